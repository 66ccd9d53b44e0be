//! Spheres and tubes as the camera sees them: their silhouettes, exact, and where a ray enters them.

use super::emitter::Emitter;
use crate::kernel::body::{FacingTube, facing_disc};
use crate::light::Form;
use core::f64::consts::{PI, TAU};
use glam::DVec3;

/// Chords of a full circle: a sagitta under 1/100 pixel for a circle of 4000 pixels.
const CHORDS: u32 = 1024;

/// A body in world space, relative to the camera.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    center: DVec3,
    radius: f64,
    /// Along a tube, half its length.
    half_axis: Option<DVec3>,
}

impl Body {
    /// The light that an emitter is a face of, if it is a body. Of a tube, its first face.
    pub fn of(emitter: &Emitter) -> Option<Self> {
        let placement = &emitter.placement;
        let body = |radius: f64, half_axis| {
            Some(Self { center: placement.origin, radius: radius * placement.y.length(), half_axis })
        };
        match emitter.form {
            Form::Outline | Form::Rectangle | Form::Disc => None,
            Form::Sphere { radius } => body(radius, None),
            Form::Tube { radius, length } => body(radius, Some(placement.x * (0.5 * length))),
        }
    }

    /// A closed polygon in the directions of the body's edge as the camera sees it, at any distances. `None` from inside:
    /// bodies shine outwards.
    pub fn silhouette(&self) -> Option<Vec<DVec3>> {
        let Some(half_axis) = self.half_axis else {
            return facing_disc(self.center, self.radius).map(|c| arc(c, TAU).collect());
        };
        let half = half_axis.length();
        let axis = half_axis / half;
        if let Some(tube) = FacingTube::new(self.center, axis, self.radius) {
            // At either end the arc that is farther out, near or far: one is the other's mirror image in homogeneous
            // coordinates.
            let end = |at: f64| {
                let [x, y, middle] = tube.end(at);
                let outward = axis * (at.signum() * y.length());
                arc([x, outward, middle], PI)
            };
            return Some(end(half).chain(end(-half)).collect());
        }
        let along = -self.center.dot(axis);
        let x = axis.any_orthonormal_vector() * self.radius;
        let cap = [x, axis.cross(x), self.center + half_axis * along.signum()];
        (along.abs() > half).then(|| arc(cap, TAU).collect())
    }

    /// Where a ray from the camera enters the body, in lengths of its direction. For a ray that passes it, where it is
    /// nearest to the round side.
    pub fn entry(&self, direction: DVec3) -> f64 {
        let (mut across, mut center, mut slab) = (direction, self.center, f64::NEG_INFINITY);
        if let Some(half_axis) = self.half_axis {
            let (rise, at) = (direction.dot(half_axis), self.center.dot(half_axis));
            let square = half_axis.length_squared();
            across -= half_axis * (rise / square);
            center -= half_axis * (at / square);
            if rise != 0.0 {
                slab = (at - square.copysign(rise)) / rise;
            }
        }
        let a = across.length_squared();
        let b = across.dot(center);
        let c = center.length_squared() - self.radius * self.radius;
        let round = if a > 0.0 { (b - (b * b - a * c).max(0.0).sqrt()) / a } else { f64::NEG_INFINITY };
        round.max(slab).max(0.0)
    }
}

/// Points of a half-ellipse or ellipse from its x axis on.
fn arc([x, y, middle]: [DVec3; 3], angle: f64) -> impl Iterator<Item = DVec3> {
    let n = (f64::from(CHORDS) * angle / TAU) as u32;
    (0..=n).map(move |i| {
        let (sin, cos) = (angle * f64::from(i) / f64::from(n)).sin_cos();
        middle + x * cos + y * sin
    })
}
