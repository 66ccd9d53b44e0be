//! One LTC integral per pixel: what a light costs by the number of its curves.
//!
//! The floor of a 1024 × 1024 picture, alpha 0.25, lights standing 0.15 m above it. Every light goes the same way; the
//! rectangle is the unit to compare with. `integral` times the integral alone on one thread, at a hundredth of the
//! pixels; `picture` the whole shading stage of a metal floor on each backend. Run: `cargo bench --bench integral`. What each
//! technique takes, and how wrong it is, `glyphlight bench` tells.

#![allow(clippy::print_stdout, reason = "a backend that is skipped is said aloud")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::emitter::Emitter;
use glyphlight::backend::gather::Images;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, BackendError, Settings};
use glyphlight::brdf::ltc::Table;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::tree::Budget;
use glyphlight::scene::Scene;
use glyphlight::scene::trial::{self, Finish, Trial};
use std::hint::black_box;
use std::time::Duration;

/// Rectangle, glyph, line of text, paragraph.
const LIGHTS: [Trial; 4] = [Trial::Rectangle, Trial::Glyph, Trial::Line, Trial::Paragraph];

fn settings(tolerance: f32) -> Settings {
    Settings { width: 1024, height: 1024, samples: 1, tolerance, ..Settings::default() }
}

/// A metal floor under the light.
fn scene(trial: Trial) -> Scene {
    trial::scene(trial.layers().expect("a light"), Finish::Gloss(0.25))
}

/// Points of the floor and directions towards the eye, a thousandth of the picture's pixels, spread over it.
fn floor_points(prepared: &Prepared) -> Vec<(DVec3, ShadingFrame)> {
    let mut points = Vec::new();
    for i in 0..(1024 * 1024 / 97) {
        let pixel = i * 97;
        let (x, y) = (f64::from(pixel % 1024) + 0.5, f64::from(pixel / 1024) + 0.5);
        let direction = prepared.rays.direction((x / 512.0 - 1.0) as f32, (1.0 - y / 512.0) as f32).as_dvec3();
        if direction.y >= -1e-3 {
            continue;
        }
        let position = direction * (-3.0 / direction.y);
        if position.length() < 20.0 {
            points.push((position, ShadingFrame::new(DVec3::Y, -direction.normalize())));
        }
    }
    points
}

fn integrate(emitter: &Emitter, points: &[(DVec3, ShadingFrame)], tolerance: f32, lobes: bool) -> f64 {
    let table = Table::shipped();
    let mut sum = 0.0;
    for (position, frame) in points {
        let Ok(images) = Images::new(emitter, frame, *position) else { continue };
        let lobe = lobes.then(|| table.lobe(0.25, frame.cos_theta as f32));
        if let Ok(integral) = images.integral(emitter, lobe.as_ref(), tolerance, &mut Budget::default()) {
            sum += integral.value.x;
        }
    }
    sum
}

fn integral(c: &mut Criterion) {
    for (lobe, lobes) in [("specular", true), ("diffuse", false)] {
        for tolerance in [1e-3, 1e-4] {
            let mut group = c.benchmark_group(format!("integral, {lobe}, tolerance {tolerance:e}"));
            for trial in LIGHTS {
                let prepared = Prepared::new(&scene(trial), &settings(tolerance)).expect("a scene");
                let points = floor_points(&prepared);
                let emitter = &prepared.emitters[0];
                group.throughput(Throughput::Elements(points.len() as u64));
                group.bench_function(BenchmarkId::from_parameter(trial), |b| {
                    b.iter(|| black_box(integrate(emitter, black_box(&points), tolerance, lobes)));
                });
            }
            group.finish();
        }
    }
}

/// The shading stage of whole pictures.
fn picture(c: &mut Criterion) {
    let mut backends: Vec<(&str, Box<dyn Backend>)> = vec![("cpu", Box::new(CpuBackend))];
    match gpu() {
        Ok(gpu) => backends.push(("gpu", gpu)),
        Err(error) => println!("SKIPPED: the GPU backend: {error}"),
    }
    for (name, backend) in backends {
        let mut group = c.benchmark_group(format!("picture, {name}, tolerance 1e-3"));
        group.sample_size(10).throughput(Throughput::Elements(1024 * 1024));
        for trial in LIGHTS {
            let scene = scene(trial);
            group.bench_function(BenchmarkId::from_parameter(trial), |b| {
                b.iter_custom(|times| (0..times).map(|_| shading(backend.as_ref(), &scene)).sum());
            });
        }
        group.finish();
    }
}

fn shading(backend: &dyn Backend, scene: &Scene) -> Duration {
    let stats = backend.render(scene, &settings(1e-3)).expect("a picture").stats;
    let stage = stats.stages.iter().find(|(name, _)| name == "shading").expect("a shading stage");
    Duration::from_secs_f64(stage.1)
}

#[cfg(feature = "gpu")]
fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    use glyphlight::backend::gpu::{AdapterChoice, GpuBackend};
    Ok(Box::new(GpuBackend::new(AdapterChoice::Any)?))
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NoAdapter("built without the feature `gpu`".into()))
}

criterion_group!(benches, integral, picture);
criterion_main!(benches);
