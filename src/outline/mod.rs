//! Fonts, SVG and path data become [`Shape`]s: finite, closed, winding 0 or 1 everywhere.
//!
//! Everything that may overlap goes through [`overlap::resolve`], the only place that removes overlaps.

pub mod bundled;
pub mod document;
mod embedded;
pub mod font;
mod glyf;
mod gradient;
mod guard;
mod judge;
pub mod layers;
pub mod lyon;
pub mod overlap;
mod paint;
pub mod path;
mod shaping;
mod stroke;
pub mod svg;
mod sweep;
pub mod text;
mod walk;

use crate::shape::{CubicBez, Shape};
use glam::DVec2;
use kurbo::{BezPath, PathEl};

/// Which points a path encloses, by the names SVG gives them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FillRule {
    /// Points with a winding number other than 0.
    #[default]
    NonZero,
    /// Points with an odd winding number.
    EvenOdd,
}

impl FillRule {
    /// Whether a point with this winding number is inside.
    pub const fn is_inside(self, winding: i32) -> bool {
        match self {
            Self::NonZero => winding != 0,
            Self::EvenOdd => winding % 2 != 0,
        }
    }
}

/// Something in the input that was left out or simplified.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What it concerns: an element with its id, or a character.
    pub element: String,
    /// What was done about it.
    pub message: String,
}

/// Why an outline did not become a shape.
#[derive(Debug, thiserror::Error)]
pub enum OutlineError {
    /// Overlap removal failed.
    #[error("{what}: {source}")]
    Overlap {
        /// The glyph or element.
        what: String,
        /// The reason.
        source: overlap::OverlapError,
    },
    /// Path data is no shape.
    #[error(transparent)]
    Path(#[from] path::PathError),
    /// An SVG file gave no light.
    #[error("{name}: {source}")]
    Svg {
        /// The file.
        name: String,
        /// The reason.
        source: svg::SvgError,
    },
    /// A font or a glyph cannot be used.
    #[error(transparent)]
    Font(#[from] font::FontError),
    /// A text cannot be set.
    #[error(transparent)]
    Text(#[from] text::TextError),
}

/// The contours of `shape` as one kurbo path; straight cubics become line elements.
pub fn bez_path(shape: &Shape) -> BezPath {
    let mut path = BezPath::new();
    for contour in shape.contours() {
        let curves = contour.curves();
        path.move_to(point(curves[0].p0));
        for c in curves {
            if *c == CubicBez::line(c.p0, c.p3) {
                path.line_to(point(c.p3));
            } else {
                path.curve_to(point(c.p1), point(c.p2), point(c.p3));
            }
        }
        path.close_path();
    }
    path
}

/// The subpaths of `path` as loops of cubics: open ones are closed by a line, lines and quadratics raised,
/// zero-length curves dropped.
fn closed_loops(path: &BezPath) -> Vec<Vec<CubicBez>> {
    let mut loops = Vec::new();
    let mut current: Vec<CubicBez> = Vec::new();
    let (mut start, mut at) = (DVec2::ZERO, DVec2::ZERO);
    let mut finish = |current: &mut Vec<CubicBez>, start: DVec2, at: DVec2| {
        if at != start {
            current.push(CubicBez::line(at, start));
        }
        current.retain(|c| c.p0 != c.p3 || c.p1 != c.p0 || c.p2 != c.p0);
        if !current.is_empty() {
            loops.push(std::mem::take(current));
        }
    };
    for el in path.elements() {
        match *el {
            PathEl::MoveTo(p) => {
                finish(&mut current, start, at);
                start = vec2(p);
                at = start;
            }
            PathEl::LineTo(p) => {
                if vec2(p) != at {
                    current.push(CubicBez::line(at, vec2(p)));
                }
                at = vec2(p);
            }
            PathEl::QuadTo(c, p) => {
                current.push(CubicBez::quad(at, vec2(c), vec2(p)));
                at = vec2(p);
            }
            PathEl::CurveTo(a, b, p) => {
                current.push(CubicBez::new(at, vec2(a), vec2(b), vec2(p)));
                at = vec2(p);
            }
            PathEl::ClosePath => {
                finish(&mut current, start, at);
                at = start;
            }
        }
    }
    finish(&mut current, start, at);
    loops
}

/// The coordinates of a path element's points.
fn coordinates(el: &PathEl) -> impl Iterator<Item = f64> + use<> {
    let points = match *el {
        PathEl::MoveTo(p) | PathEl::LineTo(p) => [Some(p), None, None],
        PathEl::QuadTo(a, p) => [Some(a), Some(p), None],
        PathEl::CurveTo(a, b, p) => [Some(a), Some(b), Some(p)],
        PathEl::ClosePath => [None; 3],
    };
    points.into_iter().flatten().flat_map(|p| [p.x, p.y])
}

const fn point(p: DVec2) -> kurbo::Point {
    kurbo::Point::new(p.x, p.y)
}

const fn vec2(p: kurbo::Point) -> DVec2 {
    DVec2::new(p.x, p.y)
}
