//! Shapes: overlap removal, orientation, winding, and the areas of masks.

use crate::mask::disagreement;
use glam::{DAffine2, DVec2};
use glyphlight::outline::FillRule::{self, EvenOdd, NonZero};
use glyphlight::outline::overlap::{self, OverlapError};
use glyphlight::shape::{CubicBez, Shape};
use kurbo::{Affine, BezPath};

/// Paths that overlap, touch, cross and nest in every way that trips boolean libraries.
const PATHS: &[(&str, &str)] = &[
    ("square", "M0 0H1V1H0Z"),
    ("square, clockwise", "M0 0V1H1V0Z"),
    ("square, open", "M0 0H1V1H0"),
    ("bow tie", "M0 0L1 1V0L0 1Z"),
    ("pentagram", "M0 1L0.588 -0.809L-0.951 0.309H0.951L-0.588 -0.809Z"),
    ("two squares", "M0 0H2V2H0ZM1 1H3V3H1Z"),
    ("two squares, opposed", "M0 0H2V2H0ZM1 1V3H3V1Z"),
    ("shared edge", "M0 0H1V1H0ZM1 0H2V1H1Z"),
    ("shared edge, partly", "M0 0H1V1H0ZM1 0.3H2V1.7H1Z"),
    ("the same twice", "M0 0H1V1H0ZM0 0H1V1H0Z"),
    ("nested four deep", "M0 0H8V8H0ZM1 1H7V7H1ZM2 2H6V6H2ZM3 3H5V5H3Z"),
    ("hole touching the rim", "M0 0H4V4H0ZM2 0L1 2H3Z"),
    ("corner to corner", "M0 0H1V1H0ZM1 1H2V2H1Z"),
    ("figure of eight", "M0 0C2 2 2 -2 0 0C-2 2 -2 -2 0 0Z"),
    ("loop in one cubic", "M0 0C3 2 -2 2 1 0Z"),
    ("cusp", "M0 0C2 2 -1 2 1 0Z"),
    ("teardrop", "M0 0C1.5 1.5 -1.5 1.5 0 0Z"),
    ("retracted handles", "M0 0C0 0 1 1 1 0C1 0 0 -1 0 0Z"),
    ("spike and back", "M0 0H1V1H0.5V3V1H0Z"),
    ("circle of quads", "M1 0Q1 .5 .7 .7Q.5 1 0 1Q-1 1 -1 0Q-1 -1 0 -1Q1 -1 1 0Z"),
    (
        "overlapping lenses",
        "M0 0C0 1 2 1 2 0C2 -1 0 -1 0 0ZM1 0C1 1 3 1 3 0C3 -1 1 -1 1 0ZM.5 .1C.5 .5 2.5 .5 2.5 .1C2.5 -.6 .5 -.6 .5 .1Z",
    ),
    ("wide and flat", "M0 0H30V.5H0ZM12 -3L18 3.5H15Z"),
    (
        "tangent circles",
        "M1 0C1 .5523 .5523 1 0 1C-.5523 1 -1 .5523 -1 0C-1 -.5523 -.5523 -1 0 -1C.5523 -1 1 -.5523 1 0ZM3 0C3 .5523 2.5523 1 2 1C1.4477 1 1 .5523 1 0C1 -.5523 1.4477 -1 2 -1C2.5523 -1 3 -.5523 3 0Z",
    ),
];

fn parse(d: &str) -> BezPath {
    BezPath::from_svg(d).expect("a test path parses")
}

fn resolved(d: &str, rule: FillRule) -> Shape {
    overlap::resolve(&parse(d), rule).expect("a test path resolves")
}

#[test]
fn resolved_paths_agree_with_masks() {
    for (name, d) in PATHS {
        for rule in [NonZero, EvenOdd] {
            let shape = resolved(d, rule);
            assert_eq!(disagreement(&shape, &parse(d), rule, 7), None, "{name} {rule:?}");
            for c in shape.contours() {
                assert!(c.signed_area() != 0.0, "{name} {rule:?}: {c:?}");
            }
        }
    }
}

#[test]
fn the_mask_oracle_refuses_wrong_shapes() {
    let d = "M0 0H8V8H0ZM1 1H7V7H1Z";
    let right = resolved(d, EvenOdd);
    let wrong = |shape: &Shape, rule| disagreement(shape, &parse(d), rule, 7).is_some();
    assert!(!wrong(&right, EvenOdd));
    assert!(wrong(&right, NonZero), "fill rule");
    assert!(wrong(&right.transformed(DAffine2::from_scale(DVec2::splat(1.002))), EvenOdd), "area");
    // The same area at another place is what an area alone does not see.
    assert!(wrong(&right.transformed(DAffine2::from_translation(DVec2::new(0.2, 0.0))), EvenOdd), "winding");
    let twice = [right.clone(), right].into_iter().fold(Shape::default(), |mut all, s| {
        all.append(s);
        all
    });
    assert!(wrong(&twice, EvenOdd), "doubled");
}

#[test]
fn scale_and_place_do_not_matter() {
    let place = DVec2::new(3.0, -7.0);
    for (name, d) in PATHS {
        let unit = resolved(d, NonZero);
        for scale in [1e-4, 3.7e-3, 41.0, 1e4] {
            let map = Affine::translate((place.x * scale * 100.0, place.y * scale * 100.0)) * Affine::scale(scale);
            let shape = overlap::resolve(&(map * parse(d)), NonZero).expect(name);
            let (area, expected) = (shape.area(), unit.area() * scale * scale);
            assert!((area - expected).abs() <= 1e-7 * expected, "{name} × {scale}: {area}, {expected}");
            assert_eq!(shape.contours().len(), unit.contours().len(), "{name} × {scale}");
        }
    }
}

#[test]
fn lines_stay_lines_and_curves_stay_curves() {
    for (name, d) in PATHS {
        let shape = resolved(d, NonZero);
        let curved = d.contains(['C', 'Q']);
        let lines = shape.curves().filter(|c| **c == CubicBez::line(c.p0, c.p3)).count();
        assert_eq!(lines == shape.curves().count(), !curved, "{name}");
        // Nothing is chopped up: a handful of crossings adds a handful of curves.
        assert!(shape.curves().count() <= 30, "{name}: {} curves", shape.curves().count());
    }
    let quads = resolved("M0 0Q1 3 2 0Z", NonZero);
    let area: f64 = quads.area();
    assert!((area.abs() - 2.0).abs() < 1e-12, "{area}");
}

#[test]
fn outer_contours_run_counter_clockwise_and_holes_clockwise() {
    let shape = resolved("M0 0H8V8H0ZM1 1H7V7H1ZM2 2H6V6H2Z", EvenOdd);
    let mut areas: Vec<_> = shape.contours().iter().map(|c| c.signed_area()).collect();
    areas.sort_by(f64::total_cmp);
    assert_eq!(areas, [-36.0, 16.0, 64.0]);
}

#[test]
fn set_operations_add_up() {
    let a = resolved("M0 0C0 1 2 1 2 0C2 -1 0 -1 0 0ZM.8 0L1 .2L1.2 0L1 -.2Z", EvenOdd);
    let b = resolved("M1 0C1 1 3 1 3 0C3 -1 1 -1 1 0Z", NonZero);
    let both = overlap::intersection(&a, &b).expect("intersects").area();
    let either = overlap::union(&a, &b).expect("unites").area();
    let only = overlap::difference(&a, &b).expect("subtracts").area();
    assert!(both > 0.3 && only > 0.3, "{both} {only}");
    assert!((a.area() - both - only).abs() < 1e-8, "{} {both} {only}", a.area());
    assert!((a.area() + b.area() - both - either).abs() < 1e-8);
    assert_eq!(overlap::difference(&a, &a).expect("subtracts"), Shape::default());
    assert!(overlap::intersection(&a, &Shape::default()).expect("intersects").is_empty());
}

#[test]
fn non_finite_and_oversized_paths_are_errors() {
    let mut path = parse("M0 0H1V1Z");
    path.line_to((f64::NAN, 0.0));
    match overlap::resolve(&path, NonZero) {
        Err(OverlapError::NotFinite { element: 4, value }) => assert!(value.is_nan()),
        other => panic!("{other:?}"),
    }
    let mut path = parse("M0 0H1V1Z");
    path.line_to((0.0, f64::INFINITY));
    assert_eq!(overlap::resolve(&path, NonZero), Err(OverlapError::NotFinite { element: 4, value: f64::INFINITY }));

    let mut many = BezPath::new();
    many.move_to((0.0, 0.0));
    (0..overlap::MAX_CURVES + 9).for_each(|i| many.line_to(((i % 640) as f64, (i / 640) as f64)));
    match overlap::resolve(&many, NonZero) {
        Err(OverlapError::TooManyCurves { count, limit }) => assert!(count > limit && limit == overlap::MAX_CURVES),
        other => panic!("{other:?}"),
    }
    // 10 000 chords of a square: some 10⁷ crossings.
    let mut chords = BezPath::new();
    let side = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / f64::from(1 << 24);
    chords.move_to((0.0, 0.0));
    (0..10_000).for_each(|k| chords.line_to((side(2 * k), side(2 * k + 1))));
    assert!(matches!(overlap::resolve(&chords, NonZero), Err(OverlapError::TooManyCrossings { .. })));
}

#[test]
fn winding_is_robust_through_vertices_and_extrema() {
    let diamond = resolved("M0 -1L1 0L0 1L-1 0Z", NonZero);
    for (x, inside) in [(-1.5, 0), (-0.5, 1), (0.0, 1), (0.5, 1), (1.5, 0)] {
        assert_eq!(diamond.winding(DVec2::new(x, 0.0)), inside, "{x}");
    }
    for y in [-1.0, 1.0] {
        assert_eq!(diamond.winding(DVec2::new(-0.5, y)), 0);
        assert_eq!(diamond.winding(DVec2::new(0.5, y)), 0);
    }
    let ring = resolved("M0 0H4V4H0ZM1 1H3V3H1Z", EvenOdd);
    assert_eq!(ring.winding(DVec2::new(2.0, 2.0)), 0);
    assert_eq!(ring.winding(DVec2::new(0.5, 1.0)), 1);
    assert_eq!(ring.winding(DVec2::new(2.0, 1.0 - 1e-12)), 1);
    assert_eq!(ring.winding(DVec2::new(2.0, 1.0 + 1e-12)), 0);
}
