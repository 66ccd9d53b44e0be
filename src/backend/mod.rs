//! Backends: the same request ([`Settings`]) and the same answer ([`Rendering`]) on CPU and GPU.

pub mod cluster_packets;
pub mod clusters;
pub mod cpu;
pub mod emitter;
pub mod exact;
pub mod features;
pub mod gather;
#[cfg(feature = "gpu")]
pub mod gpu;
mod near;
pub mod packets;
pub mod prepared;
pub mod reference;
mod sight;
mod silhouette;
pub mod skips;
pub mod stage;
mod surfaces;
pub mod technique;
pub mod tile;
mod uncut;
mod visibility;

use crate::film::Film;
use crate::kernel::surface::Rays;
use crate::light::AreaLight;
use crate::scene::{Motion, Scene};
use emitter::{Emitter, Geometry};
use glam::Vec3;
use prepared::Prepared;
pub use skips::Skips;
use std::time::Instant;
use surfaces::Surfaces;
pub use technique::{Horizons, Technique};

/// What to render and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Largest error of the picture's radiance by integration, W·sr⁻¹·m⁻², all lights and lobes together.
    pub tolerance: f32,
    /// How integrals are evaluated.
    pub technique: Technique,
    /// Where specular lobes are clipped, by techniques that know the true horizon.
    pub horizons: Horizons,
    /// What is left out where the scene doesn't need it.
    pub skips: Skips,
}

/// A finished picture and what it cost.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// For each pixel what its integrals were made of ([`Technique::parts`]), mean over its shaded samples; 0 where no surface
    /// is seen.
    pub parts: Vec<f32>,
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
    /// The technique with its parameters.
    pub technique: String,
    /// Stages in order: name and seconds.
    pub stages: Vec<(String, f64)>,
    /// Shaded samples: those that met a surface.
    pub shaded: u64,
    /// Integrals evaluated (one per shaded sample, emission and lobe that was not skipped).
    pub integrals: u64,
    /// What those integrals were made of: tree nodes, edges or samples, as [`Technique::parts`] says.
    pub nodes: u64,
    /// Parts of the shading that no surface needs and no sample paid for: `diffuse`, `specular`, `textures`, `horizons`.
    pub left_out: Vec<String>,
    /// What clusters of lights have cost.
    pub clusters: ClusterStats,
    /// Per light: its name and how many integrals were skipped, by reason.
    pub lights: Vec<LightStats>,
    /// What the trees take.
    pub memory: TreeMemory,
    /// Bytes of the lights' regions (nodes and handles of trees, curves, texels) that shading has loaded, as the shaders count
    /// them; caches aside. The CPU does not count.
    pub loaded: Option<u64>,
    /// Parts that each light was integrated in, one after the other; more than 1 where a GPU's driver ends long loops early. Nodes and
    /// bytes are then those of all parts, which go through some of them again.
    pub windows: u32,
    /// By what the shading was timed.
    pub clock: String,
    /// What was reused from the frames before.
    pub reused: Vec<Reused>,
}

/// What the trees of a scene take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct TreeMemory {
    /// Curves of the outlines that they were built from, cubics and lines.
    pub curves: u64,
    /// Bytes of the trees.
    pub bytes: u64,
}

impl TreeMemory {
    /// Of the emitters that have one.
    fn of(emitters: &[Emitter]) -> Self {
        emitters.iter().fold(Self::default(), |sum, emitter| {
            let bytes = match &emitter.geometry {
                Geometry::Tree(tree) => tree.bytes(),
                Geometry::Mosaic(mosaic) => mosaic.bytes(),
                _ => return sum,
            };
            let curves = emitter.shape.curves().count() as u64;
            Self { curves: sum.curves + curves, bytes: sum.bytes + bytes as u64 }
        })
    }

    /// Bytes for each curve; `None` without trees.
    pub fn per_curve(&self) -> Option<f64> {
        (self.curves > 0).then(|| self.bytes as f64 / self.curves as f64)
    }
}

/// Something that pictures are made with, and that a frame of a sequence may take over from the one before.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Reused {
    /// What it is.
    pub what: String,
    /// How often it was there already.
    pub reused: u64,
    /// How often it was made.
    pub made: u64,
}

impl Stats {
    /// Adds another frame of the same sequence: its times and its counts.
    pub fn add(&mut self, frame: &Self) {
        for (stage, seconds) in &frame.stages {
            match self.stages.iter_mut().find(|(name, _)| name == stage) {
                Some((_, sum)) => *sum += seconds,
                None => self.stages.push((stage.clone(), *seconds)),
            }
        }
        self.shaded += frame.shaded;
        self.integrals += frame.integrals;
        self.nodes += frame.nodes;
        self.loaded = self.loaded.zip(frame.loaded).map(|(a, b)| a + b);
        self.windows = self.windows.max(frame.windows);
        // Left out of the sequence is what is left out of every frame.
        self.left_out.retain(|part| frame.left_out.contains(part));
        self.clusters = self.clusters.plus(frame.clusters);
        for (sum, light) in self.lights.iter_mut().zip(&frame.lights) {
            sum.add(light);
        }
        for (sum, reused) in self.reused.iter_mut().zip(&frame.reused) {
            sum.reused += reused.reused;
            sum.made += reused.made;
        }
    }
}

/// What clusters of lights have cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct ClusterStats {
    /// Clusters visited for whole tiles.
    pub by_tile: u64,
    /// Of these, those whose local expansion about a tile's middle stood for their lights at all of its points, by the plain cosine.
    pub local: u64,
    /// Clusters visited by single points: single lights.
    pub by_point: u64,
    /// Expansions evaluated, each of which stood for all lights of a cluster at a point.
    pub whole: u64,
}

impl ClusterStats {
    const fn plus(self, other: Self) -> Self {
        Self {
            by_tile: self.by_tile + other.by_tile,
            local: self.local + other.local,
            by_point: self.by_point + other.by_point,
            whole: self.whole + other.whole,
        }
    }
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
    /// The light adds too little to be seen in the tile, see [`Skips::under_tolerance`].
    pub under_tolerance: u64,
    /// A cluster stood for the light, or was left out with it.
    pub clustered: u64,
    /// Of those behind: decided for a whole tile.
    pub behind_tile: u64,
    /// Of those below the horizon: decided for a whole tile.
    pub below_tile: u64,
}

impl LightStats {
    /// Integrals skipped for any reason.
    pub const fn skipped(&self) -> u64 {
        self.behind + self.below_horizon + self.no_lobe + self.under_tolerance + self.clustered
    }

    /// Counts another's integrals as this one's.
    fn add(&mut self, other: &Self) {
        self.candidates += other.candidates;
        self.behind += other.behind;
        self.below_horizon += other.below_horizon;
        self.no_lobe += other.no_lobe;
        self.under_tolerance += other.under_tolerance;
        self.clustered += other.clustered;
        self.behind_tile += other.behind_tile;
        self.below_tile += other.below_tile;
    }
}

/// The clock of what runs on the CPU.
const WALL_CLOCK: &str = "wall clock";

/// Most pixels of a picture: some 6 GB of layers.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Why a backend cannot render.
#[derive(Debug, thiserror::Error)]
pub enum BackendError {
    /// The picture has no pixels, too many, or no samples.
    #[error(
        "picture of {width} × {height} with {samples} samples per pixel: each side must be 1 to 16384, both together \
         at most {MAX_PIXELS} pixels, samples 1 to 4096"
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
    /// The Monte Carlo reference cannot sample so.
    #[error(
        "{spp} light samples per pixel until the error is {max_error:?}: must be 1 to {}, the error positive",
        technique::MAX_SPP
    )]
    Sampling {
        /// Asked samples.
        spp: u32,
        /// Asked error.
        max_error: Option<f32>,
    },
    /// A light has no area.
    #[error("light `{light}`: {source}")]
    Light {
        /// Name of the light.
        light: String,
        /// What is wrong with its shape.
        source: crate::light::tree::TreeError,
    },
    /// The yardstick integrates regions of one colour.
    #[error("light `{light}` has a picture, which technique `exact` cannot integrate; `reference` can")]
    Picture {
        /// Name of the light.
        light: String,
    },
    /// A corner of a surface is no place that 32-bit floats can compute with.
    #[error("triangle {triangle}: its corner at {position} is beyond ±{limit:e} m from the camera")]
    Far {
        /// Index of the triangle.
        triangle: usize,
        /// The corner, world space.
        position: glam::DVec3,
        /// Largest distance along an axis.
        limit: f64,
    },
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
    /// The driver ends the loops of shaders after a number of rounds, and what remains of them is too much for it as well.
    #[error(
        "{adapter} ends the loops of a shader early (llvmpipe after 65535 rounds), with the lights in {windows} parts as \
         well; a larger tolerance takes fewer rounds, the CPU backend has no such limit"
    )]
    Rounds {
        /// Adapter name.
        adapter: String,
        /// Parts that the work was in.
        windows: u32,
    },
    /// The technique does not run on this backend.
    #[error("technique `{0}` runs on the CPU only")]
    CpuOnly(&'static str),
}

/// Something that can render a scene.
pub trait Backend {
    /// Begins a sequence of pictures of a scene in motion. Nothing is computed yet.
    ///
    /// # Errors
    /// [`BackendError::CpuOnly`].
    fn begin<'a>(
        &'a self,
        scene: &'a Scene,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Box<dyn Session + 'a>, BackendError>;

    /// Renders `scene`. `stats` are complete even where nothing was shaded.
    ///
    /// # Errors
    /// What is wrong with the settings, the scene or the device.
    fn render(&self, scene: &Scene, settings: &Settings) -> Result<Rendering, BackendError> {
        self.begin(scene, &STILL, settings)?.frame(0.0)
    }
}

/// A sequence of pictures, of which each takes over from the one before what has not changed.
pub trait Session {
    /// Renders the scene as it is at `time`, seconds: to the byte what [`Backend::render`] makes of it after [`Motion::set`].
    ///
    /// # Errors
    /// As [`Backend::render`].
    fn frame(&mut self, time: f64) -> Result<Rendering, BackendError>;

    /// Puts `light` in the place of the scene's `index`th, for the pictures to come: to the byte as if the scene had had it from
    /// the beginning. There is nothing to do where the scene has no such light.
    fn fill(&mut self, index: usize, light: AreaLight);
}

/// Of a single picture.
static STILL: Motion = Motion::STILL;

/// The default technique at the command's size and tolerance.
impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            samples: 4,
            tolerance: 1e-4,
            technique: Technique::Tree,
            horizons: Horizons::Both,
            skips: Skips::default(),
        }
    }
}

impl Settings {
    /// Where specular lobes are clipped: as asked, if the technique can.
    pub const fn horizons(&self) -> Horizons {
        if self.technique.knows_true_horizon() { self.horizons } else { Horizons::Cosine }
    }

    /// Whether a picture can have these settings.
    ///
    /// # Errors
    /// [`BackendError::Size`] or [`BackendError::Tolerance`].
    pub fn check(&self) -> Result<(), BackendError> {
        let Self { width, height, samples, tolerance, .. } = *self;
        let side = 1..=16384;
        let pixels = u64::from(width) * u64::from(height);
        if !side.contains(&width) || !side.contains(&height) || pixels > MAX_PIXELS || !(1..=4096).contains(&samples) {
            return Err(BackendError::Size { width, height, samples });
        }
        if tolerance.is_finite() && tolerance > 0.0 { Ok(()) } else { Err(BackendError::Tolerance(tolerance)) }
    }

    /// Width and height of a pixel where the picture is −1..1. Multiplied with, not divided by, so that every processor finds
    /// the same rays.
    #[inline]
    fn steps(&self) -> [f32; 2] {
        [2.0 / self.width as f32, 2.0 / self.height as f32]
    }

    /// The direction (not unit) of the camera ray through a pixel; `offset` 0..1 from its upper left corner.
    #[inline]
    fn direction(&self, rays: &Rays, x: u32, y: u32, offset: [f32; 2]) -> Vec3 {
        let [step_x, step_y] = self.steps();
        rays.direction((x as f32 + offset[0]) * step_x - 1.0, 1.0 - (y as f32 + offset[1]) * step_y)
    }
}

/// What the surfaces of one pixel reflect, averaged over its samples.
#[derive(Clone, Copy, Debug, Default)]
struct Shaded {
    diffuse: Vec3,
    specular: Vec3,
    /// Fraction of the samples that met a surface.
    coverage: f32,
    /// What their integrals were made of.
    parts: f32,
}

impl Shaded {
    fn scale(&mut self, factor: f32) {
        self.diffuse *= factor;
        self.specular *= factor;
        self.coverage *= factor;
        self.parts *= factor;
    }

    /// Parts for each shaded sample.
    fn parts_per_sample(&self) -> f32 {
        if self.coverage > 0.0 { self.parts / self.coverage } else { 0.0 }
    }
}

/// What one row of pixels has cost.
#[derive(Clone, Debug)]
struct Counters {
    shaded: u64,
    integrals: u64,
    nodes: u64,
    clusters: ClusterStats,
    /// Samples at which the plain cosine and the lobe have a weight.
    weighted: [u64; 2],
    /// For each light, its integrals that clusters handed on.
    handed: Vec<u64>,
    lights: Vec<LightStats>,
}

impl Counters {
    fn new(scene: &Scene) -> Self {
        let lights = scene.lights.iter().map(|l| LightStats { name: l.name.clone(), ..LightStats::default() });
        Self {
            shaded: 0,
            integrals: 0,
            nodes: 0,
            clusters: ClusterStats::default(),
            weighted: [0; 2],
            handed: vec![0; scene.lights.len()],
            lights: lights.collect(),
        }
    }

    fn plus(mut self, other: Self) -> Self {
        self.shaded += other.shaded;
        self.integrals += other.integrals;
        self.nodes += other.nodes;
        self.clusters = self.clusters.plus(other.clusters);
        self.weighted = [0, 1].map(|k| self.weighted[k] + other.weighted[k]);
        self.handed.iter_mut().zip(&other.handed).for_each(|(a, b)| *a += b);
        for (a, b) in self.lights.iter_mut().zip(&other.lights) {
            a.add(b);
        }
        self
    }

    /// Counts the integrals there would be, and what clusters have answered for their lights.
    fn count_candidates(&mut self, prepared: &Prepared) {
        for emitter in &prepared.emitters {
            self.lights[emitter.light].candidates += 2 * self.shaded;
        }
        let weighted = self.weighted.iter().sum::<u64>();
        for emitter in prepared.clustered.emitters() {
            let stats = &mut self.lights[prepared.emitters[emitter].light];
            stats.no_lobe += 2 * self.shaded - weighted;
            stats.clustered += weighted;
        }
        for (stats, handed) in self.lights.iter_mut().zip(&self.handed) {
            stats.clustered -= handed;
        }
    }
}

/// Lays the lights over the shaded surfaces and the background.
fn compose(scene: &Scene, prepared: &Prepared, surfaces: &Surfaces, settings: &Settings, pixels: &[Shaded]) -> Film {
    let sight = sight::see(prepared, surfaces, settings);
    let background = Vec3::from_array(scene.background);
    let mut film = Film::new(settings.width, settings.height);
    for (i, pixel) in pixels.iter().enumerate() {
        let through = sight.through[i];
        film.diffuse[i] = (pixel.diffuse * through).to_array();
        film.specular[i] = (pixel.specular * through).to_array();
        film.emission[i] = sight.emission[i].to_array();
        film.background[i] = (background * ((1.0 - pixel.coverage).max(0.0) * through)).to_array();
        film.matte[i] = 1.0 - through;
    }
    film
}

/// Wall-clock times of stages, in order.
struct Stopwatch {
    since: Instant,
    laps: Vec<(String, f64)>,
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self { since: Instant::now(), laps: Vec::new() }
    }
}

impl Stopwatch {
    /// Ends a stage of which a part, `seconds`, is one of its own: `inner`, and then the `outer` rest.
    #[cfg(feature = "gpu")]
    fn split(&mut self, inner: &str, seconds: f64, outer: &str) {
        self.lap(outer);
        if let Some((_, rest)) = self.laps.last_mut() {
            *rest = (*rest - seconds).max(0.0);
        }
        self.laps.insert(self.laps.len() - 1, (inner.into(), seconds));
    }

    fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        self.laps.push((stage.into(), now.duration_since(self.since).as_secs_f64()));
        self.since = now;
    }
}
