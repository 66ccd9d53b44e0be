//! `glyphlight render`: a scene, a text or an SVG to a picture.

use super::lights::{Source, Style};
use super::technique::TechniqueArgs;
use super::values::{Color, finite, hex, positive, radiance, unit};
use super::{json, label, say, warn};
use crate::backend::cpu::CpuBackend;
use crate::backend::{Backend, BackendError, Rendering, Settings, Stats, Technique};
use crate::error::Error;
use crate::film::heat::{self, Scale};
use crate::film::{Display, Film, Format, Pending, ToneMap, check_writable};
use crate::scene::preset::{PresetOptions, sign};
use crate::scene::{Scene, file};
use clap::ValueEnum;
use comfy_table::Table;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML)
    #[arg(conflicts_with = "art")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    style: Style,
    #[command(flatten)]
    sign: Sign,
    /// Picture to write: .png (display) or .exr (linear, layers); may be given twice
    #[arg(short, long, value_name = "FILE", default_value = "glyphlight.png")]
    output: Vec<PathBuf>,
    /// Pixels across
    #[arg(long, default_value_t = 1280)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = 720)]
    height: u32,
    /// Samples per pixel
    #[arg(long, default_value_t = 4)]
    samples: u32,
    /// Largest error of each light and lobe, in radiance of the picture
    #[arg(long, default_value_t = 1e-4, value_parser = positive)]
    tolerance: f32,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Where to compute: auto takes a hardware GPU if there is one, else the CPU; gpu takes a software driver as well
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    backend: BackendArg,
    /// Exposure of PNGs, stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    exposure: f64,
    /// Tone mapping of PNGs
    #[arg(long, value_enum, default_value_t = ToneMapArg::Neutral)]
    tone_map: ToneMapArg,
    /// Dither PNGs
    #[arg(long)]
    dither: bool,
    /// Print what the picture cost
    #[arg(long)]
    stats: bool,
    /// Print the statistics as JSON
    #[arg(long, requires = "stats")]
    json: bool,
    /// Write a heat map of the edges (nodes, samples) that each pixel took, and print its scale
    #[arg(long, value_name = "FILE.png")]
    count_edges: Option<PathBuf>,
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

/// Where to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BackendArg {
    Auto,
    Cpu,
    Gpu,
}

/// Tone mapping by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ToneMapArg {
    /// Clip at white
    Linear,
    /// Reinhard's curve
    Reinhard,
    /// ACES film curve
    Aces,
    /// Khronos PBR Neutral: keeps hues, compresses highlights only
    Neutral,
}

impl From<ToneMapArg> for ToneMap {
    fn from(arg: ToneMapArg) -> Self {
        match arg {
            ToneMapArg::Linear => Self::Linear,
            ToneMapArg::Reinhard => Self::Reinhard,
            ToneMapArg::Aces => Self::Aces,
            ToneMapArg::Neutral => Self::Neutral,
        }
    }
}

pub fn run(args: &Args) -> Result<(), Error> {
    for path in &args.output {
        Format::of(path)?;
        check_writable(path)?;
    }
    let (technique, horizons) = args.technique.resolve()?;
    if let Some(path) = &args.count_edges {
        check_heat_map(path, args, technique)?;
    }
    let settings = Settings {
        width: args.width,
        height: args.height,
        samples: args.samples,
        tolerance: args.tolerance,
        technique,
        horizons,
    };
    settings.check()?;
    let start = Instant::now();
    let scene = scene(args)?;
    let load = start.elapsed().as_secs_f64();
    let Rendering { film, parts, mut stats } = render(&scene, &settings, args.backend)?;
    let start = Instant::now();
    let scale = write(&film, &parts, args)?;
    stats.stages.insert(0, ("load".into(), load));
    stats.stages.push(("write".into(), start.elapsed().as_secs_f64()));
    if args.stats {
        say(if args.json { json(&Report { stats: &stats, heat_map: scale })? } else { table(&stats) })?;
    }
    if let Some(Scale { min, max, mean }) = scale
        && !args.json
    {
        say(format!(
            "{} per sample: min {min}, max {max}, mean {mean:.2} (dark is 0, light is max)",
            technique.parts()
        ))?;
    }
    Ok(())
}

/// What `--stats --json` prints.
#[derive(serde::Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    stats: &'a Stats,
    /// Of `--count-edges`: least and mean of the values above 0, and the greatest.
    #[serde(skip_serializing_if = "Option::is_none")]
    heat_map: Option<Scale>,
}

/// Refuses a heat map that cannot be made.
fn check_heat_map(path: &Path, args: &Args, technique: Technique) -> Result<(), Error> {
    if Format::of(path)? != Format::Png {
        return Err(Error::Usage(format!("--count-edges {}: a heat map is a .png", path.display())));
    }
    if args.output.iter().any(|output| output == path) {
        return Err(Error::Usage(format!("--count-edges {}: that is the picture's file", path.display())));
    }
    if technique == Technique::Exact {
        return Err(Error::Usage("--count-edges: technique exact counts nothing".into()));
    }
    Ok(check_writable(path)?)
}

/// Writes all files or none.
fn write(film: &Film, parts: &[f32], args: &Args) -> Result<Option<Scale>, Error> {
    let display = Display { exposure: args.exposure, tone_map: args.tone_map.into(), dither: args.dither };
    let mut files = args.output.iter().map(|path| film.encode(path, &display)).collect::<Result<Vec<_>, _>>()?;
    let mut scale = None;
    if let Some(path) = &args.count_edges {
        let (file, of) = heat::encode(path, film.width, film.height, parts)?;
        files.push(file);
        scale = Some(of);
    }
    files.into_iter().try_for_each(Pending::keep)?;
    Ok(scale)
}

fn scene(args: &Args) -> Result<Scene, Error> {
    if let Some(path) = &args.scene {
        args.style.check("a scene file")?;
        let loaded = file::load(path)?;
        warn(&loaded.warnings);
        return Ok(loaded.scene);
    }
    let art = args.source.art(&args.style)?;
    warn(art.warnings.iter().map(|w| format!("{}: {}", w.element, w.message)));
    let mut layers = art.layers;
    for layer in &mut layers {
        layer.radiance *= DVec3::from_array(args.sign.color.0) * args.sign.radiance;
    }
    let default = PresetOptions::default();
    let alpha = args.sign.alpha.or(args.sign.roughness.map(|r| r * r)).unwrap_or(default.alpha);
    let aspect = f64::from(args.width) / f64::from(args.height);
    Ok(sign(layers, &PresetOptions { name: art.name, alpha, aspect, ..default })?)
}

fn render(scene: &Scene, settings: &Settings, backend: BackendArg) -> Result<Rendering, BackendError> {
    if backend == BackendArg::Cpu || settings.technique.is_cpu_only() && backend == BackendArg::Auto {
        return CpuBackend.render(scene, settings);
    }
    on_gpu(scene, settings, backend)
}

#[cfg(feature = "gpu")]
fn on_gpu(scene: &Scene, settings: &Settings, backend: BackendArg) -> Result<Rendering, BackendError> {
    use crate::backend::gpu::{AdapterChoice, GpuBackend};
    match backend {
        BackendArg::Auto => match GpuBackend::new(AdapterChoice::Hardware) {
            Ok(gpu) => gpu.render(scene, settings),
            Err(BackendError::NoAdapter(_)) => CpuBackend.render(scene, settings),
            Err(error) => Err(error),
        },
        _ => GpuBackend::new(AdapterChoice::Any)?.render(scene, settings),
    }
}

#[cfg(not(feature = "gpu"))]
fn on_gpu(scene: &Scene, settings: &Settings, backend: BackendArg) -> Result<Rendering, BackendError> {
    match backend {
        BackendArg::Auto => CpuBackend.render(scene, settings),
        _ => Err(BackendError::NoAdapter("built without the feature `gpu`".into())),
    }
}

/// The statistics as a table.
fn table(stats: &Stats) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let per_sample = |n: u64| format!("{:.2}", n as f64 / stats.shaded.max(1) as f64);
    let parts = stats.technique.parse::<Technique>().map_or("parts", |t| t.parts());
    table.add_row(["technique", &stats.technique]);
    table.add_row(["backend", &stats.backend]);
    table.add_row(["device", &stats.device]);
    for (stage, seconds) in &stats.stages {
        table.add_row([format!("time, {stage}"), format!("{:.3} ms", seconds * 1e3)]);
    }
    table.add_row(["shaded samples".to_owned(), stats.shaded.to_string()]);
    table.add_row(["integrals per sample".to_owned(), per_sample(stats.integrals)]);
    table.add_row([format!("{parts} per sample"), per_sample(stats.nodes)]);
    for light in &stats.lights {
        let percent = |n: u64| 100.0 * n as f64 / light.candidates.max(1) as f64;
        let skipped = format!(
            "behind {:.1} %, below the horizon {:.1} %, no such lobe {:.1} % of {}",
            percent(light.behind),
            percent(light.below_horizon),
            percent(light.no_lobe),
            light.candidates
        );
        table.add_row([format!("skipped, {}", label(&light.name)), skipped]);
    }
    table.to_string()
}
