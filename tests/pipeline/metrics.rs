//! Figures against values worked out by hand, FLIP against its paper where it has a closed form.

use crate::cases::Rng;
use glyphlight::color::srgb_decode;
use glyphlight::film::Film;
use glyphlight::metrics::{Figures, MetricsError, figures, flip, signed_error};

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

#[test]
fn figures_are_what_they_say() {
    // Four components of twelve are wrong: by 0.5, −1, 0.25 and 0.25. Powers of two, so that f32 holds them.
    let yardstick = [[1.0, 2.0, 4.0], [0.0, 0.0, 0.0], [0.5, 0.5, 0.5], [1.0, 1.0, 1.0]];
    let picture = [[1.5, 2.0, 3.0], [0.0, 0.25, 0.0], [0.5, 0.5, 0.75], [1.0, 1.0, 1.0]];
    let found = figures(&picture, &yardstick).unwrap();
    let squares = 0.25 + 1.0 + 2.0 * 0.0625;
    let rmse = (squares / 12.0_f64).sqrt();
    let expected = Figures {
        mae: 2.0 / 12.0,
        rmse,
        rmse_of_peak: Some(rmse / 4.0),
        max: 1.0,
        p999: 1.0,
        energy_ratio: Some(11.5 / 11.5),
    };
    assert!(close(found.mae, expected.mae, 1e-15) && close(found.rmse, expected.rmse, 1e-15), "{found:?}");
    assert!(close(found.rmse_of_peak.unwrap(), expected.rmse_of_peak.unwrap(), 1e-15), "{found:?}");
    assert_eq!((found.max, found.p999), (1.0, 1.0));
    assert!(close(found.energy_ratio.unwrap(), 1.0, 1e-15), "{found:?}");
    // A brighter copy has the energy it is brighter by; the figures notice a change of one component.
    let double = yardstick.map(|p| p.map(|c| 2.0 * c));
    assert!(close(figures(&double, &yardstick).unwrap().energy_ratio.unwrap(), 2.0, 1e-15));
    let mut worse = picture;
    worse[3][1] = 1.0 + 1e-3;
    let worse = figures(&worse, &yardstick).unwrap();
    assert!(worse.mae > found.mae && worse.rmse > found.rmse && worse.energy_ratio > found.energy_ratio);
}

#[test]
fn the_percentile_leaves_out_a_thousandth() {
    // 3000 components, of which three are wrong: 99.9 % is the 2997th, and it is right. With four it isn't.
    let yardstick = vec![[0.0_f32; 3]; 1000];
    let mut picture = yardstick.clone();
    picture[17] = [1.0, 2.0, 3.0];
    let three = figures(&picture, &yardstick).unwrap();
    assert_eq!((three.p999, three.max), (0.0, 3.0));
    picture[500][1] = -0.5;
    let four = figures(&picture, &yardstick).unwrap();
    assert_eq!((four.p999, four.max), (0.5, 3.0));
    // Nothing to be relative to.
    assert_eq!((four.rmse_of_peak, four.energy_ratio), (None, None));
}

#[test]
fn the_signed_error_is_that_of_the_worst_channel() {
    let yardstick = [[0.5, 0.5, 0.5], [0.0, 1.0, 0.0], [2.0, 2.0, 2.0]];
    let picture = [[0.75, 0.5, 0.0], [0.0, 1.0, 0.0], [2.5, 2.0, 1.75]];
    assert_eq!(signed_error(&picture, &yardstick).unwrap(), [-0.5, 0.0, 0.5]);
    assert_eq!(signed_error(&yardstick, &picture).unwrap(), [0.5, 0.0, -0.5]);
}

#[test]
fn pictures_that_cannot_be_compared_are_errors() {
    let black = vec![[0.0_f32; 3]; 4];
    let mut broken = black.clone();
    broken[2][1] = f32::NAN;
    broken[3][0] = f32::INFINITY;
    for (a, b) in [(&broken, &black), (&black, &broken)] {
        let MetricsError::NotFinite { pixels, first, .. } = figures(a, b).unwrap_err() else { panic!("wrong error") };
        assert_eq!((pixels, first), (2, 2));
        assert!(signed_error(a, b).is_err());
    }
    assert_eq!(figures(&black, &black[..3]).unwrap_err(), MetricsError::Size(4, 3));
    assert_eq!(figures(&[], &[]).unwrap_err(), MetricsError::Size(0, 0));
    for (bytes, width, height) in [(12, 2, 1), (0, 0, 0), (12, 4, 4)] {
        let bytes = vec![0; bytes];
        assert!(flip(&bytes, &bytes, width, height).is_err());
    }
}

/// FLIP between two pictures of one colour each, from the paper: without edges and points only eqs. 3 to 9 are left.
fn flip_of_colors(a: [u8; 3], b: [u8; 3]) -> f64 {
    let lab = |rgb: [u8; 3]| {
        const XYZ: [[f64; 3]; 3] = [
            [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
            [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
            [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
        ];
        let linear = rgb.map(|c| srgb_decode(f64::from(c) / 255.0));
        let dot = |row: [f64; 3], v: [f64; 3]| row.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
        let f = |t: f64| {
            let delta: f64 = 6.0 / 29.0;
            if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
        };
        let [x, y, z] = XYZ.map(|row| f(dot(row, linear) / dot(row, [1.0; 3])));
        let lightness = 116.0 * y - 16.0;
        // Hunt adjustment.
        [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
    };
    let hyab = |a: [f64; 3], b: [f64; 3]| ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(0.7);
    let most = hyab(lab([0, 255, 0]), lab([0, 0, 255]));
    let error = hyab(lab(a), lab(b));
    let knee = 0.4 * most;
    if error < knee { error * 0.95 / knee } else { 0.95 + (error - knee) / (most - knee) * 0.05 }
}

#[test]
fn flip_of_plain_colours_is_the_papers() {
    let picture = |color: [u8; 3]| color.repeat(40 * 30);
    let compared = |a, b| flip(&picture(a), &picture(b), 40, 30).unwrap();
    let mut rng = Rng(7);
    let mut byte = || (rng.unit() * 256.0) as u8;
    let mut pairs: Vec<_> = (0..8).map(|_| [[byte(), byte(), byte()], [byte(), byte(), byte()]]).collect();
    pairs.push([[0, 255, 0], [0, 0, 255]]);
    pairs.push([[128; 3], [130; 3]]);
    let mut told_apart = 0;
    for [a, b] in pairs {
        let (found, expected) = (compared(a, b), flip_of_colors(a, b));
        // Single precision, and the paper's code clamps colours that its opponent space takes out of range.
        assert!(close(found, expected, 2e-3), "{a:?} {b:?}: {found} for {expected}");
        // Another colour is another value, but for pairs that differ as much as two colours can.
        let other = [a[0] ^ 128, a[1], a[2]];
        told_apart += u32::from((compared(other, b) - expected).abs() > 2e-3);
    }
    assert!(told_apart >= 6, "{told_apart}");
    assert_eq!(compared([3, 200, 90], [3, 200, 90]), 0.0);
}

#[test]
fn flip_sees_edges_move() {
    let step = |at: usize| (0..60 * 40).flat_map(|i| [if i % 60 < at { 40 } else { 200 }; 3]).collect::<Vec<u8>>();
    let [one, two] = [1, 2].map(|shift| flip(&step(30 + shift), &step(30), 60, 40).unwrap());
    assert!(two > one && one > 0.005, "{one} {two}");
}

#[test]
fn reflected_light_is_diffuse_and_specular() {
    let mut film = Film::new(2, 1);
    film.diffuse[1] = [0.25, 0.5, 1.0];
    film.specular[1] = [0.5, 0.5, 0.5];
    film.emission[1] = [100.0; 3];
    film.background[0] = [9.0; 3];
    assert_eq!(film.reflected().collect::<Vec<_>>(), [[0.0; 3], [0.75, 1.0, 1.5]]);
}
