//! Whole pictures by the tree against whole pictures by the float64 yardstick, and the order of lights in view.

use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::film::Film;
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;

fn light(size: [f64; 2], position: [f64; 3], rotation: [f64; 3], radiance: [f64; 3]) -> AreaLight {
    let half = DVec2::from_array(size) * 0.5;
    AreaLight {
        name: "light".into(),
        layers: vec![Layer {
            shape: Shape::rectangle(-half, half),
            radiance: DVec3::from_array(radiance),
            opacity: 1.0,
            picture: None,
        }],
        form: Form::Outline,
        placement: Placement::new(DVec3::from_array(position), DVec3::from_array(rotation), DVec2::ONE),
        two_sided: false,
    }
}

/// A glossy floor seen from straight in front: in the middle column the lights' normals lie in the plane of incidence.
fn scene(lights: Vec<AreaLight>) -> Scene {
    let camera =
        Camera { position: DVec3::new(0.0, 1.5, 5.0), look_at: DVec3::new(0.0, 0.3, 0.0), up: DVec3::Y, fov_y: 50.0 };
    let floor = Material { base_color: [0.5; 3], alpha: 0.2, ..Material::default() };
    Scene {
        camera,
        triangles: plane(DVec3::ZERO, DVec3::Y, [20.0; 2], 1.0, 0).to_vec(),
        materials: vec![floor],
        textures: vec![],
        lights,
        background: [0.0; 3],
    }
}

fn render(scene: &Scene, technique: Technique) -> Film {
    let settings = Settings { width: 65, height: 41, samples: 1, tolerance: 1e-4, technique, ..Settings::default() };
    CpuBackend.render(scene, &settings).unwrap().film
}

fn worst(a: &Film, b: &Film) -> f32 {
    let difference = |(p, q): ([f32; 3], [f32; 3])| (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f32::max);
    a.beauty().zip(b.beauty()).map(difference).fold(0.0, f32::max)
}

#[test]
fn pictures_are_within_the_tolerance_of_the_yardstick() {
    // Above the floor, through it, and lying over it.
    for (position, rotation) in
        [([0.0, 1.0, 0.0], [0.0; 3]), ([0.0, 0.3, 0.0], [0.0; 3]), ([0.0, 1.2, 1.0], [90.0, 0.0, 0.0])]
    {
        let scene_at = |x: f64| {
            let position = [position[0] + x, position[1], position[2]];
            scene(vec![light([1.6, 1.2], position, rotation, [1.0, 0.8, 0.6])])
        };
        let exact = render(&scene_at(0.0), Technique::Exact);
        let error = worst(&render(&scene_at(0.0), Technique::Tree), &exact);
        assert!(error < 1.2e-4, "light at {position:?}: {error}");
        let moved = worst(&render(&scene_at(0.02), Technique::Tree), &exact);
        assert!(moved > 1e-3, "moved by 2 cm: {moved}");
    }
}

#[test]
fn the_nearer_light_hides_the_farther() {
    // A long strip that lies over the floor towards the camera, and a sign at its far end, whose middle is farther
    // than the strip's: and the other way round.
    let strip = || light([0.3, 6.0], [0.0, 0.8, 1.0], [-90.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let sign = |z: f64| light([1.0, 0.6], [0.0, 0.8, z], [0.0; 3], [0.0, 0.0, 1.0]);
    // The strip is seen on its lit upper side from y = 1.5; the pixel looks at its middle, z = 1.
    let at = |film: &Film, z: f64| {
        let camera = scene(vec![]).camera;
        let frame = camera.frame(65.0 / 41.0);
        let p = DVec3::new(0.0, 0.8, z) - camera.position;
        let y = p.dot(frame.up) / frame.up.length_squared() / p.dot(frame.forward);
        let row = ((1.0 - y) * 0.5 * 41.0) as usize;
        film.emission[row * 65 + 32]
    };
    for lights in [vec![strip(), sign(1.5)], vec![sign(1.5), strip()]] {
        let film = render(&scene(lights), Technique::Tree);
        let [red, _, blue] = at(&film, 2.5);
        assert!(red > 0.9 && blue < 0.1, "before the sign the strip is seen: {red} {blue}");
    }
    for lights in [vec![strip(), sign(3.0)], vec![sign(3.0), strip()]] {
        let film = render(&scene(lights), Technique::Tree);
        let [red, _, blue] = at(&film, 2.9);
        assert!(red < 0.1 && blue > 0.9, "behind the sign it is hidden: {red} {blue}");
    }
}

/// A scene as a model of itself.
pub fn scaled(mut scene: Scene, factor: f64) -> Scene {
    scene.camera.position *= factor;
    scene.camera.look_at *= factor;
    for light in &mut scene.lights {
        let Placement { origin, x, y } = light.placement;
        light.placement = Placement { origin: origin * factor, x: x * factor, y: y * factor };
    }
    scene.triangles.iter_mut().flat_map(|t| &mut t.vertices).for_each(|v| v.position *= factor);
    scene
}

/// A scene of a thousandth of a millimetre looks as one of metres.
#[test]
fn a_tiny_scene_is_seen() {
    let of_size = |factor: f64| {
        let scene = scene(vec![light([1.0, 0.6], [0.0, 0.6, 0.0], [0.0; 3], [1.0; 3])]);
        render(&scaled(scene, factor), Technique::Tree)
    };
    let metres = of_size(1.0);
    let off = worst(&of_size(1e-6), &metres);
    assert!(off < 1e-4, "{off}");
    let mut dark = metres.clone();
    dark.specular.fill([0.0; 3]);
    assert!(worst(&dark, &metres) > 1e-2);
}
