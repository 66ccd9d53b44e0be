//! `glyphlight probe`: values as JSON lines.

use super::backend::{BackendArg, Backends};
use super::technique::TechniqueArgs;
use super::values::positive;
use super::{json, read, say};
use crate::backend::emitter::Emitter;
use crate::backend::gather::Images;
use crate::backend::prepared::Prepared;
use crate::backend::{Settings, Technique, reference};
use crate::brdf::ltc::Table;
use crate::error::Error;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::tree::Budget;
use crate::light::tree::TreeError;
use crate::shape::Shape;
use crate::stress;
use crate::stress::case::{Line, shape_of};
use clap::Subcommand;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Largest coordinate in cosine space.
const LARGEST: f64 = 1e30;

/// Least of the largest coordinate in cosine space.
const SMALLEST: f64 = 1e-30;

/// Farthest point of a scene along an axis, metres.
const FARTHEST: f64 = 1e12;

/// Largest file of cases or points.
const MAX_BYTES: u64 = 1 << 30;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The clamped-cosine integral of shapes given in cosine space
    ///
    /// A line of CASES has `id`, `curves` (closed contours, cubics in order as [[x,y],[x,y],[x,y],[x,y]]; a new contour starts
    /// where a curve does not begin at the last end point) and `c0`, `c1`, `c2`: the images of the light's x axis, y axis and
    /// origin in cosine space. Prints {"id":…,"value":E,"visited":n}, E clipped at z = 0 only.
    ///
    /// Instead of the three a line may have a light in the world, as `glyphlight stress` prints it: `light` (`origin`, `x`, `y`: the
    /// world images of the light-space origin and axes), `eye` (the camera, (0, 0, 0) if left out), `position`, `normal`, `view`,
    /// `alpha` (without it E is the plain cosine's) and `tolerance`. E is then clipped at the surface as well, by techniques that
    /// can, and without a weight: 1 for a light that fills the hemisphere.
    Integral {
        /// Cases, one JSON object per line
        cases: PathBuf,
        /// Where to compute cases in the world: auto takes a hardware GPU if there is one, else the CPU
        #[arg(long, value_enum, default_value_t = BackendArg::Cpu)]
        backend: BackendArg,
        #[command(flatten)]
        how: How,
    },
    /// Irradiance and reflected radiance at points of a scene
    ///
    /// A line of POINTS has `position`, `normal`, `view` (towards the eye) and `alpha` (GGX width). Prints
    /// {"irradiance":[r,g,b],"specular":[r,g,b]}: irradiance in W/m², and the radiance reflected by a specular lobe with
    /// Fresnel = 1, all lights together.
    Scene {
        /// The scene file
        scene: PathBuf,
        /// Points, one JSON object per line
        #[arg(long)]
        points: PathBuf,
        #[command(flatten)]
        how: How,
    },
}

#[derive(Debug, clap::Args)]
struct How {
    #[command(flatten)]
    technique: TechniqueArgs,
    /// tree, textured: largest error of the integral, or of the radiance at a point [default: 1e-5]
    #[arg(long, value_parser = positive)]
    tolerance: Option<f32>,
}

impl How {
    fn tolerance(&self) -> Result<f32, Error> {
        self.technique.check_tolerance(self.tolerance)?;
        Ok(self.tolerance.unwrap_or(1e-5))
    }
}

pub fn run(args: &Args) -> Result<(), Error> {
    match &args.what {
        What::Integral { cases, backend, how } => integrals(cases, *backend, how),
        What::Scene { scene, points, how } => scene_points(scene, points, how),
    }
}

/// Prints what `each` makes of every line of a JSON-lines file. Blank lines are passed over.
fn lines(path: &Path, mut each: impl FnMut(&[u8]) -> Result<String, String>) -> Result<(), Error> {
    let bytes = read(path, MAX_BYTES)?;
    for (i, line) in bytes.split(|&b| b == b'\n').enumerate() {
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let message = |message| Error::Line { file: path.display().to_string(), line: i + 1, message };
        say(each(line).map_err(message)?)?;
    }
    Ok(())
}

fn parsed<T: for<'a> Deserialize<'a>>(line: &[u8]) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|e| e.to_string())
}

/// Whether a line of CASES is one in the world, so that what is wrong with it is said of that one.
fn is_in_world(line: &[u8]) -> bool {
    serde_json::from_slice::<serde_json::Value>(line).is_ok_and(|line| line.get("light").is_some())
}

#[derive(Deserialize)]
struct CosineLine {
    id: serde_json::Value,
    curves: Vec<[[f64; 2]; 4]>,
    c0: [f64; 3],
    c1: [f64; 3],
    c2: [f64; 3],
}

/// A shape given in cosine space: what a line of `glyphlight probe integral` says.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What the line calls itself.
    pub id: serde_json::Value,
    /// The contours, taken as they are: they may overlap and run either way round.
    pub shape: Shape,
    /// The images of the light's x axis, y axis and origin in cosine space.
    pub images: [DVec3; 3],
}

impl Case {
    /// Reads one line of JSON.
    ///
    /// # Errors
    /// What is wrong with it, with key and value.
    pub fn parse(line: &[u8]) -> Result<Self, String> {
        let CosineLine { id, curves, c0, c1, c2 } = parsed(line)?;
        let shape = shape_of(&curves)?;
        Ok(Self { id, shape, images: cosine_space([c0, c1, c2])? })
    }

    /// The clamped-cosine integral by `technique`, clipped at z = 0, and what it was made of ([`Technique::parts`]); 0 for
    /// what does not reach the point.
    ///
    /// # Errors
    /// [`TreeError`] where the shape is no region.
    pub fn integral(&self, technique: &Technique, tolerance: f32) -> Result<(f64, u32), TreeError> {
        let emitter = Emitter::of_shape(self.shape.clone(), technique)?;
        let images = Images::in_cosine_space(self.images);
        let integral = images.integral(&emitter, None, tolerance, &mut Budget::default());
        Ok(integral.map_or((0.0, 0), |i| (i.value.x, i.visited)))
    }
}

#[derive(Serialize)]
struct Value {
    id: serde_json::Value,
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    visited: Option<u32>,
}

fn integrals(path: &Path, backend: BackendArg, how: &How) -> Result<(), Error> {
    let (technique, horizons) = how.technique.resolve()?;
    let tolerance = how.tolerance()?;
    let backends = Backends::new(backend);
    lines(path, |line| {
        let value = if is_in_world(line) {
            let line: Line = parsed(line)?;
            let case = stress::case::Case::of_line(&line, tolerance)?;
            let meter = backends.meter(technique, horizons).map_err(|e| e.to_string())?;
            let values = meter.read(&[vec![case]]).map_err(|e| e.to_string())?;
            let value = values.first().and_then(|block| block.first()).copied().unwrap_or_default();
            Value { id: line.id, value, visited: None }
        } else {
            let case = Case::parse(line)?;
            let (value, visited) = case.integral(&technique, tolerance).map_err(|e| format!("`curves`: {e}"))?;
            Value { id: case.id, value, visited: Some(visited) }
        };
        json(&value).map_err(|e| e.to_string())
    })
}

/// The map to cosine space. Only its direction counts, but its products must not leave the range of f64.
fn cosine_space(c: [[f64; 3]; 3]) -> Result<[DVec3; 3], String> {
    let c = c.map(DVec3::from_array);
    let largest = c.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
    if (SMALLEST..=LARGEST).contains(&largest) {
        return Ok(c);
    }
    Err(format!("the largest of `c0`, `c1`, `c2` is {largest:e}; it must be {SMALLEST:e} to {LARGEST:e}"))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    #[serde(default)]
    id: Option<serde_json::Value>,
    position: [f64; 3],
    normal: [f64; 3],
    view: [f64; 3],
    alpha: f64,
}

#[derive(Serialize)]
struct Reading {
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<serde_json::Value>,
    irradiance: [f64; 3],
    specular: [f64; 3],
}

fn scene_points(scene: &Path, points: &Path, how: &How) -> Result<(), Error> {
    let (loaded, _) = super::scene::open(scene)?;
    super::warn(&loaded.warnings);
    let (technique, horizons) = how.technique.resolve()?;
    let tolerance = how.tolerance()?;
    let settings = Settings { width: 1, height: 1, samples: 1, tolerance, technique, horizons, ..Settings::default() };
    let prepared = Prepared::new(&loaded.scene, &settings)?;
    lines(points, |line| json(&reading(&prepared, &settings, parsed(line)?)?).map_err(|e| e.to_string()))
}

fn reading(prepared: &Prepared, settings: &Settings, point: Point) -> Result<Reading, String> {
    let unit = |key: &str, v: [f64; 3]| {
        DVec3::from_array(v).try_normalize().ok_or_else(|| format!("`{key}` = {v:?} has no direction"))
    };
    if !(0.0..=1.0).contains(&point.alpha) {
        return Err(format!("`alpha` = {} is not between 0 and 1", point.alpha));
    }
    if point.position.iter().any(|v| v.abs() > FARTHEST) {
        return Err(format!("`position` = {:?} is beyond ±{FARTHEST:e} m", point.position));
    }
    let frame = ShadingFrame::new(unit("normal", point.normal)?, unit("view", point.view)?);
    let position = DVec3::from_array(point.position) - prepared.eye;
    let alpha = point.alpha as f32;
    if let Technique::Reference(sampling) = &settings.technique {
        let [irradiance, specular] = reference::measure(prepared, sampling, &frame, position, alpha);
        return Ok(Reading { id: point.id, irradiance: irradiance.to_array(), specular: specular.to_array() });
    }
    let lobe = prepared.lobe(Table::shipped(), alpha, frame.cos_theta as f32);
    let [mut irradiance, mut specular] = [DVec3::ZERO; 2];
    let mut budgets = [Budget::default(); 2];
    for emitter in &prepared.emitters {
        let Ok(images) = Images::new(emitter, &frame, position) else { continue };
        let radiance = emitter.radiance.as_dvec3();
        let tolerance = settings.tolerance / emitter.radiance.max_element().max(f32::MIN_POSITIVE);
        if let Ok(integral) = images.integral(emitter, None, tolerance, &mut budgets[0]) {
            irradiance += radiance * integral.value * core::f64::consts::PI;
        }
        if let Ok(integral) = images.integral(emitter, Some(&lobe), tolerance, &mut budgets[1]) {
            specular += radiance * integral.value * f64::from(lobe.magnitude / lobe.above);
        }
    }
    Ok(Reading { id: point.id, irradiance: irradiance.to_array(), specular: specular.to_array() })
}
