//! Sequences: values between keyframes, and frames that take over from the one before only what is the same.

use crate::backends::{floor, gpu, light};
use glam::{DQuat, DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Rendering, Settings, Skips, Technique};
use glyphlight::film::Film;
use glyphlight::light::{AreaLight, simple};
use glyphlight::scene::file::{self, Loaded};
use glyphlight::scene::folder::Folder;
use glyphlight::scene::motion::{Aim, CameraMotion, Interpolation, LightMotion, Motion, Track, turn};
use glyphlight::scene::{Material, Scene};
use glyphlight::shape::Shape;
use std::path::Path;

const LINEAR: Interpolation = Interpolation::Linear;
const SMOOTH: Interpolation = Interpolation::Smooth;

#[test]
fn a_track_goes_through_its_keys() {
    let track = Track::new(vec![(1.0, 10.0), (2.0, 20.0), (4.0, -4.0)]).unwrap();
    for interpolation in [LINEAR, SMOOTH] {
        for (time, value) in [(-9.0, 10.0), (1.0, 10.0), (1.5, 15.0), (2.0, 20.0), (3.0, 8.0), (4.0, -4.0), (9.0, -4.0)]
        {
            assert_eq!(track.at(time, interpolation), value, "{interpolation:?} at {time}");
        }
    }
    assert_eq!((track.at(1.25, LINEAR), track.at(1.25, SMOOTH)), (12.5, 10.0 + 10.0 * 0.15625));
    // Smooth starts and stops at rest, linear doesn't.
    let speed = |time: f64, i| (track.at(time + 1e-6, i) - track.at(time - 1e-6, i)) / 2e-6;
    assert!(speed(2.0, SMOOTH).abs() < 1e-3 && speed(2.0, LINEAR).abs() > 1.0);
    assert!(Track::new(vec![(1.0, 1.0), (1.0, 2.0)]).is_none() && Track::<f64>::new(Vec::new()).is_none());
    assert!(Track::new(vec![(f64::NAN, 1.0)]).is_none());
}

#[test]
fn rotations_turn_about_one_axis_the_shorter_way() {
    let track = |to: f64| {
        Track::new(vec![(0.0, DQuat::IDENTITY), (1.0, turn(DVec3::new(0.0, to, 0.0)))]).unwrap().at(0.5, LINEAR)
    };
    for (to, half) in [(90.0, 45.0), (-60.0, -30.0), (170.0, 85.0), (190.0, -85.0)] {
        let wanted = turn(DVec3::new(0.0, half, 0.0));
        assert!(track(to).dot(wanted).abs() > 1.0 - 1e-12, "{to}: {}", track(to));
    }
    // As scene files have it: Rz·Ry·Rx.
    let x = turn(DVec3::new(90.0, 0.0, 90.0)) * DVec3::Y;
    assert!((x - DVec3::Z).length() < 1e-12, "{x}");
}

/// A light that moves, turns, grows and brightens, a sphere that rises, and one that is still.
fn stage() -> (Scene, Motion) {
    let material = Material { alpha: 0.2, ..Material::default() };
    let mut scene = floor(material, light(Shape::disc(8), DVec3::new(-1.2, 1.2, 0.0), DVec3::ZERO, DVec3::ONE));
    let (form, shape) = simple::sphere(0.3);
    let ball = light(shape, DVec3::new(1.5, 0.6, 0.0), DVec3::ZERO, DVec3::new(0.2, 0.6, 1.0));
    scene.lights.push(AreaLight { form, ..ball });
    let still =
        light(Shape::rectangle(DVec2::ZERO, DVec2::new(0.5, 0.3)), DVec3::new(0.0, 0.2, 0.5), DVec3::ZERO, DVec3::X);
    scene.lights.push(still);
    let to = |a: DVec3, b: DVec3| Track::new(vec![(0.0, a), (2.0, b)]).unwrap();
    let radiances = |scene: &Scene, i: usize| scene.lights[i].layers.iter().map(|l| l.radiance).collect();
    let disc = LightMotion {
        light: 0,
        interpolation: SMOOTH,
        position: to(DVec3::new(-1.2, 1.2, 0.0), DVec3::new(0.3, 0.7, -0.5)),
        rotation: Track::new(vec![(0.0, DQuat::IDENTITY), (2.0, turn(DVec3::new(20.0, -50.0, 10.0)))]).unwrap(),
        scale: Track::new(vec![(0.0, DVec2::ONE), (1.0, DVec2::new(1.0, 0.5))]).unwrap(),
        emission: to(DVec3::ONE, DVec3::new(3.0, 0.5, 1.0)),
        radiances: radiances(&scene, 0),
    };
    let ball = LightMotion {
        light: 1,
        interpolation: LINEAR,
        position: to(DVec3::new(1.5, 0.6, 0.0), DVec3::new(1.5, 1.4, 0.0)),
        rotation: Track::still(DQuat::IDENTITY),
        scale: Track::still(DVec2::ONE),
        emission: Track::still(DVec3::ONE),
        radiances: radiances(&scene, 1),
    };
    (scene, Motion { lights: vec![disc, ball], camera: None, span: [0.0, 2.0] })
}

/// The camera walks to 1 s, and only turns from there on.
fn walk(scene: &Scene) -> CameraMotion {
    let from = scene.camera.position;
    CameraMotion {
        interpolation: LINEAR,
        position: Track::new(vec![(0.0, from), (1.0, from + DVec3::new(-0.8, 0.3, 0.2))]).unwrap(),
        aim: Aim::At(Track::new(vec![(0.0, scene.camera.look_at), (2.0, DVec3::new(0.4, 0.1, 0.0))]).unwrap()),
        fov_y: Track::new(vec![(0.0, 50.0), (2.0, 44.0)]).unwrap(),
    }
}

fn settings(technique: Technique) -> Settings {
    Settings { width: 61, height: 43, samples: 2, technique, ..Settings::default() }
}

/// Every number of a picture, as it is in memory.
fn bits(film: &Film) -> Vec<u32> {
    let layers = [&film.diffuse, &film.specular, &film.emission, &film.background];
    let values =
        layers.into_iter().flatten().flatten().chain(&film.matte).chain(film.variance.iter().flatten().flatten());
    values.map(|v| v.to_bits()).collect()
}

/// Times that go on, stand still and go back.
const TIMES: [f64; 6] = [0.0, 0.7, 1.0, 1.6, 1.6, 0.3];

fn frames(backend: &dyn Backend, scene: &Scene, motion: &Motion, settings: &Settings) -> Vec<Rendering> {
    let mut session = backend.begin(scene, motion, settings).unwrap();
    TIMES.iter().map(|&time| session.frame(time).unwrap()).collect()
}

fn frames_are_what_they_are_alone(backend: &dyn Backend, techniques: &[&str]) {
    let (scene, lights) = stage();
    let camera = Motion { camera: Some(walk(&scene)), ..lights.clone() };
    for technique in techniques {
        let settings = settings(technique.parse().unwrap());
        for motion in [&lights, &camera] {
            let together = frames(backend, &scene, motion, &settings);
            for (time, frame) in TIMES.into_iter().zip(&together) {
                let mut alone = scene.clone();
                motion.set(&mut alone, time);
                let alone = backend.render(&alone, &settings).unwrap();
                assert!(bits(&frame.film) == bits(&alone.film), "{technique} at {time}");
                assert_eq!((&frame.stats.lights, frame.stats.nodes), (&alone.stats.lights, alone.stats.nodes));
            }
            // Every frame is another, but for the one whose time comes twice.
            let other = |pair: &[Rendering]| bits(&pair[0].film) != bits(&pair[1].film);
            let others: Vec<bool> = together.windows(2).map(other).collect();
            assert_eq!(others, [true, true, true, false, true], "{technique}");
        }
    }
}

#[test]
fn on_the_cpu_frames_are_what_they_are_alone() {
    let all = ["tree", "kuge", "uniform:8", "quad:64", "textured", "pal", "representative", "reference"];
    frames_are_what_they_are_alone(&CpuBackend, &all);
}

#[test]
fn on_the_gpu_frames_are_what_they_are_alone() {
    let Some(gpu) = gpu() else { return };
    frames_are_what_they_are_alone(gpu, &["tree", "quad:64"]);
}

/// How often something was reused and made.
fn counts(frames: &[Rendering], what: &str) -> Vec<(u64, u64)> {
    let count = |r: &Rendering| r.stats.reused.iter().find(|c| c.what == what).map(|c| (c.reused, c.made)).unwrap();
    frames.iter().map(count).collect()
}

/// Of the thirteen buffers of a scene those stay that hold what light space, textures and surfaces are.
#[test]
fn on_the_gpu_only_what_has_moved_is_uploaded_again() {
    let Some(gpu) = gpu() else { return };
    let (scene, motion) = stage();
    let settings = settings(Technique::Tree);
    let together = frames(gpu, &scene, &motion, &settings);
    // Emitters, their boxes and clusters are written every time; none is there before the first picture.
    assert_eq!(counts(&together, "buffers"), [vec![(0, 13)], vec![(10, 3); 5]].concat());
    // With a camera that walks, turns, stands still and jumps back, triangles and their boxes are others where it has moved.
    let moving = Motion { camera: Some(walk(&scene)), ..motion.clone() };
    let walked: Vec<_> = counts(&frames(gpu, &scene, &moving, &settings), "buffers").iter().map(|c| c.1).collect();
    assert_eq!(walked, [13, 5, 5, 3, 3, 5]);
    let skips = Skips::without(&["reuse".parse().unwrap()]);
    let anew = frames(gpu, &scene, &motion, &Settings { skips, ..settings });
    assert_eq!(counts(&anew, "buffers"), vec![(0, 13); 6]);
    for (a, b) in together.iter().zip(&anew) {
        assert!(bits(&a.film) == bits(&b.film));
        assert!(a.stats.loaded.is_some_and(|bytes| bytes > 40 * a.stats.nodes / 2), "{:?}", a.stats.loaded);
    }
}

#[test]
fn only_what_has_changed_is_made_again() {
    let (scene, motion) = stage();
    let settings = settings(Technique::Tree);
    let together = frames(&CpuBackend, &scene, &motion, &settings);
    let again = |first: u64| [vec![(0, first)], vec![(first, 0); 5]].concat();
    assert_eq!(counts(&together, "trees"), again(3), "moved, brightened or still: a tree is a tree");
    for what in ["textures", "hierarchies of surfaces", "what the camera sees"] {
        assert_eq!(counts(&together, what), again(1), "{what}");
    }
    // A camera that walks, turns, stands still and jumps back.
    let moving = Motion { camera: Some(walk(&scene)), ..motion.clone() };
    let walked = frames(&CpuBackend, &scene, &moving, &settings);
    assert_eq!(counts(&walked, "trees"), again(3));
    let made = |what| counts(&walked, what).iter().map(|c| c.1).collect::<Vec<_>>();
    assert_eq!(made("hierarchies of surfaces"), [1, 1, 1, 0, 0, 1]);
    assert_eq!(made("what the camera sees"), [1, 1, 1, 1, 1, 1], "it is kept from the second of two with one view on");
    // Another colour or another shape of the light is another mask, and another place is not.
    let masks = frames(&CpuBackend, &scene, &motion, &Settings { technique: Technique::Quad { mask: 64 }, ..settings });
    assert_eq!(counts(&masks, "regions"), [(0, 3), (2, 1), (2, 1), (2, 1), (3, 0), (2, 1)]);
    // With the skip off all is made every time, and it is the same picture.
    let skips = Skips::without(&["reuse".parse().unwrap()]);
    let anew = frames(&CpuBackend, &scene, &motion, &Settings { skips, ..settings });
    assert_eq!(counts(&anew, "trees"), vec![(0, 3); 6]);
    for (a, b) in together.iter().zip(&anew) {
        assert!(bits(&a.film) == bits(&b.film));
    }
    let mut sum = together[0].stats.clone();
    together[1..].iter().for_each(|frame| sum.add(&frame.stats));
    assert_eq!(sum.nodes, together.iter().map(|f| f.stats.nodes).sum::<u64>());
    let trees = sum.reused.iter().find(|c| c.what == "trees").unwrap();
    assert_eq!((trees.reused, trees.made), (15, 3));
}

const CAMERA: &str = "[camera]\nposition = [0.0, 1.0, 5.0]\nlook_at = [0.0, 0.0, 0.0]\n";
const LIGHT: &str =
    "[[light]]\npath = \"M0 0H1V1H0Z\"\nposition = [0.0, 1.0, 0.0]\nscale = [-2.0, 1.0]\nradiance = 2.0\n";

fn load(text: &str) -> Result<Loaded, String> {
    file::parse(text.into(), Path::new("s.toml"), &Folder::bundled(&[])).map_err(|e| e.to_string())
}

#[test]
fn keyframes_of_a_scene_file_move_what_they_name() {
    let keys = "interpolation = \"smooth\"\n[[light.keyframe]]\ntime = 1\nposition = [1.0, 1.0, 0.0]\nemission = [0.5, 1.0, 1.0]\n\
                [[light.keyframe]]\ntime = 2\nrotation = [0.0, 90.0, 0.0]\n[[light.keyframe]]\ntime = 3\nposition = [3.0, 1.0, 0.0]\n\
                scale = [-4.0, 1.0]\n";
    let camera = "[[camera.keyframe]]\ntime = -1\nrotation = [0.0, 90.0, 0.0]\nfov_y = 30\n";
    let Loaded { mut scene, motion, .. } = load(&[CAMERA, camera, LIGHT, keys].concat()).unwrap();
    assert_eq!(motion.span, [-1.0, 3.0]);
    // As loaded it is at its first keyframe; a key that no keyframe has before, or at all, is that of the first that has it.
    let placement = scene.lights[0].placement;
    assert_eq!(placement.origin, DVec3::new(1.0, 1.0, 0.0));
    assert!((placement.x - DVec3::new(0.0, 0.0, -4.0)).length() < 1e-12, "{placement:?}");
    assert_eq!(scene.lights[0].layers[0].radiance, DVec3::new(1.0, 2.0, 2.0));
    assert_eq!((scene.camera.fov_y, scene.camera.position), (30.0, DVec3::new(0.0, 1.0, 5.0)));
    assert!((scene.camera.look_at - DVec3::new(-1.0, 1.0, 5.0)).length() < 1e-12, "{:?}", scene.camera);
    motion.set(&mut scene, 1.5);
    assert_eq!(scene.lights[0].placement.origin, DVec3::new(1.3125, 1.0, 0.0), "past a keyframe that leaves it out");
    // Without keyframes nothing moves.
    assert!(load(&[CAMERA, LIGHT].concat()).unwrap().motion.is_still());
}

#[test]
fn wrong_keyframes_are_named() {
    let key = "[[light.keyframe]]\ntime = 1\n";
    let cases = [
        (
            format!("{key}{key}"),
            "s.toml:12: light[0].keyframe[1].time = 1: must be after the time of the keyframe before, 1",
        ),
        ("[[light.keyframe]]\nposition = [0, 0, 0]\n".into(), "light[0].keyframe[0].time: missing"),
        (format!("{key}radiance = 1\n"), "light[0].keyframe[0].radiance: unknown key; known here: time, position"),
        (
            format!("{key}scale = 2.0\n"),
            "light[0].keyframe[0].scale = 2.0: must have the signs of the light's own scale",
        ),
        (format!("{key}scale = 0\n"), "light[0].keyframe[0].scale = 0: must be a scale of"),
        (format!("{key}emission = -1\n"), "light[0].keyframe[0].emission = -1: must be between 0 and 1e12"),
        (format!("{key}rotation = 3\n"), "light[0].keyframe[0].rotation = 3: must be an array of 3 numbers"),
        (format!("{key}scale = [-1e9, 1e9]\nposition = [1e9, 1e9, 1e9]\n"), ""),
        (format!("{key}scale = [-1e9, 1e9]\n[[light.keyframe]]\ntime = 2\nposition = [1e9, 0, 0]\n"), ""),
        (
            "interpolation = \"smooth\"\n".into(),
            "light[0].interpolation = \"smooth\": has no effect without a keyframe",
        ),
        (
            format!("interpolation = \"cubic\"\n{key}"),
            "light[0].interpolation = \"cubic\": must be one of \"linear\", \"smooth\"",
        ),
        ("keyframe = 3\n".into(), "light[0].keyframe = 3: must be an array of tables"),
        ("[[light.keyframe]]\ntime = nan\n".into(), "light[0].keyframe[0].time = nan: must be within ±1e9 s"),
    ];
    for (keys, wanted) in cases {
        match load(&[CAMERA, LIGHT, &keys].concat()) {
            Err(said) => assert!(!wanted.is_empty() && said.contains(wanted), "{keys}: {said}"),
            Ok(_) => assert!(wanted.is_empty(), "{keys} is accepted"),
        }
    }
    let both =
        "[[camera.keyframe]]\ntime = 1\nlook_at = [0, 0, 0]\n[[camera.keyframe]]\ntime = 2\nrotation = [0, 0, 0]\n";
    let said = load(&[CAMERA, both, LIGHT].concat()).unwrap_err();
    assert!(said.contains("camera: its keyframes have either look_at or rotation"), "{said}");
    let far = LIGHT.replace("path = \"M0 0H1V1H0Z\"", "path = \"M0 0H8V8H0Z\"");
    let said = load(&[CAMERA, &far, key, "scale = [-1e9, 1e9]\n"].concat()).unwrap_err();
    assert!(said.contains("may take the light"), "{said}");
}
