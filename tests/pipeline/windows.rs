//! Work in windows: where a driver ends the loops of a shader early, as Mesa's llvmpipe does after 65535 rounds, pictures and
//! measurements are what they would be without that.

use crate::backends::{brightest, floor, gpu, light, render, same_stats};
use crate::cases::{Rng, blob, ring};
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gpu::layout::{MeterPoint, Reading};
use glyphlight::backend::gpu::{AdapterChoice, GpuBackend};
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, BackendError, Settings, Technique};
use glyphlight::film::Film;
use glyphlight::light::AreaLight;
use glyphlight::scene::{Material, Scene};
use glyphlight::shape::Shape;

/// Rounds of loops after which llvmpipe leaves them all.
const ROUNDS: f32 = 65_535.0;
/// What differing orders of the sums may do to a value.
const ROUNDING: f32 = 2e-5;

fn standing(shape: Shape) -> AreaLight {
    light(shape, DVec3::new(0.0, 1.2, 0.0), DVec3::ZERO, DVec3::ONE)
}

/// `n` × `n` rings of that many curves.
fn rings(n: usize, curves: usize) -> Shape {
    let mut rng = Rng(3);
    let place = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let contours =
        (0..n * n).map(|i| ring(&mut rng, DVec2::new(place(i % n), place(i / n)), 0.8 / n as f64, curves, false));
    Shape::from_contours(contours.collect()).unwrap()
}

fn settings(technique: Technique, tolerance: f32) -> Settings {
    Settings { width: 16, height: 11, samples: 2, tolerance, technique, ..Settings::default() }
}

fn worst(a: &Film, b: &Film) -> f32 {
    let all = |film: &Film| -> Vec<f32> { film.diffuse.iter().chain(&film.specular).flatten().copied().collect() };
    all(a).iter().zip(all(b)).fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

fn is_llvmpipe(gpu: &GpuBackend) -> bool {
    gpu.device().contains("llvmpipe")
}

/// Points that visit more nodes than the driver goes rounds.
#[test]
fn a_long_walk_leaves_no_pixel_dark() {
    let Some(gpu) = gpu() else { return };
    let scene = |n| floor(Material { alpha: 0.3, ..Material::default() }, standing(rings(n, 16)));
    let settings = settings(Technique::Tree, 1e-12);
    let (full, other) = (scene(52), scene(51));
    let (cpu, shaders) = (render(&CpuBackend, &full, &settings), render(gpu, &full, &settings));
    let most = shaders.parts.iter().fold(0.0_f32, |most, &parts| most.max(parts));
    assert!(most > ROUNDS, "{most} nodes of a sample at most");
    assert!(brightest(&shaders.film) > 0.05);
    let off = worst(&cpu.film, &shaders.film);
    assert!(off < ROUNDING, "{off}");
    assert!(shaders.stats.windows > 1 || !is_llvmpipe(gpu));
    assert_eq!(cpu.stats.windows, 1);
    // The counters are of one pass over all lights, whatever it took.
    assert_eq!(cpu.stats.shaded, shaders.stats.shaded);
    assert!(same_stats(&cpu.stats, &glyphlight::backend::Stats { nodes: cpu.stats.nodes, ..shaders.stats }));
    assert!(worst(&render(&CpuBackend, &other, &settings).film, &shaders.film) > ROUNDING);
}

/// The published techniques go their rounds by curves and edges.
#[test]
fn long_sums_over_curves_are_whole() {
    let Some(gpu) = gpu() else { return };
    let scene = |n| floor(Material { alpha: 0.3, ..Material::default() }, standing(rings(n, 32)));
    let (scene, other) = (scene(4), scene(3));
    for technique in [Technique::Uniform { segments: 256 }, Technique::Kuge { eps: Some(1e-9) }] {
        let settings = settings(technique, 1e-4);
        let (cpu, shaders) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
        let most = shaders.parts.iter().fold(0.0_f32, |most, &parts| most.max(parts));
        assert!(most > ROUNDS, "{technique}: {most} edges of a sample at most");
        let off = worst(&cpu.film, &shaders.film);
        assert!(off < 5.0 * ROUNDING, "{technique}: {off}");
        assert!(worst(&render(&CpuBackend, &other, &settings).film, &shaders.film) > 5.0 * ROUNDING, "{technique}");
    }
}

/// One curve of more edges than that: no window is shorter.
#[test]
fn what_no_window_helps_is_an_error() {
    let Some(gpu) = gpu() else { return };
    if !is_llvmpipe(gpu) {
        return;
    }
    let scene = floor(Material::default(), standing(rings(1, 3)));
    let at = |segments| gpu.render(&scene, &settings(Technique::Uniform { segments }, 1e-4));
    let refused = at(100_000);
    let message = refused.as_ref().err().map(ToString::to_string).unwrap_or_default();
    assert!(matches!(refused, Err(BackendError::Rounds { .. })), "{message}");
    assert!(message.contains("llvmpipe") && message.contains("CPU"), "{message}");
    assert!(at(20_000).is_ok_and(|rendering| rendering.stats.windows > 1));
    assert!(at(6).is_ok_and(|rendering| rendering.stats.windows == 1));
}

fn scene_of(shapes: impl Iterator<Item = Shape>) -> Scene {
    let mut scene = floor(Material::default(), standing(rings(1, 3)));
    scene.lights = shapes.map(standing).collect();
    scene
}

fn divided(windows: u32) -> GpuBackend {
    GpuBackend::new(AdapterChoice::Any).unwrap().in_windows(windows)
}

/// Pictures in windows: what is not integrated, expansions of clusters and mosaics, is added once, and skips are counted once.
#[test]
fn pictures_in_windows_are_the_same() {
    let Some(gpu) = gpu() else { return };
    let in_parts = divided(3);
    let settings = settings(Technique::Tree, 1e-3);
    let scenes = crate::backends::scenes()
        .into_iter()
        .step_by(3)
        .chain([("signs, some with pictures", crate::clusters::mixed(200))]);
    let mut moved = 0;
    for (name, scene) in scenes {
        let (whole, parts) = (render(gpu, &scene, &settings), render(&in_parts, &scene, &settings));
        let expected = if scene.lights.is_empty() { 1 } else { 3 };
        assert_eq!((whole.stats.windows, parts.stats.windows), (1, expected), "{name}");
        let off = worst(&whole.film, &parts.film);
        assert!(off < 2.0 * settings.tolerance + ROUNDING, "{name}: {off}");
        let nodes = whole.stats.nodes;
        assert!(same_stats(&whole.stats, &glyphlight::backend::Stats { nodes, ..parts.stats }), "{name}");
        assert_eq!(whole.stats.clusters, parts.stats.clusters, "{name}");
        if let Some(first) = scene.lights.first() {
            let mut other = scene.clone();
            other.lights[0].placement.origin = first.placement.origin + DVec3::X * 0.2;
            moved += usize::from(worst(&render(gpu, &other, &settings).film, &parts.film) > 1e-2);
        }
    }
    assert!(moved > 2, "{moved}");
}

/// Techniques whose integrals are no sums over elements are not divided, whatever is asked for.
#[test]
fn what_cannot_be_divided_is_whole() {
    let Some(gpu) = gpu() else { return };
    let scene = floor(Material { alpha: 0.3, ..Material::default() }, standing(rings(2, 8)));
    let technique = Technique::Quad { mask: 64 };
    let settings = settings(technique, 1e-3);
    let (whole, parts) = (render(gpu, &scene, &settings), render(&divided(3), &scene, &settings));
    assert_eq!((whole.film, whole.stats.windows), (parts.film, parts.stats.windows));
    assert!(brightest(&render(gpu, &scene, &settings).film) > 0.05);
}

/// The largest difference of two readings of a point.
fn apart(a: &[Reading], b: &[Reading]) -> f32 {
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| most.max((a.diffuse.x - b.diffuse.x).abs()).max((a.specular.x - b.specular.x).abs()))
}

/// Windows that end anywhere: between lights, nodes and in the middle of a cubic.
#[test]
fn any_number_of_windows_gives_the_same() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Rng(8);
    let scene = scene_of((0..12).map(|_| blob(&mut rng)));
    let divided_backends = [2, 7, 200].map(|windows| (windows, divided(windows)));
    for technique in
        [Technique::Tree, Technique::Textured, Technique::Kuge { eps: None }, Technique::Uniform { segments: 6 }]
    {
        let prepared = Prepared::new(&scene, &settings(technique, 1e-4)).unwrap();
        let points: Vec<MeterPoint> = (0..960)
            .map(|i| {
                let emitter = i % prepared.emitters.len();
                let normal = rng.direction();
                let view = rng.direction();
                let distance = rng.log_within(1e-3, 3.0);
                let position = prepared.emitters[emitter].placement.origin + rng.direction() * distance;
                MeterPoint {
                    position: position.as_vec3(),
                    emitter: emitter as u32,
                    normal: normal.as_vec3(),
                    alpha: rng.log_within(1e-3, 1.0) as f32,
                    view: (view * view.dot(normal).signum()).as_vec3(),
                    tolerance: 1e-4,
                }
            })
            .collect();
        let nodes = |readings: &[Reading]| readings.iter().map(|r| u64::from(r.diffuse_nodes + r.specular_nodes)).sum();
        let whole = gpu.measure(&prepared, &points).unwrap();
        let whole_nodes: u64 = nodes(&whole);
        assert!(whole.iter().filter(|r| r.diffuse.x > 0.01).count() > 100);
        for (windows, backend) in &divided_backends {
            let divided = backend.measure(&prepared, &points).unwrap();
            // Each is within the tolerance, where the technique has one.
            let off = apart(&whole, &divided);
            assert!(off < 2e-4 + ROUNDING, "{technique}, {windows} windows: {off}");
            if technique == Technique::Tree {
                assert!(nodes(&divided) > whole_nodes, "{windows} windows: not divided");
            }
        }
        // Those of the points beside.
        let mut turned = whole.clone();
        turned.rotate_left(1);
        assert!(apart(&whole, &turned) > 0.1, "{technique}");
    }
}
