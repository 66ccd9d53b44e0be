//! [`Folder`]: the one place from which a scene may read. What a scene names lies in its folder or below, or is an error.

use crate::digest::digest;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A folder, and the right to read in it and below it.
#[derive(Clone, Debug)]
pub struct Folder {
    root: Root,
    /// What has been read here and below, by path, with its digest.
    files: Arc<Mutex<BTreeMap<String, String>>>,
}

#[derive(Clone, Debug)]
enum Root {
    /// Without symbolic links, so that a prefix is proof of being inside.
    Disk(PathBuf),
    /// Files inside the program: name and bytes.
    Bundled(&'static [(&'static str, &'static [u8])]),
}

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The name is empty.
    #[error("the file name is empty")]
    Empty,
    /// The name starts at the root of the file system.
    #[error("{0:?} is an absolute path; files are looked up beside the file that names them")]
    Absolute(String),
    /// The name climbs out of the folder.
    #[error("{0:?} has a `..`; files are looked up beside the file that names them and nowhere above it")]
    Parent(String),
    /// A symbolic link leads out of the folder.
    #[error("{name:?} leads to {}, out of the folder {}", target.display(), root.display())]
    Outside {
        /// The name as given.
        name: String,
        /// Where the link leads.
        target: PathBuf,
        /// The folder.
        root: PathBuf,
    },
    /// There is no such file.
    #[error("there is no file {}", .0.display())]
    Missing(PathBuf),
    /// It is a folder, a device or a pipe.
    #[error("{} is {what}, not a file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// The file is larger than its kind may be.
    #[error("{} has {bytes} bytes; at most {limit} are read", path.display())]
    TooLarge {
        /// The path.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// The system cannot read it.
    #[error("{}: {source}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl Folder {
    /// The folder in which `file` lies.
    ///
    /// # Errors
    /// The folder doesn't exist or cannot be entered.
    pub fn of(file: &Path) -> Result<Self, FolderError> {
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let root = folder.canonicalize().map_err(|e| io(folder, e))?;
        Ok(Self { root: Root::Disk(root), files: Arc::default() })
    }

    /// A folder inside the program: the names of its files and their bytes.
    pub fn bundled(files: &'static [(&'static str, &'static [u8])]) -> Self {
        Self { root: Root::Bundled(files), files: Arc::default() }
    }

    /// The folder in which the file `name` of this folder lies: from there on, nowhere above that.
    ///
    /// # Errors
    /// As [`Folder::read`].
    pub fn beside(&self, name: &str) -> Result<Self, FolderError> {
        match &self.root {
            Root::Disk(root) => Ok(Self { files: Arc::clone(&self.files), ..Self::of(&locate(root, name)?)? }),
            Root::Bundled(_) => Ok(self.clone()),
        }
    }

    /// The bytes of the file `name`, at most `limit` of them. `name` is relative and has no `..`; symbolic links may stay
    /// inside the folder only.
    ///
    /// # Errors
    /// Each way in which that can fail, with the path.
    pub fn read(&self, name: &str, limit: u64) -> Result<Vec<u8>, FolderError> {
        let (path, bytes) = match &self.root {
            Root::Disk(root) => {
                let path = locate(root, name)?;
                let bytes = read(&path, limit)?;
                (path.display().to_string(), bytes)
            }
            Root::Bundled(files) => {
                let found = files.iter().find(|(file, _)| *file == name);
                (name.into(), found.ok_or_else(|| FolderError::Missing(name.into()))?.1.to_vec())
            }
        };
        let digest = digest(&bytes);
        self.files.lock().unwrap_or_else(PoisonError::into_inner).insert(path, digest);
        Ok(bytes)
    }

    /// The digests of all files read so far, here and in the folders below, in the order of their paths.
    pub fn digests(&self) -> Vec<String> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).values().cloned().collect()
    }
}

fn locate(root: &Path, name: &str) -> Result<PathBuf, FolderError> {
    if name.is_empty() {
        return Err(FolderError::Empty);
    }
    for part in Path::new(name).components() {
        match part {
            Component::Normal(_) | Component::CurDir => {}
            Component::ParentDir => return Err(FolderError::Parent(name.into())),
            Component::RootDir | Component::Prefix(_) => return Err(FolderError::Absolute(name.into())),
        }
    }
    let path = root.join(name);
    let target = path.canonicalize().map_err(|e| io(&path, e))?;
    if !target.starts_with(root) {
        return Err(FolderError::Outside { name: name.into(), target, root: root.into() });
    }
    Ok(target)
}

/// The bytes of a file anywhere, at most `limit` of them: for the file that the user names, not for what files name.
///
/// # Errors
/// As [`Folder::read`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, FolderError> {
    let metadata = path.metadata().map_err(|e| io(path, e))?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "a folder" } else { "a device or a pipe" };
        return Err(FolderError::NotAFile { path: path.into(), what });
    }
    let too_large = |bytes| FolderError::TooLarge { path: path.into(), bytes, limit };
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let file = File::open(path).map_err(|e| io(path, e))?;
    // The file may grow while it is read.
    file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| io(path, e))?;
    if bytes.len() as u64 > limit { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

fn io(path: &Path, source: std::io::Error) -> FolderError {
    match source.kind() {
        std::io::ErrorKind::NotFound => FolderError::Missing(path.into()),
        _ => FolderError::Io { path: path.into(), source },
    }
}
