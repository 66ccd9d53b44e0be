//! What to render: a scene file, a bundled figure, or the sign of a text, an SVG or path data.

use super::lights::{Source, Style};
use super::values::{Color, hex, radiance, unit};
use super::warn;
use crate::backend::Technique;
use crate::error::Error;
use crate::scene::file::{self, Loaded, SceneError};
use crate::scene::preset::{PresetOptions, sign};
use crate::scene::{Motion, Scene, figures, templates};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// How the names of bundled templates begin.
pub const TEMPLATE: &str = "template:";

/// What to render.
#[derive(Debug, clap::Args)]
pub struct Subject {
    /// Scene file (TOML), or figure:NAME for one of the bundled figures (compare --list)
    #[arg(conflicts_with = "art")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    style: Style,
    #[command(flatten)]
    sign: Sign,
}

/// The sign of --text, --svg and --path.
#[derive(Debug, clap::Args)]
struct Sign {
    /// Radiance of the sign (of white, for an SVG), W/(sr·m²)
    #[arg(long, default_value_t = 1.5, value_parser = radiance, conflicts_with = "scene")]
    radiance: f64,
    /// Colour of the sign, #rrggbb
    #[arg(long, default_value = "#ffffff", value_parser = hex, conflicts_with = "scene")]
    color: Color,
    /// GGX width of the floor, 0 to 1
    #[arg(long, value_parser = unit, conflicts_with_all = ["scene", "roughness"])]
    alpha: Option<f32>,
    /// Perceptual roughness of the floor, 0 to 1: the square root of alpha
    #[arg(long, value_parser = unit, conflicts_with = "scene")]
    roughness: Option<f32>,
}

/// A scene and what is known of it.
pub struct Staged {
    /// The scene.
    pub scene: Scene,
    /// How it moves.
    pub motion: Motion,
    /// The file, `figure:…`, or the art of the sign.
    pub name: String,
    /// The text of the file, or what makes up the sign.
    pub source: String,
    /// What the scene asks to be compared.
    pub techniques: Vec<Technique>,
}

impl Subject {
    /// Loads the scene for a picture of this size; says on standard error what it could not.
    pub fn stage(&self, width: u32, height: u32) -> Result<Staged, Error> {
        if let Some(path) = &self.scene {
            self.style.check("a scene file")?;
            let (loaded, techniques) = open(path)?;
            warn(&loaded.warnings);
            let Loaded { scene, motion, text: source, .. } = loaded;
            return Ok(Staged { scene, motion, name: path.display().to_string(), source, techniques });
        }
        let art = self.source.art(&self.style)?;
        warn(art.warnings.iter().map(|w| format!("{}: {}", w.element, w.message)));
        let mut layers = art.layers;
        let color = DVec3::from_array(self.sign.color.0) * self.sign.radiance;
        for layer in &mut layers {
            layer.radiance *= color;
        }
        let default = PresetOptions::default();
        let alpha = self.sign.alpha.or(self.sign.roughness.map(|r| r * r)).unwrap_or(default.alpha);
        let aspect = f64::from(width) / f64::from(height);
        let source = format!(
            "{}\nradiance {:.4} {:.4} {:.4} W/(sr·m²), over a floor of alpha {alpha}",
            self.source.describe(),
            color.x,
            color.y,
            color.z
        );
        let name = art.name.clone();
        let scene = sign(layers, &PresetOptions { name: art.name, alpha, aspect, ..default })?;
        Ok(Staged { scene, motion: Motion::STILL, name, source, techniques: Vec::new() })
    }
}

/// Loads a template: a scene file with a slot, or a bundled one.
pub fn open_template(path: &Path) -> Result<Loaded, Error> {
    Ok(match path.to_str().and_then(|name| name.strip_prefix(TEMPLATE)) {
        Some(name) => templates::load(name)?,
        None => file::load_template(path)?,
    })
}

/// Loads a scene file or a bundled figure. The techniques are those of its table `[compare]`.
pub fn open(path: &Path) -> Result<(Loaded, Vec<Technique>), Error> {
    let loaded = match path.to_str().and_then(|name| name.strip_prefix("figure:")) {
        Some(name) => figures::load(name)?,
        None => file::load(path)?,
    };
    let technique = |wanted: &file::Wanted| {
        let wrong =
            |limit| SceneError::Value { place: wanted.place.clone(), value: format!("{:?}", wanted.name), limit };
        wanted.name.parse().map_err(wrong)
    };
    let techniques = loaded.techniques.iter().map(technique).collect::<Result<_, _>>()?;
    Ok((loaded, techniques))
}
