//! `pal` and `representative` in the backends: the same on both, and what they are worth in a picture.

use crate::cases::{Rng, blob};
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::technique::Basis;
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::film::Film;
use glyphlight::light::{AreaLight, Form, Layer, Placement, simple};
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::picture::Picture;
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;
use std::sync::Arc;

const TECHNIQUES: [Technique; 4] = [
    Technique::Pal { basis: Basis::Centred },
    Technique::Pal { basis: Basis::Weighted },
    Technique::Pal { basis: Basis::Biased },
    Technique::Representative,
];

fn light((form, shape): (Form, Shape), position: DVec3, rotation: DVec3, scale: DVec2) -> AreaLight {
    AreaLight {
        name: "light".into(),
        layers: vec![Layer { shape, radiance: DVec3::new(1.0, 0.8, 0.6), opacity: 1.0, picture: None }],
        form,
        placement: Placement::new(position, rotation, scale),
        two_sided: false,
    }
}

fn outline(shape: Shape) -> (Form, Shape) {
    (Form::Outline, shape)
}

fn words() -> Shape {
    let font = Font::bundled("DejaVu Sans").unwrap();
    layout("So be it", &[font], &TextStyle { size: 0.5, ..TextStyle::default() }).unwrap().shape
}

fn chequered() -> Arc<Picture> {
    let texel =
        |i: u32| if (i % 8 + i / 8).is_multiple_of(2) { glam::Vec4::ONE } else { glam::Vec4::new(0.1, 0.2, 0.9, 1.0) };
    let (low, high) = (DVec2::splat(-0.6), DVec2::splat(0.6));
    Arc::new(Picture { width: 8, height: 8, texels: (0..64).map(texel).collect(), low, high })
}

/// Lights of every kind over a floor, some through it.
fn gallery() -> Scene {
    let one = DVec2::ONE;
    let mut lights = vec![
        light(outline(words()), DVec3::new(-2.2, 1.3, -0.5), DVec3::new(10.0, 20.0, 0.0), one),
        light(
            outline(blob(&mut Rng(5))),
            DVec3::new(1.9, 0.7, 0.2),
            DVec3::new(0.0, -30.0, 15.0),
            DVec2::new(0.9, 0.5),
        ),
        light(simple::rectangle(DVec2::new(0.8, 0.5)), DVec3::new(0.3, 0.1, 0.4), DVec3::new(-20.0, 5.0, 0.0), one),
        light(simple::disc(0.4), DVec3::new(-1.1, 0.5, 1.0), DVec3::new(30.0, 0.0, 0.0), one),
        light(simple::sphere(0.3), DVec3::new(0.6, 0.9, 0.0), DVec3::ZERO, one),
        light(simple::tube(0.08, 1.2), DVec3::new(0.2, 0.5, 1.4), DVec3::new(0.0, 25.0, 10.0), one),
    ];
    lights[1].two_sided = true;
    lights[2].layers[0].picture = Some(chequered());
    let material = Material { base_color: [0.9, 0.7, 0.5], alpha: 0.15, ..Material::default() };
    Scene {
        camera: Camera {
            position: DVec3::new(1.5, 2.0, 5.5),
            look_at: DVec3::new(0.0, 0.4, 0.3),
            up: DVec3::Y,
            fov_y: 50.0,
        },
        triangles: plane(DVec3::ZERO, DVec3::Y, [20.0, 12.0], 1.0, 0).to_vec(),
        materials: vec![material],
        textures: Vec::new(),
        lights,
        background: [0.01, 0.02, 0.03],
    }
}

fn settings(technique: Technique) -> Settings {
    Settings { width: 97, height: 71, samples: 1, tolerance: 1e-4, technique, ..Settings::default() }
}

fn render(scene: &Scene, technique: Technique) -> Film {
    CpuBackend.render(scene, &settings(technique)).unwrap().film
}

#[test]
fn a_picture_colours_the_light() {
    // The reddish half of the floor's light goes where the texels are blue; without the picture it does not.
    for technique in TECHNIQUES {
        let mut scene = gallery();
        scene.lights.truncate(3);
        scene.lights.drain(..2);
        let red_over_blue = |scene: &Scene| {
            let film = render(scene, technique);
            let sum = film.diffuse.iter().fold([0.0; 3], |s, p| [s[0] + p[0], s[1] + p[1], s[2] + p[2]]);
            sum[0] / sum[2]
        };
        let painted = red_over_blue(&scene);
        scene.lights[0].layers[0].picture = None;
        let plain = red_over_blue(&scene);
        assert!(painted > 0.0 && painted < 0.8 * plain, "{technique}: {painted} {plain}");
    }
}

#[test]
fn an_outline_gives_the_light_of_its_area() {
    // Far away a word lights as the rectangle around it does, by the part that the letters fill.
    let shape = words();
    let bounds = shape.extent();
    let box_area = bounds.size().x * bounds.size().y;
    let far = |form: (Form, Shape)| {
        let position = DVec3::new(0.0, 60.0, 0.0);
        let mut scene = gallery();
        scene.lights = vec![light(form, position, DVec3::new(90.0, 0.0, 0.0), DVec2::ONE)];
        let sum = |technique: Technique| -> f32 { render(&scene, technique).diffuse.iter().map(|p| p[1]).sum() };
        (sum(Technique::Representative), sum(Technique::Tree))
    };
    let (value, truth) = far(outline(shape.clone()));
    assert!((value / truth - 1.0).abs() < 0.01, "{value} {truth}");
    let (whole, _) = far((Form::Rectangle, Shape::rectangle(bounds.min, bounds.max)));
    let share = (shape.area() / box_area) as f32;
    assert!((value / whole / share - 1.0).abs() < 0.01 && share < 0.7, "{} {share}", value / whole);
}

#[test]
fn what_they_are_worth_in_a_picture() {
    // Against the tree, by light, of the brightest pixel of the tree's.
    println!("rms error over the tree's brightest pixel, diffuse / specular:");
    for (k, light) in gallery().lights.into_iter().enumerate() {
        let mut scene = gallery();
        scene.lights = vec![AreaLight { layers: vec![Layer { picture: None, ..light.layers[0].clone() }], ..light }];
        let truth = render(&scene, Technique::Tree);
        let mut row = Vec::new();
        for technique in TECHNIQUES {
            let film = render(&scene, technique);
            let rms = |a: &[[f32; 3]], b: &[[f32; 3]]| {
                let peak = b.iter().map(|p| p[0]).fold(0.0, f32::max);
                let sum: f32 = a.iter().zip(b).map(|(p, q)| (p[0] - q[0]).powi(2)).sum();
                (sum / a.len() as f32).sqrt() / peak
            };
            let [d, s] = [rms(&film.diffuse, &truth.diffuse), rms(&film.specular, &truth.specular)];
            assert!(d < 0.3 && s < 0.3, "{technique}: {d} {s}");
            row.push(format!("{technique} {d:.3} / {s:.3}"));
        }
        println!("  light {k}: {}", row.join(", "));
        let brightest = truth.diffuse.iter().chain(&truth.specular).flatten().copied().fold(0.0, f32::max);
        assert!(brightest > 5e-3, "light {k} lights nothing: {brightest}");
    }
}

#[cfg(feature = "gpu")]
mod on_the_gpu {
    use super::*;
    use crate::backends::{gpu, on_the_cpu};
    use glyphlight::backend::gpu::layout::MeterPoint;
    use glyphlight::backend::prepared::Prepared;

    /// Differences of the beauty, all channels, ascending.
    fn differences(a: &Film, b: &Film) -> Vec<f32> {
        let mut all: Vec<f32> =
            a.beauty().zip(b.beauty()).flat_map(|(p, q)| (0..3).map(move |c| (p[c] - q[c]).abs())).collect();
        all.sort_by(f32::total_cmp);
        all
    }

    #[test]
    fn single_integrals_are_the_same_on_both() {
        let Some(gpu) = gpu() else { return };
        for technique in TECHNIQUES {
            let mut rng = Rng(41);
            let prepared = Prepared::new(&gallery(), &settings(technique)).unwrap();
            let points: Vec<MeterPoint> = (0..4000)
                .map(|i| {
                    let emitter = i % prepared.emitters.len();
                    let e = &prepared.emitters[emitter];
                    let way = rng.direction();
                    let position = e.placement.point(e.square.center) + way * e.square.half * rng.log_within(0.1, 8.0);
                    let normal = (rng.direction() - way).normalize();
                    let mut view = rng.direction();
                    if view.dot(normal) < 0.0 {
                        view = -view;
                    }
                    MeterPoint {
                        position: position.as_vec3(),
                        emitter: emitter as u32,
                        normal: normal.as_vec3(),
                        alpha: rng.log_within(0.02, 1.0) as f32,
                        view: view.as_vec3(),
                        tolerance: 1e-5,
                    }
                })
                .collect();
            let expected: Vec<[f64; 2]> = points.iter().map(|p| on_the_cpu(&prepared, p)).collect();
            let errors = |points: &[MeterPoint]| {
                let readings = gpu.measure(&prepared, points).unwrap();
                let off = |a: f32, b: f64| (f64::from(a) - b).abs() / b.max(1.0);
                let mut errors: Vec<f64> = (readings.iter().zip(&expected))
                    .flat_map(|(r, e)| [off(r.diffuse.x, e[0]), off(r.specular.x, e[1])])
                    .collect();
                errors.sort_by(f64::total_cmp);
                errors
            };
            let at = |errors: &[f64], q: f64| errors[((errors.len() - 1) as f64 * q) as usize];
            let found = errors(&points);
            println!(
                "{technique}: median {:.1e}, 99 % {:.1e}, worst {:.1e}",
                at(&found, 0.5),
                at(&found, 0.99),
                at(&found, 1.0)
            );
            assert!(expected.iter().filter(|e| e[0] > 1e-3).count() > 1000, "{technique}");
            assert!(expected.iter().filter(|e| e[1] > 1e-3).count() > 200, "{technique}");
            assert!(at(&found, 0.95) < 1e-5 && at(&found, 0.999) < 1e-3, "{technique}");
            let moved: Vec<_> = points.iter().map(|p| MeterPoint { position: p.position * 1.01, ..*p }).collect();
            assert!(at(&errors(&moved), 0.8) > 1e-4, "{technique}");
        }
    }

    #[test]
    fn pictures_are_the_same_on_both() {
        let Some(gpu) = gpu() else { return };
        let scene = gallery();
        for technique in TECHNIQUES {
            let cpu = CpuBackend.render(&scene, &settings(technique)).unwrap();
            let film = gpu.render(&scene, &settings(technique)).unwrap();
            let found = differences(&cpu.film, &film.film);
            let at = |q: f64| found[((found.len() - 1) as f64 * q) as usize];
            println!("{technique}: 95 % {:.1e}, worst {:.1e}", at(0.95), at(1.0));
            assert!(at(0.95) < 1e-5 && at(1.0) < 1e-3, "{technique}");
            assert_eq!(cpu.stats.integrals, film.stats.integrals, "{technique}");
            let mut other = scene.clone();
            other.lights[4].placement.origin.x += 0.02;
            let other = CpuBackend.render(&other, &settings(technique)).unwrap();
            let found = differences(&other.film, &film.film);
            assert!(found[found.len() - 1] > 1e-3, "{technique}: a light moved by 2 cm is the same");
        }
    }
}
