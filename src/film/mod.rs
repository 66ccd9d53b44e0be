//! [`Film`]: the picture as linear Rec.709 radiance, in layers, and its files.

pub mod diagram;
pub mod display;
mod exr;
pub mod heat;
mod numbered;
mod png;
pub mod sheet;

pub use display::{Display, ToneMap};
pub use numbered::frame_path;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A picture in linear Rec.709 radiance (W·sr⁻¹·m⁻²), row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Light reflected by the diffuse part of the materials.
    pub diffuse: Vec<[f32; 3]>,
    /// Light reflected by the specular part.
    pub specular: Vec<[f32; 3]>,
    /// The lights themselves, as the camera sees them.
    pub emission: Vec<[f32; 3]>,
    /// The background where nothing hides it.
    pub background: Vec<[f32; 3]>,
    /// The part of the pixel that the lights cover, 0 to 1: the other layers are already reduced by it.
    pub matte: Vec<f32>,
    /// Variance of what the surfaces reflect (diffuse + specular), (W·sr⁻¹·m⁻²)², where the picture was sampled.
    pub variance: Option<Vec<[f32; 3]>>,
}

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The file name ends in nothing we write.
    #[error("{}: a picture ends in .png or .exr", .0.display())]
    Extension(PathBuf),
    /// The picture has no pixels, or a layer doesn't have one value per pixel.
    #[error(
        "{}: a picture of {width} × {height} pixels with layers of {layers:?} pixels; each must be width × height, not 0",
        path.display()
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Pixels of diffuse, specular and emission.
        layers: [usize; 3],
    },
    /// A pixel has no colour (PNG only: EXR keeps it as it is).
    #[error("{}: pixel ({x}, {y}) is {radiance:?}, which isn't a colour", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Column.
        x: u32,
        /// Row from the top.
        y: u32,
        /// What the pixel holds.
        radiance: [f32; 3],
    },
    /// No file can be made where the picture should be.
    #[error("{}: no file can be made in the folder {}: {reason}", path.display(), folder.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The encoder failed.
    #[error("{}: {message}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        message: String,
    },
}

/// A picture format, by the ending of the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit sRGB, as displayed.
    Png,
    /// 32-bit linear, with layers.
    Exr,
}

impl Format {
    /// The format of a file name; upper or lower case.
    ///
    /// # Errors
    /// [`FilmError::Extension`] for any other ending than `.png` and `.exr`. Call it before the rendering to fail early.
    pub fn of(path: &Path) -> Result<Self, FilmError> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            _ => Err(FilmError::Extension(path.into())),
        }
    }
}

impl Film {
    /// A black picture.
    pub fn new(width: u32, height: u32) -> Self {
        let black = vec![[0.0; 3]; width as usize * height as usize];
        Self {
            width,
            height,
            matte: vec![0.0; black.len()],
            diffuse: black.clone(),
            specular: black.clone(),
            emission: black.clone(),
            background: black,
            variance: None,
        }
    }

    /// The sum of the layers.
    pub fn beauty(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.diffuse.len()).map(|i| self.radiance(i))
    }

    /// The sum of the layers at a pixel.
    fn radiance(&self, i: usize) -> [f32; 3] {
        let behind = self.behind(i);
        core::array::from_fn(|c| behind[c] + self.emission[i][c])
    }

    /// What surfaces reflect: the sum of the diffuse and the specular layer.
    pub fn reflected(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.diffuse.iter().zip(&self.specular).map(|(d, s)| core::array::from_fn(|c| d[c] + s[c]))
    }

    /// What is seen of surfaces and background at a pixel.
    fn behind(&self, i: usize) -> [f32; 3] {
        core::array::from_fn(|c| self.diffuse[i][c] + self.specular[i][c] + self.background[i][c])
    }

    /// The picture as a display shows it: 8-bit sRGB, row by row from the top.
    ///
    /// # Errors
    /// [`FilmError::NotFinite`] with `path`, which is only named.
    pub fn displayed(&self, display: &Display, path: &Path) -> Result<Vec<u8>, FilmError> {
        png::displayed(self, display, path)
    }

    /// Writes the picture, as PNG or EXR by the ending of `path`. `display` applies to PNG; EXR holds radiance as it is.
    ///
    /// The file appears whole or not at all: it is written beside the target under another name and then renamed,
    /// over whatever file was there.
    ///
    /// # Errors
    /// Another ending, a picture without pixels, a pixel that is no colour (PNG), or what the system or the encoder says.
    /// Every error names `path`.
    pub fn write(&self, path: &Path, display: &Display) -> Result<(), FilmError> {
        self.encode(path, display)?.keep()
    }

    /// As [`Film::write`], but for the last step: the file has its name from [`Pending::keep`] on. Of several files either
    /// all can be kept or none.
    ///
    /// # Errors
    /// As [`Film::write`].
    pub fn encode(&self, path: &Path, display: &Display) -> Result<Pending, FilmError> {
        let format = Format::of(path)?;
        let pixels = self.width as usize * self.height as usize;
        let layers = [&self.diffuse, &self.specular, &self.emission].map(Vec::len);
        let others = [self.background.len(), self.matte.len(), self.variance.as_ref().map_or(pixels, Vec::len)];
        if pixels == 0 || layers != [pixels; 3] || others != [pixels; 3] {
            return Err(FilmError::Size { path: path.into(), width: self.width, height: self.height, layers });
        }
        Pending::new(path, |out| match format {
            Format::Png => png::encode(self, display, out, path),
            Format::Exr => exr::encode(self, out, path),
        })
    }
}

/// A PNG of 8-bit sRGB pixels, row by row from the top.
///
/// # Errors
/// What the encoder says, where `rgb` isn't `width · height · 3` bytes; with `path`, which is only named.
pub fn png_of(rgb: &[u8], width: u32, height: u32, path: &Path) -> Result<Vec<u8>, FilmError> {
    let mut png = Vec::new();
    if rgb.len() != width as usize * height as usize * 3 {
        return Err(FilmError::Size { path: path.into(), width, height, layers: [rgb.len() / 3; 3] });
    }
    png::encode_rgb(rgb, width, height, &mut png, path)?;
    Ok(png)
}

/// A file that is written whole under a temporary name beside its place, and vanishes unless it is kept.
#[must_use]
#[derive(Debug)]
pub struct Pending {
    file: tempfile::NamedTempFile,
    path: PathBuf,
}

impl Pending {
    /// Lets `fill` write what will be the file `path`.
    ///
    /// # Errors
    /// What `fill` says, or the system; the latter with `path`.
    pub fn new(
        path: &Path,
        fill: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> Result<(), FilmError>,
    ) -> Result<Self, FilmError> {
        let io = |source| FilmError::Io { path: path.into(), source };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".glyphlight-");
        // A temporary file is its owner's alone; a picture has the permissions of any new file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(folder(path)).map_err(|e| no_file(path, e.kind()))?;
        let mut out = BufWriter::new(file.as_file_mut());
        fill(&mut out)?;
        out.flush().map_err(io)?;
        drop(out);
        Ok(Self { file, path: path.into() })
    }

    /// Gives the file its name, over whatever file was there.
    ///
    /// # Errors
    /// What the system says, with the path.
    pub fn keep(self) -> Result<(), FilmError> {
        let Self { file, path } = self;
        file.persist(&path).map_err(|e| FilmError::Io { path, source: e.error })?;
        Ok(())
    }
}

/// Whether a file can be written at `path`; asked before the work that fills it. Nothing is left there.
///
/// # Errors
/// [`FilmError::Folder`], or [`FilmError::Io`] where `path` is a folder.
pub fn check_writable(path: &Path) -> Result<(), FilmError> {
    if path.is_dir() {
        let source = std::io::ErrorKind::IsADirectory.into();
        return Err(FilmError::Io { path: path.into(), source });
    }
    tempfile::tempfile_in(folder(path)).map_err(|e| no_file(path, e.kind()))?;
    Ok(())
}

/// The folder in which a file lies.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn no_file(path: &Path, kind: std::io::ErrorKind) -> FilmError {
    let folder = folder(path);
    let reason = match kind {
        std::io::ErrorKind::NotFound if !folder.exists() => "there is no such folder".into(),
        _ if folder.exists() && !folder.is_dir() => "it is not a folder".into(),
        kind => kind.to_string(),
    };
    FilmError::Folder { path: path.into(), folder: folder.into(), reason }
}
