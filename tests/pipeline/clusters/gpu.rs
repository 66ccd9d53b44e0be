//! Clusters on the GPU.

use super::{FEWEST, mixed};
use crate::backends::{agree, difference, gpu, render, same_stats, settings, white_level};
use glyphlight::backend::Settings;
use glyphlight::backend::cpu::CpuBackend;

#[test]
fn the_gpu_shares_out_the_same() {
    let Some(gpu) = gpu() else { return };
    for (count, alpha, samples) in [(FEWEST, 0.3, 1), (FEWEST + 60, 0.05, 2)] {
        let mut scene = mixed(count);
        scene.materials[0].alpha = alpha;
        let settings = Settings { width: 37, height: 29, tolerance: 1e-3, ..settings(samples) };
        let (a, b) = (render(&CpuBackend, &scene, &settings), render(gpu, &scene, &settings));
        let difference = difference(&a.film, &b.film, white_level(&scene));
        println!("{count} lights, alpha {alpha}: {difference:?}, {:?}, {:?}", a.stats.clusters, b.stats.clusters);
        assert!(agree(difference) && same_stats(&a.stats, &b.stats), "{:?}\n{:?}", a.stats, b.stats);
        let near = |x: u64, y: u64| x.abs_diff(y) as f64 <= 0.01 * x.max(y) as f64;
        let (x, y) = (a.stats.clusters, b.stats.clusters);
        assert!(near(x.by_tile, y.by_tile) && near(x.by_point, y.by_point) && near(x.whole, y.whole));
        assert!(x.whole > 0);
    }
}
