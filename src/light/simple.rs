//! Simple lights: rectangles, discs, ellipses, spheres and tubes as shapes, and the faces by which bodies shine.
//!
//! A body is convex and shines alike everywhere, so a point is lit by the solid angle of its silhouette, whatever plane that
//! is drawn in. The silhouette of a sphere is a disc that faces the point. That of a tube's round side is a rectangle that
//! faces the point and, at either end, the region between the rectangle's end and the rim: half an ellipse, seen in the
//! right plane. All of them are affine images of shapes that stay the same, so each has one tree. The geometry is
//! [`crate::kernel::body`].

use super::{AreaLight, Form, Layer, Placement};
use crate::shape::Shape;
use core::f64::consts::{PI, TAU};
use glam::{DAffine2, DVec2, DVec3};

/// Cubics of a disc. Four would make a light of the same cost (trees cut curves that turn by 90° anyway) and of 65 times the
/// error: 2e-4 of the integral near the rim.
const ARCS: u32 = 8;

/// A rectangle about the origin, by its width and height.
pub fn rectangle(size: DVec2) -> (Form, Shape) {
    (Form::Rectangle, Shape::rectangle(size * -0.5, size * 0.5))
}

/// A disc about the origin: eight cubics of exactly its area, off its rim by 4.2e-6 of the radius.
pub fn disc(radius: f64) -> (Form, Shape) {
    ellipse(DVec2::splat(2.0 * radius))
}

/// An ellipse about the origin with axes along x and y, by its width and height: a stretched [`disc`].
pub fn ellipse(size: DVec2) -> (Form, Shape) {
    (Form::Disc, Shape::disc(ARCS).transformed(DAffine2::from_scale(size * 0.5)))
}

/// A sphere about the origin. The shape is a disc of its radius.
pub fn sphere(radius: f64) -> (Form, Shape) {
    (Form::Sphere { radius }, Shape::disc(ARCS).transformed(DAffine2::from_scale(DVec2::splat(radius))))
}

/// A tube about the origin along the x axis, from cap to cap. The shape is a rectangle of its length and diameter.
pub fn tube(radius: f64, length: f64) -> (Form, Shape) {
    let half = DVec2::new(0.5 * length, radius);
    (Form::Tube { radius, length }, Shape::rectangle(-half, half))
}

impl Form {
    /// The area of all that shines, light space, where one side of the light's shape has the area `face`.
    pub fn emitting_area(&self, face: f64) -> f64 {
        match *self {
            Self::Outline | Self::Rectangle | Self::Disc => face,
            Self::Sphere { radius } => 4.0 * PI * radius * radius,
            Self::Tube { radius, length } => TAU * radius * (length + radius),
        }
    }

    /// Whether it has a volume, and so no back.
    pub const fn is_body(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Tube { .. })
    }
}

/// How a face turns to the point that it shines on. Lengths are in light-space units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Facing {
    /// It stays where its placement puts it.
    #[default]
    Fixed,
    /// It is a whole sphere or tube, for techniques that know what that is.
    Whole,
    /// The silhouette of a sphere.
    Sphere {
        /// Of the sphere.
        radius: f64,
    },
    /// The silhouette of a tube's round side, from end to end straight.
    Side {
        /// Of the tube.
        radius: f64,
    },
    /// What the rim of a tube's end adds to the side, or hides of it.
    End {
        /// Of the tube.
        radius: f64,
        /// Where the end is on the light-space x axis.
        at: f64,
    },
}

impl Facing {
    /// Whether the face counts from both sides: what a rim hides is seen from behind.
    pub const fn has_two_sides(&self) -> bool {
        matches!(self, Self::End { .. })
    }
}

/// A part of a light that is flat as each point sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Its outline in light space, and what it sends out.
    pub layer: Layer,
    /// Light space to world space. That of the whole light, but for a tube's caps.
    pub placement: Placement,
    /// How it turns.
    pub facing: Facing,
}

/// The faces by which one layer of a light shines. The first of a body is that of its round surface.
///
/// A tube has five: the side, what both rims add to it, and the caps. They have no pictures: a layer's is left out. A body that
/// is to be taken `whole` has one face, which is just the light.
pub fn faces(light: &AreaLight, layer: &Layer, whole: bool) -> Vec<Face> {
    let placement = light.placement;
    let own = |facing: Facing| {
        let picture = layer.picture.clone().filter(|_| matches!(facing, Facing::Fixed | Facing::Whole));
        Face { layer: Layer { picture, ..layer.clone() }, placement, facing }
    };
    match light.form {
        Form::Outline | Form::Rectangle | Form::Disc => vec![own(Facing::Fixed)],
        Form::Sphere { .. } | Form::Tube { .. } if whole => vec![own(Facing::Whole)],
        Form::Sphere { radius } => vec![own(Facing::Sphere { radius })],
        Form::Tube { radius, length } => {
            let scaled = |shape: Shape| Layer {
                shape: shape.transformed(DAffine2::from_scale(DVec2::splat(radius))),
                picture: None,
                ..*layer
            };
            let (half, rim, disc) = (0.5 * length, scaled(Shape::half_disc(ARCS)), scaled(Shape::disc(ARCS)));
            let end = |at: f64| Face { layer: rim.clone(), placement, facing: Facing::End { radius, at } };
            // y × z points along the axis, −y × z against it.
            let Placement { origin, x, y } = placement;
            let z = x.cross(y) / x.length();
            let cap = |at: f64, x: DVec3| Face {
                layer: disc.clone(),
                placement: Placement { origin: origin + placement.x * at, x, y: z },
                facing: Facing::Fixed,
            };
            vec![own(Facing::Side { radius }), end(half), end(-half), cap(half, y), cap(-half, -y)]
        }
    }
}
