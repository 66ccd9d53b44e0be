//! Single points: closed forms, and GGX against quadrature that shares no code with it.

use super::light;
use glam::{DVec2, DVec3, Vec4};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::reference::measure;
use glyphlight::backend::reference::region::Region;
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::brdf::ggx;
use glyphlight::brdf::ltc::Table;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::light::AreaLight;
use glyphlight::picture::Picture;
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;
use std::f64::consts::PI;
use std::sync::Arc;

/// A pixel that looks from `eye` at the origin of a floor.
pub fn scene(eye: DVec3, material: Material, lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera { position: eye, look_at: DVec3::ZERO, up: DVec3::Z, fov_y: 1.0 },
        triangles: plane(DVec3::ZERO, DVec3::Y, [4.0; 2], 1.0, 0).to_vec(),
        materials: vec![material],
        textures: vec![],
        lights,
        background: [0.0; 3],
    }
}

pub fn settings(sampling: Sampling) -> Settings {
    let technique = Technique::Reference(sampling);
    Settings { width: 1, height: 1, samples: 1, tolerance: 1e-4, technique, ..Settings::default() }
}

/// Irradiance and specular reading at the origin of the floor, viewed from `eye`.
pub fn meter(lights: Vec<AreaLight>, eye: DVec3, alpha: f32, sampling: Sampling) -> [DVec3; 2] {
    let scene = scene(eye, Material::default(), lights);
    let prepared = Prepared::new(&scene, &settings(sampling)).unwrap();
    let frame = ShadingFrame::new(DVec3::Y, eye.normalize());
    measure(&prepared, &sampling, &frame, -prepared.eye, alpha)
}

fn sampling(spp: u32, lobe: ReferenceLobe) -> Sampling {
    Sampling { spp, lobe, ..Sampling::default() }
}

/// Under a sky of radiance 1 a surface reflects its albedo.
#[test]
fn under_a_uniform_sky_the_reading_is_the_albedo() {
    let half = DVec2::splat(1e6);
    let sky = |scale: f64| {
        let turn = DVec3::new(90.0, 0.0, 0.0);
        vec![light(Shape::rectangle(-half, half), DVec3::Y * 1.0, turn, DVec3::splat(scale))]
    };
    for cos_theta in [1.0, 0.6, 0.15] {
        let eye = DVec3::new(ggx::view(cos_theta).x, cos_theta, 0.0) * 0.5;
        for alpha in [0.0, 0.05, 0.4, 1.0] {
            let read = |lobe, scale: f64| meter(sky(scale), eye, alpha, sampling(1 << 13, lobe)).map(|v| v.y);
            let [irradiance, ltc] = read(ReferenceLobe::Ltc, 1.0);
            let lobe = Table::shipped().lobe(alpha, cos_theta as f32);
            let [_, ggx] = read(ReferenceLobe::Ggx, 1.0);
            let truth = ggx::albedo(f64::from(alpha.max(1e-4)), cos_theta).magnitude;
            println!("cos {cos_theta}, alpha {alpha}: {irradiance:.5} {ltc:.5} {ggx:.5} of {truth:.5}");
            assert!((irradiance / PI - 1.0).abs() < 1e-3, "{irradiance}");
            assert!((ltc / f64::from(lobe.magnitude) - 1.0).abs() < 1e-3, "ltc {ltc} of {}", lobe.magnitude);
            assert!((ggx / truth - 1.0).abs() < 2e-3, "ggx {ggx} of {truth}");
            // A sky brighter by a hundredth is told apart.
            let [brighter, _] = read(ReferenceLobe::Ltc, 1.01);
            assert!((brighter / PI - 1.0).abs() > 5e-3);
        }
    }
}

/// f·cos by Walter 2007 with Heitz's correlated masking, written with tangents, Schlick's Fresnel.
fn ggx_by_tangents(alpha: f64, n: DVec3, v: DVec3, l: DVec3, f0: f64, f90: f64) -> f64 {
    let (cos_v, cos_l) = (n.dot(v), n.dot(l));
    if cos_l <= 0.0 {
        return 0.0;
    }
    let h = (v + l).normalize();
    let tan2 = |c: f64| 1.0 / (c * c) - 1.0;
    let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * tan2(c)).sqrt() - 1.0);
    let cos_h = n.dot(h);
    let d = 1.0 / (PI * alpha * alpha * cos_h.powi(4) * (1.0 + tan2(cos_h) / (alpha * alpha)).powi(2));
    let fresnel = f0 + (f90 - f0) * (1.0 - v.dot(h)).powi(5);
    fresnel * d / (1.0 + lambda(cos_v) + lambda(cos_l)) / (4.0 * cos_v)
}

/// ∫ g(l) dω over a rectangle of the light space by the midpoint rule.
fn over_rectangle(light: &AreaLight, half: DVec2, n: u32, g: impl Fn(DVec3, DVec2) -> f64) -> f64 {
    let normal = light.placement.normal();
    let cell = 2.0 * half / f64::from(n);
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let p = cell * (DVec2::new(f64::from(i), f64::from(j)) + 0.5) - half;
            let to_light = light.placement.point(p);
            let distance = to_light.length();
            sum += g(to_light / distance, p) * (-normal.dot(to_light)).max(0.0) / distance.powi(3);
        }
    }
    sum * cell.x * cell.y
}

#[test]
fn ggx_agrees_with_quadrature() {
    let half = DVec2::new(0.7, 0.4);
    let eye = DVec3::new(1.6, 1.2, 0.8);
    let v = eye.normalize();
    let lit = |x: f64| {
        let turn = DVec3::new(20.0, 90.0, 10.0);
        light(Shape::rectangle(-half, half), DVec3::new(x, 0.5, -0.6), turn, DVec3::new(1.0, 0.5, 2.0))
    };
    let base_color = [0.9, 0.6, 0.3];
    for (alpha, metallic) in [(0.08, 1.0), (0.3, 0.0), (0.8, 0.6)] {
        let material = Material { base_color, metallic, alpha: alpha as f32, specular: 0.7, ..Material::default() };
        let read = |x: f64| {
            let film = CpuBackend
                .render(&scene(eye, material, vec![lit(x)]), &settings(sampling(1 << 15, ReferenceLobe::Ggx)))
                .unwrap()
                .film;
            (film.specular[0], film.variance.unwrap()[0])
        };
        let (values, variance) = read(-1.2);
        let (moved, _) = read(-1.2 * 1.01);
        for c in 0..3 {
            let f0 = 0.04 * 0.7 * (1.0 - f64::from(metallic)) + f64::from(base_color[c]) * f64::from(metallic);
            let f90 = 0.7 + 0.3 * f64::from(metallic);
            let truth = over_rectangle(&lit(-1.2), half, 1200, |l, _| ggx_by_tangents(alpha, DVec3::Y, v, l, f0, f90))
                * lit(-1.2).layers[0].radiance[c];
            let sigma = f64::from(variance[c]).sqrt();
            let error = (f64::from(values[c]) - truth).abs();
            println!("alpha {alpha}, channel {c}: {truth:.6} ± {sigma:.1e}, off by {error:.1e}");
            assert!(truth > 1e-3 && sigma < 2e-3 * truth, "{truth} ± {sigma}");
            assert!(error < 5.0 * sigma + 1e-6 * truth, "alpha {alpha}: {} instead of {truth} ± {sigma}", values[c]);
            assert!((f64::from(moved[c]) - truth).abs() > 5.0 * sigma, "alpha {alpha}: moved by 1 %");
        }
    }
}

/// A picture colours the light: against quadrature with its own bilinear look-up.
#[test]
fn pictures_multiply_the_radiance() {
    let half = DVec2::new(0.5, 0.4);
    let texels = [[1.0, 0.0, 0.2], [0.1, 2.0, 0.4], [0.6, 0.3, 0.9], [0.0, 0.2, 3.0], [1.5, 0.4, 0.0], [0.3, 0.3, 0.3]];
    let (low, high) = (DVec2::new(-0.6, -0.3), DVec2::new(0.4, 0.5));
    let picture = Picture {
        width: 3,
        height: 2,
        texels: texels.iter().map(|t: &[f32; 3]| Vec4::new(t[0], t[1], t[2], 1.0)).collect(),
        low,
        high,
    };
    let colored = |picture: Picture| {
        let mut light = light(
            Shape::rectangle(-half, half),
            DVec3::new(0.2, 0.6, -0.1),
            DVec3::new(90.0, 0.0, 0.0),
            DVec3::splat(0.5),
        );
        light.layers[0].picture = Some(Arc::new(picture));
        light
    };
    let at = |p: DVec2, c: usize| {
        // Hat functions about the texel centres, the outer ones wide open.
        let hat = |x: f64, i: usize, n: usize| {
            let x = (x * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            (1.0 - (x - i as f64).abs()).max(0.0)
        };
        let s = (p - low) / (high - low);
        let texel = |i: usize| hat(s.x, i % 3, 3) * hat(1.0 - s.y, i / 3, 2) * f64::from(texels[i][c]);
        0.5 * (0..6).map(texel).sum::<f64>()
    };
    let eye = DVec3::new(1.0, 1.0, 0.0);
    let light = colored(picture.clone());
    let [irradiance, _] = meter(vec![light.clone()], eye, 0.3, sampling(1 << 14, ReferenceLobe::Ltc));
    let mut turned = picture;
    turned.texels.reverse();
    let [other, _] = meter(vec![colored(turned)], eye, 0.3, sampling(1 << 14, ReferenceLobe::Ltc));
    for c in 0..3 {
        let truth = over_rectangle(&light, half, 800, |l, p| l.y.max(0.0) * at(p, c));
        assert!((irradiance[c] / truth - 1.0).abs() < 3e-3, "{c}: {} instead of {truth}", irradiance[c]);
        assert!((other[c] / truth - 1.0).abs() > 1e-2, "{c}: the picture turned round makes no difference");
    }
}

/// Points of a region are even over its cells, and its point test is that of the shape.
#[test]
fn regions_are_sampled_evenly_and_tested_exactly() {
    let mut rng = crate::cases::Rng(3);
    for i in 0..12 {
        let shape = crate::cases::blob(&mut rng);
        let region = Region::new(&shape);
        let bounds = shape.bounds();
        for _ in 0..4000 {
            let p = bounds.min + bounds.size() * DVec2::new(rng.within(-0.1, 1.1), rng.within(-0.1, 1.1));
            assert_eq!(region.winding(p), shape.winding(p), "shape {i} at {p}");
        }
        // At heights where curves end, and on the outline itself.
        for curve in shape.curves() {
            for p in [curve.p0, DVec2::new(bounds.min.x, curve.p0.y), DVec2::new(curve.p0.x - 1e-9, curve.p0.y)] {
                assert_eq!(region.winding(p), shape.winding(p), "shape {i} at {p}");
            }
        }
        assert!((region.area() / shape.area() - 1.0).abs() < 1e-12);
        // Samples lie inside, and are even by their centroid.
        let n = 200_000;
        let (mut sum, mut area) = (DVec2::ZERO, 0.0);
        for _ in 0..n {
            let Some((p, density)) = region.sample(region.even(), [rng.unit(), rng.unit()]) else { continue };
            assert_eq!(shape.winding(p), 1, "shape {i} at {p}");
            assert_eq!(density, region.density(region.even(), p));
            let weight = 1.0 / (density * f64::from(n));
            area += weight;
            sum += p * weight / shape.area();
        }
        assert!((area / shape.area() - 1.0).abs() < 1e-3, "shape {i}: {area} instead of {}", shape.area());
        // First moments by Green's theorem: ∮ ½x² dy and −∮ ½y² dx.
        let (mut moment, steps) = (DVec2::ZERO, 2000);
        for curve in shape.curves() {
            for s in 0..steps {
                let t = (f64::from(s) + 0.5) / f64::from(steps);
                let (p, d) = (curve.eval(t), curve.tangent(t) / f64::from(steps));
                moment += 0.5 * DVec2::new(p.x * p.x * d.y, -p.y * p.y * d.x);
            }
        }
        let off = (sum - moment / shape.area()).abs().max_element();
        // The standard error of a coordinate is its spread of at most 0.7 over √n.
        assert!(off < 5.0 * 0.7 / f64::from(n).sqrt(), "shape {i}: centroid off by {off}");
        // Samples that all lie a little to one side would be noticed.
        assert!((sum + 0.02 - moment / shape.area()).abs().max_element() > 5.0 * 0.7 / f64::from(n).sqrt());
    }
}

/// Paragraph-sized shapes: the grid answers the point test without walking over all curves.
#[test]
fn a_page_of_rings_is_sampled_fast() {
    let mut rng = crate::cases::Rng(11);
    let contours = (0..200)
        .map(|i| {
            let center = DVec2::new(f64::from(i % 20), f64::from(i / 20)) * 2.0;
            crate::cases::ring(&mut rng, center, 0.8, 8, false)
        })
        .collect();
    let shape = Shape::from_contours(contours).unwrap();
    let region = Region::new(&shape);
    let bounds = shape.bounds();
    for _ in 0..4000 {
        let p = bounds.min + bounds.size() * DVec2::new(rng.unit(), rng.unit());
        assert_eq!(region.winding(p), shape.winding(p), "{p}");
    }
    let (start, points) = (std::time::Instant::now(), 200_000);
    let mut right = 0;
    for k in 0..points {
        let v = f64::from(k) / f64::from(points);
        let (p, _) = region.sample(region.even(), [f64::from(k % 447) / 447.0, v]).unwrap();
        right += u32::from(p.x > bounds.center().x);
    }
    println!("{:.0} ns per sampled and tested point", start.elapsed().as_secs_f64() * 1e9 / f64::from(points));
    let half = areas_right_of(&shape, bounds.center().x);
    let share = f64::from(right) / f64::from(points);
    assert!((share - half).abs() < 5e-3, "{share} instead of {half}");
    assert!((share - areas_right_of(&shape, bounds.center().x + 1.0)).abs() > 1e-2);
}

/// Part of a shape to the right of a line, by random points.
fn areas_right_of(shape: &Shape, x: f64) -> f64 {
    let mut rng = crate::cases::Rng(12);
    let bounds = shape.bounds();
    let (mut all, mut right) = (0, 0);
    while all < 20_000 {
        let p = bounds.min + bounds.size() * DVec2::new(rng.unit(), rng.unit());
        if shape.winding(p) == 1 {
            all += 1;
            right += u32::from(p.x > x);
        }
    }
    f64::from(right) / f64::from(all)
}
