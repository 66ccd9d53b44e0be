//! Scene files that come with the program: what [`super::figures`] and [`super::templates`] have in common.

use super::file::{Loaded, SceneError};
use super::folder::Folder;
use std::path::Path;

/// A bundled scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bundled {
    /// What it is called, after `figure:` or `template:`.
    pub name: &'static str,
    /// What it shows, one line.
    pub about: &'static str,
    /// The scene file.
    pub text: &'static str,
}

/// Why there is no such scene.
#[derive(Debug, thiserror::Error)]
pub enum BundledError {
    /// None of its kind has this name.
    #[error("{kind}:{name}: there is no such {kind}; there are {list}")]
    Unknown {
        /// `figure` or `template`.
        kind: &'static str,
        /// As it was asked for.
        name: String,
        /// Those that there are.
        list: String,
    },
    /// Its scene file is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// The scene of a name in a folder beside this file.
macro_rules! bundled {
    ($folder:literal, $name:literal, $about:literal) => {
        $crate::scene::bundled::Bundled {
            name: $name,
            about: $about,
            text: include_str!(concat!($folder, "/", $name, ".toml")),
        }
    };
}
pub(super) use bundled;

/// Scenes of one kind.
pub(super) struct Kind {
    /// What stands before the colon.
    pub name: &'static str,
    pub scenes: &'static [Bundled],
    /// Files that the scenes name.
    pub files: &'static [(&'static str, &'static [u8])],
    pub parse: fn(String, &Path, &Folder) -> Result<Loaded, SceneError>,
}

impl Kind {
    /// Loads a scene by its name.
    pub fn load(&self, name: &str) -> Result<Loaded, BundledError> {
        let unknown = || {
            let names: Vec<_> = self.scenes.iter().map(|s| s.name).collect();
            BundledError::Unknown { kind: self.name, name: name.into(), list: names.join(", ") }
        };
        let scene = self.scenes.iter().find(|s| s.name == name).ok_or_else(unknown)?;
        let path = format!("{}:{name}", self.name);
        Ok((self.parse)(scene.text.into(), Path::new(&path), &Folder::bundled(self.files))?)
    }
}
