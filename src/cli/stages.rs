//! Where the time of a rendering went.

use crate::backend::Stats;

/// Seconds of shading, and of all that came before it but compiling pipelines, which happens once in a program's life.
pub fn times(stats: &Stats) -> (f64, f64) {
    let before = |stages: &[(String, f64)]| stages.iter().filter(|s| s.0 != "pipelines").map(|s| s.1).sum();
    match stats.stages.iter().position(|(stage, _)| stage == "shading" || stage == "sampling") {
        Some(at) => (stats.stages[at].1, before(&stats.stages[..at])),
        None => (before(&stats.stages), 0.0),
    }
}
