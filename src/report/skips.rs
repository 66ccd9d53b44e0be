//! What is left out where a scene doesn't need it: the same picture with and without each skip.
//!
//! # Schema
//! ```text
//! { "format": 1, "program", "date", "machine": as in [`bench`](super::bench), "side", "repeats",
//!   "rows": [ { "skip", "scene", "backend", "device", "clock", "counted", "count", "max_difference", "tolerance",
//!               "nanoseconds", "nanoseconds_off", "saved": { "value", "spread" (or null) } } ] }
//! ```

use super::bench::{BenchMachine, Ratio};
use serde::Serialize;

/// A and B of every skip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SkipReport {
    /// 1: the schema above.
    pub format: u32,
    /// Name and version of the program.
    pub program: String,
    /// When it began, UTC, ISO 8601.
    pub date: String,
    /// Where it ran.
    pub machine: BenchMachine,
    /// Pixels along a side of the pictures.
    pub side: u32,
    /// Timed runs of each.
    pub repeats: u32,
    /// One for each skip and backend.
    pub rows: Vec<SkipRow>,
}

/// A skip on one backend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SkipRow {
    /// Its name, [`crate::backend::skips::Skips::ALL`].
    pub skip: String,
    /// What is rendered.
    pub scene: String,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// Adapter, or number of threads.
    pub device: String,
    /// What its shading was timed by.
    pub clock: String,
    /// What the counter counts.
    pub counted: String,
    /// What it counted: nothing was skipped where it is 0.
    pub count: u64,
    /// Largest difference of the two pictures' reflected radiance, W·sr⁻¹·m⁻².
    pub max_difference: f64,
    /// What it may be: the tolerance of each picture, W·sr⁻¹·m⁻².
    pub tolerance: f64,
    /// Median time of a pixel of the picture, ns.
    pub nanoseconds: f64,
    /// That with the skip off.
    pub nanoseconds_off: f64,
    /// Time without the skip over time with it, in the same round: more than 1 where it pays.
    pub saved: Option<Ratio>,
}

impl SkipRow {
    /// Whether the skip left something out and the picture is the same within the tolerance.
    pub fn holds(&self) -> bool {
        self.count > 0 && self.max_difference <= self.tolerance
    }
}
