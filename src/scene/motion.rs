//! [`Motion`]: what of a scene changes with time, by keyframes.

use super::{Camera, Scene};
use crate::light::Placement;
use glam::{DMat3, DQuat, DVec2, DVec3};

/// How a value gets from one keyframe to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// At constant speed.
    #[default]
    Linear,
    /// From rest to rest: along the same line, by the ease 3u² − 2u³.
    Smooth,
}

impl Interpolation {
    /// The part of the way at the part `u` of the time, both 0 to 1.
    fn ease(self, u: f64) -> f64 {
        match self {
            Self::Linear => u,
            Self::Smooth => u * u * (3.0 - 2.0 * u),
        }
    }
}

/// A value that can be between two others.
pub trait Between: Copy {
    /// The value at the part `u` of the way, more than 0 and less than 1.
    #[must_use]
    fn between(self, to: Self, u: f64) -> Self;
}

impl Between for f64 {
    fn between(self, to: Self, u: f64) -> Self {
        self + (to - self) * u
    }
}

impl Between for DVec2 {
    fn between(self, to: Self, u: f64) -> Self {
        self.lerp(to, u)
    }
}

impl Between for DVec3 {
    fn between(self, to: Self, u: f64) -> Self {
        self.lerp(to, u)
    }
}

/// Turns about one axis, the shorter way (Shoemake 1985, slerp).
impl Between for DQuat {
    fn between(self, to: Self, u: f64) -> Self {
        self.slerp(to, u)
    }
}

/// A value at times: at least one, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<T> {
    keys: Vec<(f64, T)>,
}

impl<T: Between> Track<T> {
    /// The value at all times.
    pub fn still(value: T) -> Self {
        Self { keys: vec![(0.0, value)] }
    }

    /// Values at times, seconds. `None` where there is none, or where a time is not finite or not after the one before.
    pub fn new(keys: Vec<(f64, T)>) -> Option<Self> {
        let in_order = keys.windows(2).all(|pair| pair[0].0 < pair[1].0);
        (!keys.is_empty() && in_order && keys.iter().all(|(time, _)| time.is_finite())).then_some(Self { keys })
    }

    /// The value at a time: that of the first key before it, that of the last after it.
    pub fn at(&self, time: f64, interpolation: Interpolation) -> T {
        let next = self.keys.partition_point(|key| key.0 <= time);
        let last = self.keys.len() - 1;
        let ((t0, from), (t1, to)) = (self.keys[next.saturating_sub(1)], self.keys[next.min(last)]);
        // A key has its own value, to the bit.
        if next == 0 || next > last || time == t0 {
            return from;
        }
        from.between(to, interpolation.ease((time - t0) / (t1 - t0)))
    }

    /// The values of the keys.
    pub fn values(&self) -> impl Iterator<Item = T> {
        self.keys.iter().map(|key| key.1)
    }
}

/// How a light moves.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMotion {
    /// Index of the light in the scene.
    pub light: usize,
    /// Between its keyframes.
    pub interpolation: Interpolation,
    /// Where its origin is, metres.
    pub position: Track<DVec3>,
    /// How it is turned.
    pub rotation: Track<DQuat>,
    /// How it is stretched along its axes, more than 0.
    pub scale: Track<DVec2>,
    /// What its radiance is multiplied with, per channel.
    pub emission: Track<DVec3>,
    /// The radiances of its layers before that.
    pub radiances: Vec<DVec3>,
}

/// Where a camera looks.
#[derive(Clone, Debug, PartialEq)]
pub enum Aim {
    /// At a point, with the scene's own upward direction.
    At(Track<DVec3>),
    /// Along −z of its own frame, which is turned so; up is its y axis.
    Turned(Track<DQuat>),
}

/// How a camera moves.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraMotion {
    /// Between its keyframes.
    pub interpolation: Interpolation,
    /// Where it stands, metres.
    pub position: Track<DVec3>,
    /// Where it looks.
    pub aim: Aim,
    /// Vertical field of view, degrees.
    pub fov_y: Track<f64>,
}

/// What of a scene changes with time. Everything else is the same at all times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// The lights that move.
    pub lights: Vec<LightMotion>,
    /// The camera, if it moves.
    pub camera: Option<CameraMotion>,
    /// Times of the first and the last keyframe, seconds.
    pub span: [f64; 2],
}

impl Motion {
    /// Nothing moves.
    pub const STILL: Self = Self { lights: Vec::new(), camera: None, span: [0.0; 2] };

    /// Whether nothing moves.
    pub const fn is_still(&self) -> bool {
        self.lights.is_empty() && self.camera.is_none()
    }

    /// Puts what moves where it is at a time.
    pub fn set(&self, scene: &mut Scene, time: f64) {
        for motion in &self.lights {
            let Some(light) = scene.lights.get_mut(motion.light) else { continue };
            let turn = DMat3::from_quat(motion.rotation.at(time, motion.interpolation));
            let scale = motion.scale.at(time, motion.interpolation);
            let origin = motion.position.at(time, motion.interpolation);
            light.placement = Placement { origin, x: turn.x_axis * scale.x, y: turn.y_axis * scale.y };
            let emission = motion.emission.at(time, motion.interpolation);
            for (layer, radiance) in light.layers.iter_mut().zip(&motion.radiances) {
                layer.radiance = *radiance * emission;
            }
        }
        if let Some(motion) = &self.camera {
            let position = motion.position.at(time, motion.interpolation);
            let (look_at, up) = match &motion.aim {
                Aim::At(track) => (track.at(time, motion.interpolation), scene.camera.up),
                Aim::Turned(track) => {
                    let turn = track.at(time, motion.interpolation);
                    (position + turn * DVec3::NEG_Z, turn * DVec3::Y)
                }
            };
            scene.camera = Camera { position, look_at, up, fov_y: motion.fov_y.at(time, motion.interpolation) };
        }
    }
}

/// `Rz·Ry·Rx`, degrees.
pub fn turn(rotation: DVec3) -> DQuat {
    let r = rotation.map(f64::to_radians);
    DQuat::from_rotation_z(r.z) * DQuat::from_rotation_y(r.y) * DQuat::from_rotation_x(r.x)
}
