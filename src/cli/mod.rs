//! The command line: one file per verb; the only folder that prints.
//!
//! Exit codes: 0 done; 1 where `stress` has broken something, `bench --check` finds that something got worse or an item of `batch` failed; 2 for an error,
//! which is one message on standard error and leaves no file behind.

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod backend;
mod batch;
mod bench;
mod compare;
mod display;
mod fit;
mod frames;
mod inspect;
mod lights;
mod machine;
mod picture;
mod probe;
mod progress;
mod render;
mod scene;
mod stages;
mod stress;
mod technique;
mod values;

use crate::error::Error;
use clap::{Parser, Subcommand};
pub use probe::Case;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::ExitCode;

/// Text and SVG art as area lights.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Render a scene file, a text or an SVG as lights
    Render(Box<render::Args>),
    /// Render one scene by every technique and show what each costs and how wrong it is
    Compare(Box<compare::Args>),
    /// Render many SVGs as lights of one scene, and go on where an earlier run was interrupted
    Batch(Box<batch::Verb>),
    /// Time against error of every technique; --check holds a run against an earlier one
    Bench(Box<bench::Args>),
    /// Show what a font's text, an SVG or path data becomes: contours, areas, tree
    Inspect(Box<inspect::Args>),
    /// The light meter: values without a picture
    Probe(probe::Args),
    /// Try to break a technique, and show the smallest cases that do
    Stress(stress::Args),
    /// Fit the table of linearly transformed cosines
    Fit(fit::Args),
}

/// Runs the command and gives its exit code.
pub fn run(cli: Cli) -> ExitCode {
    let done = match cli.verb {
        Verb::Render(args) => render::run(&args).map(|()| true),
        Verb::Compare(args) => compare::run(&args).map(|()| true),
        Verb::Batch(args) => batch::run(&args),
        Verb::Bench(args) => bench::run(&args),
        Verb::Inspect(args) => inspect::run(&args).map(|()| true),
        Verb::Probe(args) => probe::run(&args).map(|()| true),
        Verb::Stress(args) => stress::run(&args),
        Verb::Fit(args) => fit::run(&args).map(|()| true),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        // Whoever reads our output has seen enough.
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// One line on standard error for each warning.
fn warn<T: std::fmt::Display>(warnings: impl IntoIterator<Item = T>) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// A value as one line of JSON.
fn json(value: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string(value).map_err(|e| Error::Usage(format!("JSON: {e}")))
}

/// Writes a line to standard output; a closed pipe is an error, not a panic.
fn say(line: impl std::fmt::Display) -> Result<(), Error> {
    let stdout = Path::new("standard output");
    writeln!(std::io::stdout().lock(), "{line}").map_err(|source| Error::io(stdout, source))
}

/// The name of a light on one line of a table, shortened.
fn label(name: &str) -> String {
    const SHOWN: usize = 40;
    let more = if name.chars().nth(SHOWN).is_some() { "…" } else { "" };
    let shown: String = name.chars().take(SHOWN).collect();
    format!("{}{more}", shown.escape_debug())
}

/// Reads a file or pipe the user named, up to a limit.
fn read(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let io = |source| Error::io(path, source);
    let file = File::open(path).map_err(io)?;
    if file.metadata().map_err(io)?.is_dir() {
        return Err(io(std::io::ErrorKind::IsADirectory.into()));
    }
    let mut bytes = Vec::new();
    file.take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limit {
        return Err(Error::Usage(format!("{}: more than {limit} bytes", path.display())));
    }
    Ok(bytes)
}
