//! The Monte Carlo reference against the yardstick, against closed forms and quadrature, and against itself.

mod bodies;
mod points;
mod student;

use crate::yardstick::scaled;
use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::backend::{Backend, BackendError, Horizons, Rendering, Settings, Technique};
use glyphlight::film::{Display, Film};
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;

pub fn light(shape: Shape, origin: DVec3, turn: DVec3, radiance: DVec3) -> AreaLight {
    AreaLight {
        name: "light".into(),
        layers: vec![Layer { shape, radiance, opacity: 1.0, picture: None }],
        form: Form::Outline,
        placement: Placement::new(origin, turn, DVec2::ONE),
        two_sided: false,
    }
}

/// Lights over a floor, seen from a low place.
fn floor(alpha: f32, lights: Vec<AreaLight>) -> Scene {
    Scene {
        camera: Camera {
            position: DVec3::new(1.0, 1.6, 5.0),
            look_at: DVec3::new(0.0, 0.2, 0.3),
            up: DVec3::Y,
            fov_y: 45.0,
        },
        triangles: plane(DVec3::ZERO, DVec3::Y, [20.0; 2], 1.0, 0).to_vec(),
        materials: vec![Material { base_color: [0.8, 0.6, 0.4], metallic: 0.5, alpha, ..Material::default() }],
        textures: vec![],
        lights,
        background: [0.1; 3],
    }
}

fn sampling(spp: u32, lobe: ReferenceLobe) -> Sampling {
    Sampling { spp, lobe, ..Sampling::default() }
}

fn settings(technique: Technique) -> Settings {
    Settings { width: 24, height: 16, samples: 1, tolerance: 1e-4, technique, ..Settings::default() }
}

fn sampled(scene: &Scene, sampling: Sampling) -> Rendering {
    CpuBackend.render(scene, &settings(Technique::Reference(sampling))).unwrap()
}

/// Diffuse + specular of each channel.
fn reflected(film: &Film) -> impl Iterator<Item = f64> + '_ {
    film.diffuse.iter().flatten().zip(film.specular.iter().flatten()).map(|(d, s)| f64::from(*d) + f64::from(*s))
}

fn variances(film: &Film) -> Vec<f64> {
    film.variance.as_ref().unwrap().iter().flatten().map(|&v| f64::from(v)).collect()
}

/// Lights that every part of the sampler has a share in: shapes with holes, colours, a back, one that dips into the floor.
fn lights() -> Vec<AreaLight> {
    let mut rng = crate::cases::Rng(5);
    let ring = |radius, n, hole, rng: &mut crate::cases::Rng| crate::cases::ring(rng, DVec2::ZERO, radius, n, hole);
    let holed = Shape::from_contours(vec![ring(0.8, 9, false, &mut rng), ring(0.3, 5, true, &mut rng)]).unwrap();
    let blob = Shape::from_contours(vec![ring(0.6, 7, false, &mut rng)]).unwrap();
    let strip = Shape::rectangle(DVec2::new(-0.6, -0.1), DVec2::new(0.6, 0.1));
    let mut all = vec![
        light(holed, DVec3::new(-0.3, 0.7, 0.0), DVec3::new(10.0, 15.0, 0.0), DVec3::new(1.0, 0.8, 0.3)),
        light(blob, DVec3::new(1.4, 0.9, 1.0), DVec3::new(0.0, 140.0, 0.0), DVec3::new(0.2, 0.5, 1.5)),
        light(strip, DVec3::new(-1.2, 0.3, 1.5), DVec3::new(20.0, 60.0, 70.0), DVec3::new(0.5, 2.0, 0.5)),
    ];
    all[1].two_sided = true;
    all
}

/// What can go wrong when many hypotheses are tested at once: the level of each by Šidák so that all hold with 99 %.
fn sidak(count: usize) -> f64 {
    -(0.99_f64.ln() / count as f64).exp_m1()
}

/// Smallest p-value of the pixels over its Šidák level: under 1 the two films disagree.
fn agreement(reference: &Film, truth: &Film) -> f64 {
    agreement_but_for(reference, truth, 0.0)
}

/// The same; differences within `slack` are none.
fn agreement_but_for(reference: &Film, truth: &Film, slack: f64) -> f64 {
    let values: Vec<_> = reflected(reference).zip(reflected(truth)).zip(variances(reference)).collect();
    let p_value = |&((a, b), variance): &((f64, f64), f64)| {
        // Both films are rounded to f32.
        let rounding = slack + 1e-7 * (a.abs() + b.abs());
        if (a - b).abs() <= rounding { 1.0 } else { student::two_sided((a - b) / variance.sqrt()) }
    };
    assert!(values.iter().filter(|v| v.1 > 0.0).count() > values.len() / 50, "nothing is lit");
    values.iter().map(p_value).fold(1.0, f64::min) / sidak(values.len())
}

#[test]
fn the_ltc_lobe_agrees_with_the_yardstick_and_notices_one_percent() {
    for alpha in [0.02, 0.15, 0.6] {
        let scene = floor(alpha, lights());
        let exact = CpuBackend.render(&scene, &settings(Technique::Exact)).unwrap().film;
        let reference = sampled(&scene, sampling(1 << 12, ReferenceLobe::Ltc)).film;
        let agrees = agreement(&reference, &exact);
        println!("alpha {alpha}: least p over its level {agrees:.2e}");
        assert!(agrees > 1.0, "alpha {alpha}: {agrees:e}");
        let mut moved = scene.clone();
        // A hundredth of the light's width.
        moved.lights[0].placement.origin.x += 0.016;
        let moved = sampled(&moved, sampling(1 << 11, ReferenceLobe::Ltc)).film;
        let agrees = agreement(&moved, &exact);
        println!("alpha {alpha}, moved: {agrees:.2e}");
        assert!(agrees < 1e-3, "alpha {alpha}, moved: {agrees:e}");
    }
}

/// Where digits run short and densities run high.
#[test]
fn hard_places_agree_with_the_yardstick() {
    let rectangle = || Shape::rectangle(DVec2::new(-0.8, -0.5), DVec2::new(0.8, 0.5));
    let at = |origin: DVec3, turn: DVec3| light(rectangle(), origin, turn, DVec3::new(1.0, 0.7, 0.4));
    let level = DVec3::new(90.0, 0.0, 0.0);
    let upright = || floor(0.1, vec![at(DVec3::Y, DVec3::new(0.0, 20.0, 0.0))]);
    let mut grazing = upright();
    grazing.camera.position = DVec3::new(0.5, 0.01, 3.0);
    let scenes = [
        ("mirror", floor(0.0, vec![at(DVec3::Y, DVec3::ZERO)])),
        ("standing on the floor", floor(0.2, vec![at(DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO)])),
        ("just above the floor", floor(0.2, vec![at(DVec3::Y * 1e-3, level)])),
        ("in the floor", floor(0.2, vec![at(DVec3::ZERO, level)])),
        ("through the floor", floor(0.3, vec![at(DVec3::Y * 0.1, DVec3::new(30.0, 30.0, 0.0))])),
        ("grazing view", grazing),
        ("small", scaled(upright(), 1e-4)),
        ("large", scaled(upright(), 1e4)),
    ];
    for (name, scene) in scenes {
        let exact = CpuBackend.render(&scene, &settings(Technique::Exact)).unwrap().film;
        for lobe in [ReferenceLobe::Ltc, ReferenceLobe::Ggx] {
            let film = sampled(&scene, sampling(256, lobe)).film;
            assert!(reflected(&film).all(|v| v.is_finite() && v >= 0.0), "{name}");
            assert!(variances(&film).iter().all(|v| v.is_finite()), "{name}");
            // In the floor's own plane rounding decides who sees the light: there it only has to be finite.
            if lobe == ReferenceLobe::Ltc && name != "in the floor" {
                // Where a pixel sees next to nothing of the light, a few samples do not tell its variance.
                let agrees = agreement_but_for(&film, &exact, 2e-3);
                assert!(agrees > 1.0, "{name}: {agrees:e}");
                let brighter: Vec<_> = exact.specular.iter().map(|v| v.map(|v| v * 1.25)).collect();
                let agrees = agreement_but_for(&film, &Film { specular: brighter, ..exact.clone() }, 2e-3);
                assert!(agrees < 1e-2, "{name}, the lobe brighter by a quarter: {agrees:e}");
            }
        }
    }
}

/// A lobe clipped as published reflects what is below the floor, by the yardstick and by the reference alike.
#[test]
fn the_published_horizon_is_sampled_too() {
    let scene = floor(
        0.3,
        vec![light(
            Shape::rectangle(DVec2::new(-0.8, -0.6), DVec2::new(0.8, 0.6)),
            DVec3::new(0.0, 0.1, 0.0),
            DVec3::ZERO,
            DVec3::ONE,
        )],
    );
    let render =
        |technique, horizons| CpuBackend.render(&scene, &Settings { horizons, ..settings(technique) }).unwrap().film;
    let reference = Technique::Reference(sampling(1 << 12, ReferenceLobe::Ltc));
    for horizons in [Horizons::Both, Horizons::Cosine] {
        let agrees = agreement(&render(reference, horizons), &render(Technique::Exact, horizons));
        assert!(agrees > 1.0, "{horizons:?}: {agrees:e}");
    }
    assert!(agreement(&render(reference, Horizons::Both), &render(Technique::Exact, Horizons::Cosine)) < 1e-3);
}

#[test]
fn the_picture_hangs_on_the_seed_and_not_on_the_threads() {
    let scene = floor(0.2, lights());
    let render = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let sampling = Sampling { max_error: Some(0.004), ..sampling(512, ReferenceLobe::Ggx) };
        pool.install(|| sampled(&scene, Sampling { seed, ..sampling }))
    };
    let (one, two, other) = (render(1, 7), render(2, 7), render(2, 8));
    assert_eq!(one.film, two.film);
    assert_eq!(one.stats.nodes, two.stats.nodes);
    let changed = reflected(&one.film).zip(reflected(&other.film)).filter(|(a, b)| a != b).count();
    assert!(changed > one.film.diffuse.len(), "{changed} channels hang on the seed");
}

/// The mean of the variances told by single pictures is the variance over many seeds.
#[test]
fn the_variance_layer_is_the_spread_over_seeds() {
    let scene = floor(0.2, lights());
    // Both lobes, and so few samples that every batch is one.
    for (lobe, spp) in [(ReferenceLobe::Ggx, 64), (ReferenceLobe::Ltc, 16)] {
        let films: Vec<Film> =
            (0..40).map(|seed| sampled(&scene, Sampling { seed, ..sampling(spp, lobe) }).film).collect();
        let n = films.len() as f64;
        let values: Vec<Vec<f64>> = films.iter().map(|f| reflected(f).collect()).collect();
        let (mut spread, mut told) = (0.0, 0.0);
        for i in 0..values[0].len() {
            let mean = values.iter().map(|v| v[i]).sum::<f64>() / n;
            // Pixels weigh the same, bright or dark.
            let scale = 1.0 / (mean * mean).max(1e-8);
            spread += scale * values.iter().map(|v| (v[i] - mean).powi(2)).sum::<f64>() / (n - 1.0);
            told += scale * films.iter().map(|f| variances(f)[i]).sum::<f64>() / n;
        }
        println!("{spp} samples: variance told / spread {:.3}", told / spread);
        assert!((told / spread - 1.0).abs() < 0.05, "{} instead of {}", told, spread);
    }
}

#[test]
fn sampling_ends_where_the_error_is_small_enough() {
    let scene = floor(0.2, lights());
    let full = sampled(&scene, sampling(1 << 13, ReferenceLobe::Ggx));
    let with =
        |max_error| sampled(&scene, Sampling { max_error: Some(max_error), ..sampling(1 << 13, ReferenceLobe::Ggx) });
    let (coarse, fine) = (with(1e-2), with(2e-3));
    assert!(coarse.stats.nodes < fine.stats.nodes && fine.stats.nodes < full.stats.nodes);
    let worst = |r: &Rendering| variances(&r.film).into_iter().fold(0.0, f64::max).sqrt();
    assert!(worst(&coarse) <= 1e-2 && worst(&fine) <= 2e-3, "{} {}", worst(&coarse), worst(&fine));
    assert!(worst(&coarse) > 2e-3);
    // Ending early leaves no bias that shows: over all pixels the error is that of chance.
    let pairs: Vec<_> = reflected(&fine.film).zip(reflected(&full.film)).collect();
    let off = pairs.iter().map(|(a, b)| a - b).sum::<f64>();
    let sum = |film: &Film| variances(film).iter().sum::<f64>();
    // Channels of a pixel go together: three times the variance.
    let sigma = (3.0 * (sum(&fine.film) + sum(&full.film))).sqrt();
    assert!(off.abs() < 4.0 * sigma, "{off:e} of {sigma:e}");
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let scene = floor(0.2, lights());
    let error = |sampling| match CpuBackend.render(&scene, &settings(Technique::Reference(sampling))) {
        Err(error @ BackendError::Sampling { .. }) => error.to_string(),
        other => panic!("{:?}", other.map(|r| r.stats)),
    };
    assert!(error(Sampling { spp: 0, ..Sampling::default() }).starts_with("0 light samples"));
    for max_error in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(error(Sampling { max_error: Some(max_error), ..Sampling::default() }).contains("must be"));
    }
}

#[test]
fn progress_is_told_to_the_end() {
    let scene = floor(0.2, lights());
    let told = std::sync::Mutex::new(Vec::new());
    let settings = settings(Technique::Tree);
    let report = |done, total| told.lock().unwrap().push((done, total));
    glyphlight::backend::reference::render(&scene, &settings, &sampling(1, ReferenceLobe::Ggx), &report).unwrap();
    let told = told.into_inner().unwrap();
    assert_eq!(told.len(), 16);
    assert!(told.iter().all(|&(done, total)| total == 24 * 16 && done <= total));
    assert_eq!(told.iter().map(|t| t.0).max(), Some(24 * 16));
}

#[test]
fn the_variance_is_a_layer_of_the_exr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let film = sampled(&floor(0.2, lights()), sampling(32, ReferenceLobe::Ggx)).film;
    let read = |film: &Film, name: &str| -> Option<Vec<u32>> {
        film.write(&path, &Display::default()).unwrap();
        let image = crate::film::read_exr(&path);
        let channel = image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name))?;
        Some(channel.sample_data.values_as_f32().map(f32::to_bits).collect())
    };
    for (c, name) in ["variance.R", "variance.G", "variance.B"].into_iter().enumerate() {
        let want: Vec<u32> = film.variance.as_ref().unwrap().iter().map(|v| v[c].to_bits()).collect();
        assert_eq!(read(&film, name).unwrap(), want);
    }
    assert_eq!(read(&Film { variance: None, ..film.clone() }, "variance.R"), None);
    let mut short = film;
    short.variance.as_mut().unwrap().pop();
    assert!(short.write(&path, &Display::default()).is_err());
}
