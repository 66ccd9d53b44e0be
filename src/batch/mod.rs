//! Many drawings, one after the other, in one template: what is to be done, what is done, and who does it.
//!
//! ```text
//! files, folders, patterns, lists ─ items ─┬─ plan ─ crew of workers ─ pictures
//!                      manifest of a run ──┘            │
//!                                                       └─ manifest, errors, contact sheet, gallery
//! ```
//!
//! Every item is rendered in a worker, a process of its own that lives on from item to item: one that takes too long or too much memory is
//! killed, whatever it is doing, and replaced. What is done stands in the manifest ([`ledger`]), by digests of what it was made from and
//! of what was written; a picture is written beside its place and renamed. So at any moment the folder holds whole pictures, and a manifest
//! that knows of all of them but those of the last moment.
//!
//! Several machines each render a part of the items into a folder of its own ([`parts`]), as a render farm runs it by a job that [`farm`] writes.

pub mod confine;
pub mod crew;
pub mod errors;
pub mod farm;
pub mod inputs;
pub mod job;
pub mod ledger;
pub mod names;
pub mod numbers;
pub mod parts;
pub mod worker;

use std::path::PathBuf;

/// Why a batch cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// An input cannot be found or read.
    #[error("{}: {message}", path.display())]
    Input {
        /// As given.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A list of items is wrong.
    #[error(transparent)]
    List(#[from] crate::scene::file::SceneError),
    /// The name of a picture is none.
    #[error("{place}: name = {name:?}: {reason}")]
    Name {
        /// The item.
        place: String,
        /// As written.
        name: String,
        /// What is wrong.
        reason: &'static str,
    },
    /// The folder is in use.
    #[error("{}: another batch is writing to this folder", .0.display())]
    Locked(PathBuf),
    /// The folder belongs to something else.
    #[error("{}: the folder is not empty and has no {manifest} of a batch", path.display(), manifest = ledger::MANIFEST)]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// A folder that is to be merged is none of a batch.
    #[error("{}: there is no {manifest} of a batch in it, nor in a folder in it", .0.display(), manifest = ledger::MANIFEST)]
    NoPart(PathBuf),
    /// There is no job for a render farm of that.
    #[error(transparent)]
    Farm(#[from] farm::FarmError),
    /// The folder cannot be written to.
    #[error("{}: {source}", path.display())]
    Output {
        /// File or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The folder cannot be written to, says a worker.
    #[error("{0}")]
    Write(String),
    /// No worker can be started.
    #[error("no worker can be started: {0}")]
    Worker(String),
    /// The contact sheet cannot be made.
    #[error(transparent)]
    Film(#[from] crate::film::FilmError),
}

impl BatchError {
    /// What the system says of something in the folder.
    pub(crate) fn output(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Output { path, source }
    }
}
