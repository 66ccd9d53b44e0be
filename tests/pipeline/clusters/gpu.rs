//! Clusters on the GPU, whose workgroups spend the tolerance in another order: what they answer differs by far less than it.

use super::{FEWEST, mixed, worst};
use crate::backends::{gpu, render, settings};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::gpu::GpuBackend;
use glyphlight::backend::{LightStats, Settings, Stats};
use glyphlight::kernel::cluster::CLUSTER_PART;
use glyphlight::kernel::cluster_list::MOST_LISTED;

const TOLERANCE: f32 = 1e-3;

/// Renders signs on both, those of the GPU brighter by a factor; gives what they cost, and the largest difference of what surfaces
/// reflect over the tolerance.
fn compared(gpu: &GpuBackend, count: usize, alpha: f32, samples: u32, factor: f64) -> ([Stats; 2], f32) {
    let mut scene = mixed(count);
    scene.materials[0].alpha = alpha;
    let settings = Settings { width: 37, height: 29, tolerance: TOLERANCE, ..settings(samples) };
    let a = render(&CpuBackend, &scene, &settings);
    scene.lights.iter_mut().for_each(|light| light.layers[0].radiance *= factor);
    let b = render(gpu, &scene, &settings);
    let worst = worst(&a, &b) / TOLERANCE;
    ([a.stats, b.stats], worst)
}

#[test]
fn the_gpu_shares_out_nearly_the_same() {
    let Some(gpu) = gpu() else { return };
    for (count, alpha, samples) in [(FEWEST, 0.3, 1), (FEWEST + 60, 0.05, 2)] {
        let ([a, b], worst) = compared(gpu, count, alpha, samples, 1.0);
        println!("{count} lights, alpha {alpha}: off by {worst:.3} tolerances, {:?}, {:?}", a.clusters, b.clusters);
        // Less than the clusters' part of it.
        assert!(worst < 0.5 * CLUSTER_PART, "{worst}");
        let near = |x: u64, y: u64| x.abs_diff(y) as f64 <= 0.02 * x.max(y) as f64;
        let (x, y) = (a.clusters, b.clusters);
        // A workgroup begins with as many clusters as it has invocations.
        assert!(near(x.by_point, y.by_point) && near(x.whole, y.whole) && y.by_tile > 0, "{x:?} {y:?}");
        assert!(near(a.integrals, b.integrals) && a.shaded == b.shaded && x.whole > 0);
        let candidates = |s: &Stats| s.lights.iter().map(|l| l.candidates).sum::<u64>();
        let skipped: u64 = b.lights.iter().map(LightStats::skipped).sum();
        assert_eq!((candidates(&a), candidates(&b) - skipped), (candidates(&b), b.integrals));
        let clustered = |s: &Stats| s.lights.iter().map(|l| l.clustered).sum::<u64>();
        assert!(near(clustered(&a), clustered(&b)));
    }
}

#[test]
fn lights_a_hundredth_brighter_are_noticed_on_the_gpu() {
    let Some(gpu) = gpu() else { return };
    let (_, worst) = compared(gpu, FEWEST, 0.3, 1, 1.01);
    println!("off by {worst:.3} tolerances");
    assert!(worst > 1.0, "{worst}");
}

/// Lists that are longer than a workgroup has room for are gone through piece by piece.
#[test]
fn long_lists_are_shared_out_on_the_gpu() {
    let Some(gpu) = gpu() else { return };
    let mut scene = mixed(600);
    // Pictures of so many would fill a buffer.
    scene.lights.iter_mut().for_each(|light| light.layers[0].picture = None);
    let settings = Settings { width: 19, height: 13, tolerance: 2e-5, ..settings(1) };
    let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
    let worst = worst(&a, &b) / settings.tolerance;
    let per_point = |n: u64| n / b.stats.shaded;
    let [open, whole] = [b.stats.clusters.by_point, b.stats.clusters.whole].map(per_point);
    let integrals = [&a, &b].map(|r| r.stats.integrals as f64 / r.stats.shaded as f64);
    println!(
        "off by {worst:.3} tolerances; a point has {open} lights to decide about, {whole} expansions, {integrals:?} integrals"
    );
    assert!(worst < 0.5, "{worst}");
    assert!(open + whole > 2 * MOST_LISTED as u64, "{open} and {whole}");
    assert!((integrals[0] / integrals[1] - 1.0).abs() < 0.2, "{integrals:?}");
}

/// So many lights are handed on, and so many nodes visited, that a driver which ends loops early does so between two barriers.
#[test]
fn a_tile_whose_loops_are_ended_early_is_lit_all_the_same() {
    let Some(gpu) = gpu() else { return };
    let mut scene = mixed(FEWEST + 30);
    // Pictures are not divided.
    scene.lights.iter_mut().for_each(|light| light.layers[0].picture = None);
    let settings = Settings { width: 11, height: 9, tolerance: 1e-12, ..settings(1) };
    let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
    let worst = worst(&a, &b);
    println!("off by {worst:e}, {} nodes at a point, {} windows", b.stats.nodes / b.stats.shaded, b.stats.windows);
    assert!(worst < 1e-5 && b.stats.nodes > 10_000 * b.stats.shaded, "{worst}");
    assert!(b.stats.windows > 1 || !gpu.device().contains("llvmpipe"));
}
