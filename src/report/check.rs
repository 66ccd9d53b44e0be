//! Whether a benchmark is worse than an earlier one: by its ratios, which are the same on a faster machine, and its errors.

use super::bench::{BenchRow, Benchmark, Ratio};
use crate::scene::trial::Trial;
use serde::Serialize;

/// A ratio is worse if it grew by more than so many of both spreads together.
pub const SPREADS: f64 = 3.0;
/// Least spread of a ratio, as a part of it: what it moves by from one run of the program to the next, which the rounds of
/// one run do not show.
pub const LEAST_SPREAD: f64 = 0.03;
/// An RMSE is worse if it grew to more than this times what it was,
pub const ERROR_GROWTH: f64 = 1.1;
/// … and by more than this as well, W·sr⁻¹·m⁻²: what single precision leaves.
pub const ERROR_FLOOR: f64 = 2e-6;

/// The rule, for people.
pub fn rule() -> String {
    format!(
        "A row is slower if its time over the rectangle light's (of rows of the rectangle light, that over uniform:30's as well: it \
         would not show there if all were slower) grew by more than {SPREADS} √(a² + b²), a and b being the spreads of the two runs (1.4826 times the median distance from the median, \
         over the rounds) and each at least {} % of its ratio. It is less right if its RMSE against `exact` grew by more than {:.0} % and by more than \
         {ERROR_FLOOR:e}. The times of rows with fewer than three runs are not judged.",
        100.0 * LEAST_SPREAD,
        100.0 * (ERROR_GROWTH - 1.0),
    )
}

/// What got worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Time over that of the rectangle.
    Rectangles,
    /// Time over that of `uniform:30`.
    Uniforms,
    /// RMSE against `exact`, W·sr⁻¹·m⁻².
    Rmse,
}

/// Something that got worse.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Light, floor, backend, technique with its knob.
    pub row: String,
    /// What got worse.
    pub measure: Measure,
    /// What it was.
    pub before: f64,
    /// What it is.
    pub now: f64,
    /// The most that would not have counted as worse.
    pub limit: f64,
}

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Checked {
    /// Rows that both runs have.
    pub rows: usize,
    /// Of those, the ones whose time was not judged: too few runs.
    pub untimed: usize,
    /// Rows of the baseline that the run does not have.
    pub missing: usize,
    /// What got worse.
    pub worse: Vec<Finding>,
}

/// Holds a run against a baseline. Rows that the baseline does not have are not judged.
pub fn check(baseline: &Benchmark, run: &Benchmark) -> Checked {
    let mut checked = Checked::default();
    for before in &baseline.rows {
        let Some(now) = run.rows.iter().find(|row| row.key() == before.key()) else {
            checked.missing += 1;
            continue;
        };
        checked.rows += 1;
        let row = name(now);
        // Elsewhere `uniform:30` takes a thousand times longer than what it is held against, and on a busy machine suffers otherwise.
        let comparable = before.shape == Trial::Rectangle.name();
        let ratios = [
            (Measure::Rectangles, before.rectangles, now.rectangles),
            (Measure::Uniforms, before.uniforms.filter(|_| comparable), now.uniforms),
        ];
        let mut timed = false;
        for (measure, before, now) in ratios {
            let Some((before, now)) = before.zip(now) else { continue };
            let Some(limit) = limit(before, now) else { continue };
            timed = true;
            if now.value > limit {
                let row = row.clone();
                checked.worse.push(Finding { row, measure, before: before.value, now: now.value, limit });
            }
        }
        checked.untimed += usize::from(!timed);
        let limit = (before.errors.rmse * ERROR_GROWTH).max(before.errors.rmse + ERROR_FLOOR);
        // An error that is no number is worse than any.
        if now.errors.rmse > limit || now.errors.rmse.is_nan() {
            let (before, now) = (before.errors.rmse, now.errors.rmse);
            checked.worse.push(Finding { row, measure: Measure::Rmse, before, now, limit });
        }
    }
    checked
}

/// The most that a ratio may be now; nothing where a spread is not known.
fn limit(before: Ratio, now: Ratio) -> Option<f64> {
    let deviation = |ratio: Ratio| Some(ratio.spread?.max(LEAST_SPREAD * ratio.value));
    Some(before.value + SPREADS * deviation(before)?.hypot(deviation(now)?))
}

/// What messages call a row.
pub fn name(row: &BenchRow) -> String {
    let floor = if row.finish == "diffuse" { "diffuse".into() } else { format!("alpha {}", row.finish) };
    format!("{}, {floor}, {}, {}", row.shape, row.backend, row.label())
}
