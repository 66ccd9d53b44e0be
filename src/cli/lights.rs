//! What the command line can turn into light: a text, an SVG, path data.

use super::read;
use crate::error::Error;
use crate::light::Layer;
use crate::outline::bundled;
use crate::outline::font::{Font, Tag};
use crate::outline::path;
use crate::outline::svg::{self, SvgOptions};
use crate::outline::text::{Align, Direction, TextStyle, layout};
use crate::outline::{FillRule, OutlineError, Warning};
use clap::ValueEnum;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Largest font or SVG file.
const MAX_BYTES: u64 = 64 << 20;

/// One text, SVG or path.
#[derive(Debug, clap::Args)]
#[group(id = "art", multiple = false)]
pub struct Source {
    /// Text; lines end at a newline
    #[arg(long)]
    pub text: Option<String>,
    /// SVG file; each of its colours is an emission of its own
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Path data as in an SVG's `d`, metres, y up
    #[arg(long, value_name = "DATA")]
    pub path: Option<String>,
}

/// How text is set and art is measured.
#[derive(Debug, clap::Args)]
pub struct Style {
    /// Font file (.ttf, .otf, .ttc) or name of a bundled font; give several to fall back from one to the next
    #[arg(long, requires = "text")]
    font: Vec<String>,
    /// Em of the text, or longer side of the SVG, in metres
    #[arg(long, default_value_t = 1.0, value_parser = super::render::positive_f64)]
    size: f64,
    /// Alignment of the lines
    #[arg(long, value_enum, default_value_t = AlignArg::Center)]
    align: AlignArg,
    /// Extra space between letters, em
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    letter_spacing: f64,
    /// Distance between baselines, em; the font's own if not given
    #[arg(long)]
    line_height: Option<f64>,
    /// Place on an axis of a variable font, as in wght=700
    #[arg(long, value_name = "TAG=VALUE", value_parser = axis)]
    axis: Vec<(Tag, f32)>,
    /// Direction of the lines
    #[arg(long, value_enum, default_value_t = DirectionArg::Auto)]
    direction: DirectionArg,
    /// Fill rule of --path
    #[arg(long, value_enum, default_value_t = FillRuleArg::Nonzero)]
    fill_rule: FillRuleArg,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AlignArg {
    Left,
    Center,
    Right,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DirectionArg {
    Auto,
    Ltr,
    Rtl,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FillRuleArg {
    Nonzero,
    Evenodd,
}

fn axis(text: &str) -> Result<(Tag, f32), String> {
    let (tag, value) = text.split_once('=').ok_or("an axis is given as TAG=VALUE, for example wght=700")?;
    let tag = tag.parse::<Tag>().map_err(|e| e.to_string())?;
    let number = value.parse::<f32>().ok().filter(|v| v.is_finite());
    Ok((tag, number.ok_or_else(|| format!("`{value}` is not a finite number"))?))
}

/// Art that can shine.
pub struct Art {
    /// What messages call it.
    pub name: String,
    /// Emissions of radiance 1 (white), or of an SVG's own colours.
    pub layers: Vec<Layer>,
    /// What was left out or simplified.
    pub warnings: Vec<Warning>,
}

impl Source {
    /// Turns the source into shapes.
    pub fn art(&self, style: &Style) -> Result<Art, Error> {
        match (&self.text, &self.svg, &self.path) {
            (Some(text), ..) => text_art(text, style),
            (_, Some(file), _) => svg_art(file, style),
            (.., Some(data)) => path_art(data, style),
            _ => Err(Error::Usage("nothing to light: give a scene file, --text, --svg or --path".into())),
        }
    }
}

fn white(shape: crate::shape::Shape) -> Layer {
    Layer { shape, radiance: DVec3::ONE, opacity: 1.0 }
}

fn text_art(text: &str, style: &Style) -> Result<Art, Error> {
    let fonts = if style.font.is_empty() {
        // The default font first; the others for what it has no glyph for.
        bundled::bundled()
            .iter()
            .map(|f| Font::bundled(f.name).map_err(OutlineError::from))
            .collect::<Result<Vec<_>, _>>()?
    } else {
        style.font.iter().map(|name| font(name)).collect::<Result<Vec<_>, _>>()?
    };
    let set = TextStyle {
        size: style.size,
        align: match style.align {
            AlignArg::Left => Align::Left,
            AlignArg::Center => Align::Center,
            AlignArg::Right => Align::Right,
        },
        letter_spacing: style.letter_spacing,
        line_height: style.line_height,
        axes: style.axis.clone(),
        direction: match style.direction {
            DirectionArg::Auto => Direction::Auto,
            DirectionArg::Ltr => Direction::Ltr,
            DirectionArg::Rtl => Direction::Rtl,
        },
    };
    let text_layout = layout(text, &fonts, &set).map_err(OutlineError::from)?;
    Ok(Art { name: text.into(), layers: vec![white(text_layout.shape)], warnings: text_layout.warnings })
}

/// A bundled font by its name, or a font file by its ending.
fn font(name: &str) -> Result<Font, Error> {
    let path = Path::new(name);
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if matches!(ending.as_str(), "ttf" | "otf" | "ttc" | "otc") {
        return Ok(Font::from_bytes(name, read(path, MAX_BYTES)?, 0).map_err(OutlineError::from)?);
    }
    Ok(Font::bundled(name).map_err(OutlineError::from)?)
}

fn svg_art(file: &Path, style: &Style) -> Result<Art, Error> {
    let name = file.display().to_string();
    let art = svg::svg(&read(file, MAX_BYTES)?, &name, &SvgOptions::bundled(style.size))?;
    let layer = |l: svg::ArtLayer| Layer { shape: l.shape, radiance: l.color.into(), opacity: l.opacity };
    Ok(Art { name, layers: art.layers.into_iter().map(layer).collect(), warnings: art.warnings })
}

fn path_art(data: &str, style: &Style) -> Result<Art, Error> {
    let rule = match style.fill_rule {
        FillRuleArg::Nonzero => FillRule::NonZero,
        FillRuleArg::Evenodd => FillRule::EvenOdd,
    };
    Ok(Art {
        name: "path".into(),
        layers: vec![white(path::shape(data, rule).map_err(OutlineError::from)?)],
        warnings: Vec::new(),
    })
}
