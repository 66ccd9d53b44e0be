//! The Monte Carlo reference: direct light by sampling, with the error it leaves.
//!
//! At every shading point directions are drawn three ways: to a point of a light, chosen by what the lights may send there
//! and evenly by area; from the specular lobe; from the cosine. All three serve both reflections where they can, joined by
//! the balance heuristic (Veach 1997, §9.2), so that every single contribution is bounded. Nothing is hidden: as with
//! every other technique, surfaces throw no shadow and lights do not stand in each other's way.

pub mod lights;
pub mod lobes;
pub mod region;
pub mod sampler;

use super::cpu::Surfaces;
use super::gather::Skip;
use super::prepared::Prepared;
use super::technique::{MAX_SPP, Sampling};
use super::{BackendError, LightStats, Rendering, Settings, Shaded, Stats, Stopwatch};
use crate::brdf::ltc::Table;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::surface::{SurfacePoint, surface_point};
use crate::scene::Scene;
use core::sync::atomic::{AtomicU64, Ordering};
use glam::DVec3;
use lights::{Light, Source};
use lobes::{Reflector, cosine, sample_cosine};
use rayon::prelude::*;
use sampler::{Key, Sequence};

/// Batches of a pixel from which its variance is known; its samples are divided into as many, or up to twice as many.
const BATCHES: u32 = 16;
/// Most samples of a batch at each sample position where sampling may end early.
const ADAPTIVE_BATCH: u32 = 64;

/// How a pixel's samples are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Plan {
    /// Samples per batch and sample position; a power of two.
    batch: u32,
    /// Batches at most.
    batches: u32,
}

impl Plan {
    fn new(sampling: &Sampling, positions: u32) -> Self {
        let each = sampling.spp / positions;
        let most = if sampling.max_error.is_some() { ADAPTIVE_BATCH } else { u32::MAX };
        let batch = 1 << (each / BATCHES).min(most).max(1).ilog2();
        Self { batch, batches: (each / batch).max(2) }
    }
}

/// Mean and spread of the batches of one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    count: f64,
    /// Diffuse and specular.
    mean: [DVec3; 2],
    /// Squares of the distances of diffuse + specular from its mean, added up.
    spread: DVec3,
}

impl Estimate {
    /// Takes a batch in (Welford 1962).
    fn add(&mut self, batch: [DVec3; 2]) {
        self.count += 1.0;
        let before = batch[0] + batch[1] - self.mean[0] - self.mean[1];
        for (mean, value) in self.mean.iter_mut().zip(batch) {
            *mean += (value - *mean) / self.count;
        }
        self.spread += before * (batch[0] + batch[1] - self.mean[0] - self.mean[1]);
    }

    /// Variance of the mean.
    fn variance(&self) -> DVec3 {
        self.spread.max(DVec3::ZERO) / (self.count * (self.count - 1.0).max(1.0))
    }
}

/// What one row of pixels has cost.
#[derive(Clone, Debug, Default)]
struct Cost {
    shaded: u64,
    samples: u64,
    lights: Vec<LightStats>,
}

/// Renders `scene` by sampling, on the processor. `settings.technique` is not looked at.
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
    check(sampling)?;
    let mut watch = Stopwatch::default();
    let prepared = Prepared::new(scene, settings)?;
    watch.lap("trees");
    let surfaces = Surfaces::new(&prepared);
    watch.lap("surfaces");
    let layers = scene.lights.iter().flat_map(|light| light.layers.iter().map(move |layer| (light.form, layer)));
    let layers: Vec<_> = prepared.emitters.iter().zip(layers).collect();
    let lights = layers.par_iter().map(|(emitter, (form, layer))| Light::new(emitter, *form, layer)).collect();
    watch.lap("regions");
    let sampler = Sampler {
        scene,
        settings,
        sampling: *sampling,
        prepared: &prepared,
        surfaces: &surfaces,
        lights,
        key: Key::new(sampling.seed),
    };
    let (pixels, mut variance, cost) = sampler.run(progress);
    watch.lap("sampling");
    let mut film = super::compose(scene, &prepared, &surfaces, settings, &pixels);
    for (variance, matte) in variance.iter_mut().zip(&film.matte) {
        let through = 1.0 - matte;
        *variance = variance.map(|v| v * through * through);
    }
    film.variance = Some(variance);
    watch.lap("lights in view");
    let stats = Stats {
        backend: "cpu".into(),
        device: format!("{} threads", rayon::current_num_threads()),
        stages: watch.laps,
        shaded: cost.shaded,
        integrals: 0,
        nodes: 0,
        light_samples: cost.samples,
        lights: cost.lights,
    };
    Ok(Rendering { film, stats })
}

fn check(sampling: &Sampling) -> Result<(), BackendError> {
    let Sampling { spp, max_error, .. } = *sampling;
    let sound = (1..=MAX_SPP).contains(&spp) && max_error.is_none_or(|e| e.is_finite() && e > 0.0);
    if sound { Ok(()) } else { Err(BackendError::Sampling { spp, max_error }) }
}

struct Sampler<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    sampling: Sampling,
    prepared: &'a Prepared,
    surfaces: &'a Surfaces<'a>,
    lights: Vec<Light<'a>>,
    key: Key,
}

impl Sampler<'_> {
    /// Pixels, the variances of what they reflect, and the cost.
    fn run(&self, progress: &(dyn Fn(u64, u64) + Sync)) -> (Vec<Shaded>, Vec<[f32; 3]>, Cost) {
        let width = self.settings.width as usize;
        let total = width * self.settings.height as usize;
        let (mut pixels, mut variance) = (vec![Shaded::default(); total], vec![[0.0; 3]; total]);
        let done = AtomicU64::new(0);
        let rows = pixels.par_chunks_mut(width).zip(variance.par_chunks_mut(width)).enumerate();
        let cost = rows
            .map(|(y, (pixels, variance))| {
                let mut cost = self.no_cost();
                for (x, (pixel, variance)) in pixels.iter_mut().zip(variance).enumerate() {
                    let (shaded, estimate) = self.pixel(x as u32, y as u32, &mut cost);
                    *pixel = shaded;
                    *variance = estimate.as_vec3().to_array();
                }
                let done = done.fetch_add(width as u64, Ordering::Relaxed) + width as u64;
                progress(done, total as u64);
                cost
            })
            .reduce(|| self.no_cost(), plus);
        (pixels, variance, cost)
    }

    fn no_cost(&self) -> Cost {
        let lights = self.scene.lights.iter().map(|l| LightStats { name: l.name.clone(), ..LightStats::default() });
        Cost { shaded: 0, samples: 0, lights: lights.collect() }
    }

    /// What a pixel reflects, and the variance of it.
    fn pixel(&self, x: u32, y: u32, cost: &mut Cost) -> (Shaded, DVec3) {
        let points = self.points(x, y);
        if points.is_empty() {
            return (Shaded::default(), DVec3::ZERO);
        }
        let table = Table::shipped();
        let share = 1.0 / self.prepared.offsets.len() as f64;
        let plan = Plan::new(&self.sampling, self.settings.samples);
        let key = self.key.part(u64::from(y) * u64::from(self.settings.width) + u64::from(x));
        let mut estimate = Estimate::default();
        let mut from = 0;
        let mut round = if self.sampling.max_error.is_some() { BATCHES } else { plan.batches };
        let mut sums = Vec::new();
        while from < plan.batches {
            let batches = from..(from + round).min(plan.batches);
            sums.clear();
            sums.resize(batches.len(), [DVec3::ZERO; 2]);
            for (offset, point) in &points {
                let scene = Point::new(self, point, table, (from == 0).then_some(&mut *cost));
                for (batch, sum) in batches.clone().zip(&mut sums) {
                    let key = key.part(u64::from(*offset)).part(u64::from(batch));
                    let [diffuse, specular] = scene.sample(key, plan.batch);
                    sum[0] += diffuse * share;
                    sum[1] += specular * share;
                }
            }
            sums.iter().for_each(|sum| estimate.add(*sum));
            from = batches.end;
            round = (from / 2).max(1);
            let error = estimate.variance().max_element().sqrt();
            if self.sampling.max_error.is_some_and(|limit| error <= f64::from(limit)) {
                break;
            }
        }
        cost.samples += u64::from(from) * u64::from(plan.batch) * points.len() as u64;
        let [diffuse, specular] = estimate.mean.map(|mean| mean.as_vec3());
        let coverage = (points.len() as f64 * share) as f32;
        (Shaded { diffuse, specular, coverage }, estimate.variance())
    }

    /// The surface points of a pixel with the numbers of their sample positions.
    fn points(&self, x: u32, y: u32) -> Vec<(u32, SurfacePoint)> {
        let prepared = self.prepared;
        let hit = |(i, &offset): (u32, &[f32; 2])| {
            let direction = self.settings.direction(&prepared.rays, x, y, offset);
            let (index, hit) = self.surfaces.nearest(direction)?;
            let triangle = &prepared.triangles[index];
            let textures = prepared.textures();
            Some((i, surface_point(triangle, &prepared.materials, &textures, &prepared.rays, direction, hit)))
        };
        (0..).zip(&prepared.offsets).filter_map(hit).collect()
    }
}

fn plus(mut a: Cost, b: Cost) -> Cost {
    a.shaded += b.shaded;
    a.samples += b.samples;
    for (a, b) in a.lights.iter_mut().zip(b.lights) {
        a.candidates += b.candidates;
        a.behind += b.behind;
        a.below_horizon += b.below_horizon;
        a.no_lobe += b.no_lobe;
    }
    a
}

/// A shading point with the lights that reach it.
struct Point<'a> {
    reflector: Reflector,
    sources: Vec<Source<'a>>,
    /// Sums of the chances of the sources up to each, the last 1.
    chances: Vec<f64>,
}

impl<'a> Point<'a> {
    /// Counts in `cost`, if given.
    fn new(sampler: &'a Sampler<'_>, point: &SurfacePoint, table: &Table, mut cost: Option<&mut Cost>) -> Self {
        let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
        let reflector = Reflector::new(point, &frame, table, sampler.sampling.lobe);
        let lobes = u64::from(reflector.diffuse.is_some()) + u64::from(reflector.specular.is_some());
        let (mut sources, mut chances) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        if let Some(cost) = &mut cost {
            cost.shaded += 1;
        }
        for light in &sampler.lights {
            if light.is_dark() {
                continue;
            }
            let seen = light.seen_from(&frame, point.position.as_dvec3());
            if let Some(cost) = &mut cost {
                let stats = &mut cost.lights[light.index()];
                stats.candidates += 2;
                match seen {
                    Ok(_) => stats.no_lobe += 2 - lobes,
                    Err(Skip::Behind) => stats.behind += 2,
                    Err(Skip::BelowHorizon) => stats.below_horizon += 2,
                }
            }
            if let Ok((source, weight)) = seen {
                sum += weight;
                sources.push(source);
                chances.push(sum);
            }
        }
        chances.iter_mut().for_each(|chance| *chance /= sum);
        Self { reflector, sources, chances }
    }

    /// Diffuse and specular radiance towards the eye by `n` samples of each kind.
    fn sample(&self, key: Key, n: u32) -> [DVec3; 2] {
        let [mut diffuse, mut specular] = [DVec3::ZERO; 2];
        if self.sources.is_empty() {
            return [diffuse, specular];
        }
        let [over_lights, over_lobe, over_cosine] = [0, 1, 2].map(|kind| Sequence::new(key.part(kind)));
        for i in 0..n {
            self.light_sample(over_lights.point(i), &mut diffuse, &mut specular);
            if let Some(gloss) = &self.reflector.specular {
                let direction = gloss.sample(over_lobe.point(i));
                if direction.z > 0.0 {
                    let (value, density) = (gloss.value(direction), gloss.density(direction));
                    specular += value * self.arriving(direction, density);
                }
            }
            if let Some(weight) = self.reflector.diffuse {
                let direction = sample_cosine(over_cosine.point(i));
                let density = cosine(direction);
                diffuse += weight * density * self.arriving(direction, density);
            }
        }
        [diffuse / f64::from(n), specular / f64::from(n)]
    }

    /// One direction to a light, for both reflections.
    fn light_sample(&self, [u, v]: [f64; 2], diffuse: &mut DVec3, specular: &mut DVec3) {
        let last = self.sources.len() - 1;
        let chosen = self.chances.partition_point(|&end| end <= v).min(last);
        let start = if chosen == 0 { 0.0 } else { self.chances[chosen - 1] };
        let chance = self.chances[chosen] - start;
        let inner = ((v - start) / chance).clamp(0.0, 1.0 - f64::EPSILON);
        let Some(light) = self.sources[chosen].sample([u, inner]) else { return };
        let l = light.direction;
        if !(l.z > 0.0) {
            return;
        }
        let density = light.density * chance;
        if let Some(weight) = self.reflector.diffuse {
            let cos = cosine(l);
            *diffuse += weight * light.radiance * (cos / (density + cos));
        }
        if let Some(gloss) = &self.reflector.specular {
            *specular += gloss.value(l) * light.radiance / (density + gloss.density(l));
        }
    }

    /// Radiance from a direction found with `density` by a lobe, each light weighted against being found by its area.
    fn arriving(&self, direction: DVec3, density: f64) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let mut start = 0.0;
        for (source, &end) in self.sources.iter().zip(&self.chances) {
            if let Some(light) = source.meet(direction) {
                sum += light.radiance / (density + light.density * (end - start));
            }
            start = end;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_keep_to_the_samples_asked_for() {
        let plan =
            |spp, max_error, positions| Plan::new(&Sampling { spp, max_error, ..Sampling::default() }, positions);
        assert_eq!(plan(256, None, 4), Plan { batch: 4, batches: 16 });
        assert_eq!(plan(1 << 20, None, 1), Plan { batch: 1 << 16, batches: 16 });
        assert_eq!(plan(1 << 20, Some(0.1), 1), Plan { batch: 64, batches: 1 << 14 });
        // Two of each are the least that tell a variance.
        assert_eq!(plan(1, None, 4), Plan { batch: 1, batches: 2 });
        for spp in [32, 100, 1000, 12_345, 1 << 24] {
            for positions in [1, 3, 4, 16] {
                let Plan { batch, batches } = plan(spp, None, positions);
                let used = batch * batches * positions;
                assert!(used <= spp && f64::from(used) > 0.9 * f64::from(spp) - 16.0, "{spp}: {used}");
            }
        }
    }

    #[test]
    fn the_estimate_is_mean_and_variance() {
        let mut estimate = Estimate::default();
        let values = [1.0, 4.0, 2.0, 7.0, 1.5];
        values.iter().for_each(|&v| estimate.add([DVec3::splat(0.25 * v), DVec3::splat(0.75 * v)]));
        let mean = values.iter().sum::<f64>() / 5.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0 / 5.0;
        assert!((estimate.mean[0].x + estimate.mean[1].x - mean).abs() < 1e-12);
        assert!((estimate.variance().x - variance).abs() < 1e-12);
        assert_eq!(Estimate::default().variance(), DVec3::ZERO);
    }
}
