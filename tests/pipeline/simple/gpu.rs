//! Bodies on the GPU as on the CPU.

use super::{light, settings, sphere_at, tube_at};
use crate::backends::{gpu, on_the_cpu};
use crate::cases::Rng;
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gpu::layout::MeterPoint;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::light::{Placement, simple};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};

/// Single faces at random points, inside included.
#[test]
fn faces_are_the_same_on_both() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Rng(31);
    let lights: Vec<_> = (0..24)
        .map(|i| if i % 3 == 0 { sphere_at(&mut rng).0 } else { tube_at(&mut rng, [0.2, 2.0, 30.0][i % 3]).0 })
        .collect();
    let prepared = Prepared::new(&super::scene(lights), &settings(Technique::Tree)).unwrap();
    let points: Vec<MeterPoint> = (0..6000)
        .map(|i| {
            let emitter = i % prepared.emitters.len();
            let placement = &prepared.emitters[emitter].placement;
            let way = rng.direction();
            let position = placement.origin + way * placement.x.length() * rng.log_within(0.05, 5.0);
            let normal = (rng.direction() - way).normalize();
            let mut view = rng.direction();
            if view.dot(normal) < 0.0 {
                view = -view;
            }
            MeterPoint {
                position: position.as_vec3(),
                emitter: emitter as u32,
                normal: normal.as_vec3(),
                alpha: rng.log_within(0.05, 1.0) as f32,
                view: view.as_vec3(),
                tolerance: 1e-5,
            }
        })
        .collect();
    let expected: Vec<[f64; 2]> = points.iter().map(|p| on_the_cpu(&prepared, p)).collect();
    let errors = |points: &[MeterPoint]| {
        let readings = gpu.measure(&prepared, points).unwrap();
        let pairs = readings.iter().zip(&expected);
        let off = |a: f32, b: f64| (f64::from(a) - b).abs();
        let mut errors: Vec<f64> = pairs.flat_map(|(r, e)| [off(r.diffuse.x, e[0]), off(r.specular.x, e[1])]).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    let found = errors(&points);
    let at = |errors: &[f64], q: f64| errors[((errors.len() - 1) as f64 * q) as usize];
    println!("faces: median {:.1e}, 99 % {:.1e}, worst {:.1e}", at(&found, 0.5), at(&found, 0.99), at(&found, 1.0));
    assert!(expected.iter().filter(|e| e[0] > 0.01).count() > 1000);
    assert!(expected.iter().filter(|e| e[0] < -1e-4).count() > 50, "rims that hide");
    assert!(at(&found, 0.99) < 5e-6 && at(&found, 1.0) < 3e-4);
    let moved: Vec<_> = points.iter().map(|p| MeterPoint { position: p.position * 1.01, ..*p }).collect();
    assert!(at(&errors(&moved), 0.9) > 3e-4);
}

/// A floor under all five, which partly stand in it.
fn gallery() -> Scene {
    let turned = |origin: DVec3, degrees: DVec3| Placement::new(origin, degrees, DVec2::ONE);
    let mut lights = vec![
        light(simple::sphere(0.4), turned(DVec3::new(-1.6, 0.25, 0.5), DVec3::ZERO)),
        light(simple::disc(0.4), turned(DVec3::new(-0.6, 0.8, -0.4), DVec3::new(-20.0, 30.0, 0.0))),
        light(simple::ellipse(DVec2::new(0.5, 1.1)), turned(DVec3::new(0.5, 0.7, -0.6), DVec3::new(10.0, -20.0, 0.0))),
        light(simple::rectangle(DVec2::new(0.8, 0.5)), turned(DVec3::new(1.6, 0.6, -0.2), DVec3::new(0.0, -40.0, 0.0))),
        light(simple::tube(0.1, 2.2), turned(DVec3::new(0.3, 0.35, 1.2), DVec3::new(0.0, 20.0, 12.0))),
    ];
    let colors = [[1.0, 0.5, 0.2], [0.3, 0.8, 1.0], [0.9, 0.3, 0.8], [0.4, 1.0, 0.4], [1.0, 0.9, 0.6]];
    for (light, color) in lights.iter_mut().zip(colors) {
        light.layers[0].radiance = DVec3::from_array(color);
    }
    let floor = Material { base_color: [0.5; 3], alpha: 0.2, ..Material::default() };
    Scene {
        camera: Camera {
            position: DVec3::new(0.0, 2.2, 5.5),
            look_at: DVec3::new(0.0, 0.2, 0.2),
            up: DVec3::Y,
            fov_y: 42.0,
        },
        triangles: plane(DVec3::ZERO, DVec3::Y, [16.0; 2], 1.0, 0).to_vec(),
        materials: vec![floor],
        lights,
        ..super::scene(Vec::new())
    }
}

#[test]
fn pictures_are_the_same_on_both() {
    let Some(gpu) = gpu() else { return };
    let scene = gallery();
    let settings = Settings {
        width: 96,
        height: 64,
        samples: 1,
        tolerance: 1e-4,
        technique: Technique::Tree,
        ..Settings::default()
    };
    let difference = |a: &Scene, b: &Scene, technique: Technique| {
        let a = CpuBackend.render(a, &Settings { technique, ..settings }).unwrap();
        let b = gpu.render(b, &settings).unwrap();
        let pixels = a.film.beauty().zip(b.film.beauty());
        let worst = |(p, q): ([f32; 3], [f32; 3])| (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f32::max);
        (pixels.map(worst).fold(0.0, f32::max), a.stats, b.stats)
    };
    let (worst, a, b) = difference(&scene, &scene, Technique::Tree);
    let (exact, _, _) = difference(&scene, &scene, Technique::Exact);
    let mut moved = scene.clone();
    moved.lights[4].placement.origin.y += 0.01;
    let (other, _, _) = difference(&scene, &moved, Technique::Tree);
    println!("gallery: tree {worst:.1e}, exact {exact:.1e}, tube 1 cm higher {other:.1e}");
    assert!(worst < 1e-4 && exact < 2e-4 && other > 1e-3);
    assert_eq!(a.shaded, b.shaded);
    // Five faces of the tube, one of each other light.
    assert_eq!(a.lights.iter().map(|l| l.candidates / a.shaded).collect::<Vec<_>>(), [2, 2, 2, 2, 10]);
    for (a, b) in a.lights.iter().zip(&b.lights) {
        assert!(a.candidates == b.candidates && a.behind.abs_diff(b.behind) < a.candidates / 1000 + 2, "{a:?} {b:?}");
    }
}
