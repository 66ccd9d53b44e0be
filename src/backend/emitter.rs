//! [`Emitter`]: an emission as the technique at hand reads it.

use super::{BackendError, Technique};
use crate::light::picture::Picture;
use crate::light::simple::{Face, Facing, faces};
use crate::light::tree::{Tree, TreeError};
use crate::light::{AreaLight, Form, Layer, Placement, Square};
use crate::scene::Scene;
use crate::shape::Shape;
use glam::{DAffine2, DVec2, DVec3, Vec3};
use std::sync::Arc;

/// One emission of one light, ready for one technique.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// Index of the light in the scene.
    pub light: usize,
    /// Light space to the world relative to the camera; right-handed with the lit side.
    pub placement: Placement,
    /// Radiance, linear Rec.709.
    pub radiance: Vec3,
    /// Opacity towards the camera.
    pub opacity: f32,
    /// Whether the back emits.
    pub two_sided: bool,
    /// What the light is as a body.
    pub form: Form,
    /// How the region turns to the point that it shines on.
    pub facing: Facing,
    /// The region.
    pub shape: Shape,
    /// The square that the region is normalised to.
    pub square: Square,
    /// Colours the radiance is multiplied by.
    pub picture: Option<Arc<Picture>>,
    /// The region as the technique reads it.
    pub geometry: Geometry,
}

/// A region as a technique reads it.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// The region itself.
    Shape,
    /// A chord–moment tree.
    Tree(Tree),
}

impl Geometry {
    fn new(layer: &Layer, technique: &Technique) -> Result<Self, TreeError> {
        Ok(match technique {
            Technique::Exact | Technique::Reference(_) => Self::Shape,
            _ => Self::Tree(Tree::new(&layer.shape)?),
        })
    }
}

impl Emitter {
    fn new(scene: &Scene, index: usize, face: Face, technique: &Technique) -> Result<Self, BackendError> {
        let light: &AreaLight = &scene.lights[index];
        let named = |source| BackendError::Light { light: light.name.clone(), source };
        let Face { layer, mut placement, facing } = face;
        placement.origin -= scene.camera.position;
        Ok(Self {
            light: index,
            placement,
            radiance: layer.radiance.as_vec3(),
            opacity: layer.opacity as f32,
            // What a rim hides is seen from behind.
            two_sided: light.two_sided || matches!(facing, Facing::End { .. }),
            form: light.form,
            facing,
            square: Square::around(layer.shape.bounds()).ok_or_else(|| named(TreeError::NoArea))?,
            geometry: Geometry::new(&layer, technique).map_err(named)?,
            picture: layer.picture,
            shape: layer.shape,
        })
    }

    /// A one-sided emission of radiance 1, placed nowhere.
    ///
    /// # Errors
    /// [`TreeError`] where the shape is no region.
    pub fn of_shape(shape: Shape, technique: &Technique) -> Result<Self, TreeError> {
        let layer = Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None };
        Ok(Self {
            light: 0,
            placement: Placement { origin: DVec3::ZERO, x: DVec3::X, y: DVec3::Y },
            radiance: Vec3::ONE,
            opacity: 1.0,
            two_sided: false,
            form: Form::Outline,
            facing: Facing::Fixed,
            square: Square::around(layer.shape.bounds()).ok_or(TreeError::NoArea)?,
            picture: None,
            geometry: Geometry::new(&layer, technique)?,
            shape: layer.shape,
        })
    }

    /// The shape as a reader behind the light sees it: mirrored in x.
    pub fn from_behind(&self) -> Shape {
        self.shape.transformed(DAffine2::from_scale(DVec2::new(-1.0, 1.0)))
    }
}

/// The emitters of all lights, relative to the camera: one for each layer of an outline, one or more for a body.
pub fn emitters(scene: &Scene, technique: &Technique) -> Result<Vec<Emitter>, BackendError> {
    let mut emitters = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        for layer in &light.layers {
            let faces = faces(light, layer).into_iter();
            for face in faces.take(if technique.takes_bodies_whole() { 1 } else { usize::MAX }) {
                emitters.push(Emitter::new(scene, index, face, technique)?);
            }
        }
    }
    Ok(emitters)
}
