//! [`AreaLight`]: shapes with emission, placed in the world.

pub mod cluster;
pub mod curves;
pub mod distance;
pub mod mask;
pub mod mosaic;
pub mod prefilter;
pub mod simple;
pub mod tree;

use crate::outline::svg::ArtLayer;
use crate::picture::Picture;
use crate::shape::{Bounds, Shape};
use glam::{DMat3, DVec2, DVec3, DVec4};
use std::sync::Arc;

/// Where a light stands: the affine map from light space to world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// World image of the light-space origin, metres.
    pub origin: DVec3,
    /// World image of the light-space x axis; its length is the scale.
    pub x: DVec3,
    /// World image of the light-space y axis.
    pub y: DVec3,
}

impl Placement {
    /// `world = T·Rz·Ry·Rx·S`, rotation in degrees, scale per axis of light space.
    ///
    /// A negative scale mirrors the shape and leaves the lit side where the rotation puts it: callers mirror
    /// the shape ([`Shape::transformed`]) and pass magnitudes here.
    pub fn new(position: DVec3, rotation_degrees: DVec3, scale: DVec2) -> Self {
        let r = rotation_degrees * (core::f64::consts::PI / 180.0);
        let m = DMat3::from_rotation_z(r.z) * DMat3::from_rotation_y(r.y) * DMat3::from_rotation_x(r.x);
        Self { origin: position, x: m.x_axis * scale.x, y: m.y_axis * scale.y }
    }

    /// The light-space point below which a world point lies: across `x` and `y`, whatever its distance from the plane.
    pub fn light_point(&self, p: DVec3) -> DVec2 {
        let normal = self.normal();
        let (p, area) = (p - self.origin, normal.length_squared());
        DVec2::new(p.cross(self.y).dot(normal), self.x.cross(p).dot(normal)) / area
    }

    /// The world point of a light-space point.
    pub fn point(&self, p: DVec2) -> DVec3 {
        self.origin + self.x * p.x + self.y * p.y
    }

    /// `x × y`: points to the lit side; its length is the factor from light-space to world area.
    pub fn normal(&self) -> DVec3 {
        self.x.cross(self.y)
    }
}

/// A square of light space that techniques normalise a shape to: its \[−1, 1\]² is *tree space*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Square {
    /// Its middle, light space.
    pub center: DVec2,
    /// Half its side, light-space units; more than 0.
    pub half: f64,
}

impl Square {
    /// The smallest about a box. `None` where that is a point or not finite.
    pub fn around(bounds: Bounds) -> Option<Self> {
        let half = bounds.size().max_element() * 0.5;
        (half.is_finite() && half > 0.0).then(|| Self { center: bounds.center(), half })
    }
}

/// One emission: a shape that sends out one radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The emitting region, light space.
    pub shape: Shape,
    /// Radiance L, W·sr⁻¹·m⁻², linear Rec.709, already multiplied by `opacity`.
    pub radiance: DVec3,
    /// How much of what lies behind the layer it hides from the camera, 0 to 1.
    pub opacity: f64,
    /// Colours the radiance is multiplied by, from place to place.
    pub picture: Option<Arc<Picture>>,
}

impl Layer {
    /// A layer of a drawing, of radiance 1 in white; without its own colours it is white, at its (mean) opacity.
    pub fn of_art(art: ArtLayer, own_colors: bool) -> Self {
        let ArtLayer { shape, color, opacity, picture, .. } = art;
        match picture.filter(|_| own_colors) {
            Some(picture) => Self { shape, radiance: DVec3::ONE, opacity: 1.0, picture: Some(picture) },
            // The colours are multiplied by the opacity already.
            None => {
                let radiance = if own_colors { DVec3::from_array(color) } else { DVec3::splat(opacity) };
                Self { shape, radiance, opacity, picture: None }
            }
        }
    }

    /// Mean colour of its picture over the shape, linear, multiplied by alpha (w); white without a picture.
    pub fn mean_color(&self) -> DVec4 {
        self.picture.as_ref().map_or(DVec4::ONE, |picture| picture.mean_over(&self.shape).as_dvec4())
    }
}

/// What a light is as a body. The layers of all but an outline are one: the body's face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Form {
    /// Flat, bounded by the outlines of its layers.
    #[default]
    Outline,
    /// Flat; the layer is a rectangle.
    Rectangle,
    /// Flat; the layer is a disc or an ellipse with axes along x and y.
    Disc,
    /// A sphere about the light-space origin; the layer is a disc of its radius.
    Sphere {
        /// Light-space units.
        radius: f64,
    },
    /// A cylinder along the light-space x axis, with flat caps; the layer is a rectangle of its length and diameter.
    Tube {
        /// Light-space units.
        radius: f64,
        /// From cap to cap, light-space units.
        length: f64,
    },
}

/// A light: layers that add up, in one plane, facing `x × y`; or a body ([`Form`]).
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    /// What messages call it: the text, the SVG file, or its number in the scene.
    pub name: String,
    /// The emissions. Overlapping layers add their radiance.
    pub layers: Vec<Layer>,
    /// What it is as a body.
    pub form: Form,
    /// Light space to world space.
    pub placement: Placement,
    /// Whether the back emits as well.
    pub two_sided: bool,
}
