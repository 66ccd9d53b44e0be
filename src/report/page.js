"use strict";

const find = (id) => document.getElementById(id);
const frame = find("frame"), scroll = find("scroll"), canvas = find("canvas"), divider = find("divider");
const place = find("place");
const sides = ["left", "right"].map((side) => ({ image: find(side), choice: find(`${side}-choice`), name: find(`${side}-name`) }));
const [width, height] = [Number(canvas.dataset.width), Number(canvas.dataset.height)];

// The divider stands in what is seen of the picture, which may be scrolled below it.
function divide() {
  const part = Number(place.value) / Number(place.max);
  divider.style.left = `${part * 100}%`;
  const shown = scroll.scrollLeft + part * scroll.clientWidth;
  const hidden = Math.max(0, canvas.clientWidth - shown);
  sides[0].image.style.clipPath = `inset(0 ${hidden}px 0 0)`;
  place.setAttribute("aria-valuetext", `${Math.round(part * 100)} % ${sides[0].name.textContent}`);
}

function choose() {
  for (const { image, choice, name } of sides) {
    const option = choice.selectedOptions[0];
    const label = `${option.parentElement.label}: ${option.textContent}`;
    image.src = find(option.value).src;
    image.alt = label;
    name.textContent = label;
  }
  divide();
}

function zoom() {
  const value = document.querySelector("input[name=zoom]:checked").value;
  const scale = value === "fit" ? frame.clientWidth / width : Number(value);
  // The middle of what is seen stays there.
  const middle = (scroll.scrollLeft + scroll.clientWidth / 2) / (canvas.clientWidth || 1);
  const centre = (scroll.scrollTop + scroll.clientHeight / 2) / (canvas.clientHeight || 1);
  canvas.style.width = value === "fit" ? "100%" : `${width * scale}px`;
  canvas.style.aspectRatio = `${width} / ${height}`;
  canvas.classList.toggle("pixelated", scale >= 2);
  scroll.scrollLeft = middle * canvas.clientWidth - scroll.clientWidth / 2;
  scroll.scrollTop = centre * canvas.clientHeight - scroll.clientHeight / 2;
  divide();
}

function dragTo(event) {
  const box = frame.getBoundingClientRect();
  const part = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  place.value = Math.round(part * Number(place.max));
  divide();
}

function draggable(element, starts) {
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !starts(event)) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    dragTo(event);
  });
  element.addEventListener("pointermove", (event) => {
    if (element.hasPointerCapture(event.pointerId)) dragTo(event);
  });
}

// Fingers scroll the picture and drag the grip; a mouse drags anywhere.
draggable(canvas, (event) => event.pointerType === "mouse");
draggable(find("grip"), () => true);
place.addEventListener("input", divide);
scroll.addEventListener("scroll", divide);
sides.forEach(({ choice }) => choice.addEventListener("change", choose));
document.querySelectorAll("input[name=zoom]").forEach((input) => input.addEventListener("change", zoom));
find("swap").addEventListener("click", () => {
  const [left, right] = sides.map(({ choice }) => choice);
  [left.value, right.value] = [right.value, left.value];
  choose();
});
new ResizeObserver(zoom).observe(frame);

// Sorts the rows of a table by one column; cells without a value come last either way.
function sort(header) {
  const table = header.closest("table");
  const column = [...header.parentElement.children].indexOf(header);
  const order = header.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
  const sign = order === "ascending" ? 1 : -1;
  for (const other of header.parentElement.children) other.removeAttribute("aria-sort");
  header.setAttribute("aria-sort", order);
  const key = (row) => row.children[column].dataset.value;
  const compare = (a, b) => {
    const [x, y] = [key(a), key(b)];
    if (x === y) return 0;
    if (x === "" || y === "") return x === "" ? 1 : -1;
    return sign * (header.dataset.kind === "number" ? Number(x) - Number(y) : x.localeCompare(y));
  };
  table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
}
document.querySelectorAll("thead th").forEach((header) => {
  header.firstElementChild.addEventListener("click", () => sort(header));
});

choose();
zoom();
