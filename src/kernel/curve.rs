//! Curves as the polygonal techniques read them, their corners and edges. Twin: `shaders/curve.wgsl`.

use super::cubic::cubic_point;
use super::edge::{edge_angle, edge_normal};
use super::horizon::Horizon;
use super::map::CosineMap;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A cubic Bézier curve in the emitter's square \[−1, 1\]². Consecutive curves of a contour share their end points to
/// the bit. A straight line, and nothing else, has p1 = p0 and p2 = p3.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Curve {
    /// Start point.
    pub p0: Vec2,
    /// First handle.
    pub p1: Vec2,
    /// Second handle.
    pub p2: Vec2,
    /// End point.
    pub p3: Vec2,
}

/// An integral by edges, and how many it took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeSum {
    /// The integral, normalised: 1 for a full hemisphere; negative behind the light.
    pub value: f32,
    /// Edges integrated: those with a part above the horizon, closing edges apart.
    pub edges: u32,
}

/// Smallest length of an image: what lies nearer to the shading point counts as being there, so that all is finite.
pub const NEAREST_IMAGE: f32 = 1e-18;

/// A curve relative to the map's foot, by its ends and first differences.
#[derive(Clone, Copy, Debug)]
pub struct LocalCurve {
    /// Start point.
    pub p0: Vec2,
    /// End point.
    pub p3: Vec2,
    d0: Vec2,
    d1: Vec2,
    d2: Vec2,
}

impl LocalCurve {
    /// `curve` relative to `foot`.
    pub fn new(curve: &Curve, foot: Vec2) -> Self {
        let Curve { p0, p1, p2, p3 } = *curve;
        Self { p0: p0 - foot, p3: p3 - foot, d0: p1 - p0, d1: p2 - p1, d2: p3 - p2 }
    }

    /// Whether it is a straight line.
    pub fn is_line(&self) -> bool {
        self.d0 == Vec2::ZERO && self.d2 == Vec2::ZERO
    }

    /// The heights of the control points; those of the ends are what every curve that meets there finds.
    pub fn heights(&self, horizon: &Horizon) -> [f32; 4] {
        let h = &horizon.height;
        [h.at(self.p0), h.at(self.p0 + self.d0), h.at(self.p3 - self.d2), h.at(self.p3)]
    }

    /// The point at t.
    #[inline(always)]
    pub fn point(&self, t: f32) -> Vec2 {
        cubic_point([self.p0, self.p3], [self.d0, self.d1, self.d2], t)
    }
}

/// A corner of a polygon: a point of the light's plane and what its two edges share.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Relative to the map's foot.
    pub q: Vec2,
    /// Its image.
    pub p: Vec3,
    /// 1/|p|.
    inv: f32,
}

impl Corner {
    /// At the point `q` relative to the map's foot.
    #[inline(always)]
    pub fn new(map: &CosineMap, q: Vec2) -> Self {
        let p = map.point(q);
        Self { q, p, inv: 1.0 / p.length().max(NEAREST_IMAGE) }
    }
}

/// 2π times the contour integral along the edge from a to b ([`super::edge::edge_integral`]).
#[inline(always)]
pub fn corner_edge(map: &CosineMap, a: &Corner, b: &Corner) -> f32 {
    let u = b.q - a.q;
    let inv = a.inv * b.inv;
    edge_angle(edge_normal(map, u.perp_dot(a.q), u), a.p.dot(b.p) * inv, inv)
}

/// [`corner_edge`] of the edge's part above the horizon, with the closing term where it crosses.
#[inline]
pub fn clipped_edge(map: &CosineMap, horizon: Option<&Horizon>, a: &Corner, b: &Corner) -> EdgeSum {
    let Some(horizon) = horizon else { return EdgeSum { value: corner_edge(map, a, b), edges: 1 } };
    let (ha, hb) = (horizon.height.at(a.q), horizon.height.at(b.q));
    let value = match (ha > 0.0, hb > 0.0) {
        (true, true) => corner_edge(map, a, b),
        (false, false) => return EdgeSum::default(),
        (down, _) => {
            let c = Corner::new(map, a.q + (b.q - a.q) * (ha / (ha - hb)));
            let closing = horizon.crossing(c.p);
            if down { corner_edge(map, a, &c) - closing } else { corner_edge(map, &c, b) + closing }
        }
    };
    EdgeSum { value, edges: 1 }
}
