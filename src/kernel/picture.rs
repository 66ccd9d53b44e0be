//! The colour of a light as a shading point sees it: one fetch from a prefiltered picture (Heitz, Dupuy, Hill, Neubelt
//! 2016, §5). Twin: `shaders/picture.wgsl`.
//!
//! The clamped cosine over the light's plane is taken for a Gaussian, round on the light, about the point of the plane
//! nearest the origin of cosine space, with the variance r²/(2A) in units of the light's area A there, r the distance of
//! the plane. The picture comes filtered with Gaussians of rising variance.

use super::map::CosineMap;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Places beyond this (tree space) are as far as the edge of any picture.
const FARTHEST: f32 = 1e6;

/// A picture filtered by one Gaussian. The levels of a picture follow one another. Row 0 is lowest.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Level {
    /// Lower left corner of the box that the texels cover, tree space.
    pub low: Vec2,
    /// 1 / width and 1 / height of the box.
    pub per_unit: Vec2,
    /// First of its texels.
    pub offset: u32,
    /// Texels across (lower 16 bits) and up (upper 16 bits), at least 1.
    pub size: u32,
    /// σ² along each axis, tree space; rises from level to level.
    pub variance: f32,
    /// Levels after this one, of the same picture.
    pub coarser: u32,
}

/// The Gaussian that stands for the clamped cosine on a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Its middle, tree space.
    pub place: Vec2,
    /// σ² along each axis, tree space.
    pub variance: f32,
}

impl Footprint {
    /// For one shading point. Finite for every map.
    ///
    /// The plane's point nearest the origin is foot + (w1·N, −w0·N)/|N|²: the map's own foot is kept near the light. The
    /// parallelogram over the unit square of tree space has the area |N|.
    pub fn new(map: &CosineMap) -> Self {
        let largest = map.normal.abs().max_element();
        if largest.is_nan() || largest <= 0.0 {
            return Self { place: map.foot, variance: f32::MAX };
        }
        // |N|² itself would leave the range of f32 for lights that are small and far.
        let n = map.normal / largest;
        let length = n.length();
        let across = Vec2::new(map.w1.dot(n), -map.w0.dot(n)) / (length * length) / largest;
        let place = (map.foot + across).max(Vec2::splat(-FARTHEST)).min(Vec2::splat(FARTHEST));
        let distance = map.depth.abs() / length / largest;
        let variance = distance / largest * distance / (2.0 * length);
        Self { place, variance: if variance < f32::MAX { variance } else { f32::MAX } }
    }
}

/// A picture's colour under a footprint: bilinear in two levels, mixed so that the variance is that of the footprint.
///
/// `levels`: the picture's. `texels`: what they point into.
pub fn fetch(levels: &[Level], texels: &[[u32; 2]], footprint: &Footprint) -> Vec3 {
    let mut i = 0;
    while levels[i].coarser > 0 && levels[i + 1].variance <= footprint.variance {
        i += 1;
    }
    let color = fetch_level(&levels[i], texels, footprint.place);
    if levels[i].coarser == 0 {
        return color;
    }
    let (fine, coarse) = (levels[i].variance, levels[i + 1].variance);
    let share = (footprint.variance - fine) / (coarse - fine);
    if share <= 0.0 {
        return color;
    }
    color.lerp(fetch_level(&levels[i + 1], texels, footprint.place), share)
}

/// Bilinear between the texels' centres; beyond the outer ones the edge goes on.
fn fetch_level(level: &Level, texels: &[[u32; 2]], place: Vec2) -> Vec3 {
    let (width, height) = (level.size & 0xffff, level.size >> 16);
    let last = Vec2::new((width - 1) as f32, (height - 1) as f32);
    let at = ((place - level.low) * level.per_unit * (last + 1.0) - 0.5).max(Vec2::ZERO).min(last);
    let cell = at.floor();
    let part = at - cell;
    let x = cell.x as u32;
    let right = (x + 1).min(width - 1);
    let row = level.offset + cell.y as u32 * width;
    let above = level.offset + (cell.y as u32 + 1).min(height - 1) * width;
    let texel = |i: u32| unpack(texels[i as usize]);
    let lower = texel(row + x).lerp(texel(row + right), part.x);
    lower.lerp(texel(above + x).lerp(texel(above + right), part.x), part.y)
}

/// A texel: x and y are the 16-bit floats of the first word, z is that of the second. None is below 0.
#[inline(always)]
pub fn unpack([xy, z]: [u32; 2]) -> Vec3 {
    // Exponent and fraction in their places, less the difference of the biases: what `unpack2x16float` gives.
    const BIAS: f32 = f32::from_bits((127 + 112) << 23);
    let widen = |bits: u32| f32::from_bits(bits << 13) * BIAS;
    Vec3::new(widen(xy & 0xffff), widen(xy >> 16), widen(z & 0xffff))
}
