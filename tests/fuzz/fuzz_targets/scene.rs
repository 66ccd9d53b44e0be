//! Scene files beside a drawing, a font, a mesh and a picture; what loads is rendered.

#![no_main]

use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Settings};
use glyphlight::scene::file::parse;
use glyphlight::scene::folder::Folder;
use glyphlight_fuzz::{LETTERS, abort_on_our_panics, check_shape};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

const FILES: &[(&str, &[u8])] = &[
    ("a.svg", include_bytes!("../../../svg/ring.svg")),
    ("a.glb", include_bytes!("../../data/scenes/shelf.glb")),
    ("a.ttf", LETTERS),
    ("a.png", include_bytes!("../seeds/picture.png")),
];

fuzz_target!(init: abort_on_our_panics(), |data: &str| {
    let folder = Folder::bundled(FILES);
    let Ok(loaded) = parse(data.to_owned(), Path::new("fuzzed.toml"), &folder) else { return };
    for layer in loaded.scene.lights.iter().flat_map(|light| &light.layers) {
        check_shape(&layer.shape, 0.0);
        assert!(layer.radiance.is_finite() && layer.radiance.min_element() >= 0.0, "radiance {}", layer.radiance);
    }
    let settings = Settings { width: 4, height: 3, samples: 1, ..Settings::default() };
    let Ok(rendering) = CpuBackend.render(&loaded.scene, &settings) else { return };
    let film = rendering.film;
    for (name, pixels) in [("diffuse", &film.diffuse), ("specular", &film.specular), ("emission", &film.emission)] {
        let fine = |v: &f32| v.is_finite() && *v >= 0.0;
        assert!(pixels.iter().flatten().all(fine), "{name}: {pixels:?}");
    }
});
