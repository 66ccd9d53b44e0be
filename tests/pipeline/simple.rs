//! Simple lights: closed forms, brute force, power, what the camera sees, and what the scene file says.

mod brute;
mod file;
#[cfg(feature = "gpu")]
mod gpu;
mod view;

use crate::cases::Rng;
use brute::Body;
use glam::{DAffine2, DVec2, DVec3};
use glyphlight::backend::gather::Images;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::backend::{Settings, Technique};
use glyphlight::brdf::ltc::{Lobe, Table};
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Form, Layer, Placement, simple};
use glyphlight::scene::{Camera, Scene};
use glyphlight::shape::Shape;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What the tree is asked for.
const TOLERANCE: f32 = 1e-6;

fn light((form, shape): (Form, Shape), placement: Placement) -> AreaLight {
    AreaLight {
        name: "light".into(),
        layers: vec![Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None }],
        form,
        placement,
        two_sided: false,
    }
}

fn scene(lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera { position: DVec3::new(0.1, 0.2, 6.0), look_at: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 },
        triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        lights,
        background: [0.0; 3],
    }
}

fn settings(technique: Technique) -> Settings {
    Settings { width: 1, height: 1, samples: 1, tolerance: TOLERANCE, technique, ..Settings::default() }
}

fn prepared(light: &AreaLight, technique: Technique) -> Prepared {
    Prepared::new(&scene(vec![light.clone()]), &settings(technique)).unwrap()
}

/// The integral over all faces of the lights, at a place in the world.
fn gather(prepared: &Prepared, frame: &ShadingFrame, position: DVec3, lobe: Option<&Lobe>) -> f64 {
    let mut budget = Budget::default();
    let face = |emitter| {
        let images = Images::new(emitter, frame, position - prepared.eye).ok()?;
        Some(images.integral(emitter, lobe, TOLERANCE, &mut budget).ok()?.value.x)
    };
    prepared.emitters.iter().filter_map(face).sum()
}

/// A frame about a normal, seen along it.
fn facing(normal: DVec3) -> ShadingFrame {
    ShadingFrame::new(normal, normal)
}

fn standing(origin: DVec3) -> Placement {
    Placement { origin, x: DVec3::X, y: DVec3::Y }
}

#[test]
fn discs_are_round() {
    // Area exact, radius within what the documentation says, and not much better.
    for (arcs, bound) in [(4, 2.7e-4), (8, 4.2e-6), (16, 1e-7)] {
        let disc = Shape::disc(arcs);
        assert!((disc.area() - PI).abs() < 1e-14, "{arcs} arcs: {}", disc.area() - PI);
        assert!((Shape::half_disc(arcs).area() - FRAC_PI_2).abs() < 1e-14);
        let radii = disc.curves().flat_map(|c| (0..=100).map(|i| c.eval(f64::from(i) / 100.0).length() - 1.0));
        let worst = radii.map(f64::abs).fold(0.0, f64::max);
        assert!(worst < bound && worst > 0.2 * bound, "{arcs} arcs: {worst:e}");
        let bounds = disc.bounds();
        assert_eq!((bounds.min, bounds.max), (DVec2::NEG_ONE, DVec2::ONE));
    }
    // The handles of the usual approximation make another area.
    let k = 0.552_284_749_8;
    let mut usual = 0.0;
    for curve in Shape::disc(4).curves() {
        let handle = |p: DVec2, q: DVec2| p + (q - p).normalize() * k;
        let mut curve = *curve;
        (curve.p1, curve.p2) = (handle(curve.p0, curve.p1), handle(curve.p3, curve.p2));
        usual += curve.signed_area();
    }
    assert!((usual - PI).abs() > 5e-4);
    assert_eq!(simple::ellipse(DVec2::new(3.0, 1.0)).1.bounds().size(), DVec2::new(3.0, 1.0));
    assert!((simple::ellipse(DVec2::new(3.0, 1.0)).1.area() - PI * 0.75).abs() < 1e-14);
}

/// Form factor of a disc of radius r, parallel to the element, h away and a off the axis (Hamilton, Morgan 1952).
fn disc_form_factor(r: f64, h: f64, a: f64) -> f64 {
    if a == 0.0 {
        return r * r / (r * r + h * h);
    }
    let (h, r) = (h / a, r / a);
    let z = 1.0 + h * h + r * r;
    0.5 * (1.0 - (z - 2.0 * r * r) / (z * z - 4.0 * r * r).sqrt())
}

#[test]
fn a_disc_has_its_form_factor() {
    let disc = light(simple::disc(0.7), Placement { origin: DVec3::new(0.3, 2.0, -0.4), x: DVec3::X, y: DVec3::Z });
    let frame = facing(DVec3::Y);
    for (technique, bound) in [(Technique::Tree, 3e-6), (Technique::Exact, 2e-6)] {
        let prepared = prepared(&disc, technique);
        let (mut worst, mut wider) = (0.0_f64, f64::MAX);
        for (h, a) in [(2.0, 0.0), (0.4, 0.0), (0.3, 0.5), (1.0, 0.7), (0.2, 0.69), (3.0, 4.0), (0.1, 1.3)] {
            let position = DVec3::new(0.3 + a * 0.6, 2.0 - h, -0.4 + a * 0.8);
            let value = gather(&prepared, &frame, position, None);
            worst = worst.max((value - disc_form_factor(0.7, h, a)).abs());
            wider = wider.min((value - disc_form_factor(0.7007, h, a)).abs());
        }
        println!("disc, {technique}: worst {worst:.1e}; 0.1 % wider, at least {wider:.1e}");
        assert!(worst < bound && wider > 2.0 * bound, "{technique}: {worst:e} {wider:e}");
    }
}

/// An ellipse is a disc through a stretched placement.
#[test]
fn an_ellipse_is_a_stretched_disc() {
    let frame = ShadingFrame::new(DVec3::new(0.2, 0.9, 0.1).normalize(), DVec3::new(-0.6, 0.7, 0.3).normalize());
    let lobe = Table::shipped().lobe(0.3, frame.cos_theta as f32);
    let origin = DVec3::new(0.0, 1.0, 0.0);
    let turned = |scale: DVec2| Placement::new(origin, DVec3::new(80.0, 15.0, 0.0), scale);
    let at = |light: &AreaLight| {
        let prepared = prepared(light, Technique::Exact);
        [None, Some(&lobe)].map(|lobe| gather(&prepared, &frame, DVec3::new(0.3, 0.0, 0.2), lobe))
    };
    let ellipse = at(&light(simple::ellipse(DVec2::new(2.0, 0.6)), turned(DVec2::ONE)));
    let disc = at(&light(simple::disc(0.5), turned(DVec2::new(2.0, 0.6))));
    let other = at(&light(simple::disc(0.5), turned(DVec2::new(2.0, 0.601))));
    for i in 0..2 {
        assert!(disc[i] > 0.05 && (ellipse[i] - disc[i]).abs() < 1e-12, "{ellipse:?} {disc:?}");
        assert!((ellipse[i] - other[i]).abs() > 1e-5);
    }
}

/// E = (r/d)² cos θ where the sphere is wholly above the horizon.
#[test]
fn a_sphere_above_the_horizon_has_its_closed_form() {
    let mut rng = Rng(7);
    for (technique, bound) in [(Technique::Tree, 2e-6), (Technique::Exact, 1e-8)] {
        let (mut worst, mut larger) = (0.0_f64, 0.0_f64);
        for _ in 0..200 {
            let radius = rng.log_within(0.01, 10.0);
            let center = rng.direction() * 3.0;
            let prepared = prepared(
                &light(
                    simple::sphere(0.5 * radius),
                    Placement { origin: center, x: DVec3::X * 2.0, y: DVec3::Z * 2.0 },
                ),
                technique,
            );
            let distance = radius * rng.log_within(1.001, 30.0);
            let to = rng.direction();
            // A normal that leaves the whole sphere above the horizon: sin θ ≤ √(1 − r²/d²).
            let most = (1.0 - (radius / distance).powi(2)).sqrt().asin();
            let tilt = rng.within(0.0, 0.999 * most);
            let (x, y) = to.any_orthonormal_pair();
            let normal = to * tilt.cos() + (x * 0.6 + y * 0.8) * tilt.sin();
            let value = gather(&prepared, &facing(normal), center - to * distance, None);
            worst = worst.max((value - (radius / distance).powi(2) * tilt.cos()).abs());
            larger = larger.max((value - (1.01 * radius / distance).powi(2) * tilt.cos()).abs());
        }
        println!("sphere above the horizon, {technique}: worst {worst:.1e}; one of 1 % more radius {larger:.1e}");
        assert!(worst < bound, "{technique}: {worst:e}");
        assert!(larger > 1e-3);
    }
}

/// The integral of a disc does not depend on the axes that it is drawn about.
#[test]
fn the_frame_of_a_sphere_makes_no_difference() {
    let mut rng = Rng(8);
    let (mut worst, mut changed) = (0.0_f64, 0.0_f64);
    for _ in 0..100 {
        let frame = ShadingFrame::new(DVec3::Y, DVec3::new(0.8, 0.6, 0.0));
        let lobe = Table::shipped().lobe(rng.log_within(0.05, 1.0) as f32, 0.6);
        let position = rng.direction() * 2.0 - DVec3::Y;
        let at = |turn: f64, radius: f64| {
            let mut sphere = light(simple::sphere(radius), standing(DVec3::ZERO));
            sphere.layers[0].shape = sphere.layers[0].shape.transformed(DAffine2::from_angle(turn));
            gather(&prepared(&sphere, Technique::Exact), &frame, position, Some(&lobe))
        };
        let straight = at(0.0, 0.9);
        worst = worst.max((at(rng.within(0.0, TAU), 0.9) - straight).abs());
        changed = changed.max((at(0.0, 0.901) - straight).abs());
    }
    println!("turned by any angle: {worst:.1e}; 0.1 % more radius: {changed:.1e}");
    assert!(worst < 3e-6 && changed > 1e-4, "{worst:e} {changed:e}");
}

/// What a body gives at random points all around it, near and far, and by which lobes.
struct Case {
    frame: ShadingFrame,
    position: DVec3,
    lobe: Option<Lobe>,
}

fn cases(rng: &mut Rng, body: &Body, n: u32) -> Vec<Case> {
    let (center, reach) = match *body {
        Body::Sphere { center, radius } => (center, DVec3::splat(radius)),
        Body::Tube { center, radius, length, .. } => (center, DVec3::new(0.5 * length, radius, radius)),
    };
    let inside = |p: DVec3| match *body {
        Body::Sphere { center, radius } => (p - center).length() < 1.1 * radius,
        Body::Tube { center, axis, radius, length } => {
            let along = (p - center).dot(axis);
            along.abs() < 0.5 * length + 0.1 * radius && ((p - center) - axis * along).length() < 1.1 * radius
        }
    };
    let mut cases = Vec::new();
    while cases.len() < n as usize {
        let position = center + rng.direction() * reach.max_element() * rng.log_within(0.2, 8.0);
        if inside(position) {
            continue;
        }
        let toward = (center - position).normalize();
        let normal = (toward + rng.direction() * rng.within(0.0, 1.5)).normalize();
        let mut view = rng.direction();
        if view.dot(normal) < 0.0 {
            view = -view;
        }
        let frame = ShadingFrame::new(normal, view);
        let alpha = rng.log_within(0.15, 1.0) as f32;
        let lobe = (cases.len() % 2 == 1).then(|| Table::shipped().lobe(alpha, frame.cos_theta as f32));
        cases.push(Case { frame, position, lobe });
    }
    cases
}

fn tube_at(rng: &mut Rng, ratio: f64) -> (AreaLight, Body) {
    let axis = rng.direction();
    let y = axis.any_orthonormal_vector();
    let (scale, center) = (rng.log_within(0.3, 3.0), rng.direction());
    let radius = rng.log_within(0.2, 1.0);
    let (form, shape) = simple::tube(radius, ratio * radius);
    let placement = Placement { origin: center, x: axis * scale, y: y * scale };
    let body = Body::Tube { center, axis, radius: radius * scale, length: ratio * radius * scale };
    (light((form, shape), placement), body)
}

fn sphere_at(rng: &mut Rng) -> (AreaLight, Body) {
    let (center, scale, radius) = (rng.direction(), rng.log_within(0.3, 3.0), rng.log_within(0.1, 1.0));
    let y = DVec3::X.cross(rng.direction()).normalize();
    let placement = Placement { origin: center, x: DVec3::X * scale, y: y * scale };
    (light(simple::sphere(radius), placement), Body::Sphere { center, radius: radius * scale })
}

/// Largest differences from brute force of tree and yardstick, and of a light that has moved by 2 % of the distance.
fn differences(rng: &mut Rng, light: &AreaLight, body: &Body, n: u32) -> [f64; 3] {
    let mut moved = light.clone();
    let mut worst = [0.0_f64; 3];
    for case in cases(rng, body, n) {
        let truth = body.integral(&case.frame, case.position, case.lobe.as_ref(), 500);
        let way = case.position - light.placement.origin;
        moved.placement.origin = light.placement.origin + way * 0.02;
        let runs = [(light, Technique::Tree), (light, Technique::Exact), (&moved, Technique::Exact)];
        for (worst, (light, technique)) in worst.iter_mut().zip(runs) {
            let value = gather(&prepared(light, technique), &case.frame, case.position, case.lobe.as_ref());
            *worst = worst.max((value - truth).abs());
        }
    }
    worst
}

#[test]
fn spheres_are_as_by_brute_force() {
    let mut rng = Rng(11);
    let mut worst = [0.0_f64; 3];
    for _ in 0..6 {
        let (light, body) = sphere_at(&mut rng);
        let found = differences(&mut rng, &light, &body, 12);
        worst = [0, 1, 2].map(|i| found[i].max(worst[i]));
    }
    println!("sphere: tree {:.1e}, exact {:.1e}, moved by 2 % {:.1e}", worst[0], worst[1], worst[2]);
    assert!(worst[0] < 2e-5 && worst[1] < 2e-5 && worst[2] > 1e-3, "{worst:?}");
}

#[test]
fn tubes_are_as_by_brute_force() {
    let mut rng = Rng(12);
    for ratio in [0.2, 1.0, 4.0, 20.0] {
        let (light, body) = tube_at(&mut rng, ratio);
        let worst = differences(&mut rng, &light, &body, 14);
        println!(
            "tube of length {ratio} radii: tree {:.1e}, exact {:.1e}, moved by 2 % {:.1e}",
            worst[0], worst[1], worst[2]
        );
        assert!(worst[0] < 3e-5 && worst[1] < 3e-5 && worst[2] > 1e-3, "{ratio}: {worst:?}");
    }
}

/// What arrives at a sphere of receivers around a light is what the light sends out: π · area · L.
#[test]
fn every_body_sends_out_its_power() {
    let area = |light: &AreaLight| {
        let Layer { shape, .. } = &light.layers[0];
        light.form.emitting_area(shape.area()) * light.placement.x.length_squared()
    };
    let lights = [
        ("sphere", simple::sphere(0.4)),
        ("tube", simple::tube(0.2, 1.5)),
        ("coin", simple::tube(0.6, 0.1)),
        ("disc", simple::disc(0.5)),
        ("ellipse", simple::ellipse(DVec2::new(1.4, 0.5))),
        ("rectangle", simple::rectangle(DVec2::new(1.4, 0.5))),
    ];
    for (name, made) in lights {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let light = light(made, Placement { origin: DVec3::new(0.3, -0.1, 0.2), x: axis * 1.2, y: DVec3::Y * 1.2 });
        let prepared = prepared(&light, Technique::Tree);
        let (n, radius) = (48, 2.0);
        let mut flux = 0.0;
        for i in 0..n {
            let z = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
            for j in 0..2 * n {
                let (sin, cos) = (TAU * (f64::from(j) + 0.5) / f64::from(2 * n)).sin_cos();
                let out = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
                let irradiance = PI * gather(&prepared, &facing(-out), out * radius, None);
                flux += irradiance * 4.0 * PI * radius * radius / f64::from(2 * n * n);
            }
        }
        let error = flux / (PI * area(&light)) - 1.0;
        println!("{name}: flux {flux:.5}, {error:+.1e} off");
        assert!(error.abs() < 1e-3, "{name}: {error}");
        let Form::Tube { radius, .. } = light.form else { continue };
        let caps = TAU * radius * radius * light.placement.x.length_squared();
        assert!((flux / (PI * (area(&light) - caps)) - 1.0).abs() > 0.05, "{name}: without caps there is less");
    }
}

/// Bodies shine outwards: inside it is dark, and so it is behind a tube's cap within its infinite cylinder.
#[test]
fn inside_it_is_dark() {
    let tube = prepared(&light(simple::tube(0.3, 2.0), standing(DVec3::ZERO)), Technique::Tree);
    let sphere = prepared(&light(simple::sphere(0.3), standing(DVec3::ZERO)), Technique::Tree);
    let sum = |prepared: &Prepared, p: DVec3| {
        [DVec3::X, DVec3::NEG_X, DVec3::Y].map(|n| gather(prepared, &facing(n), p, None)).iter().sum::<f64>()
    };
    for p in [DVec3::ZERO, DVec3::new(0.1, 0.2, 0.1), DVec3::new(0.0, 0.3, 0.0)] {
        assert_eq!((sum(&tube, p), sum(&sphere, p)), (0.0, 0.0), "{p}");
    }
    assert_eq!(sum(&tube, DVec3::new(0.99, 0.2, 0.2)), 0.0);
    assert!(sum(&sphere, DVec3::new(0.0, 0.3001, 0.0)) > 0.9);
    assert!(sum(&tube, DVec3::new(0.99, 0.2, 0.23)) > 0.5);
    // Before the cap only the cap is seen.
    let before = sum(&tube, DVec3::new(1.2, 0.1, 0.0));
    let cap =
        prepared(&light(simple::disc(0.3), Placement { origin: DVec3::X, x: DVec3::Y, y: DVec3::Z }), Technique::Tree);
    let disc = sum(&cap, DVec3::new(1.2, 0.1, 0.0));
    assert!(before > 0.5 && (before - disc).abs() < 1e-3, "{before} {disc}");
}

/// Every technique that knows no bodies takes their silhouettes: those that converge, converge to the yardstick.
#[test]
fn polygon_techniques_take_silhouettes() {
    let mut rng = Rng(14);
    let techniques = [Technique::Kuge { eps: Some(1e-7) }, Technique::Uniform { segments: 64 }];
    for (light, body) in [sphere_at(&mut rng), tube_at(&mut rng, 3.0)] {
        let exact = prepared(&light, Technique::Exact);
        let [fine, coarse] = [techniques, [Technique::Kuge { eps: Some(1.0) }, Technique::Uniform { segments: 2 }]]
            .map(|t| t.map(|t| prepared(&light, t)));
        let mut worst = [[0.0_f64; 2]; 2];
        for case in cases(&mut rng, &body, 60).iter().filter(|c| c.lobe.is_none()) {
            let at = |prepared: &Prepared| gather(prepared, &case.frame, case.position, None);
            let truth = at(&exact);
            for (worst, prepared) in worst.iter_mut().zip([&fine, &coarse]) {
                for (worst, prepared) in worst.iter_mut().zip(prepared) {
                    *worst = worst.max((at(prepared) - truth).abs());
                }
            }
        }
        println!(
            "kuge and uniform: fine {:.1e} {:.1e}, coarse {:.1e} {:.1e}",
            worst[0][0], worst[0][1], worst[1][0], worst[1][1]
        );
        assert!(worst[0].iter().all(|&w| w < 2e-5) && worst[1].iter().all(|&w| w > 6e-5), "{worst:?}");
    }
}

/// The silhouettes are those of the bodies whose surfaces the Monte Carlo reference samples.
#[test]
fn the_reference_samples_the_same_bodies() {
    let mut rng = Rng(15);
    let sampling = Sampling { spp: 4096, lobe: ReferenceLobe::Ltc, ..Sampling::default() };
    for (light, body) in [sphere_at(&mut rng), tube_at(&mut rng, 0.4), tube_at(&mut rng, 6.0)] {
        let sampled = prepared(&light, Technique::Reference(sampling));
        let mut larger = light.clone();
        larger.placement.x *= 1.1;
        larger.placement.y *= 1.1;
        let exact = [&light, &larger].map(|l| prepared(l, Technique::Exact));
        assert_eq!(sampled.emitters.len(), 1, "a body is one light to sample");
        let mut squares = [0.0; 2];
        for case in cases(&mut rng, &body, 40) {
            let value = gather(&sampled, &case.frame, case.position, case.lobe.as_ref());
            for (square, exact) in squares.iter_mut().zip(&exact) {
                *square += (value - gather(exact, &case.frame, case.position, case.lobe.as_ref())).powi(2) / 40.0;
            }
        }
        let [same, other] = squares.map(f64::sqrt);
        println!("reference of 4096 samples: rms {same:.1e}; to a body 10 % larger {other:.1e}");
        assert!(same < 2e-3 && other > 4.0 * same, "{same:e} {other:e}");
    }
}
