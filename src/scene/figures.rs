//! Bundled scenes after the figures of the papers: the same questions, with shapes of our own.

use super::file::{self, Loaded, SceneError};
use super::folder::Folder;
use std::path::Path;

/// A bundled scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// What it is called, after `figure:`.
    pub name: &'static str,
    /// What it shows and which figure it answers to, one line.
    pub about: &'static str,
    /// The scene file.
    pub text: &'static str,
}

/// Why there is no such figure.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// No figure has this name.
    #[error("figure:{0}: there is no such figure; there are {list}", list = names().join(", "))]
    Unknown(String),
    /// Its scene file is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Files that the scenes name.
const FILES: &[(&str, &[u8])] = &[("sunset.svg", include_bytes!("../../svg/sunset.svg"))];

macro_rules! figure {
    ($name:literal, $about:literal) => {
        Figure { name: $name, about: $about, text: include_str!(concat!("figures/", $name, ".toml")) }
    };
}

/// All figures. Kuge 2022 is Kuge, Yatagawa, Morishima, JCGT 11(1); Heitz 2016 is Heitz, Dupuy, Hill, Neubelt, SIGGRAPH 2016.
pub const FIGURES: [Figure; 11] = [
    figure!("hole", "a light with a hole (Kuge 2022, fig. 1)"),
    figure!("letter", "a letter (Kuge 2022, fig. 1)"),
    figure!("picture", "a light coloured by a picture (Kuge 2022, fig. 1)"),
    figure!("alpha-0.01", "thresholds of subdivision at GGX alpha 0.01 (Kuge 2022, figs. 4 and 5)"),
    figure!("alpha-0.1", "thresholds of subdivision at GGX alpha 0.1 (Kuge 2022, figs. 4 and 5)"),
    figure!("alpha-0.25", "thresholds of subdivision at GGX alpha 0.25 (Kuge 2022, figs. 4 and 5)"),
    figure!("samples", "6, 18 and 30 edges per curve (Kuge 2022, fig. 8)"),
    figure!("mask", "a masked rectangle against the contour (Kuge 2022, fig. 9)"),
    figure!("quad-near", "a masked rectangle that stands on the floor (Heitz 2016, fig. 12)"),
    figure!("quad-horizon", "a masked rectangle that dips through the floor (Heitz 2016, fig. 12)"),
    figure!("quad-grazing", "a masked rectangle seen at a grazing angle (Heitz 2016, fig. 12)"),
];

fn names() -> Vec<&'static str> {
    FIGURES.iter().map(|f| f.name).collect()
}

/// Loads a figure by its name, without `figure:`.
///
/// # Errors
/// [`FigureError::Unknown`], which lists the figures.
pub fn load(name: &str) -> Result<Loaded, FigureError> {
    let figure = FIGURES.iter().find(|f| f.name == name).ok_or_else(|| FigureError::Unknown(name.into()))?;
    let path = format!("figure:{name}");
    Ok(file::parse(figure.text.into(), Path::new(&path), &Folder::bundled(FILES))?)
}
