//! The Monte Carlo reference: direct light by sampling, with the error it leaves.
//!
//! At every shading point and for each of its lobes, directions are drawn two ways: to a point of a light, chosen by what the
//! lights may send there; and from the lobe. Both are joined by the balance heuristic (Veach 1997, §9.2), so that every
//! single contribution is bounded. Nothing is hidden: as with every other technique, surfaces throw no shadow and lights
//! do not stand in each other's way.

mod areas;
pub mod estimate;
pub mod lights;
pub mod lobes;
pub mod reflection;
pub mod region;
pub mod sampler;

use super::emitter::Skip;
use super::prepared::Prepared;
use super::stage::{Ready, Reuse, Stage};
use super::surfaces::Surfaces;
use super::technique::{MAX_SPP, ReferenceLobe, Sampling};
use super::{BackendError, Counters, Rendering, STILL, Settings, Shaded, Stats, Stopwatch, Technique, TreeMemory};
use crate::brdf::ltc::{self, Table};
use crate::kernel::frame::ShadingFrame;
use crate::kernel::surface::{SurfacePoint, surface_point};
use crate::scene::Scene;
use core::sync::atomic::{AtomicU64, Ordering};
use estimate::{Estimate, Plan};
use glam::DVec3;
use lights::Light;
use lobes::Lobe;
use rayon::prelude::*;
use reflection::Reflection;
use sampler::Key;

/// Renders `scene` by sampling, on the processor, whatever the technique of `settings`.
///
/// The samples of a pixel are divided evenly over its sample positions (`settings.samples`) and over batches of independent
/// random numbers; at least two at each position are taken, and at most `sampling.spp` where that is more. The picture hangs
/// on the seed, not on the number of threads. Its layer `variance` is the variance of what the surfaces reflect at each
/// pixel, (W·sr⁻¹·m⁻²)², by the spread of the batches.
///
/// `progress` is called now and then with pixels done and pixels in all, from any thread.
///
/// # Errors
/// [`BackendError::Sampling`] and what every backend may say.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    sampling: &Sampling,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Rendering, BackendError> {
    let settings = Settings { technique: Technique::Reference(*sampling), ..*settings };
    render_stage(&mut Stage::new(scene, &STILL, settings), 0.0, sampling, progress)
}

/// As [`render`], the picture of a stage at a time.
pub(super) fn render_stage(
    stage: &mut Stage<'_>,
    time: f64,
    sampling: &Sampling,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Rendering, BackendError> {
    check(sampling)?;
    let mut watch = Stopwatch::default();
    let mut reuse = Reuse::default();
    let settings = &stage.settings().clone();
    let (scene, ready) = stage.at(time, &mut watch, &mut reuse)?;
    let Ready { prepared, surfaces, .. } = &*ready;
    let frame = Frame {
        scene,
        settings,
        sampling: *sampling,
        plan: Plan::new(sampling, settings.samples),
        prepared,
        surfaces,
        lights: lights(prepared),
    };
    let (pixels, mut variance, cost) = frame.run(progress);
    watch.lap("sampling");
    let mut film = super::compose(scene, prepared, surfaces, settings, &pixels);
    for (variance, matte) in variance.iter_mut().zip(&film.matte) {
        let through = 1.0 - matte;
        *variance = variance.map(|v| v * through * through);
    }
    film.variance = Some(variance);
    watch.lap("lights in view");
    let stats = Stats {
        backend: "cpu".into(),
        device: format!("{} threads", rayon::current_num_threads()),
        technique: settings.technique.to_string(),
        stages: watch.laps,
        shaded: cost.shaded,
        integrals: cost.integrals,
        nodes: cost.nodes,
        left_out: prepared.features.left_out(),
        clusters: super::ClusterStats::default(),
        lights: cost.lights,
        memory: TreeMemory::of(&prepared.emitters),
        loaded: None,
        windows: 1,
        clock: super::WALL_CLOCK.into(),
        reused: reuse.finish(),
    };
    Ok(Rendering { film, parts: pixels.iter().map(Shaded::parts_per_sample).collect(), stats })
}

/// Whether one can sample so.
///
/// # Errors
/// [`BackendError::Sampling`].
pub fn check(sampling: &Sampling) -> Result<(), BackendError> {
    let Sampling { spp, max_error, .. } = *sampling;
    let sound = (1..=MAX_SPP).contains(&spp) && max_error.is_none_or(|e| e.is_finite() && e > 0.0);
    if sound { Ok(()) } else { Err(BackendError::Sampling { spp, max_error }) }
}

/// What a light meter reads at a point relative to the camera: irradiance (W/m²) and the radiance reflected by a specular lobe
/// of width `alpha` with Fresnel = 1, all lights together.
pub fn measure(
    prepared: &Prepared,
    sampling: &Sampling,
    frame: &ShadingFrame,
    position: DVec3,
    alpha: f32,
) -> [DVec3; 2] {
    let lights = lights(prepared);
    let lobe = prepared.lobe(Table::shipped(), alpha, frame.cos_theta as f32);
    let specular = match sampling.lobe {
        ReferenceLobe::Ltc => Lobe::ltc(&lobe, DVec3::splat((lobe.magnitude / lobe.above).into())),
        ReferenceLobe::Ggx => Lobe::ggx(alpha, frame, DVec3::ONE, 1.0),
    };
    let lobes = [Lobe::Cosine(DVec3::splat(core::f64::consts::PI)), specular];
    let see = |lobe| Reflection::new(&lights, lobe, |light, lobe| light.seen_from(frame, position, lobe));
    estimate(lobes.map(|lobe| Some(see(lobe))), sampling).mean
}

/// The emissions that emit anything.
fn lights(prepared: &Prepared) -> Vec<Light<'_>> {
    prepared.emitters.iter().map(Light::new).filter(|light| !light.is_dark()).collect()
}

/// The integral of one light alone: of the plain cosine, or of a lobe, 1 for a hemisphere of radiance 1. `c` are the
/// images in the shading frame of the light-space x axis, y axis and origin. Also the number of samples.
///
/// # Errors
/// Why the light does not reach the point.
pub fn integral(
    light: &Light<'_>,
    sampling: &Sampling,
    c: [DVec3; 3],
    lobe: Option<&ltc::Lobe>,
) -> Result<(DVec3, u32), Skip> {
    let lobe = lobe.map_or(Lobe::Cosine(DVec3::ONE), |lobe| Lobe::ltc(lobe, DVec3::ONE));
    light.source(c, &lobe)?;
    let reflection = Reflection::new(core::slice::from_ref(light), lobe, |light, lobe| light.source(c, lobe));
    let estimate = estimate([Some(reflection), None], sampling);
    Ok((estimate.mean[0], estimate.count * Plan::new(sampling, 1).batch))
}

fn estimate(reflections: [Option<Reflection<'_>>; 2], sampling: &Sampling) -> Estimate {
    let plan = Plan::new(sampling, 1);
    let key = Key::new(sampling.seed);
    plan.run(sampling.max_error, |batches, sums| {
        for (batch, sum) in batches.zip(sums) {
            *sum = sampled(&reflections, key.part(u64::from(batch)), plan.batch);
        }
    })
}

/// One batch of both reflections.
fn sampled(reflections: &[Option<Reflection<'_>>; 2], key: Key, n: u32) -> [DVec3; 2] {
    core::array::from_fn(|k| reflections[k].as_ref().map_or(DVec3::ZERO, |r| r.sample(key.part(k as u64), n)))
}

/// Counts a light that a lobe has looked for.
fn note(cost: &mut Counters, light: usize, skip: Option<Skip>) {
    let stats = &mut cost.lights[light];
    match skip {
        None => cost.integrals += 1,
        Some(Skip::Behind) => stats.behind += 1,
        Some(Skip::BelowHorizon) => stats.below_horizon += 1,
    }
}

/// One picture in the making.
struct Frame<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    sampling: Sampling,
    plan: Plan,
    prepared: &'a Prepared,
    surfaces: &'a Surfaces,
    lights: Vec<Light<'a>>,
}

impl Frame<'_> {
    /// Pixels, the variances of what they reflect, and the cost.
    fn run(&self, progress: &(dyn Fn(u64, u64) + Sync)) -> (Vec<Shaded>, Vec<[f32; 3]>, Counters) {
        let width = self.settings.width as usize;
        let total = width * self.settings.height as usize;
        let (mut pixels, mut variance) = (vec![Shaded::default(); total], vec![[0.0; 3]; total]);
        let done = AtomicU64::new(0);
        let rows = pixels.par_chunks_mut(width).zip(variance.par_chunks_mut(width)).enumerate();
        let cost = rows
            .map(|(y, (pixels, variance))| {
                let mut cost = Counters::new(self.scene);
                for (x, (pixel, variance)) in pixels.iter_mut().zip(variance).enumerate() {
                    let estimate = self.pixel(x as u32, y as u32, pixel, &mut cost);
                    *variance = estimate.variance().as_vec3().to_array();
                }
                let done = done.fetch_add(width as u64, Ordering::Relaxed) + width as u64;
                progress(done, total as u64);
                cost
            })
            .reduce(|| Counters::new(self.scene), Counters::plus);
        (pixels, variance, cost)
    }

    /// Finds what a pixel reflects.
    fn pixel(&self, x: u32, y: u32, pixel: &mut Shaded, cost: &mut Counters) -> Estimate {
        let points = self.points(x, y);
        if points.is_empty() {
            return Estimate::default();
        }
        let share = 1.0 / f64::from(self.settings.samples);
        let key = Key::new(self.sampling.seed).part(u64::from(y) * u64::from(self.settings.width) + u64::from(x));
        let batch_size = self.plan.batch;
        let estimate = self.plan.run(self.sampling.max_error, |batches, sums| {
            for (position, surface) in &points {
                let reflections = self.reflections(surface, (batches.start == 0).then_some(&mut *cost));
                for (batch, sum) in batches.clone().zip(&mut *sums) {
                    let key = key.part(u64::from(batch)).part(*position);
                    let [diffuse, specular] = sampled(&reflections, key, batch_size);
                    sum[0] += diffuse * share;
                    sum[1] += specular * share;
                }
            }
        });
        let samples = u64::from(estimate.count) * u64::from(batch_size) * points.len() as u64;
        cost.nodes += samples;
        let [diffuse, specular] = estimate.mean.map(|mean| mean.as_vec3());
        let [coverage, parts] = [points.len() as f64, samples as f64].map(|n| (n * share) as f32);
        *pixel = Shaded { diffuse, specular, coverage, parts };
        estimate
    }

    /// The surface points of a pixel with the numbers of their sample positions.
    fn points(&self, x: u32, y: u32) -> Vec<(u64, SurfacePoint)> {
        let prepared = self.prepared;
        let hit = |(i, &offset): (u64, &[f32; 2])| {
            let direction = self.settings.direction(&prepared.rays, x, y, offset);
            let (index, hit) = self.surfaces.nearest(&prepared.triangles, direction)?;
            let triangle = &prepared.triangles[index];
            let textures = prepared.textures();
            Some((i, surface_point(triangle, &prepared.materials, &textures, &prepared.rays, direction, hit)))
        };
        (0..).zip(&prepared.offsets).filter_map(hit).collect()
    }

    /// The lobes of a surface point with their lights; counted in `cost`, if given.
    fn reflections(&self, point: &SurfacePoint, mut cost: Option<&mut Counters>) -> [Option<Reflection<'_>>; 2] {
        let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
        let lobe = self.prepared.lobe(Table::shipped(), point.alpha, frame.cos_theta as f32);
        let lobes = lobes::of_surface(point, &frame, lobe, self.sampling.lobe);
        if let Some(cost) = &mut cost {
            cost.shaded += 1;
            for light in &self.lights {
                let stats = &mut cost.lights[light.emitter().light];
                stats.candidates += 2;
                stats.no_lobe += lobes.iter().filter(|lobe| lobe.is_none()).count() as u64;
            }
        }
        lobes.map(|lobe| {
            Some(Reflection::new(&self.lights, lobe?, |light, lobe| {
                let seen = light.seen_from(&frame, point.position.as_dvec3(), lobe);
                if let Some(cost) = &mut cost {
                    note(cost, light.emitter().light, seen.as_ref().err().copied());
                }
                seen
            }))
        })
    }
}
