//! Keyframes of a scene file: `[[light.keyframe]]` and `[[camera.keyframe]]`.

use super::error::SceneError;
use super::light::MAX_REACH;
use super::table::{Limit, Table, Value};
use super::{COORDINATE, DEGREES, FIELD_OF_VIEW, RADIANCE, SCALE};
use crate::light::{AreaLight, Form};
use crate::scene::Camera;
use crate::scene::motion::{Aim, Between, CameraMotion, Interpolation, LightMotion, Track, turn};
use crate::shape::Bounds;
use glam::{DVec2, DVec3};

/// Keys of a table that may have keyframes.
pub(super) const KEYS: [&str; 2] = ["keyframe", "interpolation"];

/// How something moves, if it does, with the times of its first and last keyframe.
pub(super) type Moving<T> = Option<(T, [f64; 2])>;

/// Most keyframes of a light or a camera.
const MAX_KEYFRAMES: usize = 100_000;

const TIME: Limit = Limit::new(|v| v.abs() <= 1e9, "within ±1e9 s");

/// The keyframes of a table, with their times.
struct Keyframes<'d> {
    interpolation: Interpolation,
    keys: Vec<(f64, Table<'d>)>,
}

impl<'d> Keyframes<'d> {
    /// `None` where there are none.
    fn read(table: &Table<'d>, known: &[&'static str]) -> Result<Option<Self>, SceneError> {
        let choices = [("linear", Interpolation::Linear), ("smooth", Interpolation::Smooth)];
        let interpolation = table.read("interpolation", |v| v.choice(&choices))?;
        let tables = table.tables("keyframe")?;
        if tables.is_empty() {
            let stray = table.get("interpolation").map(|v| v.error("has no effect without a keyframe"));
            return stray.map_or(Ok(None), Err);
        }
        if tables.len() > MAX_KEYFRAMES {
            return Err(table.error(format!("{} keyframes; at most {MAX_KEYFRAMES}", tables.len())));
        }
        let mut keys: Vec<(f64, Table<'d>)> = Vec::with_capacity(tables.len());
        for key in tables {
            key.only(&[&["time"], known].concat())?;
            let value = key.require("time", "seconds")?;
            let time = value.number(&TIME)?;
            if let Some((before, _)) = keys.last().filter(|(before, _)| *before >= time) {
                return Err(value.error(format!("must be after the time of the keyframe before, {before}")));
            }
            keys.push((time, key));
        }
        Ok(Some(Self { interpolation: interpolation.unwrap_or_default(), keys }))
    }

    /// The track of a key: through the keyframes that have it. `None` where none has.
    fn track<T: Between>(
        &self,
        key: &str,
        read: impl Fn(&Value<'_>) -> Result<T, SceneError>,
    ) -> Result<Option<Track<T>>, SceneError> {
        let mut found = Vec::new();
        for (time, table) in &self.keys {
            found.extend(table.read(key, &read)?.map(|value| (*time, value)));
        }
        Ok(Track::new(found))
    }

    fn span(&self) -> [f64; 2] {
        [self.keys.first(), self.keys.last()].map(|key| key.map_or(0.0, |(time, _)| *time))
    }
}

/// Where a light stands by its own keys.
pub(super) struct Own {
    pub(super) position: DVec3,
    /// Degrees.
    pub(super) rotation: DVec3,
    /// With signs: negative mirrors.
    pub(super) scale: DVec2,
}

/// How the light in `table` moves, if it does, with the times of its first and last keyframe. `own` holds for what no
/// keyframe gives.
pub(super) fn light(
    table: &Table<'_>,
    index: usize,
    light: &AreaLight,
    own: &Own,
) -> Result<Moving<LightMotion>, SceneError> {
    let Some(frames) = Keyframes::read(table, &["position", "rotation", "scale", "emission"])? else {
        return Ok(None);
    };
    let signs = own.scale.signum();
    let scale = |v: &Value<'_>| {
        let scale = v.vec2(&SCALE)?;
        match () {
            () if scale.signum() != signs => Err(v.error("must have the signs of the light's own scale")),
            () if light.form.is_body() && scale.x.abs() != scale.y.abs() => {
                Err(v.error(format!("must not stretch a {}: give one number", light.name)))
            }
            () => Ok(scale.abs()),
        }
    };
    let radiances: Vec<DVec3> = light.layers.iter().map(|layer| layer.radiance).collect();
    let emission = |v: &Value<'_>| {
        let emission = DVec3::from_array(v.one_or(&RADIANCE)?);
        let too_bright = radiances.iter().any(|&radiance| !(radiance * emission).as_vec3().is_finite());
        if too_bright { Err(v.error("makes a radiance too large for 32 bits")) } else { Ok(emission) }
    };
    let motion = LightMotion {
        light: index,
        interpolation: frames.interpolation,
        position: frames.track("position", |v| v.vec3(&COORDINATE))?.unwrap_or_else(|| Track::still(own.position)),
        rotation: frames
            .track("rotation", |v| v.vec3(&DEGREES).map(turn))?
            .unwrap_or_else(|| Track::still(turn(own.rotation))),
        scale: frames.track("scale", scale)?.unwrap_or_else(|| Track::still(own.scale.abs())),
        emission: frames.track("emission", emission)?.unwrap_or_else(|| Track::still(DVec3::ONE)),
        radiances,
    };
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let farthest = largest(&mut motion.position.values().map(|p| p.abs().max_element()));
    let reach = farthest + largest(&mut motion.scale.values().map(DVec2::max_element)) * radius(light);
    if reach > MAX_REACH {
        return Err(
            table.error(format!("its keyframes may take the light {reach:e} m from the origin; at most {MAX_REACH:e}"))
        );
    }
    Ok(Some((motion, frames.span())))
}

/// The farthest that a light reaches from its origin, light-space units.
fn radius(light: &AreaLight) -> f64 {
    let Bounds { min, max } = light.layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
    let flat = min.abs().max(max.abs()).length();
    match light.form {
        Form::Outline | Form::Rectangle | Form::Disc => flat,
        Form::Sphere { radius } => radius,
        Form::Tube { radius, length } => radius.hypot(0.5 * length),
    }
}

/// How the camera in `table` moves, if it does, with the times of its first and last keyframe.
pub(super) fn camera(table: &Table<'_>, own: &Camera) -> Result<Moving<CameraMotion>, SceneError> {
    let Some(frames) = Keyframes::read(table, &["position", "look_at", "rotation", "fov_y"])? else {
        return Ok(None);
    };
    let position = frames.track("position", |v| v.vec3(&COORDINATE))?.unwrap_or_else(|| Track::still(own.position));
    let look_at = frames.track("look_at", |v| v.vec3(&COORDINATE))?;
    let rotation = frames.track("rotation", |v| v.vec3(&DEGREES).map(turn))?;
    let aim = match (look_at, rotation) {
        (Some(_), Some(_)) => return Err(table.error("its keyframes have either look_at or rotation, not both")),
        (None, Some(rotation)) => Aim::Turned(rotation),
        (look_at, None) => Aim::At(look_at.unwrap_or_else(|| Track::still(own.look_at))),
    };
    let fov_y = frames.track("fov_y", |v| v.number(&FIELD_OF_VIEW))?.unwrap_or_else(|| Track::still(own.fov_y));
    let span = frames.span();
    Ok(Some((CameraMotion { interpolation: frames.interpolation, position, aim, fov_y }, span)))
}
