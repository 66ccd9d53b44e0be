//! The clamped-cosine integral of a rectangle: four clipped edges (Heitz, Dupuy, Hill, Neubelt 2016). Twin:
//! `shaders/quad.wgsl`.

use super::horizon::{Clip, cut_edge};
use super::lanes::Lanes;
use super::map::{CosineMap, PlanePoint};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::TAU;
use glam::{DVec2, Vec2};

/// Edges of a rectangle.
pub const QUAD_EDGES: u32 = 4;

/// An axis-aligned rectangle about the middle of tree space.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Quad {
    /// Half of its width and height.
    pub half: Vec2,
    /// What f32 lost of them.
    pub low: Vec2,
}

impl Quad {
    /// Rounds the half-extents.
    pub fn new(half: DVec2) -> Self {
        let high = half.as_vec2();
        Self { half: high, low: (half - high.as_dvec2()).as_vec2() }
    }
}

/// The integral over the rectangle inside the half-spaces of `clip`, signed: positive in front of the light, negative
/// behind; 1 for a full hemisphere.
pub fn quad_integral<L: Lanes>(map: &CosineMap<L>, clip: &Clip<L>, quad: &Quad) -> L {
    let corner = |x: f32, y: f32| {
        let side = Vec2::new(x, y);
        L::Vec2::from_foot(quad.half * side, (quad.low * side).as_dvec2(), map.foot)
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let edge = |i: usize| cut_edge(map, clip.planes(), corners[i], corners[(i + 1) % 4]);
    (edge(0) + edge(1) + edge(2) + edge(3)) * (1.0 / TAU)
}
