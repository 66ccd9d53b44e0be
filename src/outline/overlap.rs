//! Overlap removal: paths that may cross themselves become [`Shape`]s.
//!
//! `sweep.rs` asks linesweeper, which keeps Béziers but is early beta, so nothing it says is taken on trust:
//!
//! 1. The input is scaled by a power of two (exact) to about a thousand units, and moved only if it lies far from
//!    the origin, so art of 1e-4 m and 1e4 m meets the same numbers.
//! 2. It runs in a thread of its own with a deadline; a panic or an endless loop there becomes an error here.
//! 3. The result is judged by code that shares nothing with it (`judge.rs`). A refused or failed attempt is
//!    repeated with the plane turned and other tolerances.

use super::guard::{GuardError, guarded};
use super::judge::{Disagreement, judge};
use super::sweep::{self, Attempt, Sets};
use super::{FillRule, closed_loops, coordinates};
use crate::shape::{Bounds, CubicBez, Shape, ShapeError};
use glam::DVec2;
use kurbo::BezPath;
use std::sync::Arc;
use std::time::Duration;

/// Most curves one overlap removal takes.
pub const MAX_CURVES: usize = 200_000;
/// Most crossings of curves with curves one overlap removal takes.
pub const MAX_CROSSINGS: usize = 500_000;
/// Seconds after which an overlap removal is given up.
pub const DEADLINE_SECONDS: u64 = 60;
/// Bytes of stack for the boolean library.
const STACK: usize = 8 << 20;

/// Why overlaps could not be removed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OverlapError {
    /// A coordinate is NaN, infinite or beyond 1e150.
    #[error("path element {element}: coordinate {value:?} is not finite")]
    NotFinite {
        /// Index of the path element.
        element: usize,
        /// The coordinate.
        value: f64,
    },
    /// More curves than [`MAX_CURVES`].
    #[error("{count} curves, more than the limit of {limit}")]
    TooManyCurves {
        /// Curves in the path.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// More crossings than [`MAX_CROSSINGS`].
    #[error("curves cross each other about {count} times, more than the limit of {limit}")]
    TooManyCrossings {
        /// Estimated number of crossings.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// The deadline passed.
    #[error("removing overlaps from {curves} curves took longer than the limit of {limit} s")]
    TimedOut {
        /// Curves in the path.
        curves: usize,
        /// The limit in seconds.
        limit: u64,
    },
    /// The boolean library failed or its result was refused, in every attempt.
    #[error("overlaps of {curves} curves could not be removed: {reason}")]
    Refused {
        /// Curves in the path.
        curves: usize,
        /// What was wrong with the last attempt.
        reason: String,
    },
    /// The result is no shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// The region that `path` encloses under `rule`, free of overlap. Subpaths left open are closed by a line.
/// The result may be empty. Curves that nothing
/// cuts stay as they are, bit for bit; crossings are right to about 1e-12 of the path's size. What is thinner than 1e-6
/// of that size may be dropped.
pub fn resolve(path: &BezPath, rule: FillRule) -> Result<Shape, OverlapError> {
    combine(path, &BezPath::new(), Rule { fill: rule, set: Set::Union })
}

/// The points in `a` or `b`.
pub fn union(a: &Shape, b: &Shape) -> Result<Shape, OverlapError> {
    of_shapes(a, b, Set::Union)
}

/// The points in both `a` and `b`.
pub fn intersection(a: &Shape, b: &Shape) -> Result<Shape, OverlapError> {
    of_shapes(a, b, Set::Intersection)
}

/// The points in `a` and not in `b`.
pub fn difference(a: &Shape, b: &Shape) -> Result<Shape, OverlapError> {
    of_shapes(a, b, Set::Difference)
}

fn of_shapes(a: &Shape, b: &Shape, set: Set) -> Result<Shape, OverlapError> {
    combine(&super::bez_path(a), &super::bez_path(b), Rule { fill: FillRule::NonZero, set })
}

#[derive(Clone, Copy)]
enum Set {
    Union,
    Intersection,
    Difference,
}

/// Which pairs of winding numbers are inside.
#[derive(Clone, Copy)]
struct Rule {
    fill: FillRule,
    set: Set,
}

impl Rule {
    const fn is_inside(self, a: i32, b: i32) -> bool {
        let (a, b) = (self.fill.is_inside(a), self.fill.is_inside(b));
        match self.set {
            Set::Union => a || b,
            Set::Intersection => a && b,
            Set::Difference => a && !b,
        }
    }
}

/// Half the extent of the working space is between this and its double.
const WORKING_HALF_EXTENT: f64 = 512.0;
/// Distance in working space below which curves count as touching: 1e-10 of the extent.
const CLOSENESS: f64 = 1e-7;
/// Contours whose mean width in working space is less, 1e-6 of the extent, are dropped if that does not show: edges that nearly coincide.
const SLIVER: f64 = 1e-3;
/// The same for what shows: 1e-10 of the extent.
const HAIR: f64 = 1e-7;
/// Handles this close to the chord, in working space, are rounding: 1e-13 of the extent.
const STRAIGHT: f64 = 1e-10;
/// The ways in which the boolean library is asked until a result holds, and the part of the extent by which the
/// result may then differ from the path along a horizontal.
const ATTEMPTS: [(Attempt, f64); 5] = [
    (Attempt { closeness: CLOSENESS, angle: 0.0, flatness: 0.3 }, 1e-6),
    (Attempt { closeness: CLOSENESS, angle: 0.739, flatness: 0.1 }, 1e-6),
    (Attempt { closeness: 1e2 * CLOSENESS, angle: 2.173, flatness: 0.1 }, 1e-6),
    (Attempt { closeness: 1e-2 * CLOSENESS, angle: 1.234, flatness: 0.03 }, 1e-5),
    (Attempt { closeness: CLOSENESS, angle: 2.9, flatness: 0.1 }, 1e-5),
];

fn combine(a: &BezPath, b: &BezPath, rule: Rule) -> Result<Shape, OverlapError> {
    for (element, el) in a.elements().iter().chain(b.elements()).enumerate() {
        if let Some(value) = coordinates(el).find(|v| v.is_nan() || v.abs() > 1e150) {
            return Err(OverlapError::NotFinite { element, value });
        }
    }
    let count = a.elements().len() + b.elements().len();
    if count > 2 * MAX_CURVES {
        return Err(OverlapError::TooManyCurves { count, limit: MAX_CURVES });
    }
    let mut sets = [closed_loops(a), closed_loops(b)];
    let bounds = Bounds::of(sets.iter().flatten().flatten().flat_map(CubicBez::points));
    let half = bounds.size().max_element() * 0.5;
    if half.is_nan() || half <= 0.0 {
        return Ok(Shape::default());
    }
    let curves = sets.iter().flatten().map(Vec::len).sum();
    if curves > MAX_CURVES {
        return Err(OverlapError::TooManyCurves { count: curves, limit: MAX_CURVES });
    }
    let frame = Frame::around(bounds);
    for curve in sets.iter_mut().flatten().flatten() {
        *curve = frame.enter(curve);
        if curve.is_line(STRAIGHT) {
            *curve = CubicBez::line(curve.p0, curve.p3);
        }
    }
    let crossings = estimated_crossings(&sets);
    if crossings > MAX_CROSSINGS {
        return Err(OverlapError::TooManyCrossings { count: crossings, limit: MAX_CROSSINGS });
    }
    let sets = Arc::new(sets);
    let limit = DEADLINE_SECONDS.min(2 + curves as u64 / 50);
    let mut reason = String::new();
    for (attempt, agreement) in ATTEMPTS {
        let shared = Arc::clone(&sets);
        let work = move || sweep::boundary(&shared, &attempt, |a, b| rule.is_inside(a, b));
        let loops = match guarded("overlap", STACK, Duration::from_secs(limit), work) {
            Ok(Ok(loops)) => loops,
            Ok(Err(message)) | Err(GuardError::Failed(message)) => {
                reason = format!("the boolean library failed: {message}");
                continue;
            }
            Err(GuardError::TimedOut) if curves > 1000 => return Err(OverlapError::TimedOut { curves, limit }),
            Err(GuardError::TimedOut) => {
                reason = format!("it took longer than the limit of {limit} s");
                continue;
            }
        };
        let judged = |width: f64| {
            let kept: Vec<_> = loops.iter().filter(|curves| !is_sliver(curves, width)).cloned().collect();
            judge(&sets, &kept, |a, b| rule.is_inside(a, b), agreement).map(|()| kept)
        };
        // Along a horizontal a sliver may be long, and a loop with a long spike is none: with them it may be right.
        match judged(SLIVER).or_else(|e| judged(HAIR).map_err(|_| e)) {
            Ok(loops) => {
                let leave = |curves: Vec<CubicBez>| curves.iter().map(|c| frame.leave(c)).collect();
                return Ok(Shape::from_contours(loops.into_iter().map(leave).collect())?);
            }
            Err(Disagreement { y, found, expected }) => {
                let y = frame.leave_point(DVec2::new(0.0, y)).y;
                reason =
                    format!("at y = {y} the result covers {found:.6} of the width where the path covers {expected:.6}");
            }
        }
    }
    Err(OverlapError::Refused { curves, reason })
}

/// Whether a loop's mean width is less than `width`.
fn is_sliver(curves: &[CubicBez], width: f64) -> bool {
    let length: f64 = curves.iter().map(|c| c.p0.distance(c.p1) + c.p1.distance(c.p2) + c.p2.distance(c.p3)).sum();
    let origin = curves[0].p0;
    let from_origin = |c: &CubicBez| {
        let [p0, p1, p2, p3] = c.points().map(|p| p - origin);
        CubicBez::new(p0, p1, p2, p3)
    };
    let area: f64 = curves.iter().map(|c| from_origin(c).signed_area()).sum();
    area.abs() <= 0.5 * length * width
}

/// The map between light space and working space.
struct Frame {
    center: DVec2,
    scale: f64,
}

impl Frame {
    fn around(bounds: Bounds) -> Self {
        let half = bounds.size().max_element() * 0.5;
        let far = bounds.center().abs().max_element() > 8.0 * half;
        let center = if far { bounds.center() } else { DVec2::ZERO };
        // A power of two: scaling loses no bit.
        let scale = (WORKING_HALF_EXTENT / half).log2().floor().clamp(-1000.0, 1000.0).exp2();
        Self { center, scale }
    }

    fn enter(&self, c: &CubicBez) -> CubicBez {
        let [a, b, c, d] = c.points().map(|p| (p - self.center) * self.scale);
        CubicBez::new(a, b, c, d)
    }

    fn leave_point(&self, p: DVec2) -> DVec2 {
        p / self.scale + self.center
    }

    fn leave(&self, c: &CubicBez) -> CubicBez {
        let [a, p, q, d] = c.points().map(|p| self.leave_point(p));
        if *c == CubicBez::line(c.p0, c.p3) { CubicBez::line(a, d) } else { CubicBez::new(a, p, q, d) }
    }
}

/// How many pairs of curves meet, by testing at most a million pairs, evenly strewn.
fn estimated_crossings(sets: &Sets) -> usize {
    const SAMPLES: u64 = 1_000_000;
    let curves: Vec<&CubicBez> = sets.iter().flatten().flatten().collect();
    let n = curves.len() as u64;
    if n * n / 2 <= MAX_CROSSINGS as u64 {
        return 0;
    }
    let separated = |a: &CubicBez, b: &CubicBez| {
        // All of b to one side of the strip around a's chord.
        let chord = a.p3 - a.p0;
        let span = |c: &CubicBez| {
            let h = c.points().map(|p| chord.perp_dot(p - a.p0));
            (h.into_iter().fold(f64::INFINITY, f64::min), h.into_iter().fold(f64::NEG_INFINITY, f64::max))
        };
        let (a, b) = (span(a), span(b));
        a.1 < b.0 || b.1 < a.0
    };
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut pick = || {
        // Knuth's MMIX generator, upper bits.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        curves[((state >> 33) % n) as usize]
    };
    let hits = (0..SAMPLES)
        .filter(|_| {
            let (a, b) = (pick(), pick());
            Bounds::of(a.points()).overlaps(Bounds::of(b.points())) && !separated(a, b) && !separated(b, a)
        })
        .count();
    (hits as f64 * (n as f64 * n as f64 * 0.5 / SAMPLES as f64)) as usize
}
