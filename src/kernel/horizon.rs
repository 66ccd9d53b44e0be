//! Clipping at a half-space through the origin of cosine space. Twin: `shaders/horizon.wgsl`.
//!
//! All crossings of a planar light with such a plane lie on one line, so the closing edges need no order and no
//! pairing: each crossing adds a function of its own place on the line, with the sign of its direction. Two
//! planes are in use: z = 0 of cosine space, where the clamped cosine ends, and the true horizon of the
//! surface, which a tilted lobe dips below.

use super::map::{CosineMap, PlanePoint};
use glam::Vec3;

/// One clipping plane, for one map.
#[derive(Clone, Copy, Debug)]
pub struct Horizon {
    /// Height above the plane, up to a positive factor, of the point q relative to the foot: h.x·q.x + h.y·q.y + h.z.
    pub height: Vec3,
    /// Rounding bound of the height anywhere on the light: what lies higher has both ends of any curve above.
    pub margin: f32,
    /// Direction of the line in which the light's plane cuts this one.
    along: Vec3,
    /// Distance of that line from the origin.
    distance: f32,
    /// z of the unit normal of the plane of origin and line: ±1 for z = 0 itself.
    slope: f32,
    /// The part of the line inside the other plane's half-space.
    range: [f32; 2],
}

impl Horizon {
    /// The plane with normal `axis`. `height` are the heights of the map's c0, c1, c2 over it, up to a common positive
    /// factor: exact ones where the caller has them (the true horizon's are world-space).
    pub fn new(map: &CosineMap, axis: Vec3, height: Vec3) -> Self {
        let n = map.normal;
        let line = n.cross(axis);
        let sine2 = line.length_squared();
        let along = if sine2 > 0.0 { line / sine2.sqrt() } else { Vec3::ZERO };
        // The line's point nearest the origin: −D·n⊥/|n⊥|² with n⊥ the part of n across the axis.
        let across = n - axis * (n.dot(axis) / axis.length_squared());
        let distance = if sine2 > 0.0 { map.depth.abs() / across.length() } else { 0.0 };
        // line × (nearest point) is parallel to along × across.
        let turn = along.cross(across * -map.depth.signum());
        let slope = if sine2 > 0.0 { turn.z / turn.length() } else { 0.0 };
        let reach = 1.0 + map.foot.abs();
        let margin = 2e-6 * (height.x.abs() * reach.x + height.y.abs() * reach.y + height.z.abs());
        Self { height, margin, along, distance, slope, range: [f32::NEG_INFINITY, f32::INFINITY] }
    }

    /// The planes z = 0 and `axis`·p = 0, each with its line ending where it meets the other. `None` where the two
    /// coincide (then z = 0 alone clips).
    pub fn pair(map: &CosineMap, axis: Vec3, height: Vec3) -> Option<[Self; 2]> {
        let axis = axis.normalize();
        if axis.x * axis.x + axis.y * axis.y < 1e-12 {
            return None;
        }
        let mut z = Self::lobe(map);
        let mut s = Self::new(map, axis, height);
        // The corner lies on the line common to both planes, through the origin: one point for both, so that
        // what one line loses there the other gains, however nearly the planes coincide.
        let ridge = Vec3::new(-axis.y, axis.x, 0.0);
        let rate = map.normal.dot(ridge);
        let corner = ridge * (-map.depth / if rate.abs() > 1e-30 { rate } else { 1e-30_f32.copysign(rate) });
        z.end_at(corner, axis);
        s.end_at(corner, Vec3::Z);
        Some([z, s])
    }

    /// The plane z = 0.
    pub fn lobe(map: &CosineMap) -> Self {
        Self::new(map, Vec3::Z, Vec3::new(map.c0.z, map.c1.z, map.c2.z))
    }

    /// Ends the line at `corner`, where it leaves the half-space of `other`.
    fn end_at(&mut self, corner: Vec3, other: Vec3) {
        self.range[usize::from(other.dot(self.along) < 0.0)] = corner.dot(self.along);
    }

    /// Height of a point relative to the foot. Above means > 0; every decision about a shared end point is this
    /// very expression, so that crossings pair.
    #[inline(always)]
    pub fn height<P: PlanePoint>(&self, q: P) -> P::Scalar {
        q.form(self.height)
    }

    /// Whether a point relative to the foot is above.
    #[inline(always)]
    pub fn is_above<P: PlanePoint>(&self, q: P) -> bool {
        self.height(q) > P::Scalar::from(0.0)
    }

    /// What a crossing at the image point `p` adds (times 2π) where the contour comes up; where it goes down,
    /// it takes that away.
    #[inline]
    pub fn crossing(&self, p: Vec3) -> f32 {
        let place = p.dot(self.along).max(self.range[0]).min(self.range[1]);
        self.slope * place.atan2(self.distance)
    }

    /// What a crossing below the other horizon adds where the contour comes up: the line ends at the corner.
    #[inline]
    pub fn far_crossing(&self) -> f32 {
        let corner = if self.range[0] > f32::NEG_INFINITY { self.range[0] } else { self.range[1] };
        self.slope * corner.atan2(self.distance)
    }
}
