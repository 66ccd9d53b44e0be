//! SVG files as layers of light: limits, options, errors; `walk.rs` does the drawing.
//!
//! No file but the one given is ever read, and no font but those given is used.

use super::bundled;
use super::document;
use super::embedded;
use super::guard::{GuardError, guarded};
use super::layers::LayerError;
use super::path::PathError;
use super::walk;
use super::{OutlineError, Warning};
use crate::picture::Picture;
use crate::shape::Shape;
use glam::DVec2;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Most layers (colours, gradients, images) a drawing may come to.
pub const MAX_LAYERS: usize = 4096;
/// Most curves all layers together may hold.
pub const MAX_CURVES: usize = 500_000;
/// Seconds after which reading the file is given up.
pub const READ_SECONDS: u64 = 30;
/// Seconds after which drawing is given up.
pub const DRAW_SECONDS: u64 = 600;
/// Most warnings about one file; how many more there are stands in the last.
const MAX_WARNINGS: usize = 200;
/// Bytes of stack for code that recurses into the drawing.
const STACK: usize = 64 << 20;

/// The bytes of a font file (TrueType, OpenType, collections).
pub type FontBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// What one file may cost; what passes a limit is an error that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SvgLimits {
    /// Size of the file, its entities written out, bytes.
    pub bytes: usize,
    /// Nesting of elements, references followed.
    pub depth: usize,
    /// Elements, references followed.
    pub elements: usize,
    /// Paths drawn, those of text and patterns included.
    pub paths: usize,
    /// Curves and lines of all path data together, and of all layers together.
    pub curves: usize,
    /// Pixels along either side of an embedded image.
    pub image_side: u32,
    /// Pixels of all embedded images together.
    pub image_pixels: u64,
}

impl Default for SvgLimits {
    fn default() -> Self {
        Self {
            bytes: document::MAX_BYTES,
            depth: document::MAX_DEPTH,
            elements: document::MAX_ELEMENTS,
            paths: document::MAX_ELEMENTS,
            curves: MAX_CURVES,
            image_side: embedded::MAX_PIXELS,
            image_pixels: 1 << 28,
        }
    }
}

/// How an SVG becomes light.
#[derive(Clone)]
pub struct SvgOptions {
    /// Length of the picture's longer side, metres.
    pub size: f64,
    /// The fonts that text may use; there are no others.
    pub fonts: Vec<FontBytes>,
    /// The family for text that names none, or one that is not given.
    pub font_family: String,
    /// What the file may cost.
    pub limits: SvgLimits,
}

impl fmt::Debug for SvgOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size, fonts, font_family, limits } = self;
        let mut shown = f.debug_struct("SvgOptions");
        shown.field("size", size).field("fonts", &fonts.len());
        shown.field("font_family", font_family).field("limits", limits).finish()
    }
}

impl SvgOptions {
    /// With the bundled fonts.
    pub fn bundled(size: f64) -> Self {
        let fonts = bundled::bundled().iter().map(|f| -> FontBytes { Arc::new(f.bytes) }).collect();
        Self { size, fonts, font_family: bundled::DEFAULT_FAMILY.into(), limits: SvgLimits::default() }
    }
}

impl Default for SvgOptions {
    /// One metre, no fonts.
    fn default() -> Self {
        Self { size: 1.0, fonts: Vec::new(), font_family: String::new(), limits: SvgLimits::default() }
    }
}

/// A drawing as light: layers that do not overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Art {
    /// One for each colour and each gradient or image, in the order in which they first appear.
    pub layers: Vec<ArtLayer>,
    /// Width and height of the picture, metres. It is centred on the origin.
    pub size: DVec2,
    /// What was left out or simplified.
    pub warnings: Vec<Warning>,
}

/// What shines in one colour, gradient or image.
#[derive(Clone, Debug, PartialEq)]
pub struct ArtLayer {
    /// The region; no other layer overlaps it.
    pub shape: Shape,
    /// Linear Rec.709, multiplied by `opacity`; of a picture the mean over the region.
    pub color: [f64; 3],
    /// How much of what lies behind is hidden, 0 to 1; of a picture the mean over the region.
    pub opacity: f64,
    /// The colours from place to place, if they are not one; what lay below translucent paint is mixed in.
    ///
    /// Gradients of random stops are within 1e-4 of their definition in the mean, 2.5e-2 at the corners of the stops (white is 1); where
    /// colours jump, a texel shows both sides. An upright image has its own pixels for texels, up to 2048 along a side.
    pub picture: Option<Arc<Picture>>,
    /// The elements it comes from, for messages.
    pub element: String,
}

/// Why an SVG file gave no light.
#[derive(Debug, thiserror::Error)]
pub enum SvgError {
    /// The size asked for is no size.
    #[error("size {size} m is not a positive number")]
    Size {
        /// The size.
        size: f64,
    },
    /// The file (with its entities written out) is larger than [`document::MAX_BYTES`].
    #[error("{bytes} bytes, more than the limit of {limit}")]
    TooLarge {
        /// Size in bytes.
        bytes: usize,
        /// The limit.
        limit: usize,
    },
    /// The file is compressed.
    #[error("compressed SVG (svgz) is not read: decompress it first")]
    Compressed,
    /// The file is no UTF-8 text.
    #[error("not UTF-8 text from byte {position} on")]
    NotUtf8 {
        /// Offset of the first bad byte.
        position: usize,
    },
    /// Elements are nested deeper than [`document::MAX_DEPTH`].
    #[error("elements nested {depth} deep, more than the limit of {limit}")]
    TooDeep {
        /// The depth found.
        depth: usize,
        /// The limit.
        limit: usize,
    },
    /// More elements than [`document::MAX_ELEMENTS`], references followed.
    #[error("{count} elements, more than the limit of {limit}")]
    TooManyElements {
        /// The number of elements.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// An element is part of what it refers to.
    #[error("{element} refers to itself")]
    Loop {
        /// The element.
        element: String,
    },
    /// An entity stands for more than text.
    #[error("entity \"{name}\" stands for markup, another entity or a file, which is not read")]
    Entity {
        /// The entity's name.
        name: String,
    },
    /// The file is no SVG.
    #[error("not an SVG: {reason}")]
    Syntax {
        /// The parser's words.
        reason: String,
    },
    /// Something outside the file is referred to.
    #[error("{element} refers to \"{href}\": nothing outside the file is read")]
    External {
        /// The element.
        element: String,
        /// What it refers to.
        href: String,
    },
    /// Path data is broken.
    #[error("{element}: {source}")]
    Path {
        /// The element.
        element: String,
        /// The fault.
        source: PathError,
    },
    /// An attribute's value is broken.
    #[error("{element}: attribute {attribute}=\"{value}\" is not valid")]
    Attribute {
        /// The element.
        element: String,
        /// The attribute.
        attribute: String,
        /// Its value.
        value: String,
    },
    /// Paints could not be laid over each other.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// Too many dashes, paths, layers, curves or pixels.
    #[error("{element}: {count} {what}, more than the limit of {limit}")]
    TooMany {
        /// The element, or "drawing".
        element: String,
        /// Of what there are too many.
        what: &'static str,
        /// How many.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// Reading or drawing took too long.
    #[error("{stage} took longer than the limit of {limit} s")]
    TimedOut {
        /// What took too long.
        stage: &'static str,
        /// The limit, seconds.
        limit: u64,
    },
    /// A library failed.
    #[error("{stage} failed: {reason}")]
    Failed {
        /// What failed.
        stage: &'static str,
        /// The reason.
        reason: String,
    },
    /// There is nothing to see.
    #[error("nothing is visible: no element covers any of the picture")]
    NothingVisible,
}

impl SvgError {
    /// The element it is about, where it is about one.
    pub fn element(&self) -> Option<&str> {
        match self {
            Self::Loop { element }
            | Self::External { element, .. }
            | Self::Path { element, .. }
            | Self::Attribute { element, .. }
            | Self::TooMany { element, .. }
            | Self::Layer(
                LayerError::Overlap { element, .. }
                | LayerError::TooManyOperations { element, .. }
                | LayerError::TooManyPieces { element, .. }
                | LayerError::TooManySteps { element, .. },
            ) => Some(element),
            _ => None,
        }
    }
}

/// The drawing in the SVG file `bytes`, called `name` in messages, as layers of light.
///
/// SVG's y runs down, light space's up: the picture is turned over, centred on the origin and scaled so that its
/// longer side is `options.size` metres. What lies outside the picture's frame is cut off.
///
/// # Errors
/// A file that is too large, too deep, broken, refers outside itself or shows nothing; see [`SvgError`].
pub fn svg(bytes: &[u8], name: &str, options: &SvgOptions) -> Result<Art, OutlineError> {
    let named = |source| OutlineError::Svg { name: name.to_owned(), source };
    parse(bytes, options).and_then(ParsedSvg::draw).map_err(named)
}

/// An SVG file that has been read and not been drawn.
pub struct ParsedSvg {
    drawing: walk::Drawing,
    findings: document::Findings,
    size: f64,
    limits: SvgLimits,
}

/// Reads the SVG file `bytes`; the first half of [`svg`].
///
/// # Errors
/// As [`svg`].
pub fn parse(bytes: &[u8], options: &SvgOptions) -> Result<ParsedSvg, SvgError> {
    if !(options.size.is_finite() && options.size > 0.0) {
        return Err(SvgError::Size { size: options.size });
    }
    let SvgOptions { size, limits, .. } = *options;
    let text = document::scan(bytes, &limits)?.to_owned();
    let settings = options.clone();
    run("reading", READ_SECONDS, move || {
        let mut findings = document::inspect(&text, &limits)?;
        let drawing = walk::parse(&text, &settings, &mut findings)?;
        Ok(ParsedSvg { drawing, findings, size, limits })
    })
}

impl ParsedSvg {
    /// Draws it; the second half of [`svg`].
    ///
    /// # Errors
    /// As [`svg`].
    pub fn draw(self) -> Result<Art, SvgError> {
        let Self { drawing, findings, size, limits } = self;
        let mut art = run("drawing", DRAW_SECONDS, move || walk::draw(&drawing, size, findings, &limits))?;
        if art.layers.is_empty() {
            return Err(SvgError::NothingVisible);
        }
        let curves = art.layers.iter().map(|layer| layer.shape.curves().count()).sum();
        for (what, count, limit) in [("layers", art.layers.len(), MAX_LAYERS), ("curves", curves, limits.curves)] {
            if count > limit {
                return Err(SvgError::TooMany { element: "drawing".to_owned(), what, count, limit });
            }
        }
        shorten(&mut art.warnings);
        Ok(art)
    }
}

fn run<T: Send + 'static>(
    stage: &'static str,
    limit: u64,
    work: impl FnOnce() -> Result<T, SvgError> + Send + 'static,
) -> Result<T, SvgError> {
    guarded("svg", STACK, Duration::from_secs(limit), work).unwrap_or_else(|e| {
        Err(match e {
            GuardError::TimedOut => SvgError::TimedOut { stage, limit },
            GuardError::Failed(reason) => SvgError::Failed { stage, reason },
        })
    })
}

/// Drops repeated warnings, and those beyond [`MAX_WARNINGS`].
fn shorten(warnings: &mut Vec<Warning>) {
    let mut seen = std::collections::HashSet::new();
    warnings.retain(|w| seen.insert((w.element.clone(), w.message.clone())));
    if warnings.len() > MAX_WARNINGS {
        let more = warnings.len() - MAX_WARNINGS;
        warnings.truncate(MAX_WARNINGS);
        warnings.push(Warning { element: "drawing".to_owned(), message: format!("{more} more warnings") });
    }
}
