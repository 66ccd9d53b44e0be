//! Simple lights: rectangles, discs, ellipses, spheres and tubes as shapes, and the faces by which bodies shine.
//!
//! A body is convex and shines alike everywhere, so a point is lit by the solid angle of its silhouette, whatever plane that
//! is drawn in. The silhouette of a sphere is a disc that faces the point. That of a tube's round side is a rectangle that
//! faces the point and, at either end, the region between the rectangle's end and the rim: half an ellipse, seen in the
//! right plane. All of them are affine images of shapes that stay the same, so each has one tree. The geometry is
//! [`crate::kernel::body`].

use super::{Form, Placement};
use crate::shape::Shape;
use core::f64::consts::{PI, TAU};
use glam::{DAffine2, DVec2};

/// Cubics of a disc or ellipse: the light is this outline, to every technique.
const DISC_ARCS: u32 = 4;
/// Cubics of a disc that stands for a body, which is truly round: a hundredth of the error.
const BODY_ARCS: u32 = 8;

/// A rectangle about the origin, by its width and height.
pub fn rectangle(size: DVec2) -> (Form, Shape) {
    (Form::Rectangle, Shape::rectangle(size * -0.5, size * 0.5))
}

/// A disc about the origin: four cubics of exactly its area.
pub fn disc(radius: f64) -> (Form, Shape) {
    ellipse(DVec2::splat(2.0 * radius))
}

/// An ellipse about the origin with axes along x and y, by its width and height: four cubics of exactly its area.
pub fn ellipse(size: DVec2) -> (Form, Shape) {
    (Form::Disc, Shape::disc(DISC_ARCS).transformed(DAffine2::from_scale(size * 0.5)))
}

/// A sphere about the origin. The shape is a disc of its radius.
pub fn sphere(radius: f64) -> (Form, Shape) {
    (Form::Sphere { radius }, Shape::disc(BODY_ARCS).transformed(DAffine2::from_scale(DVec2::splat(radius))))
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

/// A part of a light that is flat as each point sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Its outline, light space.
    pub shape: Shape,
    /// Light space to world space. That of the whole light, but for a tube's caps.
    pub placement: Placement,
    /// How it turns.
    pub facing: Facing,
}

/// The faces by which a light with one `shape` shines: a body's first face is its silhouette.
///
/// A tube has five: the side, what both rims add to it, and the caps.
pub fn faces(form: &Form, placement: &Placement, shape: &Shape) -> Vec<Face> {
    let face = |shape: Shape, placement: Placement, facing: Facing| Face { shape, placement, facing };
    match *form {
        Form::Outline | Form::Rectangle | Form::Disc => vec![face(shape.clone(), *placement, Facing::Fixed)],
        Form::Sphere { radius } => vec![face(shape.clone(), *placement, Facing::Sphere { radius })],
        Form::Tube { radius, length } => {
            let (scaled, half) = (DAffine2::from_scale(DVec2::splat(radius)), 0.5 * length);
            let end =
                |at: f64| face(Shape::half_disc(BODY_ARCS).transformed(scaled), *placement, Facing::End { radius, at });
            let mut faces = vec![face(shape.clone(), *placement, Facing::Side { radius }), end(half), end(-half)];
            let Placement { origin, x, y } = *placement;
            let z = x.cross(y) / x.length();
            for (at, x) in [(half, y), (-half, -y)] {
                // y × z points along the axis, −y × z against it.
                let cap = Placement { origin: origin + placement.x * at, x, y: z };
                faces.push(face(Shape::disc(BODY_ARCS).transformed(scaled), cap, Facing::Fixed));
            }
            faces
        }
    }
}
