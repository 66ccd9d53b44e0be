//! Spheres and tubes as the bodies they are.

use super::light;
use super::points::meter;
use glam::{DVec2, DVec3};
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::light::{AreaLight, Form};
use glyphlight::shape::Shape;
use std::f64::consts::{PI, TAU};

const EYE: DVec3 = DVec3::new(0.6, 0.8, 0.0);

fn sampling(lobe: ReferenceLobe) -> Sampling {
    Sampling { spp: 1 << 15, lobe, ..Sampling::default() }
}

fn body(form: Form, center: DVec3, turn: DVec3) -> AreaLight {
    let shape = Shape::rectangle(DVec2::splat(-0.5), DVec2::splat(0.5));
    AreaLight { form, ..light(shape, center, turn, DVec3::new(1.0, 2.0, 0.5)) }
}

fn irradiance(light: &AreaLight) -> DVec3 {
    meter(vec![light.clone()], EYE, 0.2, sampling(ReferenceLobe::Ltc))[0]
}

/// A sphere above the horizon: E = π·L·(r/d)²·cos θ, whichever way its face looks.
#[test]
fn a_spheres_irradiance_is_the_closed_form() {
    for (center, radius) in
        [(DVec3::new(0.3, 1.0, 0.4), 0.3), (DVec3::Y * 1.01, 1.0), (DVec3::new(4.0, 3.0, 0.0), 0.01)]
    {
        let truth = PI * (radius / center.length()).powi(2) * center.normalize().y;
        for turn in [DVec3::ZERO, DVec3::new(0.0, 120.0, 30.0)] {
            let read = |radius| irradiance(&body(Form::Sphere { radius }, center, turn));
            let value = read(radius) / DVec3::new(1.0, 2.0, 0.5);
            assert!((value / truth - 1.0).abs().max_element() < 1e-3, "{value} instead of {truth}");
            assert!((read(radius * 1.01).x / truth - 1.0).abs() > 1e-2);
        }
    }
}

/// A sphere that dips into the floor, by quadrature over its visible cap of directions; with both lobes against a
/// disc of the same outline far away.
#[test]
fn a_sphere_is_clipped_at_the_horizon() {
    let (center, radius) = (DVec3::new(0.9, 0.2, 0.0), 0.5);
    let read = |radius| irradiance(&body(Form::Sphere { radius }, center, DVec3::ZERO)).x;
    let sphere = |radius: f64| {
        let n = 2000;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let (z, phi) = ((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n) * TAU);
                let l = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), z, (1.0 - z * z).sqrt() * phi.sin());
                if center.cross(l).length() < radius && center.dot(l) > 0.0 {
                    sum += z * TAU / f64::from(n * n);
                }
            }
        }
        sum
    };
    let truth = sphere(radius);
    assert!((read(radius) / truth - 1.0).abs() < 2e-3, "{} instead of {truth}", read(radius));
    assert!((read(radius * 1.01) / truth - 1.0).abs() > 5e-3);
}

/// A far sphere and the disc that faces the point have the same outline and so the same reflection.
#[test]
fn a_far_sphere_is_its_facing_disc() {
    const K: f64 = 0.552_284_749_830_793_4;
    let radius = 0.5;
    let corner = |i: usize| [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y][i % 4] * radius;
    let quarter = |i: usize| {
        let (a, b) = (corner(i), corner(i + 1));
        glyphlight::shape::CubicBez::new(a, a + b * K, b + a * K, b)
    };
    let disc = Shape::from_contours(vec![(0..4).map(quarter).collect()]).unwrap();
    // Mirrored by the floor the eye looks at it; its face looks back along the same line.
    let center = DVec3::new(-0.6, 0.8, 0.0) * 40.0;
    let facing = DVec3::new(0.0, 90.0, 0.0);
    let up = f64::atan2(0.8, 0.6).to_degrees();
    for lobe in [ReferenceLobe::Ggx, ReferenceLobe::Ltc] {
        let read = |light: AreaLight| meter(vec![light], EYE, 0.02, sampling(lobe)).map(|v| v.x);
        let disc = light(disc.clone(), center, facing + DVec3::new(0.0, 0.0, -up), DVec3::ONE);
        assert!(disc.placement.normal().dot(-center.normalize()) > 0.999_999, "{}", disc.placement.normal());
        let mut sphere = body(Form::Sphere { radius }, center, DVec3::ZERO);
        sphere.layers[0].radiance = DVec3::ONE;
        let ([e, s], [disc_e, disc_s]) = (read(sphere.clone()), read(disc));
        assert!(
            s > 0.05 && (e / disc_e - 1.0).abs() < 1e-3 && (s / disc_s - 1.0).abs() < 1e-2,
            "{e} {s} {disc_e} {disc_s}"
        );
        sphere.placement.origin *= 1.05;
        assert!((read(sphere)[1] / disc_s - 1.0).abs() > 2e-2);
    }
}

/// A tube by quadrature over side and caps, only what faces the point.
#[test]
fn a_tubes_irradiance_is_the_sum_over_its_surface() {
    let tube = |center: DVec3, radius: f64, length: f64, turn: DVec3| {
        let light = body(Form::Tube { radius, length }, center, turn);
        let (axis, a) = (light.placement.x, light.placement.y);
        let b = axis.cross(a);
        let n = 1500;
        let mut sum = 0.0;
        let mut add = |p: DVec3, normal: DVec3, area: f64| {
            let facing = -normal.dot(p);
            if facing > 0.0 && p.y > 0.0 {
                sum += area * facing * p.y / p.length_squared().powi(2);
            }
        };
        for i in 0..n {
            let u = (f64::from(i) + 0.5) / f64::from(n);
            for j in 0..n {
                let v = (f64::from(j) + 0.5) / f64::from(n);
                let (sin, cos) = (TAU * u).sin_cos();
                let radial = a * cos + b * sin;
                let cell = 1.0 / f64::from(n * n);
                add(center + radial * radius + axis * (length * (v - 0.5)), radial, TAU * radius * length * cell);
                for side in [-1.0, 1.0] {
                    let p = center + axis * (0.5 * length * side) + radial * (radius * v);
                    add(p, axis * side, TAU * radius * radius * v * cell);
                }
            }
        }
        (light, sum)
    };
    for (center, radius, length, turn) in [
        (DVec3::new(0.2, 0.9, 0.1), 0.1, 1.2, DVec3::ZERO),
        (DVec3::new(0.5, 0.6, 0.3), 0.4, 0.3, DVec3::new(0.0, 40.0, 60.0)),
        // Through the floor, and looked at along the axis.
        (DVec3::new(0.8, 0.0, 0.3), 0.2, 1.0, DVec3::new(0.0, 0.0, 50.0)),
        (DVec3::new(0.0, 1.0, 0.0), 0.3, 0.4, DVec3::new(0.0, 0.0, 90.0)),
    ] {
        let (light, truth) = tube(center, radius, length, turn);
        let value = irradiance(&light) / DVec3::new(1.0, 2.0, 0.5);
        assert!((value / truth - 1.0).abs().max_element() < 2e-3, "{center}: {value} instead of {truth}");
        let (_, other) = tube(center, radius, length * 1.05, turn);
        assert!((value.x / other - 1.0).abs() > 4e-3, "{center}: as a longer tube {other}");
    }
}

/// From within a closed body that emits to both sides all is light; one that does not is dark.
#[test]
fn inside_a_body_all_is_light() {
    for form in [Form::Sphere { radius: 1.0 }, Form::Tube { radius: 0.8, length: 2.0 }] {
        let mut light = body(form, DVec3::new(0.2, 0.1, -0.1), DVec3::new(0.0, 20.0, 10.0));
        assert_eq!(irradiance(&light), DVec3::ZERO);
        light.two_sided = true;
        let value = irradiance(&light) / DVec3::new(1.0, 2.0, 0.5);
        assert!((value / PI - 1.0).abs().max_element() < 1e-3, "{form:?}: {value}");
        light.placement.origin = DVec3::Y * 3.0;
        assert!(irradiance(&light).x < 0.9 * PI);
    }
}
