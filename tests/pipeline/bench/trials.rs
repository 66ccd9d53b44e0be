//! The scenes that are timed: what is seen of them, and that the yardstick of a pictured light is right.

use glam::DVec2;
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::backend::{Backend, Settings, Technique};
use glyphlight::light::Layer;
use glyphlight::metrics::figures;
use glyphlight::picture::Picture;
use glyphlight::scene::Scene;
use glyphlight::scene::trial::{FINISHES, Finish, PETALS, PICTURE, Trial, colors, scene, windows};

#[test]
fn windows_hold_nothing_but_floor_and_pixels_of_one_size() {
    let layers = Trial::Rectangle.layers().unwrap();
    let settings = Settings { width: 8, height: 8, samples: 1, ..Settings::default() };
    let picture = PICTURE / 4;
    for finish in FINISHES {
        let all = scene(layers.clone(), finish);
        for camera in windows(picture) {
            let rendering = CpuBackend.render(&Scene { camera, ..all.clone() }, &settings).unwrap();
            assert_eq!(rendering.stats.shaded, 64, "{finish}: something else than floor in {camera:?}");
            let [diffuse, specular] = [&rendering.film.diffuse, &rendering.film.specular]
                .map(|layer| layer.iter().any(|p| p.iter().any(|c| *c > 0.0)));
            assert_eq!(
                [diffuse, specular],
                [finish.to_string() == "diffuse", finish.to_string() != "diffuse"],
                "{finish}"
            );
        }
    }
    // A pixel of a window is one in the middle of the whole picture, however many the window has.
    let pitch = |fov_y: f64, pixels: u32| (0.5 * fov_y.to_radians()).tan() / f64::from(pixels);
    let whole = pitch(scene(layers, FINISHES[0]).camera.fov_y, PICTURE);
    for side in [1, 24, 64, picture] {
        assert!(windows(side).iter().all(|camera| (pitch(camera.fov_y, side) / whole - 1.0).abs() < 1e-12), "{side}");
    }
}

#[test]
fn lights_stand_over_the_floor() {
    let mut last = 0;
    for trial in Trial::ALL {
        let layers = trial.layers().unwrap();
        let low = layers.iter().map(|l| l.shape.bounds().min.y).fold(f64::INFINITY, f64::min);
        assert!((low - 0.15).abs() < 1e-9, "{trial}: {low}");
        let curves: usize = layers.iter().map(|l| l.shape.curves().count()).sum();
        let more = if trial.has_picture() { curves == last } else { curves > last };
        assert!(more, "{trial}: {curves} curves after {last}");
        last = curves;
        assert_eq!(trial.name().parse(), Ok(trial));
    }
    let layers = Trial::Drawing.layers().unwrap();
    let contours: usize = layers.iter().map(|l| l.shape.contours().len()).sum();
    assert!(layers.len() == 3 && contours >= 500 && PETALS >= 500, "{} layers, {contours} contours", layers.len());
    assert!(Trial::Cavity.layers().unwrap()[0].shape.contours().iter().any(|c| c.is_hole()));
    assert!("cavern".parse::<Trial>().unwrap_err().contains("rectangle, cavity, glyph"));
}

/// What the floor reflects of some layers in all windows together, and the standard error of it where it is sampled.
fn reflected(layers: &[Layer], technique: Technique, tolerance: f32) -> (Vec<[f32; 3]>, Vec<f32>) {
    let settings = Settings { width: 4, height: 4, samples: 1, technique, tolerance, ..Settings::default() };
    let all = scene(layers.to_vec(), Finish::Gloss(0.25));
    let films = windows(4).map(|camera| CpuBackend.render(&Scene { camera, ..all.clone() }, &settings).unwrap().film);
    let errors = films.iter().flat_map(|f| f.variance.iter().flatten().flatten()).map(|v| v.sqrt()).collect();
    (films.iter().flat_map(|f| f.reflected().collect::<Vec<_>>()).collect(), errors)
}

/// The same layers, their picture upside down.
fn turned_over(mut layers: Vec<Layer>) -> Vec<Layer> {
    for layer in &mut layers {
        let picture = layer.picture.as_ref().unwrap();
        let over = Picture { low: picture.low, high: picture.high, ..picture.scaled(DVec2::new(1.0, -1.0)) };
        layer.picture = Some(over.into());
    }
    layers
}

/// The yardstick of a pictured light knows nothing of trees or tiles; Monte Carlo knows nothing of bands.
#[test]
fn bands_shine_as_their_picture_does() {
    let (pictured, flat) = (Trial::Picture.layers().unwrap(), Trial::Picture.flat_layers().unwrap());
    assert!(flat.len() > 60 && flat.iter().all(|l| l.picture.is_none()));
    let area = |layers: &[Layer]| layers.iter().map(|l| l.shape.area()).sum::<f64>();
    assert!((area(&flat) / area(&pictured) - 1.0).abs() < 1e-9);
    let flat = reflected(&flat, Technique::Exact, 1e-3).0;
    let sampling = Sampling { spp: 1 << 12, lobe: ReferenceLobe::Ltc, ..Sampling::default() };
    // Standard errors between the two, root mean square over pixels and channels.
    let deviation = |layers: Vec<Layer>| {
        let (sampled, errors) = reflected(&layers, Technique::Reference(sampling), 1e-3);
        let of_error = sampled.as_flattened().iter().zip(flat.as_flattened()).zip(&errors);
        let squares = of_error.map(|((a, b), error)| f64::from((a - b) / error).powi(2));
        (squares.sum::<f64>() / errors.len() as f64).sqrt()
    };
    let (same, other) = (deviation(pictured.clone()), deviation(turned_over(pictured.clone())));
    println!("{same:.2} and {other:.2} standard errors");
    assert!(same < 1.3 && other > 5.0);
    // The tree, which cuts the picture in its own way, is within its tolerance of them.
    let off = |layers: &[Layer]| figures(&reflected(layers, Technique::Tree, 1e-4).0, &flat).unwrap().max;
    assert!(off(&pictured) < 1e-4);
    assert!(off(&turned_over(pictured)) > 1e-2);
}

#[test]
fn bands_are_narrow_enough() {
    let layer = &Trial::Picture.layers().unwrap()[0];
    let picture = |bands: u32| reflected(&colors::bands(layer, bands).unwrap(), Technique::Exact, 1e-3).0;
    let finest = picture(2 * colors::BANDS);
    let off = |bands: u32| figures(&picture(bands), &finest).unwrap().rmse;
    let [enough, few] = [off(colors::BANDS), off(colors::BANDS / 16)];
    println!("{enough:.1e}, with a sixteenth of the bands {few:.1e}");
    assert!(enough < 1e-6 && few > 2e-5);
}
