//! The sign of `--text` and `--svg`: in the picture with its reflection, whatever its proportions.

use glam::{DVec2, DVec3};
use glyphlight::light::Layer;
use glyphlight::scene::Scene;
use glyphlight::scene::preset::{PresetError, PresetOptions, sign};
use glyphlight::shape::Shape;

fn layer(min: DVec2, max: DVec2) -> Layer {
    Layer { shape: Shape::rectangle(min, max), radiance: DVec3::ONE, opacity: 1.0, picture: None }
}

/// Where a point is in the picture, −1 to 1 both ways; `None` behind the eye.
fn project(scene: &Scene, aspect: f64, point: DVec3) -> Option<DVec2> {
    let frame = scene.camera.frame(aspect);
    let to = point - scene.camera.position;
    let depth = to.dot(frame.forward);
    let along = |axis: DVec3| to.dot(axis) / axis.length_squared() / depth;
    (depth > 0.0).then(|| DVec2::new(along(frame.right), along(frame.up)))
}

#[test]
fn sign_and_reflection_fill_the_picture_whatever_the_proportions() {
    for size in [[1.0, 1.0], [12.0, 0.7], [0.3, 5.0], [4e3, 1e3], [2e-4, 3e-4]] {
        for aspect in [16.0 / 9.0, 1.0, 0.5, 4.0] {
            // Somewhere in light space, in two layers.
            let (low, size) = (DVec2::new(3.0, -7.0), DVec2::from(size));
            let mid = low + size * DVec2::new(0.4, 1.0);
            let layers = vec![layer(low, mid), layer(DVec2::new(mid.x, low.y), low + size)];
            let scene = sign(layers, &PresetOptions { aspect, ..PresetOptions::default() }).unwrap();
            let light = &scene.lights[0];
            let mut extreme = DVec2::ZERO;
            for corner in [low, low + size, DVec2::new(mid.x, low.y)] {
                let world = light.placement.point(corner);
                assert!(world.y > 0.0, "the sign stands above the floor");
                for point in [world, world * DVec3::new(1.0, -1.0, 1.0)] {
                    let at = project(&scene, aspect, point).expect("in front of the camera");
                    assert!(at.abs().max_element() < 0.89, "{size} in {aspect}: {point} is at {at}");
                    extreme = extreme.max(at.abs());
                }
            }
            assert!(extreme.max_element() > 0.8, "{size} in {aspect}: the picture is not filled, {extreme}");
            let eye = scene.camera.position;
            assert!(
                eye.y > 0.0 && (eye - light.placement.origin).dot(light.placement.normal()) > 0.0,
                "the reader's side"
            );
            assert_eq!(eye.x, 0.0);
            // The floor reaches past the camera and out of sight.
            let reach = scene.triangles[0].vertices[0].position.abs().max_element();
            assert!(reach > 5.0 * eye.length(), "{size} in {aspect}: floor {reach}, eye {eye}");
        }
    }
}

#[test]
fn the_picture_scales_with_the_sign() {
    let scene = |k: f64| sign(vec![layer(DVec2::ZERO, DVec2::new(3.0, 1.0) * k)], &PresetOptions::default()).unwrap();
    let (one, ten) = (scene(1.0).camera, scene(10.0).camera);
    assert!((one.position * 10.0 - ten.position).length() < 1e-9 * ten.position.length());
}

#[test]
fn options_reach_the_floor_and_nothing_is_invented_from_nothing() {
    let options = PresetOptions { alpha: 0.5, floor: [0.1, 0.2, 0.3], name: "OPEN".into(), ..PresetOptions::default() };
    let scene = sign(vec![layer(DVec2::ZERO, DVec2::ONE)], &options).unwrap();
    assert_eq!((scene.materials[0].alpha, scene.materials[0].base_color), (0.5, [0.1, 0.2, 0.3]));
    assert_eq!(scene.lights[0].name, "OPEN");
    assert_eq!(sign(Vec::new(), &options).unwrap_err(), PresetError::Empty(0.0, 0.0));
    assert_eq!(sign(vec![layer(DVec2::ZERO, DVec2::X)], &options).unwrap_err(), PresetError::Empty(1.0, 0.0));
    for size in [1e-13, 1e13] {
        let error = sign(vec![layer(DVec2::ZERO, DVec2::splat(size))], &options).unwrap_err();
        assert!(matches!(error, PresetError::Extent(w, h) if w == h && (w / size - 1.0).abs() < 1e-9), "{error}");
    }
    let bad = PresetOptions { aspect: 0.0, ..options };
    assert_eq!(sign(vec![layer(DVec2::ZERO, DVec2::ONE)], &bad).unwrap_err(), PresetError::Aspect(0.0));
}
