//! The `glyphlight` command.

use clap::Parser;
use glyphlight::cli::{Cli, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    run(Cli::parse())
}
