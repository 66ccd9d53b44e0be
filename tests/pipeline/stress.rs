//! The stress harness: what it draws, what it finds, and that what it prints is what failed.

use glyphlight::backend::{BackendError, Horizons, Technique};
use glyphlight::stress::case::{Case, Line};
use glyphlight::stress::judge::{FLOOR, Fault, judge};
use glyphlight::stress::meter::{Cpu, Meter};
use glyphlight::stress::run::{Findings, block, run};
use glyphlight::stress::shrink::shrink;

const TREE: Cpu = Cpu { technique: Technique::Tree, horizons: Horizons::Both };

fn found(meter: &dyn Meter, seed: u64, count: u64) -> Findings {
    run(meter, seed, count, &|_, _| {}).unwrap()
}

/// The tree with an integrand that is wrong: too dark by 0.01 where a narrow lobe sees a bright light.
struct Broken;

impl Meter for Broken {
    fn read(&self, blocks: &[Vec<Case>]) -> Result<Vec<Vec<f64>>, BackendError> {
        let mut values = TREE.read(blocks)?;
        for (case, value) in blocks.iter().flatten().zip(values.iter_mut().flatten()) {
            if case.alpha.is_some_and(|alpha| alpha < 0.3) && *value > 0.1 {
                *value = (*value - 0.01).max(0.0);
            }
        }
        Ok(values)
    }

    fn horizons(&self) -> Horizons {
        Horizons::Both
    }
}

#[test]
fn the_same_seed_finds_the_same() {
    let cases = |seed| block(seed, 3, 64).into_iter().map(|(_, case)| case).collect::<Vec<_>>();
    assert_eq!(cases(5), cases(5));
    assert_ne!(cases(5), cases(6));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one.install(|| found(&TREE, 5, 5000));
    let together = found(&TREE, 5, 5000);
    assert_eq!(alone.kinds, together.kinds);
    assert_ne!(alone.kinds, found(&TREE, 6, 5000).kinds);
}

#[test]
fn a_wrong_integrand_is_caught_made_small_and_printed() {
    let sound = found(&TREE, 11, 3000);
    let broken = found(&Broken, 11, 3000);
    assert!(broken.all.faults() > sound.all.faults() + 100, "{} {}", broken.all.faults(), sound.all.faults());
    let fail = broken.fails.iter().find(|fail| fail.case.stage.shape.curves().count() > 8).unwrap();
    let (small, judged) = shrink(&Broken, &fail.case);
    assert_eq!(judged.fault, Some(Fault::Beyond));
    let length = |case: &Case| serde_json::to_string(&case.line(serde_json::Value::Null)).unwrap().len();
    assert!(small.stage.shape.curves().count() <= 4, "{small:?}");
    assert!(length(&small) * 3 < length(&fail.case), "{small:?}");
    // The line that is printed is the case to the bit.
    let line: Line = serde_json::from_str(&serde_json::to_string(&small.line("s".into())).unwrap()).unwrap();
    let again = Case::of_line(&line, 1.0).unwrap();
    let read = |case: &Case| Broken.read(&[vec![case.clone()]]).unwrap()[0][0];
    assert_eq!((again.tolerance, read(&again)), (small.tolerance, judged.value));
    assert!((read(&again) - judged.exact).abs() > f64::from(again.tolerance) + FLOOR);
}

#[test]
fn every_technique_is_read() {
    for name in ["tree", "exact", "kuge", "uniform:6", "quad:64", "textured", "pal", "representative"] {
        let technique: Technique = name.parse().unwrap();
        let horizons = glyphlight::stress::meter::horizons(&technique);
        let all = found(&Cpu { technique, horizons }, 2, 1000).all;
        assert_eq!(all.cases, 1000);
        println!("{name}: {all:?}");
        if name == "exact" {
            assert!(all.beyond == 0 && all.not_finite == 0, "{all:?}");
        }
        assert_eq!(
            all.rms() > 0.01,
            ["kuge", "uniform:6", "quad:64", "pal", "representative"].contains(&name),
            "{name}"
        );
    }
}

#[test]
fn the_tree_stands() {
    let Findings { all, kinds, fails } = found(&TREE, 1, 50_000);
    let shown: Vec<_> = fails.iter().take(3).map(|fail| (fail.index, fail.kinds, fail.judged)).collect();
    println!("{all:?} {shown:?}");
    assert_eq!((all.not_finite, all.negative, all.above_one, all.beyond), (0, 0, 0, 0), "{shown:?}");
    assert!(all.undecided * 10 < all.cases, "{all:?}");
    // 15 shapes (many curves are too rare for this count), 12 places, 5 lobes, 4 views.
    assert!(kinds.len() >= 35, "{}", kinds.len());
    let broken = found(&Broken, 1, 5_000).all;
    assert!(broken.faults() * 1000 > 10 * broken.cases, "{broken:?}");
}

/// The cases that were once beyond the tolerance on the CPU or on the GPU.
fn once_wrong() -> Vec<Case> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/stress.jsonl");
    let lines = std::fs::read_to_string(path).unwrap();
    lines.lines().map(|line| Case::of_line(&serde_json::from_str(line).unwrap(), 1e-3).unwrap()).collect()
}

/// Asserts that they hold, and that the judge would see some of them wrong by 0.01.
fn stays_fixed(meter: &dyn Meter) {
    let cases = once_wrong();
    let values = meter.read(std::slice::from_ref(&cases)).unwrap().remove(0);
    let mut moved_faults = 0;
    for (case, value) in cases.iter().zip(values) {
        let judged = judge(meter, case, value);
        assert_eq!(judged.fault, None, "{judged:?} {}", serde_json::to_string(&case.line("".into())).unwrap());
        moved_faults += usize::from(judge(meter, case, value + 0.01).fault.is_some());
    }
    assert!(cases.len() >= 19 && moved_faults * 2 > cases.len(), "{moved_faults} of {}", cases.len());
}

/// Contours of 1e-8 of their light, horizons 1e-5 apart along an edge, an edge through a footprint of 1e-13, a light's plane
/// through the point to the last digit.
#[test]
fn what_was_found_stays_fixed() {
    stays_fixed(&TREE);
}

/// The same, and edges cut a hair before their end, vectors whose squares underflow, horizons nearly parallel to the light's plane
/// or cutting it along one line, a view along the normal.
#[cfg(feature = "gpu")]
#[test]
fn what_was_found_stays_fixed_in_the_shaders() {
    let Some(backend) = crate::backends::gpu() else { return };
    stays_fixed(&shaders(backend));
}

#[cfg(feature = "gpu")]
fn shaders(backend: &glyphlight::backend::gpu::GpuBackend) -> glyphlight::stress::meter::Gpu<'_> {
    glyphlight::stress::meter::Gpu { backend, technique: Technique::Tree, horizons: Horizons::Both }
}

/// With twice the digits near a light and in needles.
#[cfg(feature = "gpu")]
#[test]
fn the_shaders_stand() {
    let Some(backend) = crate::backends::gpu() else { return };
    let Findings { all, fails, .. } = found(&shaders(backend), 1, 50_000);
    let shown: Vec<_> = fails.iter().take(3).map(|fail| (fail.index, fail.kinds, fail.judged)).collect();
    println!("{all:?} {shown:?}");
    assert_eq!((all.not_finite, all.negative, all.above_one, all.beyond), (0, 0, 0, 0), "{shown:?}");
    assert!(all.undecided * 10 < all.cases, "{all:?}");
}
