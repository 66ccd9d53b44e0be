//! The shading frame. Twin: `shaders/frame.wgsl`.

use super::lanes::{Doubles, Vector};
use glam::DVec3;

/// Orthonormal, right-handed: z is the normal, x the tangential part of the view direction.
#[derive(Clone, Copy, Debug)]
pub struct ShadingFrame<D: Doubles = f64> {
    /// Tangential part of the view direction; any tangent where the view runs along the normal.
    pub x: D::Vec3,
    /// z × x.
    pub y: D::Vec3,
    /// The normal.
    pub z: D::Vec3,
    /// cos θ of the view direction, 0 to 1. A view from below the surface counts as grazing.
    pub cos_theta: D,
}

impl ShadingFrame {
    /// From a unit normal and a unit vector towards the eye.
    pub fn new(normal: DVec3, view: DVec3) -> Self {
        let cos_theta = normal.dot(view);
        let tangent = view - normal * cos_theta;
        let x = if tangent.length_squared() > 1e-14 {
            tangent.normalize()
        } else {
            // Along the normal every tangent serves: lobes there are round.
            normal.any_orthonormal_vector()
        };
        Self { x, y: normal.cross(x), z: normal, cos_theta: cos_theta.clamp(0.0, 1.0) }
    }
}

impl<D: Doubles> ShadingFrame<D> {
    /// World to shading frame.
    #[inline(always)]
    pub fn to_local(&self, v: D::Vec3) -> D::Vec3 {
        Vector::of(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }
}
