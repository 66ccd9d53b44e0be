//! Lights of a scene file: what shines (a path, an SVG, a text, a simple shape), how strongly, and where it stands.

use super::body::{self, SHAPE_KEYS};
use super::error::SceneError;
use super::motion::{self, Moving, Own};
use super::table::{Limit, Table, Value};
use super::{COORDINATE, DEGREES, LENGTH, RADIANCE, SCALE};
use crate::color::luminance;
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::outline::bundled;
use crate::outline::font::{Font, Tag};
use crate::outline::svg::{SvgOptions, svg};
use crate::outline::text::{Align, Direction, TextStyle, layout};
use crate::outline::{FillRule, Warning, path};
use crate::picture::Picture;
use crate::scene::Texture;
use crate::scene::folder::Folder;
use crate::scene::motion::LightMotion;
use crate::scene::strength::{Strength, StrengthError};
use crate::scene::texture;
use crate::shape::{Bounds, Shape};
use glam::{DAffine2, DVec2, DVec3};
use std::sync::Arc;

/// Largest SVG or font file, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Luminous efficacy in lm/W by which radiance becomes luminance: Rec.709 white of radiance 1 has 683 nits.
pub const EFFICACY: f64 = 683.0;

/// Area of a light over the square of its larger side, below which it is rounding.
const LEAST_AREA: f64 = 1e-12;

/// Farthest a light may reach from the origin along an axis, metres.
pub(super) const MAX_REACH: f64 = 4e9;

const POWER: Limit = Limit::new(|v| (0.0..=1e15).contains(&v), "between 0 and 1e15 W");
const NITS: Limit = Limit::new(|v| (0.0..=1e15).contains(&v), "between 0 and 1e15 nits");
const SPACING: Limit = Limit::new(|v| v.abs() <= 100.0, "within ±100 em");
const LINE_HEIGHT: Limit = Limit::new(|v| v > 0.0 && v <= 100.0, "more than 0 and at most 100 em");
const AXIS: Limit = Limit::new(|v| v.abs() <= 1e6, "within ±1e6");

/// Keys of every light. `fill_rule` is one of them so that a light can be changed from one kind to another in its place.
const COMMON: [&str; 10] =
    ["position", "rotation", "scale", "radiance", "power", "luminance", "color", "two_sided", "fill_rule", "picture"];

/// What can shine: the key that says so, the keys that go with it, and how it is read.
type Kind = (&'static str, &'static [&'static str], fn(&Source<'_, '_>, &mut Vec<Warning>) -> Result<Art, SceneError>);

const KINDS: [Kind; 4] = [
    ("path", &["path"], from_path),
    ("svg", &["svg", "size", "svg_colors"], from_svg),
    ("text", &["text", "font", "size", "align", "letter_spacing", "line_height", "axes", "direction"], from_text),
    ("shape", &SHAPE_KEYS, from_shape),
];

/// What shines, and as what kind of body.
struct Art {
    layers: Vec<Layer>,
    form: Form,
}

impl From<Vec<Layer>> for Art {
    fn from(layers: Vec<Layer>) -> Self {
        Self { layers, form: Form::Outline }
    }
}

/// A light's table with the value of the key that says what shines.
struct Source<'t, 'd> {
    table: &'t Table<'d>,
    value: Value<'d>,
    folder: &'t Folder,
}

/// The light in `table`, the `number`th of the scene. Where it stands and shines by its own keys, not those of its keyframes.
pub(super) fn read(
    table: &Table<'_>,
    number: usize,
    folder: &Folder,
    warnings: &mut Vec<String>,
) -> Result<(AreaLight, Moving<LightMotion>), SceneError> {
    let given: Vec<_> = KINDS.iter().filter_map(|kind| table.get(kind.0).map(|value| (kind, value))).collect();
    let names: Vec<_> = given.iter().map(|(kind, _)| kind.0).collect();
    let Ok([((key, keys, build), value)]) = <[_; 1]>::try_from(given) else {
        let found =
            if names.is_empty() { "none is given".into() } else { format!("{} are given", names.join(" and ")) };
        return Err(table.error(format!("a light has exactly one of path, svg, text, shape; {found}")));
    };
    table.only(&[*keys, &COMMON, &motion::KEYS].concat())?;
    let name = match *key {
        "path" => format!("light[{number}]"),
        _ => value.string()?.into(),
    };
    let place = value.place();
    let source = Source { table, value, folder };
    let mut said = Vec::new();
    let Art { mut layers, form } = build(&source, &mut said)?;
    lay_picture(&source, key, form, &mut layers)?;
    if *key != "path" && table.get("fill_rule").is_some() {
        said.push(Warning { element: "fill_rule".into(), message: format!("has no effect on {key}") });
    }

    let position = table.read("position", |v| v.vec3(&COORDINATE))?.unwrap_or_default();
    let rotation = table.read("rotation", |v| v.vec3(&DEGREES))?.unwrap_or_default();
    let scale = |v: &Value<'_>| {
        let scale = v.vec2(&SCALE)?;
        let stretched = form.is_body() && scale.x.abs() != scale.y.abs();
        if stretched { Err(v.error(format!("must not stretch a {name}: give one number"))) } else { Ok(scale) }
    };
    let scale = table.read("scale", scale)?.unwrap_or(DVec2::ONE);
    let mut two_sided = table.read("two_sided", Value::boolean)?.unwrap_or(false);
    if form.is_body() && two_sided {
        let message = format!("has no effect on a {name}, which shines all round");
        said.push(Warning { element: "two_sided".into(), message });
        two_sided = false;
    }
    let mirror = DAffine2::from_scale(scale.signum());
    let mut mirrored = None;
    for layer in &mut layers {
        layer.shape = layer.shape.transformed(mirror);
        mirror_picture(layer, scale.signum(), &mut mirrored);
    }
    let placement = Placement::new(position, rotation, scale.abs());
    let area: f64 = layers.iter().map(|l| l.shape.area()).sum();
    let bounds = layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
    if area <= LEAST_AREA * bounds.size().max_element().powi(2) || layers.is_empty() {
        return Err(source.value.error(format!("the light \"{name}\" has no area")));
    }
    // All of the light is within `around` of these points.
    let (points, around) = match form {
        Form::Sphere { radius } => ([DVec2::ZERO; 4], radius),
        Form::Tube { radius, length } => ([1.0, 1.0, -1.0, -1.0].map(|side| DVec2::X * (0.5 * length * side)), radius),
        Form::Outline | Form::Rectangle | Form::Disc => {
            let Bounds { min, max } = bounds;
            ([min, max, DVec2::new(min.x, max.y), DVec2::new(max.x, min.y)], 0.0)
        }
    };
    let around = around * placement.y.length();
    let reach = points.map(|p| placement.point(p).abs().max_element() + around).into_iter().fold(0.0, f64::max);
    if reach > MAX_REACH {
        return Err(source
            .value
            .error(format!("the light reaches {reach:e} m from the origin; at most {MAX_REACH:e}")));
    }
    let sides = if two_sided { 2.0 } else { 1.0 };
    emit(table, &mut layers, placement.normal().length() * sides * form.emitting_area(area) / area)?;
    if layers.iter().all(|l| l.radiance * l.mean_color().truncate() == DVec3::ZERO) {
        let hint = if *key == "svg" { "; svg_colors = false lights every part of it" } else { "" };
        said.push(Warning { element: name.clone(), message: format!("it is black and does not shine{hint}") });
    }
    warnings.extend(said.into_iter().map(|w| format!("{place}: {}: {}", w.element, w.message)));
    let light = AreaLight { name, layers, form, placement, two_sided };
    let motion = motion::light(table, number, &light, &Own { position, rotation, scale })?;
    Ok((light, motion))
}

/// Lays the picture that the light names over its layers.
fn lay_picture(source: &Source<'_, '_>, kind: &str, form: Form, layers: &mut [Layer]) -> Result<(), SceneError> {
    let Some(value) = source.table.get("picture") else { return Ok(()) };
    if form.is_body() {
        return Err(value.error("spheres and tubes have no picture; flat lights may"));
    }
    if kind == "svg" && source.table.read("svg_colors", Value::boolean)?.unwrap_or(true) {
        return Err(value.error("an SVG shines in its own colours; with svg_colors = false it may have a picture"));
    }
    let bytes = source.folder.read(value.string()?, texture::MAX_BYTES).map_err(|e| value.resource(e))?;
    Texture::decode(&bytes, true).map_err(|e| value.resource(e))?.lay_over(layers);
    Ok(())
}

/// A picture as it is and as it is mirrored.
type Mirrored = Option<[Arc<Picture>; 2]>;

/// Mirrors the layer's picture; `last` is the one mirrored before, which layers may share.
fn mirror_picture(layer: &mut Layer, signs: DVec2, last: &mut Mirrored) {
    let Some(picture) = layer.picture.take_if(|_| signs != DVec2::ONE) else { return };
    let known = last.take().filter(|[from, _]| Arc::ptr_eq(from, &picture));
    let pair = known.unwrap_or_else(|| [Arc::clone(&picture), Arc::new(picture.scaled(signs))]);
    layer.picture = Some(Arc::clone(&pair[1]));
    *last = Some(pair);
}

/// Sets the radiance of the layers, which hold their own colours so far (white but for SVGs). `emitting` is the factor
/// from light-space area to emitting world area.
fn emit(table: &Table<'_>, layers: &mut [Layer], emitting: f64) -> Result<(), SceneError> {
    strength(table)?.apply(layers, emitting).map_err(|e| {
        let given = ["radiance", "power", "luminance"].into_iter().find_map(|key| Some((key, table.get(key)?)));
        match (e, given) {
            (StrengthError::Black, Some((_, value))) => value.error(e.to_string()),
            (_, given) => table.error(format!("{} {e}", given.map_or("radiance", |(key, _)| key))),
        }
    })
}

/// How strongly a light shines, by its keys:
///
/// - `radiance`: of a white layer, per channel.
/// - `luminance` (nits) with `color`: of a white layer; Y of the radiance times [`EFFICACY`].
/// - `power` (W) with `color`: of the whole light, see [`Strength::Power`].
pub(super) fn strength(table: &Table<'_>) -> Result<Strength, SceneError> {
    let amounts: Vec<_> = ["radiance", "power", "luminance"].into_iter().filter(|k| table.get(k).is_some()).collect();
    if amounts.len() > 1 {
        return Err(table.error(format!("give one of radiance, power, luminance, not {}", amounts.join(" and "))));
    }
    let color = table.read("color", |v| {
        let color = v.color(&RADIANCE)?;
        if luminance(color) > 0.0 { Ok(color) } else { Err(v.error("must not be black")) }
    })?;
    if color.is_some() && !matches!(amounts[..], ["power" | "luminance"]) {
        return Err(table.error("color goes with power or luminance; radiance has its colour in itself"));
    }
    let color = color.unwrap_or([1.0; 3]);
    if let Some(radiance) = table.read("radiance", |v| v.one_or(&RADIANCE))? {
        Ok(Strength::Radiance(radiance.into()))
    } else if let Some(nits) = table.read("luminance", |v| v.number(&NITS))? {
        Ok(Strength::Radiance(DVec3::from_array(color) * (nits / (EFFICACY * luminance(color)))))
    } else if let Some(watts) = table.read("power", |v| v.number(&POWER))? {
        Ok(Strength::Power { watts, color: color.into() })
    } else {
        Ok(Strength::Radiance(DVec3::ONE))
    }
}

fn from_path(source: &Source<'_, '_>, _: &mut Vec<Warning>) -> Result<Art, SceneError> {
    let rules = [("nonzero", FillRule::NonZero), ("evenodd", FillRule::EvenOdd)];
    let rule = source.table.read("fill_rule", |v| v.choice(&rules))?.unwrap_or_default();
    let shape = path::shape(source.value.string()?, rule).map_err(|e| source.value.resource(e))?;
    Ok(vec![white(shape)].into())
}

fn from_svg(source: &Source<'_, '_>, warnings: &mut Vec<Warning>) -> Result<Art, SceneError> {
    let name = source.value.string()?;
    let size = source.table.read("size", |v| v.number(&LENGTH))?.unwrap_or(1.0);
    let own_colors = source.table.read("svg_colors", Value::boolean)?.unwrap_or(true);
    let bytes = source.folder.read(name, MAX_BYTES).map_err(|e| source.value.resource(e))?;
    let art = svg(&bytes, name, &SvgOptions::bundled(size)).map_err(|e| source.value.resource(e))?;
    warnings.extend(art.warnings);
    Ok(art.layers.into_iter().map(|l| Layer::of_art(l, own_colors)).collect::<Vec<_>>().into())
}

fn from_text(source: &Source<'_, '_>, warnings: &mut Vec<Warning>) -> Result<Art, SceneError> {
    let table = source.table;
    let default = TextStyle::default();
    let aligns = [("left", Align::Left), ("center", Align::Center), ("right", Align::Right)];
    let directions = [("auto", Direction::Auto), ("ltr", Direction::Ltr), ("rtl", Direction::Rtl)];
    let style = TextStyle {
        size: table.read("size", |v| v.number(&LENGTH))?.unwrap_or(default.size),
        align: table.read("align", |v| v.choice(&aligns))?.unwrap_or(default.align),
        letter_spacing: table.read("letter_spacing", |v| v.number(&SPACING))?.unwrap_or(default.letter_spacing),
        line_height: table.read("line_height", |v| v.number(&LINE_HEIGHT))?,
        axes: table.read("axes", axes)?.unwrap_or_default(),
        direction: table.read("direction", |v| v.choice(&directions))?.unwrap_or(default.direction),
    };
    let fonts = match table.get("font") {
        Some(value) => value.strings()?.iter().map(|v| font(v, source.folder)).collect::<Result<Vec<_>, _>>()?,
        // The default font first; the others for what it has no glyph for.
        None => bundled::bundled()
            .iter()
            .map(|f| Font::bundled(f.name).map_err(|e| source.value.resource(e)))
            .collect::<Result<_, _>>()?,
    };
    let text = layout(source.value.string()?, &fonts, &style).map_err(|e| source.value.resource(e))?;
    warnings.extend(text.warnings);
    Ok(vec![white(text.shape)].into())
}

fn from_shape(source: &Source<'_, '_>, _: &mut Vec<Warning>) -> Result<Art, SceneError> {
    let (form, shape) = body::read(source.table, &source.value)?;
    Ok(Art { layers: vec![white(shape)], form })
}

fn white(shape: Shape) -> Layer {
    Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None }
}

/// A bundled font by its name, or a font file by its ending.
fn font(value: &Value<'_>, folder: &Folder) -> Result<Font, SceneError> {
    let name = value.string()?;
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
    if matches!(ending.as_str(), "ttf" | "otf" | "ttc" | "otc") {
        let bytes = folder.read(name, MAX_BYTES).map_err(|e| value.resource(e))?;
        return Font::from_bytes(name, bytes, 0).map_err(|e| value.resource(e));
    }
    Font::bundled(name).map_err(|e| value.resource(e))
}

/// `{ wght = 700 }`: places on the axes of variable fonts.
fn axes(value: &Value<'_>) -> Result<Vec<(Tag, f32)>, SceneError> {
    let entries = value.entries()?;
    let axis = |(tag, value): &(&str, Value<'_>)| {
        let tag = tag.parse::<Tag>().map_err(|e| value.error(e.to_string()))?;
        Ok((tag, value.number(&AXIS)? as f32))
    };
    entries.iter().map(axis).collect()
}
