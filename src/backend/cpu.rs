//! The CPU backend: tiles of pixels over rayon, no driver needed.

use super::emitter::Skip;
use super::gather::Images;
use super::prepared::Prepared;
use super::surfaces::Surfaces;
use super::tile::{LightList, SIDE, TilePoints};
use super::{Backend, BackendError, Counters, Rendering, Settings, Shaded, Stats, Stopwatch, Technique, reference};
use crate::brdf::ltc::Table;
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
        let counters = pixels
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
    let reflectance = &point.reflectance;
    let [mut diffuse, mut specular] = [Vec3::ZERO; 2];
    let mut budget = Budget::default();
    for listed in &list.listed {
        let emitter = &prepared.emitters[listed.emitter];
        let stats = &mut counters.lights[emitter.light];
        let images = match Images::new(emitter, &point.frame, point.position) {
            Ok(images) if prepared.features.horizons => images,
            Ok(images) => images.uncut(),
            Err(_) => {
                stats.behind += listed.lobes.iter().filter(|&&lobe| lobe).count() as u64;
                continue;
            }
        };
        let lobes =
            [(None, reflectance.diffuse, &mut diffuse), (Some(&reflectance.lobe), reflectance.specular, &mut specular)];
        for ((lobe, weight, sum), _) in lobes.into_iter().zip(listed.lobes).filter(|(_, listed)| *listed) {
            let weight = weight * emitter.radiance;
            let brightest = weight.max_element();
            if brightest <= 0.0 && settings.skips.lobes {
                stats.no_lobe += 1;
                continue;
            }
            let tolerance = list.tolerance / if brightest > 0.0 { brightest } else { 1.0 };
            match images.integral(emitter, lobe, tolerance, &mut budget) {
                Ok(integral) => {
                    counters.integrals += 1;
                    counters.nodes += u64::from(integral.visited);
                    *sum += weight * integral.value.as_vec3();
                }
                Err(Skip::Behind) => stats.behind += 1,
                Err(Skip::BelowHorizon) => stats.below_horizon += 1,
            }
        }
    }
    [diffuse, specular]
}
