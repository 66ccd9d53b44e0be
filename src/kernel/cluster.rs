//! Many flat lights at once: the walk over a tree of clusters of lights. Twin: `shaders/cluster.wgsl`.
//!
//! With y the vector from the shading point to a point of a light, n the light's unit normal, and p = M⁻¹·y in cosine
//! space, a light of radiance L adds
//!
//! ```text
//! L·E = det M⁻¹/π · ∫ h(p)·w dA,    h(p) = p_z/|p|⁴,    w = −L·(y·n)
//! ```
//!
//! whatever its plane. Over a cluster of lights that all face the point, above all horizons, the first-order expansion of
//! h about the cluster's centre c leaves ∫ w dA and ∫ w·δ dA, δ the place of a light point relative to c. Both are affine
//! in y(c): one 4 × 4 matrix of moments for each channel holds them. With all w ≥ 0 the remainder (Gegenbauer:
//! |C_n^(2)| ≤ (n+1)(n+2)(n+3)/6) is at most
//!
//! ```text
//! det M⁻¹/π · ∫ w dA · (10·ẑ + 4)·s²/(1−s)⁴/|p|³,    s = (radius of the cluster in cosine space)/|p|, ẑ = p_z/|p|
//! ```
//!
//! A cluster behind which the point lies, or that is below a horizon, adds nothing; one whose whole integral is below the
//! error that is still allowed is left out; any other is refined, down to single lights.

use super::frame::ShadingFrame;
use super::tree::Budget;
use crate::brdf::ltc::Lobe;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::FRAC_1_PI;
use glam::{DVec3, Mat4, Vec3};

/// A single light; the index is its place among the members. Otherwise the index is where the walk goes on past the cluster.
pub const SINGLE: u32 = 1 << 31;
/// One side of a light that shines to both: it counts where the point is in front of it.
pub const HALF: u32 = 1 << 30;
/// Bits of [`Cluster::link`] that hold the index.
pub const INDEX_MASK: u32 = HALF - 1;

/// Rounding of lengths in f32, relative.
pub const ROUNDING: f32 = 1e-6;

/// Lobes of a shading point: diffuse and specular.
pub const LOBES: usize = 2;

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
    /// Sine of the half-angle of the cone; 0 where that is more than a right angle.
    pub cone_sin: f32,
    /// Of the layout.
    pub pad: [f32; 3],
}

/// The moments of a cluster for each channel: times (y, 1) they are −(∫w·δ dA, ∫w dA).
///
/// Column i, of x, y, z: ∫L·nᵢ·δ dA and, fourth, ∫L·nᵢ dA. Fourth column: ∫L·(n·δ)·δ dA and ∫L·(n·δ) dA.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Moments {
    /// Red, green, blue.
    pub channels: [Mat4; 3],
}

/// The arrays of a tree of clusters.
#[derive(Clone, Copy, Debug)]
pub struct Clusters<'a> {
    /// In pre-order.
    pub clusters: &'a [Cluster],
    /// One for each cluster.
    pub moments: &'a [Moments],
    /// The tree's unit of length over a metre.
    pub per_metre: f32,
}

/// A lobe and what it reflects, as seen by clusters.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Rows of the map from the world to cosine space.
    rows: [Vec3; 3],
    /// Normal of the surface's true horizon, or of the lobe's own where only that one clips; world space, any length.
    up: Vec3,
    /// Absolute products of the map's columns: xx, yy, zz and twice xy, xz, yz.
    gram: [Vec3; 2],
    /// det M⁻¹/π.
    scale: f32,
    /// Reflected radiance over radiance and integral.
    weight: Vec3,
}

impl Field {
    /// The plain cosine, or a lobe clipped at its horizons, that reflects by `weight`.
    pub fn new(frame: &ShadingFrame, lobe: Option<&Lobe>, weight: Vec3) -> Self {
        let [x, y, z] = [frame.x, frame.y, frame.z].map(DVec3::as_vec3);
        let (rows, up, determinant) = match lobe {
            None => ([x, y, z], z, 1.0),
            Some(lobe) => {
                let m = &lobe.m_inv;
                let rows = [x * m.xx + z * m.xz, y * m.yy, x * m.zx + z * m.zz];
                let tilted = lobe.m_row_z.x != 0.0 || lobe.m_row_z.y != 0.0;
                (rows, if tilted { z } else { rows[2] }, m.yy * (m.xx * m.zz - m.xz * m.zx))
            }
        };
        let [a, b, c] = rows;
        let squares = a * a + b * b + c * c;
        let products = |i: usize, j: usize| 2.0 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j]).abs();
        let mixed = Vec3::new(products(0, 1), products(0, 2), products(1, 2));
        Self { rows, up, gram: [squares, mixed], scale: determinant * FRAC_1_PI, weight }
    }

    /// Squared radius in cosine space of a box with these half-extents.
    #[inline(always)]
    fn radius_squared(&self, half: Vec3) -> f32 {
        let mixed = Vec3::new(half.x * half.y, half.x * half.z, half.y * half.z);
        self.gram[0].dot(half * half) + self.gram[1].dot(mixed)
    }
}

/// How a cluster stands to a shading point.
#[derive(Clone, Copy, Debug)]
struct View {
    /// From the point to the cluster's centre.
    y: Vec3,
    /// |y|.
    distance: f32,
    /// Least and most of −y·n over all light points.
    front: [f32; 2],
}

impl View {
    #[inline(always)]
    fn new(cluster: &Cluster, position: Vec3) -> Self {
        let y = cluster.center - position;
        let square = y.length_squared();
        let distance = square.sqrt();
        // In the plane of y and the axis: the normals between the two sides of the cone.
        let along = -cluster.axis.dot(y);
        let across = (square - along * along).max(0.0).sqrt();
        let least = cluster.cone_cos * along - cluster.cone_sin * across;
        let most = cluster.cone_cos * along + cluster.cone_sin * across;
        let most = if along >= cluster.cone_cos * distance { distance } else { most };
        let slack = ROUNDING * distance;
        Self { y, distance, front: [least - cluster.high - slack, most - cluster.low + slack] }
    }
}

/// What a lobe sees of a cluster.
#[derive(Clone, Copy, Debug)]
struct Sight {
    /// Unit direction of the centre in cosine space.
    dir: Vec3,
    /// 1/|p|.
    inv: f32,
    /// Bound of the first-order expansion's error; infinite where it does not hold.
    error: f32,
    /// Bound of the integral; 0 below a horizon, infinite where the cluster reaches as far as the point.
    most: f32,
}

impl Sight {
    #[inline(always)]
    fn new(field: &Field, cluster: &Cluster, view: &View) -> Self {
        let [a, b, c] = field.rows;
        let p = Vec3::new(a.dot(view.y), b.dot(view.y), c.dot(view.y));
        let inv2 = 1.0 / p.length_squared();
        let inv = inv2.sqrt();
        let dir = p * inv;
        let s = (field.radius_squared(cluster.half) * inv2).sqrt();
        let gap = 1.0 - s;
        let gap2 = gap * gap;
        let reach = c.abs().dot(cluster.half) * inv + ROUNDING;
        let height = field.up.dot(view.y);
        let up_reach = field.up.abs().dot(cluster.half + ROUNDING * view.distance);
        let above = dir.z - reach > 0.0 && height - up_reach > 0.0;
        let below = dir.z + reach < 0.0 || height + up_reach < 0.0;
        let bright = (field.weight * cluster.flux).max_element();
        let unit = field.scale * inv * inv2 * view.front[1] * bright / (gap2 * gap2);
        // p_z/|p|⁴ is at most (ẑ + s)/(1 − s)⁴, and 1/(1 − s)³, over |p|³.
        let most = unit * (dir.z + reach.min(s)).min(gap).max(0.0);
        let error = unit * (10.0 * dir.z + 4.0) * s * s;
        let (holds, far) = (above && view.front[0] > 0.0 && gap > 0.0, gap > 0.0);
        Self {
            dir,
            inv,
            error: if holds { error } else { f32::INFINITY },
            most: if below { 0.0 } else if far { most } else { f32::INFINITY },
        }
    }

    /// The first-order expansion: reflected radiance.
    #[inline(always)]
    fn radiance(&self, field: &Field, moments: &Moments, view: &View) -> Vec3 {
        let [a, b, c] = field.rows;
        let d = self.dir;
        let gradient = c - (a * d.x + b * d.y + c * d.z) * (4.0 * d.z);
        let kernel = (gradient * self.inv).extend(d.z);
        let y = view.y.extend(1.0);
        let sums = moments.channels.map(|m| -(m * y).dot(kernel));
        Vec3::from_array(sums).max(Vec3::ZERO) * field.weight * (field.scale * self.inv * self.inv * self.inv)
    }
}

/// What a walk has answered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Radiance reflected by each lobe.
    pub radiance: [Vec3; LOBES],
    /// Clusters visited.
    pub visited: u32,
    /// Lobes for which a cluster was taken whole.
    pub taken: u32,
}

/// What became of a cluster for a lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It has been added or left out.
    Done,
    /// Its parts must be looked at.
    Refine,
}

/// Walks the clusters for all lobes at the point `position` (metres, relative to the camera). What must be integrated itself
/// is handed to `single`: the index of the member, the lobes (a bit for each) and what is left of the budget.
///
/// `lobes` that reflect nothing are left out. `tolerance` is for the reflected radiance.
pub fn walk_clusters(
    clusters: Clusters<'_>,
    position: Vec3,
    lobes: &[Option<Field>; LOBES],
    tolerance: f32,
    budget: &mut Budget,
    mut single: impl FnMut(usize, u32, &mut Budget),
) -> Answer {
    let mut answer = Answer::default();
    let end = clusters.clusters.len() as u32;
    // Where each lobe goes on.
    let mut next = lobes.each_ref().map(|lobe| if lobe.is_some() { 0 } else { end });
    let position = position * clusters.per_metre;
    let mut i = next[0].min(next[1]);
    while i < end {
        let cluster = &clusters.clusters[i as usize];
        answer.visited += 1;
        let is_single = cluster.link & SINGLE != 0;
        let skip = if is_single { i + 1 } else { cluster.link };
        let view = View::new(cluster, position);
        let away = if cluster.link & HALF != 0 && is_single {
            cluster.axis.dot(view.y) >= 0.0
        } else {
            view.front[1] <= 0.0
        };
        let mut singles = 0;
        for (k, lobe) in lobes.iter().enumerate() {
            let Some(field) = lobe.as_ref().filter(|_| next[k] <= i) else { continue };
            let mut fate = Fate::Done;
            if !away {
                let sight = Sight::new(field, cluster, &view);
                if sight.error < sight.most && budget.accept(sight.error, tolerance) {
                    let moments = &clusters.moments[i as usize];
                    answer.radiance[k] += sight.radiance(field, moments, &view);
                    answer.taken += 1;
                } else if !budget.accept(sight.most, tolerance) {
                    fate = Fate::Refine;
                }
            }
            next[k] = skip;
            if fate == Fate::Refine {
                if is_single {
                    singles |= 1 << k;
                } else {
                    next[k] = i + 1;
                }
            }
        }
        if singles != 0 {
            single((cluster.link & INDEX_MASK) as usize, singles, budget);
        }
        i = next[0].min(next[1]);
    }
    answer
}
