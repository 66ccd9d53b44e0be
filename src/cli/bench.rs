//! `glyphlight bench`: time against error of every technique, and whether a run is worse than an earlier one.

mod measure;
mod plan;
mod skips;
mod waiting;

use super::machine::{machine, now, simd};
use super::{json, read, say, warn};
use crate::backend::technique::MAX_SPP;
use crate::error::Error;
use crate::report::bench::{BenchMachine, BenchRow, BenchSettings, Benchmark, Build, FORMAT, Ratio};
use crate::report::check::{Checked, Measure, check, rule};
use crate::report::folder::{BENCHMARK, NewFolder};
use crate::report::plot::plots;
use crate::report::skips::{SkipReport, SkipRow};
use crate::report::{LeftOut, Machine};
use crate::scene::trial::{Finish, PICTURE, Trial, WINDOWS};
use comfy_table::{Cell, CellAlignment, Table};
use measure::Bencher;
use plan::{Filter, On, Wanted};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_long_help = rule())]
pub struct Args {
    /// Techniques, separated by commas; with a knob (tree:1e-3, textured:1e-3, kuge:1e-4, uniform:30, quad:256, reference:64)
    /// that alone, without one all that are usual [default: all that have something to show]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    technique: Vec<Wanted>,
    /// Lights: rectangle, cavity (with a hole), glyph, picture (the glyph in a gradient), line, paragraph, drawing (540 paths)
    /// [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    shape: Vec<Trial>,
    /// Floors: GGX alpha, or diffuse [default: 0.01,0.05,0.1,0.25,0.5,0.8,diffuse]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    alpha: Vec<Finish>,
    /// Where to compute [default: both, the GPU if there is one, be it a software driver]
    #[arg(long, value_enum, value_name = "LIST", value_delimiter = ',')]
    backend: Vec<On>,
    /// A few lights, floors and knobs, small windows, few runs: half a minute
    #[arg(long)]
    quick: bool,
    /// Pixels along the side of a window; there are four, as fine as pixels of a picture 1024 high [default: 32; quick: 16]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=i64::from(PICTURE / 4)))]
    size: Option<u32>,
    /// Timed rounds after the first, which warms up. What takes more than a second is run once [default: 7; quick: 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=999))]
    repeats: Option<u32>,
    /// Threads that shade; yardsticks take all there are
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Compare with Monte Carlo and the GGX BRDF itself as well: the error of integral and fit together
    #[arg(long)]
    reference: bool,
    /// Light samples per pixel of --reference [default: 1024]
    #[arg(long, value_name = "N", requires = "reference", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SPP)))]
    spp: Option<u32>,
    /// Folder to write: bench.json, bench.csv, plots/ (SVG and PNG)
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace the folder of an earlier benchmark
    #[arg(long, requires = "output")]
    force: bool,
    /// Measure what this bench.json of an earlier run holds, as far as the filters let it pass, and exit with 1 if something got
    /// worse; --help says what is worse
    #[arg(long, value_name = "BASELINE.json", conflicts_with_all = ["quick", "size"])]
    check: Option<PathBuf>,
    /// Check this bench.json, and measure nothing
    #[arg(
        long,
        value_name = "RUN.json",
        requires = "check",
        conflicts_with_all = ["technique", "shape", "alpha", "backend", "repeats", "threads", "reference", "output"]
    )]
    with: Option<PathBuf>,
    /// Measure what is left out where a scene doesn't need it instead: the same picture with each skip on and off, 256 pixels a
    /// side unless --size says otherwise. Exit with 1 if a picture changes by more than the tolerance, or nothing is left out
    #[arg(long, conflicts_with_all = ["technique", "shape", "alpha", "quick", "reference", "check", "output"])]
    skips: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Largest benchmark that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Runs the verb; `false` where a check found that something got worse.
///
/// # Errors
/// Nothing to measure, a baseline that is none, a folder that cannot be written, a yardstick that fails.
pub fn run(args: &Args) -> Result<bool, Error> {
    if args.skips {
        return compare_skips(args);
    }
    let baseline = args.check.as_deref().map(open).transpose()?;
    let run = match &args.with {
        Some(path) => open(path)?,
        None => measured(args, baseline.as_ref())?,
    };
    let Some(baseline) = baseline else {
        say(if args.json { json(&run)? } else { format!("{}\n\n{}", run.header(), table(&run.rows)) })?;
        return Ok(true);
    };
    let checked = check(&baseline, &run);
    if checked.rows == 0 {
        return Err(Error::Usage("--check: the run has no row of the baseline".into()));
    }
    say(if args.json { json(&checked)? } else { verdict(&checked) })?;
    Ok(checked.worse.is_empty())
}

/// `--skips`.
fn compare_skips(args: &Args) -> Result<bool, Error> {
    let (side, repeats) = (args.size.unwrap_or(256), args.repeats.unwrap_or(7));
    let date = now();
    let bencher = Bencher::new(side, repeats, args.threads.into(), None)?;
    let mut backends = if args.backend.is_empty() { vec![On::Cpu, On::Gpu] } else { args.backend.clone() };
    if backends.contains(&On::Gpu)
        && let Err(error) = bencher.gpu()
    {
        if !args.backend.is_empty() {
            return Err(error.into());
        }
        warn([format!("left out: all on the GPU: {error}")]);
        backends.retain(|on| *on == On::Cpu);
    }
    let rows = skips::measure(&bencher, &backends, side, repeats)?;
    let on_gpu = rows.iter().find(|r| r.backend == "gpu");
    let [adapter, clock] = [on_gpu.map(|r| r.device.clone()), on_gpu.map(|r| r.clock.clone())];
    warn_of_clock(clock.as_deref());
    let holds = rows.iter().all(SkipRow::holds);
    let program = concat!("glyphlight ", env!("CARGO_PKG_VERSION")).into();
    let report = SkipReport { format: 1, program, date, machine: here(args, adapter, clock), side, repeats, rows };
    say(if args.json { json(&report)? } else { skip_table(&report.rows) })?;
    Ok(holds)
}

/// The computer and what of it is used.
fn here(args: &Args, adapter: Option<String>, clock: Option<String>) -> BenchMachine {
    let Machine { processor, system, .. } = machine();
    BenchMachine { processor, simd: simd(), threads: args.threads.into(), system, adapter, clock }
}

fn warn_of(left_out: &[LeftOut]) {
    warn(left_out.iter().map(|l| format!("left out: {}: {}", l.technique, l.reason)));
}

/// Says so where a GPU's own clock is not to be had.
fn warn_of_clock(clock: Option<&str>) {
    warn(clock.filter(|clock| *clock != "timestamps").map(|clock| format!("GPU times are by the {clock}")));
}

fn open(path: &Path) -> Result<Benchmark, Error> {
    let wrong = |source| Error::Usage(format!("{}: {source}", path.display()));
    Benchmark::parse(&read(path, MAX_BYTES)?).map_err(wrong)
}

/// Measures, and writes what `--output` asks for.
fn measured(args: &Args, baseline: Option<&Benchmark>) -> Result<Benchmark, Error> {
    let filter = Filter {
        techniques: &args.technique,
        shapes: &args.shape,
        finishes: &args.alpha,
        backends: &args.backend,
        quick: args.quick,
    };
    let mut cells = match baseline {
        Some(baseline) => filter.of_baseline(&baseline.rows).map_err(|e| Error::Usage(format!("--check: {e}")))?,
        None => filter.cells().map_err(Error::Usage)?,
    };
    if let Some(output) = &args.output {
        NewFolder::check(output, &BENCHMARK, args.force)?;
    }
    let (side, repeats) = match baseline {
        Some(baseline) => (baseline.settings.side, args.repeats.unwrap_or(baseline.settings.repeats)),
        None if args.quick => (args.size.unwrap_or(16), args.repeats.unwrap_or(5)),
        None => (args.size.unwrap_or(32), args.repeats.unwrap_or(7)),
    };
    // What was not asked for is no surprise.
    let unfit = plan::leave_out(&mut cells);
    if !args.technique.is_empty() {
        warn_of(&unfit);
    }
    let date = now();
    let spp = args.reference.then(|| args.spp.unwrap_or(1024));
    let bencher = Bencher::new(side, repeats, args.threads.into(), spp)?;
    let mut left_out: Vec<LeftOut> = Vec::new();
    if cells.iter().flat_map(|cell| &cell.points).any(|(on, _)| *on == On::Gpu)
        && let Err(error) = bencher.gpu()
    {
        if args.backend.contains(&On::Gpu) {
            return Err(error.into());
        }
        left_out.push(LeftOut { technique: "all on the GPU".into(), reason: error.to_string() });
        cells.iter_mut().for_each(|cell| cell.points.retain(|(on, _)| *on == On::Cpu));
    }
    let rectangle = Trial::Rectangle.layers()?;
    let mut rows = Vec::new();
    let (mut adapter, mut clock) = (None, None);
    for cell in cells.iter().filter(|cell| !cell.points.is_empty()) {
        let measured = bencher.cell(cell, &rectangle)?;
        rows.extend(measured.rows);
        left_out.extend(measured.left_out);
        adapter = adapter.or(measured.adapter);
        clock = clock.or(measured.clock);
    }
    warn_of_clock(clock.as_deref());
    warn_of(&left_out);
    left_out.extend(unfit);
    if rows.is_empty() {
        return Err(Error::Usage("nothing to measure: no light, floor, technique and backend is left".into()));
    }
    let bench = Benchmark {
        format: FORMAT,
        program: concat!("glyphlight ", env!("CARGO_PKG_VERSION")).into(),
        date,
        build: Build {
            version: env!("CARGO_PKG_VERSION").into(),
            profile: if cfg!(debug_assertions) { "debug" } else { "release" }.into(),
            revision: option_env!("GLYPHLIGHT_REVISION").map(Into::into),
        },
        machine: here(args, adapter, clock),
        settings: BenchSettings { side, windows: WINDOWS, repeats, reference_spp: spp },
        rows,
        left_out,
    };
    if let Some(output) = &args.output {
        write(&bench, output, args.force)?;
    }
    Ok(bench)
}

fn write(bench: &Benchmark, output: &Path, force: bool) -> Result<(), Error> {
    let plots = plots(bench)?;
    let folder = NewFolder::new(output, &BENCHMARK, force)?;
    for plot in plots {
        folder.write(&format!("plots/{}.svg", plot.name), plot.svg)?;
        folder.write(&format!("plots/{}.png", plot.name), plot.png)?;
    }
    folder.write("bench.json", bench.json()?)?;
    folder.write("bench.csv", bench.csv())?;
    Ok(folder.keep(force)?)
}

/// The rows for the terminal.
fn table(rows: &[BenchRow]) -> String {
    let mut out = Table::new();
    out.load_style(comfy_table::presets::NOTHING);
    let total = rows.iter().any(|r| r.total.is_some());
    let header = [
        "light",
        "floor",
        "on",
        "technique",
        "ns/pixel",
        "±",
        "× rectangle",
        "±",
        "× uniform:30",
        "parts",
        "RMSE",
        "max",
    ];
    out.set_header(header.into_iter().chain(total.then_some("RMSE to GGX")));
    let right = |text: String| Cell::new(text).set_alignment(CellAlignment::Right);
    let number =
        |value: Option<f64>, decimals: usize| right(value.map_or_else(|| "–".into(), |v| format!("{v:.decimals$}")));
    let value = |ratio: Option<Ratio>| ratio.map(|r| r.value);
    for row in rows {
        let mut cells = vec![
            Cell::new(&row.shape),
            Cell::new(&row.finish),
            Cell::new(&row.backend),
            Cell::new(row.label()),
            number(Some(row.nanoseconds), 0),
            number(row.spread, 0),
            number(value(row.rectangles), 2),
            number(row.rectangles.and_then(|r| r.spread), 2),
            number(value(row.uniforms), 3),
            number(Some(row.parts), 1),
            right(format!("{:.2e}", row.errors.rmse)),
            right(format!("{:.2e}", row.errors.max)),
        ];
        if total {
            cells.push(right(row.total.map_or_else(|| "–".into(), |t| format!("{:.2e}", t.rmse))));
        }
        out.add_row(cells);
    }
    out.to_string()
}

/// Skips for the terminal.
fn skip_table(rows: &[SkipRow]) -> String {
    let mut out = Table::new();
    out.load_style(comfy_table::presets::NOTHING);
    out.set_header([
        "skip",
        "on",
        "skipped",
        "of what",
        "difference",
        "ns/pixel",
        "without",
        "saves",
        "±",
        "the picture is",
    ]);
    for row in rows {
        let right = |text: String| Cell::new(text).set_alignment(CellAlignment::Right);
        let percent = |part: Option<f64>| right(part.map_or_else(|| "–".into(), |p| format!("{:.1} %", 100.0 * p)));
        let same = if row.max_difference <= row.tolerance { "the same" } else { "NOT the same" };
        out.add_row([
            Cell::new(&row.skip),
            Cell::new(&row.backend),
            right(row.count.to_string()),
            Cell::new(&row.counted),
            right(format!("{:.1e}", row.max_difference)),
            right(format!("{:.0}", row.nanoseconds)),
            right(format!("{:.0}", row.nanoseconds_off)),
            percent(row.saved.map(|r| 1.0 - 1.0 / r.value)),
            percent(row.saved.and_then(|r| Some(r.spread? / (r.value * r.value)))),
            Cell::new(format!("{same}: {}", row.scene)),
        ]);
    }
    out.to_string()
}

/// What a check found, for the terminal.
fn verdict(checked: &Checked) -> String {
    let mut lines: Vec<String> = Vec::new();
    for finding in &checked.worse {
        let (before, now, limit) = (finding.before, finding.now, finding.limit);
        lines.push(match finding.measure {
            Measure::Rectangles => {
                format!(
                    "slower: {}: {now:.2} rectangles; it was {before:.2}, up to {limit:.2} is its spread",
                    finding.row
                )
            }
            Measure::Uniforms => {
                format!(
                    "slower: {}: {now:.3} × uniform:30; it was {before:.3}, up to {limit:.3} is its spread",
                    finding.row
                )
            }
            Measure::Rmse => {
                format!("less right: {}: RMSE {now:.2e}; it was {before:.2e}, the limit is {limit:.2e}", finding.row)
            }
        });
    }
    lines.push(format!(
        "{} rows judged, {} of them by their error only; {} rows of the baseline were not run; {} worse",
        checked.rows,
        checked.untimed,
        checked.missing,
        checked.worse.len()
    ));
    lines.join("\n")
}
