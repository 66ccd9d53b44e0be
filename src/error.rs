//! One error for the command line, wrapping one enum per stage.

use std::path::Path;

/// Anything that can go wrong between the command line and the picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file as the user named it.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Text, font, SVG or path data does not make a shape.
    #[error(transparent)]
    Outline(#[from] crate::outline::OutlineError),
    /// An argument does not make a shape.
    #[error("--{argument} {value}: {source}")]
    Argument {
        /// Its name.
        argument: &'static str,
        /// Its value, quoted and shortened.
        value: String,
        /// What is wrong with it.
        source: Box<crate::outline::OutlineError>,
    },
    /// A picture to shine in cannot be used.
    #[error("{path}: {source}")]
    Picture {
        /// The file as the user named it.
        path: String,
        /// What is wrong with it.
        source: crate::scene::texture::TextureError,
    },
    /// A shape has no tree.
    #[error(transparent)]
    Tree(#[from] crate::light::tree::TreeError),
    /// A scene file is wrong.
    #[error(transparent)]
    Scene(#[from] crate::scene::file::SceneError),
    /// There is no such figure or template, or its scene is wrong.
    #[error(transparent)]
    Bundled(#[from] crate::scene::bundled::BundledError),
    /// The sign of a text or SVG cannot be set up.
    #[error(transparent)]
    Preset(#[from] crate::scene::preset::PresetError),
    /// A batch cannot go on.
    #[error(transparent)]
    Batch(#[from] crate::batch::BatchError),
    /// A backend cannot render.
    #[error(transparent)]
    Backend(#[from] crate::backend::BackendError),
    /// The picture cannot be written.
    #[error(transparent)]
    Film(#[from] crate::film::FilmError),
    /// Pictures cannot be compared.
    #[error(transparent)]
    Metrics(#[from] crate::metrics::MetricsError),
    /// A report cannot be written.
    #[error(transparent)]
    Report(#[from] crate::report::ReportError),
    /// The folder of a report cannot be written.
    #[error(transparent)]
    Folder(#[from] crate::report::folder::FolderError),
    /// The table cannot be fitted.
    #[error(transparent)]
    Table(#[from] crate::brdf::ltc::TableError),
    /// A line of a probe file is wrong.
    #[error("{file}, line {line}: {message}")]
    Line {
        /// The file as the user named it.
        file: String,
        /// Counted from 1.
        line: usize,
        /// What is wrong, with key and value.
        message: String,
    },
    /// Arguments that make no sense.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// An input or output error of a file.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.display().to_string(), source }
    }
}
