//! [`NewFolder`]: the folder of a comparison, there as a whole or not at all.

use super::FORMAT;
use std::fs::FileType;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The file that says that a folder is a comparison.
const TABLE: &str = "table.json";
/// Files of a comparison.
pub const FILES: [&str; 5] = ["index.html", "table.md", "table.csv", TABLE, "error-scale.png"];
/// Folders of a comparison.
pub const FOLDERS: [&str; 2] = ["pictures", "errors"];
/// How the names of all files in [`FOLDERS`] end.
pub const ENDINGS: [&str; 2] = ["png", "exr"];

/// A folder that is filled under a temporary name beside its place, and vanishes unless it is kept.
#[must_use]
#[derive(Debug)]
pub struct NewFolder {
    folder: TempDir,
    path: PathBuf,
}

/// Why there is no such folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file is in its place.
    #[error("{}: there is a file of that name", .0.display())]
    File(PathBuf),
    /// It is there and isn't empty.
    #[error("{}: the folder is not empty; --force replaces an earlier comparison", .0.display())]
    NotEmpty(PathBuf),
    /// It is there and holds what no comparison wrote.
    #[error(
        "{}: the folder holds {entry:?}, which is no part of a comparison; --force replaces nothing but comparisons",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The first such entry by name.
        entry: String,
    },
    /// It is there, and no comparison says that it is one.
    #[error(
        "{}: the folder has no table.json of a comparison; --force replaces nothing but comparisons",
        .0.display()
    )]
    NoComparison(PathBuf),
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
    pub fn check(path: &Path, force: bool) -> Result<(), FolderError> {
        check(path, force)?;
        let path = place_of(path)?;
        // It has no name: it is gone when its handle is.
        tempfile::tempfile_in(parent_of(&path)).map_err(|e| no_parent(&path, &e))?;
        Ok(())
    }

    /// Begins the folder `path`. A folder that is there must be empty, or an earlier comparison and `force` be true. What
    /// takes long belongs before it: a program that is killed leaves the temporary folder.
    ///
    /// # Errors
    /// Every [`FolderError`].
    pub fn new(path: &Path, force: bool) -> Result<Self, FolderError> {
        check(path, force)?;
        let path = place_of(path)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".glyphlight-");
        // A temporary folder is its owner's alone; this one will have the permissions of any new folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent_of(&path)).map_err(|e| no_parent(&path, &e))?;
        Ok(Self { folder, path })
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

    /// Gives the folder its name. A comparison that was there goes away once the new one is in its place.
    ///
    /// # Errors
    /// What the system says, or that the place has been taken by something else meanwhile.
    pub fn keep(self, force: bool) -> Result<(), FolderError> {
        let Self { folder, path } = self;
        check(&path, force)?;
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
fn check(path: &Path, force: bool) -> Result<(), FolderError> {
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
        return Err(FolderError::NotEmpty(path.into()));
    }
    if let Some(entry) = foreign(path, &entries)? {
        return Err(FolderError::Foreign { path: path.into(), entry });
    }
    if is_table(&path.join(TABLE)) { Ok(()) } else { Err(FolderError::NoComparison(path.into())) }
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

/// The first thing by name that no comparison writes.
fn foreign(path: &Path, entries: &[(String, FileType)]) -> Result<Option<String>, FolderError> {
    for (name, kind) in entries {
        if FOLDERS.contains(&name.as_str()) && kind.is_dir() {
            let ours = |(file, kind): &(String, FileType)| {
                let ending = Path::new(file).extension().and_then(|e| e.to_str());
                kind.is_file() && ending.is_some_and(|e| ENDINGS.contains(&e))
            };
            if let Some((file, _)) = self::entries(&path.join(name))?.iter().find(|entry| !ours(entry)) {
                return Ok(Some(format!("{name}/{file}")));
            }
        } else if !(FILES.contains(&name.as_str()) && kind.is_file()) {
            return Ok(Some(name.clone()));
        }
    }
    Ok(None)
}

/// Whether a file is the table of a comparison, in this format or an earlier one.
fn is_table(file: &Path) -> bool {
    let parsed = std::fs::read(file).ok().and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    parsed.is_some_and(|table| {
        let format = table["format"].as_u64().is_some_and(|format| (1..=u64::from(FORMAT)).contains(&format));
        format && table["program"].as_str().is_some_and(|program| program.starts_with("glyphlight "))
    })
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> FolderError {
    move |source| FolderError::Io { path: path.into(), source }
}
