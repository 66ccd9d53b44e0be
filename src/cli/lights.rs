//! What the command line can turn into light: a text, an SVG, path data.

use super::read;
use super::values::positive_f64;
use crate::error::Error;
use crate::light::Layer;
use crate::outline::bundled;
use crate::outline::font::{Font, Tag};
use crate::outline::path;
use crate::outline::svg::{self, SvgOptions};
use crate::outline::text::{Align, Direction, TextStyle, layout};
use crate::outline::{FillRule, OutlineError, Warning};
use crate::scene::{Texture, texture};
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
    #[arg(long)]
    font: Vec<String>,
    /// Em of the text, or longer side of the SVG, in metres [default: 1]
    #[arg(long, value_parser = length)]
    size: Option<f64>,
    /// Alignment of the lines [default: center]
    #[arg(long, value_enum)]
    align: Option<AlignArg>,
    /// Extra space between letters, em [default: 0]
    #[arg(long, allow_negative_numbers = true)]
    letter_spacing: Option<f64>,
    /// Distance between baselines, em; the font's own if not given
    #[arg(long)]
    line_height: Option<f64>,
    /// Place on an axis of a variable font, as in wght=700
    #[arg(long, value_name = "TAG=VALUE", value_parser = axis)]
    axis: Vec<(Tag, f32)>,
    /// Direction of the lines [default: auto]
    #[arg(long, value_enum)]
    direction: Option<DirectionArg>,
    /// Light every part of the SVG alike, whatever its own colours
    #[arg(long)]
    no_svg_colors: bool,
    /// PNG or JPEG in whose colours --text or --path shines, stretched over it
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Fill rule of --path [default: nonzero]
    #[arg(long, value_enum)]
    fill_rule: Option<FillRuleArg>,
}

impl Style {
    /// Refuses what would have no effect; `kind` is `--text`, `--svg`, `--path` or what a file is called.
    pub fn check(&self, kind: &str) -> Result<(), Error> {
        const TEXT: &[&str] = &["--text"];
        let given: [(&str, bool, &[&str]); 10] = [
            ("font", !self.font.is_empty(), TEXT),
            ("size", self.size.is_some(), &["--text", "--svg"]),
            ("align", self.align.is_some(), TEXT),
            ("letter-spacing", self.letter_spacing.is_some(), TEXT),
            ("line-height", self.line_height.is_some(), TEXT),
            ("axis", !self.axis.is_empty(), TEXT),
            ("direction", self.direction.is_some(), TEXT),
            ("no-svg-colors", self.no_svg_colors, &["--svg"]),
            ("picture", self.picture.is_some(), &["--text", "--path"]),
            ("fill-rule", self.fill_rule.is_some(), &["--path"]),
        ];
        match given.iter().find(|(_, given, kinds)| *given && !kinds.contains(&kind)) {
            None => Ok(()),
            Some((name, _, kinds)) => {
                Err(Error::Usage(format!("--{name} goes with {}; it has no effect on {kind}", kinds.join(" and "))))
            }
        }
    }

    /// The art in the colours of --picture.
    fn painted(&self, mut art: Art) -> Result<Art, Error> {
        if let Some(file) = &self.picture {
            let fault = |source| Error::Picture { path: file.display().to_string(), source };
            Texture::decode(&read(file, texture::MAX_BYTES)?, true).map_err(fault)?.lay_over(&mut art.layers);
        }
        Ok(art)
    }

    fn size(&self) -> f64 {
        self.size.unwrap_or(1.0)
    }
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

/// A length in metres, within what scene files take as well.
fn length(text: &str) -> Result<f64, String> {
    let value = positive_f64(text)?;
    if (1e-9..=1e9).contains(&value) { Ok(value) } else { Err(format!("{text} is not a length of 1e-9 to 1e9 m")) }
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
    /// The arguments, one to a line.
    pub fn describe(&self) -> String {
        let file = self.svg.as_ref().map(|file| file.display().to_string());
        let given = [("text", &self.text), ("svg", &file), ("path", &self.path)];
        let lines = given.iter().filter_map(|(name, value)| value.as_ref().map(|value| format!("{name} {value}")));
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Turns the source into shapes.
    pub fn art(&self, style: &Style) -> Result<Art, Error> {
        match (&self.text, &self.svg, &self.path) {
            (Some(text), ..) => style.check("--text").and_then(|()| text_art(text, style)),
            (_, Some(file), _) => style.check("--svg").and_then(|()| svg_art(file, style)),
            (.., Some(data)) => style.check("--path").and_then(|()| path_art(data, style)),
            _ => Err(Error::Usage("nothing to light: give a scene file, --text, --svg or --path".into())),
        }
    }
}

fn white(shape: crate::shape::Shape) -> Layer {
    Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None }
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
        size: style.size(),
        align: match style.align {
            Some(AlignArg::Left) => Align::Left,
            Some(AlignArg::Center) | None => Align::Center,
            Some(AlignArg::Right) => Align::Right,
        },
        letter_spacing: style.letter_spacing.unwrap_or(0.0),
        line_height: style.line_height,
        axes: style.axis.clone(),
        direction: match style.direction {
            Some(DirectionArg::Auto) | None => Direction::Auto,
            Some(DirectionArg::Ltr) => Direction::Ltr,
            Some(DirectionArg::Rtl) => Direction::Rtl,
        },
    };
    let text_layout = layout(text, &fonts, &set).map_err(|e| argument("text", text, e))?;
    style.painted(Art { name: text.into(), layers: vec![white(text_layout.shape)], warnings: text_layout.warnings })
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
    let art = svg::svg(&read(file, MAX_BYTES)?, &name, &SvgOptions::bundled(style.size()))?;
    let layers: Vec<_> = art.layers.into_iter().map(|l| Layer::of_art(l, !style.no_svg_colors)).collect();
    if layers.iter().all(|l| l.radiance == DVec3::ZERO) {
        return Err(Error::Usage(format!("{name}: all of it is black; --no-svg-colors lights every part of it")));
    }
    Ok(Art { name, layers, warnings: art.warnings })
}

fn path_art(data: &str, style: &Style) -> Result<Art, Error> {
    let rule = match style.fill_rule {
        Some(FillRuleArg::Nonzero) | None => FillRule::NonZero,
        Some(FillRuleArg::Evenodd) => FillRule::EvenOdd,
    };
    let shape = path::shape(data, rule).map_err(|e| argument("path", data, e))?;
    style.painted(Art { name: "path".into(), layers: vec![white(shape)], warnings: Vec::new() })
}

/// An error of what an argument holds.
fn argument(argument: &'static str, value: &str, source: impl Into<OutlineError>) -> Error {
    const QUOTED: usize = 60;
    let shown: String = value.chars().take(QUOTED).collect();
    let more = if shown.len() < value.len() { "…" } else { "" };
    Error::Argument { argument, value: format!("{shown:?}{more}"), source: Box::new(source.into()) }
}
