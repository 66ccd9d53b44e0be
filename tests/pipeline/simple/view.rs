//! Bodies in the picture, against rays that are cast at them.

use super::{brute::Body, light, scene};
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::film::Film;
use glyphlight::light::{AreaLight, Placement, simple};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 72;
/// Rays per pixel, squared.
const RAYS: u32 = 8;

impl Body {
    /// Where a ray from `eye` first meets the surface.
    fn hit(&self, eye: DVec3, direction: DVec3) -> Option<f64> {
        let from = eye - self.center();
        let roots = |a: f64, b: f64, c: f64| {
            let root = (b * b - a * c).sqrt();
            [(-b - root) / a, (-b + root) / a]
        };
        let ahead = |t: f64| (t > 0.0).then_some(t);
        match *self {
            Self::Sphere { radius, .. } => {
                let c = from.length_squared() - radius * radius;
                let [near, _] = roots(direction.length_squared(), from.dot(direction), c);
                ahead(near)
            }
            Self::Tube { axis, radius, length, .. } => {
                let (d, o) = (direction - axis * direction.dot(axis), from - axis * from.dot(axis));
                let [near, _] = roots(d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
                let round = ahead(near).filter(|t| (from + direction * *t).dot(axis).abs() <= 0.5 * length);
                let cap = |sign: f64| {
                    let t = (sign * 0.5 * length - from.dot(axis)) / direction.dot(axis);
                    let p = from + direction * t;
                    ahead(t).filter(|_| (p - axis * p.dot(axis)).length() <= radius)
                };
                [round, cap(1.0), cap(-1.0)].into_iter().flatten().reduce(f64::min)
            }
        }
    }

    fn center(&self) -> DVec3 {
        match *self {
            Self::Sphere { center, .. } | Self::Tube { center, .. } => center,
        }
    }
}

fn sphere(center: DVec3, radius: f64) -> (AreaLight, Body) {
    let placement = Placement { origin: center, x: DVec3::X * 2.0, y: DVec3::Y * 2.0 };
    (light(simple::sphere(0.5 * radius), placement), Body::Sphere { center, radius })
}

fn tube(center: DVec3, axis: DVec3, radius: f64, length: f64) -> (AreaLight, Body) {
    let axis = axis.normalize();
    let placement = Placement { origin: center, x: axis * 0.5, y: axis.any_orthonormal_vector() * 0.5 };
    (light(simple::tube(2.0 * radius, 2.0 * length), placement), Body::Tube { center, axis, radius, length })
}

fn render(scene: &Scene) -> Film {
    let settings = Settings {
        width: WIDTH,
        height: HEIGHT,
        samples: 16,
        tolerance: 1e-3,
        technique: Technique::Tree,
        ..Settings::default()
    };
    CpuBackend.render(scene, &settings).unwrap().film
}

/// The part of each pixel's rays for which `seen` holds.
fn cast(camera: &Camera, seen: impl Fn(DVec3) -> bool) -> Vec<f32> {
    let frame = camera.frame(f64::from(WIDTH) / f64::from(HEIGHT));
    let place = |pixel: u32, k: u32| f64::from(pixel) + (f64::from(k) + 0.5) / f64::from(RAYS);
    let part = |i: u32| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        let count = (0..RAYS * RAYS).filter(|k| {
            let u = place(x, k % RAYS) / f64::from(WIDTH) * 2.0 - 1.0;
            let v = 1.0 - place(y, k / RAYS) / f64::from(HEIGHT) * 2.0;
            seen(frame.forward + frame.right * u + frame.up * v)
        });
        count.count() as f32 / (RAYS * RAYS) as f32
    };
    (0..WIDTH * HEIGHT).map(part).collect()
}

/// Largest and mean difference of two masks.
fn difference(a: &[f32], b: &[f32]) -> (f32, f32) {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    let worst = differences.clone().fold(0.0, f32::max);
    (worst, differences.sum::<f32>() / a.len() as f32)
}

#[test]
fn silhouettes_are_those_of_the_bodies() {
    let eye = scene(Vec::new()).camera.position;
    let ahead = DVec3::new(0.0, 0.0, 0.0);
    let bodies = [
        ("sphere", sphere(ahead, 1.0)),
        ("sphere out of the middle", sphere(DVec3::new(2.6, 1.5, 1.0), 0.6)),
        ("sphere beyond the picture", sphere(DVec3::new(1.4, 0.4, 4.0), 1.5)),
        ("sphere beside the camera", sphere(eye + DVec3::new(1.5, 0.0, 0.0), 1.4)),
        ("tube across", tube(ahead, DVec3::new(1.0, 0.3, 0.0), 0.3, 2.5)),
        ("tube towards the camera", tube(ahead, DVec3::new(0.4, 0.2, 1.0), 0.4, 3.0)),
        ("tube away from the camera", tube(ahead, DVec3::new(0.4, -0.2, -1.0), 0.4, 3.0)),
        ("tube past the camera", tube(eye - DVec3::new(0.3, 0.4, 0.0), DVec3::new(0.05, 0.0, 1.0), 0.2, 8.0)),
        ("tube straight ahead", tube(ahead, eye, 0.7, 2.0)),
        ("coin", tube(ahead, DVec3::new(0.2, 0.5, 1.0), 1.2, 0.1)),
        ("coin on edge", tube(DVec3::new(0.4, 0.0, 0.0), DVec3::new(1.0, 0.2, 0.05), 1.2, 0.1)),
    ];
    for (name, (light, body)) in bodies {
        let scene = scene(vec![light]);
        let film = render(&scene);
        let mask = cast(&scene.camera, |d| body.hit(eye, d).is_some());
        let (worst, mean) = difference(&film.matte, &mask);
        println!("{name}: {:.0} pixels, worst {worst:.3}, mean {mean:.1e}", mask.iter().sum::<f32>());
        assert!(mask.iter().sum::<f32>() > 50.0, "{name}");
        assert!(worst < 0.16 && mean < 1e-3, "{name}: {worst} {mean}");
        // From a hundredth of the distance to the side it is another picture.
        let aside = eye + DVec3::X * 0.06;
        let other = difference(&film.matte, &cast(&scene.camera, |d| body.hit(aside, d).is_some()));
        assert!(other.1 > 2.0 * mean && other.0 > 0.2, "{name}: {other:?}");
    }
}

/// Flat lights that pass the camera are drawn along their true edges.
#[test]
fn a_strip_past_the_camera_keeps_its_direction() {
    let eye = scene(Vec::new()).camera.position;
    // Lies 0.4 m below the eye and reaches from 20 m before it to 20 m behind it; its lit side is up.
    let origin = eye - DVec3::new(0.3, 0.4, 0.0);
    let axis = DVec3::new(0.1, 0.0, -1.0);
    let across = DVec3::Y.cross(axis).normalize();
    let strip = light(simple::rectangle(DVec2::new(40.0, 0.5)), Placement { origin, x: axis.normalize(), y: across });
    assert!(strip.placement.normal().y > 0.0);
    let mut scene = scene(vec![strip]);
    let (along, across) = (scene.lights[0].placement.x, scene.lights[0].placement.y);
    let mask = cast(&scene.camera, |d| {
        let t = (origin.y - eye.y) / d.y;
        let p = eye + d * t - origin;
        t > 0.0 && p.dot(across).abs() < 0.25 && p.dot(along).abs() < 20.0
    });
    let found = difference(&render(&scene).matte, &mask);
    println!("strip past the camera: {:.0} pixels, {found:?}", mask.iter().sum::<f32>());
    assert!(mask.iter().sum::<f32>() > 500.0);
    assert!(found.0 < 0.16 && found.1 < 1e-3, "{found:?}");
    scene.lights[0].placement.origin.x += 0.004;
    assert!(difference(&render(&scene).matte, &mask).1 > 2e-3);
}

#[test]
fn from_inside_a_body_is_dark() {
    let eye = scene(Vec::new()).camera.position;
    for (light, _) in [sphere(eye, 0.5), tube(eye, DVec3::new(1.0, 0.0, 0.4), 0.5, 3.0)] {
        let mut scene = scene(vec![light]);
        assert!(render(&scene).matte.iter().all(|&m| m == 0.0));
        scene.lights[0].placement.origin -= DVec3::Z * 2.0;
        assert!(render(&scene).matte.contains(&1.0));
    }
}

/// Bodies that stand in one another and in a floor: each pixel shows what its rays meet first.
#[test]
fn bodies_hide_one_another_where_they_are_nearer() {
    let (mut ball, red) = sphere(DVec3::new(-0.3, 0.1, 0.0), 1.0);
    let (mut rod, green) = tube(DVec3::new(0.2, 0.1, 0.2), DVec3::new(1.0, 0.4, 0.3), 0.5, 3.2);
    ball.layers[0].radiance = DVec3::new(1.0, 0.0, 0.0);
    rod.layers[0].radiance = DVec3::new(0.0, 1.0, 0.0);
    let floor = -0.3;
    let mut scene = scene(vec![ball, rod]);
    scene.triangles = plane(DVec3::Y * floor, DVec3::Y, [40.0, 40.0], 1.0, 0).to_vec();
    scene.materials = vec![Material::default()];
    let camera = scene.camera;
    let eye = camera.position;
    let nearest = |d: DVec3| {
        let ground = (d.y < 0.0).then(|| (floor - eye.y) / d.y);
        let hits = [red.hit(eye, d), green.hit(eye, d), ground];
        let found = hits.into_iter().enumerate().filter_map(|(i, t)| Some((i, t?)));
        found.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    };
    let masks = [0, 1].map(|which| cast(&camera, |d| nearest(d) == Some(which)));
    let compare = |film: &Film| {
        [0, 1].map(|which| {
            let seen: Vec<f32> = film.emission.iter().map(|e| e[which]).collect();
            difference(&seen, &masks[which])
        })
    };
    let found = compare(&render(&scene));
    println!("two bodies in a floor: {found:?}");
    for (worst, mean) in found {
        assert!(worst < 0.35 && mean < 2e-3, "{found:?}");
    }
    scene.lights.swap(0, 1);
    assert_eq!(compare(&render(&scene)), found, "their order in the scene makes no difference");
    scene.lights[0].placement.origin.z += 0.1;
    assert!(compare(&render(&scene)).iter().any(|(_, mean)| *mean > 4e-3));
}
