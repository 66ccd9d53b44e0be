"use strict";
const list = document.getElementById("cards");
const cards = [...list.children];
const search = document.getElementById("search");
const order = document.getElementById("order");
const count = document.getElementById("count");

function show() {
  const which = document.querySelector("input[name=which]:checked").value;
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const card of cards) {
    const text = card.dataset.text;
    const fits = (which === "all" || card.dataset.is.split(" ").includes(which)) && words.every((w) => text.includes(w));
    card.hidden = !fits;
    if (fits) shown += 1;
  }
  count.textContent = `${shown} of ${cards.length} shown`;
}

function sort() {
  const by = {
    number: (a, b) => a.dataset.number - b.dataset.number,
    name: (a, b) => a.dataset.name.localeCompare(b.dataset.name, undefined, { numeric: true }),
    difference: (a, b) => (b.dataset.difference || -1) - (a.dataset.difference || -1),
    curves: (a, b) => (b.dataset.curves || -1) - (a.dataset.curves || -1),
  }[order.value];
  cards.sort((a, b) => by(a, b) || a.dataset.number - b.dataset.number);
  list.append(...cards);
}

document.querySelectorAll("input[name=which]").forEach((input) => input.addEventListener("change", show));
search.addEventListener("input", show);
order.addEventListener("change", sort);
sort();
show();
