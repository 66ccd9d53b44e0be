//! What is decided for a whole tile holds at each of its points: against the yardstick.

use crate::cases::{Rng, blob};
use glam::{DVec2, DVec3, Vec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gather::Images;
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::tile::{LightList, TilePoints};
use glyphlight::backend::{Backend, Horizons, Rendering, Settings, Skips, Technique};
use glyphlight::brdf::ltc::Table;
use glyphlight::film::Film;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::reflect::Reflectance;
use glyphlight::kernel::surface::SurfacePoint;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Form, Layer, Placement, simple};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;

const TOLERANCE: f32 = 1e-3;

fn light((form, shape): (Form, Shape), placement: Placement, radiance: f64, two_sided: bool) -> AreaLight {
    let layer = Layer { shape, radiance: DVec3::new(1.0, 0.7, 0.4) * radiance, opacity: 1.0, picture: None };
    AreaLight { name: "light".into(), layers: vec![layer], form, placement, two_sided }
}

/// Lights of all kinds about the origin, which they do not touch.
fn lights(rng: &mut Rng, count: usize) -> Vec<AreaLight> {
    let one = |i: usize| {
        let turn = DVec3::new(rng.within(-180.0, 180.0), rng.within(-90.0, 90.0), rng.within(-180.0, 180.0));
        let origin = rng.direction() * rng.log_within(1.6, 30.0);
        let placement = Placement::new(origin, turn, DVec2::splat(rng.log_within(0.1, 1.5)));
        let form = match i % 8 {
            0 => simple::sphere(rng.within(0.3, 1.0)),
            1 => simple::tube(rng.within(0.1, 0.4), rng.within(0.5, 2.0)),
            _ => (Form::Outline, blob(rng)),
        };
        let two_sided = i % 8 == 2;
        light(form, placement, rng.log_within(1e-4, 1.0), two_sided)
    };
    (0..count).map(one).collect()
}

fn scene(lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera { position: DVec3::ZERO, look_at: DVec3::NEG_Z, up: DVec3::Y, fov_y: 50.0 },
        triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        lights,
        background: [0.0; 3],
    }
}

type Point = (DVec3, ShadingFrame, Reflectance);

/// The points of a tile: near each other, of like normals and like materials, as neighbours in a picture are.
fn points(rng: &mut Rng, prepared: &Prepared) -> Vec<Point> {
    let (extent, bend) = (rng.log_within(0.1, 1.0), rng.log_within(1e-2, 0.3));
    let (normal, metallic, alpha) = (rng.direction(), rng.within(0.0, 1.0) as f32, rng.log_within(1e-3, 1.0));
    let eye = (normal + rng.direction() * 0.9) * rng.log_within(2.0, 20.0);
    let near = |rng: &mut Rng, size: f64| rng.direction() * rng.within(0.0, size);
    let one = |_| {
        let position = near(rng, extent).as_vec3();
        let normal = (normal + near(rng, bend)).normalize();
        let view = (eye - position.as_dvec3()).normalize();
        let point = SurfacePoint {
            position,
            normal: normal.as_vec3(),
            view: view.as_vec3(),
            base_color: Vec3::new(0.8, 0.5, 0.9),
            metallic,
            alpha: (alpha * (1.0 + rng.within(-0.5, 0.5) * bend)) as f32,
            specular: 1.0,
        };
        let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
        let lobe = prepared.lobe(Table::shipped(), point.alpha, frame.cos_theta as f32);
        (position.as_dvec3(), frame, point.reflectance(lobe))
    };
    (0..12).map(one).collect()
}

/// What the emitters that are not listed send to a point at most, by the yardstick.
fn missed(exact: &Prepared, list: &LightList, (position, frame, reflectance): &Point) -> f64 {
    let mut sum = 0.0;
    for (index, emitter) in exact.emitters.iter().enumerate() {
        let listed = list.listed.iter().find(|l| l.emitter == index).map_or([false; 2], |l| l.lobes);
        let Ok(images) = Images::new(emitter, frame, *position) else { continue };
        let lobes = [(None, reflectance.diffuse), (Some(&reflectance.lobe), reflectance.specular)];
        for ((lobe, weight), _) in lobes.into_iter().zip(listed).filter(|(_, listed)| !listed) {
            let integral = images.integral(emitter, lobe, 0.0, &mut Budget::default());
            let value = integral.map_or(0.0, |i| i.value.x.abs());
            sum += value * f64::from((weight * emitter.radiance).max_element());
        }
    }
    sum
}

/// How often a point misses more than the tolerance makes room for, of how many tiles; and how many lobes were left out.
fn trial(seed: u64, horizons: Horizons, shrink: bool) -> (u32, u32) {
    let mut rng = Rng(seed);
    let (mut wrong, mut skipped) = (0, 0);
    for _ in 0..24 {
        let scene = scene(lights(&mut rng, 24));
        // Clusters would take the lights away from the list.
        let skips = Skips::without(&["clusters".parse().unwrap()]);
        let settings = Settings { tolerance: TOLERANCE, horizons, skips, ..Settings::default() };
        let prepared = Prepared::new(&scene, &settings).unwrap();
        let exact = Prepared::new(&scene, &Settings { technique: Technique::Exact, ..settings }).unwrap();
        for _ in 0..4 {
            let points = points(&mut rng, &prepared);
            let mut tile = TilePoints::NONE;
            for (position, frame, reflectance) in &points[..if shrink { 1 } else { points.len() }] {
                tile.add(position.as_vec3(), frame, reflectance);
            }
            let mut list = LightList::default();
            list.fill(&prepared, TOLERANCE, &tile);
            skipped += prepared.emitters.len() as u32 * 2;
            skipped -= list.listed.iter().flat_map(|l| l.lobes).filter(|&lobe| lobe).count() as u32;
            let room = f64::from(TOLERANCE - list.tolerance);
            assert!((0.0..=0.2501 * f64::from(TOLERANCE)).contains(&room));
            let worst = points.iter().map(|p| missed(&exact, &list, p)).fold(0.0, f64::max);
            wrong += u32::from(worst > room + 1e-9);
        }
    }
    (wrong, skipped)
}

#[test]
fn what_a_tile_leaves_out_is_dark_at_each_of_its_points() {
    for horizons in [Horizons::Both, Horizons::Cosine] {
        let (wrong, skipped) = trial(3, horizons, false);
        println!("{horizons:?}: {skipped} lobes left out, {wrong} tiles wrong");
        assert_eq!(wrong, 0);
        assert!(skipped > 1500, "{skipped}");
        // Bounds of the first point alone are not those of the tile.
        let (wrong, _) = trial(3, horizons, true);
        println!("{wrong} tiles wrong by bounds of one point");
        assert!(wrong > 2);
    }
}

/// Three walls of a room, of metal, plaster and varnish; signs before them and behind them, and far lights without number.
fn room() -> Scene {
    let mut rng = Rng(11);
    let mut triangles = plane(DVec3::ZERO, DVec3::Y, [9.0, 9.0], 1.0, 0).to_vec();
    triangles.extend(plane(DVec3::new(0.0, 2.0, -2.0), DVec3::Z, [9.0, 4.0], 1.0, 1));
    triangles.extend(plane(DVec3::new(-3.0, 2.0, 0.0), DVec3::X, [4.0, 6.0], 1.0, 2));
    let metal = Material { metallic: 1.0, alpha: 0.1, ..Material::default() };
    let plaster = Material { specular: 0.0, ..Material::default() };
    let placed = |origin, turn| Placement::new(origin, turn, DVec2::splat(0.5));
    let mut lights = vec![
        light((Form::Outline, blob(&mut rng)), placed(DVec3::new(0.5, 1.2, -1.0), DVec3::ZERO), 1.0, false),
        light((Form::Outline, blob(&mut rng)), placed(DVec3::new(1.5, 0.8, 1.0), DVec3::Y * 180.0), 2.0, false),
        light((Form::Outline, blob(&mut rng)), placed(DVec3::new(0.0, -1.0, 0.0), DVec3::X * -90.0), 1.0, true),
        light(simple::sphere(0.4), placed(DVec3::new(-1.0, 0.3, 0.0), DVec3::ZERO), 0.5, false),
        light(simple::tube(0.1, 2.0), placed(DVec3::new(0.0, 2.0, 0.5), DVec3::ZERO), 0.5, false),
    ];
    for i in 0..70 {
        let origin = DVec3::new(rng.within(-9.0, 9.0), rng.within(4.0, 9.0), rng.within(8.0, 20.0));
        let radiance = if i % 2 == 0 { 0.01 } else { 1e-4 };
        let placement = Placement::new(origin, DVec3::new(rng.within(60.0, 160.0), 0.0, 0.0), DVec2::splat(0.05));
        lights.push(light((Form::Outline, blob(&mut rng)), placement, radiance, false));
    }
    Scene {
        camera: Camera {
            position: DVec3::new(2.5, 2.2, 5.0),
            look_at: DVec3::new(-0.4, 1.0, 0.0),
            up: DVec3::Y,
            fov_y: 50.0,
        },
        triangles,
        materials: vec![metal, plaster, Material::default()],
        lights,
        ..scene(Vec::new())
    }
}

fn worst(a: &Film, b: &Film) -> f32 {
    let layers = |f: &Film| f.diffuse.iter().chain(&f.specular).flatten().copied().collect::<Vec<_>>();
    layers(a).iter().zip(layers(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// With each skip off the picture is the same within the tolerance, and its counter is zero.
fn every_skip_is_counted_and_changes_nothing(backend: &dyn Backend) {
    let scene = room();
    let render = |skips: Skips| -> Rendering {
        let settings =
            Settings { width: 70, height: 50, samples: 2, tolerance: TOLERANCE, skips, ..Settings::default() };
        backend.render(&scene, &settings).unwrap()
    };
    // Clusters, which would take the lights away from the list, have tests of their own.
    let all = render(Skips::without(&["clusters".parse().unwrap()]));
    let none = render(Skips::NONE);
    let counter = |r: &Rendering, name: &str| -> u64 {
        let sum = |f: fn(&glyphlight::backend::LightStats) -> u64| r.stats.lights.iter().map(f).sum();
        match name {
            "lobes" => sum(|l| l.no_lobe),
            "textures" => u64::from(r.stats.left_out.iter().any(|part| part == "textures")) * r.stats.shaded,
            "under-tolerance" => sum(|l| l.under_tolerance),
            "behind" => sum(|l| l.behind_tile),
            _ => sum(|l| l.below_tile),
        }
    };
    let integrals = |r: &Rendering| {
        let skipped: u64 = r.stats.lights.iter().map(glyphlight::backend::LightStats::skipped).sum();
        assert_eq!(r.stats.integrals + skipped, r.stats.lights.iter().map(|l| l.candidates).sum::<u64>());
        r.stats.integrals
    };
    assert!(integrals(&none) > integrals(&all));
    for (name, _) in Skips::ALL.iter().filter(|(name, _)| !["reuse", "horizons", "clusters"].contains(name)) {
        let without = render(Skips::without(&[name.parse().unwrap(), "clusters".parse().unwrap()]));
        let (with, rest) = (counter(&all, name), counter(&without, name));
        println!("{name}: {with} against {rest}, picture off by {:.1e}", worst(&all.film, &without.film));
        assert!(with > 0 && rest == 0, "{name} counts wrongly");
        assert!(worst(&all.film, &without.film) <= TOLERANCE && integrals(&without) >= integrals(&all), "{name}");
    }
    assert!(worst(&all.film, &none.film) <= TOLERANCE);
    // A light that is left out and should not be shows.
    let mut dark = scene.clone();
    dark.lights.remove(0);
    let skips = Skips::without(&["clusters".parse().unwrap()]);
    let settings = Settings { width: 70, height: 50, samples: 2, tolerance: TOLERANCE, skips, ..Settings::default() };
    assert!(worst(&all.film, &backend.render(&dark, &settings).unwrap().film) > TOLERANCE);
}

#[test]
fn every_skip_is_proven_on_the_cpu() {
    every_skip_is_counted_and_changes_nothing(&CpuBackend);
}

#[cfg(feature = "gpu")]
#[test]
fn every_skip_is_proven_on_the_gpu() {
    let Some(gpu) = crate::backends::gpu() else { return };
    every_skip_is_counted_and_changes_nothing(gpu);
}

/// More lights than the shader decides about at once.
#[cfg(feature = "gpu")]
#[test]
fn two_thousand_lights_are_the_same_on_both() {
    let Some(gpu) = crate::backends::gpu() else { return };
    let mut rng = Rng(2);
    let mut scene = room();
    while scene.lights.len() < 2100 {
        let origin = DVec3::new(rng.within(-3.0, 9.0), rng.within(0.5, 9.0), rng.within(-2.0, 20.0));
        let turn = DVec3::new(rng.within(-180.0, 180.0), rng.within(-180.0, 180.0), 0.0);
        let shape = simple::rectangle(DVec2::new(0.1, 0.02));
        scene.lights.push(light(shape, Placement::new(origin, turn, DVec2::ONE), rng.log_within(1e-4, 0.3), false));
    }
    let skips = Skips::without(&["clusters".parse().unwrap()]);
    let settings = Settings { width: 24, height: 16, samples: 1, tolerance: TOLERANCE, skips, ..Settings::default() };
    let [a, b] = [&CpuBackend as &dyn Backend, gpu].map(|backend| backend.render(&scene, &settings).unwrap());
    assert!(crate::backends::same_stats(&a.stats, &b.stats), "{:?}\n{:?}", a.stats, b.stats);
    assert!(worst(&a.film, &b.film) < 2e-5);
    assert!(b.stats.lights.iter().map(|l| l.under_tolerance).sum::<u64>() > 1000);
    scene.lights.truncate(2090);
    assert!(worst(&a.film, &gpu.render(&scene, &settings).unwrap().film) > 1e-6);
}

/// A lamp under the ceiling, turned down, and a floor; the lamp's height over the floor, its width and what the floor is made of.
fn under_a_lamp(height: f64, width: f64, floor: Material) -> Scene {
    let down = Placement::new(DVec3::new(0.0, height, 0.0), DVec3::new(90.0, 0.0, 0.0), DVec2::splat(width));
    let mut rng = Rng(4);
    Scene {
        camera: Camera { position: DVec3::new(1.0, 2.0, 4.0), look_at: DVec3::ZERO, up: DVec3::Y, fov_y: 50.0 },
        triangles: plane(DVec3::ZERO, DVec3::Y, [3.0, 3.0], 1.0, 0).to_vec(),
        materials: vec![floor],
        lights: vec![light((Form::Outline, blob(&mut rng)), down, 1.0, false)],
        ..scene(Vec::new())
    }
}

/// Where no horizon cuts a light the clipping is left out and the picture is the same to the bit; elsewhere it stays.
fn clipping_is_left_out_where_nothing_is_cut(backend: &dyn Backend) {
    let diffuse = Material { specular: 0.0, ..Material::default() };
    let glossy = Material { alpha: 0.3, ..Material::default() };
    let mut bumpy = under_a_lamp(1.0, 0.5, diffuse);
    for (i, vertex) in bumpy.triangles.iter_mut().flat_map(|t| &mut t.vertices).enumerate() {
        vertex.normal = (vertex.normal + Vec3::X * (0.9 * (i % 2) as f32)).normalize();
    }
    let mut standing = under_a_lamp(0.2, 0.5, diffuse);
    standing.lights[0].placement = Placement::new(DVec3::new(0.0, 0.2, 0.0), DVec3::ZERO, DVec2::ONE);
    let cases = [
        ("lamp over plaster", under_a_lamp(1.0, 0.5, diffuse), true),
        ("lamp high over varnish", under_a_lamp(3.0, 0.2, glossy), true),
        ("lamp low over varnish", under_a_lamp(0.5, 0.5, glossy), false),
        ("normals that lean", bumpy, false),
        ("light in the floor", standing, false),
    ];
    for (name, scene, uncut) in cases {
        let render = |skips: Skips| {
            let settings =
                Settings { width: 60, height: 40, samples: 1, tolerance: 1e-6, skips, ..Settings::default() };
            backend.render(&scene, &settings).unwrap()
        };
        let (with, without) = (render(Skips::default()), render(Skips::without(&["horizons".parse().unwrap()])));
        assert_eq!(with.stats.left_out.iter().any(|part| part == "horizons"), uncut, "{name}");
        assert!(without.stats.left_out.iter().all(|part| part != "horizons"), "{name}");
        assert!(worst(&with.film, &without.film) <= 1e-6, "{name}");
        assert!(with.film.diffuse.iter().any(|c| c[0] > 1e-3), "{name}");
    }
}

#[test]
fn clipping_is_left_out_on_the_cpu() {
    clipping_is_left_out_where_nothing_is_cut(&CpuBackend);
}

#[cfg(feature = "gpu")]
#[test]
fn clipping_is_left_out_on_the_gpu() {
    let Some(gpu) = crate::backends::gpu() else { return };
    clipping_is_left_out_where_nothing_is_cut(gpu);
}
