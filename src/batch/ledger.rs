//! [`Ledger`]: the manifest of a batch, `manifest.jsonl`, and the lock on its folder.
//!
//! One line of JSON for each finished item ([`Entry`]). While a batch runs, lines are added at the end; when it ends the file is written
//! anew in the order of names, which is the same however often the batch was interrupted. A last line that was cut off by a kill is dropped:
//! its item is rendered again.

use super::BatchError;
use super::job::{Difference, Written};
use crate::digest::digest;
use crate::film::Pending;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The manifest's file.
pub const MANIFEST: &str = "manifest.jsonl";
/// The file that is locked while a batch runs.
const LOCK: &str = ".lock";
/// How the names of files begin that are being written.
pub const TEMPORARY: &str = ".glyphlight-";

/// A finished item.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The name of its picture: its key.
    pub name: String,
    /// The SVG file, as it was named.
    pub file: String,
    /// Digest of the SVG file.
    pub input: String,
    /// Digest of all else that the picture hangs on: template and the files it names, options, what the item has otherwise.
    pub settings: String,
    /// Name and version of the program.
    pub tool: String,
    /// What was written.
    pub pictures: Vec<Written>,
    /// What was left out or simplified.
    pub warnings: Vec<(String, String)>,
    /// The drawing is black, and lit in white.
    pub was_black: bool,
    /// Layers of the light.
    pub layers: usize,
    /// Curves of its outlines.
    pub curves: usize,
    /// How far the masked rectangle is off.
    pub difference: Option<Difference>,
}

/// A line: an entry, or that there is none any more.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Line {
    Entry(Box<Entry>),
    Gone { gone: String },
}

/// What of a folder is done.
#[derive(Debug)]
pub struct Ledger {
    folder: PathBuf,
    entries: BTreeMap<String, Entry>,
    out: Option<File>,
    _lock: Option<File>,
}

impl Ledger {
    /// Takes the folder for a batch, makes it if need be, and removes what a killed batch was writing.
    ///
    /// # Errors
    /// It is in use, belongs to something else, or cannot be written to.
    pub fn open(folder: &Path) -> Result<Self, BatchError> {
        std::fs::create_dir_all(folder).map_err(BatchError::output(folder))?;
        check_own(folder)?;
        let path = folder.join(LOCK);
        let lock = File::create(&path).map_err(BatchError::output(&path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(BatchError::Locked(folder.into())),
            Err(TryLockError::Error(source)) => return Err(BatchError::Output { path, source }),
        }
        sweep(folder)?;
        let (entries, is_whole) = read(folder)?;
        let mut ledger = Self { folder: folder.into(), entries, out: None, _lock: Some(lock) };
        if !is_whole {
            ledger.rewrite()?;
        }
        let path = folder.join(MANIFEST);
        let out = OpenOptions::new().create(true).append(true).open(&path).map_err(BatchError::output(path))?;
        ledger.out = Some(out);
        Ok(ledger)
    }

    /// Looks at a folder; nothing is locked, made or changed.
    ///
    /// # Errors
    /// It belongs to something else, or cannot be read.
    pub fn look(folder: &Path) -> Result<Self, BatchError> {
        let mut entries = BTreeMap::new();
        if folder.exists() {
            check_own(folder)?;
            entries = read(folder)?.0;
        }
        Ok(Self { folder: folder.into(), entries, out: None, _lock: None })
    }

    /// Looks at a folder that no batch is writing to; nothing in it is made or changed.
    ///
    /// # Errors
    /// It is in use, belongs to something else, or cannot be read.
    pub fn look_finished(folder: &Path) -> Result<Self, BatchError> {
        let path = folder.join(LOCK);
        match File::open(&path).map(|lock| lock.try_lock_shared()) {
            Ok(Ok(())) => {}
            Ok(Err(TryLockError::WouldBlock)) => return Err(BatchError::Locked(folder.into())),
            // Copied without it.
            Err(source) if source.kind() == std::io::ErrorKind::NotFound => {}
            Ok(Err(TryLockError::Error(source))) | Err(source) => return Err(BatchError::Output { path, source }),
        }
        Self::look(folder)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The entry of that name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.get(name)
    }

    /// Adds an entry, or replaces that of its name.
    ///
    /// # Errors
    /// What the system says.
    pub fn add(&mut self, entry: Entry) -> Result<(), BatchError> {
        self.append(&Line::Entry(Box::new(entry.clone())))?;
        self.entries.insert(entry.name.clone(), entry);
        Ok(())
    }

    /// Strikes out the entry of that name and removes its pictures: they show what is no longer there.
    ///
    /// # Errors
    /// What the system says.
    pub fn strike(&mut self, name: &str) -> Result<(), BatchError> {
        let Some(entry) = self.entries.remove(name) else { return Ok(()) };
        self.append(&Line::Gone { gone: name.into() })?;
        for picture in entry.pictures.iter().filter(|p| is_below(&p.path)) {
            let path = self.folder.join(&picture.path);
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(BatchError::output(path)(e)),
                _ => {}
            }
        }
        Ok(())
    }

    fn append(&mut self, line: &Line) -> Result<(), BatchError> {
        let path = self.folder.join(MANIFEST);
        let Some(out) = &mut self.out else { return Ok(()) };
        let io = BatchError::output(path);
        let mut text = serde_json::to_string(line).map_err(|e| BatchError::Write(e.to_string()))?;
        text.push('\n');
        out.write_all(text.as_bytes()).map_err(io)
    }

    /// Writes the manifest anew, in the order of names.
    ///
    /// # Errors
    /// What the system says.
    pub fn rewrite(&mut self) -> Result<(), BatchError> {
        let path = self.folder.join(MANIFEST);
        let mut text = String::new();
        for entry in self.entries.values() {
            text += &serde_json::to_string(entry).map_err(|e| BatchError::Write(e.to_string()))?;
            text.push('\n');
        }
        write_whole(&path, text.as_bytes())
    }

    /// Whether all pictures of an entry are there, as they were written.
    pub fn is_there(&self, entry: &Entry) -> bool {
        let holds = |picture: &Written| {
            let bytes = std::fs::read(self.folder.join(&picture.path));
            bytes.is_ok_and(|bytes| digest(&bytes) == picture.digest)
        };
        !entry.pictures.is_empty() && entry.pictures.iter().all(|p| is_below(&p.path) && holds(p))
    }

    /// Removes what workers that were killed have been writing.
    ///
    /// # Errors
    /// What the system says.
    pub fn sweep(&self) -> Result<(), BatchError> {
        sweep(&self.folder)
    }
}

/// Writes a file whole or not at all.
///
/// # Errors
/// What the system says.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), BatchError> {
    let io = |source| crate::film::FilmError::Io { path: path.into(), source };
    Ok(Pending::new(path, |out| out.write_all(bytes).map_err(io))?.keep()?)
}

/// Whether a path of the manifest, which anyone may have edited, stays in the folder.
fn is_below(path: &str) -> bool {
    let parts = Path::new(path).components();
    !path.is_empty() && parts.into_iter().all(|part| matches!(part, std::path::Component::Normal(_)))
}

/// Whether a folder is a batch's.
pub fn is_own(folder: &Path) -> bool {
    folder.join(MANIFEST).is_file() || folder.join(LOCK).is_file() || folder.join(super::parts::PARTS).is_dir()
}

/// Refuses a folder that holds anything and is no batch's.
fn check_own(folder: &Path) -> Result<(), BatchError> {
    if is_own(folder) {
        return Ok(());
    }
    let mut entries = std::fs::read_dir(folder).map_err(BatchError::output(folder))?;
    if entries.next().is_some() { Err(BatchError::Foreign { path: folder.into() }) } else { Ok(()) }
}

/// The entries of a folder's manifest, and whether nothing in it was cut off.
fn read(folder: &Path) -> Result<(BTreeMap<String, Entry>, bool), BatchError> {
    let path = folder.join(MANIFEST);
    let text = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok((BTreeMap::new(), true)),
        Err(e) => return Err(BatchError::output(path)(e)),
    };
    let mut entries = BTreeMap::new();
    let mut is_whole = text.is_empty() || text.ends_with(b"\n");
    for line in text.split(|b| *b == b'\n').filter(|line| !line.is_empty()) {
        match serde_json::from_slice(line) {
            Ok(Line::Entry(entry)) => {
                entries.insert(entry.name.clone(), *entry);
            }
            Ok(Line::Gone { gone }) => {
                entries.remove(&gone);
            }
            Err(_) => is_whole = false,
        }
    }
    Ok((entries, is_whole))
}

/// Removes unfinished files and folders in a folder and below.
fn sweep(folder: &Path) -> Result<(), BatchError> {
    for entry in std::fs::read_dir(folder).map_err(BatchError::output(folder))? {
        let entry = entry.map_err(BatchError::output(folder))?;
        let path = entry.path();
        if entry.file_type().map_err(BatchError::output(&path))?.is_dir() {
            if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
                std::fs::remove_dir_all(&path).map_err(BatchError::output(&path))?;
            } else if entry.file_name() != super::parts::PARTS {
                // Whoever renders a part cleans up there.
                sweep(&path)?;
            }
        } else if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(BatchError::output(path)(e)),
                _ => {}
            }
        }
    }
    Ok(())
}
