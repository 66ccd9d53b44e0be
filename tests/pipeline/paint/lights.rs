//! Pictures on lights: their mean, mirrored, from a scene file, by the command, and as the camera sees them.

use crate::cases::{Rng, blob};
use crate::cli::Workdir;
use glam::{DVec2, DVec3, DVec4, Vec4};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Settings};
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::picture::Picture;
use glyphlight::scene::Scene;
use glyphlight::scene::camera::Camera;
use glyphlight::scene::file::load;
use glyphlight::shape::{Bounds, Shape};
use std::sync::Arc;

fn picture(width: u32, height: u32, low: DVec2, high: DVec2, rng: &mut Rng) -> Picture {
    let mut texel = || Vec4::new(rng.unit() as f32, rng.unit() as f32, rng.unit() as f32, rng.unit() as f32);
    Picture { width, height, texels: (0..width * height).map(|_| texel()).collect(), low, high }
}

#[test]
fn means_over_shapes_are_those_of_many_samples() {
    let mut rng = Rng(21);
    for case in 0..12 {
        let shape = blob(&mut rng);
        let (width, height) = ([1, 2, 7, 40][case % 4], [1, 9, 3, 33][case / 3 % 4]);
        // Smaller and larger than the shape.
        let corner = rng.within(0.5, 2.0);
        let picture = picture(width, height, DVec2::new(-corner, -0.8), DVec2::new(1.1, corner), &mut rng);
        let mean = picture.mean_over(&shape);
        let n = 700;
        let (mut sum, mut count) = (DVec4::ZERO, 0.0);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let p = DVec2::new(f64::from(i) + 0.37, f64::from(j) + 0.61) / f64::from(n) * 2.2 - 1.1;
            if shape.winding(p) == 1 {
                sum += picture.sample(p).as_dvec4();
                count += 1.0;
            }
        }
        let error = (sum / count - mean.as_dvec4()).abs().max_element();
        assert!(error < 1e-3, "{width} × {height}: {error:e}");
        let moved = Picture { low: picture.low + 0.2, high: picture.high + 0.2, ..picture.clone() };
        assert!(width * height == 1 || (moved.mean_over(&shape) - mean).abs().max_element() > 1e-3);
        // A picture twice as fine, the same but for what lies between the texels, has nearly the same mean.
        let flat = Picture { texels: vec![Vec4::new(0.1, 0.2, 0.3, 0.4); picture.texels.len()], ..picture };
        assert!((flat.mean_over(&shape) - Vec4::new(0.1, 0.2, 0.3, 0.4)).abs().max_element() < 1e-6);
    }
    let edge = picture(5, 5, DVec2::ZERO, DVec2::ONE, &mut rng);
    assert_eq!(edge.mean_over(&Shape::default()), Vec4::ZERO);
}

/// The stated error of the mean: against the same picture on pieces a hundredth of a texel long, by cutting the shape's curves.
#[test]
fn means_are_right_to_the_stated_digits() {
    let mut rng = Rng(8);
    let mut worst: f64 = 0.0;
    for _ in 0..10 {
        let shape = blob(&mut rng);
        let contours = shape.contours().iter().map(|contour| {
            let cut = |c: &glyphlight::shape::CubicBez| {
                let c = *c;
                (0..200).map(move |i| c.subsegment(f64::from(i) / 200.0, f64::from(i + 1) / 200.0))
            };
            let mut curves: Vec<_> = contour.curves().iter().flat_map(cut).collect();
            let n = curves.len();
            (0..n).for_each(|i| curves[i].p3 = curves[(i + 1) % n].p0);
            curves
        });
        let fine = Shape::from_contours(contours.collect()).unwrap();
        let picture = picture(16, 11, DVec2::splat(-1.0), DVec2::splat(1.0), &mut rng);
        worst = worst.max(f64::from((picture.mean_over(&shape) - picture.mean_over(&fine)).abs().max_element()));
    }
    println!("mean over a shape: {worst:.1e} off");
    assert!(worst < 1e-4, "{worst:e}");
}

#[test]
fn scaled_pictures_show_the_same_elsewhere() {
    let mut rng = Rng(2);
    let picture = picture(5, 3, DVec2::new(-0.2, 0.1), DVec2::new(1.0, 0.9), &mut rng);
    for by in [DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0), DVec2::new(-2.0, -0.5), DVec2::ONE] {
        let scaled = picture.scaled(by);
        for _ in 0..100 {
            let p = DVec2::new(rng.within(-0.5, 1.5), rng.within(-0.5, 1.5));
            assert!((scaled.sample(p * by) - picture.sample(p)).abs().max_element() < 1e-5, "{by} {p}");
        }
        let p = DVec2::new(0.1, 0.2);
        assert!((scaled.sample(p * by) - picture.sample(p + 0.3)).abs().max_element() > 1e-3);
    }
}

#[test]
fn shapes_extend_as_far_as_their_curves() {
    let mut rng = Rng(4);
    let mut reach: f64 = 0.0;
    for _ in 0..20 {
        let shape = blob(&mut rng);
        let Bounds { min, max } = shape.extent();
        let points = shape.curves().flat_map(|c| (0..=500).map(|i| c.eval(f64::from(i) / 500.0)));
        let dense = Bounds::of(points);
        assert!((dense.min - min).abs().max_element() < 1e-4 && (dense.max - max).abs().max_element() < 1e-4);
        assert!(min.cmple(dense.min + 1e-12).all() && max.cmpge(dense.max - 1e-12).all());
        reach = reach.max((shape.bounds().size() - (max - min)).max_element());
    }
    assert!(reach > 0.05, "handles reach farther");
}

/// Four texels: red and green above, blue and a half-transparent white below.
fn quarters() -> image::RgbaImage {
    let mut quarters = image::RgbaImage::new(2, 2);
    for (x, y, pixel) in
        [(0, 0, [255, 0, 0, 255]), (1, 0, [0, 255, 0, 255]), (0, 1, [0, 0, 255, 255]), (1, 1, [255, 255, 255, 51])]
    {
        quarters.put_pixel(x, y, image::Rgba(pixel));
    }
    quarters
}

const CAMERA: &str = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n";

fn lit(light: &str) -> Result<AreaLight, String> {
    let dir = tempfile::tempdir().unwrap();
    quarters().save(dir.path().join("q.png")).unwrap();
    std::fs::write(dir.path().join("x.png"), b"not a picture").unwrap();
    let svg = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 4 4'><rect width='2' height='4' fill='#f00'/><rect x='2' width='2' height='4' fill='#0f0' fill-opacity='.5'/></svg>";
    std::fs::write(dir.path().join("two.svg"), svg).unwrap();
    let path = dir.path().join("scene.toml");
    std::fs::write(&path, format!("{CAMERA}[[light]]\n{light}")).unwrap();
    load(&path).map(|mut loaded| loaded.scene.lights.remove(0)).map_err(|e| e.to_string())
}

const BOX: &str = "path = \"M0 0H2V1H0Z\"\npicture = \"q.png\"\n";

#[test]
fn a_scene_file_lays_pictures_over_lights() {
    let color = |light: &AreaLight, x: f64, y: f64| {
        let layer = &light.layers[0];
        (
            layer.picture.as_ref().expect("a picture").sample(DVec2::new(x, y)).truncate().as_dvec3() * layer.radiance,
            layer.opacity,
        )
    };
    let plain = lit(&format!("{BOX}radiance = 3")).unwrap();
    let picture = plain.layers[0].picture.as_ref().unwrap();
    assert_eq!((picture.low, picture.high), (DVec2::ZERO, DVec2::new(2.0, 1.0)));
    assert_eq!(color(&plain, 0.1, 0.9).0, DVec3::X * 3.0, "upper left");
    assert_eq!(color(&plain, 1.9, 0.9).0, DVec3::Y * 3.0, "upper right");
    assert_eq!(color(&plain, 0.1, 0.1).0, DVec3::Z * 3.0, "lower left");
    assert!((color(&plain, 1.9, 0.1).0 - DVec3::splat(0.6)).length() < 1e-6, "alpha 51/255");
    assert!((picture.sample(DVec2::new(1.9, 0.1)).w - 0.2).abs() < 1e-6);
    let mirrored = lit(&format!("{BOX}radiance = 3\nscale = [-1, 1]")).unwrap();
    assert_eq!(color(&mirrored, -0.1, 0.9).0, DVec3::X * 3.0, "mirrored with the shape");
    assert_eq!(color(&mirrored, -1.9, 0.9).0, DVec3::Y * 3.0);
    let turned = lit(&format!("{BOX}radiance = 3\nscale = [2, -2]")).unwrap();
    assert_eq!(color(&turned, 0.1, -0.9).0, DVec3::X * 3.0);
    // A text: the box around what is seen of it.
    let text = lit("text = \"Oo\"\npicture = \"q.png\"").unwrap();
    let (bounds, picture) = (text.layers[0].shape.extent(), text.layers[0].picture.as_ref().unwrap());
    assert_eq!((picture.low, picture.high), (bounds.min, bounds.max));
    // One picture over all parts of an SVG without its colours.
    let svg = lit("svg = \"two.svg\"\nsvg_colors = false\npicture = \"q.png\"").unwrap();
    let opacities: Vec<_> = svg.layers.iter().map(|l| (l.opacity, l.radiance)).collect();
    assert_eq!(opacities, [(1.0, DVec3::ONE), (0.5, DVec3::splat(0.5))]);
    assert!(svg.layers.iter().all(|l| l.picture.as_ref().unwrap().low == DVec2::splat(-0.5)));
}

#[test]
fn power_is_that_of_the_picture() {
    // Bilinear with constant rims, each quarter counts alike.
    let mean = DVec3::splat(0.3);
    let flux = |light: &AreaLight| {
        let area = light.placement.normal().length() * light.layers[0].shape.area();
        light.layers[0].radiance * mean * std::f64::consts::PI * area
    };
    let light = lit(&format!("{BOX}power = 60\nscale = 2")).unwrap();
    assert!((flux(&light) - DVec3::splat(60.0)).length() < 1e-4, "{}", flux(&light));
    // Over the left half of the box the white does not count.
    let left = lit("path = \"M0 0H.25V1H0ZM1.9 .999V1H2V.999Z\"\npicture = \"q.png\"\npower = 60").unwrap();
    let expected = 60.0 / (std::f64::consts::PI * left.layers[0].shape.area() / 3.0);
    assert!((left.layers[0].radiance.x / expected - 1.0).abs() < 1e-3, "{} {expected}", left.layers[0].radiance);
    let nits = lit(&format!("{BOX}luminance = 683")).unwrap();
    assert!((nits.layers[0].radiance - DVec3::ONE).length() < 1e-9, "of the light where it is white");
}

#[test]
fn mistakes_with_pictures_are_named() {
    let cases = [
        ("path = \"M0 0H2V1H0Z\"\npicture = \"none.png\"", ["scene.toml:6: light[0].picture", "there is no file"]),
        ("path = \"M0 0H2V1H0Z\"\npicture = \"x.png\"", ["light[0].picture = \"x.png\"", "not a PNG or JPEG"]),
        ("path = \"M0 0H2V1H0Z\"\npicture = \"../q.png\"", ["light[0].picture", ".."]),
        ("path = \"M0 0H2V1H0Z\"\npicture = \"/etc/passwd\"", ["light[0].picture", "absolute"]),
        ("path = \"M0 0H2V1H0Z\"\npicture = 5", ["light[0].picture = 5", "must be a string"]),
        ("svg = \"two.svg\"\npicture = \"q.png\"", ["light[0].picture", "svg_colors = false"]),
        (
            "shape = \"sphere\"\nradius = 1\npicture = \"q.png\"",
            ["light[0].picture", "spheres and tubes have no picture"],
        ),
    ];
    for (light, words) in cases {
        let fault = lit(light).unwrap_err();
        assert!(words.iter().all(|w| fault.contains(w)), "{light}: {fault}");
    }
}

/// A light of 2 × 2 m at the origin, turned by `rotation`, seen from 4 m.
fn seen(rotation: DVec3, position: DVec3, two_sided: bool, picture: Picture, samples: u32) -> glyphlight::film::Film {
    let shape = Shape::rectangle(DVec2::splat(-1.0), DVec2::splat(1.0));
    let layer = Layer { shape, radiance: DVec3::splat(2.0), opacity: 1.0, picture: Some(Arc::new(picture)) };
    let scene = Scene {
        camera: Camera { position, look_at: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 },
        triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        lights: vec![AreaLight {
            name: "light".into(),
            layers: vec![layer],
            form: Form::Outline,
            placement: Placement::new(DVec3::ZERO, rotation, DVec2::ONE),
            two_sided,
        }],
        background: [0.0; 3],
    };
    let settings = Settings { width: 90, height: 90, samples, ..Settings::default() };
    CpuBackend.render(&scene, &settings).unwrap().film
}

/// The pixel in which a world point is seen by the camera of [`seen`] on the z axis.
fn pixel(p: DVec3) -> usize {
    let tan = 20_f64.to_radians().tan();
    let [x, y] = [p.x, -p.y].map(|v| ((v / ((4.0 - p.z) * tan) + 1.0) * 45.0) as usize);
    y * 90 + x
}

#[test]
fn the_camera_sees_the_picture_in_perspective() {
    let front = DVec3::Z * 4.0;
    // x in red, y in green.
    let ramp = |n: u32| {
        let texel = |i: u32| Vec4::new((i % n) as f32 + 0.5, n as f32 - (i / n) as f32 - 0.5, 0.0, n as f32) / n as f32;
        Picture {
            width: n,
            height: n,
            texels: (0..n * n).map(texel).collect(),
            low: DVec2::splat(-1.0),
            high: DVec2::splat(1.0),
        }
    };
    for rotation in [DVec3::ZERO, DVec3::new(0.0, 60.0, 0.0), DVec3::new(-50.0, 20.0, 30.0)] {
        let film = seen(rotation, front, false, ramp(64), 1);
        let placement = Placement::new(DVec3::ZERO, rotation, DVec2::ONE);
        for (x, y) in [(-0.7, -0.7), (0.0, 0.0), (0.6, -0.5), (-0.3, 0.7), (0.8, 0.8)] {
            let found = film.emission[pixel(placement.point(DVec2::new(x, y)))];
            let expected = [x + 1.0, y + 1.0].map(|v| v as f32);
            let error = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
            // A pixel is 0.03 m wide where it looks straight at the light.
            assert!(error < 0.09, "{rotation} ({x}, {y}): {found:?}");
            assert!((found[0] - expected[1]).abs() > 0.2 || (x - y).abs() < 0.2);
        }
    }
    // From behind it is mirrored, in pixels as in life.
    let behind = seen(DVec3::Y * 180.0, front, true, ramp(64), 1);
    let found = behind.emission[pixel(DVec3::new(0.7, 0.5, 0.0))];
    assert!((found[0] - 0.3).abs() < 0.05 && (found[1] - 1.5).abs() < 0.05, "{found:?}");
}

#[test]
fn the_camera_sees_through_alpha_and_averages_fine_texels() {
    let front = DVec3::Z * 4.0;
    let half = |alpha: f32| Picture {
        width: 1,
        height: 1,
        texels: vec![Vec4::new(0.25, 0.25, 0.25, alpha)],
        low: DVec2::splat(-1.0),
        high: DVec2::splat(1.0),
    };
    let film = seen(DVec3::ZERO, front, false, half(0.25), 1);
    let middle = pixel(DVec3::ZERO);
    assert!((film.matte[middle] - 0.25).abs() < 1e-3 && (film.emission[middle][0] - 0.5).abs() < 1e-6);
    assert!((seen(DVec3::ZERO, front, false, half(0.75), 1).matte[middle] - 0.75).abs() < 1e-3);
    // Stripes of one texel, about twelve to a pixel: grey, not black or white.
    let stripes = |n: u32| Picture {
        width: n,
        height: 1,
        texels: (0..n).map(|i| Vec4::new(1.0, 1.0, 1.0, 1.0) * (i % 2) as f32).collect(),
        low: DVec2::splat(-1.0),
        high: DVec2::splat(1.0),
    };
    let film = seen(DVec3::ZERO, front, false, stripes(768), 1);
    for y in (25..65).step_by(4) {
        for x in 25..65 {
            let v = film.emission[y * 90 + x][0];
            assert!((v - 1.0).abs() < 0.2, "{x} {y}: {v}");
        }
    }
    let coarse = seen(DVec3::ZERO, front, false, stripes(8), 1);
    assert!((25..65).any(|x| (coarse.emission[45 * 90 + x][0] - 1.0).abs() > 0.8), "wide stripes stay");
}

#[test]
fn the_command_takes_a_picture() {
    let here = Workdir::new();
    quarters().save(here.path("q.png")).unwrap();
    let small = ["--width", "64", "--height", "36", "--samples", "1", "--backend", "cpu"];
    let render = |args: &[&str], out: &str| {
        let output = here.run([&["render", "-o", out], args, &small[..]].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let box_ = ["--path", "M0 0H2V1H0Z"];
    assert_eq!(render(&[&box_[..], &["--picture", "q.png"]].concat(), "a.exr"), (Some(0), String::new()));
    assert_eq!(render(&box_, "b.exr"), (Some(0), String::new()));
    let bytes = |name: &str| std::fs::read(here.path(name)).unwrap();
    assert!(bytes("a.exr") != bytes("b.exr"), "the picture shows");
    let text = render(&["--text", "OK", "--picture", "q.png"], "c.png");
    assert_eq!(text, (Some(0), String::new()));
    let png = image::open(here.path("c.png")).unwrap().into_rgb8();
    let has = |k: usize| png.pixels().any(|p| p.0[k] > 120 && p.0[(k + 1) % 3] < 60 && p.0[(k + 2) % 3] < 60);
    assert!(has(0) && has(1) && has(2), "red, green and blue parts");
    here.write("bad.png", "no picture");
    let faults = [
        (&["--text", "OK", "--picture", "none.png"][..], "none.png"),
        (&["--text", "OK", "--picture", "bad.png"], "bad.png: not a PNG or JPEG picture"),
        (&["--svg", "x.svg", "--picture", "q.png"], "--picture goes with --text and --path"),
    ];
    for (args, words) in faults {
        let (code, stderr) = render(args, "d.png");
        assert!(code == Some(2) && stderr.contains(words), "{args:?}: {stderr}");
    }
}
