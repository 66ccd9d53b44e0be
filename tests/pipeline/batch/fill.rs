//! A session whose slot is filled with one light after the other: each picture is what it is alone.

use crate::backends::{floor, gpu, light};
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Rendering, Settings, Technique};
use glyphlight::light::{AreaLight, Layer, simple};
use glyphlight::scene::{Material, Motion, Scene};
use glyphlight::shape::Shape;

/// Three lights, of which the second is the slot.
fn stage() -> Scene {
    let material = Material { alpha: 0.2, ..Material::default() };
    let mut scene = floor(material, light(Shape::disc(8), DVec3::new(-1.4, 1.0, 0.0), DVec3::ZERO, DVec3::ONE));
    let empty = AreaLight { layers: Vec::new(), ..scene.lights[0].clone() };
    let (form, shape) = simple::sphere(0.3);
    let ball = light(shape, DVec3::new(1.5, 0.6, 0.0), DVec3::ZERO, DVec3::new(0.2, 0.6, 1.0));
    scene.lights.extend([empty, AreaLight { form, ..ball }]);
    scene
}

/// Lights of one, two and again one layer.
fn fillings() -> [AreaLight; 3] {
    let square = |low: f64| Shape::rectangle(DVec2::splat(low), DVec2::splat(low + 0.5));
    let one = light(square(0.0), DVec3::new(0.0, 0.2, 0.5), DVec3::new(10.0, 20.0, 0.0), DVec3::X * 2.0);
    let mut two = light(Shape::disc(6), DVec3::new(0.1, 1.4, 0.0), DVec3::ZERO, DVec3::Y);
    two.layers.push(Layer { shape: square(1.2), radiance: DVec3::Z, opacity: 1.0, picture: None });
    let last = light(square(-0.2), DVec3::new(-0.3, 0.6, 0.2), DVec3::ZERO, DVec3::ONE);
    [one, two, last]
}

fn check(backend: &dyn Backend, technique: &str) {
    let technique: Technique = technique.parse().unwrap();
    let settings = Settings { width: 24, height: 16, samples: 2, technique, ..Settings::default() };
    let scene = stage();
    let still = Motion::STILL;
    let mut session = backend.begin(&scene, &still, &settings).unwrap();
    let mut last: Option<Rendering> = None;
    for filling in fillings() {
        let mut alone = scene.clone();
        alone.lights[1] = filling.clone();
        session.fill(1, filling);
        let filled = session.frame(0.0).unwrap();
        assert!(filled.film == backend.render(&alone, &settings).unwrap().film, "{technique}");
        if let Some(last) = &last {
            assert!(last.film != filled.film, "{technique}: the light does not change");
            let reused = |what: &str| filled.stats.reused.iter().find(|r| r.what == what).map(|r| (r.reused, r.made));
            assert_eq!(reused("hierarchies of surfaces"), Some((1, 0)));
            assert_eq!(reused("textures"), Some((1, 0)));
            if let Some((kept, made)) = reused("trees").filter(|_| technique == Technique::Tree) {
                assert_eq!((kept, made), (2, alone.lights[1].layers.len() as u64));
            }
            if filled.stats.backend == "cpu" {
                assert_eq!(reused("what the camera sees"), Some((1, 0)));
            }
        }
        last = Some(filled);
    }
    // No such light: nothing happens.
    session.fill(7, fillings()[0].clone());
    assert!(session.frame(0.0).unwrap().film == last.unwrap().film);
}

#[test]
fn a_filled_slot_is_a_light_like_others() {
    for technique in ["tree", "quad:64", "uniform:6", "pal", "representative", "exact"] {
        check(&CpuBackend, technique);
    }
}

#[test]
fn a_filled_slot_is_a_light_like_others_on_the_gpu() {
    let Some(backend) = gpu() else { return };
    check(backend, "tree");
}
