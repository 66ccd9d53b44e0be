//! What a pixel costs under 1, 10, 100 and 1000 lights: the shading stage of a floor of 512 × 512 pixels, tolerance 1e-3, one thread.
//!
//! Signs of five words stand about on the floor ([`glyphlight::scene::signs`]), which grows with their number, or they shrink on the
//! same floor. Runs of all counts take turns; ratios are of times in the same turn, less what the thread waited for a processor.
//! Run: `cargo bench --bench lights`; arguments: floors (`0.05`, `0.25`, `diffuse`, `both`), `density` or `area`, `plain` (as well
//! without clusters), `gpu` (on any Vulkan driver), `error` (as well the worst and the rms error of what the floor reflects, against each light by itself at a
//! tolerance of 1e-6), counts, `side=512`, `rounds=5`.

#![allow(clippy::print_stdout, reason = "the table is what it is for")]

mod gpu;

use glam::Vec3;
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Settings, Skips};
use glyphlight::film::Film;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::scene::signs::{SignsOptions, signs};
use glyphlight::scene::{Material, Scene};
use glyphlight::shape::Shape;
use gpu::gpu;

/// Seconds that this thread has waited for a processor since it began; nothing where the system does not tell.
fn waited() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_ascii_whitespace().nth(1).and_then(|ns| ns.parse::<f64>().ok()).map_or(0.0, |ns| ns * 1e-9)
}

/// Worst and rms error of what the floor reflects, radiance.
fn errors(scene: &Scene, settings: &Settings) -> (f32, f32) {
    let skips = Skips { clusters: false, ..Skips::default() };
    let film = |settings| CpuBackend.render(scene, &settings).expect("a picture").film;
    let (ours, truth) = (film(*settings), film(Settings { tolerance: 1e-6, skips, ..*settings }));
    let value = |film: &Film, i: usize| Vec3::from(film.diffuse[i]) + Vec3::from(film.specular[i]);
    let off = |i: usize| (value(&ours, i) - value(&truth, i)).abs().max_element();
    let all: Vec<f32> = (0..ours.diffuse.len()).map(off).collect();
    let square: f32 = all.iter().map(|e| e * e).sum();
    (all.iter().copied().fold(0.0, f32::max), (square / all.len() as f32).sqrt())
}

/// Seconds of the shading stage.
fn shading(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> (f64, String) {
    let before = waited();
    let stats = backend.render(scene, settings).expect("a picture").stats;
    let waited = waited() - before;
    let all: f64 = stats.stages.iter().map(|(_, seconds)| seconds).sum();
    let stage = stats.stages.iter().find(|(name, _)| name == "shading").expect("a shading stage").1;
    let per = |n: u64| n as f64 / stats.shaded as f64;
    let handed: u64 = stats.lights.iter().map(|l| l.candidates - l.skipped()).sum();
    let what = format!(
        "per point: integrals {:.2} nodes {:.1} handed {:.2}; by tile {:.2} ({:.2} local), by point {:.2}, whole {:.2}",
        per(stats.integrals),
        per(stats.nodes),
        per(handed),
        per(stats.clusters.by_tile),
        per(stats.clusters.local),
        per(stats.clusters.by_point),
        per(stats.clusters.whole)
    );
    (stage - waited * stage / all, what)
}

fn scene(words: &[Shape], floor: &str, same_area: bool, count: u32) -> Scene {
    let material = match floor {
        "diffuse" => Material { specular: 0.0, ..Material::default() },
        "both" => Material::default(),
        alpha => Material { metallic: 1.0, alpha: alpha.parse().expect("an alpha"), ..Material::default() },
    };
    let mut options = SignsOptions { count, material, ..SignsOptions::default() };
    if same_area {
        let width = (10.0 / f64::from(count)).sqrt();
        options = SignsOptions { width, heights: options.heights.map(|h| h / width), ..options };
    }
    signs(words, &options)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn measure() {
    let words = ["OPEN", "BAR", "HOTEL", "24h", "CAFE"].map(|word| {
        let font = Font::bundled("DejaVu Sans").expect("bundled");
        layout(word, &[font], &TextStyle::default()).expect("Latin text").shape
    });
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let is = |name: &str| arguments.iter().any(|a| a == name);
    let value = |key: &str, default: usize| {
        let found = arguments.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
        found.map_or(default, |v| v.parse().expect("a number"))
    };
    let (side, rounds) = (value("side", 512) as u32, value("rounds", 5));
    let backend = if is("gpu") { gpu().expect("a Vulkan driver") } else { Box::new(CpuBackend) };
    let mut floors: Vec<&str> = ["0.05", "0.25", "diffuse", "both"].into_iter().filter(|f| is(f)).collect();
    if floors.is_empty() {
        floors = vec!["0.05", "0.25", "diffuse", "both"];
    }
    let mut counts: Vec<u32> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    if counts.is_empty() {
        counts = vec![1, 10, 100, 1000];
    }
    for floor in floors {
        for (area, same_area) in [("density", false), ("area", true)] {
            if (is("density") || is("area")) && !is(area) {
                continue;
            }
            let mut cases = Vec::new();
            for &count in &counts {
                cases.push((count, Skips::default()));
                if is("plain") {
                    cases.push((count, Skips { clusters: false, ..Skips::default() }));
                }
            }
            let scenes: Vec<Scene> = counts.iter().map(|&count| scene(&words, floor, same_area, count)).collect();
            let mut times = vec![Vec::new(); cases.len()];
            let mut stats = vec![String::new(); cases.len()];
            for _ in 0..rounds {
                for (i, (count, skips)) in cases.iter().enumerate() {
                    let at = counts.iter().position(|c| c == count).expect("a count");
                    let settings =
                        Settings { width: side, height: side, tolerance: 1e-3, skips: *skips, ..Settings::default() };
                    let (time, what) = shading(backend.as_ref(), &scenes[at], &settings);
                    times[i].push(time);
                    stats[i] = what;
                }
            }
            let base = cases.iter().position(|(count, _)| *count == 10).unwrap_or(0);
            println!("floor {floor}, constant {area}");
            for (i, (count, skips)) in cases.iter().enumerate() {
                let ratios = times[i].iter().zip(&times[base]).map(|(a, b)| a / b).collect();
                let pixel = 1e9 * median(times[i].clone()) / f64::from(side * side);
                let name = if skips.clusters { "" } else { " one by one" };
                println!(
                    "  {count:5}{name}: {:6.2} × that of 10, {pixel:7.0} ns a pixel; {}",
                    median(ratios),
                    stats[i]
                );
                if is("error") {
                    let at = counts.iter().position(|c| c == count).expect("a count");
                    let settings =
                        Settings { width: side, height: side, tolerance: 1e-3, skips: *skips, ..Settings::default() };
                    let (worst, rms) = errors(&scenes[at], &settings);
                    println!("         error: worst {worst:.1e}, rms {rms:.1e}");
                }
            }
        }
    }
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(measure);
}
