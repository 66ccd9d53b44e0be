//! Lines of `probe integral`.

#![no_main]

use glyphlight::backend::Technique;
use glyphlight::cli::Case;
use glyphlight::outline::{FillRule, bez_path, overlap};
use glyphlight_fuzz::{abort_on_our_panics, check_shape, integral};
use libfuzzer_sys::fuzz_target;

const TECHNIQUES: [Technique; 4] =
    [Technique::Tree, Technique::Exact, Technique::Kuge { eps: None }, Technique::Uniform { segments: 6 }];

fuzz_target!(init: abort_on_our_panics(), |data: &[u8]| {
    let Ok(case) = Case::parse(data) else { return };
    // A horizontal meets a cubic three times at most, and each time the winding number changes by one.
    let most = 1.5 * case.shape.curves().count() as f64;
    for technique in TECHNIQUES {
        if let Ok((value, _)) = case.integral(&technique, 1e-5) {
            assert!((0.0..=most).contains(&value), "{technique}: {value}");
        }
    }
    let Ok(region) = overlap::resolve(&bez_path(&case.shape), FillRule::NonZero) else { return };
    check_shape(&region, case.shape.bounds().size().max_element());
    for technique in &TECHNIQUES[..2] {
        if let Some(value) = integral(&region, case.images, technique) {
            assert!((0.0..=1.001).contains(&value), "{technique}: {value}");
        }
    }
});
