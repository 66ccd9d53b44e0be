//! SVG files that mean harm, or are broken: each gives one clear error that names value and limit, and soon.

use crate::svg::options;
use glyphlight::outline::svg::svg;
use std::time::{Duration, Instant};

/// The error that `text` gives, which must come within five seconds.
fn fault(text: &[u8]) -> String {
    let start = Instant::now();
    let result = svg(text, "evil.svg", &options(1.0));
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    match result {
        Ok(art) => panic!("read as {} layers, {:?}", art.layers.len(), art.warnings),
        Err(e) => e.to_string(),
    }
}

fn names(text: &str, words: &[&str]) {
    let fault = fault(text.as_bytes());
    assert!(fault.starts_with("evil.svg: "), "{fault}");
    for word in words {
        assert!(fault.contains(word), "{word} is not in: {fault}");
    }
}

fn drawing(body: &str) -> String {
    format!(r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{body}</svg>"#)
}

#[test]
fn a_million_elements_nested_ten_thousand_deep() {
    let tower = format!("{}{}", "<g>".repeat(9_999), "</g>".repeat(9_999));
    let body = format!("{tower}{}", "<g/>".repeat(990_000));
    names(&drawing(&body), &["nested 10000 deep", "limit of 256"]);
    names(&drawing(&"<g/>".repeat(999_999)), &["1000000 elements", "limit of 250000"]);
}

#[test]
fn references_that_multiply() {
    let mut uses = String::from("<g id='n0'><rect width='9' height='9'/></g>");
    for level in 1..=9 {
        uses += &format!("<g id='n{level}'>{}</g>", format!("<use href='#n{}'/>", level - 1).repeat(10));
    }
    names(&drawing(&uses), &["elements", "limit of 250000"]);
    let chain: String = (1..10_000).map(|i| format!("<g id='c{i}'><use href='#c{}'/></g>", i - 1)).collect();
    names(&drawing(&format!("<g id='c0'/>{chain}")), &["nested", "limit of 256"]);
    let mut markers = String::new();
    for level in 0..6 {
        markers += &format!(
            "<marker id='m{level}' markerWidth='9' markerHeight='9'><path d='M0 0{}' stroke='#fff' marker-mid='url(#m{})'/></marker>",
            "L1 1L0 1".repeat(50),
            level + 1
        );
    }
    let body = format!("{markers}<path d='M0 0{}' stroke='#fff' marker-mid='url(#m0)'/>", "L9 9L0 9".repeat(50));
    names(&drawing(&body), &["elements", "limit of 250000"]);
    names(&drawing("<g id='a'><use href='#b'/></g><g id='b'><use href='#a'/></g>"), &["refers to itself"]);
    names(&drawing("<use id='a' href='#a'/>"), &["use \"a\"", "refers to itself"]);
    names(&drawing("<clipPath id='c' clip-path='url(#c)'/>"), &["clipPath \"c\"", "refers to itself"]);
}

#[test]
fn entities_that_multiply() {
    let laughs =
        "<!DOCTYPE svg [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\">]><svg><text>&b;</text></svg>";
    names(laughs, &["entity \"b\""]);
    names("<!DOCTYPE svg [<!ENTITY e \"<g><g>\">]><svg>&e;</svg>", &["entity \"e\""]);
    names("<!DOCTYPE svg [<!ENTITY x SYSTEM \"file:///etc/passwd\">]><svg><text>&x;</text></svg>", &["entity \"x\""]);
    names("<!DOCTYPE svg [<!ENTITY % p \"x\">]><svg/>", &["entity \"%\""]);
    let long = format!(
        "<!DOCTYPE svg [<!ENTITY a \"{}\">]><svg><text>{}</text></svg>",
        "x".repeat(9_999),
        "&a;".repeat(9_999)
    );
    names(&long, &["bytes", "limit of 67108864"]);
}

#[test]
fn nothing_outside_is_read() {
    for body in [
        "<image id='i' href='photo.png' width='9' height='9'/>",
        "<image id='i' href='file:///etc/passwd' width='9' height='9'/>",
        "<image id='i' href='https://example.com/a.png' width='9' height='9'/>",
        "<image id='i' xmlns:xlink='http://www.w3.org/1999/xlink' xlink:href='../up.svg' width='9' height='9'/>",
        "<use id='i' href='other.svg#x'/>",
        "<rect id='i' width='9' height='9' fill='url(other.svg#g)'/>",
        "<rect id='i' width='9' height='9' style='fill:url(\"http://example.com/#g\")'/>",
        "<filter><feImage id='i' href='a.png'/></filter>",
    ] {
        names(&drawing(&format!("<rect width='50' height='50' fill='#fff'/>{body}")), &["\"i\"", "outside"]);
    }
    // A link is no picture.
    let linked = drawing("<a href='https://example.com'><rect width='50' height='50' fill='#fff'/></a>");
    assert!(svg(linked.as_bytes(), "t", &options(1.0)).is_ok());
}

#[test]
fn broken_numbers() {
    names(&drawing("<path id='p' d='M0 0L10 NaN 5 5Z'/>"), &["path \"p\"", "position 9"]);
    names(&drawing("\n<path d='M0 0L10 1e999 5 5Z'/>"), &["path (line 2)", "position"]);
    names(&drawing("<path id='p' d='M0 0L1e35 0 5 5Z'/>"), &["path \"p\"", "larger than"]);
    names(&drawing("<rect id='r' width='NaN' height='5'/>"), &["rect \"r\"", "width=\"NaN\""]);
    names(&drawing("<rect id='r' style='stroke-width:inf' height='5'/>"), &["rect \"r\"", "style"]);
    names(&drawing("<g id='g' transform='rotate(NaN)'/>"), &["g \"g\"", "rotate(NaN)"]);
    names(&drawing("<polygon id='y' points='0 0 5 x 5 5'/>"), &["polygon \"y\"", "points"]);
}

#[test]
fn files_that_are_no_drawing() {
    assert!(fault(b"").contains("not an SVG"));
    assert!(fault(b"hello").contains("not an SVG"));
    assert!(fault(b"<html/>").contains("not an SVG"));
    assert!(fault(b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'><rect").contains("not an SVG"));
    assert!(fault(b"<svg>\xff</svg>").contains("byte 5"));
    assert!(fault(&[0x1f, 0x8b, 8, 0]).contains("svgz"));
    let large = vec![b' '; (64 << 20) + 1];
    assert!(fault(&large).contains("67108865 bytes, more than the limit of 67108864"));
    names(&drawing(""), &["nothing is visible"]);
    names(&drawing("<rect width='9' height='9' display='none' fill='#fff'/>"), &["nothing is visible"]);
    names(&drawing("<rect x='200' width='9' height='9' fill='#fff'/>"), &["nothing is visible"]);
    names(&drawing("<line x1='0' x2='9' y1='0' y2='9'/>"), &["nothing is visible"]);
    names(
        "<svg xmlns='http://www.w3.org/2000/svg' width='0' height='5'><rect width='9' height='9'/></svg>",
        &["not an SVG"],
    );
    let square = drawing("<rect width='9' height='9' fill='#fff'/>");
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(svg(square.as_bytes(), "t", &options(size)).unwrap_err().to_string().contains("size"));
    }
}

#[test]
fn drawings_that_take_too_long() {
    names(
        &drawing("<path id='d' d='M0 0H100' stroke='#fff' stroke-dasharray='.0001'/>"),
        &["path \"d\"", "dashes", "limit of 50000"],
    );
    let side = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / f64::from(1 << 24) * 100.0;
    let chords: String = (0..9_000).map(|k| format!("L{:.3} {:.3}", side(2 * k), side(2 * k + 1))).collect();
    names(
        &drawing(&format!("<path id='h' fill='#fff' d='M0 0{chords}Z'/>")),
        &["path \"h\"", "cross each other", "limit"],
    );
    let many: String = (0..210_000).map(|k| format!("L{} {}", k % 640, k / 640)).collect();
    names(
        &drawing(&format!("<path id='m' fill='#fff' d='M0 0{many}Z'/>")),
        &["path \"m\"", "curves", "limit of 200000"],
    );
}
