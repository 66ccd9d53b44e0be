//! [`Emitter`]: an emission as the technique at hand reads it.

use super::technique::Basis;
use super::{BackendError, Technique};
use crate::kernel::pal;
use crate::kernel::representative::{DISC, RECTANGLE, SPHERE, Solid, TUBE};
use crate::light::distance::Polygons;
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
    /// Polygons and the basis they are projected with, one of [`crate::kernel::pal`].
    Polygons(Polygons, u32),
    /// A simple body, or the rectangle around the region.
    Solid(Solid),
}

impl Geometry {
    fn new(
        layer: &Layer,
        form: Form,
        placement: &Placement,
        square: Square,
        technique: &Technique,
    ) -> Result<Self, TreeError> {
        Ok(match technique {
            Technique::Exact | Technique::Reference(_) => Self::Shape,
            Technique::Pal { basis } => {
                let sides = DVec2::new(placement.x.length(), placement.y.length());
                let basis = match basis {
                    Basis::Centred => pal::CENTRED,
                    Basis::Weighted => pal::WEIGHTED,
                    Basis::Biased => pal::BIASED,
                };
                Self::Polygons(Polygons::new(&layer.shape, square, sides / sides.max_element()), basis)
            }
            Technique::Representative => Self::Solid(solid(form, &layer.shape, square)),
            _ => Self::Tree(Tree::new(&layer.shape)?),
        })
    }
}

/// A light as a body; an outline as the rectangle around it, shining by the part of it that the shape fills.
fn solid(form: Form, shape: &Shape, square: Square) -> Solid {
    let half = (shape.bounds().size() * (0.5 / square.half)).as_vec2();
    let flat = |kind, coverage| Solid { half, kind, coverage };
    let round = |kind, half: DVec2| Solid { half: (half / square.half).as_vec2(), kind, coverage: 1.0 };
    match form {
        Form::Outline => {
            let whole = 4.0 * f64::from(half.x * half.y) * square.half * square.half;
            flat(RECTANGLE, (shape.area() / whole).clamp(0.0, 1.0) as f32)
        }
        Form::Rectangle => flat(RECTANGLE, 1.0),
        Form::Disc => flat(DISC, 1.0),
        Form::Sphere { radius } => round(SPHERE, DVec2::splat(radius)),
        Form::Tube { radius, length } => round(TUBE, DVec2::new(0.5 * length, radius)),
    }
}

impl Emitter {
    fn new(scene: &Scene, index: usize, layer: &Layer, technique: &Technique) -> Result<Self, BackendError> {
        let light: &AreaLight = &scene.lights[index];
        let named = |source| BackendError::Light { light: light.name.clone(), source };
        let mut placement = light.placement;
        placement.origin -= scene.camera.position;
        let square = Square::around(layer.shape.bounds()).ok_or_else(|| named(TreeError::NoArea))?;
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
            geometry: Geometry::new(layer, light.form, &placement, square, technique).map_err(named)?,
        })
    }

    /// A one-sided emission of radiance 1, placed nowhere.
    ///
    /// # Errors
    /// [`TreeError`] where the shape is no region.
    pub fn of_shape(shape: Shape, technique: &Technique) -> Result<Self, TreeError> {
        let layer = Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None };
        let placement = Placement { origin: DVec3::ZERO, x: DVec3::X, y: DVec3::Y };
        let square = Square::around(layer.shape.bounds()).ok_or(TreeError::NoArea)?;
        Ok(Self {
            light: 0,
            placement,
            radiance: Vec3::ONE,
            opacity: 1.0,
            two_sided: false,
            form: Form::Outline,
            square,
            picture: None,
            geometry: Geometry::new(&layer, Form::Outline, &placement, square, technique)?,
            shape: layer.shape,
        })
    }

    /// Whether it is a body with a volume, which has no back.
    pub fn is_round(&self) -> bool {
        matches!(&self.geometry, Geometry::Solid(solid) if matches!(solid.kind, SPHERE | TUBE))
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
