//! [`Shape`] from and to lyon's paths, for callers who hold those. The only file that names lyon_path.

use super::FillRule;
use super::overlap::{self, OverlapError};
use crate::shape::{CubicBez, Shape};
use glam::DVec2;
use kurbo::BezPath;
use lyon_path::geom::Point;
use lyon_path::{Event, Path};

/// The region that `path` encloses under `rule`, free of overlap; open subpaths are closed by a line.
///
/// Coordinates are taken as light space: metres, y up (lyon itself has no view on that).
///
/// # Errors
/// Coordinates that are not finite, too many curves, or a failed overlap removal.
pub fn from_lyon(path: &Path, rule: FillRule) -> Result<Shape, OverlapError> {
    let point = |p: Point<f32>| (f64::from(p.x), f64::from(p.y));
    let mut outline = BezPath::new();
    for event in path {
        match event {
            Event::Begin { at } => outline.move_to(point(at)),
            Event::Line { to, .. } => outline.line_to(point(to)),
            Event::Quadratic { ctrl, to, .. } => outline.quad_to(point(ctrl), point(to)),
            Event::Cubic { ctrl1, ctrl2, to, .. } => outline.curve_to(point(ctrl1), point(ctrl2), point(to)),
            Event::End { .. } => outline.close_path(),
        }
    }
    overlap::resolve(&outline, rule)
}

/// The contours of `shape` as a lyon path, rounded to f32. Any fill rule fills it right.
pub fn to_lyon(shape: &Shape) -> Path {
    let point = |p: DVec2| Point::new(p.x as f32, p.y as f32);
    let mut builder = Path::builder();
    for contour in shape.contours() {
        builder.begin(point(contour.curves()[0].p0));
        for c in contour.curves() {
            if *c == CubicBez::line(c.p0, c.p3) {
                builder.line_to(point(c.p3));
            } else {
                builder.cubic_bezier_to(point(c.p1), point(c.p2), point(c.p3));
            }
        }
        builder.end(true);
    }
    builder.build()
}
