//! Curves subdivided by what they contribute. Twin: `shaders/subdivide.wgsl`.
//!
//! Kuge, Yatagawa, Morishima, *Real-Time Shading of Free-Form Area Lights using Linearly Transformed Cosines*, JCGT 11(1),
//! 2022: the Ramer–Douglas–Peucker scheme with the radiance that a triangle adds in place of a distance. Each part of a curve
//! above the horizon begins as [`INTERVALS`] equal steps of its parameter; with the middle of a step its ends make a
//! triangle, and the step is halved as long as the triangle's own contribution is `eps` or more.
//!
//! What the paper leaves open is settled as the authors' program has it: a contribution is θ·n_z summed over the three edges,
//! without the factor 1/2π; a triangle that is not subdivided adds its two outer edges, which its contribution has already
//! cost. Closing edges are the order-free sum of [`super::horizon`], for any number of contours and curves.

use super::curve::{Corner, Curve, EdgeSum, LocalCurve, clipped_edge, corner_edge};
use super::horizon::Horizon;
use super::map::CosineMap;
use super::roots::crossings;
use core::f32::consts::TAU;
use glam::Vec2;

/// log₂ of [`INTERVALS`].
pub const START_LEVEL: u32 = 2;
/// Steps that a part of a curve begins with: the paper's N_div.
pub const INTERVALS: u32 = 1 << START_LEVEL;
/// Halvings of such a step at most, and the size of the stack. With the two edges of a triangle, 2⁻¹⁹ of the part.
pub const HALVINGS: u32 = 16;
/// The paper's eps for the diffuse lobe: nothing is ever halved.
pub const DIFFUSE_EPS: f32 = 1000.0;
/// The paper's eps for the specular lobe over the squared perceptual roughness, which is the GGX alpha.
pub const SPECULAR_EPS: f32 = 0.1;

/// The paper's eps: for the plain cosine, or for the lobe of a GGX width.
pub fn default_eps(alpha: Option<f32>) -> f32 {
    alpha.map_or(DIFFUSE_EPS, |alpha| SPECULAR_EPS * alpha)
}

/// The clamped-cosine integral over the light, its curves subdivided until every triangle contributes less than `eps`
/// (2π times its normalised integral), clipped at z = 0 (`horizon`; `None` where the light is wholly above). Lines are
/// one edge. Signed: negative behind the light.
pub fn kuge_integral(map: &CosineMap, horizon: Option<&Horizon>, curves: &[Curve], eps: f32) -> EdgeSum {
    let mut total = EdgeSum::default();
    for curve in curves {
        let local = LocalCurve::new(curve, map.foot);
        let sum = if local.is_line() {
            clipped_edge(map, horizon, &Corner::new(map, local.p0), &Corner::new(map, local.p3))
        } else {
            curve_above(map, horizon, &local, eps)
        };
        total.value += sum.value;
        total.edges += sum.edges;
    }
    EdgeSum { value: total.value / TAU, ..total }
}

/// A part of a curve, in its parameter, with its end points.
struct Part {
    t0: f32,
    t1: f32,
    start: Vec2,
    end: Vec2,
}

impl Part {
    /// The point after `index` steps of the width 2⁻ⁿ, of which 2ⁿ make the part.
    #[inline(always)]
    fn point(&self, curve: &LocalCurve, index: u32, width: f32) -> Vec2 {
        let share = index as f32 * width;
        if share == 1.0 { self.end } else { curve.point(self.t0 + (self.t1 - self.t0) * share) }
    }
}

/// The curve's parts above the horizon, with the closing terms of its crossings (times 2π).
fn curve_above(map: &CosineMap, horizon: Option<&Horizon>, curve: &LocalCurve, eps: f32) -> EdgeSum {
    let mut part = Part { t0: 0.0, t1: 1.0, start: curve.p0, end: curve.p3 };
    let Some(horizon) = horizon else { return part_integral(map, curve, &part, eps) };
    let heights = curve.heights(horizon);
    if heights.iter().all(|&h| h > 0.0) {
        return part_integral(map, curve, &part, eps);
    }
    let mut total = EdgeSum::default();
    if !heights.iter().any(|&h| h > 0.0) {
        return total;
    }
    let found = crossings(heights);
    let mut above = heights[0] > 0.0;
    for i in 0..=found.count {
        let (mut t, mut q, mut closing) = (1.0, curve.p3, 0.0);
        if i < found.count {
            t = found.t[i];
            q = curve.point(t);
            closing = horizon.crossing(map.point(q));
        }
        if above {
            (part.t1, part.end) = (t, q);
            let sum = part_integral(map, curve, &part, eps);
            total.value += sum.value - closing;
            total.edges += sum.edges;
        } else {
            total.value += closing;
        }
        (part.t0, part.start) = (t, q);
        above = !above;
    }
    total
}

/// The integral (times 2π) along a part of a curve above the horizon.
///
/// Step `index` of 2^`level`, as wide as twice `half`, from a to b with `chord` the integral along its chord. Slots hold the
/// right halves that wait, one at most for each level. No triangle contributes more than 2π: with an eps above that the
/// chords need not be known.
fn part_integral(map: &CosineMap, curve: &LocalCurve, part: &Part, eps: f32) -> EdgeSum {
    let mut slots = [(Vec2::ZERO, 0.0); HALVINGS as usize];
    let adaptive = eps <= TAU;
    let (mut level, mut index, mut half) = (START_LEVEL, 0, 0.5 / INTERVALS as f32);
    let mut total = EdgeSum::default();
    let mut a = Corner::new(map, part.start);
    let mut b = Corner::new(map, part.point(curve, 1, 2.0 * half));
    let mut chord = if adaptive { corner_edge(map, &a, &b) } else { 0.0 };
    while index < INTERVALS || level > START_LEVEL {
        let m = Corner::new(map, part.point(curve, 2 * index + 1, half));
        let (first, second) = (corner_edge(map, &a, &m), corner_edge(map, &m, &b));
        if adaptive && (first + second - chord).abs() >= eps && level < START_LEVEL + HALVINGS {
            slots[(level - START_LEVEL) as usize] = (b.q, second);
            level += 1;
            index *= 2;
            half *= 0.5;
            b = m;
            chord = first;
            continue;
        }
        total.value += first + second;
        total.edges += 2;
        a = b;
        index += 1;
        let up = index.trailing_zeros().min(level - START_LEVEL);
        index >>= up;
        level -= up;
        half *= (1_u32 << up) as f32;
        if level > START_LEVEL {
            let slot = slots[(level - 1 - START_LEVEL) as usize];
            b = Corner::new(map, slot.0);
            chord = slot.1;
        } else if index < INTERVALS {
            b = Corner::new(map, part.point(curve, index + 1, 2.0 * half));
            chord = if adaptive { corner_edge(map, &a, &b) } else { 0.0 };
        }
    }
    total
}
