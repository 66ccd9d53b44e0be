//! Parts of a batch, each in a folder of its own, and what becomes of them: one whole.
//!
//! No two processes ever write to one folder, so nothing hangs on locks that reach from machine to machine. What renders a part looks at the
//! whole's manifest, which nobody changes meanwhile, and leaves out what is done. Who merges reads every picture again, holds its bytes
//! against the digest in the part's manifest, and writes it beside its place in the whole and renames it: killed, it is run again.

use super::errors::{Errors, ItemError};
use super::inputs::Item;
use super::ledger::{Entry, Ledger, TEMPORARY, is_own, write_whole};
use super::numbers::Numbers;
use super::{BatchError, names};
use crate::digest::digest;
use std::path::{Path, PathBuf};

/// Folder of the parts, below that of the whole.
pub const PARTS: &str = "parts";

/// The folder of these items of the batch in `whole`.
pub fn folder(whole: &Path, items: &Numbers) -> PathBuf {
    whole.join(PARTS).join(names::plain(&items.to_string()))
}

/// What a part says of an item.
#[derive(Debug)]
pub enum Found<'p> {
    /// It is done.
    Done(&'p Ledger, &'p Entry),
    /// There is no picture of it.
    Failed(&'p ItemError),
}

/// Parts that are finished.
#[derive(Debug)]
pub struct Parts {
    parts: Vec<(Ledger, Errors)>,
}

impl Parts {
    /// Opens what `folders` hold: each is a part, or a folder of parts. The own folder of parts of `whole` need not be there.
    ///
    /// # Errors
    /// A part that is being written, or a folder that is none.
    pub fn open(folders: &[PathBuf], whole: &Path, items: &[Item]) -> Result<Self, BatchError> {
        let mut parts = Vec::new();
        for folder in folders {
            let is_own_parts = *folder == whole.join(PARTS);
            if is_own(folder) {
                parts.push(folder.clone());
                continue;
            }
            let before = parts.len();
            if folder.is_dir() {
                let io = || BatchError::output(folder.clone());
                let entries = std::fs::read_dir(folder).map_err(io())?.collect::<Result<Vec<_>, _>>().map_err(io())?;
                let mut below: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
                below.retain(|path| path.is_dir() && is_own(path));
                below.sort();
                parts.extend(below);
            }
            if parts.len() == before && !is_own_parts {
                return Err(BatchError::NoPart(folder.clone()));
            }
        }
        let open = |part: &PathBuf| Ok((Ledger::look_finished(part)?, Errors::read(part, items, |_| true)));
        Ok(Self { parts: parts.iter().map(open).collect::<Result<_, BatchError>>()? })
    }

    /// How many there are.
    pub const fn count(&self) -> usize {
        self.parts.len()
    }

    /// What the parts say of an item: a picture that `fits` before a failure.
    pub fn find(&self, item: &Item, fits: impl Fn(&Entry) -> bool) -> Option<Found<'_>> {
        let done = |(part, _): &'_ (Ledger, Errors)| part.get(&item.name).is_some_and(&fits);
        if let Some((part, _)) = self.parts.iter().find(|part| done(part)) {
            return part.get(&item.name).map(|entry| Found::Done(part, entry));
        }
        self.parts.iter().find_map(|(_, errors)| errors.of(item.number)).map(Found::Failed)
    }

    /// Whether any part has an entry of that name, fitting or not.
    pub fn names(&self, item: &Item) -> bool {
        self.parts.iter().any(|(part, _)| part.get(&item.name).is_some())
    }
}

/// Copies the pictures of an entry from its part into the whole, and notes it there. `false` where a picture isn't there or isn't what was
/// written; then nothing is noted.
///
/// # Errors
/// The whole cannot be written to.
pub fn take_over(whole: &mut Ledger, part: &Ledger, entry: &Entry, item: &Item) -> Result<bool, BatchError> {
    if !part.is_there(entry) {
        return Ok(false);
    }
    for picture in &entry.pictures {
        let Ok(bytes) = std::fs::read(part.folder().join(&picture.path)) else { return Ok(false) };
        if digest(&bytes) != picture.digest {
            return Ok(false);
        }
        let path = whole.folder().join(&picture.path);
        let folder = path.parent().unwrap_or(whole.folder());
        std::fs::create_dir_all(folder).map_err(BatchError::output(folder))?;
        write_whole(&path, &bytes)?;
    }
    whole.add(Entry { file: item.file.display().to_string(), ..entry.clone() })?;
    Ok(true)
}

/// Removes the whole's own folder of parts, all of it at once as others see it.
///
/// # Errors
/// What the system says.
pub fn remove(whole: &Path) -> Result<(), BatchError> {
    let (from, to) = (whole.join(PARTS), whole.join(format!("{TEMPORARY}{PARTS}")));
    match std::fs::rename(&from, &to) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(e) => Err(BatchError::output(from)(e)),
        Ok(()) => std::fs::remove_dir_all(&to).map_err(BatchError::output(to)),
    }
}
