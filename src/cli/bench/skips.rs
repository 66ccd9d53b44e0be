//! `bench --skips`: each thing that is left out where a scene doesn't need it, switched on and off in turns.

use super::measure::Bencher;
use super::plan::On;
use crate::backend::skips::{SkipName, Skips};
use crate::backend::{LightStats, Rendering, Settings, Stats};
use crate::cli::stages::times;
use crate::error::Error;
use crate::light::{AreaLight, Placement};
use crate::metrics::figures;
use crate::report::bench::Ratio;
use crate::report::skips::SkipRow;
use crate::report::statistics::median;
use crate::scene::Scene;
use crate::scene::motion::{Interpolation, LightMotion, Motion, Track};
use crate::scene::surface::plane;
use crate::scene::trial::{Finish, Trial, scene};
use glam::{DQuat, DVec2, DVec3};

/// Tolerance of the pictures, W·sr⁻¹·m⁻².
const TOLERANCE: f32 = 1e-3;

/// A skip and a picture that doesn't need what is skipped.
struct Case {
    skip: &'static str,
    about: &'static str,
    trial: Trial,
    finish: Finish,
    /// What the counter counts.
    counted: &'static str,
    count: fn(&Stats) -> u64,
    /// Adds to the scene.
    change: fn(&mut Scene),
    /// What is off in both pictures: it would leave out the same.
    off: &'static [&'static str],
}

const CASES: [Case; 8] = [
    Case {
        skip: "lobes",
        about: "a line of text over a metal floor, which has no diffuse light",
        trial: Trial::Line,
        finish: Finish::Gloss(0.25),
        counted: "integrals without such a lobe",
        count: |stats| lights(stats, |l| l.no_lobe),
        change: |_| (),
        off: &[],
    },
    Case {
        skip: "lobes",
        about: "a line of text over a diffuse floor, which has no gloss",
        trial: Trial::Line,
        finish: Finish::Diffuse,
        counted: "integrals without such a lobe",
        count: |stats| lights(stats, |l| l.no_lobe),
        change: |_| (),
        off: &[],
    },
    Case {
        skip: "textures",
        about: "a rectangle over a floor without textures",
        trial: Trial::Rectangle,
        finish: Finish::Diffuse,
        counted: "samples without texture look-ups",
        count: |stats| shaded_without(stats, "textures"),
        change: |_| (),
        off: &[],
    },
    Case {
        skip: "horizons",
        about: "a line of text above a diffuse floor",
        trial: Trial::Line,
        finish: Finish::Diffuse,
        counted: "samples without clipping",
        count: |stats| shaded_without(stats, "horizons"),
        change: |_| (),
        off: &[],
    },
    Case {
        skip: "behind",
        about: "48 signs in rows",
        trial: Trial::Glyph,
        finish: Finish::Gloss(0.25),
        counted: "integrals of tiles behind a light",
        count: |stats| lights(stats, |l| l.behind_tile),
        change: signs,
        off: &["clusters"],
    },
    Case {
        skip: "below-horizon",
        about: "a shelf above 48 signs",
        trial: Trial::Glyph,
        finish: Finish::Gloss(0.25),
        counted: "integrals of tiles that a light is below",
        count: |stats| lights(stats, |l| l.below_tile),
        change: |scene| {
            signs(scene);
            scene.triangles.extend(plane(DVec3::new(0.0, 1.0, 0.0), DVec3::Y, [6.0, 6.0], 1.0, 0));
        },
        off: &["clusters"],
    },
    Case {
        skip: "under-tolerance",
        about: "48 signs, each too dim far away",
        trial: Trial::Glyph,
        finish: Finish::Diffuse,
        counted: "integrals of tiles with less light than the tolerance",
        count: |stats| lights(stats, |l| l.under_tolerance),
        change: |scene| {
            signs(scene);
            scene.lights.iter_mut().flat_map(|l| &mut l.layers).for_each(|layer| layer.radiance *= 0.2);
        },
        off: &["clusters"],
    },
    Case {
        skip: "clusters",
        about: "48 signs, most of them far from any place of the floor",
        trial: Trial::Glyph,
        finish: Finish::Gloss(0.25),
        counted: "integrals that a cluster stood for",
        count: |stats| lights(stats, |l| l.clustered),
        change: signs,
        off: &[],
    },
];

/// Eight by six small copies of the light instead of it, a metre apart and more.
fn signs(scene: &mut Scene) {
    let light = scene.lights.remove(0);
    for i in 0..48 {
        let (x, z) = (f64::from(i % 8) * 1.2 - 4.2, f64::from(i / 8) * 1.5 - 6.0);
        let placement = Placement::new(DVec3::new(x, 0.05, z), DVec3::ZERO, DVec2::splat(0.3));
        scene.lights.push(AreaLight { name: format!("sign {i}"), placement, ..light.clone() });
    }
}

fn lights(stats: &Stats, count: fn(&LightStats) -> u64) -> u64 {
    stats.lights.iter().map(count).sum()
}

/// All samples, if none of them paid for `what`.
fn shaded_without(stats: &Stats, what: &str) -> u64 {
    if stats.left_out.iter().any(|left| left == what) { stats.shaded } else { 0 }
}

/// Every skip on the backends, `side` × `side` pixels.
///
/// # Errors
/// What the backends say.
pub fn measure(bencher: &Bencher, backends: &[On], side: u32, repeats: u32) -> Result<Vec<SkipRow>, Error> {
    let mut rows = Vec::new();
    for case in &CASES {
        let mut scene = scene(case.trial.layers()?, case.finish);
        (case.change)(&mut scene);
        let names = case.off.iter().copied().chain([case.skip]).map(str::parse);
        let names = names.collect::<Result<Vec<SkipName>, _>>().map_err(Error::Usage)?;
        let skips = Skips::without(&names[..case.off.len()]);
        let on = Settings { width: side, height: side, samples: 1, tolerance: TOLERANCE, skips, ..Settings::default() };
        let off = Settings { skips: Skips::without(&names), ..on };
        for &backend in backends {
            bencher.say(format_args!("skip {}, {backend}", case.skip));
            let render = |settings| bencher.render(backend, &scene, settings);
            let pixels = f64::from(side) * f64::from(side);
            let time = |(rendering, ran): &(Rendering, f64)| times(&rendering.stats).0 * ran * 1e9 / pixels;
            // The first pair warms up.
            let (with, without) = (render(&on)?.0, render(&off)?.0);
            let [mut fast, mut slow] = [Vec::new(), Vec::new()];
            for _ in 0..repeats {
                fast.push(time(&render(&on)?));
                slow.push(time(&render(&off)?));
            }
            let [a, b] = [&with, &without].map(|r| r.film.reflected().collect::<Vec<_>>());
            rows.push(SkipRow {
                skip: case.skip.into(),
                scene: case.about.into(),
                backend: backend.to_string(),
                device: with.stats.device.clone(),
                clock: with.stats.clock.clone(),
                counted: case.counted.into(),
                count: (case.count)(&with.stats),
                max_difference: figures(&a, &b)?.max,
                tolerance: f64::from(TOLERANCE),
                nanoseconds: median(&fast),
                nanoseconds_off: median(&slow),
                saved: Ratio::of(&slow, &fast),
            });
        }
    }
    for &backend in backends {
        bencher.say(format_args!("skip reuse, {backend}"));
        rows.push(sequence(bencher, backend, side, repeats)?);
    }
    bencher.say("");
    Ok(rows)
}

/// Times of the pictures of a sequence, seconds.
const TIMES: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];

/// What a sequence keeps: a drawing of 540 paths over a metal floor, beside a rectangle that flickers.
fn sequence(bencher: &Bencher, on: On, side: u32, repeats: u32) -> Result<SkipRow, Error> {
    let mut scene = scene(Trial::Drawing.layers()?, Finish::Gloss(0.25));
    let placement = Placement::new(DVec3::new(2.0, 0.0, 0.0), DVec3::ZERO, DVec2::ONE);
    let flickering = AreaLight { layers: Trial::Rectangle.layers()?, placement, ..scene.lights[0].clone() };
    let emission = Track::new(vec![(0.0, DVec3::ONE), (1.0, DVec3::splat(0.25))]);
    let motion = LightMotion {
        light: 1,
        interpolation: Interpolation::Linear,
        position: Track::still(placement.origin),
        rotation: Track::still(DQuat::IDENTITY),
        scale: Track::still(DVec2::ONE),
        emission: emission.unwrap_or_else(|| Track::still(DVec3::ONE)),
        radiances: flickering.layers.iter().map(|layer| layer.radiance).collect(),
    };
    scene.lights.push(flickering);
    let motion = Motion { lights: vec![motion], camera: None, span: [0.0, 1.0] };
    let kept = Settings { width: side, height: side, samples: 1, tolerance: TOLERANCE, ..Settings::default() };
    let anew = Settings { skips: Skips::without(&["reuse".parse().map_err(Error::Usage)?]), ..kept };
    let run = |settings: &Settings| bencher.sequence(on, (&scene, &motion), settings, &TIMES);
    let pixels = f64::from(side) * f64::from(side) * TIMES.len() as f64;
    // The first pair warms up.
    let (with, without) = (run(&kept)?.0, run(&anew)?.0);
    let [mut fast, mut slow] = [Vec::new(), Vec::new()];
    for _ in 0..repeats {
        fast.push(run(&kept)?.1 * 1e9 / pixels);
        slow.push(run(&anew)?.1 * 1e9 / pixels);
    }
    let mut max_difference: f64 = 0.0;
    for (a, b) in with.iter().zip(&without) {
        let [a, b] = [a, b].map(|r| r.film.reflected().collect::<Vec<_>>());
        max_difference = max_difference.max(figures(&a, &b)?.max);
    }
    Ok(SkipRow {
        skip: "reuse".into(),
        scene: "six frames of a drawing beside a light that flickers; times are of all stages".into(),
        backend: on.to_string(),
        device: with[0].stats.device.clone(),
        clock: "wall clock".into(),
        counted: "parts taken over from the frame before".into(),
        count: with.iter().flat_map(|r| &r.stats.reused).map(|part| part.reused).sum(),
        max_difference,
        tolerance: f64::from(TOLERANCE),
        nanoseconds: median(&fast),
        nanoseconds_off: median(&slow),
        saved: Ratio::of(&slow, &fast),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_skip_of_a_picture_has_a_case() {
        let mut cases: Vec<_> = CASES.iter().map(|c| c.skip).collect();
        cases.dedup();
        // What a sequence reuses shows in no single picture: it has a row of its own.
        let skips: Vec<_> = Skips::ALL.iter().map(|(name, _)| *name).filter(|name| *name != "reuse").collect();
        assert_eq!(cases, skips);
    }
}
