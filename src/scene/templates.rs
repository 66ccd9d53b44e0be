//! Bundled templates: scenes whose light is filled with a drawing.

use super::file::{self, Loaded, SceneError};
use super::folder::Folder;
use std::path::Path;

/// A bundled template.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Template {
    /// What it is called, after `template:`.
    pub name: &'static str,
    /// What it shows, one line.
    pub about: &'static str,
    /// The scene file.
    pub text: &'static str,
}

/// Why there is no such template.
#[derive(Debug, thiserror::Error)]
pub enum TemplateError {
    /// No template has this name.
    #[error("template:{0}: there is no such template; there are {list}", list = names().join(", "))]
    Unknown(String),
    /// Its scene file is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Files that the scenes name.
const FILES: &[(&str, &[u8])] =
    &[("shelf.glb", include_bytes!("templates/shelf.glb")), ("checker.png", include_bytes!("templates/checker.png"))];

macro_rules! template {
    ($name:literal, $about:literal) => {
        Template { name: $name, about: $about, text: include_str!(concat!("templates/", $name, ".toml")) }
    };
}

/// All templates, the default first.
pub const TEMPLATES: [Template; 4] = [
    template!("floor", "a sign that stands on a dark floor and is reflected in it"),
    template!("wall", "a sign before a wall, over a wet pavement"),
    template!("shelf", "a sign over a product shelf, a mesh with textures and normal maps"),
    template!("checker", "a sign over a floor of rough and glossy tiles"),
];

fn names() -> Vec<&'static str> {
    TEMPLATES.iter().map(|t| t.name).collect()
}

/// Loads a template by its name, without `template:`.
///
/// # Errors
/// [`TemplateError::Unknown`], which lists the templates.
pub fn load(name: &str) -> Result<Loaded, TemplateError> {
    let template = TEMPLATES.iter().find(|t| t.name == name).ok_or_else(|| TemplateError::Unknown(name.into()))?;
    let path = format!("template:{name}");
    Ok(file::parse_template(template.text.into(), Path::new(&path), &Folder::bundled(FILES))?)
}
