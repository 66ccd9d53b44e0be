//! Backends: the same request ([`Settings`]) and the same answer ([`Rendering`]) on CPU and GPU.

pub mod exact;

use crate::film::Film;
use crate::scene::Scene;

/// How a light's integral is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Technique {
    /// The chord–moment tree: error bounded by the tolerance, cost nearly independent of the curve count.
    #[default]
    Tree,
    /// Adaptive contour integration in float64: the yardstick, right to 1e-10 and slow. CPU only.
    Exact,
}

/// What to render and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Largest error per light and lobe in radiance of the picture, W·sr⁻¹·m⁻².
    pub tolerance: f32,
    /// How integrals are evaluated.
    pub technique: Technique,
}

/// A finished picture and what it cost.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// What it cost.
    pub stats: Stats,
}

/// What a rendering cost, and what it skipped.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The adapter and its driver, or the processor's thread count.
    pub device: String,
    /// Stages in order: name and seconds.
    pub stages: Vec<(String, f64)>,
    /// Shaded samples: those that met a surface.
    pub shaded: u64,
    /// Integrals evaluated (one per shaded sample, emission and lobe that was not skipped).
    pub integrals: u64,
    /// Tree nodes visited by those integrals.
    pub nodes: u64,
    /// Per light: its name and how many integrals were skipped, by reason.
    pub lights: Vec<LightStats>,
}

/// Why integrals of one light were skipped.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct LightStats {
    /// The light's name.
    pub name: String,
    /// Integrals the light could have had: shaded samples × emissions × lobes.
    pub candidates: u64,
    /// The shading point is behind the light or in its plane.
    pub behind: u64,
    /// The light is wholly below the horizon.
    pub below_horizon: u64,
    /// The material has no such lobe.
    pub no_lobe: u64,
}

/// Why a backend cannot render.
#[derive(Debug, thiserror::Error)]
pub enum BackendError {
    /// The picture has no pixels, too many, or no samples.
    #[error(
        "picture of {width} × {height} with {samples} samples per pixel: each must be 1 to 16384, samples 1 to 4096"
    )]
    Size {
        /// Asked width.
        width: u32,
        /// Asked height.
        height: u32,
        /// Asked samples per pixel.
        samples: u32,
    },
    /// The tolerance is not a positive number.
    #[error("tolerance {0} is not a positive number")]
    Tolerance(f32),
    /// No adapter of the wanted kind.
    #[error("no GPU adapter: {0}")]
    NoAdapter(String),
    /// The device cannot hold the scene.
    #[error("the scene needs a buffer of {needed} bytes ({what}); adapter {adapter} allows {limit}")]
    TooLarge {
        /// Which buffer.
        what: &'static str,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
        /// Adapter name.
        adapter: String,
    },
    /// The device failed while rendering.
    #[error("GPU: {0}")]
    Device(String),
    /// The technique does not run on this backend.
    #[error("technique `exact` runs on the CPU only")]
    CpuOnly,
}

/// Something that can render a scene.
pub trait Backend {
    /// Renders `scene`. `stats` are complete even where nothing was shaded.
    fn render(&self, scene: &Scene, settings: &Settings) -> Result<Rendering, BackendError>;
}
