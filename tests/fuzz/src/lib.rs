//! What every fuzz target asserts, beyond that nothing panics, hangs or eats the memory.

use glam::{DAffine2, DVec2, DVec3};
use glyphlight::backend::Technique;
use glyphlight::backend::emitter::Emitter;
use glyphlight::backend::gather::Images;
use glyphlight::kernel::tree::Budget;
use glyphlight::outline::{FillRule, path};
use glyphlight::shape::{Bounds, CubicBez, Shape};

/// A font of the letters `abO&`.
pub const LETTERS: &[u8] = include_bytes!("../seeds/letters.ttf");
/// Horizontals along which a shape is scanned.
const LINES: u32 = 48;
/// Part of the extent on which a shape may wind otherwise than 0 or 1 along a horizontal: ten times what the library lets pass.
const STRAY: f64 = 1e-4;

/// Makes a panic of our own code abort even where the library would catch it: it catches those of other libraries.
pub fn abort_on_our_panics() {
    // The library's own hook is set by the first work that it guards; ours must come after it.
    assert!(path::shape("M0 0H1V1Z", FillRule::NonZero).is_ok());
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let ours =
            info.location().is_some_and(|l| !l.file().contains("/registry/") && !l.file().starts_with("/rustc/"));
        if ours {
            eprintln!("panic of our own: {info}\n{}", std::backtrace::Backtrace::force_capture());
            std::process::abort();
        }
        print(info);
    }));
}

/// The shape is closed and finite, winds 0 or 1, has the area it says, and a tree whose integral is a form factor.
///
/// `source` is the size of what it was made from: of that size is what the library may drop.
pub fn check_shape(shape: &Shape, source: f64) {
    let contours = shape.contours().iter().map(|c| c.curves().to_vec()).collect();
    assert!(Shape::from_contours(contours).is_ok_and(|s| s == *shape), "not closed and finite");
    if shape.is_empty() {
        return;
    }
    check_winding(shape, source);
    check_integral(shape);
}

/// Along horizontals: winding 0 or 1, and an area that is theirs.
fn check_winding(shape: &Shape, source: f64) {
    let bounds = shape.extent();
    let size = bounds.size();
    let extent = size.max_element();
    assert!(extent.is_finite() && extent > 0.0, "extent {extent}");
    // Far from the origin coordinates are coarse.
    let coarse = 8.0 * f64::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
    let allowed = (STRAY * extent).max(1e-5 * source) + coarse;
    let beside = (1.7e-5 * extent).max(8e-6 * source);
    let step = size.y / f64::from(LINES);
    let mut area = 0.0;
    for k in 0..LINES {
        let y = bounds.min.y + step * (f64::from(k) + 0.5);
        area += step * scan(shape, y).0;
        let stray = [0.0, 1.0, -1.3].map(|shift| scan(shape, y + shift * beside).1);
        // Beside an edge that grazes the line much may be astray, or on one line of three.
        let least = stray.into_iter().fold(f64::INFINITY, f64::min);
        assert!(least <= allowed, "winds otherwise than 0 or 1 on {least} of {extent} at y = {y}");
    }
    // Midpoint rule: off by the step times half the variation of the width, which the control polygons bound.
    let variation: f64 = shape.curves().map(variation).sum();
    let (found, bound) = (shape.area(), step * variation + (1e-9 * extent + coarse) * extent);
    assert!((found - area).abs() <= bound, "area {found}, by scan lines {area} ± {bound}");
    assert!(found >= -1e-4 * extent * extent, "area {found} of extent {extent}");
}

fn variation(c: &CubicBez) -> f64 {
    let [a, p, q, d] = c.points().map(|p| p.x);
    (p - a).abs() + (q - p).abs() + (d - q).abs()
}

/// Along the horizontal through `y`: the integral of the winding number, and how much of the line winds otherwise than 0 or 1.
fn scan(shape: &Shape, y: f64) -> (f64, f64) {
    let mut crossings = Vec::new();
    shape.curves().for_each(|c| c.crossings(y, |x, direction| crossings.push((x, direction))));
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut winding, mut inside, mut stray) = (0, 0.0, 0.0);
    let mut last = 0.0;
    for (x, direction) in crossings {
        let width: f64 = x - last;
        if winding != 0 {
            inside += f64::from(winding) * width;
            stray += if winding == 1 { 0.0 } else { width };
        }
        winding -= direction;
        last = x;
    }
    assert_eq!(winding, 0, "the crossings at y = {y} do not cancel");
    (inside, stray)
}

/// The light as seen from half its extent in front of it, by the tree: a form factor, and that of the yardstick.
fn check_integral(shape: &Shape) {
    let Bounds { min, max } = shape.extent();
    let extent = (max - min).max_element();
    let shape = shape.transformed(DAffine2::from_translation(-(min + max) * 0.5));
    // The light faces the point: what is its left is the point's right.
    let images = [DVec3::NEG_X / extent, DVec3::Y / extent, DVec3::Z * 0.5];
    let values = [Technique::Tree, Technique::Exact].map(|technique| integral(&shape, images, &technique));
    let [Some(tree), Some(exact)] = values else { return };
    assert!((-1e-3..=1.001).contains(&exact), "form factor {exact} by the yardstick");
    assert!((tree - exact).abs() <= 1e-3, "form factor {tree} by the tree, {exact} by the yardstick");
}

/// The clamped-cosine integral over the shape whose axes and origin have these images; `None` where it is no region.
pub fn integral(shape: &Shape, images: [DVec3; 3], technique: &Technique) -> Option<f64> {
    let emitter = Emitter::of_shape(shape.clone(), technique).ok()?;
    let gathered = Images::in_cosine_space(images).integral(&emitter, None, 1e-5, &mut Budget::default());
    let value = gathered.map_or(0.0, |g| g.value.x);
    assert!(value.is_finite(), "{technique}: {value}");
    Some(value)
}

/// No point is in two of the shapes: asked at points strewn over the boxes of each.
pub fn check_disjoint(shapes: &[&Shape]) {
    for (i, shape) in shapes.iter().enumerate() {
        let Bounds { min, max } = shape.extent();
        let extent = (max - min).max_element();
        for p in strewn(min, max, 24) {
            let inside = |shape: &Shape, p: DVec2| shape.winding(p) == 1;
            let both = |p: DVec2| shapes[..i].iter().any(|other| inside(other, p)) && inside(shape, p);
            assert!(!beside(p, extent).into_iter().all(both), "two layers at {p}");
        }
    }
}

/// `count` points of the box, evenly strewn (the R2 sequence, Roberts 2018).
pub fn strewn(min: DVec2, max: DVec2, count: u32) -> impl Iterator<Item = DVec2> {
    const R2: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    (0..count).map(move |k| min + (max - min) * (R2 * f64::from(k) + 0.5).fract())
}

/// A point and four beside it: what holds at all of them is no matter of rounding at an edge.
pub fn beside(p: DVec2, extent: f64) -> [DVec2; 5] {
    let d = 1e-4 * extent;
    [(0.0, 0.0), (1.0, 0.3), (-0.9, 0.4), (0.2, -1.1), (-0.3, 0.8)].map(|(x, y)| p + DVec2::new(x, y) * d)
}
