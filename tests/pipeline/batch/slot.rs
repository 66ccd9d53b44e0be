//! The light of a template that drawings fill.

use crate::svg::options;
use glam::DVec3;
use glyphlight::light::AreaLight;
use glyphlight::outline::svg::{Art, svg};
use glyphlight::scene::file::{self, Loaded};
use glyphlight::scene::folder::Folder;
use glyphlight::scene::slot::{Change, Slot};
use std::path::Path;

const CAMERA: &str = "[camera]\nposition = [0, 1, 3]\nlook_at = [0, 0.5, 0]\n";

fn template(light: &str) -> Result<Loaded, String> {
    let text = format!("{CAMERA}[[light]]\n{light}\n");
    file::parse_template(text, Path::new("t.toml"), &Folder::bundled(&[])).map_err(|e| e.to_string())
}

fn slot(light: &str) -> Slot {
    template(&format!("slot = true\n{light}")).unwrap().slot.unwrap()
}

/// A bar of 40 × 10 in the upper left of a picture of 100 × 50.
fn bar(fill: &str) -> Art {
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 50'><rect width='40' height='10' fill='{fill}'/></svg>"
    );
    svg(text.as_bytes(), "bar", &options(1.0)).unwrap()
}

/// The lower left and the upper right corner of a light in the world.
fn corners(light: &AreaLight) -> [DVec3; 2] {
    let bounds = light.layers[0].shape.bounds();
    [bounds.min, bounds.max].map(|p| light.placement.point(p))
}

fn near(found: [DVec3; 2], wanted: [[f64; 3]; 2]) {
    for (found, wanted) in found.into_iter().zip(wanted) {
        assert!(found.distance(wanted.into()) < 1e-9, "{found} is not {wanted:?}");
    }
}

#[test]
fn drawings_are_fitted() {
    let fill = |keys: &str| slot(keys).fill("bar", bar("#fff")).unwrap().light;
    // The frame of 2 × 1 m about the origin.
    near(corners(&fill("size = 2")), [[-1.0, 0.3, 0.0], [-0.2, 0.5, 0.0]]);
    near(corners(&fill("size = [8, 0.5]")), [[-0.5, 0.15, 0.0], [-0.1, 0.25, 0.0]]);
    near(corners(&fill("size = 2\nanchor = \"bottom\"")), [[-1.0, 0.8, 0.0], [-0.2, 1.0, 0.0]]);
    // The bar itself.
    near(corners(&fill("size = 2\nfit = \"outline\"")), [[-1.0, -0.25, 0.0], [1.0, 0.25, 0.0]]);
    let placed = "size = 2\nfit = \"outline\"\nanchor = \"top\"\nposition = [1, 2, 3]\nrotation = [0, 90, 0]";
    near(corners(&fill(placed)), [[1.0, 1.5, 4.0], [1.0, 2.0, 2.0]]);
    let change =
        Change { size: Some([1.0, 1.0]), position: Some([0.0; 3]), rotation: Some([0.0; 3]), ..Change::default() };
    let changed = slot(placed).changed(&change).fill("bar", bar("#fff")).unwrap().light;
    near(corners(&changed), [[-0.5, -0.25, 0.0], [0.5, 0.0, 0.0]]);
}

#[test]
fn drawings_shine_as_the_slot_says() {
    let radiance = |keys: &str, fill: &str| {
        let filled = slot(&format!("size = 2\nfit = \"outline\"\n{keys}")).fill("bar", bar(fill)).unwrap();
        (filled.light.layers[0].radiance, filled.was_black)
    };
    assert_eq!(radiance("", "#fff"), (DVec3::ONE, false));
    assert_eq!(radiance("radiance = [1, 2, 3]", "#f00"), (DVec3::X, false));
    assert_eq!(radiance("radiance = 2\nsvg_colors = false", "#f00"), (DVec3::splat(2.0), false));
    assert_eq!(radiance("radiance = 2", "#000"), (DVec3::splat(2.0), true));
    // 2 × 0.5 m, both sides.
    let (power, _) = radiance("power = 6.283185307179586\ntwo_sided = true", "#fff");
    assert!((power - DVec3::ONE).length() < 1e-9, "{power}");
    let fault =
        |keys: &str, fill: &str| slot(&format!("size = 2\n{keys}")).fill("bar", bar(fill)).unwrap_err().to_string();
    assert!(fault("svg_colors = true", "#000").contains("all of it is black"));
}

#[test]
fn templates_have_one_slot_and_other_scenes_none() {
    let fault = |light: &str| template(light).unwrap_err();
    for (light, words) in [
        ("shape = \"disc\"\nradius = 1", "a template has a [[light]] with slot = true"),
        ("slot = true", "t.toml:4: light[0].size: missing"),
        ("slot = false\nsize = 1", "slot = false: must be true"),
        ("slot = true\nsize = 0", "light[0].size = 0"),
        ("slot = true\nsize = 1\nsvg = \"a.svg\"", "light[0].svg: unknown key"),
        ("slot = true\nsize = 1\nfit = \"all\"", "\"frame\", \"outline\""),
        ("slot = true\nsize = 1\nradiance = 1\npower = 1", "give one of radiance, power, luminance"),
        ("slot = true\nsize = 1\n[[light]]\nslot = true\nsize = 1", "one slot"),
    ] {
        let fault = fault(light);
        assert!(fault.contains(words), "{light}: {fault}");
    }
    let text = format!("{CAMERA}[[light]]\nslot = true\nsize = 1\n");
    let fault = file::parse(text, Path::new("t.toml"), &Folder::bundled(&[])).unwrap_err().to_string();
    assert!(fault.contains("t.toml:4: light[0]: it is a slot"), "{fault}");
}
