//! Pictures written and read back: EXR to the bit, PNG against the display transform, nothing half-written.

use glyphlight::film::{Display, Film, FilmError, ToneMap};
use std::path::Path;

/// A picture whose layers differ in every pixel, with values that ask for all 32 bits.
fn film() -> Film {
    let mut film = Film::new(7, 5);
    for i in 0..35 {
        let t = i as f32 / 34.0;
        film.diffuse[i] = [t, t * t, 1.0 / 3.0 + t * 1e-7];
        film.specular[i] = [t * 1e-30, 12_345.678 * t, 0.1];
        film.emission[i] = [if i == 17 { 1e9 } else { 0.0 }, f32::from_bits(i as u32), 0.2];
        film.background[i] = [0.25 * t, 1e-20, t];
    }
    film
}

pub fn read_exr(path: &Path) -> exr::image::Image<exr::image::Layer<exr::image::AnyChannels<exr::image::FlatSamples>>> {
    use exr::prelude::*;
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap()
}

#[test]
fn exr_keeps_every_bit_of_every_layer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let film = film();
    film.write(&path, &Display::default()).unwrap();
    let image = read_exr(&path);
    let beauty: Vec<_> = film.beauty().collect();
    let stored = |name: &str| -> Vec<u32> {
        let channel =
            image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap_or_else(|| panic!("{name}"));
        assert!(matches!(channel.sample_data, exr::image::FlatSamples::F32(_)), "{name} is not 32-bit");
        channel.sample_data.values_as_f32().map(f32::to_bits).collect()
    };
    let layers = [
        ("", &beauty),
        ("diffuse.", &film.diffuse),
        ("specular.", &film.specular),
        ("emission.", &film.emission),
        ("background.", &film.background),
    ];
    for (prefix, layer) in layers {
        for (c, name) in ["R", "G", "B"].iter().enumerate() {
            let want: Vec<u32> = layer.iter().map(|p| p[c].to_bits()).collect();
            assert_eq!(stored(&format!("{prefix}{name}")), want, "{prefix}{name}");
        }
    }
    assert_eq!(stored("emission.A"), film.matte.iter().map(|m| m.to_bits()).collect::<Vec<_>>());
    assert_eq!(image.layer_data.channel_data.list.len(), 16);
    // The comparison notices one bit.
    let mut other = film.clone();
    other.specular[20][1] = f32::from_bits(other.specular[20][1].to_bits() ^ 1);
    assert_ne!(stored("specular.G"), other.specular.iter().map(|p| p[1].to_bits()).collect::<Vec<_>>());
}

/// A light ten times white that covers half a pixel shows as half white, not as white: edges stay smooth.
#[test]
fn a_bright_lights_edge_is_smooth_in_png() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edge.png");
    let mut film = Film::new(3, 1);
    for (i, matte) in [0.0, 0.5, 1.0].into_iter().enumerate() {
        film.emission[i] = [10.0 * matte; 3];
        film.matte[i] = matte;
    }
    let display = Display { tone_map: ToneMap::Linear, ..Display::default() };
    let shown = |film: &Film| -> Vec<u8> {
        film.write(&path, &display).unwrap();
        image::open(&path).unwrap().to_rgb8().pixels().map(|p| p[0]).collect()
    };
    assert_eq!(shown(&film), [0, 188, 255]);
    // Without its matte the edge is as white as the light.
    film.matte[1] = 0.0;
    assert_eq!(shown(&film), [0, 255, 255]);
}

#[test]
fn exr_says_what_its_numbers_mean() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.EXR");
    film().write(&path, &Display::default()).unwrap();
    let image = read_exr(&path);
    let chromaticities = image.attributes.chromaticities.expect("chromaticities");
    assert_eq!((chromaticities.red.0, chromaticities.white.1), (0.64, 0.329));
    assert_eq!(image.layer_data.encoding.compression, exr::compression::Compression::ZIP16);
    let software = image.layer_data.attributes.software_name.expect("software").to_string();
    assert!(software.starts_with("glyphlight "), "{software}");
}

#[test]
fn png_holds_the_displayed_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let film = film();
    let display = Display { exposure: -9.5, tone_map: ToneMap::Aces, dither: true };
    film.write(&path, &display).unwrap();
    let read = image::open(&path).unwrap().into_rgb8();
    assert_eq!(read.dimensions(), (7, 5));
    let mut differs = 0;
    for (i, radiance) in film.beauty().enumerate() {
        let (x, y) = (i as u32 % 7, i as u32 / 7);
        assert_eq!(read.get_pixel(x, y).0, display.encode(radiance, x, y), "({x}, {y})");
        let other = Display { exposure: -9.0, ..display };
        differs += usize::from(read.get_pixel(x, y).0 != other.encode(radiance, x, y));
    }
    assert!(differs > 20, "half a stop changes {differs} of 35 pixels");
}

#[test]
fn linear_display_is_the_srgb_curve_and_a_clip() {
    let display = Display::default();
    let byte = |v: f32| display.encode([v; 3], 0, 0)[0];
    assert_eq!([byte(-1.0), byte(0.0), byte(0.18), byte(0.5), byte(1.0), byte(7.0)], [0, 0, 118, 188, 255, 255]);
    let brighter = Display { exposure: 2.0, ..display };
    assert_eq!(brighter.encode([0.125, 0.045, 0.0], 0, 0), [188, 118, 0]);
}

#[test]
fn tone_maps_rise_and_stay_in_range() {
    for (name, map) in ToneMap::ALL {
        let mut last = -1.0;
        for k in 0..4000 {
            let grey = 1e-6 * 1.006_f64.powi(k);
            let [r, g, b] = map.apply([grey; 3]);
            assert!(r >= last && (0.0..=1.0).contains(&r), "{name} at {grey}: {r} after {last}");
            assert!((r - g).abs() < 1e-4 && (g - b).abs() < 1e-4, "{name} tints grey {grey}: {r} {g} {b}");
            last = r;
        }
        assert!(last > 0.999, "{name} reaches white: {last}");
        assert_eq!(map.apply([0.0; 3]), [0.0; 3], "{name} keeps black");
        // A saturated colour at any strength: every component in range, the brightest stays the brightest.
        for k in 0..60 {
            let c = map.apply([10_f64.powf(f64::from(k) * 0.5 - 10.0), 0.0, 0.0]);
            assert!(c.iter().all(|v| (0.0..=1.0).contains(v)) && c[0] >= c[1] && c[0] >= c[2], "{name}: {c:?}");
        }
    }
}

#[test]
fn tone_maps_have_their_published_values() {
    let grey = |map: ToneMap, v: f64| map.apply([v; 3])[0];
    assert_eq!(grey(ToneMap::Linear, 0.3), 0.3);
    assert_eq!(grey(ToneMap::Reinhard, 1.0), 0.5);
    // Neutral: 0.04 below the start of its compression, and 1 − d²/(peak + d − start) above it.
    assert!((grey(ToneMap::Neutral, 0.5) - 0.46).abs() < 1e-12);
    assert!((grey(ToneMap::Neutral, 1.04) - (1.0 - 0.24 * 0.24 / 0.48)).abs() < 1e-12);
    // ACES fitted: 0.18 is shown as 0.1056 (the curve by hand, matrices whose rows sum to 1 to 1e-4).
    let curve = (0.18 * (0.18 + 0.024_578_6) - 0.000_090_537) / (0.18 * (0.983_729 * 0.18 + 0.432_951) + 0.238_081);
    assert!((grey(ToneMap::Aces, 0.18) - curve).abs() < 1e-4);
}

#[test]
fn dither_is_fixed_unbiased_and_keeps_black_and_white() {
    let display = Display { dither: true, ..Display::default() };
    let plain = Display::default();
    let value = 0.2_f32;
    let exact = 255.0 * (1.055 * 0.2_f64.powf(1.0 / 2.4) - 0.055);
    let mean =
        |d: &Display| (0..64 * 64).map(|i| f64::from(d.encode([value; 3], i % 64, i / 64)[0])).sum::<f64>() / 4096.0;
    assert!((mean(&display) - exact).abs() < 0.02, "{} for {exact}", mean(&display));
    assert!((mean(&plain) - exact).abs() > 0.1, "without dither the mean is a whole level");
    assert_eq!(display.encode([0.0, 1.0, 9.0], 3, 1), [0, 255, 255]);
    assert_eq!(display.encode([value; 3], 5, 9), display.encode([value; 3], 5, 9));
}

/// What is in a folder.
fn files(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn what_cannot_be_written_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let display = Display::default();
    for name in ["picture.jpg", "picture", "png", ".png"] {
        let error = film().write(&at(name), &display).unwrap_err();
        assert!(matches!(error, FilmError::Extension(_)) && error.to_string().contains(name), "{error}");
    }
    let error = film().write(&at("no/such/folder.png"), &display).unwrap_err();
    assert!(matches!(error, FilmError::Folder { .. }) && error.to_string().contains("folder.png"), "{error}");
    let error = Film::new(0, 4).write(&at("empty.exr"), &display).unwrap_err();
    assert!(matches!(error, FilmError::Size { width: 0, .. }), "{error}");
    let mut torn = film();
    torn.specular.pop();
    assert!(matches!(torn.write(&at("torn.exr"), &display), Err(FilmError::Size { layers: [35, 34, 35], .. })));
    let mut bad = film();
    bad.diffuse[9][1] = f32::NAN;
    let error = bad.write(&at("nan.png"), &display).unwrap_err();
    assert!(matches!(error, FilmError::NotFinite { x: 2, y: 1, .. }), "{error}");
    assert_eq!(files(folder.path()), Vec::<String>::new());
    // A folder of the picture's name is not replaced, and nothing stays beside it.
    std::fs::create_dir(at("folder.png")).unwrap();
    assert!(matches!(film().write(&at("folder.png"), &display), Err(FilmError::Io { .. })));
    assert_eq!(files(folder.path()), ["folder.png"]);
}

#[test]
fn a_failed_write_keeps_the_old_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    film().write(&path, &Display::default()).unwrap();
    let before = std::fs::read(&path).unwrap();
    let mut bad = film();
    bad.emission[0] = [f32::INFINITY; 3];
    assert!(bad.write(&path, &Display::default()).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), before);
    film().write(&path, &Display { exposure: 3.0, ..Display::default() }).unwrap();
    assert_ne!(std::fs::read(&path).unwrap(), before);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::write(folder.path().join("plain"), "").unwrap();
        let mode = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        assert_eq!(mode("picture.png"), mode("plain"), "a picture has the permissions of any new file");
    }
}
