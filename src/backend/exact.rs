//! The float64 yardstick: adaptive contour integration of the clamped cosine, right to 1e-10. Shares no code with
//! [`crate::kernel`].
//!
//! Positions are evaluated in double-double arithmetic and rounded once, so that a point near the light or in a
//! narrow lobe's axis costs no digits. Curves are cut at the extrema of their height over each horizon, so that
//! each part has at most one crossing and a sign change finds it; the parts above are integrated by adaptive
//! Gauss–Kronrod quadrature; the horizon is closed by sorting the crossings along its line.

use crate::shape::{CubicBez, Shape};
use core::ops::{Add, Mul};
use glam::{DVec2, DVec3};
use twofloat::TwoFloat;

/// Error asked of each adaptive quadrature.
const QUADRATURE_TOLERANCE: f64 = 1e-13;
/// The same, for a first look.
const ROUGH_TOLERANCE: f64 = 1e-9;
const ROUGH_DEPTH: u32 = 38;
/// Halvings of a curve: double-double tells points apart that are 2⁻¹⁰⁰ of it from each other.
const QUADRATURE_DEPTH: u32 = 100;
/// A piece is looked at whole from this many of its half-lengths away. Nearer, nodes may miss the peak where it passes the origin.
const WHOLE_FROM: f64 = 1.5;

/// A light's plane in cosine space: p(x, y) = c\[0\]·x + c\[1\]·y + c\[2\], light space in, and the clipping planes.
#[derive(Clone, Copy, Debug)]
pub struct ExactMap {
    /// Images of the light-space x axis, y axis and origin.
    pub c: [DVec3; 3],
    /// Normal of the surface's true horizon in cosine space (the third row of M), where that clips as well.
    pub horizon: Option<DVec3>,
}

/// The one-sided clamped-cosine integral E of `shape` over the half-space z > 0 of cosine space (and above the true horizon,
/// where the map has one): 1 for a full hemisphere, 0 for D ≤ 0.
///
/// Contours count by their winding number. Error below 1e-10 for shapes whose contours do not pass through the
/// shading point.
pub fn exact_integral(map: &ExactMap, shape: &Shape) -> f64 {
    let effort = Effort { tolerance: QUADRATURE_TOLERANCE, depth: QUADRATURE_DEPTH, whole_from: WHOLE_FROM };
    integral::<TwoFloat>(map, shape, effort)
}

/// As [`exact_integral`], for a first look: positions in plain f64, each quadrature to 1e-9, some hundred times faster. Where the
/// contour passes within 1e-9 of the shading point it may miss the peak and be wrong altogether.
pub fn rough_integral(map: &ExactMap, shape: &Shape) -> f64 {
    integral::<f64>(map, shape, Effort { tolerance: ROUGH_TOLERANCE, depth: ROUGH_DEPTH, whole_from: 0.0 })
}

/// What an adaptive quadrature may spend.
#[derive(Clone, Copy)]
struct Effort {
    /// Error asked for.
    tolerance: f64,
    /// Halvings.
    depth: u32,
    /// Half-lengths of a piece from the origin from where it need not be halved.
    whole_from: f64,
}

/// What positions along a curve are evaluated in.
trait Real: Copy + Add<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self> + From<TwoFloat> + Into<f64> {}

impl Real for f64 {}
impl Real for TwoFloat {}

fn integral<R: Real>(map: &ExactMap, shape: &Shape, effort: Effort) -> f64 {
    if depth_sign(map.c) <= 0.0 {
        return 0.0;
    }
    // A true horizon that is z = 0 itself must not be closed twice.
    let apart = |n: &DVec3| n.x.hypot(n.y) > 1e-13 * n.z.abs();
    let normals: Vec<DVec3> = [Some(DVec3::Z), map.horizon.filter(apart)].into_iter().flatten().collect();
    let mut crossings: Vec<Vec<Crossing>> = vec![Vec::new(); normals.len()];
    let mut sum = 0.0;
    for contour in shape.contours() {
        for curve in contour.curves() {
            sum += curve_above::<R>(map.c, curve, &normals, &mut crossings, effort);
        }
    }
    for (i, list) in crossings.iter_mut().enumerate() {
        let other = (normals.len() == 2).then(|| Other { normal: normals[1 - i], corner: corner(map.c, &normals) });
        sum += closing_edges(list, normals[i].normalize(), other);
    }
    sum / core::f64::consts::TAU
}

/// The sign of D = −(c0 × c1)·c2.
fn depth_sign(c: [DVec3; 3]) -> f64 {
    let [x, y, o] = c;
    let minor = |a: f64, b: f64, c: f64, d: f64| TwoFloat::new_mul(a, d) - TwoFloat::new_mul(b, c);
    let cross = [minor(x.y, x.z, y.y, y.z), minor(x.z, x.x, y.z, y.x), minor(x.x, x.y, y.x, y.y)];
    let dot = cross[0] * o.x + cross[1] * o.y + cross[2] * o.z;
    -f64::from(dot)
}

/// Where a contour passes through a horizon, and which way (+1 comes up, −1 goes down).
#[derive(Clone, Copy)]
struct Crossing {
    point: DVec3,
    direction: f64,
}

/// A polynomial in t of degree 3, constant term first.
#[derive(Clone, Copy)]
struct Cubic<R>([R; 4]);

impl<R: Real> Cubic<R> {
    /// The polynomial of a linear function of points over a curve. Coefficients are formed in double-double.
    fn new(curve: &CubicBez, of: impl Fn(DVec2) -> TwoFloat) -> Self {
        let v = curve.points().map(of);
        let (d0, d1, d2) = (v[1] - v[0], v[2] - v[1], v[3] - v[2]);
        let (e0, e1) = (d1 - d0, d2 - d1);
        Self([v[0], d0 * 3.0, e0 * 3.0, e1 - e0].map(R::from))
    }

    fn eval(&self, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.0;
        (((c3 * t + c2) * t + c1) * t + c0).into()
    }

    fn derivative(&self, t: f64) -> f64 {
        let [_, c1, c2, c3] = self.0;
        ((c3 * (3.0 * t) + c2 * 2.0_f64) * t + c1).into()
    }

    /// The part from `start`, `width` long, as a polynomial on \[0, 1\].
    fn part(&self, start: R, width: R) -> Self {
        let [c0, c1, c2, c3] = self.0;
        let (slope, bend) = ((c3 * start * 3.0_f64 + c2 * 2.0_f64) * start + c1, c3 * start * 3.0_f64 + c2);
        let value = ((c3 * start + c2) * start + c1) * start + c0;
        Self([value, slope * width, bend * width * width, c3 * width * width * width])
    }

    /// How far values on \[0, 1\] may be from that at 1/2.
    fn spread(&self) -> f64 {
        let [_, _, c2, c3] = self.0.map(Into::<f64>::into);
        0.5 * self.derivative(0.5).abs() + 0.25 * (c2 + 1.5 * c3).abs() + 0.125 * c3.abs()
    }

    /// Where the derivative vanishes inside (0, 1), in order.
    fn extrema(&self) -> Vec<f64> {
        let [_, c, b, a] = self.0.map(Into::<f64>::into);
        let (a, half_b) = (3.0 * a, b);
        let discriminant = half_b * half_b - a * c;
        let mut roots = Vec::new();
        if discriminant > 0.0 {
            let q = -(half_b + discriminant.sqrt().copysign(half_b));
            // q/a overflows where the polynomial is a noisy quadratic: that root is then outside (0, 1).
            roots.extend([q / a, c / q]);
        } else if a != 0.0 {
            roots.push(-half_b / a);
        }
        roots.retain(|t| *t > 0.0 && *t < 1.0);
        roots.sort_by(f64::total_cmp);
        roots
    }
}

/// a·x + b·y + c, double-double.
fn at(p: DVec2, [a, b, c]: [f64; 3]) -> TwoFloat {
    TwoFloat::new_mul(a, p.x) + TwoFloat::new_mul(b, p.y) + c
}

/// The height of a point over the plane with a normal, double-double: where planes nearly coincide and pass near the point, their
/// heights would round together.
fn height_at(p: DVec2, c: [DVec3; 3], normal: DVec3) -> TwoFloat {
    at(p, c.map(|v| v.x)) * normal.x + at(p, c.map(|v| v.y)) * normal.y + at(p, c.map(|v| v.z)) * normal.z
}

/// The polynomials of a curve in cosine space.
struct Path<R> {
    x: Cubic<R>,
    y: Cubic<R>,
    z: Cubic<R>,
}

impl<R: Real> Path<R> {
    fn new(c: [DVec3; 3], curve: &CubicBez) -> Self {
        Self {
            x: Cubic::new(curve, |p| at(p, c.map(|v| v.x))),
            y: Cubic::new(curve, |p| at(p, c.map(|v| v.y))),
            z: Cubic::new(curve, |p| at(p, c.map(|v| v.z))),
        }
    }

    fn part(&self, start: R, width: R) -> Self {
        let part = |c: &Cubic<R>| c.part(start, width);
        Self { x: part(&self.x), y: part(&self.y), z: part(&self.z) }
    }

    /// Whether no point comes nearer to the origin than `from` half-lengths less one.
    fn is_away(&self, from: f64) -> bool {
        let spread = DVec3::new(self.x.spread(), self.y.spread(), self.z.spread());
        self.point(0.5).length_squared() >= from * from * spread.length_squared()
    }

    fn point(&self, t: f64) -> DVec3 {
        DVec3::new(self.x.eval(t), self.y.eval(t), self.z.eval(t))
    }

    fn tangent(&self, t: f64) -> DVec3 {
        DVec3::new(self.x.derivative(t), self.y.derivative(t), self.z.derivative(t))
    }

    /// The integrand (p' × p)_z / |p|².
    fn integrand(&self, t: f64) -> f64 {
        let (p, d) = (self.point(t), self.tangent(t));
        let value = (d.x * p.y - d.y * p.x) / p.length_squared();
        if value.is_finite() { value } else { 0.0 }
    }
}

/// Integrates a curve's parts above all horizons and notes its crossings.
fn curve_above<R: Real>(
    c: [DVec3; 3],
    curve: &CubicBez,
    normals: &[DVec3],
    crossings: &mut [Vec<Crossing>],
    effort: Effort,
) -> f64 {
    let path = Path::<R>::new(c, curve);
    // t and the horizon, and which horizons the start is above.
    let mut cuts: Vec<(TwoFloat, usize)> = Vec::new();
    let mut above: Vec<bool> = Vec::new();
    for (i, &normal) in normals.iter().enumerate() {
        let height_of = |p| height_at(p, c, normal);
        let height = Cubic::<TwoFloat>::new(curve, height_of);
        // Shared end points are judged from the point alone, the same for both curves that meet there.
        let start = f64::from(height_of(curve.p0)) > 0.0;
        let end = f64::from(height_of(curve.p3)) > 0.0;
        above.push(start);
        let mut stops = height.extrema();
        stops.push(1.0);
        let (mut t0, mut sign0) = (0.0, start);
        for t1 in stops {
            let sign1 = if t1 == 1.0 { end } else { height.eval(t1) > 0.0 };
            if sign0 != sign1 {
                let (t, rest) = root(&height, t0, t1, sign0);
                let point = path.point(t) + path.tangent(t) * rest;
                crossings[i].push(Crossing { point, direction: if sign1 { 1.0 } else { -1.0 } });
                cuts.push((TwoFloat::new_add(t, rest), i));
            }
            (t0, sign0) = (t1, sign1);
        }
    }
    cuts.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(core::cmp::Ordering::Equal));
    let mut sum = 0.0;
    let mut from = TwoFloat::from(0.0);
    for (t, i) in cuts.into_iter().chain([(TwoFloat::from(1.0), usize::MAX)]) {
        if above.iter().all(|&a| a) && t > from {
            sum += quadrature(path.part(from.into(), (t - from).into()), effort);
        }
        if i < above.len() {
            above[i] = !above[i];
        }
        from = t;
    }
    sum
}

/// The root of a monotone polynomial between `t0` and `t1`, where its sign changes: t and a remainder.
fn root(height: &Cubic<TwoFloat>, t0: f64, t1: f64, sign0: bool) -> (f64, f64) {
    let (mut lo, mut hi) = (t0, t1);
    loop {
        let middle = 0.5 * (lo + hi);
        if middle <= lo || middle >= hi {
            break;
        }
        if (height.eval(middle) > 0.0) == sign0 { lo = middle } else { hi = middle }
    }
    let rest = -height.eval(lo) / height.derivative(lo);
    (lo, if rest.is_finite() { rest.clamp(0.0, hi - lo) } else { 0.0 })
}

/// Adaptive Gauss–Kronrod (7, 15) of the integrand over a path. Pieces have parameters of their own, which resolve what is
/// smaller than the spacing of the path's.
fn quadrature<R: Real>(path: Path<R>, effort: Effort) -> f64 {
    let half = |start: f64| [start, 0.5].map(|v| R::from(TwoFloat::from(v)));
    let [first, second] = [half(0.0), half(0.5)];
    let mut sum = 0.0;
    let mut stack = vec![(path, 0_u32)];
    while let Some((piece, depth)) = stack.pop() {
        let (value, error) = kronrod(&piece);
        if depth == effort.depth || (error <= effort.tolerance && piece.is_away(effort.whole_from)) {
            sum += value;
        } else {
            for [start, width] in [second, first] {
                stack.push((piece.part(start, width), depth + 1));
            }
        }
    }
    sum
}

/// The 15-point Kronrod value over \[0, 1\] and its difference from the 7-point Gauss value (QUADPACK qk15).
fn kronrod<R: Real>(path: &Path<R>) -> (f64, f64) {
    const NODES: [f64; 8] = [
        0.991_455_371_120_812_6,
        0.949_107_912_342_758_5,
        0.864_864_423_359_769_1,
        0.741_531_185_599_394_4,
        0.586_087_235_467_691_1,
        0.405_845_151_377_397_2,
        0.207_784_955_007_898_46,
        0.0,
    ];
    const KRONROD: [f64; 8] = [
        0.022_935_322_010_529_224,
        0.063_092_092_629_978_55,
        0.104_790_010_322_250_18,
        0.140_653_259_715_525_92,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
        0.209_482_141_084_727_82,
    ];
    const GAUSS: [f64; 4] =
        [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];
    let (mut fine, mut coarse) = (0.0, 0.0);
    for (i, &x) in NODES.iter().enumerate() {
        let f =
            if x == 0.0 { path.integrand(0.5) } else { path.integrand(0.5 - 0.5 * x) + path.integrand(0.5 + 0.5 * x) };
        fine += KRONROD[i] * f;
        if i % 2 == 1 {
            coarse += GAUSS[i / 2] * f;
        }
    }
    (0.5 * fine, (0.5 * (fine - coarse)).abs())
}

/// Closes the contour along a horizon: its crossings in order along the line, each interval with the winding that
/// the crossings before it leave, kept to where the other horizon's height is positive.
fn closing_edges(crossings: &mut [Crossing], normal: DVec3, other: Option<Other>) -> f64 {
    let [Some(first), Some(last)] = [crossings.first(), crossings.last()] else { return 0.0 };
    // The line's direction: from the longest difference, which needs no division.
    let from = first.point;
    let far = |a: &&Crossing, b: &&Crossing| a.point.distance_squared(from).total_cmp(&b.point.distance_squared(from));
    let along = crossings.iter().max_by(far).unwrap_or(last).point - from;
    let place = |c: &Crossing| (c.point - from).dot(along);
    crossings.sort_by(|a, b| place(a).total_cmp(&place(b)));
    let mut sum = 0.0;
    let mut winding = 0.0;
    for pair in crossings.windows(2) {
        // A contour that came up `n` times more often than it went down so far is closed by going back.
        winding -= pair[0].direction;
        if winding != 0.0 {
            sum += winding * clipped_chord(pair[0].point, pair[1].point, normal, other);
        }
    }
    sum
}

/// The horizon that clips the closing edges of another.
#[derive(Clone, Copy)]
struct Other {
    normal: DVec3,
    /// Towards the point of the light's plane on both horizons: the same for both, so that what one gains there the other loses.
    corner: DVec3,
}

/// Where both horizons meet the light's plane, as a direction: along their common line, on the light's side of the origin.
fn corner([x, y, _]: [DVec3; 3], normals: &[DVec3]) -> DVec3 {
    let ridge = normals[0].cross(normals[1]);
    if x.cross(y).dot(ridge) > 0.0 { -ridge } else { ridge }
}

/// θ·(b×a)_z/|b×a| of the part of the chord a → b above the `other` horizon. Both ends lie in the plane through the origin with the
/// unit normal `normal`, so b×a is along it: where the chord passes near the origin its own direction would be noise.
fn clipped_chord(a: DVec3, b: DVec3, normal: DVec3, other: Option<Other>) -> f64 {
    let turn = |a: DVec3, b: DVec3, cross: DVec3| cross.dot(normal).atan2(a.dot(b)) * normal.z;
    let Some(Other { normal: height, corner }) = other else { return turn(a, b, (b - a).cross(a)) };
    match (height.dot(a) > 0.0, height.dot(b) > 0.0) {
        (true, true) => turn(a, b, (b - a).cross(a)),
        (false, false) => 0.0,
        (true, false) => turn(a, corner, corner.cross(a)),
        (false, true) => turn(corner, b, b.cross(corner)),
    }
}
