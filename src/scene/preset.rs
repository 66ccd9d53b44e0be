//! The scene of a lone text or logo: a sign that stands on a dark floor and lights it.

use super::camera::{Camera, CameraFrame};
use super::surface::plane;
use super::{Material, Scene};
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::shape::Bounds;
use glam::{DVec2, DVec3};

/// What a sign stands on and how it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct PresetOptions {
    /// What messages call the light.
    pub name: String,
    /// GGX width of the floor, 0 to 1.
    pub alpha: f32,
    /// Albedo of the floor, linear Rec.709, each 0 to 1.
    pub floor: [f32; 3],
    /// Width / height of the picture, > 0.
    pub aspect: f64,
}

impl Default for PresetOptions {
    fn default() -> Self {
        Self { name: "sign".into(), alpha: 0.08, floor: [0.4; 3], aspect: 16.0 / 9.0 }
    }
}

/// Why there is no scene for a sign.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum PresetError {
    /// The layers together have no width or no height, metres.
    #[error("the sign has no area: it measures {0} × {1} m")]
    Empty(f64, f64),
    /// The layers together are too small or too large, metres.
    #[error("the sign measures {0:e} × {1:e} m; its longer side must be {LEAST:e} to {MOST:e} m")]
    Extent(f64, f64),
    /// The picture's aspect ratio is no positive number.
    #[error("the aspect ratio {0} of the picture is not a positive number")]
    Aspect(f64),
}

/// Vertical field of view, degrees: that of a longer lens, so that letters at the ends of a line stay upright.
const FOV_Y: f64 = 25.0;

/// How far the camera looks down, degrees: a reader's view, with enough floor in it for the light to fall on.
const LOOK_DOWN: f64 = 14.0;

/// Height of the sign above the floor, of the lesser of its sides: near enough that light and letters meet.
const GAP: f64 = 0.15;

/// Part of the picture, from the middle, in which sign and reflection lie.
const FILLED: f64 = 0.88;

/// Half the floor's side over the larger of the sign's: its end is out of sight and dark.
const FLOOR: f64 = 200.0;

/// Least longer side of a sign, metres.
const LEAST: f64 = 1e-12;

/// Most, metres: what 32-bit floats can square and add up, floor included.
const MOST: f64 = 1e12;

/// The sign `layers`, which stand upright on a floor and face the reader: their plane is z = 0, their lit side +z, their middle x = 0,
/// the floor y = 0. The camera is in front, a little above, as near as keeps the sign and its mirror image in the floor in the
/// picture, whatever their proportions. Everything scales with the sign.
///
/// # Errors
/// Layers without extent in x or y, or of one beyond 1e-12 to 1e12 m, or an aspect ratio that isn't positive.
pub fn sign(layers: Vec<Layer>, options: &PresetOptions) -> Result<Scene, PresetError> {
    if !(options.aspect > 0.0 && options.aspect.is_finite()) {
        return Err(PresetError::Aspect(options.aspect));
    }
    let bounds = layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
    let size = bounds.size();
    if !(size.min_element() > 0.0 && size.is_finite()) {
        return Err(PresetError::Empty(size.x.max(0.0), size.y.max(0.0)));
    }
    if !(LEAST..=MOST).contains(&size.max_element()) {
        return Err(PresetError::Extent(size.x, size.y));
    }
    let gap = GAP * size.min_element();
    let placement =
        Placement { origin: DVec3::new(-bounds.center().x, gap - bounds.min.y, 0.0), x: DVec3::X, y: DVec3::Y };
    let floor = Material { base_color: options.floor, alpha: options.alpha, ..Material::default() };
    let side = 2.0 * FLOOR * size.max_element();
    Ok(Scene {
        camera: camera(size, gap, options.aspect),
        triangles: plane(DVec3::ZERO, DVec3::Y, [side, side], size.max_element(), 0).into(),
        materials: vec![floor],
        textures: Vec::new(),
        lights: vec![AreaLight {
            name: options.name.clone(),
            layers,
            form: Form::Outline,
            placement,
            two_sided: false,
        }],
        background: [0.0; 3],
    })
}

/// The nearest camera of the fixed direction whose picture holds the corners of the sign and of its mirror image.
///
/// A corner p is left of the right border where (p − c)·right ≤ t·(p − c)·forward, t the half-width at distance 1: linear in
/// the eye c. Each border asks for one number, the maximum over the corners; two opposite borders together bound how far
/// forward c can go, and their difference centres it.
fn camera(size: DVec2, gap: f64, aspect: f64) -> Camera {
    let (sin, cos) = LOOK_DOWN.to_radians().sin_cos();
    let level = Camera { position: DVec3::ZERO, look_at: DVec3::new(0.0, -sin, -cos), up: DVec3::Y, fov_y: FOV_Y };
    let CameraFrame { forward, right, up } = level.frame(aspect);
    let top = gap + size.y;
    let corners = [top, gap, -gap, -top].map(|y| [-0.5, 0.5].map(|x| DVec3::new(x * size.x, y, 0.0)));
    let border = |axis: DVec3, half: f64| {
        let distance = |p: &DVec3| p.dot(axis) - half * p.dot(forward);
        corners.as_flattened().iter().map(distance).fold(f64::NEG_INFINITY, f64::max)
    };
    let fit = |axis: DVec3| {
        let half = axis.length() * FILLED;
        let axis = axis.normalize();
        let (plus, minus) = (border(axis, half), border(-axis, half));
        (axis * ((plus - minus) * 0.5), -(plus + minus) / (2.0 * half))
    };
    let ((across, forward_x), (along, forward_y)) = (fit(right), fit(up));
    let position = across + along + forward * forward_x.min(forward_y);
    Camera { position, look_at: position + forward * position.length(), up: DVec3::Y, fov_y: FOV_Y }
}
