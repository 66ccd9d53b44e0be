//! The CPU backend: tiles of pixels over rayon, no driver needed.

use super::emitter::Skip;
use super::gather::Images;
use super::prepared::Prepared;
use super::surfaces::Surfaces;
use super::tile::{LightList, SIDE, TilePoints};
use super::{Backend, BackendError, Counters, Rendering, Settings, Shaded, Stats, Stopwatch, Technique, reference};
use crate::brdf::ltc::Table;
use crate::kernel::cluster::{ClusterSums, Receiver};
use crate::kernel::frame::ShadingFrame;
use crate::kernel::reflect::Reflectance;
use crate::kernel::surface::surface_point;
use crate::kernel::tree::Budget;
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Renders on the processor.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl Backend for CpuBackend {
    fn render(&self, scene: &Scene, settings: &Settings) -> Result<Rendering, BackendError> {
        if let Technique::Reference(sampling) = &settings.technique {
            return reference::render(scene, settings, sampling, &|_, _| ());
        }
        let mut watch = Stopwatch::default();
        let prepared = Prepared::new(scene, settings)?;
        watch.lap("trees");
        let surfaces = Surfaces::new(&prepared);
        watch.lap("surfaces");
        let width = settings.width as usize;
        let mut pixels = vec![Shaded::default(); width * settings.height as usize];
        let mut counters = pixels
            .par_chunks_mut(width * SIDE as usize)
            .zip((0..settings.height).into_par_iter().step_by(SIDE as usize))
            .map(|(rows, y)| {
                let mut shader = Shader {
                    prepared: &prepared,
                    surfaces: &surfaces,
                    settings,
                    list: LightList::default(),
                    points: Vec::new(),
                    counters: Counters::new(scene),
                };
                for x in (0..settings.width).step_by(SIDE as usize) {
                    for &offset in &prepared.offsets {
                        shader.shade_tile(rows, [x, y], offset);
                    }
                }
                rows.iter_mut().for_each(|pixel| pixel.scale(1.0 / settings.samples as f32));
                shader.counters
            })
            .reduce(|| Counters::new(scene), Counters::plus);
        counters.count_clustered(&prepared);
        watch.lap("shading");
        let film = super::compose(scene, &prepared, &surfaces, settings, &pixels);
        watch.lap("lights in view");
        let stats = Stats {
            backend: "cpu".into(),
            device: format!("{} threads", rayon::current_num_threads()),
            technique: settings.technique.to_string(),
            stages: watch.laps,
            shaded: counters.shaded,
            integrals: counters.integrals,
            nodes: counters.nodes,
            left_out: prepared.features.left_out(),
            clusters: counters.clusters,
            lights: counters.lights,
        };
        Ok(Rendering { film, parts: pixels.iter().map(Shaded::parts_per_sample).collect(), stats })
    }
}

/// Shades tiles.
struct Shader<'a> {
    prepared: &'a Prepared,
    surfaces: &'a Surfaces<'a>,
    settings: &'a Settings,
    list: LightList,
    points: Vec<TilePoint>,
    counters: Counters,
}

/// A shading point of a tile.
struct TilePoint {
    /// Index in the rows of the tile.
    pixel: usize,
    position: DVec3,
    frame: ShadingFrame,
    reflectance: Reflectance,
}

impl Shader<'_> {
    /// Adds one sample of every pixel of the tile at `first` to `rows`, which begin at its upper edge.
    fn shade_tile(&mut self, rows: &mut [Shaded], first: [u32; 2], offset: [f32; 2]) {
        let tile = self.find_points(rows.len() / self.settings.width as usize, first, offset);
        if tile.count == 0 {
            return;
        }
        self.list.fill(self.prepared, self.settings.tolerance, &tile);
        self.list.count(self.prepared, &tile, &mut self.counters);
        self.counters.shaded += tile.count;
        self.counters.clusters.by_tile += u64::from(self.list.visited);
        for (sum, weighted) in self.counters.weighted.iter_mut().zip(tile.weighted) {
            *sum += if self.prepared.features.skips.lobes { weighted } else { tile.count };
        }
        for emitter in &self.prepared.emitters {
            self.counters.lights[emitter.light].candidates += 2 * tile.count;
        }
        for point in &self.points {
            let before = self.counters.nodes;
            let [diffuse, specular] = shade(self.prepared, self.settings, &self.list, point, &mut self.counters);
            let pixel = &mut rows[point.pixel];
            pixel.diffuse += diffuse;
            pixel.specular += specular;
            pixel.coverage += 1.0;
            pixel.parts += (self.counters.nodes - before) as f32;
        }
    }

    /// Finds what the camera sees in a tile of that many rows.
    fn find_points(&mut self, height: usize, [x0, y0]: [u32; 2], offset: [f32; 2]) -> TilePoints {
        let (prepared, settings) = (self.prepared, self.settings);
        let mut tile = TilePoints::NONE;
        self.points.clear();
        for y in 0..height as u32 {
            for x in x0..(x0 + SIDE).min(settings.width) {
                let direction = settings.direction(&prepared.rays, x, y0 + y, offset);
                let Some((index, hit)) = self.surfaces.nearest(direction) else { continue };
                let triangle = &prepared.triangles[index];
                let (materials, textures, rays) = (&prepared.materials, prepared.textures(), &prepared.rays);
                let point = surface_point(triangle, materials, &textures, rays, direction, hit);
                let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
                let lobe = prepared.lobe(Table::shipped(), point.alpha, frame.cos_theta as f32);
                let reflectance = point.reflectance(lobe);
                tile.add(point.position, &frame, &reflectance);
                let pixel = y as usize * settings.width as usize + x as usize;
                self.points.push(TilePoint { pixel, position: point.position.as_dvec3(), frame, reflectance });
            }
        }
        tile
    }
}

/// Diffuse and specular radiance of a point towards the eye, from the lights of its tile.
fn shade(
    prepared: &Prepared,
    settings: &Settings,
    list: &LightList,
    point: &TilePoint,
    counters: &mut Counters,
) -> [Vec3; 2] {
    let mut budget = list.budget;
    let mut sums = [Vec3::ZERO; 2];
    for listed in &list.listed {
        let [plain, lobe] = listed.lobes.map(u32::from);
        gather(prepared, settings, list, point, counters, &mut budget, &mut sums, listed.emitter, plain | lobe << 1);
    }
    if list.clusters.is_empty() {
        return sums;
    }
    let tree = &prepared.clustered.tree;
    let axes = [point.frame.x, point.frame.y, point.frame.z].map(|axis| axis.as_vec3());
    let both_horizons = prepared.features.true_horizon;
    let receiver =
        Receiver::of_point(point.position.as_vec3(), axes, &point.reflectance, both_horizons, tree.per_metre);
    let mut clusters = ClusterSums::default();
    for &listed in &list.clusters {
        clusters.add(tree.view(), &receiver, listed, list.tolerance, &mut budget, |emitter, lobes, budget| {
            counters.handed[prepared.emitters[emitter].light] += u64::from(lobes.count_ones());
            gather(prepared, settings, list, point, counters, budget, &mut sums, emitter, lobes);
        });
    }
    counters.clusters.by_point += u64::from(clusters.visited);
    counters.clusters.whole += u64::from(clusters.whole);
    [sums[0] + clusters.radiance[0], sums[1] + clusters.radiance[1]]
}

/// Adds what a point gathers from one emitter by `lobes`, a bit for each.
#[expect(clippy::too_many_arguments, reason = "what a point gathers with")]
fn gather(
    prepared: &Prepared,
    settings: &Settings,
    list: &LightList,
    point: &TilePoint,
    counters: &mut Counters,
    budget: &mut Budget,
    sums: &mut [Vec3; 2],
    emitter: usize,
    lobes: u32,
) {
    let emitter = &prepared.emitters[emitter];
    let stats = &mut counters.lights[emitter.light];
    let images = match Images::new(emitter, &point.frame, point.position) {
        Ok(images) if prepared.features.horizons => images,
        Ok(images) => images.uncut(),
        Err(_) => {
            stats.behind += u64::from(lobes.count_ones());
            return;
        }
    };
    let reflectance = &point.reflectance;
    let weighted = [(None, reflectance.diffuse), (Some(&reflectance.lobe), reflectance.specular)];
    for (k, (lobe, weight)) in weighted.into_iter().enumerate().filter(|(k, _)| lobes & 1 << k != 0) {
        let weight = weight * emitter.radiance;
        let brightest = weight.max_element();
        if brightest <= 0.0 && settings.skips.lobes {
            stats.no_lobe += 1;
            continue;
        }
        let tolerance = list.tolerance / if brightest > 0.0 { brightest } else { 1.0 };
        match images.integral(emitter, lobe, tolerance, budget) {
            Ok(integral) => {
                counters.integrals += 1;
                counters.nodes += u64::from(integral.visited);
                sums[k] += weight * integral.value.as_vec3();
            }
            Err(Skip::Behind) => stats.behind += 1,
            Err(Skip::BelowHorizon) => stats.below_horizon += 1,
        }
    }
}
