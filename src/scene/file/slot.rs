//! The light of a template that is to be filled: `slot = true`.

use super::error::SceneError;
use super::light;
use super::table::{Table, Value};
use super::{COORDINATE, DEGREES, LENGTH};
use crate::scene::slot::{Anchor, Fit, Slot};
use glam::DVec3;

/// The keys of such a light.
const KEYS: [&str; 12] = [
    "slot",
    "size",
    "fit",
    "anchor",
    "position",
    "rotation",
    "svg_colors",
    "radiance",
    "power",
    "luminance",
    "color",
    "two_sided",
];

/// The slot in `table`, the `number`th light of the scene; `None` if it is a light like others.
pub(super) fn read(table: &Table<'_>, number: usize) -> Result<Option<Slot>, SceneError> {
    let Some(value) = table.get("slot") else { return Ok(None) };
    if !value.boolean()? {
        return Err(value.error("must be true; a light that is no slot has no such key"));
    }
    table.only(&KEYS)?;
    let size = table.require("size", "width and height that a drawing may take, m, or one number for both")?;
    Ok(Some(Slot {
        light: number,
        size: size.vec2(&LENGTH)?,
        fit: table.read("fit", |v| v.choice(&[("frame", Fit::Frame), ("outline", Fit::Outline)]))?.unwrap_or_default(),
        anchor: table
            .read("anchor", |v| {
                v.choice(&[("center", Anchor::Center), ("bottom", Anchor::Bottom), ("top", Anchor::Top)])
            })?
            .unwrap_or_default(),
        position: table.read("position", |v| v.vec3(&COORDINATE))?.unwrap_or_default(),
        rotation: table.read("rotation", |v| v.vec3(&DEGREES))?.unwrap_or_default(),
        strength: light::strength(table)?,
        tint: DVec3::ONE,
        svg_colors: table.read("svg_colors", Value::boolean)?,
        two_sided: table.read("two_sided", Value::boolean)?.unwrap_or(false),
    }))
}
