//! Many flat lights at once: the walk over a tree of clusters of lights. Twin: `shaders/cluster.wgsl`.
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
//! shading points of a tile at once ([`list_clusters`]): positions, normals and rows of M⁻¹ are known by boxes that hold
//! those of all points. What holds for some points only is decided by each ([`ClusterSums::add`]).

use super::lanes::{Lanes, Vector};
use super::reflect::Reflectance;
use super::tile::{Extent, TileBounds};
use super::tree::Budget;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::FRAC_1_PI;
use glam::{Mat4, Vec3};

/// A single light; the index is that of its emission. Otherwise the index is where the walk goes on past the cluster.
pub const SINGLE: u32 = 1 << 31;
/// One side of a light that shines to both: it counts where the point is in front of it.
pub const HALF: u32 = 1 << 30;
/// Bits of [`Cluster::link`] that hold the index.
pub const INDEX_MASK: u32 = HALF - 1;

/// Rounding of lengths in f32, relative.
pub const ROUNDING: f32 = 1e-6;

/// Most clusters that a tile lists. Where it would be more, each of its points walks for itself.
pub const MOST_LISTED: usize = 512;

/// Lobes of a shading point: the plain cosine and the specular lobe.
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
    fn end(&self, index: u32) -> u32 {
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

/// A vector known up to a box.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Loose {
    middle: Vec3,
    half: Vec3,
}

impl Loose {
    fn new(extent: &Extent) -> Self {
        Self { middle: extent.middle(), half: extent.half() }
    }

    fn known(middle: Vec3) -> Self {
        Self { middle, half: Vec3::ZERO }
    }
}

/// A lobe of shading points, and what it reflects.
#[derive(Clone, Copy, Debug)]
struct Field {
    /// Rows of the map from the world to cosine space.
    rows: [Loose; 3],
    /// Normal of the surface's true horizon, or of the lobe's own where only that one clips; world space, any length.
    up: Loose,
    /// Products of the map's columns: xx, yy, zz, and xy, xz, yz.
    gram: [Vec3; 2],
    /// det M⁻¹/π.
    scale: f32,
    /// Reflected radiance over radiance and integral.
    weight: Vec3,
}

impl Field {
    fn new(rows: [Loose; 3], up: Loose, determinant: f32, weight: Vec3) -> Self {
        let [a, b, c] = rows.map(|row| row.middle);
        let turned = |v: Vec3| Vec3::new(v.y, v.z, v.x);
        // xy, yz, zx.
        let mixed = a * turned(a) + b * turned(b) + c * turned(c);
        let gram = [a * a + b * b + c * c, Vec3::new(mixed.x, mixed.z, mixed.y)];
        Self { rows, up, gram, scale: determinant * FRAC_1_PI, weight }
    }

    /// The lobe at the middle of the boxes.
    fn at_middle(&self) -> Self {
        Self { rows: self.rows.map(|row| Loose::known(row.middle)), up: Loose::known(self.up.middle), ..*self }
    }

    /// What a single point reflects of a cluster, by its expansion.
    #[inline(always)]
    fn expansion(&self, cluster: &Cluster, y: Vec3) -> Vec3 {
        Vec3::from_array(expansion::<f32>(self.rows.map(|row| row.middle), &cluster.moments, y)) * self.reflected()
    }

    /// Reflected radiance over ∫ h·w dA.
    fn reflected(&self) -> Vec3 {
        self.weight * self.scale
    }

    /// Largest length in cosine space of a vector in a box with these half-extents, by the middles of the rows.
    #[inline(always)]
    fn radius(&self, half: Vec3) -> f32 {
        let mixed = Vec3::new(half.x * half.y, half.x * half.z, half.y * half.z);
        (self.gram[0].dot(half * half) + 2.0 * self.gram[1].abs().dot(mixed)).sqrt()
    }

    /// Largest length by which the boxes of the rows leave the image of a vector in a box open.
    #[inline(always)]
    fn slack(&self, half: Vec3) -> f32 {
        let [a, b, c] = self.rows;
        Vec3::new(a.half.dot(half), b.half.dot(half), c.half.dot(half)).length()
    }
}

/// The shading points of a tile, or one of them, as seen by clusters. Lengths are in the tree's unit.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    position: Loose,
    /// `None` for a lobe that reflects nothing.
    fields: [Option<Field>; LOBES],
}

impl Receiver {
    /// The points within `bounds`. Specular lobes are clipped at the true horizon as well where `both_horizons`.
    pub fn of_tile(bounds: &TileBounds, both_horizons: bool, per_metre: f32) -> Self {
        let normal = Loose::new(&bounds.normal);
        // The plain cosine is round about the normal. Tangents turn by as much as normals do, which are up to twice their box's
        // half-diagonal from the unit vector through its middle.
        let z = normal.middle.normalize_or(Vec3::Z);
        let x = z.any_orthonormal_vector();
        let turn = Vec3::splat(2.0 * normal.half.length());
        let tangent = |middle: Vec3| Loose { middle, half: turn };
        let rows = bounds.rows.each_ref().map(Loose::new);
        let up = if both_horizons { normal } else { rows[2] };
        let plain = Field::new([tangent(x), tangent(z.cross(x)), normal], normal, 1.0, bounds.weights[0]);
        let lobe = Field::new(rows, up, bounds.determinant, bounds.weights[1]);
        Self::new(Loose::new(&bounds.position), [plain, lobe], per_metre)
    }

    /// One point, by its position relative to the camera in metres, the axes of its shading frame and what it reflects.
    pub fn of_point(
        position: Vec3,
        [x, y, z]: [Vec3; 3],
        reflectance: &Reflectance,
        both_horizons: bool,
        per_metre: f32,
    ) -> Self {
        let m = &reflectance.lobe.m_inv;
        let rows = [x * m.xx + z * m.xz, y * m.yy, x * m.zx + z * m.zz].map(Loose::known);
        let up = if both_horizons { Loose::known(z) } else { rows[2] };
        let plain = Field::new([x, y, z].map(Loose::known), Loose::known(z), 1.0, reflectance.diffuse);
        let lobe = Field::new(rows, up, m.determinant(), reflectance.specular);
        Self::new(Loose::known(position), [plain, lobe], per_metre)
    }

    fn new(position: Loose, fields: [Field; LOBES], per_metre: f32) -> Self {
        let position = Loose { middle: position.middle * per_metre, half: position.half * per_metre };
        Self { position, fields: fields.map(|field| (field.weight.max_element() > 0.0).then_some(field)) }
    }

    /// Its middle.
    pub const fn position(&self) -> Vec3 {
        self.position.middle
    }

    /// The rows of the map from the world to cosine space, by the lobe's place, and reflected radiance over ∫ h·w dA. `None` for a
    /// lobe that reflects nothing.
    pub fn lobe(&self, lobe: usize) -> Option<([Vec3; 3], Vec3)> {
        self.fields[lobe].as_ref().map(|field| (field.rows.map(|row| row.middle), field.reflected()))
    }

    /// The middle of the tile.
    fn at_middle(&self) -> Self {
        Self {
            position: Loose::known(self.position.middle),
            fields: self.fields.map(|field| field.map(|f| f.at_middle())),
        }
    }
}

/// How a cluster stands to shading points.
#[derive(Clone, Copy, Debug)]
struct View {
    /// From the middle of the points to the cluster's centre.
    y: Vec3,
    /// Half-extents of where y may lie.
    open: Vec3,
    /// |y|.
    distance: f32,
    /// Least and most of −y·n over all light points, for all shading points.
    front: [f32; 2],
}

impl View {
    #[inline(always)]
    fn new(cluster: &Cluster, position: &Loose) -> Self {
        let y = cluster.center - position.middle;
        let square = y.length_squared();
        let distance = square.sqrt();
        // In the plane of y and the axis: the normals between the two sides of the cone.
        let along = -cluster.axis.dot(y);
        let across = (square - along * along).max(0.0).sqrt();
        let least = cluster.cone_cos * along - cluster.cone_sin * across;
        let most = cluster.cone_cos * along + cluster.cone_sin * across;
        let most = if along >= cluster.cone_cos * distance { distance } else { most };
        let slack = ROUNDING * distance + position.half.length();
        Self { y, open: position.half, distance, front: [least - cluster.high - slack, most - cluster.low + slack] }
    }

    /// Whether no light of the cluster shines on any of the points.
    #[inline(always)]
    fn is_away(&self, cluster: &Cluster) -> bool {
        if cluster.link & HALF != 0 && cluster.is_single() {
            // Of both sides exactly one is in front of a single point.
            cluster.axis.dot(self.y) - cluster.axis.abs().dot(self.open) >= 0.0
        } else {
            self.front[1] <= 0.0
        }
    }
}

/// What a lobe sees of a cluster.
#[derive(Clone, Copy, Debug)]
struct Sight {
    /// Bound of the first-order expansion's error; infinite where it does not hold.
    error: f32,
    /// Bound of the integral; 0 below a horizon, infinite where the cluster reaches as far as the point.
    most: f32,
}

impl Sight {
    /// Of all points of a tile, or of a single one where `TILE` is false.
    #[inline(always)]
    fn new<const TILE: bool>(field: &Field, cluster: &Cluster, view: &View) -> Self {
        let [a, b, c] = field.rows;
        let half = cluster.half;
        let p = Vec3::new(a.middle.dot(view.y), b.middle.dot(view.y), c.middle.dot(view.y));
        let height = field.up.middle.dot(view.y);
        // How far p and the height may be from that, and how far the cluster reaches over its centre.
        let noise = ROUNDING * view.distance;
        let mut off = Vec3::ZERO;
        let mut reach = c.middle.abs().dot(half + noise);
        let mut up_reach = field.up.middle.abs().dot(half + noise);
        if TILE {
            let far = view.y.abs() + view.open;
            off = Vec3::new(open(a, view.open, far), open(b, view.open, far), open(c, view.open, far));
            reach += c.half.dot(half);
            up_reach += open(field.up, view.open, far + half);
        }
        if p.z + off.z + reach < 0.0 || height + up_reach < 0.0 {
            return Self { error: f32::INFINITY, most: 0.0 };
        }
        let above = p.z - off.z - reach > 0.0 && height - up_reach > 0.0;
        let nearest = p.length() - off.length();
        let inv = 1.0 / nearest;
        let z = ((p.z + off.z) * inv).clamp(0.0, 1.0);
        let radius = field.radius(half) + if TILE { field.slack(half) } else { 0.0 };
        let s = radius * inv;
        let gap = 1.0 - s;
        if !(nearest > 0.0 && gap > 0.0) {
            return Self { error: f32::INFINITY, most: f32::INFINITY };
        }
        let bright = (field.weight * cluster.flux).max_element();
        let unit = field.scale * bright * (view.front[1] * inv) * (inv * inv);
        let per_gap = 1.0 / gap;
        let per_gap_2 = per_gap * per_gap;
        let per_gap_4 = per_gap_2 * per_gap_2;
        // p_z/|p|⁴ is at most (ẑ + s)/(1 − s)⁴, and 1/(1 − s)³, over |p|³.
        let most = unit * per_gap_4 * (z + s.min(reach * inv)).min(gap);
        if !(above && view.front[0] > 0.0) {
            return Self { error: f32::INFINITY, most };
        }
        // Root means of |q|² and q_z², over |p|.
        let mut mean = (field.gram[0].dot(cluster.squares) + 2.0 * field.gram[1].dot(cluster.products)).max(0.0).sqrt();
        let mixed = Vec3::new(c.middle.x * c.middle.y, c.middle.x * c.middle.z, c.middle.y * c.middle.z);
        let mut rise = ((c.middle * c.middle).dot(cluster.squares) + 2.0 * mixed.dot(cluster.products)).max(0.0).sqrt();
        if TILE {
            let spread = Vec3::new(cluster.squares.x.sqrt(), cluster.squares.y.sqrt(), cluster.squares.z.sqrt());
            mean += field.slack(spread);
            rise += c.half.dot(spread);
        }
        let (mean, rise) = (mean * inv, rise * inv);
        let together = (6.0 * z + 2.0).min(6.0) + s * (10.0 - s * (15.0 - 6.0 * s)) * (per_gap_2 * per_gap);
        let t2 = 10.0 + s * (20.0 + s * 35.0 * per_gap_4);
        let t1 = 4.0 + s * t2;
        Self { error: unit * mean * (mean * together).min(z * mean * t2 + rise * t1), most }
    }
}

/// How far the product of a loose vector with one open by `open` may be off; `far` holds the magnitudes of the latter.
#[inline(always)]
fn open(v: Loose, open: Vec3, far: Vec3) -> f32 {
    v.middle.abs().dot(open) + v.half.dot(far)
}

/// The first-order expansion of ∫ h·w dA at single points, for each channel: what det M⁻¹/π and what the lobe reflects are
/// multiplied with. `rows` map the world to cosine space, `y` leads to the cluster's centre.
#[inline(always)]
pub fn expansion<L: Lanes>([a, b, c]: [L::Vec3; 3], moments: &[Mat4; 3], y: L::Vec3) -> [L; 3] {
    let p = L::Vec3::of(a.dot(y), b.dot(y), c.dot(y));
    let square = p.length_squared();
    let inv2 = square.splat(1.0) / square;
    let inv = inv2.sqrt();
    let d = p * inv;
    // h and its gradient in the world, times |p|³.
    let gradient = (c - (a * d.x() + b * d.y() + c * d.z()) * (d.z() * 4.0)) * inv;
    let [red, green, blue] = moments;
    let (height, per_cube) = (d.z(), inv * inv2);
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

/// What becomes of a cluster for a lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It adds nothing, or nothing that counts.
    Nothing,
    /// The expansion stands for it.
    Whole,
    /// Its parts must be looked at.
    Refine,
}

#[inline(always)]
fn fate<const TILE: bool>(field: &Field, cluster: &Cluster, view: &View, tolerance: f32, budget: &mut Budget) -> Fate {
    let sight = Sight::new::<TILE>(field, cluster, view);
    if sight.error < sight.most && budget.accept(sight.error, tolerance, true) {
        Fate::Whole
    } else if budget.accept(sight.most, tolerance, true) {
        Fate::Nothing
    } else {
        Fate::Refine
    }
}

/// A cluster that shading points of a tile gather from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedCluster {
    /// Its index.
    pub cluster: u32,
    /// Lobes for which the expansion stands for it at all points; a bit for each.
    pub whole: u32,
    /// Lobes for which each point decides.
    pub open: u32,
}

impl ListedCluster {
    /// All clusters, to be decided about by each point.
    pub const ALL: Self = Self { cluster: 0, whole: 0, open: (1 << LOBES) - 1 };
}

/// Walks the clusters for the points of a tile. Gives to `list` what is not nothing for all of them, and returns the clusters visited.
///
/// `tolerance` is for the reflected radiance; `budget` what is left of it at each of the points.
pub fn list_clusters(
    clusters: Clusters<'_>,
    tile: &Receiver,
    tolerance: f32,
    budget: &mut Budget,
    mut list: impl FnMut(ListedCluster),
) -> u32 {
    let end = clusters.clusters.len() as u32;
    let middle = tile.at_middle();
    let mut visited = 0;
    // Where each lobe goes on.
    let mut next = tile.fields.each_ref().map(|field| if field.is_some() { 0 } else { end });
    let mut i = next[0].min(next[1]);
    while i < end {
        let cluster = &clusters.clusters[i as usize];
        visited += 1;
        let (is_single, skip) = (cluster.is_single(), cluster.end(i));
        let view = View::new(cluster, &tile.position);
        let away = view.is_away(cluster);
        let mut listed = ListedCluster { cluster: i, whole: 0, open: 0 };
        for (k, next) in next.iter_mut().enumerate() {
            let (Some(field), Some(at_middle)) = (&tile.fields[k], &middle.fields[k]) else { continue };
            if *next > i {
                continue;
            }
            *next = skip;
            let fate_of_all = if away { Fate::Nothing } else { fate::<true>(field, cluster, &view, tolerance, budget) };
            match fate_of_all {
                Fate::Nothing => {}
                Fate::Whole => listed.whole |= 1 << k,
                Fate::Refine => {
                    let own = View::new(cluster, &middle.position);
                    // Where the middle could do with the cluster, many points can.
                    let decide = is_single
                        || fate::<false>(at_middle, cluster, &own, tolerance, &mut { *budget }) != Fate::Refine;
                    if decide {
                        listed.open |= 1 << k;
                    } else {
                        *next = i + 1;
                    }
                }
            }
        }
        if listed.whole | listed.open != 0 {
            list(listed);
        }
        i = next[0].min(next[1]);
    }
    visited
}

/// What a point gathers from clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClusterSums {
    /// Radiance reflected by each lobe.
    pub radiance: [Vec3; LOBES],
    /// Clusters visited.
    pub visited: u32,
    /// Expansions summed up.
    pub whole: u32,
}

impl ClusterSums {
    /// Adds a listed cluster at a single point. Hands to `single` each light that must be integrated itself: the index of its
    /// emission, the lobes (a bit for each) and what is left of the budget.
    pub fn add(
        &mut self,
        clusters: Clusters<'_>,
        point: &Receiver,
        listed: ListedCluster,
        tolerance: f32,
        budget: &mut Budget,
        mut single: impl FnMut(usize, u32, &mut Budget),
    ) {
        let first = &clusters.clusters[listed.cluster as usize];
        for k in 0..LOBES {
            if let (Some(field), true) = (&point.fields[k], listed.whole & 1 << k != 0) {
                let y = first.center - point.position.middle;
                self.radiance[k] += field.expansion(first, y);
                self.whole += 1;
            }
        }
        if listed.open == 0 {
            return;
        }
        let end = first.end(listed.cluster);
        let mut next =
            [0, 1].map(|k| if listed.open & 1 << k != 0 && point.fields[k].is_some() { listed.cluster } else { end });
        let mut i = next[0].min(next[1]);
        while i < end {
            let cluster = &clusters.clusters[i as usize];
            self.visited += 1;
            let (is_single, skip) = (cluster.is_single(), cluster.end(i));
            let view = View::new(cluster, &point.position);
            let away = view.is_away(cluster);
            let mut singles = 0;
            for (k, next) in next.iter_mut().enumerate() {
                let Some(field) = &point.fields[k] else { continue };
                if *next > i {
                    continue;
                }
                *next = skip;
                let fate = if away { Fate::Nothing } else { fate::<false>(field, cluster, &view, tolerance, budget) };
                match fate {
                    Fate::Nothing => {}
                    Fate::Whole => {
                        self.radiance[k] += field.expansion(cluster, view.y);
                        self.whole += 1;
                    }
                    Fate::Refine if is_single => singles |= 1 << k,
                    Fate::Refine => *next = i + 1,
                }
            }
            if singles != 0 {
                single((cluster.link & INDEX_MASK) as usize, singles, budget);
            }
            i = next[0].min(next[1]);
        }
    }
}
