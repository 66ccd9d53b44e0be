//! The page of a comparison, opened in Chromium: the slider, zoom, tables, both widths, no error on the console.

use crate::browser::Browser;
use crate::compare::{comparison, pictures};
use serde_json::json;

/// Colour at a place of the window.
fn color_at(browser: &mut Browser, [x, y]: [f64; 2]) -> [u8; 3] {
    let shot = image::load_from_memory(&browser.screenshot(false)).unwrap().into_rgb8();
    shot.get_pixel(x as u32, y as u32).0
}

#[test]
fn the_page_works() {
    let Some(mut browser) = Browser::start() else { return };
    let comparison = comparison();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("index.html");
    std::fs::write(&file, comparison.page(&pictures(&comparison))).unwrap();
    browser.resize(1280, 900);
    browser.open(&file);

    // Left of the divider is the yardstick, right of it the worst technique: the pictures that `pictures` paints.
    let color = |i: usize| [(40 + 25 * i) as u8, (230 - 25 * i) as u8, (i * 90 % 256) as u8];
    let (exact, quad) = (color(6), color(4));
    let frame =
        browser.eval("(() => { const b = frame.getBoundingClientRect(); return [b.x, b.y, b.width, b.height] })()");
    let [x, y, width, height] = core::array::from_fn(|i| frame[i].as_f64().unwrap());
    assert!(width > 1000.0 && height > 300.0, "{frame}");
    let at = |part: f64, down: f64| [x + part * width, y + down * height];
    assert_eq!(color_at(&mut browser, at(0.45, 0.8)), exact);
    assert_eq!(color_at(&mut browser, at(0.55, 0.8)), quad);

    // By the mouse, anywhere on the picture; then by the grip; then by keys.
    browser.drag(at(0.7, 0.3), at(0.2, 0.3));
    assert!((browser.number("Number(place.value)") - 200.0).abs() <= 2.0);
    assert_eq!(color_at(&mut browser, at(0.25, 0.8)), quad, "the divider did not move");
    assert_eq!(color_at(&mut browser, at(0.15, 0.8)), exact);
    browser.drag(at(0.2, 0.5), at(0.9, 0.5));
    assert!((browser.number("Number(place.value)") - 900.0).abs() <= 2.0);
    assert_eq!(color_at(&mut browser, at(0.8, 0.8)), exact);
    browser.eval("place.focus({ preventScroll: true })");
    browser.key("ArrowLeft", 37);
    assert!((browser.number("Number(place.value)") - 899.0).abs() <= 2.0);
    browser.key("Home", 36);
    assert_eq!(browser.number("Number(place.value)"), 0.0);
    assert_eq!(color_at(&mut browser, at(0.1, 0.8)), quad);

    // Another picture on the left; the two change sides; an error map.
    browser.eval("(() => { const c = document.getElementById('left-choice'); c.value = 'errors/tree.png'; \
                  c.dispatchEvent(new Event('change')); place.value = 1000; place.dispatchEvent(new Event('input')) })()");
    assert_eq!(color_at(&mut browser, at(0.5, 0.8)), color(1));
    assert_eq!(browser.eval("document.getElementById('left-name').textContent"), json!("Integral error: tree"));
    browser.eval("document.getElementById('swap').click()");
    assert_eq!(color_at(&mut browser, at(0.5, 0.8)), quad);

    // Pixels stay pixels from twice their size on, and the divider stays in view.
    browser.eval("document.querySelector('input[value=\"8\"]').click()");
    assert_eq!(browser.number("canvas.clientWidth"), 512.0);
    assert_eq!(browser.eval("getComputedStyle(canvas.firstElementChild).imageRendering"), json!("pixelated"));
    browser.eval("document.querySelector('input[value=\"1\"]').click()");
    assert_eq!(browser.eval("getComputedStyle(canvas.firstElementChild).imageRendering"), json!("auto"));
    assert_eq!(browser.number("canvas.clientWidth"), 64.0);
    browser.eval("document.querySelector('input[value=\"fit\"]').click()");

    // The table sorts by numbers, what has none last, both ways.
    let order = "[...document.querySelectorAll('tbody tr')].map(r => r.firstElementChild.textContent).join(' ')";
    assert_eq!(browser.eval(order), json!("tree uniform:30 quad:512 exact"));
    let sort = "[...document.querySelectorAll('thead button')].find(b => b.textContent === 'RMSE').click()";
    browser.eval(sort);
    assert_eq!(browser.eval(order), json!("tree uniform:30 quad:512 exact"));
    browser.eval(sort);
    assert_eq!(browser.eval(order), json!("quad:512 uniform:30 tree exact"));
    assert_eq!(browser.eval("document.querySelectorAll('[aria-sort=descending]').length"), json!(1));

    // On a telephone: nothing is wider than the window, and the slider works.
    browser.resize(400, 800);
    assert!(browser.number("document.documentElement.scrollWidth") <= 400.0);
    browser.eval("window.scrollTo(0, 0)");
    browser.eval("place.value = 500; place.dispatchEvent(new Event('input'))");
    let top = browser.number("frame.getBoundingClientRect().y");
    let left = color_at(&mut browser, [100.0, top + 150.0]);
    assert_eq!((left, color_at(&mut browser, [300.0, top + 150.0])), (quad, color(1)));

    assert_eq!(browser.complaints, Vec::<String>::new());
    assert_eq!(browser.requests, [format!("file://{}", file.display())], "the page asks for something else");
    // The ears are open: what this page says is heard.
    browser.eval("console.error('heard'); setTimeout(() => { throw new Error('seen') }, 0)");
    browser.eval("new Promise(done => setTimeout(done, 50))");
    assert_eq!(browser.complaints.len(), 2, "{:?}", browser.complaints);
}
