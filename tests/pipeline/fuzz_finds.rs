//! What the fuzz targets (tests/fuzz) found, each as plain bytes.

use glam::DVec2;
use glyphlight::backend::Technique;
use glyphlight::cli::Case;
use glyphlight::outline::FillRule;
use glyphlight::outline::font::{Font, FontError};
use glyphlight::outline::path;
use glyphlight::outline::text::{TextError, TextStyle, layout};

/// A font of the letters `g` and `V`, in CFF2.
const LETTERS: &[u8] = include_bytes!("../fuzz/seeds/font/cff2");
/// Where the font begins: what stands before is the text.
const FONT: usize = 4;

/// Sets `text` in the letters with one byte of the file changed.
fn set_with(at: usize, byte: u8) -> Result<f64, TextError> {
    let mut bytes = LETTERS.to_vec();
    bytes[at] = byte;
    let font = Font::from_bytes("found.otf", bytes.split_off(FONT), 0)?;
    Ok(layout("Vg", &[font], &TextStyle::default())?.shape.area())
}

/// A charstring that pops what it has not pushed: the outline reader panicked.
#[test]
fn a_charstring_that_pops_nothing() {
    let Err(TextError::Font(FontError::Glyph { reason, .. })) = set_with(897, 16) else { panic!("it is set") };
    assert!(reason.starts_with("is malformed: "), "{reason}");
    assert!(set_with(897, LETTERS[897]).unwrap() > 0.0);
}

/// Curves that leave a point side by side and cross soon: the crossing was missed, and the wedge between them wound −1.
#[test]
fn a_crossing_beside_a_joint() {
    let data = "M.936329-.0239965C0 .266063.418421.518162.117317.744304C-7.28646.473662 70.403777.20302-.664324-.0676214\
                C-.6-.572491.641899-.2236.936329-.0239965Z";
    let shape = path::shape(data, FillRule::NonZero).unwrap();
    let windings = [0.1, 0.166, 0.3].map(|x| shape.winding(DVec2::new(x, 0.666)));
    assert_eq!(windings, [0, 1, 0]);
}

/// A sliver thinner than 1e-6 of the path's size but long along a horizontal: it was dropped, and what was left refused.
#[test]
fn a_sliver_along_a_horizontal() {
    let area = |data: &str| path::shape(data, FillRule::NonZero).unwrap().area();
    let (square, sliver) = ("M0 0H30000V-30000H0Z", "M1 2L33334 6H33425Z");
    let with = area(&format!("{square}{sliver}"));
    assert!((with - area(square) - 182.0).abs() < 1e-3, "{with}");
    assert!((area(sliver) - 182.0).abs() < 1e-3);
}

/// A path a thousand times as high as all that it encloses, by a spike without area: the judge's horizontals lay so far apart that
/// it saw nothing wrong in a part that wound −1.
#[test]
fn a_spike_above_small_regions() {
    let data = "M0 0 40 1T 0 1 4 0e8h-02 H1 3V2 1V2V31 3-2 33335 7z";
    let shape = path::shape(data, FillRule::EvenOdd).unwrap();
    let windings = [(-3.0, 0.218), (1.0, 0.218), (5.0, 0.218), (2.0, 3.0), (1.0, 3.0)].map(|p| shape.winding(p.into()));
    assert_eq!(windings, [1, 0, 1, 1, 0]);
}

/// An edge no longer than its distance, of a light 1e13 times as large: 1/(|a|·|b|) left f32, and the integral was lost.
#[test]
fn a_light_that_is_touched() {
    // A triangle whose corner of 45° is before the point; its first edge goes on where it ends.
    let corners = [[0.0, 0.0], [1.0, 0.0], [1e13, 0.0], [1e13, 1e13]];
    let values = |distance: f64| {
        let edge = |i: usize| {
            let [a, b] = [corners[i], corners[(i + 1) % 4]];
            let third = |s: f64| [a[0] + (b[0] - a[0]) * s, a[1] + (b[1] - a[1]) * s];
            [a, third(1.0 / 3.0), third(2.0 / 3.0), b]
        };
        let curves: Vec<_> = (0..4).map(edge).collect();
        let line = serde_json::json!({
            "id": 0, "curves": curves, "c0": [-1.0, 0.0, 0.0], "c1": [0.0, 1.0, 0.0], "c2": [0.0, 0.0, distance],
        });
        let case = Case::parse(line.to_string().as_bytes()).unwrap();
        [Technique::Tree, Technique::Exact].map(|technique| case.integral(&technique, 1e-5).unwrap().0)
    };
    for value in values(1.0) {
        assert!((value - 0.125).abs() < 1e-6, "{value}");
    }
    let away = values(1e13);
    assert!(away[0] < 0.1 && (away[0] - away[1]).abs() < 1e-5, "{away:?}");
}
