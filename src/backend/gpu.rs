//! The GPU backend: the rasteriser finds the triangle that each sample sees, a compute pass shades it. The shaders are the
//! WGSL twins of [`crate::kernel`], in f32 throughout. This folder alone names wgpu.
//!
//! Large pictures are drawn in tiles, so that no buffer but the scene's own grows with them.

mod boxes;
mod buffers;
mod clock;
mod device;
pub mod layout;
mod order;
mod pipelines;
pub mod source;
mod tiles;
mod window;

use super::features::Features;
use super::prepared::Prepared;
use super::stage::{Kept, Ready, Reuse, Stage};
use super::{
    Backend, BackendError, ClusterStats, Counters, LightStats, Rendering, Session, Settings, Shaded, Stats, Stopwatch,
    TreeMemory,
};
use crate::light::AreaLight;
use crate::scene::{Motion, Scene};
use boxes::Boxes;
use buffers::{Readback, SceneBuffers, storage, target};
use clock::Clock;
use device::Device;
use glam::UVec2;
use layout::{Emitters, Frame, MeterPoint, Reading};
use order::Ordered;
use pipelines::{Layouts, Pipelines};
use source::SKIP_ROWS;
use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};
use tiles::{Painter, Tile, Work};
use window::Windows;

/// Counters of each light: behind, below the horizon, without such a lobe, under the tolerance; of the first two those decided
/// by tile; handed on by clusters. After all lights, of the clusters: visited for tiles, lights that points decided about, expansions;
/// points that clusters light, and those with a weight of the plain cosine and of the lobe; clusters whose local expansion stands for
/// them.
const SKIP_REASONS: usize = 7;
/// Points of the light meter in a workgroup.
const METER_GROUP: usize = 64;

/// Which adapters will do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterChoice {
    /// Hardware only.
    Hardware,
    /// Hardware if there is any, else software.
    Any,
}

/// Renders on a GPU.
#[derive(Debug)]
pub struct GpuBackend {
    device: Device,
    layouts: Layouts,
    pipelines: Mutex<HashMap<Features, Pipelines>>,
    clock: OnceLock<Clock>,
    /// To begin with.
    windows: Windows,
}

impl GpuBackend {
    /// Opens the best adapter of the wanted kind.
    ///
    /// # Errors
    /// [`BackendError::NoAdapter`] where there is none, or none that will do.
    pub fn new(choice: AdapterChoice) -> Result<Self, BackendError> {
        let device = Device::open(choice)?;
        let layouts = Layouts::new(&device);
        device.check()?;
        Ok(Self { device, layouts, pipelines: Mutex::default(), clock: OnceLock::new(), windows: Windows::new(1) })
    }

    /// The same, with each light integrated in so many parts, one after the other, from the start, and in more where the driver ends
    /// loops early; as many of them as are of use, for techniques that sum over curves. Their number changes no value beyond its tolerance.
    #[must_use]
    pub fn in_windows(self, windows: u32) -> Self {
        Self { windows: Windows::new(windows), ..self }
    }

    /// Adapter, driver and interface.
    pub fn device(&self) -> &str {
        &self.device.name
    }

    /// Compiled once per combination of features; and whether they were compiled before.
    fn pipelines(&self, features: Features) -> Result<(Pipelines, bool), BackendError> {
        let mut known = self.pipelines.lock().map_err(|e| BackendError::Device(e.to_string()))?;
        let are_known = known.contains_key(&features);
        let pipelines = known.entry(features).or_insert_with(|| self.layouts.pipelines(&self.device, features)).clone();
        self.device.check()?;
        Ok((pipelines, are_known))
    }

    /// What passes are timed by, found out once.
    fn clock(&self) -> Result<&Clock, BackendError> {
        match self.clock.get() {
            Some(clock) => Ok(clock),
            None => {
                let clock = Clock::of(&self.device)?;
                Ok(self.clock.get_or_init(|| clock))
            }
        }
    }

    /// The light meter: both integrals of single emissions at `points`, by the shaders that shade pictures.
    ///
    /// # Errors
    /// [`BackendError::CpuOnly`], [`BackendError::TooLarge`], [`BackendError::Rounds`] or [`BackendError::Device`].
    pub fn measure(&self, prepared: &Prepared, points: &[MeterPoint]) -> Result<Vec<Reading>, BackendError> {
        if prepared.technique.is_cpu_only() {
            return Err(BackendError::CpuOnly(prepared.technique.name()));
        }
        if points.is_empty() {
            return Ok(Vec::new());
        }
        let device = &self.device;
        let (boxes, emitters) = (Boxes::new(&[]), Emitters::new(&prepared.emitters));
        let ordered = Ordered::single(&emitters);
        let contents = buffers::contents(None, &boxes, &emitters, &ordered, Kept::default());
        let buffers = SceneBuffers::new(device, &contents)?;
        let mut windows = self.windows.of_use(&emitters, &prepared.technique);
        let mut readings = self.read(prepared, &buffers, points, windows)?;
        loop {
            let cut: Vec<usize> = (0..points.len()).filter(|&i| readings[i].cut > 0).collect();
            if cut.is_empty() {
                return Ok(readings);
            }
            windows = windows.more(device, &emitters, &prepared.technique)?;
            let again: Vec<MeterPoint> = cut.iter().map(|&i| points[i]).collect();
            for (i, reading) in cut.into_iter().zip(self.read(prepared, &buffers, &again, windows)?) {
                readings[i] = reading;
            }
        }
    }

    /// Reads points, whether or not the driver ends loops early.
    fn read(
        &self,
        prepared: &Prepared,
        buffers: &SceneBuffers,
        points: &[MeterPoint],
        windows: Windows,
    ) -> Result<Vec<Reading>, BackendError> {
        let device = &self.device;
        let scene = self.layouts.bind_scene(device, buffers);
        let bytes = points.len() as u64 * size_of::<Reading>() as u64;
        let readings = target(device, "readings", bytes)?;
        let meter = self.layouts.bind_meter(device, &storage(device, "points", points)?, &readings);
        let features = Features { windows: windows.are_many(), ..prepared.features };
        let pipeline = self.layouts.meter_pipeline(device, features);
        device.check()?;
        for window in windows.all() {
            let frame = Frame { window, ..Frame::of(&prepared.technique) };
            device.queue.write_buffer(&buffers.frame, 0, bytemuck::bytes_of(&frame));
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &scene, &[]);
            pass.set_bind_group(1, &meter, &[]);
            pass.dispatch_workgroups(points.len().div_ceil(METER_GROUP) as u32, 1, 1);
            drop(pass);
            device.queue.submit([encoder.finish()]);
        }
        Readback::new(device, bytes).read(device, &readings, points.len() as u64, <[Reading]>::to_vec)
    }
}

impl Backend for GpuBackend {
    fn begin<'a>(
        &'a self,
        scene: &'a Scene,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Box<dyn Session + 'a>, BackendError> {
        if settings.technique.is_cpu_only() {
            return Err(BackendError::CpuOnly(settings.technique.name()));
        }
        Ok(Box::new(GpuSession { backend: self, stage: Stage::new(scene, motion, *settings), drawn: None }))
    }
}

/// A sequence of pictures on a GPU.
struct GpuSession<'a> {
    backend: &'a GpuBackend,
    stage: Stage<'a>,
    drawn: Option<Drawn<'a>>,
}

/// What the last picture was drawn with.
struct Drawn<'a> {
    boxes: Boxes,
    emitters: Emitters,
    painter: Painter<'a>,
}

impl Session for GpuSession<'_> {
    fn frame(&mut self, time: f64) -> Result<Rendering, BackendError> {
        let Self { backend, stage, drawn } = self;
        let backend = *backend;
        let settings = &stage.settings().clone();
        let mut watch = Stopwatch::default();
        let mut reuse = Reuse::default();
        let (scene, Ready { prepared, surfaces, kept, .. }) = stage.at(time, &mut watch, &mut reuse)?;
        let (prepared, kept) = (&*prepared, *kept);
        let (before, painter) = drawn.take().map(|d| ((d.boxes, d.emitters), d.painter)).unzip();
        let (boxes, emitters) = before.unzip();
        let boxes = boxes.filter(|_| kept.surfaces).unwrap_or_else(|| Boxes::new(&prepared.triangles));
        watch.lap("boxes");
        let (_, are_known) = backend.pipelines(prepared.features)?;
        reuse.count("pipelines", are_known);
        let clock = backend.clock()?;
        watch.lap("pipelines");
        let emitters = match emitters.filter(|_| kept.regions) {
            Some(mut emitters) => {
                emitters.moved(&prepared.emitters);
                emitters
            }
            None => Emitters::new(&prepared.emitters),
        };
        let ordered = Ordered::new(prepared, &emitters);
        let frame = Frame {
            rays: prepared.rays,
            picture: UVec2::new(settings.width, settings.height),
            steps: settings.steps().into(),
            tolerance: settings.tolerance,
            emitters: ordered.boxes.len() as u32,
            boxes: boxes.boxes.len() as u32,
            lights: scene.lights.len() as u32,
            clusters: ordered.clusters.len() as u32,
            per_metre: prepared.clustered.tree.per_metre,
            ..Frame::of(&settings.technique)
        };
        let counters = u64::from(SKIP_ROWS) * (scene.lights.len() as u64 + 1) * SKIP_REASONS as u64;
        let triangles = prepared.triangles.len() as u32;
        let contents = buffers::contents(Some(prepared), &boxes, &emitters, &ordered, kept);
        let painter = painter.filter(|painter| painter.serves(&frame, triangles, counters));
        buffers::count(&contents, painter.is_some(), &mut reuse);
        let mut painter = match painter {
            Some(mut painter) => {
                painter.renew(&contents)?;
                painter
            }
            None => Painter::new(&backend.device, &backend.layouts, clock, &contents, &frame, triangles, counters)?,
        };
        backend.device.wait()?;
        watch.lap("upload");
        let mut pixels = vec![Shaded::default(); settings.width as usize * settings.height as usize];
        let (mut shaded, mut nodes, mut loaded) = (0, 0, 0);
        painter.begin_with(backend.windows.of_use(&emitters, &settings.technique));
        let compiled = |windows| Ok(backend.pipelines(Features { windows, ..prepared.features })?.0);
        let work =
            Work { emitters: &emitters, technique: &prepared.technique, offsets: &prepared.offsets, frame: &frame };
        for tile in Tile::all(&frame) {
            painter.paint(compiled, tile, &work, |painted| {
                for (row, y) in painted.chunks(tile.size.x as usize).zip(tile.origin.y..) {
                    let first = y as usize * settings.width as usize + tile.origin.x as usize;
                    for (pixel, sum) in row.iter().zip(&mut pixels[first..]) {
                        let coverage = pixel.shaded() as f32;
                        let parts = pixel.visited() as f32;
                        *sum = Shaded { diffuse: pixel.diffuse, specular: pixel.specular, coverage, parts };
                        sum.scale(1.0 / settings.samples as f32);
                        shaded += u64::from(pixel.shaded());
                        nodes += pixel.visited();
                        loaded += pixel.loaded();
                    }
                }
            })?;
        }
        let skips = painter.skips()?;
        watch.split("shading", painter.seconds()?, "raster and reading back");
        let film = super::compose(scene, prepared, surfaces, settings, &pixels);
        watch.lap("lights in view");
        let lights = light_stats(scene, prepared, shaded, &skips, settings);
        let skipped: u64 = lights.iter().map(LightStats::skipped).sum();
        let candidates: u64 = lights.iter().map(|l| l.candidates).sum();
        let stats = Stats {
            backend: "gpu".into(),
            device: backend.device.name.clone(),
            technique: settings.technique.to_string(),
            stages: watch.laps,
            shaded,
            integrals: candidates - skipped,
            nodes,
            left_out: prepared.features.left_out(),
            clusters: cluster_stats(scene, &skips),
            lights,
            memory: TreeMemory::of(&prepared.emitters),
            loaded: Some(loaded),
            windows: painter.windows(),
            clock: clock.name(),
            reused: reuse.finish(),
        };
        let parts = pixels.iter().map(Shaded::parts_per_sample).collect();
        *drawn = settings.skips.reuse.then_some(Drawn { boxes, emitters, painter });
        Ok(Rendering { film, parts, stats })
    }

    fn fill(&mut self, index: usize, light: AreaLight) {
        self.stage.fill(index, light);
    }
}

/// A counter of a light, or of the clusters that come after all lights, over all rows of `skips`.
fn counted(scene: &Scene, skips: &[u64], light: usize, reason: usize) -> u64 {
    skips.iter().skip(light * SKIP_REASONS + reason).step_by((scene.lights.len() + 1) * SKIP_REASONS).sum()
}

/// What clusters have cost, from the rows of `skips`.
fn cluster_stats(scene: &Scene, skips: &[u64]) -> ClusterStats {
    let [by_tile, by_point, whole, local] = [0, 1, 2, 6].map(|i| counted(scene, skips, scene.lights.len(), i));
    ClusterStats { by_tile, local, by_point, whole }
}

/// The lights' counters, from the rows of `skips`.
fn light_stats(scene: &Scene, prepared: &Prepared, shaded: u64, skips: &[u64], settings: &Settings) -> Vec<LightStats> {
    let sum = |light: usize, reason: usize| counted(scene, skips, light, reason);
    let [points, plain, specular] = [3, 4, 5].map(|i| sum(scene.lights.len(), i));
    let weighted = if settings.skips.lobes { [plain, specular] } else { [points; 2] };
    let mut counters = Counters { shaded, weighted, ..Counters::new(scene) };
    for (index, (stats, handed)) in counters.lights.iter_mut().zip(&mut counters.handed).enumerate() {
        stats.behind = sum(index, 0);
        stats.below_horizon = sum(index, 1);
        stats.no_lobe = sum(index, 2);
        stats.under_tolerance = sum(index, 3);
        stats.behind_tile = sum(index, 4);
        stats.below_tile = sum(index, 5);
        *handed = sum(index, 6);
    }
    counters.count_candidates(prepared);
    counters.lights
}
