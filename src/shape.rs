//! `CubicBez`, `Contour`, `Shape`: closed cubic Bézier contours in light space.
//!
//! Light space is 2-D, x right, y up, metres, as a reader in front of the light sees it. Outer contours run
//! counter-clockwise, holes clockwise; the winding number is 0 or 1 everywhere. A [`Shape`] that comes out of
//! [`crate::outline`] keeps that invariant; [`Shape::from_contours`] checks all of it but the winding number.

use core::f64::consts::{FRAC_PI_2, TAU};
use glam::{DAffine2, DVec2};

/// A cubic Bézier segment with control points `p0..p3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicBez {
    /// Start point (t = 0).
    pub p0: DVec2,
    /// First handle.
    pub p1: DVec2,
    /// Second handle.
    pub p2: DVec2,
    /// End point (t = 1).
    pub p3: DVec2,
}

impl CubicBez {
    /// A cubic from its control points.
    pub const fn new(p0: DVec2, p1: DVec2, p2: DVec2, p3: DVec2) -> Self {
        Self { p0, p1, p2, p3 }
    }

    /// The straight segment `a → b`, handles at its thirds.
    pub fn line(a: DVec2, b: DVec2) -> Self {
        Self::new(a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b)
    }

    /// A quadratic `a, c, b` raised to a cubic.
    pub fn quad(a: DVec2, c: DVec2, b: DVec2) -> Self {
        Self::new(a, a.lerp(c, 2.0 / 3.0), b.lerp(c, 2.0 / 3.0), b)
    }

    /// The point at `t` (Bernstein form).
    pub fn eval(&self, t: f64) -> DVec2 {
        let s = 1.0 - t;
        self.p0 * (s * s * s) + self.p1 * (3.0 * s * s * t) + self.p2 * (3.0 * s * t * t) + self.p3 * (t * t * t)
    }

    /// The derivative with respect to `t`.
    pub fn tangent(&self, t: f64) -> DVec2 {
        let s = 1.0 - t;
        ((self.p1 - self.p0) * (s * s) + (self.p2 - self.p1) * (2.0 * s * t) + (self.p3 - self.p2) * (t * t)) * 3.0
    }

    /// The point at `t`, to the bit at both ends.
    pub fn eval_exact(&self, t: f64) -> DVec2 {
        match t {
            0.0 => self.p0,
            1.0 => self.p3,
            _ => self.eval(t),
        }
    }

    /// The part over `[t0, t1]` (blossoming); end points at 0 and 1 are kept to the bit, and so is the whole.
    pub fn subsegment(&self, t0: f64, t1: f64) -> Self {
        if t0 == 0.0 && t1 == 1.0 {
            return *self;
        }
        let (a, b) = (self.eval_exact(t0), self.eval_exact(t1));
        let h = (t1 - t0) / 3.0;
        Self::new(a, a + self.tangent(t0) * h, b - self.tangent(t1) * h, b)
    }

    /// Contribution ½∫ p × dp to the signed area (counter-clockwise positive).
    pub fn signed_area(&self) -> f64 {
        let [p0, p1, p2, p3] = [self.p0, self.p1, self.p2, self.p3];
        (6.0 * p0.perp_dot(p1)
            + 3.0 * p0.perp_dot(p2)
            + p0.perp_dot(p3)
            + 3.0 * p1.perp_dot(p2)
            + 3.0 * p1.perp_dot(p3)
            + 6.0 * p2.perp_dot(p3))
            / 20.0
    }

    /// Largest distance from the quadratic nearest to the curve (its end points kept).
    pub fn off_quadratic(&self) -> f64 {
        const FACTOR: f64 = 0.048_112_522_432_468_816; // √3/36
        FACTOR * (self.p3 - self.p0 + 3.0 * (self.p1 - self.p2)).length()
    }

    /// The parameters, ascending, inside (0, 1) at which the height y turns: between them the curve is monotone in y.
    pub fn turns(&self) -> impl Iterator<Item = f64> + use<> {
        let h = self.points().map(|p| p.y);
        let [d0, d1, d2] = [h[1] - h[0], h[2] - h[1], h[3] - h[2]];
        let [early, late] = quadratic_roots(d0 - 2.0 * d1 + d2, 2.0 * (d1 - d0), d0);
        let inside = |t: f64| t > 0.0 && t < 1.0;
        [early, late]
            .into_iter()
            .enumerate()
            .filter(move |&(i, t)| inside(t) && !(i == 1 && t == early))
            .map(|(_, t)| t)
    }

    /// Calls `visit(x, direction)` for every crossing with the horizontal through `y`: +1 where the curve comes
    /// up through it, −1 where it goes down. See [`Self::crossing_parameters`].
    pub fn crossings(&self, y: f64, mut visit: impl FnMut(f64, i32)) {
        self.crossing_parameters(y, |t, direction| visit(self.eval(t).x, direction));
    }

    /// Calls `visit(t, direction)` for every crossing with the horizontal through `y`, in the order of the curve.
    ///
    /// A point counts as below when its height is `<= y`, for the curve's ends to the bit, so along a closed
    /// contour the directions always add to nothing, whatever lies on the line.
    pub fn crossing_parameters(&self, y: f64, mut visit: impl FnMut(f64, i32)) {
        let h = self.points().map(|p| p.y);
        let below = h.map(|v| v <= y);
        if below == [below[0]; 4] {
            return;
        }
        let mut stops = [0.0, 1.0, 1.0, 1.0];
        let mut n = 1;
        for t in self.turns() {
            stops[n] = t;
            n += 1;
        }
        let height = |t: f64| self.eval_exact(t).y;
        for piece in stops[..=n].windows(2) {
            let (mut lo, mut hi) = (piece[0], piece[1]);
            let (start, end) = (height(lo), height(hi));
            if (start <= y) == (end <= y) {
                continue;
            }
            let direction = if end > start { 1 } else { -1 };
            // Newton, kept inside the bracket by bisection.
            let mut t = lo + (hi - lo) * ((y - start) / (end - start));
            for _ in 0..64 {
                let here = height(t);
                if (here <= y) == (start <= y) {
                    lo = t;
                } else {
                    hi = t;
                }
                let newton = t - (here - y) / self.tangent(t).y;
                let next = if newton > lo && newton < hi { newton } else { 0.5 * (lo + hi) };
                if (next - t).abs() <= 4.0 * f64::EPSILON || here == y {
                    break;
                }
                t = next;
            }
            visit(t, direction);
        }
    }

    /// The four control points.
    pub const fn points(&self) -> [DVec2; 4] {
        [self.p0, self.p1, self.p2, self.p3]
    }

    /// The same curve run backwards.
    pub const fn reversed(&self) -> Self {
        Self::new(self.p3, self.p2, self.p1, self.p0)
    }

    /// The curve with its ends moved to `start` and `end`, handles along with them; a line stays one.
    #[must_use]
    pub fn with_ends(&self, start: DVec2, end: DVec2) -> Self {
        if start == self.p0 && end == self.p3 {
            *self
        } else if *self == Self::line(self.p0, self.p3) {
            Self::line(start, end)
        } else {
            Self::new(start, self.p1 + (start - self.p0), self.p2 + (end - self.p3), end)
        }
    }

    /// Whether the handles lie on the chord to within `tolerance` (metres), so that the curve is its chord.
    pub fn is_line(&self, tolerance: f64) -> bool {
        let chord = self.p3 - self.p0;
        let length = chord.length();
        let off = |p: DVec2| {
            let d = p - self.p0;
            if length <= f64::MIN_POSITIVE {
                return d.length();
            }
            let along = d.dot(chord) / length;
            let beyond = (-along).max(along - length).max(0.0);
            (chord.perp_dot(d) / length).abs().max(beyond)
        };
        off(self.p1) <= tolerance && off(self.p2) <= tolerance
    }
}

/// Real roots of `a·t² + b·t + c` in ascending order, NaN where there is none (kurbo's stable form: no cancellation,
/// and a leading coefficient of rounding noise gives one root far away).
fn quadratic_roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [f64::NAN; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (r, s) = (q / a, c / q);
    if s < r { [s, r] } else { [r, s] }
}

/// A closed loop of cubics; each starts at the bit-identical point where the one before it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    curves: Vec<CubicBez>,
}

impl Contour {
    /// The cubics, in order.
    pub fn curves(&self) -> &[CubicBez] {
        &self.curves
    }

    /// Signed area in m²: positive for an outer contour, negative for a hole.
    pub fn signed_area(&self) -> f64 {
        // About the first point: far from the origin the sum would cancel.
        let o = self.curves[0].p0;
        let area = |c: &CubicBez| CubicBez::new(c.p0 - o, c.p1 - o, c.p2 - o, c.p3 - o).signed_area();
        self.curves.iter().map(area).sum()
    }

    /// Whether the contour runs clockwise, i.e. cuts a hole.
    pub fn is_hole(&self) -> bool {
        self.signed_area() < 0.0
    }

    /// Bounds of the control points.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.curves.iter().flat_map(|c| c.points()))
    }
}

/// An axis-aligned box in light space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower left corner.
    pub min: DVec2,
    /// Upper right corner.
    pub max: DVec2,
}

impl Bounds {
    /// The box that holds nothing (min > max).
    pub const EMPTY: Self = Self { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn of(points: impl IntoIterator<Item = DVec2>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether the two boxes share a point.
    pub fn overlaps(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Width and height in metres.
    pub fn size(self) -> DVec2 {
        self.max - self.min
    }

    /// The middle.
    pub fn center(self) -> DVec2 {
        (self.min + self.max) * 0.5
    }
}

/// Why contours cannot make a [`Shape`].
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ShapeError {
    /// A control point is NaN or infinite.
    #[error("contour {contour}, curve {curve}: control point ({x}, {y}) is not finite")]
    NotFinite {
        /// Index of the contour.
        contour: usize,
        /// Index of the curve in the contour.
        curve: usize,
        /// x of the control point.
        x: f64,
        /// y of the control point.
        y: f64,
    },
    /// A curve does not start where the one before it ends.
    #[error("contour {contour} is not closed: curve {curve} starts at ({x}, {y}), not where the one before it ends")]
    NotClosed {
        /// Index of the contour.
        contour: usize,
        /// Index of the curve in the contour.
        curve: usize,
        /// x of the start point.
        x: f64,
        /// y of the start point.
        y: f64,
    },
    /// A contour without curves.
    #[error("contour {contour} has no curves")]
    Empty {
        /// Index of the contour.
        contour: usize,
    },
}

/// A set of closed contours whose winding number is 0 or 1 everywhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    contours: Vec<Contour>,
}

impl Shape {
    /// Takes contours that are already oriented and free of overlap (holes clockwise), and checks that they
    /// are finite and closed. For paths that may overlap use [`crate::outline`].
    pub fn from_contours(contours: Vec<Vec<CubicBez>>) -> Result<Self, ShapeError> {
        for (k, curves) in contours.iter().enumerate() {
            let Some(mut end) = curves.last().map(|c| c.p3) else {
                return Err(ShapeError::Empty { contour: k });
            };
            for (i, c) in curves.iter().enumerate() {
                if let Some(p) = c.points().into_iter().find(|p| !p.is_finite()) {
                    return Err(ShapeError::NotFinite { contour: k, curve: i, x: p.x, y: p.y });
                }
                if c.p0 != end {
                    return Err(ShapeError::NotClosed { contour: k, curve: i, x: c.p0.x, y: c.p0.y });
                }
                end = c.p3;
            }
        }
        Ok(Self::of_closed(contours))
    }

    /// Contours known to be closed and finite.
    pub(crate) fn of_closed(contours: Vec<Vec<CubicBez>>) -> Self {
        Self { contours: contours.into_iter().map(|curves| Contour { curves }).collect() }
    }

    /// The axis-aligned rectangle from `min` to `max`.
    pub fn rectangle(min: DVec2, max: DVec2) -> Self {
        let corner = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
        let curves = (0..4).map(|i| CubicBez::line(corner[i], corner[(i + 1) % 4])).collect();
        Self { contours: vec![Contour { curves }] }
    }

    /// The unit disc about the origin: `arcs` cubics (a multiple of 4) from (1, 0), of exactly its area.
    ///
    /// The cubics end on the circle and leave it by at most 2.7e-4 where there are four, 4.2e-6 where there are eight.
    pub fn disc(arcs: u32) -> Self {
        Self { contours: vec![Contour { curves: (0..arcs).map(|i| arc(i, arcs)).collect() }] }
    }

    /// The upper half of [`Shape::disc`], moved down by ½ so that its box is about the origin; from (1, −½).
    pub fn half_disc(arcs: u32) -> Self {
        let mut curves: Vec<_> = (0..arcs / 2).map(|i| arc(i, arcs)).collect();
        curves.push(CubicBez::line(DVec2::NEG_X, DVec2::X));
        Self { contours: vec![Contour { curves }] }.transformed(DAffine2::from_translation(DVec2::new(0.0, -0.5)))
    }

    /// The contours.
    pub fn contours(&self) -> &[Contour] {
        &self.contours
    }

    /// Whether there is no contour.
    pub fn is_empty(&self) -> bool {
        self.contours.is_empty()
    }

    /// All curves of all contours.
    pub fn curves(&self) -> impl Iterator<Item = &CubicBez> {
        self.contours.iter().flat_map(|c| c.curves())
    }

    /// Area in m² (holes subtracted).
    pub fn area(&self) -> f64 {
        // From +0: the sum of nothing would be −0.
        self.contours.iter().map(Contour::signed_area).fold(0.0, |a, b| a + b)
    }

    /// Bounds of the control points; [`Bounds::EMPTY`] for an empty shape.
    pub fn bounds(&self) -> Bounds {
        self.contours.iter().map(Contour::bounds).fold(Bounds::EMPTY, Bounds::union)
    }

    /// The smallest box around the curves themselves, handles aside; [`Bounds::EMPTY`] for an empty shape.
    pub fn extent(&self) -> Bounds {
        let turned = |c: &CubicBez| {
            let [p0, p1, p2, p3] = c.points().map(|p| DVec2::new(p.y, p.x));
            CubicBez::new(p0, p1, p2, p3)
        };
        let points = |c: &CubicBez| {
            let turns: Vec<_> = c.turns().chain(turned(c).turns()).chain([0.0, 1.0]).collect();
            let curve = *c;
            turns.into_iter().map(move |t| curve.eval_exact(t))
        };
        Bounds::of(self.curves().flat_map(points))
    }

    /// The shape under an affine map of the plane; a mirroring map turns the contours round so that outer
    /// contours stay counter-clockwise.
    #[must_use]
    pub fn transformed(&self, map: DAffine2) -> Self {
        let mirrored = map.matrix2.determinant() < 0.0;
        let contour = |c: &Contour| {
            let mut curves: Vec<_> = c
                .curves
                .iter()
                .map(|c| {
                    let [p0, p1, p2, p3] = c.points().map(|p| map.transform_point2(p));
                    let c = CubicBez::new(p0, p1, p2, p3);
                    if mirrored { c.reversed() } else { c }
                })
                .collect();
            if mirrored {
                curves.reverse();
            }
            Contour { curves }
        };
        Self { contours: self.contours.iter().map(contour).collect() }
    }

    /// How often the contours wind round `p`, counter-clockwise positive: 1 inside, 0 outside.
    ///
    /// Exact up to the rounding of the curve's x where the horizontal through `p` meets it.
    pub fn winding(&self, p: DVec2) -> i32 {
        let mut winding = 0;
        for curve in self.curves() {
            if curve.points().iter().any(|q| q.x > p.x) {
                curve.crossings(p.y, |x, direction| {
                    if x > p.x {
                        winding += direction;
                    }
                });
            }
        }
        winding
    }

    /// Adds the contours of `other`, which must not overlap this shape.
    pub fn append(&mut self, other: Self) {
        self.contours.extend(other.contours);
    }
}

/// The `i`th of `arcs` cubics round the unit circle, counter-clockwise.
///
/// Ends on the circle, handles of length k along its tangents. The area between such a cubic and the centre is
/// (12k(1 − cos θ) + 10·sin θ − 3k²·sin θ)/20 for an arc of angle θ; k makes it θ/2, that of the sector.
fn arc(i: u32, arcs: u32) -> CubicBez {
    let theta = TAU / f64::from(arcs);
    let (s, c) = theta.sin_cos();
    let b = 12.0 * (1.0 - c);
    let k = (b - (b * b - 120.0 * s * (theta - s)).sqrt()) / (6.0 * s);
    let (start, end) = (on_circle(i, arcs), on_circle(i + 1, arcs));
    CubicBez::new(start, start + start.perp() * k, end - end.perp() * k, end)
}

/// The `i`th of `corners` places round the unit circle; those on the axes to the bit.
fn on_circle(i: u32, corners: u32) -> DVec2 {
    let quarter = corners / 4;
    let corner = DVec2::from_angle(FRAC_PI_2 / f64::from(quarter) * f64::from(i % quarter));
    (0..i / quarter % 4).fold(corner, |p, _| p.perp())
}
