//! [`Emitter`]: an emission as the technique at hand reads it.

use super::reference::region::Region;
use super::stage::{Changes, LightChange, Reuse};
use super::technique::{Basis, Sampling};
use super::{BackendError, Technique};
use crate::kernel::curve::Curve;
use crate::kernel::pal;
use crate::kernel::quad::Quad;
use crate::kernel::representative::{DISC, RECTANGLE, SPHERE, Solid, TUBE};
use crate::light::curves::curves;
use crate::light::distance::Polygons;
use crate::light::mask::{light_picture, shape_picture};
use crate::light::mosaic::{CELLS, Mosaic};
use crate::light::prefilter::Prefiltered;
use crate::light::simple::{Face, Facing, faces};
use crate::light::tree::{Tree, TreeError};
use crate::light::{AreaLight, Form, Layer, Placement, Square};
use crate::picture::Picture;
use crate::scene::Scene;
use crate::shape::{Bounds, Shape};
use glam::{DAffine2, DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// One emission of one light, ready for one technique. For `quad` it is the whole light, its layers one picture.
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
    /// The picture as techniques without sampling read it: what the integral is multiplied by.
    pub colors: Option<Arc<Prefiltered>>,
    /// The region as the technique reads it.
    pub geometry: Geometry,
}

/// Why an integral is zero without having been evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skip {
    /// The point is behind a one-sided light or in its plane.
    Behind,
    /// The light is wholly below a horizon.
    BelowHorizon,
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
    /// The bounding rectangle.
    Quad(Quad),
    /// Polygons and the basis they are projected with, one of [`crate::kernel::pal`].
    Polygons(Polygons, u32),
    /// A simple body, or the rectangle around the region.
    Solid(Solid),
    /// Chord–moment trees of tiles of one colour each.
    Mosaic(Mosaic),
    /// A grid over the region, to be sampled.
    Sampled {
        /// The grid.
        region: Arc<Region>,
        /// How it is sampled.
        sampling: Sampling,
    },
}

/// What a region is a part of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Whole {
    /// What the light is as a body.
    pub form: Form,
    /// Where it stands.
    pub placement: Placement,
    /// Its longer side, light-space units.
    pub extent: f64,
}

impl Geometry {
    /// The region of `layer` as `technique` reads it.
    ///
    /// # Errors
    /// [`TreeError`] where it is none.
    pub fn new(layer: &Layer, whole: &Whole, technique: &Technique) -> Result<Self, TreeError> {
        let square = Square::around(layer.shape.bounds()).ok_or(TreeError::NoArea)?;
        Ok(match *technique {
            Technique::Tree if let Some(picture) = &layer.picture => {
                Self::Mosaic(Mosaic::new(&layer.shape, picture, whole.extent / CELLS)?)
            }
            Technique::Exact => Self::Shape,
            Technique::Reference(sampling) => Self::Sampled { region: Arc::new(Region::new(&layer.shape)), sampling },
            Technique::Kuge { eps } => Self::Kuge { curves: curves(&layer.shape, square), eps },
            Technique::Uniform { segments } => Self::Uniform { curves: curves(&layer.shape, square), segments },
            Technique::Pal { basis } => {
                let sides = DVec2::new(whole.placement.x.length(), whole.placement.y.length());
                let basis = match basis {
                    Basis::Centred => pal::CENTRED,
                    Basis::Weighted => pal::WEIGHTED,
                    Basis::Biased => pal::BIASED,
                };
                Self::Polygons(Polygons::new(&layer.shape, square, sides / sides.max_element()), basis)
            }
            Technique::Representative => Self::Solid(solid(whole.form, &layer.shape, square)),
            _ => Self::Tree(Tree::new(&layer.shape)?),
        })
    }
}

/// A light as a body; an outline as the rectangle around it, shining by the part of it that the shape fills.
fn solid(form: Form, shape: &Shape, square: Square) -> Solid {
    let bounds = shape.extent();
    let half = (bounds.size() * (0.5 / square.half)).as_vec2();
    let center = ((bounds.center() - square.center) / square.half).as_vec2();
    let flat = |kind, coverage| Solid { center, half, kind, coverage };
    let round = |kind, half: DVec2| {
        let origin = (-square.center / square.half).as_vec2();
        Solid { center: origin, half: (half / square.half).as_vec2(), kind, coverage: 1.0 }
    };
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

/// What one emitter is made of: a face of the light of that index, or layers to be taken together.
enum Part<'a> {
    Face(usize, Face),
    Quad(usize, Cow<'a, [Layer]>, Placement, Facing, u32),
}

impl Part<'_> {
    /// Index of the light in the scene.
    const fn light(&self) -> usize {
        match self {
            Self::Face(light, _) | Self::Quad(light, ..) => *light,
        }
    }

    /// The emitter. What it is in light space is taken from `known`, if that is still right.
    fn emitter(
        self,
        scene: &Scene,
        technique: &Technique,
        known: Option<(Emitter, LightChange)>,
    ) -> (bool, Result<Emitter, BackendError>) {
        match (self, known) {
            (Self::Face(index, face), Some((known, _))) if known.is_right(&face.placement, technique) => {
                (true, Ok(known.moved(scene, index, &face)))
            }
            (Self::Quad(.., placement, _, _), Some((mut known, change))) if !change.radiance => {
                known.placement = relative(placement, scene);
                (true, Ok(known))
            }
            (Self::Face(index, face), _) => (false, Emitter::new(scene, index, face, technique)),
            (Self::Quad(index, layers, placement, facing, mask), _) => {
                (false, Emitter::quad(scene, index, &layers, placement, facing, mask))
            }
        }
    }
}

/// A placement relative to the camera.
fn relative(mut placement: Placement, scene: &Scene) -> Placement {
    placement.origin -= scene.camera.position;
    placement
}

impl Emitter {
    /// Whether it is in light space what it would be with another placement.
    fn is_right(&self, placement: &Placement, technique: &Technique) -> bool {
        // Petryaev's distances are measured in the world's proportions.
        let sides = |p: &Placement| [p.x.length(), p.y.length()];
        !matches!(technique, Technique::Pal { .. }) || sides(placement) == sides(&self.placement)
    }

    /// The same face with another placement and radiance.
    fn moved(self, scene: &Scene, index: usize, face: &Face) -> Self {
        let peak = self.colors.as_ref().map_or(Vec3::ONE, |c| c.peak);
        let radiance = face.layer.radiance.as_vec3() * peak;
        Self { light: index, placement: relative(face.placement, scene), radiance, ..self }
    }

    fn new(scene: &Scene, index: usize, face: Face, technique: &Technique) -> Result<Self, BackendError> {
        let light: &AreaLight = &scene.lights[index];
        let Face { layer, placement, facing } = face;
        let named = |source| BackendError::Light { light: light.name.clone(), source };
        let bounds = light.layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
        let placement = relative(placement, scene);
        let square = Square::around(layer.shape.bounds()).ok_or_else(|| named(TreeError::NoArea))?;
        let whole = Whole { form: light.form, placement, extent: bounds.size().max_element() };
        let geometry = Geometry::new(&layer, &whole, technique).map_err(named)?;
        // Sampling and mosaics read the picture itself.
        let prefilters = !matches!(geometry, Geometry::Shape | Geometry::Sampled { .. } | Geometry::Mosaic(_));
        let colors = layer.picture.as_ref().filter(|_| prefilters).and_then(|p| colors(&layer.shape, p, &square));
        let peak = colors.as_ref().map_or(Vec3::ONE, |c| c.peak);
        Ok(Self {
            light: index,
            placement,
            radiance: layer.radiance.as_vec3() * peak,
            opacity: layer.opacity as f32,
            two_sided: light.two_sided || facing.has_two_sides(),
            form: light.form,
            facing,
            shape: layer.shape,
            square,
            picture: layer.picture,
            colors,
            geometry,
        })
    }

    /// Layers of a light as one picture on their bounding rectangle.
    fn quad(
        scene: &Scene,
        index: usize,
        layers: &[Layer],
        placement: Placement,
        facing: Facing,
        mask: u32,
    ) -> Result<Self, BackendError> {
        let light: &AreaLight = &scene.lights[index];
        let none = || BackendError::Light { light: light.name.clone(), source: TreeError::NoArea };
        let placement = relative(placement, scene);
        let picture = light_picture(layers, mask).ok_or_else(none)?;
        let (low, high) = (picture.low, picture.high);
        let square = Square::around(Bounds { min: low, max: high }).ok_or_else(none)?;
        let colors = Prefiltered::new(&picture, &square);
        Ok(Self {
            light: index,
            placement,
            radiance: colors.peak,
            opacity: 1.0,
            two_sided: light.two_sided || facing.has_two_sides(),
            form: light.form,
            facing,
            shape: Shape::rectangle(low, high),
            square,
            picture: Some(Arc::new(picture)),
            colors: Some(Arc::new(colors)),
            geometry: Geometry::Quad(Quad::new((high - low) * 0.5 / square.half)),
        })
    }

    /// A one-sided emission of radiance 1, placed nowhere.
    ///
    /// # Errors
    /// [`TreeError`] where the shape is no region.
    pub fn of_shape(shape: Shape, technique: &Technique) -> Result<Self, TreeError> {
        let square = Square::around(shape.bounds()).ok_or(TreeError::NoArea)?;
        let layer = Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None };
        let placement = Placement { origin: DVec3::ZERO, x: DVec3::X, y: DVec3::Y };
        let whole = Whole { form: Form::Outline, placement, extent: 2.0 * square.half };
        Ok(Self {
            light: 0,
            placement,
            radiance: Vec3::ONE,
            opacity: 1.0,
            two_sided: false,
            form: Form::Outline,
            facing: Facing::Fixed,
            square,
            picture: None,
            colors: None,
            geometry: Geometry::new(&layer, &whole, technique)?,
            shape: layer.shape,
        })
    }

    /// Half the side of its square in the world, the longer if it is stretched; metres.
    pub fn world_half(&self) -> f64 {
        self.square.half * self.placement.x.length().max(self.placement.y.length())
    }

    /// The shape as a reader behind the light sees it: mirrored in x.
    pub fn from_behind(&self) -> Shape {
        self.shape.transformed(DAffine2::from_scale(DVec2::new(-1.0, 1.0)))
    }
}

/// Fewest and most texels along the longer side of a shape's prefiltered picture.
const COLOR_SIZES: [f64; 2] = [64.0, 1024.0];

/// A layer's picture, prefiltered for its shape, at the picture's own resolution. `None` for a shape of no extent.
fn colors(shape: &Shape, picture: &Picture, square: &Square) -> Option<Arc<Prefiltered>> {
    let density = DVec2::new(f64::from(picture.width), f64::from(picture.height)) / (picture.high - picture.low);
    let size = (shape.extent().size() * density).max_element().ceil().clamp(COLOR_SIZES[0], COLOR_SIZES[1]);
    let on_shape = shape_picture(shape, picture, size as u32)?;
    Some(Arc::new(Prefiltered::new(&on_shape, square)))
}

/// The emitters of all lights, relative to the camera: one for each layer of a flat light, or for all of them together (`quad`);
/// one or more for a body, its round surface first.
pub fn emitters(scene: &Scene, technique: &Technique) -> Result<Vec<Emitter>, BackendError> {
    emitters_after(scene, technique, Vec::new(), None, &mut Reuse::default())
}

/// As [`emitters`]. `known` are those before the `changes`, or none.
pub fn emitters_after(
    scene: &Scene,
    technique: &Technique,
    known: Vec<Emitter>,
    changes: Option<&Changes>,
    reuse: &mut Reuse,
) -> Result<Vec<Emitter>, BackendError> {
    let parts = parts(scene, technique);
    let change = |e: &Emitter| changes.map_or_else(LightChange::default, |c| c.lights[e.light]);
    let mut known = known.into_iter().map(|e| (change(&e), e)).filter(|(change, _)| !change.whole).peekable();
    // In the order of lights, as the parts are: of a light that has changed as a whole none is left.
    let known: Vec<_> = parts.iter().map(|part| known.next_if(|(_, e)| e.light == part.light())).collect();
    let made: Vec<_> = parts
        .into_par_iter()
        .zip(known)
        .map(|(part, known)| part.emitter(scene, technique, known.map(|(change, emitter)| (emitter, change))))
        .collect();
    let counted = |(is_reused, emitter): (bool, Result<Emitter, BackendError>)| {
        let emitter = emitter?;
        let what = match emitter.geometry {
            Geometry::Tree(_) | Geometry::Mosaic(_) => "trees",
            _ => "regions",
        };
        reuse.count(what, is_reused);
        Ok(emitter)
    };
    made.into_iter().map(counted).collect()
}

/// What the emitters are made of.
fn parts<'a>(scene: &'a Scene, technique: &Technique) -> Vec<Part<'a>> {
    let of_light = |(index, light): (usize, &'a AreaLight)| -> Vec<Part<'a>> {
        let whole = technique.takes_bodies_whole();
        let faces = || light.layers.iter().flat_map(|layer| faces(light, layer, whole));
        match *technique {
            Technique::Quad { mask } if light.form.is_body() => {
                let part = |f: Face| Part::Quad(index, Cow::Owned(vec![f.layer]), f.placement, f.facing, mask);
                faces().map(part).collect()
            }
            Technique::Quad { mask } if !light.layers.is_empty() => {
                vec![Part::Quad(index, Cow::Borrowed(&light.layers), light.placement, Facing::Fixed, mask)]
            }
            _ => faces().map(|face| Part::Face(index, face)).collect(),
        }
    };
    scene.lights.iter().enumerate().flat_map(of_light).collect()
}

/// All layers of all lights as the camera sees them: regions and pictures as they are.
pub fn layers(scene: &Scene) -> Result<Vec<Emitter>, BackendError> {
    emitters(scene, &Technique::Exact)
}
