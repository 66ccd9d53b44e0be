//! One LTC integral per pixel: what a light costs by the number of its curves.
//!
//! The floor of a 1024 × 1024 picture, alpha 0.25, lights standing 0.15 m above it. Every light goes the same way; the
//! rectangle is the unit to compare with. `integral` times the integral alone on one thread, at a hundredth of the
//! pixels; `technique` does so by every technique; `picture` the whole shading stage of a metal floor on each backend. Run: `cargo bench --bench integral`.

#![allow(clippy::print_stdout, reason = "a backend that is skipped is said aloud")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::emitter::Emitter;
use glyphlight::backend::gather::Images;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, BackendError, Settings, Technique};
use glyphlight::brdf::ltc::Table;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{Align, TextStyle, layout};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;
use std::hint::black_box;
use std::time::Duration;

const PARAGRAPH: &str = "Light in the shape of\nletters falls on every\nfloor that it can see,\nand the farther it is,\nthe softer it becomes.";

fn text(text: &str, size: f64) -> Shape {
    let font = Font::bundled("DejaVu Sans").expect("bundled");
    let style = TextStyle { size, align: Align::Center, ..TextStyle::default() };
    layout(text, &[font], &style).expect("Latin text").shape
}

/// The four lights, each moved to stand 0.15 m above the floor.
fn lights() -> Vec<(&'static str, Shape)> {
    let lights = vec![
        ("rectangle", Shape::rectangle(DVec2::new(-0.7, 0.0), DVec2::new(0.7, 1.4))),
        ("glyph &", text("&", 1.9)),
        ("line of 20 glyphs", text("Light from letters all", 0.38)),
        ("paragraph of 100 glyphs", text(PARAGRAPH, 0.36)),
    ];
    let stand = |shape: Shape| {
        let up = DVec2::new(0.0, 0.15 - shape.bounds().min.y);
        shape.transformed(glam::DAffine2::from_translation(up))
    };
    lights.into_iter().map(|(name, shape)| (name, stand(shape))).collect()
}

fn settings(tolerance: f32) -> Settings {
    Settings { width: 1024, height: 1024, samples: 1, tolerance, ..Settings::default() }
}

/// A metal floor under the light.
fn scene(shape: &Shape) -> Scene {
    let light = AreaLight {
        name: "light".into(),
        layers: vec![Layer { shape: shape.clone(), radiance: DVec3::ONE, opacity: 1.0, picture: None }],
        form: Form::Outline,
        placement: Placement::new(DVec3::ZERO, DVec3::ZERO, DVec2::ONE),
        two_sided: false,
    };
    let camera =
        Camera { position: DVec3::new(1.5, 3.0, 6.5), look_at: DVec3::new(0.0, 0.2, 0.8), up: DVec3::Y, fov_y: 50.0 };
    let metal = Material { base_color: [1.0; 3], metallic: 1.0, alpha: 0.25, ..Material::default() };
    Scene {
        camera,
        triangles: plane(DVec3::ZERO, DVec3::Y, [20.0; 2], 1.0, 0).to_vec(),
        materials: vec![metal],
        textures: vec![],
        lights: vec![light],
        background: [0.0; 3],
    }
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
            for (name, shape) in lights() {
                let prepared = Prepared::new(&scene(&shape), &settings(tolerance)).expect("a scene");
                let points = floor_points(&prepared);
                let emitter = &prepared.emitters[0];
                group.throughput(Throughput::Elements(points.len() as u64));
                group.bench_function(BenchmarkId::from_parameter(name), |b| {
                    b.iter(|| black_box(integrate(emitter, black_box(&points), tolerance, lobes)));
                });
            }
            group.finish();
        }
    }
}

/// What each technique takes for the same lights: the tree at tolerance 1e-3, the others at their own parameters.
fn technique(c: &mut Criterion) {
    const TECHNIQUES: [&str; 9] =
        ["tree", "kuge", "kuge:1e-4", "uniform:6", "uniform:18", "uniform:30", "quad:512", "pal", "representative"];
    for (light, shape) in lights().into_iter().take(3) {
        let scene = scene(&shape);
        let mut group = c.benchmark_group(format!("technique, specular, {light}"));
        for name in TECHNIQUES {
            let technique: Technique = name.parse().expect("a technique");
            let settings = Settings { technique, ..settings(1e-3) };
            let prepared = Prepared::new(&scene, &settings).expect("a scene");
            let points = floor_points(&prepared);
            let emitter = &prepared.emitters[0];
            group.throughput(Throughput::Elements(points.len() as u64));
            group.bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| black_box(integrate(emitter, black_box(&points), 1e-3, true)));
            });
        }
        group.finish();
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
        for (light, shape) in lights() {
            let scene = scene(&shape);
            group.bench_function(BenchmarkId::from_parameter(light), |b| {
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

criterion_group!(benches, integral, technique, picture);
criterion_main!(benches);
