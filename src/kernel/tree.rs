//! The walk over the chord–moment tree. Twin: `shaders/tree.wgsl`.
//!
//! A node is a region of the light's plane: a *run* of the contour closed by its chord, or a *cluster* of whole
//! contours (no chord). Far from the node its region is the third-order Taylor expansion of the kernel about the node's centre
//! with the region's moments ([`super::expansion`]); a run adds its chord exactly. The walk refines a node whose remainder is
//! above the tolerance or which a horizon cuts.

use super::cubic::cubic_point;
use super::edge::edge_integral;
use super::expansion::{Bound, Expansion};
use super::horizon::{Clip, Horizon, cut_edge};
use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
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
    /// ∫x dA, ∫y dA; these and the next with x and y over [`Node::unit`], so that the moments of small contours are numbers.
    pub m1: [f32; 2],
    /// ∫x² dA, ∫xy dA, ∫y² dA.
    pub m2: [f32; 3],
    /// ∫x³ dA, ∫x²y dA, ∫xy² dA, ∫y³ dA.
    pub m3: [f32; 4],
    /// Unsigned area, and the same integral of ρ⁴, ρ the larger of |x| and |y| in half-extents of the box: see [`areas`].
    pub areas: u32,
    /// Kind and index.
    pub link: u32,
}

/// Two bounds in one word: the upper 16 bits of each, rounded up.
pub fn areas(area: f32, area_4: f32) -> u32 {
    let up = |v: f32| v.to_bits().saturating_add(0xffff) & !0xffff;
    up(area) | up(area_4) >> 16
}

impl Node {
    /// The length that x and y are measured in, in the moments: the box's larger half-extent.
    #[inline(always)]
    pub fn unit(&self) -> f32 {
        self.half.x.max(self.half.y)
    }

    /// ∫|dA|.
    #[inline(always)]
    pub fn area(&self) -> f32 {
        f32::from_bits(self.areas & !0xffff)
    }

    /// ∫ρ⁴|dA|, ρ the larger of |x| and |y| in half-extents of the box.
    #[inline(always)]
    pub fn area_4(&self) -> f32 {
        f32::from_bits(self.areas << 16)
    }
}

/// The handles of a cubic leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Handles {
    /// First handle.
    pub p1: Vec2,
    /// Second handle.
    pub p2: Vec2,
    /// What f32 lost of the first handle.
    pub low1: DVec2,
    /// What f32 lost of the second handle.
    pub low2: DVec2,
}

/// What f32 lost of a node's chord ends. Read only where a lobe's footprint on the light is so small that it shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LowEnds {
    /// Of [`Node::a`].
    pub a: DVec2,
    /// Of [`Node::b`].
    pub b: DVec2,
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

/// What the tolerance still allows at one shading point: one budget for all its lights and lobes, so that it is the
/// picture that is within the tolerance.
///
/// A bound is several times the error it bounds, and errors of many nodes partly cancel: so a node may spend up to
/// half the tolerance, and the more has been spent the less the next node may.
#[derive(Clone, Copy, Debug)]
pub struct Budget<L: Lanes = f32> {
    /// [`SLACK`] over the sum of itself and the accepted bounds, in tolerances: 1 where nothing has been spent.
    pub left: L,
}

/// The largest bound that the first node may have, in tolerances.
pub const SHARE: f32 = 0.5;
/// Bounds that may add up, in tolerances, before the next node's share is a quarter of the first's.
pub const SLACK: f32 = 1.0;

impl Default for Budget {
    fn default() -> Self {
        Self { left: 1.0 }
    }
}

impl<L: Lanes> Budget<L> {
    /// Where a node with this error bound need not be refined, of the lanes that ask; there, its bound is spent.
    #[inline(always)]
    pub(super) fn accept(&mut self, bound: Bound<L>, tolerance: L, asking: L::Mask) -> L::Mask {
        let Bound { numerator, denominator } = bound;
        let allowed = denominator * tolerance;
        let accepted = asking & numerator.at_most(allowed * self.left * self.left * SHARE);
        if accepted.any() {
            // 1/left grows by the bound over SLACK.
            let left = self.left * allowed / (self.left * numerator * (1.0 / SLACK) + allowed);
            self.left = L::select(accepted, left, self.left);
        }
        accepted
    }
}

/// The clamped-cosine integral of the light over the hemisphere that `clip` leaves, signed: positive in front of
/// the light (map.depth > 0), negative behind. Nodes whose error bound is within their share of `tolerance` are not refined.
/// Only the given lanes take part; where one is close ([`CosineMap::is_close`]) it wants f64.
#[inline(always)]
pub fn tree_integral<L: Lanes>(
    map: &CosineMap<L>,
    clip: &Clip<L>,
    tree: Nodes<'_>,
    tolerance: L,
    budget: &mut Budget<L>,
    lanes: L::Mask,
) -> Integral<L> {
    let [integral] = walk([Lobe::<L::Vec2>::new(map, clip.planes(), tolerance, lanes)], tree, budget);
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
        let (zero, start) = (map.depth.splat(0.0), map.depth.index(0));
        Self { map, horizons, tolerance, lanes, next: start, contour: zero, region: zero, visited: start }
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
        let center = <P::Lanes as Lanes>::Vec2::from_foot(node.center, DVec2::ZERO, map.foot);
        let half = center.fixed(node.half);
        let end = |high: Vec2, low: DVec2| P::from_foot(high, low, map.foot);
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
        let [area, area_4] = [node.area(), node.area_4()].map(|area| map.depth.splat(area));
        let bound = expansion.region_bound::<4>(place.above, lit, area, area_4);
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
            // The zeroth order about the centroid of a sliver, whose ∫ρ²|dA| is no more than half its area.
            let bound = expansion.region_bound::<2>(place.above, lit, area.abs(), area.abs() * 0.5);
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
