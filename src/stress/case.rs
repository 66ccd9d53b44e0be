//! [`Case`]: one integral of one light at one shading point, and the line of `probe` that says the same.

use crate::backend::emitter::{Emitter, emitters};
use crate::backend::{BackendError, Technique};
use crate::brdf::ltc::{Lobe, Table};
use crate::kernel::frame::ShadingFrame;
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::scene::{Camera, Scene};
use crate::shape::{CubicBez, Shape};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A one-sided light of radiance 1, and a camera. World space, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The region that shines, light space.
    pub shape: Shape,
    /// Where it stands.
    pub placement: Placement,
    /// The camera: backends compute relative to it.
    pub eye: DVec3,
}

impl Stage {
    /// The light as a technique reads it.
    ///
    /// # Errors
    /// [`BackendError::Light`] where the shape has no area.
    pub fn emitter(&self, technique: &Technique) -> Result<Emitter, BackendError> {
        let layer = Layer { shape: self.shape.clone(), radiance: DVec3::ONE, opacity: 1.0, picture: None };
        let light = AreaLight {
            name: "light".into(),
            layers: vec![layer],
            form: Form::Outline,
            placement: self.placement,
            two_sided: false,
        };
        // One layer of a flat light is one emitter.
        Ok(emitters(&scene(self.eye, vec![light]), technique)?.remove(0))
    }
}

/// Lights and a camera, and nothing to be seen.
pub fn scene(eye: DVec3, lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera { position: eye, look_at: DVec3::ZERO, up: DVec3::Y, fov_y: 50.0 },
        triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        lights,
        background: [0.0; 3],
    }
}

/// A shading point and what the light is integrated over there.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The light and the camera.
    pub stage: Arc<Stage>,
    /// The shading point, world space, metres.
    pub position: DVec3,
    /// Its normal; only its direction counts.
    pub normal: DVec3,
    /// Towards the eye; only its direction counts.
    pub view: DVec3,
    /// GGX width of the specular lobe, 0 to 1; `None` for the plain cosine.
    pub alpha: Option<f64>,
    /// Largest error asked for.
    pub tolerance: f32,
}

impl Case {
    /// The shading frame. `None` where a direction has none.
    pub fn frame(&self) -> Option<ShadingFrame> {
        Some(ShadingFrame::new(self.normal.try_normalize()?, self.view.try_normalize()?))
    }

    /// The lobe at the shading point; `None` for the plain cosine.
    pub fn lobe(&self, frame: &ShadingFrame) -> Option<Lobe> {
        self.alpha.map(|alpha| Table::shipped().lobe(alpha as f32, frame.cos_theta as f32))
    }

    /// The shading point relative to the camera.
    pub fn place(&self) -> DVec3 {
        self.position - self.stage.eye
    }

    /// The line of `glyphlight probe integral` that asks for this integral.
    pub fn line(&self, id: serde_json::Value) -> Line {
        let Stage { shape, placement, eye } = &*self.stage;
        Line {
            id,
            curves: shape.curves().map(|c| c.points().map(|p| p.to_array())).collect(),
            light: Axes { origin: placement.origin.to_array(), x: placement.x.to_array(), y: placement.y.to_array() },
            eye: eye.to_array(),
            position: self.position.to_array(),
            normal: self.normal.to_array(),
            view: self.view.to_array(),
            alpha: self.alpha,
            tolerance: Some(self.tolerance),
        }
    }

    /// The case that a line asks for, to `tolerance` where it says none itself.
    ///
    /// # Errors
    /// Which of its values is out of range.
    pub fn of_line(line: &Line, tolerance: f32) -> Result<Self, String> {
        let Line { curves, light, eye, position, normal, view, alpha, .. } = line;
        let tolerance = line.tolerance.unwrap_or(tolerance);
        if !(tolerance.is_finite() && tolerance > 0.0) {
            return Err(format!("`tolerance` = {tolerance} is not a finite number above 0"));
        }
        let point = |key: &str, v: [f64; 3]| {
            let inside = v.iter().all(|x| x.abs() <= FARTHEST);
            inside.then(|| DVec3::from_array(v)).ok_or_else(|| format!("`{key}` = {v:?} is beyond ±{FARTHEST:e} m"))
        };
        let direction = |key: &str, v: [f64; 3]| {
            let d = DVec3::from_array(v);
            d.try_normalize().map(|_| d).ok_or_else(|| format!("`{key}` = {v:?} has no direction"))
        };
        if let Some(alpha) = alpha.filter(|a| !(0.0..=1.0).contains(a)) {
            return Err(format!("`alpha` = {alpha} is not between 0 and 1"));
        }
        let placement = Placement {
            origin: point("light.origin", light.origin)?,
            x: point("light.x", light.x)?,
            y: point("light.y", light.y)?,
        };
        let stage = Stage { shape: shape_of(curves)?, placement, eye: point("eye", *eye)? };
        Ok(Self {
            stage: Arc::new(stage),
            position: point("position", *position)?,
            normal: direction("normal", *normal)?,
            view: direction("view", *view)?,
            alpha: *alpha,
            tolerance,
        })
    }
}

/// Farthest place in the world along an axis, metres.
const FARTHEST: f64 = 1e12;

/// Largest coordinate in light space.
const LARGEST: f64 = 1e30;

/// A case as one JSON object.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// What the answer is called.
    pub id: serde_json::Value,
    /// Closed contours, cubics in order; a new contour starts where a curve does not begin at the last end point.
    pub curves: Vec<[[f64; 2]; 4]>,
    /// Where the light stands.
    pub light: Axes,
    /// The camera's place in the world.
    #[serde(default)]
    pub eye: [f64; 3],
    /// The shading point in the world.
    pub position: [f64; 3],
    /// Its normal, of any length.
    pub normal: [f64; 3],
    /// Towards the eye, of any length.
    pub view: [f64; 3],
    /// GGX width of the specular lobe; without it the integral is that of the plain cosine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// Largest error asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f32>,
}

/// World images of the light-space origin and axes.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// Of the origin.
    pub origin: [f64; 3],
    /// Of the x axis.
    pub x: [f64; 3],
    /// Of the y axis.
    pub y: [f64; 3],
}

/// The shape of a list of curves, split where one does not begin at the last end point.
///
/// # Errors
/// What is wrong with `curves`.
pub fn shape_of(curves: &[[[f64; 2]; 4]]) -> Result<Shape, String> {
    let mut contours: Vec<Vec<CubicBez>> = Vec::new();
    let mut end = None;
    for points in curves {
        if let Some(point) = points.iter().find(|p| p.iter().any(|v| v.abs() > LARGEST)) {
            return Err(format!("`curves`: control point {point:?} is beyond ±{LARGEST:e}"));
        }
        let [p0, p1, p2, p3] = points.map(DVec2::from_array);
        let curve = CubicBez::new(p0, p1, p2, p3);
        match contours.last_mut() {
            Some(contour) if end == Some(p0) => contour.push(curve),
            _ => contours.push(vec![curve]),
        }
        end = Some(p3);
    }
    if contours.is_empty() {
        return Err("`curves` is empty".into());
    }
    Shape::from_contours(contours).map_err(|e| format!("`curves`: {e}"))
}
