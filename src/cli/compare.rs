//! `glyphlight compare`: one scene by every technique, with what each costs and how wrong it is.

mod measure;
mod verdict;

use super::backend::{BackendArg, Backends};
use super::display::DisplayArgs;
use super::machine::{machine, now};
use super::picture::SizeArgs;
use super::scene::{Staged, Subject};
use super::technique::why_not;
use super::values::positive;
use super::{say, warn};
use crate::backend::technique::{MAX_SPP, ReferenceLobe, Sampling};
use crate::backend::{Horizons, Settings, Technique};
use crate::error::Error;
use crate::film::{Display, ToneMap};
use crate::report::folder::{COMPARISON, NewFolder};
use crate::report::{Comparison, FORMAT, LeftOut, PictureSettings, Row, SceneSource};
use crate::scene::Scene;
use crate::scene::figures::FIGURES;
use comfy_table::{Cell, CellAlignment, Table};
use measure::Entry;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    mut_arg("width", |arg| arg.default_value("480")),
    mut_arg("height", |arg| arg.default_value("270")),
    mut_arg("samples", |arg| arg.default_value("1"))
)]
pub struct Args {
    #[command(flatten)]
    subject: Subject,
    /// Folder to write: pictures, error maps, tables, index.html
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Print the bundled figures and what they show
    #[arg(long)]
    list: bool,
    /// Replace the folder of an earlier comparison
    #[arg(long)]
    force: bool,
    /// Techniques with their parameters, separated by commas [default: what the scene asks for, else all that apply]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    techniques: Vec<Technique>,
    /// Compare with Monte Carlo and the GGX BRDF itself as well: the error of integral and fit together
    #[arg(long)]
    reference: bool,
    /// Light samples per pixel of all Monte Carlo: --reference, `reference` in the list [default: 256], and the yardstick where
    /// `exact` cannot be one [default: 1024]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SPP)))]
    spp: Option<u32>,
    /// Most runs of a technique; times are medians. What takes more than five seconds is run once
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=99))]
    repeat: u32,
    #[command(flatten)]
    size: SizeArgs,
    /// Tolerance of the tree, in radiance of the picture
    #[arg(long, default_value_t = 1e-4, value_parser = positive)]
    tolerance: f32,
    /// Where to compute: auto takes a hardware GPU if there is one, else the CPU; gpu takes a software driver as well. What
    /// runs on the CPU only runs there
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    backend: BackendArg,
    /// Threads of the CPU [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    #[command(flatten)]
    display: DisplayArgs,
    /// Write the pictures as EXR as well
    #[arg(long)]
    exr: bool,
}

/// Light samples per pixel of a yardstick by Monte Carlo: in `figure:picture` its noise is a fiftieth of the masked rectangle's
/// error.
const YARDSTICK_SPP: u32 = 1024;

/// What is compared where neither arguments nor scene say it.
const DEFAULT: [&str; 9] =
    ["tree", "kuge", "uniform:6", "uniform:18", "uniform:30", "quad", "textured", "pal", "representative"];

pub fn run(args: &Args) -> Result<(), Error> {
    if args.list {
        return FIGURES.iter().try_for_each(|f| say(format!("figure:{:<14} {}", f.name, f.about)));
    }
    let Some(output) = &args.output else { return Err(Error::Usage("compare needs -o DIR".into())) };
    if let Some(threads) = args.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        pool.map_err(|e| Error::Usage(format!("--threads {threads}: {e}")))?;
    }
    let SizeArgs { width, height, samples } = args.size;
    let tolerance = args.tolerance;
    let settings = Settings { width, height, samples, tolerance, technique: Technique::Tree, ..Settings::default() };
    settings.check()?;
    NewFolder::check(output, &COMPARISON, args.force)?;
    let date = now();
    let staged = args.subject.stage(width, height)?;
    let Plan { entries, mut left_out, asked_for } = plan(args, &staged, &settings)?;
    let techniques = entries.iter().filter(|e| e.role == measure::Role::Technique).count();
    let measured = measure::all(&staged.scene, entries, &Backends::new(args.backend), args.repeat)?;
    let display = args.display.display();
    let verdict = verdict::of(&measured, &settings, &display)?;
    let failed = measured.failed.iter().chain(&verdict.failed);
    if techniques > 0 && failed.clone().count() == techniques {
        left_out.extend(failed.cloned());
        return Err(nothing(&left_out));
    }
    // What was not asked for is no surprise.
    let missed = left_out.iter().filter(|_| asked_for).chain(failed.clone());
    warn(missed.map(|l| format!("left out: {}: {}", l.technique, l.reason)));
    left_out.extend(failed.cloned());
    let comparison = Comparison {
        format: FORMAT,
        program: concat!("glyphlight ", env!("CARGO_PKG_VERSION")).into(),
        date,
        machine: machine(),
        scene: SceneSource { name: staged.name, source: staged.source },
        settings: picture_settings(args, &settings, &display),
        rectangles: measured.rectangle_times(&settings),
        error_scale: verdict.scale,
        blocks: verdict.blocks,
        left_out,
    };
    let page = comparison.page(&verdict.pictures);
    let folder = NewFolder::new(output, &COMPARISON, args.force)?;
    for picture in &verdict.pictures {
        folder.write(&picture.file, &picture.png)?;
    }
    if let Some(bar) = verdict.bar {
        folder.write("error-scale.png", bar)?;
    }
    if args.exr {
        for picture in &measured.entries {
            picture.film.encode(&folder.place(&picture.file("exr"))?, &display)?.keep()?;
        }
    }
    folder.write("index.html", page)?;
    folder.write("table.md", comparison.markdown())?;
    folder.write("table.csv", comparison.csv())?;
    folder.write("table.json", comparison.json()?)?;
    folder.keep(args.force)?;
    comparison.blocks.iter().try_for_each(|block| say(table(&block.rows)))
}

fn picture_settings(args: &Args, settings: &Settings, display: &Display) -> PictureSettings {
    let named = ToneMap::ALL.iter().find(|(_, tone_map)| *tone_map == display.tone_map);
    let Settings { width, height, samples, tolerance, .. } = *settings;
    PictureSettings {
        width,
        height,
        samples,
        tolerance,
        exposure: display.exposure,
        tone_map: named.map_or_else(String::new, |(name, _)| (*name).into()),
        repeat: args.repeat,
    }
}

/// What is rendered, and what cannot be.
struct Plan {
    entries: Vec<Entry>,
    left_out: Vec<LeftOut>,
    /// Whether arguments or scene name the techniques.
    asked_for: bool,
}

/// # Errors
/// Nothing to compare, or a flag without effect.
fn plan(args: &Args, staged: &Staged, settings: &Settings) -> Result<Plan, Error> {
    let pictures = has_pictures(&staged.scene);
    let asked = [&args.techniques, &staged.techniques].into_iter().find(|list| !list.is_empty()).cloned();
    let asked_for = asked.is_some();
    let asked = asked.unwrap_or_else(|| DEFAULT.iter().filter_map(|name| name.parse().ok()).collect());
    let sampling = |lobe, spp| Technique::Reference(Sampling { spp, lobe, ..Sampling::default() });
    let yardstick = match pictures {
        true => sampling(ReferenceLobe::Ltc, args.spp.unwrap_or(YARDSTICK_SPP)),
        false => Technique::Exact,
    };
    let of = |technique: Technique, horizons| Settings { technique, horizons, ..*settings };
    let mut entries: Vec<Entry> = Vec::new();
    let mut left_out = Vec::new();
    // Every row is held against a yardstick that clips where it does.
    let mut horizons: Vec<Horizons> = Vec::new();
    for technique in asked {
        let technique = match technique {
            // Among the integrals of a cosine it is one as well.
            Technique::Reference(s) => {
                let spp = args.spp.unwrap_or(s.spp);
                Technique::Reference(Sampling { lobe: ReferenceLobe::Ltc, spp, ..s })
            }
            other => other,
        };
        if let Some(reason) = why_not(&technique, pictures) {
            left_out.push(LeftOut { technique: technique.to_string(), reason: reason.into() });
            continue;
        }
        let settings = of(technique, Horizons::Both);
        let clip = settings.horizons();
        if !horizons.contains(&clip) {
            horizons.push(clip);
        }
        if technique != yardstick && !entries.iter().any(|e| e.settings == settings) {
            entries.push(Entry::technique(settings));
        }
    }
    if horizons.is_empty() {
        return Err(nothing(&left_out));
    }
    entries.extend(horizons.into_iter().map(|horizons| Entry::yardstick(of(yardstick, horizons))));
    if args.reference {
        let spp = args.spp.unwrap_or(Sampling::default().spp);
        entries.push(Entry::truth(of(sampling(ReferenceLobe::Ggx, spp), Horizons::Both)));
    }
    if args.spp.is_some() && !entries.iter().any(|e| matches!(e.settings.technique, Technique::Reference(_))) {
        let message = "--spp has no effect here: it goes with --reference, with reference in --techniques, or with a scene \
                       that has pictures";
        return Err(Error::Usage(message.into()));
    }
    Ok(Plan { entries, left_out, asked_for })
}

/// Why no technique is left.
fn nothing(left_out: &[LeftOut]) -> Error {
    let reasons: Vec<_> = left_out.iter().map(|l| format!("{}: {}", l.technique, l.reason)).collect();
    Error::Usage(format!("nothing to compare: {}", reasons.join("; ")))
}

/// Whether a light changes its colour from place to place, which contour integrals cannot follow.
fn has_pictures(scene: &Scene) -> bool {
    scene.lights.iter().any(|l| l.layers.iter().any(|layer| layer.picture.is_some()))
}

/// A few columns for the terminal.
fn table(rows: &[Row]) -> String {
    let mut out = Table::new();
    out.load_style(comfy_table::presets::NOTHING);
    let noisy = rows.iter().any(|r| r.yardstick_noise.is_some());
    let header = ["technique", "shade ms", "× rectangle", "RMSE", "max", "FLIP", "energy", "yardstick"];
    let more = noisy.then_some(["yardstick's noise", "RMSE less noise"]);
    out.set_header(header.into_iter().chain(more.into_iter().flatten()));
    let number = |value: Option<f64>, decimals: usize| {
        let text = value.map_or_else(|| "–".into(), |v| format!("{v:.decimals$}"));
        Cell::new(text).set_alignment(CellAlignment::Right)
    };
    let small = |value: Option<f64>| {
        let text = value.map_or_else(|| "–".into(), |v| format!("{v:.2e}"));
        Cell::new(text).set_alignment(CellAlignment::Right)
    };
    for row in rows {
        let mut cells = vec![
            Cell::new(&row.technique),
            number(Some(row.seconds * 1e3), 1),
            number(row.rectangles, 2),
            small(row.errors.map(|e| e.rmse)),
            small(row.errors.map(|e| e.max)),
            number(row.flip, 5),
            number(row.errors.and_then(|e| e.energy_ratio), 5),
            Cell::new(row.yardstick.as_deref().unwrap_or("is one")),
        ];
        if noisy {
            cells.extend([small(row.yardstick_noise), small(row.rmse_less_noise)]);
        }
        out.add_row(cells);
    }
    out.to_string()
}
