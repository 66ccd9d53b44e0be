//! The colour of a light as a shading point sees it: one fetch from a prefiltered picture (Heitz, Dupuy, Hill, Neubelt
//! 2016, §5). Twin: `shaders/picture.wgsl`.
//!
//! The clamped cosine over the light's plane is taken for a Gaussian, round on the light, about the point of the plane
//! nearest the origin of cosine space, with the variance r²/(2A) in units of the light's area A there, r the distance of
//! the plane. The picture comes filtered with Gaussians of rising variance.

use super::map::CosineMap;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

/// Places beyond this (tree space) are as far as the edge of any picture.
const FARTHEST: f32 = 1e6;

/// A prefiltered picture of one light or layer.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Filtered {
    /// Lower left corner of the box that all levels cover, tree space.
    pub low: Vec2,
    /// 1 / width and 1 / height of the box.
    pub per_unit: Vec2,
    /// First of its levels.
    pub first_level: u32,
    /// Number of its levels, at least 1.
    pub levels: u32,
}

/// The picture, filtered by one Gaussian. Row 0 is lowest.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Level {
    /// First of its texels.
    pub offset: u32,
    /// Texels across.
    pub width: u32,
    /// Texels up.
    pub height: u32,
    /// σ² along each axis, tree space; rises from level to level.
    pub variance: f32,
}

/// The levels and texels that pictures point into. Texels are linear; 1 stands for the picture's peak.
#[derive(Clone, Copy, Debug)]
pub struct Levels<'a> {
    /// Of all pictures.
    pub levels: &'a [Level],
    /// Of all levels; w is unused.
    pub texels: &'a [Vec4],
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
        if !(largest > 0.0) {
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

/// The picture's colour under a footprint: bilinear in two levels, mixed so that the variance is that of the footprint.
pub fn fetch(picture: &Filtered, all: Levels<'_>, footprint: &Footprint) -> Vec3 {
    let first = picture.first_level as usize;
    let last = first + picture.levels as usize - 1;
    let mut fine = first;
    while fine < last && all.levels[fine + 1].variance <= footprint.variance {
        fine += 1;
    }
    let coarse = last.min(fine + 1);
    let at = (footprint.place - picture.low) * picture.per_unit;
    let color = fetch_level(&all.levels[fine], all.texels, at);
    let step = all.levels[coarse].variance - all.levels[fine].variance;
    let share = footprint.variance - all.levels[fine].variance;
    if !(step > 0.0 && share > 0.0) {
        return color;
    }
    color.lerp(fetch_level(&all.levels[coarse], all.texels, at), (share / step).min(1.0))
}

/// Bilinear, the place in 0..1 of the box; beyond it the edge goes on.
fn fetch_level(level: &Level, texels: &[Vec4], at: Vec2) -> Vec3 {
    let last = Vec2::new((level.width - 1) as f32, (level.height - 1) as f32);
    let place = (at * (last + 1.0) - 0.5).max(Vec2::ZERO).min(last);
    let low = place.floor();
    let part = place - low;
    let x = low.x as u32;
    let right = (x + 1).min(level.width - 1);
    let row = level.offset + low.y as u32 * level.width;
    let above = level.offset + (low.y as u32 + 1).min(level.height - 1) * level.width;
    let texel = |i: u32| texels[i as usize].truncate();
    let lower = texel(row + x).lerp(texel(row + right), part.x);
    lower.lerp(texel(above + x).lerp(texel(above + right), part.x), part.y)
}
