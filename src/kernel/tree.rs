//! The walk over the chord–moment tree. Twin: `shaders/tree.wgsl`.
//!
//! A node is a region of the light's plane: a *run* of the contour closed by its chord, or a *cluster* of whole
//! contours (no chord). Far from the node its region is k(c)·m0 + ∇k(c)·m1 + ½ H(c):m2, the second-order Taylor
//! expansion of the kernel k = D·z / (π·|p|⁴) about the node's centre c with the region's moments; a run adds
//! its chord exactly. The walk refines a node whose remainder is above the tolerance or which a horizon cuts.

use super::cubic::cubic_point;
use super::edge::edge_integral;
use super::horizon::{Clip, Horizon, Side, cut_edge};
use super::map::{CosineMap, PlanePoint};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::{FRAC_1_PI, TAU};
use glam::{DVec2, Vec2, Vec3};

/// Bits of [`Node::link`] that hold the index; the rest is the kind.
pub const LINK_MASK: u32 = (1 << 30) - 1;
/// A set of whole contours; the index is where the walk goes on past it.
pub const CLUSTER: u32 = 0;
/// A run of a contour; the index is where the walk goes on past it.
pub const RUN: u32 = 1 << 30;
/// A straight edge from a to b.
pub const SEGMENT: u32 = 2 << 30;
/// A cubic from a to b; the index is that of its [`Handles`].
pub const CUBIC: u32 = 3 << 30;

/// Halvings of a cubic at the leaf before it is taken for its chord: 2⁻²⁰ of the curve is under an f32 step.
pub const DEEPEST: u32 = 20;

/// A node, in pre-order. Lengths are tree space.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    /// Centre of the node's box, about which the moments are taken.
    pub center: Vec2,
    /// Half-extents of the box.
    pub half: Vec2,
    /// Start of the chord; shared to the bit with the neighbour's end.
    pub a: Vec2,
    /// End of the chord.
    pub b: Vec2,
    /// ∫dA over the region, signed.
    pub m0: f32,
    /// ∫x dA, ∫y dA.
    pub m1: [f32; 2],
    /// ∫x² dA, ∫xy dA, ∫y² dA.
    pub m2: [f32; 3],
    /// Unsigned area, and the same integral of ρ³, ρ the larger of |x| and |y| in half-extents of the box: see [`areas`].
    pub areas: u32,
    /// Kind and index.
    pub link: u32,
}

/// Two bounds in one word: the upper 16 bits of each, rounded up.
pub fn areas(area: f32, area_3: f32) -> u32 {
    let up = |v: f32| v.to_bits().saturating_add(0xffff) & !0xffff;
    up(area) | up(area_3) >> 16
}

impl Node {
    /// ∫|dA|.
    #[inline(always)]
    pub fn area(&self) -> f32 {
        f32::from_bits(self.areas & !0xffff)
    }

    /// ∫ρ³|dA|, ρ the larger of |x| and |y| in half-extents of the box.
    #[inline(always)]
    pub fn area_3(&self) -> f32 {
        f32::from_bits(self.areas << 16)
    }
}

/// The handles of a cubic leaf.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Handles {
    /// First handle.
    pub p1: Vec2,
    /// Second handle.
    pub p2: Vec2,
    /// What f32 lost of the first handle.
    pub low1: Vec2,
    /// What f32 lost of the second handle.
    pub low2: Vec2,
}

/// What f32 lost of a node's chord ends. Read only where a lobe's footprint on the light is so small that it shows.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LowEnds {
    /// Of [`Node::a`].
    pub a: Vec2,
    /// Of [`Node::b`].
    pub b: Vec2,
}

/// The arrays of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Nodes<'a> {
    /// In pre-order.
    pub nodes: &'a [Node],
    /// One for each node.
    pub low: &'a [LowEnds],
    /// Of the cubic leaves.
    pub handles: &'a [Handles],
}

/// A value and what it cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integral {
    /// The integral, normalised: 1 for a full hemisphere.
    pub value: f32,
    /// Nodes and pieces of leaves visited.
    pub visited: u32,
}

/// The expansion point of a region in cosine space.
pub(super) struct Expansion {
    /// Unit direction of the region's centre.
    dir: Vec3,
    /// 1/|p|.
    inv: f32,
    /// D / (π·|p|³).
    scale: f32,
    /// Squared ratio of the region's radius to |p|.
    s2: f32,
}

impl Expansion {
    #[inline(always)]
    pub(super) fn new(map: &CosineMap, center: Vec2, half: Vec2) -> Self {
        let p = map.point(center);
        let inv2 = 1.0 / p.length_squared();
        let inv = inv2.sqrt();
        let [g00, g01, g11] = map.gram;
        let r2 = half.x * half.x * g00 + half.y * half.y * g11 + 2.0 * half.x * half.y * g01.abs();
        Self { dir: p * inv, inv, scale: map.depth * FRAC_1_PI * inv2 * inv, s2: r2 * inv2 }
    }

    /// |D|/(π·|p|³) · area · terms(s, 1/(1 − s)³). Infinite where the region reaches as far as the origin.
    #[inline(always)]
    fn bound(&self, area: f32, terms: impl Fn(f32, f32) -> f32) -> f32 {
        let s = self.s2.sqrt();
        let gap = 1.0 - s;
        if gap <= 0.0 {
            return f32::INFINITY;
        }
        self.scale.abs() * area * terms(s, 1.0 / (gap * gap * gap))
    }

    /// Bound of the second-order expansion's remainder for a region above the horizon, from ∫ρ³|dA|.
    ///
    /// The nth term of k about p is at most (n+1)(n+2)/2·sⁿ of the scale: p/|p|⁴ has the complex generating function
    /// (1 − s·e^iθ)⁻²(1 − s·e^−iθ)⁻¹. Of the third, 10ẑ + 3.52·√(1 − ẑ²) is the exact maximum.
    #[inline(always)]
    pub(super) fn remainder(&self, area_3: f32) -> f32 {
        let third = (10.0 * self.dir.z + 3.52).min(10.0);
        self.bound(area_3, |s, gap_3| self.s2 * s * (third + s * (15.0 - s * (24.0 - 10.0 * s)) * gap_3))
    }

    /// Bound of the zeroth-order expansion's remainder about the centroid of a sliver above the horizon, whose ∫ρ²|dA| is no
    /// more than half its area.
    #[inline(always)]
    fn remainder_at_centroid(&self, area: f32) -> f32 {
        let second = (6.0 * self.dir.z + 2.0).min(6.0);
        self.bound(0.5 * area, |s, gap_3| self.s2 * (second + s * (10.0 - s * (15.0 - 6.0 * s)) * gap_3))
    }

    /// Bound of the region's whole integral, wherever the horizon cuts it.
    #[inline(always)]
    pub(super) fn magnitude(&self, area: f32) -> f32 {
        self.bound(area, |s, gap_3| ((self.dir.z + s) / (1.0 - s)).clamp(0.0, 1.0) * gap_3)
    }

    /// k·m0 + ∇k·m1 + ½ H:m2.
    #[inline(always)]
    fn region(&self, map: &CosineMap, node: &Node) -> f32 {
        let Derivatives { value, gradient, curvature } = self.derivatives(map);
        let [first, second] = [dot(gradient, node.m1), dot(curvature, node.m2)];
        value * node.m0 + first + second
    }

    /// The kernel and its derivatives at the centre, times the factors of Taylor's series.
    #[inline(always)]
    pub(super) fn derivatives(&self, map: &CosineMap) -> Derivatives {
        let z = self.dir.z;
        let (z0, z1) = (map.c0.z * self.inv, map.c1.z * self.inv);
        let (b0, b1) = (map.c0.dot(self.dir) * self.inv, map.c1.dot(self.dir) * self.inv);
        let inv2 = self.inv * self.inv;
        let [g00, g01, g11] = map.gram;
        let h00 = 6.0 * z * b0 * b0 - 2.0 * z0 * b0 - z * g00 * inv2;
        let h01 = 6.0 * z * b0 * b1 - z0 * b1 - z1 * b0 - z * g01 * inv2;
        let h11 = 6.0 * z * b1 * b1 - 2.0 * z1 * b1 - z * g11 * inv2;
        Derivatives {
            value: self.scale * z,
            gradient: [z0 - 4.0 * z * b0, z1 - 4.0 * z * b1].map(|d| d * self.scale),
            curvature: [2.0 * h00, 4.0 * h01, 2.0 * h11].map(|d| d * self.scale),
        }
    }
}

/// k, ∇k and the parts of H that go with the moments m0, m1 and m2.
pub(super) struct Derivatives {
    pub(super) value: f32,
    pub(super) gradient: [f32; 2],
    pub(super) curvature: [f32; 3],
}

#[inline(always)]
fn dot<const N: usize>(a: [f32; N], b: [f32; N]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What the tolerance still allows at one shading point: one budget for all its lights and lobes, so that it is the
/// picture that is within the tolerance.
///
/// A bound is ten to thirty times the error it bounds, and errors of many nodes partly cancel: so a node may spend up to
/// the whole tolerance, and the more has been spent the less the next node may.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Sum of the accepted bounds, in tolerances.
    spent: f32,
    /// The largest bound that the next node may have, in tolerances.
    share: f32,
}

/// Bounds that may add up, in tolerances, before the next node's share is a quarter.
pub const SLACK: f32 = 1.0;

impl Default for Budget {
    fn default() -> Self {
        Self { spent: 0.0, share: 1.0 }
    }
}

impl Budget {
    /// Whether a node with this error bound need not be refined; if so, its bound is spent.
    #[inline(always)]
    pub(super) fn accept(&mut self, bound: f32, tolerance: f32) -> bool {
        if bound <= tolerance * self.share {
            self.spent += bound / tolerance;
            let left = SLACK / (SLACK + self.spent);
            self.share = left * left;
            return true;
        }
        false
    }
}

/// Sums of a walk: contour terms carry the factor 2π.
#[derive(Default)]
struct Sums {
    contour: f32,
    region: f32,
}

/// The clamped-cosine integral of the light over the hemisphere that `clip` leaves, signed: positive in front of
/// the light (map.depth > 0), negative behind. Nodes whose error bound is within their share of `tolerance` are not refined.
pub fn tree_integral(map: &CosineMap, clip: &Clip, tree: Nodes<'_>, tolerance: f32, budget: &mut Budget) -> Integral {
    let horizons = clip.planes();
    if map.is_close() {
        walk::<DVec2>(map, horizons, tree, tolerance, budget)
    } else {
        walk::<Vec2>(map, horizons, tree, tolerance, budget)
    }
}

/// Where a box lies with respect to all horizons.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Above,
    Cut,
    /// Wholly below the horizon of that index.
    Below(usize),
}

#[inline(always)]
pub(super) fn place(horizons: &[Horizon], center: Vec2, half: Vec2) -> Place {
    let mut place = Place::Above;
    for (i, h) in horizons.iter().enumerate() {
        match h.height.side(center, half) {
            Side::Above => {}
            Side::Cut => place = Place::Cut,
            Side::Below => return Place::Below(i),
        }
    }
    place
}

#[inline(always)]
fn walk<P: PlanePoint>(
    map: &CosineMap,
    horizons: &[Horizon],
    tree: Nodes<'_>,
    tolerance: f32,
    budget: &mut Budget,
) -> Integral {
    let Nodes { nodes, low, handles } = tree;
    let mut sums = Sums::default();
    let mut visited = 0;
    let mut i = 0;
    while i < nodes.len() {
        let node = &nodes[i];
        visited += 1;
        let kind = node.link & !LINK_MASK;
        let index = (node.link & LINK_MASK) as usize;
        let skip = if kind <= RUN { index } else { i + 1 };
        let center = node.center - map.foot;
        let (a, b) = (P::from_foot(node.a, low[i].a, map.foot), P::from_foot(node.b, low[i].b, map.foot));
        let place = place(horizons, center, node.half);
        if let Place::Below(below) = place {
            if kind != CLUSTER && horizons.len() == 2 {
                sums.contour += far_crossing(&horizons[1 - below], a, b);
            }
            i = skip;
            continue;
        }
        if kind == SEGMENT {
            sums.contour +=
                if place == Place::Above { edge_integral(map, a, b) } else { cut_edge(map, horizons, a, b) };
            i = skip;
            continue;
        }
        let expansion = Expansion::new(map, center, node.half);
        if place == Place::Above {
            if budget.accept(expansion.remainder(node.area_3()), tolerance) {
                sums.region += expansion.region(map, node);
                if kind != CLUSTER {
                    sums.contour += edge_integral(map, a, b);
                }
                i = skip;
                continue;
            }
        } else if budget.accept(expansion.magnitude(node.area()), tolerance) {
            if kind != CLUSTER {
                sums.contour += cut_edge(map, horizons, a, b);
            }
            i = skip;
            continue;
        }
        if kind == CUBIC {
            visited += cubic_leaf(map, horizons, [a, b], &handles[index], tolerance, budget, &mut sums);
        }
        i += 1;
    }
    Integral { value: sums.contour / TAU + sums.region, visited }
}

/// A curve below one horizon still crosses the other: beyond the corner of the two lines, where each crossing
/// adds the same, so that only the end points count.
#[inline]
fn far_crossing<P: PlanePoint>(other: &Horizon, a: P, b: P) -> f32 {
    match (other.height.is_above(a), other.height.is_above(b)) {
        (false, true) => other.far_crossing(),
        (true, false) => -other.far_crossing(),
        _ => 0.0,
    }
}

/// Integrates a cubic by halving it where the bound asks for it: chord plus the sliver's area times the kernel
/// at the sliver's centroid (0.4 of the sagitta off the chord). Returns the pieces visited.
#[inline(never)]
fn cubic_leaf<P: PlanePoint>(
    map: &CosineMap,
    horizons: &[Horizon],
    ends: [P; 2],
    handles: &Handles,
    tolerance: f32,
    budget: &mut Budget,
    sums: &mut Sums,
) -> u32 {
    let [p0, p3] = ends;
    let p1 = P::from_foot(handles.p1, handles.low1, map.foot);
    let p2 = P::from_foot(handles.p2, handles.low2, map.foot);
    let scalar = P::Scalar::from;
    // The first halving is certain: the whole leaf has just been refused. Piece `index` of 2^level.
    let (mut level, mut index, mut visited) = (1_u32, 0_u32, 0);
    let (d0, d1, d2) = (p1 - p0, p2 - p1, p3 - p2);
    let eval = |t: f32| cubic_point([p0, p3], [d0, d1, d2], t);
    let tangent = |t: f32| {
        let s = 1.0 - t;
        d0 * scalar(s * s) + d1 * scalar(2.0 * s * t) + d2 * scalar(t * t)
    };
    let mut a = p0;
    loop {
        visited += 1;
        let width = 1.0 / (1_u32 << level) as f32;
        let t0 = index as f32 * width;
        let t1 = t0 + width;
        let b = if index + 1 == 1 << level { p3 } else { eval(t1) };
        let (h0, h1) = (tangent(t0) * scalar(width), tangent(t1) * scalar(width));
        let chord = b - a;
        // Area between the piece's own cubic 0, h0, q2, chord and its chord: ½∫ p × dp.
        let q2 = chord - h1;
        let area = (3.0 * h0.perp_dot(q2) + 3.0 * h0.perp_dot(chord) + 6.0 * q2.perp_dot(chord)) / 20.0;
        let hull = [a, a + h0, b - h1, b].map(P::round);
        let low = hull[0].min(hull[1]).min(hull[2].min(hull[3]));
        let high = hull[0].max(hull[1]).max(hull[2].max(hull[3]));
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let place = place(horizons, center, half);
        let expansion = Expansion::new(map, center, half);
        let accept = match place {
            Place::Below(_) => true,
            Place::Above => budget.accept(expansion.remainder_at_centroid(area.abs()), tolerance),
            Place::Cut => budget.accept(expansion.magnitude(area.abs()), tolerance),
        };
        if !accept && level < DEEPEST {
            level += 1;
            index *= 2;
            continue;
        }
        match place {
            Place::Below(below) => {
                if horizons.len() == 2 {
                    sums.contour += far_crossing(&horizons[1 - below], a, b);
                }
            }
            Place::Cut => sums.contour += cut_edge(map, horizons, a, b),
            Place::Above => {
                sums.contour += edge_integral(map, a, b);
                if accept {
                    let centroid = a + chord * scalar(0.5) + (h0 - h1) * scalar(0.375 * 0.4);
                    let p = map.point(centroid.round());
                    let inv2 = 1.0 / p.length_squared();
                    sums.region += map.depth * FRAC_1_PI * p.z * inv2 * inv2 * area;
                }
            }
        }
        a = b;
        index += 1;
        while index & 1 == 0 {
            index >>= 1;
            level -= 1;
            if level == 0 {
                return visited;
            }
        }
    }
}
