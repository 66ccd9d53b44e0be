//! The pinhole camera.

use glam::DVec3;

/// A pinhole camera, right-handed, looking along −z of its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point, world space, metres.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// The direction that is up in the picture.
    pub up: DVec3,
    /// Vertical field of view, degrees, 0 to 180 (exclusive).
    pub fov_y: f64,
}

/// The camera's orthonormal frame, with the axes scaled for ray generation: the ray through the point (x, y) of
/// the picture, both in −1..1 with y up, has the direction `forward + x·right + y·up` (not normalised).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFrame {
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Right half-width of the picture at distance 1.
    pub right: DVec3,
    /// Upper half-height of the picture at distance 1.
    pub up: DVec3,
}

impl Camera {
    /// The frame for a picture of the given aspect ratio (width / height).
    ///
    /// Where `up` is parallel to the line of sight another axis serves, so the frame is always defined.
    pub fn frame(&self, aspect: f64) -> CameraFrame {
        let forward = (self.look_at - self.position).normalize_or(DVec3::NEG_Z);
        let side = forward.cross(self.up.normalize_or(DVec3::Y));
        let right = if side.length_squared() > 1e-12 { side.normalize() } else { forward.any_orthonormal_vector() };
        let up = right.cross(forward);
        let half = (self.fov_y.to_radians() * 0.5).tan();
        CameraFrame { forward, right: right * (half * aspect), up: up * half }
    }
}
