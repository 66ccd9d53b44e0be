//! Clusters of lights: what stands for many lights is them, within the bound that was asked for, against the yardstick.

#[cfg(feature = "gpu")]
mod gpu;
mod packets;

use crate::cases::{Rng, blob};
use glam::{DVec2, DVec3, Mat4, Vec3};
use glyphlight::backend::clusters::{Clustered, FEWEST};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gather::Images;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, Rendering, Settings, Skips, Technique};
use glyphlight::brdf::ltc::Table;
use glyphlight::film::Film;
use glyphlight::kernel::cluster::{Cluster, ClusterBudget, Clusters, LOCAL_SHARE};
use glyphlight::kernel::cluster_list::{ListedCluster, TileWalk};
use glyphlight::kernel::cluster_walk::ClusterSums;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::local::Local;
use glyphlight::kernel::receiver::{LOBES, Receiver};
use glyphlight::kernel::reflect::Reflectance;
use glyphlight::kernel::surface::SurfacePoint;
use glyphlight::kernel::tile::TileBounds;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::picture::Picture;
use glyphlight::scene::signs::{SignsOptions, signs};
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;
use std::sync::Arc;

/// What f32 leaves of an integral's last digits.
const FLOOR: f64 = 2e-5;

const NO_CLUSTERS: fn() -> Skips = || Skips { clusters: false, ..Skips::default() };

fn settings(samples: u32) -> Settings {
    Settings { width: 64, height: 48, samples, ..Settings::default() }
}

fn render(scene: &Scene, settings: &Settings) -> Rendering {
    CpuBackend.render(scene, settings).unwrap()
}

fn brightest(film: &Film) -> f32 {
    film.diffuse.iter().chain(&film.specular).flatten().copied().fold(0.0, f32::max)
}

/// What a point gathers from clusters.
#[derive(Default)]
struct Gathered {
    radiance: DVec3,
    /// Lights that it must integrate itself, with the lobes, a bit for each.
    handed: Vec<(usize, u32)>,
}

/// What a tile lists, alone.
struct Lister {
    listed: Vec<ListedCluster>,
    /// What clusters send to all of its points, and how many those are.
    local: Local,
    locals: u32,
    /// Clusters visited.
    visited: u32,
    /// The middle of the tile.
    middle: Vec3,
    /// What is left to each point.
    budget: ClusterBudget,
}

impl Lister {
    fn new(clusters: Clusters<'_>, tile: &Receiver, tolerance: f32) -> Self {
        let mut walk = TileWalk::new(0.0_f32);
        let (mut listed, mut budget) = (Vec::new(), ClusterBudget::default());
        while let Some(found) = walk.go_on(clusters, tile, tolerance, &mut budget, true) {
            let bits = |lobes: [bool; LOBES]| u32::from(lobes[0]) | u32::from(lobes[1]) << 1;
            listed.push(ListedCluster { cluster: found.cluster, whole: bits(found.whole), open: bits(found.open) });
        }
        let TileWalk { visited, local, locals, .. } = walk;
        Self { listed, local, locals, visited, middle: tile.position.middle, budget }
    }
}

/// What a point gathers from the clusters that its tile has listed.
fn gather(clusters: Clusters<'_>, point: &Receiver, tile: &Lister, tolerance: f32) -> Gathered {
    let mut gathered = ClusterSums::new(0.0_f32);
    let mut budget = tile.budget;
    gathered.add_whole(clusters, point, &tile.listed, true);
    gathered.add_local(point, tile.middle, &tile.local, true);
    let mut handed = Vec::new();
    for &listed in tile.listed.iter().filter(|listed| listed.open != 0) {
        if let Some(light) = gathered.decide(clusters, point, listed, tolerance, &mut budget, true) {
            handed.push((light.emitter as usize, u32::from(light.points[0]) | u32::from(light.points[1]) << 1));
        }
    }
    let mut radiance = Vec3::ZERO;
    for lobe in (0..LOBES).filter(|&lobe| point.shines[lobe]) {
        let field = &point.fields[lobe];
        radiance += Vec3::from(gathered.sums[lobe]) * (field.weight * field.scale);
    }
    Gathered { radiance: radiance.as_dvec3(), handed }
}

/// What a point gathers from clusters that it has listed for itself, and how many it visited for that.
fn gather_alone(clusters: Clusters<'_>, point: &Receiver, tolerance: f32) -> (Gathered, u32) {
    let tile = Lister::new(clusters, point, tolerance);
    (gather(clusters, point, &tile, tolerance), tile.visited)
}

fn scene(lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera { position: DVec3::new(0.1, -0.2, 0.3), look_at: DVec3::NEG_Z, up: DVec3::Y, fov_y: 50.0 },
        triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        lights,
        background: [0.0; 3],
    }
}

/// Coloured lights in a cloud, their normals within `spread` degrees of +z; some are two-sided.
fn cloud(rng: &mut Rng, count: usize, spread: f64, two_sided: bool) -> Vec<AreaLight> {
    let flat = rng.log_within(0.05, 1.0);
    let size = rng.log_within(0.02, 0.4);
    let one = |i: usize| {
        let turn = DVec3::new(rng.within(-spread, spread), rng.within(-spread, spread), rng.within(-180.0, 180.0));
        let origin = rng.direction() * DVec3::new(1.0, 1.0, flat);
        let color = DVec3::new(rng.unit(), rng.unit(), rng.unit()) * rng.log_within(0.1, 3.0);
        AreaLight {
            name: format!("{i}"),
            layers: vec![Layer { shape: blob(rng), radiance: color, opacity: 1.0, picture: None }],
            form: Form::Outline,
            placement: Placement::new(origin, turn, DVec2::splat(size)),
            two_sided: two_sided && i.is_multiple_of(2),
        }
    };
    (0..count).map(one).collect()
}

/// A shading point relative to the camera.
struct Point {
    position: DVec3,
    frame: ShadingFrame,
    reflectance: Reflectance,
}

impl Point {
    fn new(position: DVec3, normal: DVec3, view: DVec3, alpha: f32, metallic: f32) -> Self {
        let point = SurfacePoint {
            position: position.as_vec3(),
            normal: normal.as_vec3(),
            view: view.as_vec3(),
            base_color: Vec3::new(0.8, 0.5, 0.9),
            metallic,
            alpha,
            specular: 1.0,
        };
        let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
        let lobe = Table::shipped().lobe(alpha, frame.cos_theta as f32);
        Self { position: point.position.as_dvec3(), frame, reflectance: point.reflectance(lobe) }
    }

    /// With a normal that looks at the origin more or less.
    fn random(rng: &mut Rng, position: DVec3) -> Self {
        let normal = (rng.direction() - position.normalize() * rng.within(0.0, 2.0)).normalize();
        let view = (rng.direction() + normal * rng.log_within(1e-3, 2.0)).normalize();
        let view = if view.dot(normal) < 0.0 { (view - normal * 2.0 * view.dot(normal)).normalize() } else { view };
        Self::new(position, normal, view, rng.log_within(0.01, 1.0) as f32, f32::from(u8::from(rng.unit() < 0.5)))
    }

    fn receiver(&self, per_metre: f32) -> Receiver {
        let axes = [self.frame.x, self.frame.y, self.frame.z].map(|axis| axis.as_vec3());
        Receiver::of_point(self.position.as_vec3(), axes, &self.reflectance, true, per_metre)
    }

    fn add_to(&self, bounds: &mut TileBounds) {
        let m = &self.reflectance.lobe.m_inv;
        let [x, y, z] = [self.frame.x, self.frame.y, self.frame.z].map(|axis| axis.as_vec3());
        bounds.position.add(self.position.as_vec3());
        bounds.normal.add(z);
        for (row, value) in bounds.rows.iter_mut().zip([x * m.xx + z * m.xz, y * m.yy, x * m.zx + z * m.zz]) {
            row.add(value);
        }
        bounds.determinant = bounds.determinant.max(m.determinant());
        bounds.weights[0] = bounds.weights[0].max(self.reflectance.diffuse);
        bounds.weights[1] = bounds.weights[1].max(self.reflectance.specular);
    }

    /// What both lobes reflect of all emitters, by the yardstick.
    fn truth(&self, prepared: &Prepared) -> DVec3 {
        let r = &self.reflectance;
        let mut sum = DVec3::ZERO;
        for emitter in &prepared.emitters {
            let Ok(images) = Images::new(emitter, &self.frame, self.position) else { continue };
            for (lobe, weight) in [(None, r.diffuse), (Some(&r.lobe), r.specular)] {
                if let Ok(integral) = images.integral(emitter, lobe, 1.0, &mut Budget::default()) {
                    sum += (weight * emitter.radiance).as_dvec3() * integral.value;
                }
            }
        }
        sum
    }

    /// What the clusters answer where nothing is handed on; `None` where something is.
    fn answer(&self, clusters: Clusters<'_>, tile: &Lister, tolerance: f32) -> Option<DVec3> {
        let gathered = gather(clusters, &self.receiver(clusters.per_metre), tile, tolerance);
        gathered.handed.is_empty().then_some(gathered.radiance)
    }
}

/// The clusters of a scene, and its emitters for the yardstick.
fn prepare(lights: Vec<AreaLight>) -> (Prepared, Prepared) {
    let scene = scene(lights);
    let with = |technique| Prepared::new(&scene, &Settings { technique, ..settings(1) }).unwrap();
    let mut ours = with(Technique::Tree);
    ours.clustered = Clustered::of(&ours.emitters);
    (ours, with(Technique::Exact))
}

/// The least bound at which the root alone answers for all lights, and what it answers.
fn root_answer(point: &Point, clusters: Clusters<'_>) -> Option<(f32, DVec3)> {
    let at = |exponent: f32| {
        let tolerance = exponent.exp2();
        let (gathered, visited) = gather_alone(clusters, &point.receiver(clusters.per_metre), tolerance);
        let alone = gathered.handed.is_empty() && visited == 1;
        // No cluster may have more than the greatest share of a tolerance.
        alone.then_some((tolerance * LOCAL_SHARE, gathered.radiance))
    };
    let (mut low, mut high) = (-40.0, 10.0);
    let mut best = at(high)?;
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        match at(middle) {
            Some(answer) => (high, best) = (middle, answer),
            None => low = middle,
        }
    }
    Some(best)
}

/// Counts the cases in which a root's answer is off by more than its bound, and those in which there was an expansion.
fn breaches(seed: u64, cases: usize, perturb: impl Fn(&mut Cluster)) -> (usize, usize) {
    let mut rng = Rng(seed);
    let (mut breaches, mut expansions) = (0, 0);
    for case in 0..cases {
        let spread = [0.0, 5.0, 20.0, 180.0][case % 4];
        let lights = cloud(&mut rng, 8 + case % 9, spread, case % 5 == 0);
        let (mut ours, exact) = prepare(lights);
        ours.clustered.tree.clusters.iter_mut().for_each(&perturb);
        for _ in 0..6 {
            let distance = rng.log_within(2.0, 200.0);
            // In front of most lights.
            let place = (rng.direction() + DVec3::Z * rng.within(0.0, 3.0)).normalize() * distance;
            let point = Point::random(&mut rng, place);
            let Some((bound, answer)) = root_answer(&point, ours.clustered.tree.view()) else { continue };
            let truth = point.truth(&exact);
            let error = (answer - truth).abs().max_element();
            // Both lobes are accepted out of one budget: each within the tolerance.
            breaches +=
                usize::from(error.is_nan() || error > 2.0 * f64::from(bound) + FLOOR * truth.max_element() + 1e-9);
            expansions += usize::from(answer != DVec3::ZERO);
        }
    }
    (breaches, expansions)
}

#[test]
fn an_expansion_is_within_its_bound() {
    let (breaches, expansions) = breaches(11, 100, |_| ());
    println!("{expansions} expansions of 600");
    assert_eq!(breaches, 0);
    assert!(expansions > 150);
}

#[test]
fn a_perturbed_moment_breaks_the_bound() {
    // The flux by 5 %; the place by a quarter of the cluster's width.
    let flux = breaches(11, 40, |c| c.moments = c.moments.map(|m| m * 1.05));
    let place = breaches(11, 40, |c| {
        let shift = 0.5 * c.half.x;
        c.moments = c.moments.map(|m| {
            let shifted = |column: glam::Vec4| column + glam::Vec4::new(shift * column.w, 0.0, 0.0, 0.0);
            Mat4::from_cols(shifted(m.x_axis), shifted(m.y_axis), shifted(m.z_axis), shifted(m.w_axis))
        });
    });
    println!("{flux:?} {place:?}");
    assert!(flux.0 > 5 && place.0 > 5);
}

/// Counts points of diffuse tiles at which the root's local expansion is off by more than its bound, and all such points. The tiles
/// are up to a third as large as the lights are far.
fn local_breaches(perturb: impl Fn(&mut Local)) -> (usize, usize) {
    let mut rng = Rng(53);
    let (mut breaches, mut answers) = (0, 0);
    for case in 0..60 {
        let (ours, exact) = prepare(cloud(&mut rng, 6 + case % 7, [0.0, 5.0, 20.0][case % 3], false));
        let tree = ours.clustered.tree.view();
        let distance = rng.log_within(2.0, 60.0);
        let place = (rng.direction() + DVec3::Z * rng.within(0.5, 3.0)).normalize() * distance;
        let middle = Point::random(&mut rng, place);
        let (extent, bend) = (rng.log_within(1e-3, 0.3) * distance, [0.0, 0.2][case % 2]);
        let points: Vec<Point> = (0..6)
            .map(|_| {
                let normal = (middle.frame.z + rng.direction() * bend).normalize();
                let position = middle.position + rng.direction() * rng.within(0.0, extent);
                let mut point = Point::new(position, normal, normal, 0.5, 0.0);
                point.reflectance.specular = Vec3::ZERO;
                point
            })
            .collect();
        let mut bounds = TileBounds::EMPTY;
        points.iter().for_each(|p| p.add_to(&mut bounds));
        let tile = Receiver::of_tile(&bounds, true, tree.per_metre);
        let alone = |exponent: f32| {
            let tile = Lister::new(tree, &tile, exponent.exp2());
            (tile.locals == 1 && tile.visited == 1).then_some(tile)
        };
        let (mut low, mut high) = (-40.0_f32, 10.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            *(if alone(middle).is_some() { &mut high } else { &mut low }) = middle;
        }
        let Some(mut tile) = alone(high) else { continue };
        perturb(&mut tile.local);
        let bound = f64::from(high.exp2() * LOCAL_SHARE);
        for point in &points {
            let truth = point.truth(&exact);
            let answer = gather(tree, &point.receiver(tree.per_metre), &tile, 1.0).radiance;
            let error = (answer - truth).abs().max_element();
            breaches += usize::from(error.is_nan() || error > bound + FLOOR * truth.max_element() + 1e-9);
            answers += 1;
        }
    }
    (breaches, answers)
}

#[test]
fn a_local_expansion_is_within_its_bound() {
    let (breaches, answers) = local_breaches(|_| ());
    // Values a tenth off, slopes of the wrong sign.
    let values = local_breaches(|local| local.terms.iter_mut().for_each(|t| t[..3].iter_mut().for_each(|t| *t *= 1.1)));
    let slopes = local_breaches(|local| local.terms.iter_mut().for_each(|t| t[3..].iter_mut().for_each(|t| *t = -*t)));
    println!("{breaches} breaches of {answers}; {values:?} and {slopes:?} perturbed");
    assert!(breaches == 0 && answers > 100);
    assert!(values.0 > 10 && slopes.0 > 10);
}

/// What points of random tiles answer, by clusters alone.
#[derive(Default)]
struct TileAnswers {
    answered: usize,
    /// Those off by more than the tolerance.
    breaches: usize,
    /// Clusters that stood for their lights at all points of a tile, each point having their expansion, or the tile.
    whole: usize,
    locals: usize,
}

fn tile_answers(perturb: impl Fn(&mut Local)) -> TileAnswers {
    let mut rng = Rng(31);
    let mut answers = TileAnswers::default();
    for case in 0..60 {
        let lights = cloud(&mut rng, 24, [10.0, 60.0, 180.0][case % 3], case % 5 == 0);
        let (ours, exact) = prepare(lights);
        let tree = ours.clustered.tree.view();
        let distance = rng.log_within(1.0, 30.0);
        let place = rng.direction() * distance;
        let middle = Point::random(&mut rng, place);
        let (extent, bend) = (rng.log_within(1e-3, 0.3) * distance, [0.0, 0.05][case % 2]);
        let alpha = rng.log_within(0.02, 1.0);
        let view = middle.frame.z + middle.frame.x * rng.within(0.0, 3.0);
        let points: Vec<Point> = (0..8)
            .map(|_| {
                let normal = (middle.frame.z + rng.direction() * bend).normalize();
                let position = middle.position
                    + middle.frame.x * rng.within(-extent, extent)
                    + middle.frame.y * rng.within(-extent, extent);
                let eye = (view * distance * 2.0 + middle.position - position).normalize();
                Point::new(position, normal, eye, (alpha * rng.within(1.0, 1.0 + bend)) as f32, 0.0)
            })
            .collect();
        let mut bounds = TileBounds::EMPTY;
        points.iter().for_each(|p| p.add_to(&mut bounds));
        let tile = Receiver::of_tile(&bounds, true, tree.per_metre);
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let mut tile = Lister::new(tree, &tile, tolerance);
            perturb(&mut tile.local);
            answers.whole += tile.listed.iter().filter(|l| l.whole != 0).count();
            answers.locals += tile.locals as usize;
            for point in &points {
                let Some(answer) = point.answer(tree, &tile, tolerance) else { continue };
                let truth = point.truth(&exact);
                let error = (answer - truth).abs().max_element();
                answers.answered += 1;
                let is_within = error <= f64::from(tolerance) + FLOOR * truth.max_element();
                answers.breaches += usize::from(!is_within);
            }
        }
    }
    answers
}

#[test]
fn every_point_of_a_tile_is_within_the_tolerance() {
    let TileAnswers { answered, breaches, whole, locals } = tile_answers(|_| ());
    println!("{answered} points answered by clusters alone, {whole} whole clusters, {locals} local");
    assert_eq!(breaches, 0);
    assert!(answered > 300 && whole > 200 && locals > 200);
}

#[test]
fn a_perturbed_local_expansion_breaks_the_tolerance() {
    let values = tile_answers(|local| local.terms.iter_mut().for_each(|t| t[..3].iter_mut().for_each(|t| *t *= 1.1)));
    let slopes = tile_answers(|local| local.terms.iter_mut().for_each(|t| t[3..].iter_mut().for_each(|t| *t = -*t)));
    println!("{} and {} breaches", values.breaches, slopes.breaches);
    assert!(values.breaches > 20 && slopes.breaches > 5);
}

/// Both sides of two-sided lights, some of them seen by points of one tile from either side, and lights with pictures.
pub fn mixed(count: usize) -> Scene {
    let words = [Shape::rectangle(DVec2::new(0.0, 0.0), DVec2::new(3.0, 1.0)), blob(&mut Rng(2))];
    let material = Material { base_color: [0.8, 0.7, 0.6], alpha: 0.3, ..Material::default() };
    let mut scene = signs(&words, &SignsOptions { count: count as u32, material, ..SignsOptions::default() });
    let texels = vec![[1.0, 0.2, 0.1, 1.0], [0.1, 0.3, 1.0, 1.0]].into_iter().map(glam::Vec4::from_array).collect();
    for (i, light) in scene.lights.iter_mut().enumerate() {
        light.two_sided = i % 3 == 0;
        if i % 7 == 0 {
            let bounds = light.layers[0].shape.bounds();
            let picture =
                Picture { low: bounds.min, high: bounds.max, width: 2, height: 1, texels: Clone::clone(&texels) };
            light.layers[0].picture = Some(Arc::new(picture));
        }
    }
    scene
}

fn worst(a: &Rendering, b: &Rendering) -> f32 {
    let sum = |r: &Rendering, i: usize| Vec3::from_array(r.film.diffuse[i]) + Vec3::from_array(r.film.specular[i]);
    (0..a.film.diffuse.len()).map(|i| (sum(a, i) - sum(b, i)).abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn a_picture_of_many_lights_is_within_the_tolerance() {
    for count in [FEWEST + 2, 150] {
        let scene = mixed(count);
        let ours = Settings { width: 48, height: 40, tolerance: 1e-3, ..settings(1) };
        let plain = Settings { tolerance: 1e-6, skips: NO_CLUSTERS(), ..ours };
        let (a, b) = (render(&scene, &ours), render(&scene, &plain));
        let off = worst(&a, &b);
        println!("{count} lights: off by {off:.1e} of {:.2}; {:?}", brightest(&b.film), a.stats.clusters);
        assert!(off <= 1e-3 && brightest(&b.film) > 0.02);
        assert!(a.stats.clusters.whole > 0 && b.stats.clusters.by_tile == 0);
        // Lights that are a tenth brighter show.
        let mut brighter = scene.clone();
        brighter.lights.iter_mut().for_each(|light| light.layers[0].radiance *= 1.1);
        assert!(worst(&render(&brighter, &ours), &b) > 1e-3);
    }
}

#[test]
fn every_integral_is_accounted_for() {
    let settings = Settings { width: 48, height: 40, tolerance: 1e-3, ..settings(2) };
    let stats = render(&mixed(150), &settings).stats;
    let skipped: u64 = stats.lights.iter().map(glyphlight::backend::LightStats::skipped).sum();
    let candidates: u64 = stats.lights.iter().map(|l| l.candidates).sum();
    let clustered: u64 = stats.lights.iter().map(|l| l.clustered).sum();
    assert_eq!(candidates - skipped, stats.integrals);
    assert!(clustered as f64 > 0.9 * candidates as f64, "{clustered} of {candidates}");
}

#[test]
fn few_lights_are_not_clustered() {
    let ours = Settings { width: 16, height: 16, tolerance: 1e-3, ..settings(1) };
    let plain = Settings { skips: NO_CLUSTERS(), ..ours };
    for (count, clustered) in [(FEWEST - 1, false), (FEWEST, true)] {
        let scene = mixed(count);
        let tree = Prepared::new(&scene, &ours).unwrap().clustered.tree;
        assert_eq!(!tree.clusters.is_empty(), clustered);
        let same = render(&scene, &ours).film == render(&scene, &plain).film;
        assert_eq!(same, !clustered);
    }
}

/// Through a light, on its edge, in its plane, in the middle of all lights, far away: no cluster answers with nonsense.
#[test]
fn hostile_places_are_answered() {
    let mut rng = Rng(77);
    for case in 0..30 {
        let (ours, exact) = prepare(cloud(&mut rng, 16, 180.0, case % 2 == 0));
        let tree = ours.clustered.tree.view();
        let emitter = &exact.emitters[case % exact.emitters.len()];
        let places = [
            emitter.placement.origin,
            emitter.placement.origin + emitter.placement.x * 5.0,
            emitter.placement.origin + emitter.placement.normal().normalize() * 1e-6,
            -DVec3::new(0.1, -0.2, 0.3),
            rng.direction() * 1e6,
        ];
        for place in places {
            let normal = rng.direction();
            let view = (normal + rng.direction() * 0.9).normalize();
            let point = Point::new(place, normal, view, 0.2, 0.0);
            let (gathered, _) = gather_alone(tree, &point.receiver(tree.per_metre), 1e-3);
            let mut answer = gathered.radiance;
            for (i, lobes) in gathered.handed {
                let emitter = &exact.emitters[i];
                let Ok(images) = Images::new(emitter, &point.frame, point.position) else { continue };
                let r = &point.reflectance;
                for (k, (lobe, weight)) in [(None, r.diffuse), (Some(&r.lobe), r.specular)].into_iter().enumerate() {
                    if let (Ok(integral), true) =
                        (images.integral(emitter, lobe, 1.0, &mut Budget::default()), lobes & 1 << k != 0)
                    {
                        answer += (weight * emitter.radiance).as_dvec3() * integral.value;
                    }
                }
            }
            let truth = point.truth(&exact);
            assert!((answer - truth).abs().max_element() <= 1e-3, "case {case} at {place}: {answer} for {truth}");
        }
    }
}

#[test]
fn signs_stand_on_a_floor_that_fills_the_picture() {
    let settings = Settings { width: 32, height: 24, ..settings(1) };
    for count in [1, 10, 50] {
        let scene = mixed(count);
        assert_eq!(scene.lights.len(), count);
        let stats = render(&scene, &settings).stats;
        assert_eq!(stats.shaded, 32 * 24);
        for light in &scene.lights {
            let bounds = light.layers[0].shape.bounds();
            for corner in [bounds.min, bounds.max] {
                assert!(light.placement.point(corner).y > 0.0);
            }
        }
    }
}
