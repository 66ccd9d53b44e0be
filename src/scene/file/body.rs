//! Simple lights of a scene file: which shape, and how large.

use super::LENGTH;
use super::error::SceneError;
use super::table::{Table, Value};
use crate::light::{Form, simple};
use crate::shape::Shape;

/// The key of simple lights, and those that go with it.
pub(super) const SHAPE_KEYS: [&str; 4] = ["shape", "radius", "size", "length"];

/// Longest tube over its radius, and widest over its length: 32-bit floats must hold both.
const SLENDER: f64 = 1e6;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Sphere,
    Disc,
    Ellipse,
    Rectangle,
    Tube,
}

const KINDS: [(&str, Kind); 5] = [
    ("sphere", Kind::Sphere),
    ("disc", Kind::Disc),
    ("ellipse", Kind::Ellipse),
    ("rectangle", Kind::Rectangle),
    ("tube", Kind::Tube),
];

impl Kind {
    /// What it is measured by.
    const fn measures(self) -> &'static [&'static str] {
        match self {
            Self::Sphere | Self::Disc => &["radius"],
            Self::Ellipse | Self::Rectangle => &["size"],
            Self::Tube => &["radius", "length"],
        }
    }
}

/// The simple light of a table, whose key `shape` has this `value`.
pub(super) fn read(table: &Table<'_>, value: &Value<'_>) -> Result<(Form, Shape), SceneError> {
    let kind = value.choice(&KINDS)?;
    let name = value.string()?;
    let measures = kind.measures();
    for key in SHAPE_KEYS[1..].iter().filter(|key| !measures.contains(key)) {
        if let Some(stray) = table.get(key) {
            return Err(
                stray.error(format!("has no meaning for shape \"{name}\", which has {}", measures.join(" and ")))
            );
        }
    }
    let radius = || table.require("radius", "the radius in metres")?.number(&LENGTH);
    let size = || table.require("size", "width and height in metres, [x, y]")?.vec2(&LENGTH);
    Ok(match kind {
        Kind::Sphere => simple::sphere(radius()?),
        Kind::Disc => simple::disc(radius()?),
        Kind::Ellipse => simple::ellipse(size()?),
        Kind::Rectangle => simple::rectangle(size()?),
        Kind::Tube => {
            let radius = radius()?;
            let length = table.require("length", "the length in metres, along the light's x axis")?;
            let metres = length.number(&LENGTH)?;
            if !(radius / SLENDER..=radius * SLENDER).contains(&metres) {
                return Err(length.error(format!("must be 1e-6 to 1e6 times the radius {radius}")));
            }
            simple::tube(radius, metres)
        }
    })
}
