//! Overlap removal: paths that may cross themselves become [`Shape`]s, by linesweeper.
//!
//! linesweeper keeps Béziers but is early beta, so nothing it says is taken on trust:
//!
//! 1. The input is scaled by a power of two (exact) to about a thousand units, and moved only if it lies far from
//!    the origin, so art of 1e-4 m and 1e4 m meets the same numbers.
//! 2. It runs in a thread of its own with a deadline; a panic or an endless loop there becomes an error here.
//! 3. The result is judged by code of ours that shares nothing with it: along horizontals through the input
//!    (`judge`) the inside intervals of the result must be those of the input under the fill rule, with
//!    winding 0 or 1 only. A refused or failed attempt is repeated at a coarser tolerance and turned by an angle.

use super::guard::{GuardError, guarded};
use super::{FillRule, closed_loops, coordinates, point};
use crate::shape::{Bounds, CubicBez, Shape, ShapeError};
use glam::DVec2;
use kurbo::{Affine, BezPath};
use linesweeper::topology::{BinaryWindingNumber, OneOfTwo, Topology};
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
/// cuts stay as they are; where curves cross or touch the result is within about 1e-6 of the path's size.
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
/// Distance in working space below which curves count as touching: 1e-12 of the extent. linesweeper cuts curves at
/// a height, so beside an extremum a cut is off sideways by the square root of this: 1e-6 of the extent.
const CLOSENESS: f64 = 1e-9;
/// Curves shorter than this in working space, 4e-9 of the extent, are welded away.
const SPECK: f64 = 4e-6;
/// Contours whose mean width in working space is less, 1e-6 of the extent, are dropped: edges that nearly coincide.
const SLIVER: f64 = 1e-3;
/// Handles this close to the chord, in working space, are rounding: 1e-13 of the extent.
const STRAIGHT: f64 = 1e-10;
/// Closeness and angle (radians) of each attempt: turned by an angle that no drawing prefers, horizontals and
/// coincident extrema, which are what trips a sweep line, are gone.
const ATTEMPTS: [(f64, f64); 4] =
    [(CLOSENESS, 0.0), (1e3 * CLOSENESS, 0.0), (CLOSENESS, 0.739), (1e3 * CLOSENESS, 2.173)];

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
    }
    let crossings = estimated_crossings(&sets);
    if crossings > MAX_CROSSINGS {
        return Err(OverlapError::TooManyCrossings { count: crossings, limit: MAX_CROSSINGS });
    }
    let mut reason = String::new();
    for (closeness, angle) in ATTEMPTS {
        let turn = Affine::rotate(angle);
        let [a, b] = sets.each_ref().map(|set| turn * sweep_input(set));
        let swept = match sweep(a, b, rule, closeness) {
            Ok(swept) => swept,
            Err(GuardError::TimedOut) => return Err(OverlapError::TimedOut { curves, limit: DEADLINE_SECONDS }),
            Err(GuardError::Failed(message)) => {
                reason = format!("the boolean library failed: {message}");
                continue;
            }
        };
        let loops: Vec<_> = swept
            .iter()
            .map(|path| if angle == 0.0 { path.clone() } else { turn.inverse() * path.clone() })
            .flat_map(|path| closed_loops(&path))
            .filter_map(tidy)
            .collect();
        match judge(&sets, &loops, rule) {
            Ok(()) => {
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
fn estimated_crossings(sets: &[Vec<Vec<CubicBez>>; 2]) -> usize {
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

/// The loops as linesweeper wants them: what is straight as a line element.
fn sweep_input(loops: &[Vec<CubicBez>]) -> BezPath {
    let mut path = BezPath::new();
    for curves in loops {
        path.move_to(point(curves[0].p0));
        for c in curves {
            if c.is_line(STRAIGHT) {
                path.line_to(point(c.p3));
            } else {
                path.curve_to(point(c.p1), point(c.p2), point(c.p3));
            }
        }
        path.close_path();
    }
    path
}

fn sweep(a: BezPath, b: BezPath, rule: Rule, closeness: f64) -> Result<Vec<BezPath>, GuardError> {
    let work = move || {
        let sets = [(&a, OneOfTwo::A), (&b, OneOfTwo::B)];
        let topology = Topology::<BinaryWindingNumber>::from_paths(sets, closeness)
            .map_err(|e| GuardError::Failed(format!("{e:?}")))?;
        let contours = topology.contours(|w| rule.is_inside(w.shape_a, w.shape_b));
        Ok(contours.into_contours().map(|c| c.path).collect())
    };
    guarded("overlap", STACK, Duration::from_secs(DEADLINE_SECONDS), work)?
}

/// Welds curves shorter than [`SPECK`] to the one before, and drops loops thinner than [`SLIVER`].
fn tidy(mut curves: Vec<CubicBez>) -> Option<Vec<CubicBez>> {
    let reach = |c: &CubicBez| c.points().iter().map(|p| p.distance(c.p0)).fold(0.0, f64::max);
    // Start on a curve that stays, so that the weld never runs over the seam.
    let first = curves.iter().position(|c| reach(c) > SPECK)?;
    curves.rotate_left(first);
    let mut kept: Vec<CubicBez> = Vec::with_capacity(curves.len());
    for c in curves {
        if reach(&c) > SPECK {
            let start = kept.last().map_or(c.p0, |k| k.p3);
            kept.push(moved(c, start, c.p3));
        }
    }
    let (start, last) = (kept[0].p0, kept.len() - 1);
    kept[last] = moved(kept[last], kept[last].p0, start);
    let length: f64 = kept.iter().map(|c| c.p0.distance(c.p1) + c.p1.distance(c.p2) + c.p2.distance(c.p3)).sum();
    let origin = kept[0].p0;
    let area: f64 = kept.iter().map(|c| translated(c, -origin).signed_area()).sum();
    (area.abs() > 0.5 * length * SLIVER).then_some(kept)
}

fn translated(c: &CubicBez, by: DVec2) -> CubicBez {
    let [p0, p1, p2, p3] = c.points().map(|p| p + by);
    CubicBez::new(p0, p1, p2, p3)
}

/// The curve with its ends moved to `start` and `end`, handles along; a line stays one.
fn moved(c: CubicBez, start: DVec2, end: DVec2) -> CubicBez {
    if start == c.p0 && end == c.p3 {
        c
    } else if c == CubicBez::line(c.p0, c.p3) {
        CubicBez::line(start, end)
    } else {
        CubicBez::new(start, c.p1 + (start - c.p0), c.p2 + (end - c.p3), end)
    }
}

/// Where result and path disagree: height in working space, and the covered parts of the width there.
struct Disagreement {
    y: f64,
    found: f64,
    expected: f64,
}

/// Compares the result with the path along horizontals at quantiles of the curves' heights.
///
/// A horizontal may graze a curve, where 1e-9 upwards is much sideways; so a horizontal is believed to differ only if two
/// more beside it do.
fn judge(sets: &[Vec<Vec<CubicBez>>; 2], result: &[Vec<CubicBez>], rule: Rule) -> Result<(), Disagreement> {
    let input = || sets.iter().flatten().flatten();
    let mut heights: Vec<f64> = input()
        .chain(result.iter().flatten())
        .filter(|c| c.p0.y != c.p3.y)
        // Not the middle: symmetric art has its vertices there.
        .map(|c| c.p0.y + (c.p3.y - c.p0.y) * 0.414_213_562)
        .collect();
    heights.sort_by(f64::total_cmp);
    let bounds = Bounds::of(input().flat_map(CubicBez::points));
    let extent = bounds.size().max_element();
    let lines = (heights.len() / 4).clamp(8, 64);
    for k in 0..lines.min(heights.len()) {
        let y = heights[k * heights.len() / lines.min(heights.len())];
        let mut worst = None;
        for shift in [0.0, 1.7e-5, -2.3e-5] {
            let y = y + shift * extent;
            let expected = spans(&[&sets[0], &sets[1]], y, |w| rule.is_inside(w[0], w[1]));
            let found = spans(&[result], y, |w| w[0] == 1);
            let stray = length(&spans(&[result], y, |w| w[0] != 0 && w[0] != 1));
            let differ = stray + length(&symmetric_difference(&expected, &found));
            if differ <= 1e-5 * extent {
                worst = None;
                break;
            }
            let width = extent.max(f64::MIN_POSITIVE);
            worst =
                Some(Disagreement { y, found: (length(&found) + stray) / width, expected: length(&expected) / width });
        }
        if let Some(disagreement) = worst {
            return Err(disagreement);
        }
    }
    Ok(())
}

/// The intervals of the horizontal through `y` where the windings of the sets are inside.
fn spans(sets: &[&[Vec<CubicBez>]], y: f64, inside: impl Fn([i32; 2]) -> bool) -> Vec<[f64; 2]> {
    let mut crossings = Vec::new();
    for (k, set) in sets.iter().enumerate() {
        for curve in set.iter().flatten() {
            // Upwards is +1 for what lies to the left of it, so −1 from left to right.
            curve.crossings(y, |x, direction| crossings.push((x, k, direction)));
        }
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut windings = [0; 2];
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut open = None;
    for (x, k, direction) in crossings {
        windings[k] -= direction;
        match (open, inside(windings)) {
            (None, true) => open = Some(x),
            (Some(from), false) => {
                spans.push([from, x]);
                open = None;
            }
            _ => {}
        }
    }
    spans
}

fn length(spans: &[[f64; 2]]) -> f64 {
    spans.iter().map(|s| s[1] - s[0]).sum()
}

/// What is in one list of spans and not in the other.
fn symmetric_difference(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut ends: Vec<f64> = a.iter().chain(b).flatten().copied().collect();
    ends.sort_by(f64::total_cmp);
    ends.chunks_exact(2).map(|c| [c[0], c[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn judge_refuses_a_wrong_result() {
        let square = |r: f64| {
            let p = [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| DVec2::new(x, y));
            (0..4).map(|i| CubicBez::line(p[i], p[(i + 1) % 4])).collect::<Vec<_>>()
        };
        let hole = |r| square(r).iter().rev().map(CubicBez::reversed).collect::<Vec<_>>();
        let rule = Rule { fill: FillRule::NonZero, set: Set::Union };
        let sets = [vec![square(2.0), hole(1.0)], vec![]];
        assert!(judge(&sets, &[square(2.0), hole(1.0)], rule).is_ok());
        // Hole lost, hole turned round (winding 2), wrong size, nothing at all.
        for wrong in [vec![square(2.0)], vec![square(2.0), square(1.0)], vec![square(2.1), hole(1.0)], vec![]] {
            assert!(judge(&sets, &wrong, rule).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn a_panic_and_a_broken_path_become_errors() {
        let mut open = BezPath::new();
        open.move_to((0.0, 0.0));
        open.line_to((1.0, 0.0));
        let rule = Rule { fill: FillRule::NonZero, set: Set::Union };
        assert!(matches!(sweep(open, BezPath::new(), rule, 1e-6), Err(GuardError::Failed(_))));
    }
}
