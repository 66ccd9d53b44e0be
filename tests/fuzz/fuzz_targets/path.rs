//! Path data by either fill rule.

#![no_main]

use glyphlight::outline::{FillRule, path};
use glyphlight_fuzz::{abort_on_our_panics, check_shape};
use kurbo::BezPath;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: abort_on_our_panics(), |data: &str| {
    let [non_zero, even_odd] = [FillRule::NonZero, FillRule::EvenOdd].map(|rule| path::shape(data, rule));
    let Ok(path) = BezPath::from_svg(data) else { return };
    let extent = path.control_box().width().max(path.control_box().height());
    for shape in [&non_zero, &even_odd].into_iter().flatten() {
        check_shape(shape, extent);
    }
    if let (Ok(non_zero), Ok(even_odd)) = (non_zero, even_odd) {
        let [all, odd] = [&non_zero, &even_odd].map(|s| s.area());
        assert!(odd <= all + 1e-4 * extent * extent, "even-odd encloses {odd}, non-zero {all}");
    }
});
