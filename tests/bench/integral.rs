//! One LTC integral per pixel: what a light costs by the number of its curves.
//!
//! The floor of a 1024 × 1024 picture, alpha 0.25, lights standing 0.15 m above it. Every light goes the same way; the
//! rectangle is the unit to compare with. `integral` times the integral alone on one thread, in blocks of 4 × 4 pixels spread over
//! the picture; `AVX2` and its like the same in the packets of this processor and of lesser ones, `one by one` without packets;
//! `far` the same of more and more glyphs far away; `picture` the whole shading stage of a metal floor on each backend; `lights`
//! that of a floor under 1 to 1000 signs, clustered and one by one. Run: `cargo bench --bench integral`. What each technique
//! takes, and how wrong it is, `glyphlight bench` tells.

#![allow(clippy::print_stdout, reason = "a backend that is skipped is said aloud")]

mod gpu;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DAffine2, DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::emitter::Emitter;
use glyphlight::backend::gather::Images;
use glyphlight::backend::packets::{PointPacket, Question, tree_of};
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, Settings, Skips};
use glyphlight::brdf::ltc::{Lobe, Table};
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::packet::{MAX_LANES, Processor};
use glyphlight::kernel::tree::Budget;
use glyphlight::light::Placement;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::scene::signs::{SignsOptions, signs};
use glyphlight::scene::trial::{self, Finish, Trial};
use glyphlight::scene::{Material, Scene};
use glyphlight::shape::Shape;
use gpu::gpu;
use std::hint::black_box;
use std::time::Duration;

/// Rectangle, glyph, line of text, paragraph.
const LIGHTS: [Trial; 4] = [Trial::Rectangle, Trial::Glyph, Trial::Line, Trial::Paragraph];

/// Pixels along a side of a picture of many lights.
const LIGHTS_SIDE: u64 = 256;

fn settings(tolerance: f32) -> Settings {
    Settings { width: 1024, height: 1024, samples: 1, tolerance, ..Settings::default() }
}

/// A metal floor under the light.
fn scene(trial: Trial) -> Scene {
    trial::scene(trial.layers().expect("a light"), Finish::Gloss(0.25))
}

/// Points of the floor, blocks of 4 × 4 pixels one after the other.
fn floor_points(prepared: &Prepared) -> Vec<(DVec3, ShadingFrame)> {
    let mut points = Vec::new();
    for block in (0..256 * 256).step_by(61) {
        let (x0, y0) = (block % 256 * 4, block / 256 * 4);
        for i in 0..16 {
            let (x, y) = (f64::from(x0 + i % 4) + 0.5, f64::from(y0 + i / 4) + 0.5);
            let direction = prepared.rays.direction((x / 512.0 - 1.0) as f32, (1.0 - y / 512.0) as f32).as_dvec3();
            if direction.y >= -1e-3 {
                continue;
            }
            let position = direction * (-3.0 / direction.y);
            if position.length() < 20.0 {
                points.push((position, ShadingFrame::new(DVec3::Y, -direction.normalize())));
            }
        }
    }
    points
}

/// As the CPU backend does: packet by packet, and point by point where the light is close.
fn integrate(processor: Processor, question: &Question<'_>, points: &[(DVec3, ShadingFrame)]) -> f64 {
    let mut packet = PointPacket::default();
    let mut sum = 0.0;
    for points in points.chunks(processor.lanes()) {
        packet.clear();
        points.iter().for_each(|(position, frame)| packet.push(*position, frame, &lobe(frame)));
        let answer = packet.ask(processor, question);
        sum += answer.value.iter().map(|&value| f64::from(value)).sum::<f64>();
        for (lane, point) in points.iter().enumerate().filter(|(lane, _)| answer.alone >> lane & 1 == 1) {
            sum += alone(question, point, &mut packet.budget(lane));
        }
    }
    sum
}

/// The integral at one point.
fn alone(question: &Question<'_>, (position, frame): &(DVec3, ShadingFrame), budget: &mut Budget) -> f64 {
    let Ok(images) = Images::new(question.emitter, frame, *position) else { return 0.0 };
    let lobe = question.specular.then(|| lobe(frame));
    let integral = images.integral(question.emitter, lobe.as_ref(), question.tolerance[0], budget);
    integral.map_or(0.0, |integral| integral.value.x)
}

fn lobe(frame: &ShadingFrame) -> Lobe {
    Table::shipped().lobe(0.25, frame.cos_theta as f32)
}

/// What is asked at every point.
fn question(emitter: &Emitter, tolerance: f32, specular: bool) -> Question<'_> {
    let tree = tree_of(emitter).expect("a tree");
    Question { emitter, tree, specular, asking: u32::MAX, tolerance: [tolerance; MAX_LANES], may_be_cut: true }
}

fn integral(c: &mut Criterion) {
    for tolerance in [1e-3, 1e-4] {
        integrals(c, "integral", tolerance, |question, points| integrate(Processor::default(), question, points));
    }
}

/// The same with what lesser processors can do, and without packets.
fn processor(c: &mut Criterion) {
    integrals(c, "one by one", 1e-3, |question, points| {
        points.iter().map(|point| alone(question, point, &mut Budget::default())).sum()
    });
    for processor in Processor::all() {
        integrals(c, processor.name(), 1e-3, |question, points| integrate(processor, question, points));
    }
}

fn integrals(
    c: &mut Criterion,
    name: &str,
    tolerance: f32,
    integrate: impl Fn(&Question<'_>, &[(DVec3, ShadingFrame)]) -> f64,
) {
    for (lobe, specular) in [("specular", true), ("diffuse", false)] {
        let mut group = c.benchmark_group(format!("{name}, {lobe}, tolerance {tolerance:e}"));
        for trial in LIGHTS {
            let prepared = Prepared::new(&scene(trial), &settings(tolerance)).expect("a scene");
            let points = floor_points(&prepared);
            let question = question(&prepared.emitters[0], tolerance, specular);
            group.throughput(Throughput::Elements(points.len() as u64));
            group.bench_function(BenchmarkId::from_parameter(trial), |b| {
                b.iter(|| black_box(integrate(&question, black_box(&points))));
            });
        }
        group.finish();
    }
}

/// Paragraphs 20 m and 40 m behind the light's place: with twice the glyphs of the same size, one paragraph over the other, and with
/// twice the glyphs on the same area.
fn far(c: &mut Criterion) {
    for (lobe, specular) in [("specular", true), ("diffuse", false)] {
        let mut group = c.benchmark_group(format!("far, {lobe}, tolerance 1e-3"));
        for (name, same_area, away) in [("20 m", false, 20.0), ("20 m, same area", true, 20.0), ("40 m", false, 40.0)] {
            for copies in [1_i32, 2, 4, 8] {
                let mut scene = scene(Trial::Paragraph);
                let light = &mut scene.lights[0];
                let one = light.layers[0].shape.clone();
                let height = one.bounds().size().y * 1.1;
                let stacked = (0..copies).flat_map(|k| {
                    let up = DAffine2::from_translation(DVec2::new(0.0, height * f64::from(k)));
                    one.transformed(up).contours().iter().map(|c| c.curves().to_vec()).collect::<Vec<_>>()
                });
                light.layers[0].shape = Shape::from_contours(stacked.collect()).expect("contours");
                let size = if same_area { 1.0 / f64::from(copies).sqrt() } else { 1.0 };
                light.placement = Placement::new(DVec3::new(0.0, 0.0, -away), DVec3::ZERO, DVec2::splat(size));
                let prepared = Prepared::new(&scene, &settings(1e-3)).expect("a scene");
                let points = floor_points(&prepared);
                group.throughput(Throughput::Elements(points.len() as u64));
                let question = question(&prepared.emitters[0], 1e-3, specular);
                group.bench_function(BenchmarkId::new(name, 100 * copies), |b| {
                    b.iter(|| black_box(integrate(Processor::default(), &question, black_box(&points))));
                });
            }
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
        for trial in LIGHTS {
            let scene = scene(trial);
            group.bench_function(BenchmarkId::from_parameter(trial), |b| {
                b.iter_custom(|times| (0..times).map(|_| shading(backend.as_ref(), &scene, &settings(1e-3))).sum());
            });
        }
        group.finish();
    }
}

/// Signs over a floor, on all threads. Their floor grows with their number, or their size shrinks on the same floor.
fn lights_together(c: &mut Criterion) {
    let words = ["OPEN", "BAR", "HOTEL", "24h", "CAFE"].map(|word| {
        let font = Font::bundled("DejaVu Sans").expect("bundled");
        layout(word, &[font], &TextStyle::default()).expect("Latin text").shape
    });
    let diffuse = Material { specular: 0.0, ..Material::default() };
    let glossy = Material { metallic: 1.0, alpha: 0.25, ..Material::default() };
    for (floor, material) in [("diffuse", diffuse), ("glossy", glossy)] {
        for same_area in [false, true] {
            let area = if same_area { "constant area" } else { "constant density" };
            let mut group = c.benchmark_group(format!("lights, {floor}, {area}, tolerance 1e-3"));
            group.sample_size(10).throughput(Throughput::Elements(LIGHTS_SIDE * LIGHTS_SIDE));
            for count in [1, 10, 100, 1000] {
                let mut options = SignsOptions { count, material, ..SignsOptions::default() };
                if same_area {
                    let width = (10.0 / f64::from(count)).sqrt();
                    options = SignsOptions { width, heights: options.heights.map(|h| h / width), ..options };
                }
                let scene = signs(&words, &options);
                for (name, clusters) in [("clusters", true), ("one by one", false)] {
                    let skips = Skips { clusters, ..Skips::default() };
                    let side = LIGHTS_SIDE as u32;
                    let settings = Settings { width: side, height: side, skips, ..settings(1e-3) };
                    if clusters || count <= 100 {
                        group.bench_function(BenchmarkId::new(name, count), |b| {
                            b.iter_custom(|times| (0..times).map(|_| shading(&CpuBackend, &scene, &settings)).sum());
                        });
                    }
                }
            }
            group.finish();
        }
    }
}

fn shading(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> Duration {
    let stats = backend.render(scene, settings).expect("a picture").stats;
    let stage = stats.stages.iter().find(|(name, _)| name == "shading").expect("a shading stage");
    Duration::from_secs_f64(stage.1)
}

criterion_group!(benches, integral, processor, far, picture, lights_together);
criterion_main!(benches);
