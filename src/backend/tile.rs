//! Which lights may reach a tile of shading points, decided for all of its points at once. Twin: `shaders/light_list.wgsl`; the
//! bounds are those of [`crate::kernel::tile`].

use super::cluster_packets::Lists;
use super::emitter::Emitter;
use super::prepared::Prepared;
use super::{Counters, Skips};
use crate::kernel::cluster::{CLUSTER_PART, ClusterBudget};
use crate::kernel::cluster_list::ListedCluster;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::local::Local;
use crate::kernel::packet::{MAX_LANES, Processor};
use crate::kernel::receiver::Receiver;
use crate::kernel::reflect::Reflectance;
use crate::kernel::tile::{BUCKETS, LightBox, Offsets, SKIP_SHARE, TileBounds, bucket, first_skipped};
use crate::light::Form;
use crate::light::simple::Facing;
use core::f64::consts::PI;
use glam::{DVec2, DVec3, Vec3};

/// Pixels along a side of a tile.
pub const SIDE: u32 = 8;

/// The shading points of a tile: what they have in common, and how many there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TilePoints {
    /// Bounds of all.
    pub bounds: TileBounds,
    /// Points.
    pub count: u64,
    /// Points at which the plain cosine and the lobe have a weight.
    pub weighted: [u64; 2],
}

impl Default for TilePoints {
    fn default() -> Self {
        Self::NONE
    }
}

impl TilePoints {
    /// No points.
    pub const NONE: Self = Self { bounds: TileBounds::EMPTY, count: 0, weighted: [0; 2] };

    /// Adds a point.
    pub fn add(&mut self, position: Vec3, frame: &ShadingFrame, reflectance: &Reflectance) {
        let bounds = &mut self.bounds;
        self.count += 1;
        bounds.position.add(position);
        bounds.normal.add(frame.z.as_vec3());
        let weights = [reflectance.diffuse, reflectance.specular];
        for (k, weight) in weights.into_iter().enumerate() {
            bounds.weights[k] = bounds.weights[k].max(weight);
            self.weighted[k] += u64::from(weight.max_element() > 0.0);
        }
        if weights[1].max_element() > 0.0 {
            let [x, y, z] = [frame.x, frame.y, frame.z].map(|axis| axis.as_vec3());
            let m = &reflectance.lobe.m_inv;
            bounds.rows[0].add(x * m.xx + z * m.xz);
            bounds.rows[1].add(y * m.yy);
            bounds.rows[2].add(x * m.zx + z * m.zz);
            bounds.determinant = bounds.determinant.max(m.determinant());
        }
    }
}

/// An emitter that may reach a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Index of the emitter.
    pub emitter: usize,
    /// Whether by the plain cosine and by the lobe.
    pub lobes: [bool; 2],
}

/// Why the points of a tile do not gather from an emitter by one of their lobes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Listed,
    Behind,
    BelowHorizon,
    UnderTolerance,
    NoLobe,
}

/// The emitters and clusters of emitters that may reach a tile, in their order.
#[derive(Clone, Debug, Default)]
pub struct LightList {
    /// The emitters outside of clusters.
    pub listed: Vec<Listed>,
    /// The clusters.
    pub clusters: Vec<ListedCluster>,
    /// What the tile's decisions about clusters leave for each point.
    pub budget: ClusterBudget,
    /// What clusters send to all of its points, about its middle in the tree's unit.
    pub local: Local,
    /// That middle.
    pub middle: Vec3,
    /// How many clusters do.
    pub locals: u32,
    /// Clusters visited for the tile.
    pub visited: u32,
    /// What the skipped ones leave of the tolerance for lights that are integrated, W·sr⁻¹·m⁻².
    pub tolerance: f32,
    /// The same for clusters.
    pub cluster_tolerance: f32,
    fates: Vec<[Fate; 2]>,
    buckets: Vec<[u32; 2]>,
}

impl LightList {
    /// Decides for the points of a tile. The skipped lights together send them less than the part of `tolerance` that is taken
    /// off it.
    pub fn fill(&mut self, prepared: &Prepared, tolerance: f32, points: &TilePoints) {
        let skips = prepared.features.skips;
        let both_horizons = prepared.features.true_horizon;
        self.tolerance = tolerance;
        self.fates.clear();
        self.buckets.clear();
        self.listed.clear();
        self.clusters.clear();
        self.budget = ClusterBudget::default();
        self.visited = 0;
        self.locals = 0;
        let apart = prepared.clustered.apart.iter().map(|&emitter| emitter as usize);
        if !skips.by_tile() {
            self.listed.extend(apart.map(|emitter| Listed { emitter, lobes: [true; 2] }));
            self.share_tolerance(prepared);
            return;
        }
        let mut counts = [0; BUCKETS as usize];
        for emitter in apart.clone() {
            let (fates, bounds) = decide(&points.bounds, &prepared.boxes[emitter], skips, both_horizons);
            let buckets: [u32; 2] = core::array::from_fn(|k| {
                let bucket =
                    if fates[k] == Fate::Listed { bucket(bounds[k] / (tolerance * SKIP_SHARE)) } else { BUCKETS };
                if bucket < BUCKETS {
                    counts[bucket as usize] += 1;
                }
                bucket
            });
            self.fates.push(fates);
            self.buckets.push(buckets);
        }
        if skips.under_tolerance {
            let (first, spent) = first_skipped(&counts);
            self.tolerance *= 1.0 - spent * SKIP_SHARE;
            for (fates, buckets) in self.fates.iter_mut().zip(&self.buckets) {
                for (fate, &bucket) in fates.iter_mut().zip(buckets) {
                    if *fate == Fate::Listed && bucket >= first && bucket < BUCKETS {
                        *fate = Fate::UnderTolerance;
                    }
                }
            }
        }
        for (emitter, fates) in apart.zip(&self.fates) {
            let lobes = fates.map(|fate| fate == Fate::Listed);
            if lobes != [false; 2] {
                self.listed.push(Listed { emitter, lobes });
            }
        }
        self.share_tolerance(prepared);
    }

    /// Parts the tolerance between clusters and the lights that are integrated.
    fn share_tolerance(&mut self, prepared: &Prepared) {
        self.cluster_tolerance = 0.0;
        if prepared.features.skips.clusters {
            self.cluster_tolerance = self.tolerance * CLUSTER_PART;
            self.tolerance -= self.cluster_tolerance;
        }
    }

    /// Lists the clusters of several tiles, of which there may be as many as the processor has lanes.
    pub fn fill_clusters(tiles: &mut [(&mut Self, &TilePoints)], prepared: &Prepared, processor: Processor) {
        let tree = &prepared.clustered.tree;
        let receiver =
            |points: &TilePoints| Receiver::of_tile(&points.bounds, prepared.features.true_horizon, tree.per_metre);
        let receivers: Vec<Receiver> = tiles.iter().map(|(_, points)| receiver(points)).collect();
        let mut tolerance = [1.0; MAX_LANES];
        tolerance.iter_mut().zip(tiles.iter()).for_each(|(tolerance, (list, _))| *tolerance = list.cluster_tolerance);
        let lists = Lists::new(processor, tree.view(), &receivers, &tolerance);
        for (lane, (list, _)) in tiles.iter_mut().enumerate() {
            list.visited = lists.visited(lane);
            list.budget = lists.budget(lane);
            list.middle = receivers[lane].position.middle;
            (list.local, list.locals) = lists.local(lane);
            list.clusters.clear();
            list.clusters.extend(lists.of_tile(lane));
        }
    }

    /// Counts the integrals that the tile's points skip.
    pub(super) fn count(&self, prepared: &Prepared, points: &TilePoints, counters: &mut Counters) {
        for (&emitter, fates) in prepared.clustered.apart.iter().zip(&self.fates) {
            let stats = &mut counters.lights[prepared.emitters[emitter as usize].light];
            for (fate, &weighted) in fates.iter().zip(&points.weighted) {
                let weighted = if prepared.features.skips.lobes { weighted } else { points.count };
                let rest = points.count - weighted;
                match fate {
                    Fate::Listed => {}
                    Fate::NoLobe => stats.no_lobe += points.count,
                    // Found before anything is known of the lobe.
                    Fate::Behind => {
                        stats.behind += points.count;
                        stats.behind_tile += points.count;
                    }
                    Fate::BelowHorizon => {
                        stats.below_horizon += weighted;
                        stats.below_tile += weighted;
                        stats.no_lobe += rest;
                    }
                    Fate::UnderTolerance => {
                        stats.under_tolerance += weighted;
                        stats.no_lobe += rest;
                    }
                }
            }
        }
    }
}

/// What becomes of the plain cosine and of the lobe, the tolerance aside, and bounds of what they reflect, W·sr⁻¹·m⁻².
fn decide(tile: &TileBounds, light: &LightBox, skips: Skips, both_horizons: bool) -> ([Fate; 2], [f32; 2]) {
    let offsets = Offsets::new(tile, light);
    let mut bounds = [0.0; 2];
    if skips.behind && offsets.is_behind(light) {
        return ([Fate::Behind; 2], bounds);
    }
    let mut fates = [Fate::Listed; 2];
    let under_surface = skips.below_horizon && offsets.is_below(light, &tile.normal);
    for k in 0..2 {
        let brightest = (tile.weights[k] * light.radiance).max_element();
        if brightest <= 0.0 {
            if skips.lobes {
                fates[k] = Fate::NoLobe;
            }
            continue;
        }
        let under_lobe = || skips.below_horizon && offsets.is_below(light, &tile.rows[2]);
        let below = if k == 0 { under_surface } else { both_horizons && under_surface || under_lobe() };
        if below {
            fates[k] = Fate::BelowHorizon;
        } else if skips.under_tolerance {
            let bound = if k == 0 { offsets.diffuse_bound(tile, light) } else { offsets.specular_bound(tile, light) };
            bounds[k] = bound * brightest;
        }
    }
    (fates, bounds)
}

/// The box around an emitter, whichever way it turns.
pub fn light_box(emitter: &Emitter) -> LightBox {
    let placement = &emitter.placement;
    let x = placement.x.normalize_or(DVec3::X);
    let z = placement.normal().normalize_or(x.any_orthonormal_vector());
    let y = z.cross(x);
    let bounds = emitter.shape.bounds();
    let flat = |center: DVec2, half: DVec2| {
        // A light need not be square to its axes.
        let (sheared_x, sheared_y) = (placement.y.dot(x).abs(), placement.y.dot(y).abs());
        let half = DVec3::new(placement.x.length() * half.x + sheared_x * half.y, sheared_y * half.y, 0.0);
        (placement.point(center), half, emitter.shape.area() * placement.normal().length())
    };
    let scale = placement.x.length();
    let (center, half, area) = match (emitter.facing, emitter.form) {
        (Facing::Fixed, _) => flat(bounds.center(), bounds.size() * 0.5),
        (_, Form::Sphere { radius }) => {
            let radius = radius * scale;
            (placement.origin, DVec3::splat(radius), 2.0 * PI * radius * radius)
        }
        (facing, Form::Tube { radius, length }) => {
            let (radius, length) = (radius * scale, length * scale);
            let area = match facing {
                Facing::Side { .. } => 2.0 * radius * length,
                Facing::End { .. } => PI * radius * radius,
                _ => 2.0 * PI * radius * (length + radius),
            };
            (placement.origin, DVec3::new(0.5 * length, radius, radius), area)
        }
        (_, Form::Outline | Form::Rectangle | Form::Disc) => flat(bounds.center(), bounds.size() * 0.5),
    };
    let outward = 1.0 + f64::from(f32::EPSILON);
    LightBox {
        center: center.as_vec3(),
        area: (area * outward) as f32,
        x: x.as_vec3(),
        half_x: (half.x * outward) as f32,
        y: y.as_vec3(),
        half_y: (half.y * outward) as f32,
        z: z.as_vec3(),
        half_z: (half.z * outward) as f32,
        radiance: emitter.radiance,
        one_sided: u32::from(emitter.facing == Facing::Fixed && !emitter.two_sided),
    }
}
