//! [`Job`]: a batch in parts, as a render farm runs it.
//!
//! Every format says the same: a task for each chunk of items, which renders it into a folder of its own ([`super::parts`]), and when all are
//! done one that gathers them. The farm schedules, repeats and logs; nothing of that is done here.

mod cuecmd;
mod openjd;
mod slurm;
mod words;

use std::ops::RangeInclusive;

/// Most tasks of a job where none are said: of Slurm's arrays as they come, and below the 1024 of an Open Job Description.
const MOST_TASKS: usize = 1000;
/// Items of a task where none are said and there are not too many.
const FEW: usize = 16;

/// What can't be a job.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FarmError {
    /// A word that cannot be written so that every shell and scheduler reads it back.
    #[error("{word:?} {reason}")]
    Word {
        /// As given.
        word: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Too many tasks.
    #[error(
        "--chunk {chunk}: {items} items make {tasks} tasks; {format} takes {most}: from --chunk {least} on it works"
    )]
    Tasks {
        /// Items of a task.
        chunk: usize,
        /// Items.
        items: usize,
        /// Tasks that makes.
        tasks: usize,
        /// Where it is too many.
        format: &'static str,
        /// The most.
        most: usize,
        /// The least chunk that works.
        least: usize,
    },
}

/// How it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Open Job Description, jobtemplate-2023-09, as JSON.
    OpenJd,
    /// A shell script that submits a Slurm job array and a job that follows it.
    Slurm,
    /// A list of commands, one line each, for OpenCue's `cuecmd`; the last step is not in it.
    CueCmd,
}

/// Something that tasks read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// As given.
    pub path: String,
    /// What it is.
    pub kind: InputKind,
}

/// What an input is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputKind {
    /// A file.
    File,
    /// A folder.
    Folder,
    /// A pattern.
    Pattern,
}

/// A batch in parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// The program on the machines that do it.
    pub program: String,
    /// What is rendered.
    pub inputs: Vec<Input>,
    /// The folder of the batch.
    pub output: String,
    /// The template's file, if it is none of the bundled ones.
    pub scene: Option<String>,
    /// All other arguments, each one word.
    pub options: Vec<String>,
    /// How many items there are.
    pub items: usize,
    /// How many a task has.
    pub chunk: usize,
}

impl Job {
    /// Items of a task, where none are said.
    pub fn fitting_chunk(items: usize) -> usize {
        items.div_ceil(MOST_TASKS).max(FEW)
    }

    /// The job in that format.
    ///
    /// # Errors
    /// [`FarmError`].
    pub fn write(&self, format: Format) -> Result<String, FarmError> {
        match format {
            Format::OpenJd => openjd::template(self),
            Format::Slurm => slurm::script(self),
            Format::CueCmd => cuecmd::list(self),
        }
    }

    /// The command of the last step, as a line for a shell.
    ///
    /// # Errors
    /// [`FarmError::Word`].
    pub fn last_command(&self) -> Result<String, FarmError> {
        words::line(&self.merge_command(&self.words(), false))
    }

    /// The items of the tasks, from 1 on.
    fn chunks(&self) -> impl Iterator<Item = RangeInclusive<usize>> {
        let chunk = self.chunk.max(1);
        (0..self.items.div_ceil(chunk)).map(move |task| task * chunk + 1..=((task + 1) * chunk).min(self.items))
    }

    /// Refuses more tasks than a format takes.
    fn check_tasks(&self, format: &'static str, most: usize) -> Result<(), FarmError> {
        let Self { chunk, items, .. } = *self;
        let tasks = self.chunks().count();
        let least = items.div_ceil(most);
        if tasks > most { Err(FarmError::Tasks { chunk, items, tasks, format, most, least }) } else { Ok(()) }
    }

    /// Its paths as given.
    fn words(&self) -> Paths {
        Paths {
            program: self.program.clone(),
            inputs: self.inputs.iter().map(|input| input.path.clone()).collect(),
            output: self.output.clone(),
            scene: self.scene.clone(),
        }
    }

    /// The words of a task.
    fn part_command(&self, paths: &Paths, items: &str, says_openjd: bool) -> Vec<String> {
        let own = ["--items".into(), items.into(), "--part".into()];
        self.command(paths, own, says_openjd)
    }

    /// The words of the last step.
    fn merge_command(&self, paths: &Paths, says_openjd: bool) -> Vec<String> {
        let own = ["--merge".into(), format!("{}/{}", paths.output, super::parts::PARTS)];
        self.command(paths, own, says_openjd)
    }

    fn command(&self, paths: &Paths, own: impl IntoIterator<Item = String>, says_openjd: bool) -> Vec<String> {
        let mut words = vec![paths.program.clone(), "batch".into(), "-o".into(), paths.output.clone()];
        words.extend(own);
        if says_openjd {
            words.push("--openjd".into());
        }
        if let Some(scene) = &paths.scene {
            words.extend(["--scene".into(), scene.clone()]);
        }
        words.extend(self.options.iter().cloned());
        words.push("--".into());
        words.extend(paths.inputs.iter().cloned());
        words
    }
}

/// Paths of a command, or what stands for them.
struct Paths {
    program: String,
    inputs: Vec<String>,
    output: String,
    scene: Option<String>,
}
