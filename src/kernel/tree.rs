//! The walk over the chord–moment tree. Twin: `shaders/tree.wgsl`.
//!
//! A node is a region of the light's plane: a *run* of the contour closed by its chord, or a *cluster* of whole
//! contours (no chord). Far from the node its region is k(c)·m0 + ∇k(c)·m1 + ½ H(c):m2, the second-order Taylor
//! expansion of the kernel k = D·z / (π·|p|⁴) about the node's centre c with the region's moments; a run adds
//! its chord exactly. The walk refines a node whose remainder is above the tolerance or which a horizon cuts.

use super::cubic::cubic_point;
use super::edge::edge_integral;
use super::horizon::{Clip, Horizon, cut_edge};
use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use super::packet::{Packet, Packet2, PacketMask, Simd};
use super::wide::{Wide, Wide2};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::{FRAC_1_PI, TAU};
use glam::{DVec2, Vec2};

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

/// Halvings of a cubic at the leaf before it is taken for its chord, off which it then is by 2⁻⁴⁸ of its size, as light space is.
pub const DEEPEST: u32 = 24;

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
pub struct Integral<L: Lanes = f32> {
    /// The integral, normalised: 1 for a full hemisphere.
    pub value: L,
    /// Nodes and pieces of leaves visited.
    pub visited: L::Index,
}

/// The expansion point of a region in cosine space.
pub(super) struct Expansion<L: Lanes> {
    /// Unit direction of the region's centre.
    dir: L::Vec3,
    /// 1/|p|.
    inv: L,
    /// D / (π·|p|³).
    scale: L,
    /// Squared ratio of the region's radius to |p|.
    s2: L,
}

impl<L: Lanes> Expansion<L> {
    #[inline(always)]
    pub(super) fn new(map: &CosineMap<L>, center: L::Vec2, half: L::Vec2) -> Self {
        let p = map.point(center);
        let inv2 = map.depth.splat(1.0) / p.length_squared();
        let inv = inv2.sqrt();
        let [g00, g01, g11] = map.gram;
        let (x, y) = (half.x(), half.y());
        let r2 = x * x * g00 + y * y * g11 + x * y * g01.abs() * 2.0;
        Self { dir: p * inv, inv, scale: map.depth * FRAC_1_PI * inv2 * inv, s2: r2 * inv2 }
    }

    /// |D|/(π·|p|³) · area · terms(s, 1/(1 − s)³). Infinite where the region reaches as far as the origin.
    #[inline(always)]
    fn bound(&self, area: L, terms: impl Fn(L, L) -> L) -> L {
        let s = self.s2.sqrt();
        let gap = -s + 1.0;
        let whole = self.scale.abs() * area * terms(s, s.splat(1.0) / (gap * gap * gap));
        L::select(gap.is_positive(), whole, s.splat(f32::INFINITY))
    }

    /// Bound of the second-order expansion's remainder for a region above the horizon, from ∫ρ³|dA|.
    ///
    /// The nth term of k about p is at most (n+1)(n+2)/2·sⁿ of the scale: p/|p|⁴ has the complex generating function
    /// (1 − s·e^iθ)⁻²(1 − s·e^−iθ)⁻¹. Of the third, 10ẑ + 3.52·√(1 − ẑ²) is the exact maximum.
    #[inline(always)]
    pub(super) fn remainder(&self, area_3: L) -> L {
        let third = (self.dir.z() * 10.0 + 3.52).min(self.s2.splat(10.0));
        self.bound(area_3, |s, gap_3| self.s2 * s * (third + s * (-s * (-s * 10.0 + 24.0) + 15.0) * gap_3))
    }

    /// Bound of the zeroth-order expansion's remainder about the centroid of a sliver above the horizon, whose ∫ρ²|dA| is no
    /// more than half its area.
    #[inline(always)]
    fn remainder_at_centroid(&self, area: L) -> L {
        let second = (self.dir.z() * 6.0 + 2.0).min(self.s2.splat(6.0));
        self.bound(area * 0.5, |s, gap_3| self.s2 * (second + s * (-s * (-s * 6.0 + 15.0) + 10.0) * gap_3))
    }

    /// Bound of the region's whole integral, wherever the horizon cuts it.
    #[inline(always)]
    pub(super) fn magnitude(&self, area: L) -> L {
        self.bound(area, |s, gap_3| ((self.dir.z() + s) / (-s + 1.0)).between(0.0, 1.0) * gap_3)
    }

    /// k·m0 + ∇k·m1 + ½ H:m2.
    #[inline(always)]
    fn region(&self, map: &CosineMap<L>, node: &Node) -> L {
        let Derivatives { value, gradient, curvature } = self.derivatives(map);
        let first = gradient[0] * node.m1[0] + gradient[1] * node.m1[1];
        let second = curvature[0] * node.m2[0] + curvature[1] * node.m2[1] + curvature[2] * node.m2[2];
        value * node.m0 + first + second
    }

    /// The kernel and its derivatives at the centre, times the factors of Taylor's series.
    #[inline(always)]
    pub(super) fn derivatives(&self, map: &CosineMap<L>) -> Derivatives<L> {
        let z = self.dir.z();
        let (z0, z1) = (map.c0.z() * self.inv, map.c1.z() * self.inv);
        let (b0, b1) = (map.c0.dot(self.dir) * self.inv, map.c1.dot(self.dir) * self.inv);
        let inv2 = self.inv * self.inv;
        let [g00, g01, g11] = map.gram;
        let z6 = z * 6.0;
        let h00 = z6 * b0 * b0 - z0 * b0 * 2.0 - z * g00 * inv2;
        let h01 = z6 * b0 * b1 - z0 * b1 - z1 * b0 - z * g01 * inv2;
        let h11 = z6 * b1 * b1 - z1 * b1 * 2.0 - z * g11 * inv2;
        let z4 = z * 4.0;
        Derivatives {
            value: self.scale * z,
            gradient: [(z0 - z4 * b0) * self.scale, (z1 - z4 * b1) * self.scale],
            curvature: [h00 * 2.0 * self.scale, h01 * 4.0 * self.scale, h11 * 2.0 * self.scale],
        }
    }
}

/// k, ∇k and the parts of H that go with the moments m0, m1 and m2.
pub(super) struct Derivatives<L> {
    pub(super) value: L,
    pub(super) gradient: [L; 2],
    pub(super) curvature: [L; 3],
}

/// What the tolerance still allows at one shading point: one budget for all its lights and lobes, so that it is the
/// picture that is within the tolerance.
///
/// A bound is several times the error it bounds, and errors of many nodes partly cancel: so a node may spend up to
/// half the tolerance, and the more has been spent the less the next node may.
#[derive(Clone, Copy, Debug)]
pub struct Budget<L: Lanes = f32> {
    /// Sum of the accepted bounds, in tolerances.
    pub spent: L,
    /// The largest bound that the next node may have, in tolerances.
    pub share: L,
}

/// The largest bound that the first node may have, in tolerances.
pub const SHARE: f32 = 0.5;
/// Bounds that may add up, in tolerances, before the next node's share is a quarter of the first's.
pub const SLACK: f32 = 1.0;

impl Default for Budget {
    fn default() -> Self {
        Self { spent: 0.0, share: SHARE }
    }
}

impl<L: Lanes> Budget<L> {
    /// Where a node with this error bound need not be refined, of the lanes that ask; there, its bound is spent.
    #[inline(always)]
    pub(super) fn accept(&mut self, bound: L, tolerance: L, asking: L::Mask) -> L::Mask {
        let accepted = asking & bound.at_most(tolerance * self.share);
        if accepted.any() {
            self.spent = L::select(accepted, self.spent + bound / tolerance, self.spent);
            let left = bound.splat(SLACK) / (self.spent + SLACK);
            self.share = left * left * SHARE;
        }
        accepted
    }
}

/// The clamped-cosine integral of the light over the hemisphere that `clip` leaves, signed: positive in front of
/// the light (map.depth > 0), negative behind. Nodes whose error bound is within their share of `tolerance` are not refined.
pub fn tree_integral(map: &CosineMap, clip: &Clip, tree: Nodes<'_>, tolerance: f32, budget: &mut Budget) -> Integral {
    let horizons = clip.planes();
    if map.is_close() {
        let [integral] = walk([Lobe::<DVec2>::new(map, horizons, tolerance, true)], tree, budget);
        integral
    } else {
        let [integral] = walk([Lobe::<Vec2>::new(map, horizons, tolerance, true)], tree, budget);
        integral
    }
}

/// [`tree_integral`] in f64.
pub fn wide_integral(
    map: &CosineMap<Wide>,
    clip: &Clip<Wide>,
    tree: Nodes<'_>,
    tolerance: f32,
    budget: &mut Budget,
) -> Integral {
    let Budget { spent, share } = *budget;
    let wide = |v: f32| Wide(f64::from(v));
    let mut own = Budget { spent: wide(spent), share: wide(share) };
    let [integral] = walk([Lobe::<Wide2>::new(map, clip.planes(), wide(tolerance), true)], tree, &mut own);
    *budget = Budget { spent: own.spent.0 as f32, share: own.share.0 as f32 };
    Integral { value: integral.value.0 as f32, visited: integral.visited }
}

/// [`tree_integral`] of the lanes that take part, none of which is close ([`CosineMap::is_close`]).
#[inline(always)]
pub fn tree_integrals<S: Simd>(
    map: &CosineMap<Packet<S>>,
    clip: &Clip<Packet<S>>,
    tree: Nodes<'_>,
    tolerance: Packet<S>,
    budget: &mut Budget<Packet<S>>,
    lanes: PacketMask<S>,
) -> Integral<Packet<S>> {
    let [integral] = walk([Lobe::<Packet2<S>>::new(map, clip.planes(), tolerance, lanes)], tree, budget);
    integral
}

/// Where a box lies with respect to all horizons; neither where one may cut it.
pub(super) struct Place<M> {
    pub(super) above: M,
    /// Wholly below one of them, by its index: the first of those.
    below: [M; 2],
}

impl<M: Mask> Place<M> {
    /// Wholly below a horizon.
    #[inline(always)]
    pub(super) fn below(&self) -> M {
        self.below[0] | self.below[1]
    }
}

#[inline(always)]
pub(super) fn place<L: Lanes>(like: L, horizons: &[Horizon<L>], center: L::Vec2, half: L::Vec2) -> Place<L::Mask> {
    let mut place = Place { above: like.mask(true), below: [like.mask(false); 2] };
    for (i, h) in horizons.iter().enumerate() {
        let side = h.height.side(center, half);
        place.above = place.above & side.above;
        place.below[i] = side.below & !place.below[0];
    }
    place
}

/// The walk for one lobe of every lane: what it is about, where it is, and its sums.
pub(super) struct Lobe<'a, P: PlanePoint> {
    map: &'a CosineMap<P::Lanes>,
    horizons: &'a [Horizon<P::Lanes>],
    tolerance: P::Lanes,
    /// Lanes that take part.
    lanes: <P::Lanes as Real>::Mask,
    /// The node where each lane goes on: it has no use for those before.
    next: <P::Lanes as Lanes>::Index,
    /// 2π times the chords and closing terms.
    contour: P::Lanes,
    /// What lies between chords and curves.
    region: P::Lanes,
    visited: <P::Lanes as Lanes>::Index,
}

/// Centre and half-extents of the box around some points.
#[inline(always)]
fn box_of<V: PlanePoint<Scalar: Lanes>>([a, b, c, d]: [V; 4]) -> (V, V) {
    let (low_x, high_x) = (a.x().min(b.x()).min(c.x().min(d.x())), a.x().max(b.x()).max(c.x().max(d.x())));
    let (low_y, high_y) = (a.y().min(b.y()).min(c.y().min(d.y())), a.y().max(b.y()).max(c.y().max(d.y())));
    let center = V::of((low_x + high_x) * 0.5, (low_y + high_y) * 0.5);
    (center, V::of((high_x - low_x) * 0.5, (high_y - low_y) * 0.5))
}

/// Walks the tree for some lobes together, which share the loads of its nodes; each lobe of each lane accepts or refines for
/// itself.
#[inline(always)]
pub(super) fn walk<P: PlanePoint, const LOBES: usize>(
    mut lobes: [Lobe<'_, P>; LOBES],
    tree: Nodes<'_>,
    budget: &mut Budget<P::Lanes>,
) -> [Integral<P::Lanes>; LOBES] {
    let mut i = 0;
    while i < tree.nodes.len() {
        let node = &tree.nodes[i];
        let kind = node.link & !LINK_MASK;
        let skip = if kind <= RUN { (node.link & LINK_MASK) as usize } else { i + 1 };
        let mut refined = false;
        for lobe in &mut lobes {
            refined |= lobe.visit(&tree, i, kind, skip as u32, budget);
        }
        i = if refined { i + 1 } else { skip };
    }
    lobes.map(|lobe| Integral { value: lobe.contour * (1.0 / TAU) + lobe.region, visited: lobe.visited })
}

impl<'a, P: PlanePoint> Lobe<'a, P> {
    /// At the root. Only the given lanes walk.
    #[inline(always)]
    pub(super) fn new(
        map: &'a CosineMap<P::Lanes>,
        horizons: &'a [Horizon<P::Lanes>],
        tolerance: P::Lanes,
        lanes: <P::Lanes as Real>::Mask,
    ) -> Self {
        let [zero, none] = [map.depth.splat(0.0), map.depth.splat(0.0)];
        let start = zero.index(0);
        Self { map, horizons, tolerance, lanes, next: start, contour: zero, region: none, visited: start }
    }

    /// Adds where `mask` holds.
    #[inline(always)]
    fn add_contour(&mut self, mask: <P::Lanes as Real>::Mask, value: P::Lanes) {
        self.contour = P::Lanes::select(mask, self.contour + value, self.contour);
    }

    /// Takes what node `i` gives, and tells whether some lane wants its children.
    #[inline(always)]
    fn visit(&mut self, tree: &Nodes<'_>, i: usize, kind: u32, skip: u32, budget: &mut Budget<P::Lanes>) -> bool {
        let Self { map, horizons, tolerance, .. } = *self;
        let node = &tree.nodes[i];
        let awake = self.lanes & P::Lanes::reached(self.next, i as u32);
        self.visited = P::Lanes::count(self.visited, awake);
        let center = <P::Lanes as Lanes>::Vec2::from_foot(node.center, Vec2::ZERO, map.foot);
        let half = center.fixed(node.half);
        let end = |high: Vec2, low: Vec2| P::from_foot(high, low, map.foot);
        let (a, b) = (end(node.a, tree.low[i].a), end(node.b, tree.low[i].b));
        let place = place(map.depth, horizons, center, half);
        if kind != CLUSTER && horizons.len() == 2 {
            self.add_far_crossings(&place, awake, a, b);
        }
        let lit = awake & !place.below();
        if kind == SEGMENT {
            self.add_edge(lit & place.above, lit & !place.above, a, b);
            return false;
        }
        self.next = P::Lanes::select_index(awake, map.depth.index(skip), self.next);
        if !lit.any() {
            return false;
        }
        let expansion = Expansion::new(map, center, half);
        let mut bound = expansion.remainder(map.depth.splat(node.area_3()));
        if (lit & !place.above).any() {
            let whole = expansion.magnitude(map.depth.splat(node.area()));
            bound = P::Lanes::select(place.above, bound, whole);
        }
        let accepted = budget.accept(bound, tolerance, lit);
        if accepted.any() {
            if (accepted & place.above).any() {
                let region = expansion.region(map, node);
                self.region = P::Lanes::select(accepted & place.above, self.region + region, self.region);
            }
            if kind != CLUSTER {
                self.add_edge(accepted & place.above, accepted & !place.above, a, b);
            }
        }
        let refining = lit & !accepted;
        if kind == CUBIC {
            if refining.any() {
                let handles = &tree.handles[(node.link & LINK_MASK) as usize];
                self.cubic_leaf([a, b], handles, refining, budget);
            }
            return false;
        }
        self.next = P::Lanes::select_index(refining, map.depth.index(i as u32), self.next);
        refining.any()
    }

    /// Adds an edge of lanes above all horizons, and of lanes where one may cut it.
    #[inline(always)]
    fn add_edge(&mut self, above: <P::Lanes as Real>::Mask, cut: <P::Lanes as Real>::Mask, a: P, b: P) {
        if cut.any() {
            self.add_contour(cut | above, cut_edge(self.map, self.horizons, a, b));
        } else if above.any() {
            self.add_contour(above, edge_integral(self.map, a, b));
        }
    }

    /// Adds what an edge below one horizon adds by crossing the other.
    #[inline(always)]
    fn add_far_crossings(
        &mut self,
        place: &Place<<P::Lanes as Real>::Mask>,
        awake: <P::Lanes as Real>::Mask,
        a: P,
        b: P,
    ) {
        for (below, other) in [(place.below[0], 1), (place.below[1], 0)] {
            if (below & awake).any() {
                self.add_contour(below & awake, self.horizons[other].far_crossing(a, b));
            }
        }
    }

    /// Integrates a cubic by halving it where the bound asks for it: chord plus the sliver's area times the kernel
    /// at the sliver's centroid (0.4 of the sagitta off the chord).
    #[inline(always)]
    fn cubic_leaf(
        &mut self,
        ends: [P; 2],
        handles: &Handles,
        refining: <P::Lanes as Real>::Mask,
        budget: &mut Budget<P::Lanes>,
    ) {
        let Self { map, horizons, tolerance, .. } = *self;
        let [p0, p3] = ends;
        let p1 = P::from_foot(handles.p1, handles.low1, map.foot);
        let p2 = P::from_foot(handles.p2, handles.low2, map.foot);
        let scalar = |value: f32| p0.x().splat(value);
        let (d0, d1, d2) = (p1 - p0, p2 - p1, p3 - p2);
        let eval = |t: f32| cubic_point([p0, p3], [d0, d1, d2], t);
        let tangent = |t: f32| {
            let s = 1.0 - t;
            d0 * scalar(s * s) + d1 * scalar(2.0 * s * t) + d2 * scalar(t * t)
        };
        // The first halving is certain: the whole leaf has just been refused. Piece `index` of 2^level. Each lane goes on at
        // `next`, in the shortest of pieces, from its point `from`.
        let (mut level, mut index) = (1_u32, 0_u32);
        let mut next = map.depth.index(0);
        let mut from = p0;
        loop {
            let awake = refining & P::Lanes::reached(next, index << (DEEPEST - level));
            self.visited = P::Lanes::count(self.visited, awake);
            let width = 1.0 / (1_u32 << level) as f32;
            let t0 = index as f32 * width;
            let t1 = t0 + width;
            let (a, b) = (from, if index + 1 == 1 << level { p3 } else { eval(t1) });
            let (h0, h1) = (tangent(t0) * scalar(width), tangent(t1) * scalar(width));
            let chord = b - a;
            // Area between the piece's own cubic 0, h0, q2, chord and its chord: ½∫ p × dp.
            let q2 = chord - h1;
            let area = (h0.perp_dot(q2) * 3.0 + h0.perp_dot(chord) * 3.0 + q2.perp_dot(chord) * 6.0) * (1.0 / 20.0);
            let (center, half) = box_of([a.round(), (a + h0).round(), (b - h1).round(), b.round()]);
            let place = place(map.depth, horizons, center, half);
            let lit = awake & !place.below();
            let expansion = Expansion::new(map, center, half);
            let mut bound = expansion.remainder_at_centroid(area.abs());
            if (lit & !place.above).any() {
                bound = P::Lanes::select(place.above, bound, expansion.magnitude(area.abs()));
            }
            let accepted = budget.accept(bound, tolerance, lit);
            let halved = lit & !accepted;
            let done = if level < DEEPEST { awake & !halved } else { awake };
            if done.any() {
                if horizons.len() == 2 {
                    self.add_far_crossings(&place, done, a, b);
                }
                self.add_edge(done & lit & place.above, done & lit & !place.above, a, b);
                let sliver = accepted & place.above;
                if sliver.any() {
                    let centroid = a + chord * scalar(0.5) + (h0 - h1) * scalar(0.375 * 0.4);
                    let p = map.point(centroid.round());
                    let inv2 = map.depth.splat(1.0) / p.length_squared();
                    let region = map.depth * FRAC_1_PI * p.z() * inv2 * inv2 * area;
                    self.region = P::Lanes::select(sliver, self.region + region, self.region);
                }
                from = P::select(done, b, from);
                next = P::Lanes::select_index(done, map.depth.index((index + 1) << (DEEPEST - level)), next);
            }
            if level < DEEPEST && halved.any() {
                level += 1;
                index *= 2;
                continue;
            }
            index += 1;
            while index & 1 == 0 {
                index >>= 1;
                level -= 1;
                if level == 0 {
                    return;
                }
            }
        }
    }
}
