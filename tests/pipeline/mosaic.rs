//! Regions whose colour changes from place to place, by the tree, against brute force.

use glam::{DVec2, DVec3, Vec4};
use glyphlight::backend::Technique;
use glyphlight::backend::emitter::{Emitter, Geometry, Whole};
use glyphlight::backend::gather::Images;
use glyphlight::brdf::ltc::{Lobe, Table};
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::picture::Picture;
use glyphlight::shape::{CubicBez, Shape};
use std::f64::consts::PI;
use std::sync::Arc;

const TABLE_ALPHAS: [f32; 3] = [0.05, 0.2, 0.6];

/// Red rises to the right, green downwards, blue in a checkerboard of 1/8.
fn picture(size: u32, low: DVec2, high: DVec2) -> Picture {
    let texel = |i: u32| {
        let (x, y) = ((i % size) as f32 + 0.5, (i / size) as f32 + 0.5);
        let part = 8.0 / size as f32;
        let check = ((x * part) as u32 + (y * part) as u32).is_multiple_of(2);
        Vec4::new(x / size as f32, y / size as f32, f32::from(u8::from(check)), 1.0)
    };
    Picture { width: size, height: size, texels: (0..size * size).map(texel).collect(), low, high }
}

/// A ring with a bent outside and a square hole.
fn ring() -> Shape {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let outer = vec![
        CubicBez::new(p(0.9, 0.0), p(0.9, 0.7), p(0.2, 0.9), p(-0.1, 0.6)),
        CubicBez::new(p(-0.1, 0.6), p(-0.6, 0.9), p(-1.0, 0.3), p(-0.8, -0.1)),
        CubicBez::new(p(-0.8, -0.1), p(-0.7, -0.9), p(0.9, -0.9), p(0.9, 0.0)),
    ];
    let corners = [p(-0.3, -0.3), p(-0.3, 0.2), p(0.3, 0.2), p(0.3, -0.3)];
    let hole = (0..4).map(|i| CubicBez::line(corners[i], corners[(i + 1) % 4])).collect();
    Shape::from_contours(vec![outer, hole]).expect("closed")
}

/// ∫ colour · density over the shape: midpoints along rows.
fn brute(light: &AreaLight, position: DVec3, frame: &ShadingFrame, lobe: Option<&Lobe>, lines: u32) -> DVec3 {
    let layer = &light.layers[0];
    let picture = layer.picture.as_ref().expect("a picture");
    let bounds = layer.shape.bounds();
    let step = bounds.size().max_element() / f64::from(lines);
    let rows = (bounds.size().y / step).round();
    let dy = bounds.size().y / rows;
    let normal = light.placement.normal();
    let mut sum = DVec3::ZERO;
    for row in 0..rows as u32 {
        let y = bounds.min.y + (f64::from(row) + 0.5) * dy;
        let mut crossings = Vec::new();
        layer.shape.curves().for_each(|c| c.crossings(y, |x, _| crossings.push(x)));
        crossings.sort_by(f64::total_cmp);
        for span in crossings.chunks(2) {
            let n = ((span[1] - span[0]) / step).ceil().max(1.0);
            let dx = (span[1] - span[0]) / n;
            for i in 0..n as u32 {
                let q = DVec2::new(span[0] + (f64::from(i) + 0.5) * dx, y);
                let to = light.placement.point(q) - position;
                let r2 = to.length_squared();
                let l = frame.to_local(to / r2.sqrt());
                let facing = -normal.dot(to) / r2.sqrt();
                if facing <= 0.0 || l.z <= 0.0 {
                    continue;
                }
                let density = lobe.map_or(l.z / PI, |lobe| {
                    let m_inv = lobe.m_inv.mat3().as_dmat3();
                    let o = m_inv * l;
                    if o.z <= 0.0 { 0.0 } else { o.z / PI * m_inv.determinant().abs() / o.length().powi(4) }
                });
                sum += picture.sample(q).truncate().as_dvec3() * (density * facing / r2 * dx * dy);
            }
        }
    }
    sum
}

fn light(shape: Shape, picture: Picture) -> AreaLight {
    AreaLight {
        name: "light".into(),
        layers: vec![Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: Some(Arc::new(picture)) }],
        form: Form::Outline,
        placement: Placement::new(DVec3::new(0.0, 0.6, 0.0), DVec3::new(10.0, 0.0, 5.0), DVec2::ONE),
        two_sided: false,
    }
}

fn emitter(light: &AreaLight) -> Emitter {
    let mut emitter = Emitter::of_shape(light.layers[0].shape.clone(), &Technique::Tree).expect("a region");
    let whole = Whole { form: light.form, placement: light.placement, extent: 1.9 };
    emitter.geometry = Geometry::new(&light.layers[0], &whole, &Technique::Tree).expect("a region");
    emitter.placement = light.placement;
    emitter
}

#[test]
fn colours_are_integrated_within_the_tolerance() {
    let full = (DVec2::new(-0.9, -0.9), DVec2::new(1.0, 0.9));
    let shapes = [Shape::rectangle(DVec2::new(-0.8, -0.5), DVec2::new(0.8, 0.5)), ring()];
    let (mut texels, mut noticed, mut visited, mut integrals) = (0.0_f64, 0, 0, 0);
    for shape in shapes {
        let light = light(shape, picture(32, full.0, full.1));
        let other = emitter(&self::light(light.layers[0].shape.clone(), picture(32, full.0 - 0.05, full.1 - 0.05)));
        let emitter = emitter(&light);
        let Geometry::Mosaic(mosaic) = &emitter.geometry else { panic!("no mosaic") };
        println!("{} tiles, {} KiB", mosaic.tiles.len(), mosaic.bytes() >> 10);
        let eye = DVec3::new(0.5, 1.5, 4.0);
        for position in [DVec3::new(0.2, 0.0, 0.7), DVec3::new(-0.5, 0.0, 1.6), DVec3::new(1.5, 0.0, 0.4)] {
            let frame = ShadingFrame::new(DVec3::Y, (eye - position).normalize());
            let images = Images::new(&emitter, &frame, position).expect("in front");
            let lobes = TABLE_ALPHAS.map(|alpha| Table::shipped().lobe(alpha, frame.cos_theta as f32));
            for lobe in [None].into_iter().chain(lobes.iter().map(Some)) {
                let truth = brute(&light, position, &frame, lobe, 700);
                let all = images.integral(&emitter, lobe, 1e-9, &mut Budget::default()).expect("above").value;
                texels = texels.max((all - truth).abs().max_element());
                for tolerance in [1e-3, 1e-4] {
                    let found = images.integral(&emitter, lobe, tolerance, &mut Budget::default()).expect("above");
                    let error = (found.value - all).abs().max_element();
                    assert!(error < f64::from(tolerance), "{error} at {tolerance}: {found:?}, {all}");
                    visited += found.visited;
                    integrals += 1;
                }
                let moved = images.integral(&other, lobe, 1e-4, &mut Budget::default()).expect("above").value;
                noticed += u32::from((moved - truth).abs().max_element() > 3e-3);
            }
        }
    }
    println!("cells cost {texels:.1e}, {} parts per integral, {noticed} noticed", visited / integrals);
    assert!(texels < 4e-3, "{texels}");
    assert!(noticed > 6, "{noticed}");
}

#[cfg(feature = "gpu")]
#[test]
fn both_backends_give_the_same_picture() {
    use crate::backends::{agree, difference, floor, render, settings, white_level};
    use glyphlight::backend::cpu::CpuBackend;
    use glyphlight::scene::Material;
    let Some(gpu) = crate::backends::gpu() else { return };
    for (shape, two_sided) in [(ring(), false), (Shape::rectangle(DVec2::new(-0.8, -0.5), DVec2::new(0.8, 0.5)), true)]
    {
        let scene = |size: f64| {
            let pictured = picture(32, DVec2::splat(-size), DVec2::splat(size));
            // It dips through the floor, so that both horizons cut it.
            let mut light = light(shape.clone(), pictured);
            light.placement.origin.y = 0.4;
            light.two_sided = two_sided;
            floor(Material { alpha: 0.15, ..Material::default() }, light)
        };
        let (scene, other) = (scene(1.0), scene(1.05));
        let white = white_level(&scene);
        let on_cpu = render(&CpuBackend, &scene, &settings(1));
        let on_gpu = render(gpu, &scene, &settings(1));
        let found = difference(&on_cpu.film, &on_gpu.film, white);
        println!("mosaic, two-sided {two_sided}: {found:?}, {} parts", on_cpu.stats.nodes);
        assert!(agree(found), "{found:?}");
        assert!(!agree(difference(&render(&CpuBackend, &other, &settings(1)).film, &on_gpu.film, white)));
    }
}
