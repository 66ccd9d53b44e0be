//! The representative point: limits, simple geometry, and every awkward place.

use crate::cases::Rng;
use glam::{DVec3, Vec3};
use glyphlight::brdf::ggx::{brdf_cos, view};
use glyphlight::brdf::ltc::Table;
use glyphlight::kernel::representative::{Body, DISC, RECTANGLE, SPHERE, TUBE};
use std::f32::consts::PI;

const KINDS: [u32; 4] = [RECTANGLE, DISC, SPHERE, TUBE];

/// A body about `center` that faces the point: half-extents 1 and `aspect`.
fn facing(kind: u32, center: Vec3, size: f32, aspect: f32) -> Body {
    let x = center.normalize().any_orthonormal_vector();
    let y = center.normalize().cross(x);
    Body { kind, center, x: x * size, y: y * size * aspect }
}

fn specular(body: &Body, alpha: f32, cos_theta: f32) -> f32 {
    body.specular(alpha, cos_theta, Table::shipped().lobe(alpha, cos_theta).magnitude)
}

fn mirror(cos_theta: f32) -> Vec3 {
    Vec3::new(-(1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta)
}

/// The truth: f cos of GGX over the magnitude, summed over a sphere's cone in f64.
fn specular_of_cone(axis: DVec3, sin: f64, alpha: f64, cos_theta: f64, steps: usize) -> f64 {
    let v = view(cos_theta);
    let (x, y) = axis.any_orthonormal_pair();
    let low = (1.0 - sin * sin).sqrt();
    let mut sum = 0.0;
    for i in 0..steps {
        let cos = 1.0 - (1.0 - low) * (i as f64 + 0.5) / steps as f64;
        for j in 0..steps {
            let phi = std::f64::consts::TAU * (j as f64 + 0.5) / steps as f64;
            let l = axis * cos + (x * phi.cos() + y * phi.sin()) * (1.0 - cos * cos).sqrt();
            sum += brdf_cos(alpha, v, l);
        }
    }
    let magnitude = f64::from(Table::shipped().lobe(alpha as f32, cos_theta as f32).magnitude);
    sum * std::f64::consts::TAU * (1.0 - low) / (steps * steps) as f64 / magnitude
}

#[test]
fn a_sphere_in_a_mirror_is_seen_at_its_radiance() {
    // At normal view, from a distant sphere to one that fills most of the sky; the mirror ray meets it in the middle, off
    // the middle, or not at all.
    for ratio in [0.01_f32, 0.1, 0.5, 0.9] {
        for off in [0.0_f32, 0.5, 0.9] {
            let sin = ratio * off;
            let center = Vec3::new(sin, 0.0, (1.0 - sin * sin).sqrt());
            let sphere = Body { kind: SPHERE, center, x: Vec3::X * ratio, y: Vec3::Y };
            let errors = [1e-2, 1e-3, 1e-4].map(|alpha| (specular(&sphere, alpha, 1.0) - 1.0).abs());
            assert!(errors[2] < 0.05 && errors[2] < errors[1] && errors[1] < errors[0], "{ratio} {off}: {errors:?}");
            // The same ray, the sphere a little beyond its own edge.
            let sin = (ratio * 1.2).min(0.99);
            let center = Vec3::new(sin, 0.0, (1.0 - sin * sin).sqrt());
            let beside = Body { kind: SPHERE, center, x: Vec3::X * ratio, y: Vec3::Y };
            assert!(specular(&beside, 1e-4, 1.0) < 1e-3, "{ratio}: {}", specular(&beside, 1e-4, 1.0));
        }
    }
}

#[test]
fn the_mirror_holds_for_every_shape_and_view() {
    println!("E in the middle of the reflection, alpha 1e-4 (1 is right):");
    for kind in KINDS {
        let mut row = Vec::new();
        for cos_theta in [1.0_f32, 0.8, 0.5, 0.2, 0.05] {
            let body = facing(kind, mirror(cos_theta) * 3.0, 0.3, 0.2);
            let value = specular(&body, 1e-4, cos_theta);
            assert!((value - 1.0).abs() < 0.05, "{kind} at {cos_theta}: {value}");
            let away = Body { center: body.center + body.y * 1.2, ..body };
            if kind != SPHERE {
                assert!(specular(&away, 1e-4, cos_theta) < 0.05, "{kind} at {cos_theta}");
            }
            row.push(format!("{value:.4}"));
        }
        println!("  {kind}: {}", row.join("  "));
    }
}

#[test]
fn a_sphere_against_the_truth() {
    // What the approximation is worth where it is no limit: E over the truth.
    println!("sphere, sin of half-angle 0.3, mirrored in its middle: E / truth");
    for cos_theta in [1.0, 0.7, 0.4] {
        let axis = DVec3::new(-view(cos_theta).x, 0.0, cos_theta);
        let ratios = [0.05, 0.1, 0.25, 0.5, 0.8].map(|alpha| {
            let sphere = Body { kind: SPHERE, center: axis.as_vec3(), x: Vec3::X * 0.3, y: Vec3::Y };
            f64::from(specular(&sphere, alpha as f32, cos_theta as f32))
                / specular_of_cone(axis, 0.3, alpha, cos_theta, 300)
        });
        println!("  cos {cos_theta}: {ratios:.3?}");
        assert!(ratios.iter().all(|r| (0.4..1.2).contains(r)), "{cos_theta}: {ratios:?}");
    }
}

#[test]
fn a_far_light_has_the_irradiance_of_its_solid_angle() {
    for kind in KINDS {
        for cos in [1.0_f32, 0.7, 0.3] {
            let direction = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let size = 0.01;
            let body = facing(kind, direction, size, 1.0);
            let area = match kind {
                RECTANGLE => 4.0,
                TUBE => 4.0,
                _ => PI,
            };
            let expected = cos * area * size * size / PI;
            let value = body.diffuse();
            assert!((value - expected).abs() < 0.01 * expected, "{kind} at {cos}: {value}, {expected}");
            let nearer = Body { center: body.center * 0.98, ..body }.diffuse();
            assert!((nearer - expected).abs() > 0.01 * expected, "{kind} at {cos}: nearer is the same");
        }
    }
}

#[test]
fn a_sphere_lights_exactly() {
    // Against the cone summed in f64, above, through and below the horizon.
    let mut rng = Rng(3);
    for _ in 0..200 {
        let axis = rng.direction();
        let sin = rng.within(0.05, 0.98);
        let sphere = Body { kind: SPHERE, center: axis.as_vec3() * 2.0, x: Vec3::Z * (2.0 * sin) as f32, y: Vec3::X };
        let (x, y) = axis.any_orthonormal_pair();
        let low = (1.0 - sin * sin).sqrt();
        let steps = 200;
        let mut sum = 0.0;
        for i in 0..steps {
            let cos = 1.0 - (1.0 - low) * (f64::from(i) + 0.5) / f64::from(steps);
            for j in 0..steps {
                let phi = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(steps);
                let l = axis * cos + (x * phi.cos() + y * phi.sin()) * (1.0 - cos * cos).sqrt();
                sum += l.z.max(0.0);
            }
        }
        let expected = sum * 2.0 * (1.0 - low) / f64::from(steps * steps);
        let value = f64::from(sphere.diffuse());
        assert!((value - expected).abs() < 2e-4, "{axis} {sin}: {value}, {expected}");
        let larger = Body { x: sphere.x * 1.01, ..sphere }.diffuse();
        assert!(expected < 0.02 || f64::from(larger) > expected + 2e-4, "{axis} {sin}: a larger one is the same");
    }
}

#[test]
fn nearer_larger_and_nearer_to_the_mirror_is_brighter() {
    for kind in KINDS {
        let body = facing(kind, Vec3::new(-0.6, 0.2, 1.4), 0.2, 0.7);
        for alpha in [0.1, 0.4] {
            let here = specular(&body, alpha, 0.9);
            let larger = Body { x: body.x * 1.1, y: body.y * 1.1, ..body };
            assert!(specular(&larger, alpha, 0.9) > here && larger.diffuse() > body.diffuse(), "{kind}");
            let nearer = Body { center: body.center * 0.9, ..body };
            assert!(specular(&nearer, alpha, 0.9) > here && nearer.diffuse() > body.diffuse(), "{kind}");
            // Away from the mirror direction (−0.44, 0, 0.9), at the same height and distance.
            let turned = facing(kind, Vec3::new(0.6, 0.2, 1.4), 0.2, 0.7);
            assert!(specular(&turned, alpha, 0.9) < here, "{kind}");
        }
    }
}

#[test]
fn it_is_total() {
    let mut rng = Rng(11);
    let pick = |rng: &mut Rng, from: &[f32]| from[(rng.unit() * from.len() as f64) as usize];
    let mut above = 0;
    for _ in 0..200_000 {
        let kind = KINDS[(rng.unit() * 4.0) as usize];
        let (x, y) = rng.direction().any_orthonormal_pair();
        let scale = rng.log_within(1e-6, 1e6);
        let mut center = rng.direction() * rng.log_within(1e-6, 1e3);
        match (rng.unit() * 6.0) as u32 {
            // In the light's plane; on its axis; on its surface; at the point.
            0 => center -= x.cross(y) * center.dot(x.cross(y)),
            1 => center = x * center.length(),
            2 => center = center.normalize(),
            3 if rng.unit() < 0.2 => center = DVec3::ZERO,
            _ => {}
        }
        let body = Body {
            kind,
            center: (center * scale).as_vec3(),
            x: (x * scale).as_vec3(),
            y: (y * scale * rng.log_within(1e-4, 1.0)).as_vec3(),
        };
        let alpha = pick(&mut rng, &[0.0, 1e-4, 0.01, 0.3, 1.0, f32::NAN]);
        let cos_theta = pick(&mut rng, &[0.0, 1e-6, 0.1, 0.7, 1.0, f32::NAN]);
        let values = [body.diffuse(), specular(&body, alpha, cos_theta)];
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{body:?} {alpha} {cos_theta}: {values:?}");
        assert!(values[0] <= 1.0, "{body:?}: {values:?}");
        above += usize::from(values[0] > 0.0 && values[1] > 0.0);
    }
    assert!(above > 50_000, "only {above} lights were seen");
}
