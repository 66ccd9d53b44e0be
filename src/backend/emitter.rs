//! [`Emitter`]: an emission as the technique at hand reads it.

use super::{BackendError, Technique};
use crate::kernel::curve::Curve;
use crate::light::curves::curves;
use crate::light::picture::Picture;
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
    /// Curves to subdivide.
    Kuge {
        /// In the emitter's square.
        curves: Vec<Curve>,
        /// Least contribution of a triangle that is subdivided; the paper's own where `None`.
        eps: Option<f32>,
    },
    /// Curves to step along.
    Uniform {
        /// In the emitter's square.
        curves: Vec<Curve>,
        /// Edges per curve.
        segments: u32,
    },
}

impl Geometry {
    fn new(layer: &Layer, square: Square, technique: &Technique) -> Result<Self, TreeError> {
        Ok(match *technique {
            Technique::Exact | Technique::Reference(_) => Self::Shape,
            Technique::Kuge { eps } => Self::Kuge { curves: curves(&layer.shape, square), eps },
            Technique::Uniform { segments } => Self::Uniform { curves: curves(&layer.shape, square), segments },
            _ => Self::Tree(Tree::new(&layer.shape)?),
        })
    }
}

impl Emitter {
    fn new(scene: &Scene, index: usize, layer: &Layer, technique: &Technique) -> Result<Self, BackendError> {
        let light: &AreaLight = &scene.lights[index];
        let named = |source| BackendError::Light { light: light.name.clone(), source };
        let square = Square::around(layer.shape.bounds()).ok_or_else(|| named(TreeError::NoArea))?;
        let mut placement = light.placement;
        placement.origin -= scene.camera.position;
        Ok(Self {
            light: index,
            placement,
            radiance: layer.radiance.as_vec3(),
            opacity: layer.opacity as f32,
            two_sided: light.two_sided,
            form: light.form,
            shape: layer.shape.clone(),
            square,
            picture: layer.picture.clone(),
            geometry: Geometry::new(layer, square, technique).map_err(named)?,
        })
    }

    /// A one-sided emission of radiance 1, placed nowhere.
    ///
    /// # Errors
    /// [`TreeError`] where the shape is no region.
    pub fn of_shape(shape: Shape, technique: &Technique) -> Result<Self, TreeError> {
        let square = Square::around(shape.bounds()).ok_or(TreeError::NoArea)?;
        let layer = Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None };
        Ok(Self {
            light: 0,
            placement: Placement { origin: DVec3::ZERO, x: DVec3::X, y: DVec3::Y },
            radiance: Vec3::ONE,
            opacity: 1.0,
            two_sided: false,
            form: Form::Outline,
            square,
            picture: None,
            geometry: Geometry::new(&layer, square, technique)?,
            shape: layer.shape,
        })
    }

    /// The shape as a reader behind the light sees it: mirrored in x.
    pub fn from_behind(&self) -> Shape {
        self.shape.transformed(DAffine2::from_scale(DVec2::new(-1.0, 1.0)))
    }
}

/// One emitter for each layer of each light, relative to the camera.
pub fn emitters(scene: &Scene, technique: &Technique) -> Result<Vec<Emitter>, BackendError> {
    let mut emitters = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        for layer in &light.layers {
            emitters.push(Emitter::new(scene, index, layer, technique)?);
        }
    }
    Ok(emitters)
}
