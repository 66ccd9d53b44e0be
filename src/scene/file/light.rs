//! Lights of a scene file: a path, an SVG or a text; its emission; its place.

use super::error::SceneError;
use super::table::{Limit, Table, Value};
use super::{COORDINATE, DEGREES, LENGTH, RADIANCE, SCALE};
use crate::color::luminance;
use crate::light::{AreaLight, Layer, Placement};
use crate::outline::svg::{self, SvgOptions};
use crate::outline::text::{Align, Direction, TextStyle, layout};
use crate::outline::{FillRule, Warning, path};
use crate::outline::{bundled, font};
use crate::scene::folder::Folder;
use crate::shape::{Bounds, Shape};
use core::f64::consts::PI;
use glam::{DAffine2, DVec2, DVec3};

/// Largest SVG and font file, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Lumens per watt: CIE photopic efficacy, for which Rec.709 white of radiance 1 has 683 nits.
pub const EFFICACY: f64 = 683.0;

const POWER: Limit = Limit::new(|v| (0.0..=1e15).contains(&v), "between 0 and 1e15 W");
const NITS: Limit = Limit::new(|v| (0.0..=1e15).contains(&v), "between 0 and 1e15 nits");
const SPACING: Limit = Limit::new(|v| v.abs() <= 100.0, "within ±100 em");
const LINE_HEIGHT: Limit = Limit::new(|v| v > 0.0 && v <= 100.0, "more than 0 and at most 100 em");
const AXIS: Limit = Limit::new(|v| v.abs() <= 1e6, "within ±1e6");

/// The keys that every light has.
const COMMON: [&str; 9] =
    ["position", "rotation", "scale", "radiance", "power", "luminance", "color", "two_sided", "fill_rule"];
const PATH: [&str; 1] = ["path"];
const SVG: [&str; 3] = ["svg", "size", "svg_colors"];
const TEXT: [&str; 8] = ["text", "font", "size", "align", "letter_spacing", "line_height", "axes", "direction"];
