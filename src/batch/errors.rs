//! [`Errors`]: the items that gave no picture, `errors.jsonl`.
//!
//! One line of JSON each ([`ItemError`]): added while a batch runs, written anew in the order of numbers when it ends.

use super::BatchError;
use super::inputs::Item;
use super::ledger::write_whole;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Its file.
pub const ERRORS: &str = "errors.jsonl";

/// An item that gave no picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ItemError {
    /// The item's number.
    pub number: usize,
    /// The name that its picture would have.
    pub name: String,
    /// The SVG file.
    pub file: String,
    /// The element of the drawing that it is about.
    pub element: Option<String>,
    /// What is wrong.
    pub reason: String,
}

/// All of them.
#[derive(Debug)]
pub struct Errors {
    path: PathBuf,
    list: BTreeMap<usize, ItemError>,
    out: Option<File>,
}

impl Errors {
    /// Those that an earlier run has left in a folder, of items that are still the same and that `is_kept`.
    pub fn read(folder: &Path, items: &[Item], is_kept: impl Fn(&Item) -> bool) -> Self {
        let path = folder.join(ERRORS);
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        let known = text.lines().filter_map(|line| serde_json::from_str::<ItemError>(line).ok());
        let same = |error: &ItemError| {
            let item = error.number.checked_sub(1).and_then(|index| items.get(index));
            item.is_some_and(|item| item.name == error.name && item.file == Path::new(&error.file) && is_kept(item))
        };
        Self { path, list: known.filter(same).map(|error| (error.number, error)).collect(), out: None }
    }

    /// Their file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The error of an item.
    pub fn of(&self, number: usize) -> Option<&ItemError> {
        self.list.get(&number)
    }

    /// All of them, by number.
    pub fn iter(&self) -> impl Iterator<Item = &ItemError> {
        self.list.values()
    }

    /// Forgets that of an item.
    pub fn remove(&mut self, number: usize) {
        self.list.remove(&number);
    }

    /// Adds one.
    ///
    /// # Errors
    /// What the system says.
    pub fn add(&mut self, error: ItemError) -> Result<(), BatchError> {
        let io = BatchError::output(self.path.clone());
        let line = line(&error)?;
        self.list.insert(error.number, error);
        if self.out.is_none() {
            self.rewrite()?;
            self.out = Some(File::options().append(true).open(&self.path).map_err(io)?);
            return Ok(());
        }
        self.out.as_mut().map_or(Ok(()), |out| out.write_all(line.as_bytes())).map_err(io)
    }

    /// Writes the file anew, in the order of numbers.
    ///
    /// # Errors
    /// What the system says.
    pub fn rewrite(&mut self) -> Result<(), BatchError> {
        self.out = None;
        let lines = self.list.values().map(line).collect::<Result<String, _>>()?;
        write_whole(&self.path, lines.as_bytes())
    }
}

fn line(error: &ItemError) -> Result<String, BatchError> {
    let text = serde_json::to_string(error).map_err(|e| BatchError::Write(e.to_string()))?;
    Ok(text + "\n")
}
