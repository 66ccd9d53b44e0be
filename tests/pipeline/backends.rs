//! CPU and GPU give the same picture.
//!
//! The white level is radiance 1, or the brightest light's radiance where that is more: 95 % of the pixels agree within
//! 1e-5 of it, all within 1e-3.

#![cfg(feature = "gpu")]

use crate::cases::{Rng, ring};
pub use crate::reference::light;
use glam::{DVec2, DVec3, Vec2, Vec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gather::Images;
use glyphlight::backend::gpu::layout::MeterPoint;
use glyphlight::backend::gpu::{AdapterChoice, GpuBackend};
use glyphlight::backend::prepared::Prepared;
use glyphlight::backend::{Backend, BackendError, Rendering, Settings, Stats, Technique};
use glyphlight::brdf::ltc::Table;
use glyphlight::film::Film;
use glyphlight::kernel::frame::ShadingFrame;
use glyphlight::kernel::tree::Budget;
use glyphlight::light::{AreaLight, Layer, Placement};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene, Texture, Triangle, Vertex};
use glyphlight::shape::{CubicBez, Shape};
use std::io::Write;
use std::sync::OnceLock;

/// The GPU, or `None` with a loud line where there is none. With `CI` or `GLYPHLIGHT_REQUIRE_GPU` set that is a failure.
pub fn gpu() -> Option<&'static GpuBackend> {
    static GPU: OnceLock<Result<GpuBackend, BackendError>> = OnceLock::new();
    match GPU.get_or_init(|| GpuBackend::new(AdapterChoice::Any)) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            let required = ["CI", "GLYPHLIGHT_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
            assert!(!required, "a GPU is required here: {error}");
            // Past the harness, which keeps what a passing test prints to itself.
            let line = format!("SKIPPED: the GPU backend was NOT tested: {error}\n");
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            None
        }
    }
}

pub fn settings(samples: u32) -> Settings {
    Settings { width: 97, height: 71, samples, tolerance: 1e-4, ..Settings::default() }
}

fn material(alpha: f32, metallic: f32) -> Material {
    Material { base_color: [0.9, 0.7, 0.5], metallic, alpha, ..Material::default() }
}

/// A light over a floor.
pub fn floor(material: Material, light: AreaLight) -> Scene {
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
        lights: vec![light],
        background: [0.01, 0.02, 0.03],
    }
}

fn circle(center: DVec2, radius: f64) -> Vec<CubicBez> {
    const K: f64 = 0.552_284_749_830_793_4;
    let corner = |i: usize| DVec2::from_angle(i as f64 * std::f64::consts::FRAC_PI_2) * radius;
    (0..4)
        .map(|i| {
            let (a, b) = (corner(i), corner((i + 1) % 4));
            let (a, p1, p2, b) = (a, a + a.perp() * K, b - b.perp() * K, b);
            let [a, p1, p2, b] = [a, p1, p2, b].map(|p| center + p);
            CubicBez::new(a, p1, p2, b)
        })
        .map(|mut c| {
            // Shared end points to the bit.
            let snap = |p: DVec2| (p * 1e9).round() / 1e9;
            (c.p0, c.p3) = (snap(c.p0), snap(c.p3));
            c
        })
        .collect()
}

fn reversed(mut curves: Vec<CubicBez>) -> Vec<CubicBez> {
    curves.reverse();
    curves.iter_mut().for_each(|c| *c = c.reversed());
    curves
}

fn annulus() -> Shape {
    Shape::from_contours(vec![circle(DVec2::ZERO, 0.8), reversed(circle(DVec2::new(0.1, 0.0), 0.4))]).unwrap()
}

pub fn rectangle() -> Shape {
    Shape::rectangle(DVec2::new(-1.0, -0.5), DVec2::new(1.0, 0.5))
}

fn blob() -> Shape {
    Shape::from_contours(vec![ring(&mut Rng(5), DVec2::ZERO, 1.0, 9, false)]).unwrap()
}

/// Sixty contours, some with holes, as in a line of text.
pub fn page() -> Shape {
    let mut rng = Rng(8);
    let mut contours = Vec::new();
    for i in 0..60 {
        let center = DVec2::new(f64::from(i % 12) * 0.2 - 1.1, f64::from(i / 12) * 0.2 - 0.4);
        contours.push(ring(&mut rng, center, 0.08, 6, false));
        if i % 3 == 0 {
            contours.push(ring(&mut rng, center, 0.03, 4, true));
        }
    }
    Shape::from_contours(contours).unwrap()
}

/// A sphere of `n` × 2n quads, smooth normals.
fn sphere(center: DVec3, radius: f64, n: u32, material: u32) -> Vec<Triangle> {
    let vertex = |i: u32, j: u32| {
        let (theta, phi) = (f64::from(i) / f64::from(n), f64::from(j % (2 * n)) / f64::from(n));
        let (st, ct) = (theta * std::f64::consts::PI).sin_cos();
        let (sp, cp) = (phi * std::f64::consts::PI).sin_cos();
        let normal = DVec3::new(st * cp, ct, st * sp);
        Vertex {
            position: center + normal * radius,
            normal: normal.as_vec3(),
            tangent: Vec3::new(-sp as f32, 0.0, cp as f32).extend(1.0),
            uv: Vec2::new(j as f32 / n as f32, i as f32 / n as f32),
        }
    };
    let quad = |i: u32, j: u32| {
        let [a, b, c, d] = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
        [Triangle { vertices: [a, b, c], material }, Triangle { vertices: [a, c, d], material }]
    };
    (0..n).flat_map(|i| (0..2 * n).flat_map(move |j| quad(i, j))).collect()
}

/// A floor with all three kinds of texture.
fn textured() -> Scene {
    let mut scene = floor(
        Material {
            base_color_texture: Some(0),
            metallic_roughness_texture: Some(1),
            normal_texture: Some(2),
            normal_scale: 0.6,
            ..material(0.5, 0.8)
        },
        light(annulus(), DVec3::new(0.0, 1.2, 0.0), DVec3::new(20.0, 0.0, 0.0), DVec3::splat(2.0)),
    );
    let mut rng = Rng(3);
    let mut texture = |width: u32, height: u32, srgb: bool, low: [f64; 3], high: [f64; 3]| {
        let mut texel = || {
            let [r, g, b] = std::array::from_fn(|c| rng.within(low[c], high[c]) as u32);
            r | g << 8 | b << 16 | 0xff << 24
        };
        Texture { width, height, texels: (0..width * height).map(|_| texel()).collect(), srgb }
    };
    scene.textures = vec![
        texture(8, 8, true, [20.0; 3], [255.0; 3]),
        texture(7, 5, false, [0.0, 120.0, 0.0], [255.0; 3]),
        texture(16, 4, false, [100.0, 100.0, 200.0], [156.0, 156.0, 255.0]),
    ];
    scene
}

/// A sphere and a mirror-like wall on the floor.
fn mesh(n: u32) -> Scene {
    let mut scene = floor(
        material(0.3, 0.0),
        light(blob(), DVec3::new(-0.4, 1.9, 0.0), DVec3::new(40.0, 10.0, 0.0), DVec3::new(3.0, 2.0, 1.0)),
    );
    scene.materials.push(material(0.1, 1.0));
    scene.triangles.extend(sphere(DVec3::new(0.3, 0.6, 1.4), 0.6, n, 1));
    scene
}

pub fn scenes() -> Vec<(&'static str, Scene)> {
    let white = DVec3::ONE;
    let above = DVec3::new(0.0, 1.3, 0.0);
    let tilt = DVec3::new(15.0, 20.0, 0.0);
    let mut all = vec![
        ("rectangle, alpha 0.25", floor(material(0.25, 0.0), light(rectangle(), above, tilt, white))),
        ("rectangle, alpha 0.05", floor(material(0.05, 0.0), light(rectangle(), above, tilt, white))),
        ("annulus, alpha 0.8", floor(material(0.8, 0.0), light(annulus(), above, tilt, white))),
        ("blob, metal of alpha 0.1", floor(material(0.1, 1.0), light(blob(), above, tilt, DVec3::new(1.0, 0.6, 0.2)))),
        ("page, alpha 0.15", floor(material(0.15, 0.0), light(page(), above, tilt, white))),
        ("page, diffuse", floor(Material { specular: 0.0, ..material(0.5, 0.0) }, light(page(), above, tilt, white))),
        (
            "annulus through the floor",
            floor(material(0.25, 0.3), light(annulus(), DVec3::new(0.0, 0.2, 0.0), tilt, white)),
        ),
        ("page through the floor", floor(material(0.1, 0.0), light(page(), DVec3::new(0.0, 0.1, 0.3), tilt, white))),
        (
            "rectangle facing away",
            floor(material(0.25, 0.0), light(rectangle(), above, DVec3::new(0.0, 170.0, 0.0), white)),
        ),
        ("textures", textured()),
        ("sphere of few triangles", mesh(6)),
        ("sphere of many triangles", mesh(120)),
        ("no light", Scene { lights: Vec::new(), ..mesh(6) }),
        ("no surface", Scene { triangles: Vec::new(), ..mesh(6) }),
    ];
    let mut both = floor(material(0.25, 0.0), light(blob(), above, DVec3::new(0.0, 65.0, 10.0), white));
    both.lights[0].two_sided = true;
    all.push(("blob with two sides", both));
    let mut layers = floor(material(0.2, 0.5), light(annulus(), above, tilt, DVec3::new(0.2, 0.5, 2.0)));
    layers.lights[0].layers.push(Layer {
        shape: blob(),
        radiance: DVec3::new(0.7, 0.1, 0.0),
        opacity: 0.5,
        picture: None,
    });
    layers.lights.push(light(rectangle(), DVec3::new(2.0, 0.6, -1.0), DVec3::new(0.0, -30.0, 5.0), white));
    all.push(("two lights, three emissions", layers));
    let mut down = floor(material(0.15, 0.0), light(annulus(), above, DVec3::new(70.0, 0.0, 0.0), white));
    down.camera.position = DVec3::new(0.1, 4.0, 0.1);
    down.camera.look_at = DVec3::new(0.1, 0.0, 0.1);
    all.push(("seen from straight above", down));
    all
}

/// Scenes where f32 is short of digits.
fn hard_scenes() -> Vec<(&'static str, Scene)> {
    let white = DVec3::ONE;
    let tilt = DVec3::new(15.0, 20.0, 0.0);
    let scaled = |mut scene: Scene, factor: f64, shift: DVec3| {
        let place = |p: DVec3| p * factor + shift;
        scene.camera.position = place(scene.camera.position);
        scene.camera.look_at = place(scene.camera.look_at);
        for light in &mut scene.lights {
            let Placement { origin, x, y } = light.placement;
            light.placement = Placement { origin: place(origin), x: x * factor, y: y * factor };
        }
        for v in scene.triangles.iter_mut().flat_map(|t| &mut t.vertices) {
            v.position = place(v.position);
        }
        scene
    };
    let page_at = |alpha, y| floor(material(alpha, 0.5), light(page(), DVec3::new(0.0, y, 0.0), tilt, white));
    let mut straight =
        floor(material(0.02, 1.0), light(page(), DVec3::new(0.0, 1.0, 0.0), DVec3::new(90.0, 0.0, 0.0), white));
    straight.camera = Camera { position: DVec3::new(0.0, 4.0, 0.0), look_at: DVec3::ZERO, ..straight.camera };
    let mut near = page_at(0.1, 0.3);
    near.camera.position = DVec3::new(0.2, 0.02, 1.5);
    vec![
        ("alpha 0.02", page_at(0.02, 1.2)),
        ("alpha 0.005", page_at(0.005, 1.2)),
        ("alpha 0.001", page_at(0.001, 1.2)),
        ("mirror, alpha 0", page_at(0.0, 1.2)),
        ("mirror from straight above", straight),
        (
            "standing on the floor",
            floor(material(0.2, 0.0), light(rectangle(), DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO, white)),
        ),
        (
            "lying close above the floor",
            floor(material(0.2, 0.0), light(annulus(), DVec3::new(0.0, 1e-3, 0.0), DVec3::new(90.0, 0.0, 0.0), white)),
        ),
        (
            "lying very close above the floor",
            floor(material(0.2, 0.0), light(annulus(), DVec3::new(0.0, 1e-5, 0.0), DVec3::new(90.0, 0.0, 0.0), white)),
        ),
        ("grazing view", near),
        ("small", scaled(page_at(0.1, 0.3), 1e-4, DVec3::ZERO)),
        ("large", scaled(page_at(0.1, 0.3), 1e4, DVec3::ZERO)),
        ("far from the origin", scaled(page_at(0.1, 0.3), 1.0, DVec3::new(1e5, -3e4, 2e5))),
        ("triangles below a pixel", mesh(400)),
    ]
}

pub fn white_level(scene: &Scene) -> f32 {
    let layers = scene.lights.iter().flat_map(|l| &l.layers);
    layers.map(|l| l.radiance.max_element()).fold(1.0, f64::max) as f32
}

/// Fraction of pixels that differ by more than 1e-5 of the white level in any layer, and the largest difference over it.
pub fn difference(a: &Film, b: &Film, white: f32) -> (f64, f32) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pixel = |f: &Film, i: usize| -> Vec<f32> {
        let layers = [f.diffuse[i], f.specular[i], f.emission[i], f.background[i]];
        // The matte is a fraction of the pixel, and so a fraction of the white level.
        layers.into_iter().flatten().chain([f.matte[i] * white]).collect()
    };
    let error = |i: usize| -> f32 {
        let off = |(x, y): (f32, f32)| if x.is_finite() && y.is_finite() { (x - y).abs() } else { f32::MAX };
        pixel(a, i).into_iter().zip(pixel(b, i)).map(off).fold(0.0, f32::max) / white
    };
    let errors: Vec<f32> = (0..a.matte.len()).map(error).collect();
    let off = errors.iter().filter(|&&e| e > 1e-5).count() as f64 / errors.len() as f64;
    (off, errors.into_iter().fold(0.0, f32::max))
}

pub fn agree((off, worst): (f64, f32)) -> bool {
    off <= 0.05 && worst <= 1e-3
}

pub fn render(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> Rendering {
    backend.render(scene, settings).unwrap()
}

/// Brightest value that a surface reflects.
pub fn brightest(film: &Film) -> f32 {
    film.diffuse.iter().chain(&film.specular).flatten().fold(0.0, |a, &b| a.max(b))
}

#[test]
fn every_scene_is_the_same_on_both() {
    let Some(gpu) = gpu() else { return };
    let mut bad = Vec::new();
    let hard = hard_scenes().into_iter().map(|(name, scene)| (name, scene, 1));
    let all = scenes().into_iter().flat_map(|(name, scene)| [(name, scene.clone(), 1), (name, scene, 3)]);
    for (name, scene, samples) in all.chain(hard) {
        let settings = settings(samples);
        let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
        let difference = difference(&a.film, &b.film, white_level(&scene));
        println!("{name}, {samples} samples: {:.2e} of the pixels off, worst {:.1e}", difference.0, difference.1);
        let lit = !scene.lights.is_empty() && !scene.triangles.is_empty();
        let blank = lit && brightest(&b.film) < 0.01;
        if !agree(difference) || blank || !same_stats(&a.stats, &b.stats) {
            bad.push(format!("{name}: {difference:?}, blank {blank}, {:?}, {:?}", a.stats, b.stats));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

/// Samples are the same; decisions that hang on a rounding may differ. The points of a workgroup share the top of the trees, so that
/// on the GPU (`b`) they visit fewer nodes, and no more than a few more where another's top is not quite theirs.
pub fn same_stats(a: &Stats, b: &Stats) -> bool {
    let near = |x: u64, y: u64| x.abs_diff(y) as f64 <= 1e-3 * x.max(y) as f64 + 2.0;
    let lights = a.lights.iter().zip(&b.lights).all(|(x, y)| {
        x.name == y.name
            && x.candidates == y.candidates
            && near(x.behind, y.behind)
            && near(x.below_horizon, y.below_horizon)
            && near(x.no_lobe, y.no_lobe)
            && near(x.under_tolerance, y.under_tolerance)
            && near(x.clustered, y.clustered)
            && near(x.behind_tile, y.behind_tile)
            && near(x.below_tile, y.below_tile)
    });
    let totals = a.shaded == b.shaded
        && near(a.integrals, b.integrals)
        && (a.nodes / 2..=a.nodes + a.nodes / 100 + 2).contains(&b.nodes);
    totals && lights && a.lights.len() == b.lights.len()
}

/// The comparison notices a light that moves by a hundredth of its size.
#[test]
fn a_moved_light_is_noticed() {
    let Some(gpu) = gpu() else { return };
    for (name, scene) in scenes() {
        if scene.lights.is_empty() {
            continue;
        }
        let mut moved = scene.clone();
        moved.lights[0].placement.origin.x += 0.02;
        let settings = settings(1);
        let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &moved, &settings));
        assert!(!agree(difference(&a.film, &b.film, white_level(&scene))), "{name}");
    }
}

/// A picture wider and one higher than a tile, neither a multiple of it or of a workgroup.
#[test]
fn tiles_fit_together() {
    let Some(gpu) = gpu() else { return };
    for (width, height) in [(1031, 29), (27, 2050)] {
        let settings = Settings { width, height, ..settings(1) };
        let scene = mesh(12);
        let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
        assert!(agree(difference(&a.film, &b.film, white_level(&scene))), "{width} × {height}");
        assert!(same_stats(&a.stats, &b.stats));
    }
}

#[test]
fn what_the_gpu_cannot_do_is_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = mesh(6);
    let exact = Settings { technique: Technique::Exact, ..settings(1) };
    assert!(matches!(gpu.render(&scene, &exact), Err(BackendError::CpuOnly(_))));
    let empty = Settings { width: 0, ..settings(1) };
    assert!(matches!(gpu.render(&scene, &empty), Err(BackendError::Size { .. })));
}

/// Single integrals of the WGSL walk against the Rust walk: random lights, lobes and places, the hostile ones included.
#[test]
fn the_walks_agree_on_single_integrals() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Rng(21);
    let mut scene = floor(Material::default(), light(rectangle(), DVec3::ZERO, DVec3::ZERO, DVec3::ONE));
    scene.lights = (0..40)
        .map(|i| {
            let shape = if i % 8 == 0 { page() } else { crate::cases::blob(&mut rng) };
            let turn = DVec3::new(rng.within(-180.0, 180.0), rng.within(-180.0, 180.0), 0.0);
            let mut light = light(shape, rng.direction() * rng.within(0.0, 3.0), turn, DVec3::ONE);
            light.two_sided = i % 2 == 0;
            light
        })
        .collect();
    let prepared = Prepared::new(&scene, &settings(1)).unwrap();
    let points: Vec<MeterPoint> = (0..8000)
        .map(|i| {
            let emitter = i % prepared.emitters.len();
            let normal = rng.direction();
            let mut view = rng.direction();
            if view.dot(normal) < 0.0 {
                view = -view;
            }
            let distance = rng.log_within(0.03, 30.0);
            let position = prepared.emitters[emitter].placement.origin + rng.direction() * distance;
            MeterPoint {
                position: position.as_vec3(),
                emitter: emitter as u32,
                normal: normal.as_vec3(),
                alpha: rng.log_within(0.01, 1.0) as f32,
                view: view.as_vec3(),
                tolerance: if i % 2 == 0 { 1e-3 } else { 1e-5 },
            }
        })
        .collect();
    let expected: Vec<[f64; 2]> = points.iter().map(|p| on_the_cpu(&prepared, p)).collect();
    let readings = gpu.measure(&prepared, &points).unwrap();
    let mut errors: Vec<f64> = readings
        .iter()
        .zip(&expected)
        .flat_map(|(r, e)| [(f64::from(r.diffuse.x) - e[0]).abs(), (f64::from(r.specular.x) - e[1]).abs()])
        .collect();
    errors.sort_by(f64::total_cmp);
    let quantile = |q: f64| errors[((errors.len() - 1) as f64 * q) as usize];
    println!(
        "median {:.1e}, 99 % {:.1e}, 99.9 % {:.1e}, worst {:.1e}",
        quantile(0.5),
        quantile(0.99),
        quantile(0.999),
        quantile(1.0)
    );
    assert!(expected.iter().filter(|e| e[0] > 0.01 && e[1] > 0.01).count() > 1000);
    assert!(quantile(0.99) < 2e-6);
    assert!(quantile(1.0) < 2e-4);
    // A lobe wider by a hundredth is another lobe.
    let wider: Vec<MeterPoint> = points.iter().map(|p| MeterPoint { alpha: p.alpha * 1.01, ..*p }).collect();
    let others = gpu.measure(&prepared, &wider).unwrap();
    let off = others.iter().zip(&expected).filter(|(r, e)| (f64::from(r.specular.x) - e[1]).abs() > 2e-4).count();
    assert!(off > points.len() / 20, "{off}");
}

/// Both integrals at a point by the Rust kernel.
pub fn on_the_cpu(prepared: &Prepared, point: &MeterPoint) -> [f64; 2] {
    let emitter = &prepared.emitters[point.emitter as usize];
    let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
    let Ok(images) = Images::new(emitter, &frame, point.position.as_dvec3()) else { return [0.0; 2] };
    let lobe = Table::shipped().lobe(point.alpha, frame.cos_theta as f32);
    [None, Some(&lobe)].map(|lobe| {
        images.integral(emitter, lobe, point.tolerance, &mut Budget::default()).map_or(0.0, |gathered| gathered.value.x)
    })
}
