//! `glyphlight stress`: tries to break a technique.

use super::backend::{BackendArg, Backends};
use super::progress;
use super::{json, say};
use crate::backend::Technique;
use crate::error::Error;
use crate::film::Pending;
use crate::stress::judge::{FLOOR, Judged};
use crate::stress::meter::{Meter, horizons};
use crate::stress::run::{Fail, Findings, Tally, run as seek};
use crate::stress::shrink::shrink;
use comfy_table::{Cell, CellAlignment, Table};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Cases
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=10_u64.pow(12)))]
    count: u64,
    /// Which cases: the same seed gives the same ones, whatever the machine
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Techniques with their parameters, separated by commas
    #[arg(long, default_value = "tree", value_name = "LIST", value_delimiter = ',')]
    technique: Vec<Technique>,
    /// Where to compute: auto takes a hardware GPU if there is one, else the CPU; gpu takes a software driver as well
    #[arg(long, value_enum, default_value_t = BackendArg::Cpu)]
    backend: BackendArg,
    /// Failing cases to make small and show, for each technique
    #[arg(long, default_value_t = 3, value_name = "N")]
    show: usize,
    /// Faults of each technique that are known: so many do not fail the run
    #[arg(long, default_value_t = 0, value_name = "N")]
    allow: u64,
    /// Write all failing cases (1000 at most) to a file of lines for `probe integral`, as they were drawn
    #[arg(long, value_name = "FILE")]
    failures: Option<PathBuf>,
    /// Print one JSON object for each technique instead of tables
    #[arg(long)]
    json: bool,
}

/// Whether no more failed than is known.
pub fn run(args: &Args) -> Result<bool, Error> {
    let backends = Backends::new(args.backend);
    let mut sound = true;
    let mut lines = Vec::new();
    for &technique in &args.technique {
        let meter = backends.meter(technique, horizons(&technique))?;
        let since = Instant::now();
        let found = progress::shown("cases", |report| seek(&*meter, args.seed, args.count, report))?;
        let seconds = since.elapsed().as_secs_f64();
        sound &= found.all.faults() <= args.allow;
        for fail in &found.fails {
            lines.push(json(&fail.case.line(id(args.seed, fail.index).into()))?);
        }
        let small: Vec<_> = worst(&found).into_iter().take(args.show).map(|fail| Small::new(&*meter, fail)).collect();
        if args.json {
            print_json(args, &technique, &found, &small, seconds)?;
        } else {
            print(args, &technique, &found, &small, seconds)?;
        }
    }
    if let Some(path) = &args.failures {
        let write = |out: &mut dyn Write| lines.iter().try_for_each(|line| writeln!(out, "{line}"));
        Pending::new(path, |out| {
            write(out).map_err(|source| crate::film::FilmError::Io { path: path.clone(), source })
        })?
        .keep()?;
    }
    Ok(sound)
}

fn id(seed: u64, index: u64) -> String {
    format!("{seed}:{index}")
}

/// One fault of each kind of place and lobe, the worst kinds of fault first.
fn worst(found: &Findings) -> Vec<&Fail> {
    let mut fails: Vec<_> = found.fails.iter().collect();
    fails.sort_by(|a, b| a.judged.fault.cmp(&b.judged.fault).then(b.judged.error().total_cmp(&a.judged.error())));
    let mut seen = Vec::new();
    fails.retain(|fail| {
        let kind = (fail.judged.fault, fail.kinds.place, fail.kinds.lobe);
        let new = !seen.contains(&kind);
        seen.push(kind);
        new
    });
    fails
}

/// A failing case made small.
struct Small<'a> {
    fail: &'a Fail,
    case: crate::stress::case::Case,
    judged: Judged,
}

impl<'a> Small<'a> {
    fn new(meter: &dyn Meter, fail: &'a Fail) -> Self {
        let (case, judged) = shrink(meter, &fail.case);
        Self { fail, case, judged }
    }
}

fn command(args: &Args, technique: &Technique, small: &Small<'_>) -> Result<String, Error> {
    let line = json(&small.case.line(id(args.seed, small.fail.index).into()))?;
    let backend = if args.backend == BackendArg::Cpu { "" } else { " --backend gpu" };
    Ok(format!("echo '{line}' | glyphlight probe integral /dev/stdin --technique {technique}{backend}"))
}

fn print(args: &Args, technique: &Technique, found: &Findings, small: &[Small<'_>], seconds: f64) -> Result<(), Error> {
    let all = &found.all;
    say(format!(
        "{technique}: seed {}, {} cases in {seconds:.1} s: {} faults; largest error over its tolerance {:.2e} (allowed {FLOOR:.0e})",
        args.seed,
        all.cases,
        all.faults(),
        all.floor,
    ))?;
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header([
        "",
        "",
        "cases",
        "not finite",
        "negative",
        "above 1",
        "beyond",
        "> 0.01",
        "undecided",
        "worst",
        "over tolerance",
        "rms",
    ]);
    let rows = found.kinds.iter().map(|((of, name), tally)| (*of, *name, tally));
    for (of, name, tally) in rows.chain([("", "all", all)]) {
        let Tally { cases, not_finite, negative, above_one, beyond, coarse, undecided, worst, floor, .. } = *tally;
        let counts = [cases, not_finite, negative, above_one, beyond, coarse, undecided].map(|n| n.to_string());
        let errors = [worst, floor, tally.rms()].map(|e| format!("{e:.1e}"));
        let right = |text: &String| Cell::new(text).set_alignment(CellAlignment::Right);
        let names = [Cell::new(of), Cell::new(name)];
        table.add_row(names.into_iter().chain(counts.iter().chain(&errors).map(right)));
    }
    say(table)?;
    for small in small {
        let Judged { value, exact, fault, .. } = small.judged;
        let fault = fault.map_or_else(String::new, |fault| format!("{fault:?}"));
        let Fail { index, kinds, judged, .. } = small.fail;
        let names = kinds.names().map(|(_, name)| name).join(", ");
        say(format!(
            "\ncase {index} ({names}): {} for {}; made small: {fault}, {value} for {exact}",
            judged.value, judged.exact
        ))?;
        say(command(args, technique, small)?)?;
    }
    Ok(())
}

#[derive(Serialize)]
struct Output<'a> {
    technique: String,
    seed: u64,
    seconds: f64,
    floor_allowed: f64,
    all: Tally,
    rms: f64,
    kinds: Vec<Row<'a>>,
    fails: Vec<FailRow>,
}

#[derive(Serialize)]
struct Row<'a> {
    of: &'a str,
    name: &'a str,
    #[serde(flatten)]
    tally: Tally,
    rms: f64,
}

#[derive(Serialize)]
struct FailRow {
    index: u64,
    kinds: [&'static str; 4],
    fault: Option<crate::stress::judge::Fault>,
    value: f64,
    exact: f64,
    command: String,
}

fn print_json(
    args: &Args,
    technique: &Technique,
    found: &Findings,
    small: &[Small<'_>],
    seconds: f64,
) -> Result<(), Error> {
    let row = |((of, name), tally): (&(&'static str, &'static str), &Tally)| Row {
        of,
        name,
        tally: *tally,
        rms: tally.rms(),
    };
    let fail = |small: &Small<'_>| {
        Ok(FailRow {
            index: small.fail.index,
            kinds: small.fail.kinds.names().map(|(_, name)| name),
            fault: small.judged.fault,
            value: small.judged.value,
            exact: small.judged.exact,
            command: command(args, technique, small)?,
        })
    };
    say(json(&Output {
        technique: technique.to_string(),
        seed: args.seed,
        seconds,
        floor_allowed: FLOOR,
        all: found.all,
        rms: found.all.rms(),
        kinds: found.kinds.iter().map(row).collect(),
        fails: small.iter().map(fail).collect::<Result<_, Error>>()?,
    })?)
}
