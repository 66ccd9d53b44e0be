//! SVG files; a font of a few letters is at hand.

#![no_main]

use glyphlight::outline::svg::{FontBytes, SvgOptions, svg};
use glyphlight_fuzz::{abort_on_our_panics, check_disjoint, check_shape};
use libfuzzer_sys::fuzz_target;
use std::sync::Arc;

fuzz_target!(init: abort_on_our_panics(), |data: &[u8]| {
    let letters: FontBytes = Arc::new(glyphlight_fuzz::LETTERS);
    let options = SvgOptions { size: 1.0, fonts: vec![letters], font_family: "Letters".into(), ..SvgOptions::default() };
    let Ok(art) = svg(data, "fuzzed.svg", &options) else { return };
    for layer in &art.layers {
        check_shape(&layer.shape, 1.0);
        let bounds = layer.shape.extent();
        let half = art.size * (0.5 + 1e-5);
        assert!(bounds.min.cmpge(-half).all() && bounds.max.cmple(half).all(), "{}: beyond the frame", layer.element);
        let fine = |c: f64| c.is_finite() && c >= 0.0;
        assert!(layer.color.into_iter().all(fine), "{}: colour {:?}", layer.element, layer.color);
        assert!((0.0..=1.0).contains(&layer.opacity), "{}: opacity {}", layer.element, layer.opacity);
    }
    check_disjoint(&art.layers.iter().map(|layer| &layer.shape).collect::<Vec<_>>());
});
