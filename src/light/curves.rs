//! The curves of a shape as the polygonal techniques read them.

use super::Square;
use crate::kernel::curve::Curve;
use crate::shape::{CubicBez, Shape};
use glam::DVec2;

/// Handles nearer to the chord than this make a straight line: half the spacing of f32 in the emitter's square, so that
/// what is left out is less than what rounding moves.
const STRAIGHT: f64 = 1.0 / (1 << 25) as f64;

/// The curves of `shape` in the square, contour after contour.
///
/// Whether a curve is a line is decided here, in f64 and by its handles' distances from the chord: a handle that is drawn
/// back into its end or square to the chord does not make one. Curves that are a point are left out.
pub fn curves(shape: &Shape, Square { center, half }: Square) -> Vec<Curve> {
    let to_square = |p: DVec2| (p - center) / half;
    let mut curves = Vec::new();
    for curve in shape.curves() {
        let [p0, p1, p2, p3] = curve.points().map(to_square);
        let line = CubicBez::new(p0, p1, p2, p3).is_line(STRAIGHT);
        let [p0, p1, p2, p3] = [p0, p1, p2, p3].map(|p| p.as_vec2());
        let curve = if line { Curve { p0, p1: p0, p2: p3, p3 } } else { Curve { p0, p1, p2, p3 } };
        if !(line && p0 == p3) {
            curves.push(curve);
        }
    }
    curves
}
