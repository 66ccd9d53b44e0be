//! What can be wrong with a scene file.

use crate::outline::OutlineError;
use crate::outline::font::FontError;
use crate::outline::path::PathError;
use crate::outline::text::TextError;
use crate::scene::folder::FolderError;
use crate::scene::mesh::MeshError;
use crate::scene::texture::TextureError;
use std::fmt;
use std::path::PathBuf;

/// A place in a scene file: written as `scene.toml:12: light[0].radiance[1]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The scene file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// The key with the tables it lies in; empty for the file as a whole.
    pub key: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)?;
        if self.key.is_empty() { Ok(()) } else { write!(f, ": {}", self.key) }
    }
}

/// Why a scene file cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file itself cannot be read.
    #[error("scene file: {0}")]
    Read(#[from] FolderError),
    /// The scene file isn't text.
    #[error("{}: not UTF-8 text at byte {at}", file.display())]
    Encoding {
        /// The scene file.
        file: PathBuf,
        /// First byte that isn't UTF-8.
        at: usize,
    },
    /// The scene file isn't TOML.
    #[error("{place}:{column}: {message}")]
    Syntax {
        /// Where.
        place: Place,
        /// Column, from 1, in characters.
        column: usize,
        /// What the parser says.
        message: String,
    },
    /// A key that doesn't exist.
    #[error("{place}: unknown key; known here: {}", known.join(", "))]
    UnknownKey {
        /// The key.
        place: Place,
        /// The keys that may stand there.
        known: Vec<&'static str>,
    },
    /// A key that must be there and isn't.
    #[error("{place}: missing; it holds {wanted}")]
    Missing {
        /// The key.
        place: Place,
        /// What it should hold.
        wanted: &'static str,
    },
    /// A value of the wrong type or out of its range.
    #[error("{place} = {value}: {limit}")]
    Value {
        /// The key.
        place: Place,
        /// The value as written.
        value: String,
        /// What it may be.
        limit: String,
    },
    /// Keys that contradict each other, or a table that doesn't say enough.
    #[error("{place}: {message}")]
    Table {
        /// The table.
        place: Place,
        /// What is wrong.
        message: String,
    },
    /// Something that the scene names cannot be used.
    #[error("{place} = {value}: {source}")]
    Resource {
        /// The key.
        place: Place,
        /// The value as written.
        value: String,
        /// What is wrong with it.
        source: Box<ResourceError>,
    },
}

/// Why a file, path or text that a scene names cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ResourceError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FolderError),
    /// The picture isn't a texture.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// The mesh is broken.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The path data is broken.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The SVG is broken.
    #[error(transparent)]
    Svg(#[from] OutlineError),
    /// The font is broken, or there is none of that name.
    #[error(transparent)]
    Font(#[from] FontError),
    /// The text cannot be set.
    #[error(transparent)]
    Text(#[from] TextError),
}
