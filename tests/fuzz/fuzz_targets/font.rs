//! Font files and texts. An input is a byte that says how long the text is, one that says where on its axes the font stands,
//! the text, and the font.

#![no_main]

use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight_fuzz::{abort_on_our_panics, check_shape};
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: abort_on_our_panics(), |data: &[u8]| {
    let [length, place, rest @ ..] = data else { return };
    let (text, font) = rest.split_at(rest.len().min(usize::from(*length % 32)));
    let Ok(font) = Font::from_bytes("fuzzed.ttf", font.to_vec(), 0) else { return };
    let share = f32::from(*place) / 255.0;
    let axes = font.axes().iter().map(|a| (a.tag, a.min + (a.max - a.min) * share)).collect();
    let letter_spacing = if place % 2 == 0 { 0.0 } else { 0.1 };
    let style = TextStyle { axes, letter_spacing, ..TextStyle::default() };
    let Ok(text) = layout(&String::from_utf8_lossy(text), &[font], &style) else { return };
    check_shape(&text.shape, 1.0);
    assert!(text.glyphs.iter().all(|g| g.origin.is_finite()));
    assert!(text.lines.iter().all(|l| l.left.is_finite() && l.right.is_finite() && l.baseline.is_finite()));
});
