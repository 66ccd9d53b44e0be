//! `glyphlight render`: a scene, a text or an SVG to a picture.

use super::backend::Backends;
use super::display::DisplayArgs;
use super::frames::{FrameArgs, Times};
use super::picture::PictureArgs;
use super::scene::{Staged, Subject};
use super::{json, label, say};
use crate::backend::skips::{SkipName, Skips};
use crate::backend::{ClusterStats, Rendering, Reused, Settings, Stats, Technique};
use crate::error::Error;
use crate::film::heat::{self, Scale};
use crate::film::{Display, Film, Format, Pending, check_writable, frame_path};
use crate::scene::{Motion, Scene};
use comfy_table::Table;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    subject: Subject,
    /// Picture to write: .png (display) or .exr (linear, layers); may be given twice
    #[arg(short, long, value_name = "FILE", default_value = "glyphlight.png")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    display: DisplayArgs,
    /// Dither PNGs
    #[arg(long)]
    dither: bool,
    /// Print what the picture cost
    #[arg(long)]
    stats: bool,
    /// Print the statistics as JSON
    #[arg(long, requires = "stats")]
    json: bool,
    /// Compute what the scene doesn't need as well: one of the names of `Skips::ALL`; may be given several times
    #[arg(long, hide = true, value_name = "NAME")]
    without_skip: Vec<SkipName>,
    /// Write a heat map of the edges (nodes, samples) that each pixel took, and print its scale
    #[arg(long, value_name = "FILE.png", conflicts_with = "frames")]
    count_edges: Option<PathBuf>,
    #[command(flatten)]
    frames: FrameArgs,
}

pub fn run(args: &Args) -> Result<(), Error> {
    for path in &args.output {
        Format::of(path)?;
        check_writable(&if args.frames.numbers() { frame_path(path, 1) } else { path.clone() })?;
    }
    let settings = Settings { skips: Skips::without(&args.without_skip), ..args.picture.settings()? };
    let technique = settings.technique;
    if let Some(path) = &args.count_edges {
        check_heat_map(path, args, technique)?;
    }
    let start = Instant::now();
    let Staged { mut scene, motion, .. } = args.subject.stage(settings.width, settings.height)?;
    let backends = Backends::new(args.picture.backend);
    let times = args.frames.times(&motion)?;
    if let Times::One(time) = times {
        motion.set(&mut scene, time);
    }
    let load = start.elapsed().as_secs_f64();
    let (frames, mut stats, scale) = if let Times::Frames(times) = times {
        (Some(times.len()), sequence(&backends, &scene, &motion, &settings, &times, args)?, None)
    } else {
        let Rendering { film, parts, mut stats } = backends.render(&scene, &settings)?;
        let start = Instant::now();
        let scale = write(&film, &parts, args, None)?;
        stats.stages.push(("write".into(), start.elapsed().as_secs_f64()));
        (None, stats, scale)
    };
    stats.stages.insert(0, ("load".into(), load));
    if args.stats {
        let report = Report { frames, stats: &stats, heat_map: scale };
        say(if args.json { json(&report)? } else { table(&report) })?;
    }
    if let Some(Scale { min, max, mean }) = scale
        && !args.json
    {
        say(format!(
            "{} per sample: min {min}, max {max}, mean {mean:.2} (dark is min, light is max, black is none)",
            technique.parts()
        ))?;
    }
    Ok(())
}

/// Renders the frames at those times, each to its own files. Gives what they cost together.
fn sequence(
    backends: &Backends,
    scene: &Scene,
    motion: &Motion,
    settings: &Settings,
    times: &[f64],
    args: &Args,
) -> Result<Stats, Error> {
    let mut session = backends.begin(scene, motion, settings)?;
    let mut total: Option<Stats> = None;
    for (number, &time) in (1..).zip(times) {
        let Rendering { film, parts, mut stats } = session.frame(time)?;
        let start = Instant::now();
        write(&film, &parts, args, Some(number))?;
        stats.stages.push(("write".into(), start.elapsed().as_secs_f64()));
        match &mut total {
            Some(total) => total.add(&stats),
            None => total = Some(stats),
        }
    }
    Ok(total.unwrap_or_default())
}

/// What `--stats --json` prints.
#[derive(serde::Serialize)]
struct Report<'a> {
    /// How many, of a sequence; everything else is of all of them together.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<usize>,
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

/// Writes all files or none; those of a frame by its number.
fn write(film: &Film, parts: &[f32], args: &Args, frame: Option<u32>) -> Result<Option<Scale>, Error> {
    let display = Display { dither: args.dither, ..args.display.display() };
    let encode = |path: &PathBuf| film.encode(&frame.map_or_else(|| path.clone(), |n| frame_path(path, n)), &display);
    let mut files = args.output.iter().map(encode).collect::<Result<Vec<_>, _>>()?;
    let mut scale = None;
    if let Some(path) = &args.count_edges {
        let (file, of) = heat::encode(path, film.width, film.height, parts)?;
        files.push(file);
        scale = Some(of);
    }
    files.into_iter().try_for_each(Pending::keep)?;
    Ok(scale)
}

/// The statistics as a table.
fn table(report: &Report<'_>) -> String {
    let stats = report.stats;
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let per_sample = |n: u64| format!("{:.2}", n as f64 / stats.shaded.max(1) as f64);
    let parts = stats.technique.parse::<Technique>().map_or("parts", |t| t.parts());
    if let Some(frames) = report.frames {
        table.add_row(["frames".to_owned(), frames.to_string()]);
        for Reused { what, reused, made } in &stats.reused {
            table.add_row([format!("{what} reused"), format!("{reused} of {}", reused + made)]);
        }
    }
    table.add_row(["technique", &stats.technique]);
    table.add_row(["backend", &stats.backend]);
    table.add_row(["device", &stats.device]);
    table.add_row(["clock of the shading", &stats.clock]);
    for (stage, seconds) in &stats.stages {
        table.add_row([format!("time, {stage}"), format!("{:.3} ms", seconds * 1e3)]);
    }
    table.add_row(["shaded samples".to_owned(), stats.shaded.to_string()]);
    table.add_row(["integrals per sample".to_owned(), per_sample(stats.integrals)]);
    table.add_row([format!("{parts} per sample"), per_sample(stats.nodes)]);
    if let Some(bytes) = stats.loaded {
        table.add_row(["bytes of lights loaded per sample".to_owned(), per_sample(bytes)]);
    }
    if stats.windows > 1 {
        table.add_row(["parts of each light, as the driver ends long loops".to_owned(), stats.windows.to_string()]);
    }
    if let Some(bytes) = stats.memory.per_curve() {
        table.add_row(["bytes of trees per curve".to_owned(), format!("{bytes:.0}")]);
    }
    if !stats.left_out.is_empty() {
        table.add_row(["left out for all samples".to_owned(), stats.left_out.join(", ")]);
    }
    let ClusterStats { by_tile, local, by_point, whole } = stats.clusters;
    if by_tile + by_point > 0 {
        let [visited, stood] = [by_point, whole].map(per_sample);
        let clusters = format!(
            "{by_tile} by tiles, {local} stood for their lights at all points; per sample {visited} by points, {stood} stood for \
             their lights"
        );
        table.add_row(["clusters of lights visited".to_owned(), clusters]);
    }
    for light in &stats.lights {
        let percent = |n: u64| 100.0 * n as f64 / light.candidates.max(1) as f64;
        let skipped = format!(
            "behind {:.1} % ({:.1} % by tile), below the horizon {:.1} % ({:.1} % by tile), no such lobe {:.1} %, under the \
             tolerance {:.1} %, in a cluster {:.1} % of {}",
            percent(light.behind),
            percent(light.behind_tile),
            percent(light.below_horizon),
            percent(light.below_tile),
            percent(light.no_lobe),
            percent(light.under_tolerance),
            percent(light.clustered),
            light.candidates
        );
        table.add_row([format!("skipped, {}", label(&light.name)), skipped]);
    }
    table.to_string()
}
