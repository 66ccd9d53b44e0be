//! Bundled templates: scenes whose light is filled with a drawing.

use super::bundled::{Bundled, BundledError, Kind, bundled};
use super::file::{self, Loaded};

/// All templates, the default first.
pub const TEMPLATES: [Bundled; 4] = [
    bundled!("templates", "floor", "a sign that stands on a dark floor and is reflected in it"),
    bundled!("templates", "wall", "a sign before a wall, over a wet pavement"),
    bundled!("templates", "shelf", "a sign over a product shelf, a mesh with textures and normal maps"),
    bundled!("templates", "checker", "a sign over a floor of rough and glossy tiles"),
];

const KIND: Kind = Kind {
    name: "template",
    scenes: &TEMPLATES,
    files: &[
        ("shelf.glb", include_bytes!("templates/shelf.glb")),
        ("checker.png", include_bytes!("templates/checker.png")),
    ],
    parse: file::parse_template,
};

/// Loads a template by its name, without `template:`.
///
/// # Errors
/// [`BundledError::Unknown`], which lists the templates.
pub fn load(name: &str) -> Result<Loaded, BundledError> {
    KIND.load(name)
}
