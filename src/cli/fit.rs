//! `glyphlight fit`: the table of linearly transformed cosines.

use super::say;
use crate::brdf::errors::ErrorMap;
use crate::brdf::fit::{FitOptions, Tilt, fit_table};
use crate::brdf::ltc::Table;
use crate::error::Error;
use crate::film::{FilmError, Pending, check_writable};
use comfy_table::{Cell, CellAlignment};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where to write the table; without it only the error map is printed
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Nodes along alpha and along theta
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..=256))]
    size: u32,
    /// Print the error map of the shipped table instead of fitting one
    #[arg(long, conflicts_with = "output")]
    shipped: bool,
}

pub fn run(args: &Args) -> Result<(), Error> {
    args.output.as_deref().map(check_writable).transpose()?;
    let size = args.size as usize;
    let options = FitOptions { alphas: size, thetas: size, ..FitOptions::default() };
    let table = if args.shipped { Table::shipped().clone() } else { fit(&options, "free tilt")? };
    if let Some(path) = &args.output {
        write(path, &table.to_bytes())?;
    }
    // A worse fit on purpose: what the published form of the matrix, its tilt pinned, can do.
    let pinned = fit(&FitOptions { tilt: Tilt::MeanDirection, ..options }, "pinned tilt")?;
    say(
        "Error over alpha × theta, L_k = (∫|fit − f cos|ᵏ / ∫(f cos)ᵏ)^(1/k) above the horizon, on 16 × 16 places between nodes:",
    )?;
    say(report(&[("free tilt", &table), ("tilt pinned to the mean direction", &pinned)]))
}

/// Writes the table, whole or not at all.
fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let io = |source| FilmError::Io { path: path.into(), source };
    Ok(Pending::new(path, |out| out.write_all(bytes).map_err(io))?.keep()?)
}

fn fit(options: &FitOptions, what: &str) -> Result<Table, Error> {
    let shown = Mutex::new(-1_i64);
    let terminal = std::io::stderr().is_terminal();
    let progress = |share: f64| {
        let percent = (share * 100.0) as i64;
        if let Ok(mut last) = shown.lock()
            && terminal
            && percent > *last
        {
            *last = percent;
            eprint!("\rfitting, {what}: {percent} %");
        }
    };
    let table = fit_table(options, &progress)?;
    if terminal {
        eprintln!();
    }
    Ok(table)
}

/// Mean and greatest L1, L2, L3 error of each table.
fn report(tables: &[(&str, &Table)]) -> String {
    let mut out = comfy_table::Table::new();
    out.load_style(comfy_table::presets::NOTHING);
    out.set_header(["table", "mean L1", "mean L2", "mean L3", "max L1", "max L2", "max L3"]);
    for (name, table) in tables {
        let map = ErrorMap::between_nodes(table, 16);
        let cells = map.mean().into_iter().chain(map.max());
        let row = cells.map(|v| Cell::new(format!("{v:.4}")).set_alignment(CellAlignment::Right));
        out.add_row(std::iter::once(Cell::new(name)).chain(row));
    }
    out.to_string()
}
