//! [`NewFolder`]: the folder of a report, there as a whole or not at all.

use std::fs::FileType;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// What a folder holds, so that one that holds anything else is left alone.
#[derive(Debug, PartialEq, Eq)]
pub struct Kind {
    /// What messages call such a report.
    pub name: &'static str,
    /// The file that says that a folder is one: JSON with `format` and `program`.
    pub table: &'static str,
    /// The latest number of its format.
    pub format: u32,
    /// Its files.
    pub files: &'static [&'static str],
    /// Its folders.
    pub folders: &'static [&'static str],
    /// How the names of all files in its folders end.
    pub endings: &'static [&'static str],
}

/// What `glyphlight compare` writes.
pub static COMPARISON: Kind = Kind {
    name: "comparison",
    table: "table.json",
    format: super::FORMAT,
    files: &["index.html", "table.md", "table.csv", "table.json", "error-scale.png"],
    folders: &["pictures", "errors"],
    endings: &["png", "exr"],
};

/// What `glyphlight bench` writes.
pub static BENCHMARK: Kind = Kind {
    name: "benchmark",
    table: "bench.json",
    format: super::bench::FORMAT,
    files: &["bench.json", "bench.csv"],
    folders: &["plots"],
    endings: &["svg", "png"],
};

/// A folder that is filled under a temporary name beside its place, and vanishes unless it is kept.
#[must_use]
#[derive(Debug)]
pub struct NewFolder {
    folder: TempDir,
    path: PathBuf,
    kind: &'static Kind,
}

/// Why there is no such folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file is in its place.
    #[error("{}: there is a file of that name", .0.display())]
    File(PathBuf),
    /// It is there and isn't empty.
    #[error("{}: the folder is not empty; --force replaces an earlier {kind}", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
        /// What it should be.
        kind: &'static str,
    },
    /// It is there and holds what no such report has.
    #[error(
        "{}: the folder holds {entry:?}, which is no part of a {kind}; --force replaces nothing but {kind}s",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What it should be.
        kind: &'static str,
        /// The first such entry by name.
        entry: String,
    },
    /// It is there, and no report says that it is one.
    #[error("{}: the folder has no {table} of a {kind}; --force replaces nothing but {kind}s", path.display())]
    NoReport {
        /// The folder.
        path: PathBuf,
        /// The file that is missing, or isn't what it should be.
        table: &'static str,
        /// What it should be.
        kind: &'static str,
    },
    /// The folder it should lie in cannot be used.
    #[error("{}: no folder can be made in {}: {reason}", path.display(), parent.display())]
    Parent {
        /// The folder.
        path: PathBuf,
        /// Where it should lie.
        parent: PathBuf,
        /// Why not.
        reason: String,
    },
    /// What the system says.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl NewFolder {
    /// Whether [`NewFolder::new`] would succeed now. Leaves nothing behind, not even when it is interrupted.
    ///
    /// # Errors
    /// Every [`FolderError`].
    pub fn check(path: &Path, kind: &'static Kind, force: bool) -> Result<(), FolderError> {
        check(path, kind, force)?;
        let path = place_of(path)?;
        // It has no name: it is gone when its handle is.
        tempfile::tempfile_in(parent_of(&path)).map_err(|e| no_parent(&path, &e))?;
        Ok(())
    }

    /// Begins the folder `path`. A folder that is there must be empty, or an earlier report of its kind
    /// and `force` be true. What
    /// takes long belongs before it: a program that is killed leaves the temporary folder.
    ///
    /// # Errors
    /// Every [`FolderError`].
    pub fn new(path: &Path, kind: &'static Kind, force: bool) -> Result<Self, FolderError> {
        check(path, kind, force)?;
        let path = place_of(path)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".glyphlight-");
        // A temporary folder is its owner's alone; this one will have the permissions of any new folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent_of(&path)).map_err(|e| no_parent(&path, &e))?;
        Ok(Self { folder, path, kind })
    }

    /// Where a file of the folder is written meanwhile; folders on the way are made.
    ///
    /// # Errors
    /// What the system says.
    pub fn place(&self, file: &str) -> Result<PathBuf, FolderError> {
        let path = self.folder.path().join(file);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(io(parent))?;
        }
        Ok(path)
    }

    /// Writes a file of the folder.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, file: &str, bytes: impl AsRef<[u8]>) -> Result<(), FolderError> {
        let path = self.place(file)?;
        std::fs::write(&path, bytes).map_err(io(&self.path.join(file)))
    }

    /// Gives the folder its name. A report that was there goes away once the new one is in its place.
    ///
    /// # Errors
    /// What the system says, or that the place has been taken by something else meanwhile.
    pub fn keep(self, force: bool) -> Result<(), FolderError> {
        let Self { folder, path, kind } = self;
        check(&path, kind, force)?;
        let parent = folder.path().parent().unwrap_or(Path::new("."));
        let old = tempfile::Builder::new().prefix(".glyphlight-").tempdir_in(parent).map_err(io(parent))?;
        let aside = old.path().join("old");
        let replaces = path.exists();
        if replaces {
            std::fs::rename(&path, &aside).map_err(io(&path))?;
        }
        match std::fs::rename(folder.path(), &path) {
            Ok(()) => {
                // The name is another folder's now.
                let _ = folder.keep();
                Ok(())
            }
            Err(source) => {
                if replaces {
                    std::fs::rename(&aside, &path).map_err(io(&path))?;
                }
                Err(FolderError::Io { path, source })
            }
        }
    }
}

/// Where a folder is put: a symbolic link goes on pointing where it does.
fn place_of(path: &Path) -> Result<PathBuf, FolderError> {
    if path.exists() { path.canonicalize().map_err(io(path)) } else { Ok(path.to_path_buf()) }
}

fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn no_parent(path: &Path, error: &std::io::Error) -> FolderError {
    let parent = parent_of(path);
    let reason = if parent.exists() { error.kind().to_string() } else { "there is no such folder".into() };
    FolderError::Parent { path: path.into(), parent: parent.into(), reason }
}

/// Whether a folder may be made, or replaced, at `path`.
fn check(path: &Path, kind: &'static Kind, force: bool) -> Result<(), FolderError> {
    if !path.exists() {
        return Ok(());
    }
    if !path.is_dir() {
        return Err(FolderError::File(path.into()));
    }
    let entries = entries(path)?;
    if entries.is_empty() {
        return Ok(());
    }
    if !force {
        return Err(FolderError::NotEmpty { path: path.into(), kind: kind.name });
    }
    if let Some(entry) = foreign(path, kind, &entries)? {
        return Err(FolderError::Foreign { path: path.into(), kind: kind.name, entry });
    }
    if is_table(&path.join(kind.table), kind) {
        Ok(())
    } else {
        Err(FolderError::NoReport { path: path.into(), table: kind.table, kind: kind.name })
    }
}

/// What a folder holds, by name; a symbolic link is a symbolic link, not what it points to.
fn entries(folder: &Path) -> Result<Vec<(String, FileType)>, FolderError> {
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io(folder))? {
        let entry = entry.map_err(io(folder))?;
        entries.push((entry.file_name().to_string_lossy().into_owned(), entry.file_type().map_err(io(folder))?));
    }
    entries.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(entries)
}

/// The first thing by name that no such report has.
fn foreign(path: &Path, kind: &Kind, entries: &[(String, FileType)]) -> Result<Option<String>, FolderError> {
    for (name, entry) in entries {
        if kind.folders.contains(&name.as_str()) && entry.is_dir() {
            let ours = |(file, entry): &(String, FileType)| {
                let ending = Path::new(file).extension().and_then(|e| e.to_str());
                entry.is_file() && ending.is_some_and(|e| kind.endings.contains(&e))
            };
            if let Some((file, _)) = self::entries(&path.join(name))?.iter().find(|entry| !ours(entry)) {
                return Ok(Some(format!("{name}/{file}")));
            }
        } else if !(kind.files.contains(&name.as_str()) && entry.is_file()) {
            return Ok(Some(name.clone()));
        }
    }
    Ok(None)
}

/// Whether a file is the table of such a report, in this format or an earlier one.
fn is_table(file: &Path, kind: &Kind) -> bool {
    let parsed = std::fs::read(file).ok().and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    parsed.is_some_and(|table| {
        let format = table["format"].as_u64().is_some_and(|format| (1..=u64::from(kind.format)).contains(&format));
        format && table["program"].as_str().is_some_and(|program| program.starts_with("glyphlight "))
    })
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> FolderError {
    move |source| FolderError::Io { path: path.into(), source }
}
