//! `shape` in scene files.

use glam::{DVec2, DVec3};
use glyphlight::light::{AreaLight, Form};
use glyphlight::scene::file::{Loaded, SceneError, load};
use std::f64::consts::PI;

const CAMERA: &str = "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n[[light]]\n";

fn load_text(keys: &str) -> Result<Loaded, SceneError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.toml");
    std::fs::write(&path, format!("{CAMERA}{keys}\n")).unwrap();
    load(&path)
}

fn light(keys: &str) -> AreaLight {
    let mut loaded = load_text(keys).unwrap_or_else(|e| panic!("{e}\n{keys}"));
    assert_eq!(loaded.warnings, Vec::<String>::new(), "{keys}");
    loaded.scene.lights.remove(0)
}

#[test]
fn every_shape_is_read() {
    let area = |l: &AreaLight| l.layers[0].shape.area();
    let size = |l: &AreaLight| l.layers[0].shape.bounds().size();
    let sphere = light("shape = \"sphere\"\nradius = 0.5\nposition = [1, 2, 3]");
    assert_eq!((sphere.form, sphere.name.as_str()), (Form::Sphere { radius: 0.5 }, "sphere"));
    assert_eq!((sphere.placement.origin, size(&sphere)), (DVec3::new(1.0, 2.0, 3.0), DVec2::ONE));
    let disc = light("shape = \"disc\"\nradius = 0.5\ntwo_sided = true");
    assert_eq!((disc.form, disc.two_sided, size(&disc)), (Form::Disc, true, DVec2::ONE));
    assert!((area(&disc) - PI * 0.25).abs() < 1e-14);
    let ellipse = light("shape = \"ellipse\"\nsize = [2, 0.5]\nscale = [1, -2]");
    assert_eq!((ellipse.form, size(&ellipse)), (Form::Disc, DVec2::new(2.0, 0.5)));
    assert!((area(&ellipse) * ellipse.placement.normal().length() - PI * 0.5).abs() < 1e-14);
    let rectangle = light("shape = \"rectangle\"\nsize = [2, 0.5]");
    assert_eq!((rectangle.form, size(&rectangle)), (Form::Rectangle, DVec2::new(2.0, 0.5)));
    assert_eq!(size(&light("shape = \"rectangle\"\nsize = 2")), DVec2::splat(2.0));
    let tube = light("shape = \"tube\"\nradius = 0.1\nlength = 3\nrotation = [0, 0, 90]\nscale = [2, -2]");
    assert_eq!((tube.form, size(&tube)), (Form::Tube { radius: 0.1, length: 3.0 }, DVec2::new(3.0, 0.2)));
    assert!((tube.placement.x - DVec3::Y * 2.0).length() < 1e-15);
    assert_eq!(light("path = \"M0 0H1V1H0Z\"").form, Form::Outline);
}

/// L = Φ/(π·area), with all of the area that shines.
#[test]
fn power_is_that_of_the_whole_surface() {
    let radiance = |keys: &str| light(keys).layers[0].radiance.x;
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    let sphere = radiance("shape = \"sphere\"\nradius = 0.5\nscale = 2\npower = 60");
    assert!(close(sphere, 60.0 / (PI * 4.0 * PI)), "{sphere}");
    let tube = radiance("shape = \"tube\"\nradius = 0.1\nlength = 3\nscale = -2\npower = 60");
    assert!(close(tube, 60.0 / (PI * (2.0 * PI * 0.2 * 6.0 + 2.0 * PI * 0.04))), "{tube}");
    assert!(!close(tube, 60.0 / (PI * 2.0 * PI * 0.2 * 6.0)), "the caps shine as well");
    let disc = radiance("shape = \"disc\"\nradius = 0.5\npower = 60");
    let both = radiance("shape = \"disc\"\nradius = 0.5\npower = 60\ntwo_sided = true");
    assert!(close(disc, 60.0 / (PI * PI * 0.25)) && close(disc, 2.0 * both), "{disc} {both}");
    assert!(close(radiance("shape = \"rectangle\"\nsize = [2, 3]\npower = 60"), 60.0 / (PI * 6.0)));
    assert!(close(radiance("shape = \"sphere\"\nradius = 0.5\nluminance = 683"), 1.0));
}

#[test]
fn a_body_has_no_back() {
    for keys in ["shape = \"sphere\"\nradius = 0.5", "shape = \"tube\"\nradius = 0.1\nlength = 3"] {
        let both = load_text(&format!("{keys}\npower = 6\ntwo_sided = true")).unwrap();
        let once = load_text(&format!("{keys}\npower = 6\ntwo_sided = false")).unwrap();
        let warned = both.warnings.concat();
        assert!(warned.contains("light[0].shape: two_sided: has no effect on a "), "{warned}");
        assert_eq!(once.warnings.len(), 0);
        assert_eq!(both.scene.lights, once.scene.lights);
    }
}

#[test]
fn mistakes_are_named() {
    let cases = [
        (
            "shape = \"cube\"",
            "scene.toml:5: light[0].shape = \"cube\": must be one of \"sphere\", \"disc\", \"ellipse\"",
        ),
        ("shape = 3", "light[0].shape = 3: must be a string"),
        ("shape = \"sphere\"", "light[0].radius: missing; it holds the radius in metres"),
        ("shape = \"sphere\"\nradius = 0", "scene.toml:6: light[0].radius = 0: must be a length of 1e-9 to 1e9 m"),
        ("shape = \"sphere\"\nradius = nan", "light[0].radius = nan: must be a length"),
        (
            "shape = \"sphere\"\nradius = 1\nlength = 2",
            "scene.toml:7: light[0].length = 2: has no meaning for shape \"sphere\", which has radius",
        ),
        ("shape = \"disc\"\nsize = 2", "light[0].size = 2: has no meaning for shape \"disc\", which has radius"),
        (
            "shape = \"ellipse\"\nradius = 2",
            "light[0].radius = 2: has no meaning for shape \"ellipse\", which has size",
        ),
        ("shape = \"rectangle\"", "light[0].size: missing; it holds width and height"),
        ("shape = \"rectangle\"\nsize = [1, -1]", "light[0].size[1] = -1: must be a length of 1e-9 to 1e9 m"),
        ("shape = \"rectangle\"\nsize = [1e9, 1e-9]", "the light \"rectangle\" has no area"),
        ("shape = \"tube\"\nradius = 1", "light[0].length: missing; it holds the length in metres"),
        (
            "shape = \"tube\"\nradius = 1e-3\nlength = 1e4",
            "scene.toml:7: light[0].length = 1e4: must be 1e-6 to 1e6 times the radius 0.001",
        ),
        (
            "shape = \"sphere\"\nradius = 1\nscale = [1, 2]",
            "scene.toml:7: light[0].scale = [1, 2]: must not stretch a sphere: give one number",
        ),
        (
            "shape = \"tube\"\nradius = 1\nlength = 1\nscale = [1, 2]",
            "light[0].scale = [1, 2]: must not stretch a tube",
        ),
        (
            "shape = \"sphere\"\nradius = 1e9\nposition = [9e8, 0, 0]\nscale = 3.2",
            "the light reaches 4.1e9 m from the origin; at most 4e9",
        ),
        ("shape = \"sphere\"\nradius = 1\nfont = \"Inter\"", "light[0].font: unknown key; known here: shape, radius"),
        (
            "shape = \"sphere\"\nradius = 1\npath = \"M0 0H1V1H0Z\"",
            "a light has exactly one of path, svg, text, shape; path and shape are given",
        ),
        ("radius = 1", "a light has exactly one of path, svg, text, shape; none is given"),
    ];
    for (keys, wanted) in cases {
        let message = load_text(keys).map(|_| ()).expect_err(keys).to_string();
        assert!(message.contains(wanted) && !message.contains('\n'), "{message}\nis not\n{wanted}");
    }
    // Nothing of that is wrong in itself.
    light("shape = \"ellipse\"\nsize = [1, 2]\nscale = [1, 2]");
    light("shape = \"tube\"\nradius = 1e-3\nlength = 9e2");
    light("shape = \"sphere\"\nradius = 1e9\nposition = [9e8, 0, 0]\nscale = 3");
}
