//! [`NewFolder`]: the folder of a comparison, there as a whole or not at all.

use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Files and folders of a comparison; only a folder that holds nothing else is ever replaced.
pub const ENTRIES: [&str; 7] =
    ["index.html", "table.md", "table.csv", "table.json", "error-scale.png", "pictures", "errors"];

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
    /// Begins the folder `path`. A folder that is there must be empty, or hold an earlier comparison and `force` be true.
    ///
    /// # Errors
    /// Every [`FolderError`].
    pub fn new(path: &Path, force: bool) -> Result<Self, FolderError> {
        check(path, force)?;
        // A symbolic link goes on pointing where it does.
        let path = if path.exists() { path.canonicalize().map_err(io(path))? } else { path.to_path_buf() };
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        builder.prefix(".glyphlight-");
        // A temporary folder is its owner's alone; this one will have the permissions of any new folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent).map_err(|e| {
            let reason = if parent.exists() { e.kind().to_string() } else { "there is no such folder".into() };
            FolderError::Parent { path: path.clone(), parent: parent.into(), reason }
        })?;
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

/// Whether a folder may be made, or replaced, at `path`.
fn check(path: &Path, force: bool) -> Result<(), FolderError> {
    if !path.exists() {
        return Ok(());
    }
    if !path.is_dir() {
        return Err(FolderError::File(path.into()));
    }
    let mut names = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io(path))? {
        names.push(entry.map_err(io(path))?.file_name().to_string_lossy().into_owned());
    }
    if !names.is_empty() && !force {
        return Err(FolderError::NotEmpty(path.into()));
    }
    let foreign = names.into_iter().filter(|n| !ENTRIES.contains(&n.as_str())).min();
    foreign.map_or(Ok(()), |entry| Err(FolderError::Foreign { path: path.into(), entry }))
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> FolderError {
    move |source| FolderError::Io { path: path.into(), source }
}
