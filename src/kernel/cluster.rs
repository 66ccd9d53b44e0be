//! Many flat lights at once: what a cluster of them sends to shading points. Twin: `shaders/cluster.wgsl`.
//!
//! With y the vector from a shading point to a point of a light, n the light's unit normal, and p = M⁻¹·y in cosine
//! space, a light of radiance L adds
//!
//! ```text
//! L·E = det M⁻¹/π · ∫ h(p)·w dA,    h(p) = p_z/|p|⁴,    w = −L·(y·n)
//! ```
//!
//! whatever its plane. Over a cluster of lights that all face the point, above all horizons, the first-order expansion of
//! h about the cluster's centre needs ∫ w dA and ∫ w·δ dA, δ the place of a light point relative to the centre. Both are
//! affine in the centre's y: one 4 × 4 matrix of moments for each channel holds them. With q = M⁻¹·δ and s the cluster's
//! radius in cosine space over |p|, the expansion leaves out at most the smaller of
//!
//! ```text
//! det M⁻¹/π · ∫ w·|q|² dA · ((6ẑ + 2) + s·(10 − 15s + 6s²)/(1−s)³)/|p|⁵
//! det M⁻¹/π · ∫ w·(ẑ·|q|²·T₂ + |q_z|·|q|·T₁) dA/|p|⁵,    T₁ = ((1−s)⁻⁴ − 1)/s,    T₂ = 10 + 20s + 35s²/(1−s)⁴
//! ```
//!
//! The first bounds the series of h by that of p/|p|⁴, as in [`super::tree`]; the second bounds the factors of z and q_z by those of
//! |p|⁻⁴ (Gegenbauer: |C_n^(2)| ≤ (n+1)(n+2)(n+3)/6) and knows that far lights low over the horizon have little height to differ in.
//!
//! A cluster behind which the point lies, or that is below a horizon, adds nothing; one whose whole integral is below the
//! error that is still allowed is left out; any other is refined, down to single lights. All of this is decided for the
//! shading points of a tile at once ([`super::cluster_list`]): positions, normals and rows of M⁻¹ are known by boxes that hold
//! those of all points. What single lights about which a tile can't decide send, is decided by each point
//! ([`super::cluster_walk`]). The plain cosine is smoother than lobes: over a tile its integral over what is far is linear
//! ([`super::local`]).

use super::lanes::{Lanes, Mask, Vector};
use super::receiver::{Field, Loose, PLAIN, dot_fixed, fixed, length, magnitudes};
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};

/// A single light; the index is that of its emission. Otherwise the index is where the walk goes on past the cluster.
pub const SINGLE: u32 = 1 << 31;
/// One side of a light that shines to both: it counts where the point is in front of it.
pub const HALF: u32 = 1 << 30;
/// Bits of [`Cluster::link`] that hold the index.
pub const INDEX_MASK: u32 = HALF - 1;

/// Rounding of lengths in f32, relative.
pub const ROUNDING: f32 = 1e-6;

/// A cluster of lights, in pre-order. Lengths are in the tree's unit, places relative to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Cluster {
    /// Middle of the cluster's box, about which the moments are taken.
    pub center: Vec3,
    /// Kind and index.
    pub link: u32,
    /// Half-extents of the box.
    pub half: Vec3,
    /// Least height over the centre of a light's plane, along the light's normal, less rounding.
    pub low: f32,
    /// Axis of the cone that holds the lights' normals, unit.
    pub axis: Vec3,
    /// Most height over the centre of a light's plane, plus rounding; 0 or more. Huge where the cone is wider than a half-space.
    pub high: f32,
    /// ∫L dA, of the unsigned area.
    pub flux: Vec3,
    /// Cosine of the half-angle of the cone; −1 where that is more than a right angle.
    pub cone_cos: f32,
    /// Largest over the channels of ∫L·δᵢ² dA / ∫L dA: x, y, z.
    pub squares: Vec3,
    /// Sine of the half-angle of the cone; 0 where that is more than a right angle.
    pub cone_sin: f32,
    /// The same of the mixed products: xy, xz, yz.
    pub products: Vec3,
    /// Of the layout.
    pub pad: f32,
    /// The moments of red, green and blue: times (y, 1) they are −(∫w·δ dA, ∫w dA).
    ///
    /// Column i, of x, y, z: ∫L·nᵢ·δ dA and, fourth, ∫L·nᵢ dA. Fourth column: ∫L·(n·δ)·δ dA and ∫L·(n·δ) dA.
    pub moments: [Mat4; 3],
}

impl Cluster {
    /// Whether it is one light, or one side of one.
    #[inline(always)]
    pub const fn is_single(&self) -> bool {
        self.link & SINGLE != 0
    }

    /// Where the walk goes on past the cluster of that index.
    #[inline(always)]
    pub(super) fn end(&self, index: u32) -> u32 {
        if self.is_single() { index + 1 } else { self.link }
    }
}

/// The arrays of a tree of clusters.
#[derive(Clone, Copy, Debug)]
pub struct Clusters<'a> {
    /// In pre-order.
    pub clusters: &'a [Cluster],
    /// The tree's unit of length over a metre.
    pub per_metre: f32,
}

/// How a cluster stands to shading points.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<L: Lanes> {
    /// From the middle of the points to the cluster's centre.
    pub(super) y: L::Vec3,
    /// Half-extents of where y may lie.
    open: L::Vec3,
    /// |y|.
    distance: L,
    /// Least and most of −y·n over all light points, for all shading points.
    front: [L; 2],
}

impl<L: Lanes> View<L> {
    /// Of all points of a tile, or of a single one where `TILE` is false.
    #[inline(always)]
    pub(super) fn new<const TILE: bool>(like: L, cluster: &Cluster, position: &Loose<L>) -> Self {
        let y = fixed(like, cluster.center) - position.middle;
        let square = y.length_squared();
        let distance = square.sqrt();
        // In the plane of y and the axis: the normals between the two sides of the cone.
        let along = -dot_fixed::<L>(y, cluster.axis);
        let across = (square - along * along).max(like.splat(0.0)).sqrt();
        let (middle, side) = (along * cluster.cone_cos, across * cluster.cone_sin);
        let in_cone = (distance * cluster.cone_cos).at_most(along);
        let most = L::select(in_cone, distance, middle + side);
        let mut slack = distance * ROUNDING;
        if TILE {
            slack = slack + length::<L>(position.half);
        }
        let front = [middle - side - cluster.high - slack, most - cluster.low + slack];
        Self { y, open: position.half, distance, front }
    }

    /// Where no light of the cluster shines on any of the points.
    #[inline(always)]
    pub(super) fn is_away<const TILE: bool>(&self, cluster: &Cluster) -> L::Mask {
        let zero = self.distance.splat(0.0);
        if cluster.link & HALF != 0 && cluster.is_single() {
            // Of both sides exactly one is in front of a single point.
            let mut back = dot_fixed::<L>(self.y, cluster.axis);
            if TILE {
                back = back - dot_fixed::<L>(self.open, cluster.axis.abs());
            }
            zero.at_most(back)
        } else {
            self.front[1].at_most(zero)
        }
    }
}

/// What a lobe sees of a cluster.
#[derive(Clone, Copy, Debug)]
struct Sight<L> {
    /// Bound of the first-order expansion's error; infinite where it does not hold.
    error: L,
    /// Bound of the integral; 0 below a horizon, infinite where the cluster reaches as far as the point.
    most: L,
    /// Bound of what the plain cosine's local expansion about the middle of a tile is off by beyond that; infinite for a lobe, and where
    /// the tile is as large as the cluster is far.
    shift: L,
}

impl<L: Lanes> Sight<L> {
    /// Of all points of a tile, or of a single one where `TILE` is false. To the plain cosine of a point the world and cosine space
    /// are the same but for a rotation.
    #[inline(always)]
    fn new<const TILE: bool, const LOBE: usize>(field: &Field<L>, cluster: &Cluster, view: &View<L>) -> Self {
        let round = LOBE == PLAIN && !TILE;
        let [a, b, c] = &field.rows;
        let half = cluster.half;
        let like = view.distance;
        let zero = like.splat(0.0);
        let p = L::Vec3::of(a.middle.dot(view.y), b.middle.dot(view.y), c.middle.dot(view.y));
        let height = if LOBE == PLAIN { p.z() } else { field.up.middle.dot(view.y) };
        // How far p and the height may be from that, and how far the cluster reaches over its centre.
        let noise = like * ROUNDING;
        let over = L::Vec3::of(noise + half.x, noise + half.y, noise + half.z);
        let mut off = fixed(like, Vec3::ZERO);
        let mut reach = magnitudes::<L>(c.middle).dot(over);
        let mut up_reach = if LOBE == PLAIN { reach } else { magnitudes::<L>(field.up.middle).dot(over) };
        let mut nearest = if round { view.distance } else { length::<L>(p) };
        let mut radius = if round { like.splat(half.length()) } else { field.radius(half) };
        if TILE {
            let far = magnitudes::<L>(view.y) + view.open;
            off = L::Vec3::of(open(a, view.open, far), open(b, view.open, far), open(c, view.open, far));
            reach = reach + dot_fixed::<L>(c.half, half);
            up_reach = up_reach + open(&field.up, view.open, far + fixed(like, half));
            nearest = nearest - length::<L>(off);
            radius = radius + field.slack(half);
        }
        let below = zero.above(p.z() + off.z() + reach) | zero.above(height + up_reach);
        let above = (p.z() - off.z() - reach).is_positive() & (height - up_reach).is_positive();
        let inv = like.splat(1.0) / nearest;
        let z = ((p.z() + off.z()) * inv).between(0.0, 1.0);
        let s = radius * inv;
        let gap = -s + 1.0;
        let apart = nearest.is_positive() & gap.is_positive();
        let bright = field.weight;
        let flux = cluster.flux;
        let bright = (bright.x() * flux.x).max(bright.y() * flux.y).max(bright.z() * flux.z);
        let unit = field.scale * bright * (view.front[1] * inv) * (inv * inv);
        let per_gap = like.splat(1.0) / gap;
        let per_gap_2 = per_gap * per_gap;
        let per_gap_4 = per_gap_2 * per_gap_2;
        // p_z/|p|⁴ is at most (ẑ + s)/(1 − s)⁴, and 1/(1 − s)³, over |p|³.
        let most = unit * per_gap_4 * (z + s.min(reach * inv)).min(gap);
        let infinite = like.splat(f32::INFINITY);
        let most = L::select(below, zero, L::select(apart, most, infinite));
        let expands = above & apart & view.front[0].is_positive() & !below;
        if !expands.any() {
            return Self { error: infinite, most, shift: infinite };
        }
        // Root means of |q|² and q_z², over |p|.
        let (squares, products) = (cluster.squares, cluster.products);
        let m = c.middle;
        let mixed = L::Vec3::of(m.x() * m.y(), m.x() * m.z(), m.y() * m.z());
        let square = L::Vec3::of(m.x() * m.x(), m.y() * m.y(), m.z() * m.z());
        let mut mean = if round {
            like.splat((squares.x + squares.y + squares.z).sqrt())
        } else {
            root::<L>(field.squares, field.products, squares, products)
        };
        let mut rise = root::<L>(square, mixed, squares, products);
        if TILE {
            let spread = Vec3::new(squares.x.sqrt(), squares.y.sqrt(), squares.z.sqrt());
            mean = mean + field.slack(spread);
            rise = rise + dot_fixed::<L>(c.half, spread);
        }
        let (mean, rise) = (mean * inv, rise * inv);
        let third = per_gap_2 * per_gap;
        let together = (z * 6.0 + 2.0).min(like.splat(6.0)) + s * (-(s * (-(s * 6.0) + 15.0)) + 10.0) * third;
        let t2 = s * (s * 35.0 * per_gap_4 + 20.0) + 10.0;
        let t1 = s * t2 + 4.0;
        let error = unit * mean * (mean * together).min(z * mean * t2 + rise * t1);
        let mut shift = infinite;
        if TILE && LOBE == PLAIN {
            let size = length::<L>(view.open) * inv;
            let gap = -size + 1.0;
            let per_gap = like.splat(1.0) / gap;
            let series = size * size * (per_gap * per_gap * per_gap);
            let sum = unit * (mean * 30.0 + 6.0) + field.scale * bright * (inv * inv) * (mean * 12.0 + 3.0);
            shift = L::select(gap.is_positive(), series * sum, infinite);
        }
        Self { error: L::select(expands, error, infinite), most, shift }
    }
}

/// Root of a quadratic form whose squares and products are weighted with those of a cluster.
#[inline(always)]
fn root<L: Lanes>(squares: L::Vec3, products: L::Vec3, weights: Vec3, mixed: Vec3) -> L {
    let sum = dot_fixed::<L>(squares, weights) + dot_fixed::<L>(products, mixed) * 2.0;
    sum.max(sum.splat(0.0)).sqrt()
}

/// How far the product of a loose vector with one open by `open` may be off; `far` holds the magnitudes of the latter.
#[inline(always)]
fn open<L: Lanes>(v: &Loose<L>, open: L::Vec3, far: L::Vec3) -> L {
    magnitudes::<L>(v.middle).dot(open) + v.half.dot(far)
}

/// What clusters may still be off by at a shading point: one budget for all clusters and lobes, apart from that of the lights that
/// are integrated.
///
/// A bound is some twenty times the error it bounds, and errors of many clusters partly cancel. So no cluster may spend more than
/// [`FIRST_SHARE`] or [`LOCAL_SHARE`], and the more has been spent the less the next may.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterBudget<L: Lanes = f32> {
    /// Sum of the accepted bounds, in tolerances.
    pub spent: L,
}

/// The largest bound that the first cluster may have, in tolerances.
pub const FIRST_SHARE: f32 = 1.0;
/// The same where a tile's local expansion stands for it, whose bound is more than that above its error.
pub const LOCAL_SHARE: f32 = 2.0;
/// Bounds that may add up, in tolerances, before the next cluster's share is a quarter of the first's.
pub const CLUSTER_SLACK: f32 = 64.0;
/// The part of the tolerance that is for clusters, where there are any; the rest is for the lights that are integrated. What clusters
/// are off by is about that; what integrals are, far less than their part, for their bounds are added up.
pub const CLUSTER_PART: f32 = 0.3;
/// What the bound of a cluster that is left out weighs: it is a few times the error only, and all such errors have one sign.
pub const LEFT_OUT: f32 = 4.0;

impl Default for ClusterBudget {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl<L: Lanes> ClusterBudget<L> {
    /// Of which nothing is spent.
    #[inline(always)]
    pub fn new(like: L) -> Self {
        Self { spent: like.splat(0.0) }
    }

    /// Where a bound is small enough, of the lanes that ask; there it is spent. The first may be `share` tolerances.
    #[inline(always)]
    fn accept(&mut self, bound: L, tolerance: L, share: f32, asking: L::Mask) -> L::Mask {
        let left = bound.splat(CLUSTER_SLACK) / (self.spent + CLUSTER_SLACK);
        let accepted = asking & bound.at_most(tolerance * (left * left * share));
        self.spent = L::select(accepted, self.spent + bound / tolerance, self.spent);
        accepted
    }
}

/// What becomes of a cluster for a lobe, where it was asked; elsewhere it adds nothing, or nothing that counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fates<M> {
    /// The expansion stands for it.
    pub(super) whole: M,
    /// The local expansion of the tile does.
    pub(super) local: M,
    /// Its parts must be looked at.
    pub(super) refine: M,
}

impl<M: Mask> Fates<M> {
    /// For all points of a tile, or for a single one where `TILE` is false; of the lanes that ask.
    #[inline(always)]
    pub(super) fn new<const TILE: bool, const LOBE: usize, L: Lanes<Mask = M>>(
        field: &Field<L>,
        cluster: &Cluster,
        view: &View<L>,
        tolerance: L,
        budget: &mut ClusterBudget<L>,
        asking: M,
    ) -> Self {
        let Sight { error, most, shift } = Sight::new::<TILE, LOBE>(field, cluster, view);
        let expands = most.above(error);
        let mut local = tolerance.mask(false);
        if TILE && LOBE == PLAIN {
            local = budget.accept(error + shift, tolerance, LOCAL_SHARE, asking & expands);
        }
        let asking = asking & !local;
        let bound = L::select(expands, error, most * LEFT_OUT);
        let accepted = budget.accept(bound, tolerance, FIRST_SHARE, asking);
        Self { whole: accepted & expands, local, refine: asking & !accepted }
    }
}

/// The first-order expansion of ∫ h·w dA at single points, for each channel: what det M⁻¹/π and what the lobe reflects are
/// multiplied with. `y` leads to the cluster's centre.
#[inline(always)]
pub(super) fn expansion<L: Lanes, const LOBE: usize>(field: &Field<L>, cluster: &Cluster, y: L::Vec3) -> [L; 3] {
    let [a, b, c] = [field.rows[0].middle, field.rows[1].middle, field.rows[2].middle];
    // The image of the direction to the centre, and back.
    let (height, inv, inv2, back) = if LOBE == PLAIN {
        let square = y.length_squared();
        let inv2 = square.splat(1.0) / square;
        let inv = inv2.sqrt();
        (c.dot(y) * inv, inv, inv2, y * inv)
    } else {
        let p = L::Vec3::of(a.dot(y), b.dot(y), c.dot(y));
        let square = p.length_squared();
        let inv2 = square.splat(1.0) / square;
        let inv = inv2.sqrt();
        let d = p * inv;
        (d.z(), inv, inv2, a * d.x() + b * d.y() + c * d.z())
    };
    // h and its gradient in the world, times |p|³.
    let gradient = (c - back * (height * 4.0)) * inv;
    let [red, green, blue] = &cluster.moments;
    let per_cube = inv * inv2;
    [
        channel(red, gradient, height, y) * per_cube,
        channel(green, gradient, height, y) * per_cube,
        channel(blue, gradient, height, y) * per_cube,
    ]
}

/// One channel's moments at (y, 1), with h and its gradient.
#[inline(always)]
fn channel<L: Lanes>(m: &Mat4, gradient: L::Vec3, height: L, y: L::Vec3) -> L {
    let (x, y, z) = (y.x(), y.y(), y.z());
    let first = gradient.x() * (x * m.x_axis.x + y * m.y_axis.x + z * m.z_axis.x + m.w_axis.x)
        + gradient.y() * (x * m.x_axis.y + y * m.y_axis.y + z * m.z_axis.y + m.w_axis.y)
        + gradient.z() * (x * m.x_axis.z + y * m.y_axis.z + z * m.z_axis.z + m.w_axis.z);
    let zeroth = height * (x * m.x_axis.w + y * m.y_axis.w + z * m.z_axis.w + m.w_axis.w);
    (-(first + zeroth)).max(height.splat(0.0))
}
