//! What a tile of shading points may receive from a light, for all of its points at once. Twin: `shaders/tile.wgsl`.
//!
//! The tile is known by boxes of vectors: of its positions, of its normals and of the rows r of its lobes' matrices M⁻¹ in world
//! axes. The light is a box as well. So a point of the light relative to a point of the tile, w, lies in a box, and each coordinate
//! r·w of its image in cosine space lies in an interval. All bounds are taken on the safe side of their rounding.

use super::lanes::Lanes;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// A box of vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Least coordinates.
    pub low: Vec3,
    /// Greatest coordinates.
    pub high: Vec3,
}

impl Extent {
    /// The box of no vector.
    pub const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    /// Grows to hold a vector.
    #[inline]
    pub fn add(&mut self, v: Vec3) {
        self.low = self.low.min(v);
        self.high = self.high.max(v);
    }

    pub(super) fn middle(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    pub(super) fn half(&self) -> Vec3 {
        (self.high - self.low) * 0.5
    }
}

/// What the shading points of a tile have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileBounds {
    /// Positions relative to the camera, metres.
    pub position: Extent,
    /// Unit shading normals.
    pub normal: Extent,
    /// Rows x, y, z of M⁻¹ in world axes, of points with a specular weight.
    pub rows: [Extent; 3],
    /// Largest determinant of M⁻¹.
    pub determinant: f32,
    /// Largest weights of the plain cosine and of the lobe, per channel.
    pub weights: [Vec3; 2],
}

impl TileBounds {
    /// Of no points.
    pub const EMPTY: Self = Self {
        position: Extent::EMPTY,
        normal: Extent::EMPTY,
        rows: [Extent::EMPTY; 3],
        determinant: 0.0,
        weights: [Vec3::ZERO; 2],
    };
}

/// Where a light may be, and how much of it: what it shines on a point comes from directions in which this box is seen.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightBox {
    /// Its middle relative to the camera, metres.
    pub center: Vec3,
    /// Area that may shine on one point, m².
    pub area: f32,
    /// Unit axis.
    pub x: Vec3,
    /// Half its extent along x, metres.
    pub half_x: f32,
    /// Unit axis across x.
    pub y: Vec3,
    /// Half its extent along y, metres.
    pub half_y: f32,
    /// x × y: of a flat light the normal of its lit side.
    pub z: Vec3,
    /// Half its extent along z, metres; 0 for a flat light.
    pub half_z: f32,
    /// W·sr⁻¹·m⁻², linear Rec.709.
    pub radiance: Vec3,
    /// 1 where it is flat and dark behind.
    pub one_sided: u32,
}

/// From the points of a tile to those of a light.
#[derive(Clone, Copy, Debug)]
pub struct Offsets {
    /// From middle to middle.
    middle: Vec3,
    /// Half-extents of the tile.
    tile: Vec3,
    /// Largest magnitude of each coordinate.
    reach: Vec3,
    /// What each coordinate may be off by rounding.
    noise: Vec3,
    /// Largest height of the tile over a flat light's plane on the side that shines; of a body, its largest distance.
    height: f32,
}

impl Offsets {
    /// From a tile to a light.
    pub fn new(tile: &TileBounds, light: &LightBox) -> Self {
        let from = tile.position.middle();
        let middle = light.center - from;
        let extent = tile.position.half();
        let reach = middle.abs()
            + extent
            + light.x.abs() * light.half_x
            + light.y.abs() * light.half_y
            + light.z.abs() * light.half_z;
        let noise = (light.center.abs() + from.abs() + reach) * f32::MARGIN;
        let across = light.z.abs().dot(extent + noise);
        let over = -light.z.dot(middle);
        let flat = if light.one_sided == 1 { over } else { over.abs() };
        let height = if light.half_z > 0.0 { reach.length() } else { flat + across };
        Self { middle, tile: extent, reach, noise, height }
    }

    /// Whether all of the tile is behind the light.
    pub fn is_behind(&self, light: &LightBox) -> bool {
        light.one_sided == 1 && self.height < 0.0
    }

    /// Bounds of r·w for all rows r in a box.
    fn interval(&self, light: &LightBox, row: &Extent) -> [f32; 2] {
        let (r, half) = (row.middle(), row.half());
        let middle = r.dot(self.middle);
        let light = r.dot(light.x).abs() * light.half_x
            + r.dot(light.y).abs() * light.half_y
            + r.dot(light.z).abs() * light.half_z;
        let radius = light + r.abs().dot(self.tile + self.noise) + half.dot(self.reach + self.noise);
        [middle - radius, middle + radius]
    }

    /// Whether all of the light is below the plane with those normals at all of the tile.
    pub fn is_below(&self, light: &LightBox, normal: &Extent) -> bool {
        self.interval(light, normal)[1] < 0.0
    }

    /// Bound of the plain cosine's integral over the light at any point of the tile.
    pub fn diffuse_bound(&self, tile: &TileBounds, light: &LightBox) -> f32 {
        // The distance in the light's own axes.
        let side = |axis: Vec3, half: f32| gap(axis.dot(self.middle), half + axis.abs().dot(self.tile + self.noise));
        let nearest = Vec3::new(side(light.x, light.half_x), side(light.y, light.half_y), side(light.z, light.half_z));
        self.sent(light, nearest.length(), self.interval(light, &tile.normal)[1], 1.0)
    }

    /// Bound of the lobe's integral over the light at any point of the tile.
    pub fn specular_bound(&self, tile: &TileBounds, light: &LightBox) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|i| self.interval(light, &tile.rows[i]));
        let side = |[low, high]: [f32; 2]| gap((low + high) * 0.5, (high - low) * 0.5);
        let nearest = Vec3::new(side(x), side(y), side(z));
        self.sent(light, nearest.length(), z[1], tile.determinant)
    }

    /// det M⁻¹ · area · height · z / (π·|p|⁴), the area form of the integral at its largest, or the 1 that no integral exceeds.
    /// `nearest` is the least |p|, `z` the largest height of p.
    fn sent(&self, light: &LightBox, nearest: f32, z: f32, determinant: f32) -> f32 {
        if nearest <= 0.0 {
            return 1.0;
        }
        let inv = 1.0 / nearest;
        let slant = (z * inv).clamp(0.0, 1.0);
        let bound = (light.area * inv * inv) * (self.height.max(0.0) * inv) * (slant * determinant) * FRAC_1_PI;
        bound.min(1.0)
    }
}

/// The least magnitude in an interval.
fn gap(middle: f32, radius: f32) -> f32 {
    (middle.abs() - radius).max(0.0)
}

/// Part of the tolerance that skipped lights may use up.
pub const SKIP_SHARE: f32 = 0.25;

/// Bounds are sorted by powers of two below [`SKIP_SHARE`], the last for all that are smaller.
pub const BUCKETS: u32 = 24;

/// Where a bound belongs that is `share` of what skipped lights may use up: in bucket j it is less than 2⁻ʲ. Past the last where it
/// is 1 or more, or no number.
#[inline]
pub fn bucket(share: f32) -> u32 {
    if share.is_nan() || share >= 1.0 {
        return BUCKETS;
    }
    (126 - (share.to_bits() >> 23).min(126)).min(BUCKETS - 1)
}

/// The first bucket whose bounds and all smaller ones may be skipped, and the part of [`SKIP_SHARE`] that they use up.
pub fn first_skipped(counts: &[u32; BUCKETS as usize]) -> (u32, f32) {
    let mut spent = 0.0;
    let mut first = BUCKETS;
    for j in (0..BUCKETS).rev() {
        let with = spent + counts[j as usize] as f32 * f32::from_bits((127 - j) << 23);
        if with > 1.0 {
            break;
        }
        spent = with;
        first = j;
    }
    (first, spent)
}
