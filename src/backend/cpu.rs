//! The CPU backend: tiles of pixels over rayon, no driver needed.

use super::cluster_packets::{Handed, WalkingPacket};
use super::emitter::{Emitter, Skip};
use super::gather::Images;
use super::packets::{PointPacket, Question, tree_of};
use super::prepared::Prepared;
use super::stage::{Ready, Reuse, Stage};
use super::surfaces::Surfaces;
use super::tile::{LightList, Listed, SIDE, TilePoints};
use super::visibility::SeenRows;
use super::{
    Backend, BackendError, Counters, Rendering, Session, Settings, Shaded, Stats, Stopwatch, Technique, TreeMemory,
    reference,
};
use crate::brdf::ltc::{Lobe, Table};
use crate::kernel::frame::ShadingFrame;
use crate::kernel::packet::{MAX_LANES, Processor};
use crate::kernel::receiver::Receiver;
use crate::kernel::reflect::Reflectance;
use crate::kernel::surface::surface_point;
use crate::light::AreaLight;
use crate::light::tree::Tree;
use crate::scene::{Motion, Scene};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Renders on the processor.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl Backend for CpuBackend {
    fn begin<'a>(
        &'a self,
        scene: &'a Scene,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Box<dyn Session + 'a>, BackendError> {
        Ok(Box::new(CpuSession { stage: Stage::new(scene, motion, *settings) }))
    }
}

/// A sequence of pictures on the processor.
struct CpuSession<'a> {
    stage: Stage<'a>,
}

impl Session for CpuSession<'_> {
    fn frame(&mut self, time: f64) -> Result<Rendering, BackendError> {
        let settings = &self.stage.settings().clone();
        if let Technique::Reference(sampling) = &settings.technique {
            return reference::render_stage(&mut self.stage, time, sampling, &|_, _| ());
        }
        let mut watch = Stopwatch::default();
        let mut reuse = Reuse::default();
        let (scene, ready) = self.stage.at(time, &mut watch, &mut reuse)?;
        let Ready { prepared, surfaces, visibility, .. } = ready;
        let (prepared, surfaces) = (&*prepared, &*surfaces);
        reuse.count("what the camera sees", visibility.is_known());
        let processor = Processor::default();
        let width = settings.width as usize;
        let mut pixels = vec![Shaded::default(); width * settings.height as usize];
        let mut counters = pixels
            .par_chunks_mut(width * SIDE as usize)
            .zip(visibility.rows(settings))
            .zip((0..settings.height).into_par_iter().step_by(SIDE as usize))
            .map(|((rows, seen), y)| {
                let mut shader = Shader {
                    prepared,
                    surfaces,
                    settings,
                    seen,
                    processor,
                    tile: Tile::default(),
                    found: Vec::new(),
                    walk: Box::default(),
                    counters: Counters::new(scene),
                };
                let together = SIDE as usize * shader.tiles_together();
                for x in (0..settings.width).step_by(together) {
                    for sample in 0..prepared.offsets.len() {
                        shader.shade_tiles(rows, [x, y], sample);
                    }
                }
                rows.iter_mut().for_each(|pixel| pixel.scale(1.0 / settings.samples as f32));
                shader.counters
            })
            .reduce(|| Counters::new(scene), Counters::plus);
        visibility.complete();
        counters.count_candidates(prepared);
        watch.lap("shading");
        let film = super::compose(scene, prepared, surfaces, settings, &pixels);
        watch.lap("lights in view");
        let stats = Stats {
            backend: "cpu".into(),
            device: format!("{} threads, {processor}", rayon::current_num_threads()),
            technique: settings.technique.to_string(),
            stages: watch.laps,
            shaded: counters.shaded,
            integrals: counters.integrals,
            nodes: counters.nodes,
            left_out: prepared.features.left_out(),
            clusters: counters.clusters,
            lights: counters.lights,
            memory: TreeMemory::of(&prepared.emitters),
            loaded: None,
            windows: 1,
            clock: super::WALL_CLOCK.into(),
            reused: reuse.finish(),
        };
        Ok(Rendering { film, parts: pixels.iter().map(Shaded::parts_per_sample).collect(), stats })
    }

    fn fill(&mut self, index: usize, light: AreaLight) {
        self.stage.fill(index, light);
    }
}

/// Shades tiles.
struct Shader<'a> {
    prepared: &'a Prepared,
    surfaces: &'a Surfaces,
    settings: &'a Settings,
    /// What the camera sees in the rows of the tile.
    seen: SeenRows<'a>,
    processor: Processor,
    /// The tile that is lit.
    tile: Tile,
    /// Tiles that are found and listed together.
    found: Vec<Tile>,
    /// A packet of the tile on its way through clusters.
    walk: Box<WalkingPacket>,
    counters: Counters,
}

/// A tile of shading points, and what may light it.
#[derive(Default)]
struct Tile {
    list: LightList,
    summary: TilePoints,
    points: Vec<TilePoint>,
    /// The points again, as many to a packet as the processor has lanes.
    packets: Vec<PointPacket>,
}

/// A shading point of a tile.
struct TilePoint {
    /// Index in the rows of the tile.
    pixel: usize,
    position: DVec3,
    frame: ShadingFrame,
    reflectance: Reflectance,
    /// Radiance towards the eye, diffuse and specular.
    sums: [Vec3; 2],
    /// What its integrals were made of.
    parts: u32,
}

impl TilePoint {
    /// What an integral of the diffuse or the specular lobe is weighted with.
    fn weight(&self, lobe: usize) -> Vec3 {
        [self.reflectance.diffuse, self.reflectance.specular][lobe]
    }

    fn lobe(&self, lobe: usize) -> Option<&Lobe> {
        [None, Some(&self.reflectance.lobe)][lobe]
    }

    fn add(&mut self, lobe: usize, radiance: Vec3, visited: u32, counters: &mut Counters) {
        self.sums[lobe] += radiance;
        self.parts += visited;
        counters.integrals += 1;
        counters.nodes += u64::from(visited);
    }
}

/// A bit for each point of a tile.
const ALL_POINTS: u64 = u64::MAX;
const _: () = assert!(SIDE * SIDE <= u64::BITS);

/// Sides of the blocks of pixels that packets are made of, as square as can be.
const BLOCK: u32 = 4;

impl Shader<'_> {
    /// How many tiles are found together: one for each lane that walks the clusters.
    fn tiles_together(&self) -> usize {
        if self.prepared.clustered.tree.clusters.is_empty() { 1 } else { self.processor.lanes() }
    }

    /// Adds one sample of every pixel of the tiles from that at `first` on to `rows`, which begin at its upper edge.
    fn shade_tiles(&mut self, rows: &mut [Shaded], [x0, y0]: [u32; 2], sample: usize) {
        let height = rows.len() / self.settings.width as usize;
        self.found.resize_with(self.tiles_together(), Tile::default);
        let mut count = 0;
        for x in (x0..self.settings.width).step_by(SIDE as usize).take(self.found.len()) {
            let mut tile = core::mem::take(&mut self.found[count]);
            self.find_points(&mut tile, height, [x, y0], sample);
            if tile.summary.count > 0 {
                tile.list.fill(self.prepared, self.settings.tolerance, &tile.summary);
                self.found[count] = tile;
                count += 1;
            }
        }
        if count > 0 && !self.prepared.clustered.tree.clusters.is_empty() {
            let mut tiles: Vec<_> = self.found[..count].iter_mut().map(|t| (&mut t.list, &t.summary)).collect();
            LightList::fill_clusters(&mut tiles, self.prepared, self.processor);
        }
        for i in 0..count {
            core::mem::swap(&mut self.tile, &mut self.found[i]);
            self.shade_tile(rows);
            core::mem::swap(&mut self.tile, &mut self.found[i]);
        }
    }

    /// Lights a tile.
    fn shade_tile(&mut self, rows: &mut [Shaded]) {
        let Tile { list, summary, .. } = &self.tile;
        list.count(self.prepared, summary, &mut self.counters);
        self.counters.shaded += summary.count;
        self.counters.clusters.by_tile += u64::from(list.visited);
        self.counters.clusters.local += u64::from(list.locals);
        for (sum, weighted) in self.counters.weighted.iter_mut().zip(summary.weighted) {
            *sum += if self.prepared.features.skips.lobes { weighted } else { summary.count };
        }
        for i in 0..self.tile.list.listed.len() {
            let Listed { emitter, lobes } = self.tile.list.listed[i];
            self.light(emitter, lobes.map(|listed| if listed { ALL_POINTS } else { 0 }));
        }
        if !self.tile.list.clusters.is_empty() || self.tile.list.locals > 0 {
            self.light_clusters();
        }
        for point in &self.tile.points {
            let pixel = &mut rows[point.pixel];
            pixel.diffuse += point.sums[0];
            pixel.specular += point.sums[1];
            pixel.coverage += 1.0;
            pixel.parts += point.parts as f32;
        }
    }

    /// Finds what the camera sees in a tile of that many rows.
    fn find_points(&mut self, tile: &mut Tile, height: usize, [x0, y0]: [u32; 2], sample: usize) {
        let (prepared, settings) = (self.prepared, self.settings);
        let offset = prepared.offsets[sample];
        let (width, height) = (SIDE.min(settings.width - x0), height as u32);
        tile.summary = TilePoints::NONE;
        tile.points.clear();
        tile.packets.clear();
        for i in 0..SIDE * SIDE {
            // Pixel by pixel in a block, block by block in the tile.
            let (block, i) = (i / (BLOCK * BLOCK), i % (BLOCK * BLOCK));
            let x = block % (SIDE / BLOCK) * BLOCK + i % BLOCK;
            let y = block / (SIDE / BLOCK) * BLOCK + i / BLOCK;
            if x >= width || y >= height {
                continue;
            }
            let direction = settings.direction(&prepared.rays, x0 + x, y0 + y, offset);
            let pixel = y as usize * settings.width as usize + (x0 + x) as usize;
            let nearest = || self.surfaces.nearest(&prepared.triangles, direction);
            let found = self.seen.get(pixel * prepared.offsets.len() + sample, nearest);
            let Some((index, hit)) = found else { continue };
            let triangle = &prepared.triangles[index];
            let (materials, textures, rays) = (&prepared.materials, prepared.textures(), &prepared.rays);
            let point = surface_point(triangle, materials, &textures, rays, direction, hit);
            let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
            let lobe = prepared.lobe(Table::shipped(), point.alpha, frame.cos_theta as f32);
            let reflectance = point.reflectance(lobe);
            tile.summary.add(point.position, &frame, &reflectance);
            let position = point.position.as_dvec3();
            if tile.points.len().is_multiple_of(self.processor.lanes()) {
                tile.packets.push(PointPacket::default());
            }
            if let Some(packet) = tile.packets.last_mut() {
                packet.push(position, &frame, &reflectance.lobe);
            }
            tile.points.push(TilePoint { pixel, position, frame, reflectance, sums: [Vec3::ZERO; 2], parts: 0 });
        }
    }

    /// The error that an integral may have which is weighted with `weight`.
    fn tolerance(&self, weight: Vec3) -> f32 {
        let brightest = weight.max_element();
        self.tile.list.tolerance / if brightest > 0.0 { brightest } else { 1.0 }
    }

    /// Whether an integral with that weight is evaluated.
    fn counts(&self, weight: Vec3) -> bool {
        weight.max_element() > 0.0 || !self.settings.skips.lobes
    }

    /// Adds what the points gather from the clusters that are listed.
    fn light_clusters(&mut self) {
        let prepared = self.prepared;
        let tree = &prepared.clustered.tree;
        let lanes = self.processor.lanes();
        let both_horizons = prepared.features.true_horizon;
        for p in 0..self.tile.packets.len() {
            let count = self.tile.packets[p].len();
            self.walk.clear();
            for point in self.tile.points[p * lanes..].iter().take(count) {
                let axes = [point.frame.x, point.frame.y, point.frame.z].map(|axis| axis.as_vec3());
                let position = point.position.as_vec3();
                self.walk.push(&Receiver::of_point(position, axes, &point.reflectance, both_horizons, tree.per_metre));
            }
            let LightList { clusters, local, middle, locals, cluster_tolerance, budget, .. } = &self.tile.list;
            let local = (*locals > 0).then_some((*middle, local));
            self.walk.walk(self.processor, tree.view(), clusters, local, *cluster_tolerance, *budget);
            self.counters.clusters.by_point += self.walk.visited();
            self.counters.clusters.whole += self.walk.whole();
            for (lane, point) in self.tile.points[p * lanes..].iter_mut().take(count).enumerate() {
                (0..2).for_each(|lobe| point.sums[lobe] += self.walk.reflected(lane, lobe));
            }
            for i in 0..self.walk.handed().len() {
                let Handed { emitter, points } = self.walk.handed()[i];
                let [plain, lobe] = points.map(|bits| u64::from(bits) << (p * lanes));
                let integrals = plain.count_ones() + lobe.count_ones();
                self.counters.handed[prepared.emitters[emitter].light] += u64::from(integrals);
                self.light(emitter, [plain, lobe]);
            }
        }
    }

    /// Adds the light of an emission to the points that ask for it by the plain cosine and by the lobe, a bit for each.
    fn light(&mut self, emitter: usize, points: [u64; 2]) {
        let emitter = &self.prepared.emitters[emitter];
        match tree_of(emitter) {
            Some(tree) => self.light_packets(emitter, tree, points),
            None => self.light_points(emitter, points),
        }
    }

    /// Adds the light of an emission to points, packet by packet.
    fn light_packets(&mut self, emitter: &Emitter, tree: &Tree, wanted: [u64; 2]) {
        let lanes = self.processor.lanes();
        for first in (0..self.tile.points.len()).step_by(lanes) {
            for lobe in 0..2 {
                let points = &self.tile.points[first..self.tile.points.len().min(first + lanes)];
                let wanted = (wanted[lobe] >> first) as u32 & bits(points.len());
                if wanted == 0 {
                    continue;
                }
                let mut asking = 0;
                let mut tolerance = [0.0; MAX_LANES];
                for (lane, point) in points.iter().enumerate() {
                    let weight = point.weight(lobe) * emitter.radiance;
                    asking |= u32::from(self.counts(weight)) << lane & wanted;
                    tolerance[lane] = self.tolerance(weight);
                }
                let may_be_cut = self.prepared.features.horizons;
                let question = Question { emitter, tree, specular: lobe == 1, asking, tolerance, may_be_cut };
                let answer = self.tile.packets[first / lanes].ask(self.processor, &question);
                let stats = &mut self.counters.lights[emitter.light];
                stats.behind += u64::from((answer.behind & wanted).count_ones());
                stats.below_horizon += u64::from(answer.below.count_ones());
                stats.no_lobe += u64::from((wanted & !asking & !answer.behind).count_ones());
                for lane in (0..points.len()).filter(|&lane| answer.integrated >> lane & 1 == 1) {
                    let point = &mut self.tile.points[first + lane];
                    let radiance = point.weight(lobe) * emitter.radiance * answer.value[lane];
                    point.add(lobe, radiance, answer.visited[lane], &mut self.counters);
                }
                for lane in (0..lanes).filter(|&lane| answer.alone >> lane & 1 == 1) {
                    self.light_point(emitter, lobe, first + lane);
                }
            }
        }
    }

    /// Adds the light of an emission to points, one by one.
    fn light_points(&mut self, emitter: &Emitter, wanted: [u64; 2]) {
        for i in 0..self.tile.points.len() {
            for lobe in (0..2).filter(|&lobe| wanted[lobe] >> i & 1 == 1) {
                self.light_point(emitter, lobe, i);
            }
        }
    }

    /// Adds what one lobe of one point reflects of an emission.
    fn light_point(&mut self, emitter: &Emitter, lobe: usize, i: usize) {
        let point = &self.tile.points[i];
        let weight = point.weight(lobe) * emitter.radiance;
        let (counts, tolerance) = (self.counts(weight), self.tolerance(weight));
        let (packet, lane) = (&mut self.tile.packets[i / self.processor.lanes()], i % self.processor.lanes());
        let stats = &mut self.counters.lights[emitter.light];
        let images = match Images::new(emitter, &point.frame, point.position) {
            Ok(_) if !counts => {
                stats.no_lobe += 1;
                return;
            }
            Ok(images) if self.prepared.features.horizons => images,
            Ok(images) => images.uncut(),
            Err(_) => {
                stats.behind += 1;
                return;
            }
        };
        let mut budget = packet.budget(lane);
        match images.integral(emitter, point.lobe(lobe), tolerance, &mut budget) {
            Ok(integral) => {
                let radiance = weight * integral.value.as_vec3();
                self.tile.points[i].add(lobe, radiance, integral.visited, &mut self.counters);
            }
            Err(Skip::Behind) => stats.behind += 1,
            Err(Skip::BelowHorizon) => stats.below_horizon += 1,
        }
        packet.set_budget(lane, budget);
    }
}

/// That many bits.
const fn bits(count: usize) -> u32 {
    (1 << count) - 1
}
