//! `glyphlight batch plan`: the same batch as a job of a render farm.

use super::Args;
use crate::batch::BatchError;
use crate::batch::farm::{FarmError, Format, Input, InputKind, Job};
use crate::batch::inputs;
use crate::cli::scene::{TEMPLATE, open_template};
use crate::cli::{Cli, say};
use crate::error::Error;
use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Command, CommandFactory, ValueEnum};
use std::ffi::OsStr;
use std::path::Path;

/// Arguments that the job has in its own way.
const OWN: [&str; 7] = ["inputs", "output", "scene", "format", "chunk", "program", "backend"];
/// Arguments that no job has.
const NONE: [&str; 10] =
    ["list", "items", "part", "merge", "dry_run", "json", "openjd", "worker", "worker_backend", "help"];

#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    /// Open Job Description (JSON), a script that submits to Slurm, or a list of commands for OpenCue's cuecmd
    #[arg(long, value_enum)]
    format: FormatArg,
    /// Items of a task [default: 16, or as many as make 1000 tasks]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    chunk: Option<u32>,
    /// The program on the machines that render
    #[arg(long, value_name = "COMMAND", default_value = "glyphlight")]
    program: String,
    #[command(flatten)]
    args: Args,
}

/// Formats by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormatArg {
    Openjd,
    Slurm,
    Cuecmd,
}

/// Writes the job to standard output.
pub fn run(plan: &PlanArgs) -> Result<(), Error> {
    let args = &plan.args;
    let Some(output) = &args.output else { return Err(Error::Usage("batch plan needs -o DIR".into())) };
    // What the tasks would refuse is refused here.
    open_template(&args.scene)?;
    super::plan(args, output)?;
    let items = inputs::items(&args.inputs)?.len();
    let kind = |path: &Path| match () {
        () if path.is_dir() => InputKind::Folder,
        () if path.exists() => InputKind::File,
        () => InputKind::Pattern,
    };
    let input = |path: &std::path::PathBuf| Ok(Input { path: word(path.as_os_str())?, kind: kind(path) });
    let scene = word(args.scene.as_os_str())?;
    let is_bundled = scene.starts_with(TEMPLATE);
    let mut options = options()?;
    if is_bundled {
        options.push(format!("--scene={scene}"));
    }
    // Pictures of several machines are those of one only if all have the same backend, and not every machine has a GPU.
    let backend = if args.picture.backend == super::BackendArg::Gpu { "gpu" } else { "cpu" };
    options.push(format!("--backend={backend}"));
    let job = Job {
        program: plan.program.clone(),
        inputs: args.inputs.iter().map(input).collect::<Result<_, BatchError>>()?,
        output: word(output.as_os_str())?,
        scene: (!is_bundled).then_some(scene),
        options,
        items,
        chunk: plan.chunk.map_or_else(|| Job::fitting_chunk(items), |chunk| chunk as usize),
    };
    let format = match plan.format {
        FormatArg::Openjd => Format::OpenJd,
        FormatArg::Slurm => Format::Slurm,
        FormatArg::Cuecmd => Format::CueCmd,
    };
    let text = job.write(format).map_err(BatchError::from)?;
    say(text.trim_end())?;
    if format == Format::CueCmd {
        eprintln!("when all frames are done: {}", job.last_command().map_err(BatchError::from)?);
    }
    Ok(())
}

/// All arguments of this command that tasks are to have as well, one word each.
fn options() -> Result<Vec<String>, Error> {
    let usage = |e: clap::Error| Error::Usage(e.to_string());
    let matches = Cli::command().try_get_matches_from(std::env::args_os()).map_err(usage)?;
    let of = |matches: &ArgMatches, name| matches.subcommand_matches(name).cloned();
    let found = of(&matches, "batch").and_then(|matches| of(&matches, "plan"));
    let command = Cli::command();
    let described = command.find_subcommand("batch").and_then(|command| command.find_subcommand("plan"));
    let (Some(matches), Some(command)) = (found, described) else {
        return Err(Error::Usage("batch plan was not what was called".into()));
    };
    words(command, &matches)
}

fn words(command: &Command, matches: &ArgMatches) -> Result<Vec<String>, Error> {
    let mut words = Vec::new();
    for arg in command.get_arguments() {
        let id = arg.get_id().as_str();
        if OWN.contains(&id) || matches.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let Some(long) = arg.get_long() else { continue };
        if NONE.contains(&id) {
            return Err(Error::Usage(format!(
                "--{long}: a plan is of the whole batch, and its tasks say how far they are"
            )));
        }
        if matches!(arg.get_action(), ArgAction::SetTrue) {
            words.push(format!("--{long}"));
            continue;
        }
        for value in matches.get_raw(id).into_iter().flatten() {
            words.push(format!("--{long}={}", word(value)?));
        }
    }
    Ok(words)
}

fn word(word: &OsStr) -> Result<String, BatchError> {
    let bad = || FarmError::Word { word: word.display().to_string(), reason: "is no text" };
    Ok(word.to_str().ok_or_else(bad)?.into())
}
