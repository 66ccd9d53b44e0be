//! [`Comparison`]: techniques side by side on one scene, and the files it is written as.
//!
//! # Schema of `table.json`
//! The fields of [`Comparison`] under their own names, in a format that [`FORMAT`] numbers:
//!
//! ```text
//! { "format": 1, "program": "glyphlight 0.1.0", "date": "2026-01-31T12:00:00Z",
//!   "machine": { "processor", "threads", "system" },
//!   "scene": { "name", "source" },
//!   "settings": { "width", "height", "samples", "tolerance", "exposure", "tone_map", "repeat" },
//!   "rectangles": [ { "backend", "seconds", "ms_per_megapixel" } ],
//!   "error_scale": { "end", "linear" } or null,
//!   "blocks": [ { "name", "about",
//!                 "rows": [ { "technique", "backend", "device", "runs", "seconds", "prepare_seconds", "ms_per_megapixel",
//!                             "rectangles" (or null), "yardstick" (null: it is one), "picture", "error_map" (or null),
//!                             "errors" (null where there is no yardstick):
//!                               { "mae", "rmse", "rmse_of_peak" (or null), "max", "p999", "energy_ratio" (or null) },
//!                             "flip" (null where there is no yardstick), "noise" (null but for Monte Carlo),
//!                             "yardstick_noise", "rmse_less_noise" (null but with a Monte Carlo yardstick) } ] } ],
//!   "left_out": [ { "technique", "reason" } ] }
//! ```
//!
//! Times are wall-clock seconds, errors radiance in W·sr⁻¹·m⁻² ([`crate::metrics`] defines each figure), files relative to
//! the folder. `table.csv` has the same rows, one line each, all blocks after each other under one line of names; numbers in
//! full, nothing where JSON has null (RFC 4180). `table.md` is for people: three digits.

pub mod bench;
pub mod check;
pub mod folder;
pub mod gallery;
pub mod page;
pub mod plot;
pub mod scale;
pub mod skips;
pub mod statistics;
pub mod table;

use crate::metrics::Figures;
use scale::ErrorScale;
use serde::Serialize;

/// The number of the schema above; any change to it but an added field raises it.
pub const FORMAT: u32 = 1;

/// Techniques side by side on one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// [`FORMAT`].
    pub format: u32,
    /// Name and version of the program.
    pub program: String,
    /// When it began, UTC, ISO 8601.
    pub date: String,
    /// Where it ran.
    pub machine: Machine,
    /// What was rendered.
    pub scene: SceneSource,
    /// How it was rendered.
    pub settings: PictureSettings,
    /// What the scene costs with each light replaced by its bounding rectangle, per backend.
    pub rectangles: Vec<RectangleTime>,
    /// The one colour scale of all error maps; nothing where there are none.
    pub error_scale: Option<ErrorScale>,
    /// One block per question: the error of the integral, the error of integral and fit together.
    pub blocks: Vec<Block>,
    /// Techniques that were asked for and could not be shown.
    pub left_out: Vec<LeftOut>,
}

/// The computer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Model of the processor.
    pub processor: String,
    /// Threads the CPU backend used.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// The scene as the user gave it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SceneSource {
    /// The file, `figure:…`, or the art of the sign.
    pub name: String,
    /// The text of the scene file, or the arguments that make up the sign.
    pub source: String,
}

/// What all pictures have in common.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Tolerance of the tree, W·sr⁻¹·m⁻².
    pub tolerance: f32,
    /// Exposure of the displayed pictures, stops.
    pub exposure: f64,
    /// Their tone map.
    pub tone_map: String,
    /// Most runs of a technique.
    pub repeat: u32,
}

/// The time of a scene whose lights are rectangles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RectangleTime {
    /// `cpu` or `gpu`.
    pub backend: String,
    /// Median time of shading.
    pub seconds: f64,
    /// Milliseconds per million pixels.
    pub ms_per_megapixel: f64,
}

/// Rows that answer one question.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Block {
    /// A word for file and column names: `integral` or `total`.
    pub name: String,
    /// What is compared with what, one sentence.
    pub about: String,
    /// In the order in which the techniques were asked for.
    pub rows: Vec<Row>,
}

impl Block {
    /// The heading: the name, capitalised.
    fn title(&self) -> String {
        let mut letters = self.name.chars();
        letters
            .next()
            .map_or_else(String::new, |first| first.to_uppercase().chain(letters).chain(" error".chars()).collect())
    }
}

/// One technique.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// With its parameter, as the command line takes it.
    pub technique: String,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// Adapter, or number of threads.
    pub device: String,
    /// Runs that the medians are of.
    pub runs: usize,
    /// Median time of shading the picture: camera rays, surfaces, integrals.
    pub seconds: f64,
    /// Median time of all that comes before: trees, masks, hierarchies, buffers.
    pub prepare_seconds: f64,
    /// Milliseconds of shading per million pixels, all samples of a pixel together.
    pub ms_per_megapixel: f64,
    /// Time of shading over that of the same scene with rectangles for lights, by the tree, on the same backend.
    pub rectangles: Option<f64>,
    /// What it was compared with.
    pub yardstick: Option<String>,
    /// Errors of the reflected radiance.
    pub errors: Option<Figures>,
    /// Mean FLIP of the displayed picture.
    pub flip: Option<f64>,
    /// Standard error of the picture itself, root mean square, W·sr⁻¹·m⁻²: errors below that of their yardstick say nothing.
    pub noise: Option<f64>,
    /// [`Row::noise`] of the yardstick: what the errors hold beside those of the technique.
    pub yardstick_noise: Option<f64>,
    /// The RMSE with that noise taken off, [`crate::metrics::less_noise`], W·sr⁻¹·m⁻².
    pub rmse_less_noise: Option<f64>,
    /// File of the picture.
    pub picture: String,
    /// File of the error map.
    pub error_map: Option<String>,
}

/// A technique without a picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
pub struct LeftOut {
    /// With its parameter.
    pub technique: String,
    /// Why.
    pub reason: String,
}

/// Why a report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The encoder of JSON failed.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// A file that should be a benchmark is none.
    #[error("not a benchmark: {0}")]
    NoBenchmark(serde_json::Error),
    /// A benchmark of another version of the program.
    #[error("a benchmark of format {found}; this program knows {known}")]
    Format {
        /// What the file says.
        found: u32,
        /// What there is.
        known: u32,
    },
    /// A plot cannot be drawn.
    #[error("plot {plot}: {message}")]
    Plot {
        /// Which.
        plot: String,
        /// What the library says.
        message: String,
    },
}
