//! [`Benchmark`]: time against error of every technique, and the files it is written as.
//!
//! # Schema of `bench.json`
//! The fields of [`Benchmark`] under their own names, in a format that [`FORMAT`] numbers:
//!
//! ```text
//! { "format": 1, "program": "glyphlight 0.1.0", "date": "2026-01-31T12:00:00Z",
//!   "build": { "version", "profile", "revision" (or null) },
//!   "machine": { "processor", "simd", "threads", "system", "adapter", "clock" (null without GPU rows) },
//!   "settings": { "side", "windows", "repeats", "reference_spp" (null without a reference) },
//!   "rows": [ { "shape", "curves", "finish": "diffuse" or alpha, "backend", "technique", "knob" (null: it has none),
//!               "runs", "nanoseconds", "spread" (or null), "prepare_seconds", "parts",
//!               "rectangles", "uniforms": { "value", "spread" (or null) } or null,
//!               "errors": { "mae", "rmse", "rmse_of_peak" (or null), "max", "p999", "energy_ratio" (or null) },
//!               "total": as "errors", or null without a reference, "total_noise" (or null) } ],
//!   "left_out": [ { "technique", "reason" } ] }
//! ```
//!
//! `bench.csv` has the same rows, one line each, numbers in full, nothing where JSON has null (RFC 4180).

use super::statistics::{median, spread};
use super::{LeftOut, ReportError, table};
use crate::metrics::Figures;
use serde::{Deserialize, Serialize};

/// The number of the schema above; any change to it but an added field raises it.
pub const FORMAT: u32 = 1;

/// Time against error of techniques.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Benchmark {
    /// [`FORMAT`].
    pub format: u32,
    /// Name and version of the program.
    pub program: String,
    /// When it began, UTC, ISO 8601.
    pub date: String,
    /// What ran.
    pub build: Build,
    /// Where it ran.
    pub machine: BenchMachine,
    /// What all rows have in common.
    pub settings: BenchSettings,
    /// By shape, finish, backend and technique.
    pub rows: Vec<BenchRow>,
    /// What was asked for and could not be measured.
    pub left_out: Vec<LeftOut>,
}

/// The program that ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Build {
    /// Of the crate.
    pub version: String,
    /// `release`, or `debug` where assertions are compiled in.
    pub profile: String,
    /// What the environment variable `GLYPHLIGHT_REVISION` held when it was compiled.
    pub revision: Option<String>,
}

/// The computer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BenchMachine {
    /// Model of the processor.
    pub processor: String,
    /// The instructions that packets of pixels are shaded with, and the pixels in one: `AVX-512, 16 lanes`.
    pub simd: String,
    /// Threads that shade; yardsticks take all there are.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Adapter and driver of the GPU rows.
    pub adapter: Option<String>,
    /// What their shading was timed by: `timestamps`, or `wall clock` and why.
    #[serde(default)]
    pub clock: Option<String>,
}

/// What all rows have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BenchSettings {
    /// Pixels along the side of a window.
    pub side: u32,
    /// How many windows there are, [`crate::scene::trial::WINDOWS`].
    pub windows: usize,
    /// Timed runs of a row at most.
    pub repeats: u32,
    /// Light samples per pixel of the GGX reference.
    pub reference_spp: Option<u32>,
}

/// A technique at one value of its accuracy knob, on one backend, for one light and one floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BenchRow {
    /// The light, [`crate::scene::trial::Trial`].
    pub shape: String,
    /// Its curves.
    pub curves: usize,
    /// The floor, [`crate::scene::trial::Finish`]: `diffuse`, or GGX alpha.
    pub finish: String,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// Without its knob.
    pub technique: String,
    /// Tolerance, eps, edges per curve, mask resolution, samples: as the command line takes it.
    pub knob: Option<String>,
    /// Runs that the medians are of. One that is slow is run once.
    pub runs: usize,
    /// Median time of shading a pixel, ns: camera ray, surface, integral.
    pub nanoseconds: f64,
    /// [`spread`] of that; nothing of fewer than three runs.
    pub spread: Option<f64>,
    /// Median time of all that comes before, for one window: trees, masks, buffers.
    pub prepare_seconds: f64,
    /// Mean number of nodes, edges or samples of a pixel.
    pub parts: f64,
    /// Its time over that of the tree on the rectangle, same floor and backend.
    pub rectangles: Option<Ratio>,
    /// Its time over that of `uniform:30` on the same light, floor and backend.
    pub uniforms: Option<Ratio>,
    /// Error of the reflected radiance against `exact`, clipped at the same horizon: that of the integral.
    pub errors: Figures,
    /// Error against Monte Carlo with GGX: that of integral, fit and horizon together.
    pub total: Option<Figures>,
    /// Standard error of that Monte Carlo, root mean square, W·sr⁻¹·m⁻².
    pub total_noise: Option<f64>,
}

/// One time over another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// Median over the rounds of the ratio in each round, so that what slows the machine for a while slows both.
    pub value: f64,
    /// [`spread`] over the rounds; nothing of fewer than three.
    pub spread: Option<f64>,
}

impl Ratio {
    /// Of times by round. Where there are fewer of `times`, as of a slow row, it is the median of those over that of `unit`.
    /// Nothing where either is empty or the unit took no time.
    pub fn of(times: &[f64], unit: &[f64]) -> Option<Self> {
        if times.is_empty() || unit.is_empty() || unit.iter().any(|t| *t <= 0.0) {
            return None;
        }
        if times.len() != unit.len() {
            return Some(Self { value: median(times) / median(unit), spread: None });
        }
        let ratios: Vec<f64> = times.iter().zip(unit).map(|(time, unit)| time / unit).collect();
        Some(Self { value: median(&ratios), spread: spread(&ratios) })
    }
}

impl BenchRow {
    /// The technique with its knob, as `bench --technique` takes it.
    pub fn label(&self) -> String {
        match &self.knob {
            Some(knob) => format!("{}:{knob}", self.technique),
            None => self.technique.clone(),
        }
    }

    /// What tells it from other rows.
    pub fn key(&self) -> [&str; 5] {
        [&self.shape, &self.finish, &self.backend, &self.technique, self.knob.as_deref().unwrap_or_default()]
    }
}

/// Names of the columns of `bench.csv`.
const COLUMNS: [&str; 30] = [
    "shape",
    "curves",
    "finish",
    "backend",
    "technique",
    "knob",
    "runs",
    "nanoseconds",
    "spread",
    "prepare_seconds",
    "parts",
    "rectangles",
    "rectangles_spread",
    "uniforms",
    "uniforms_spread",
    "mae",
    "rmse",
    "rmse_of_peak",
    "p999",
    "max",
    "energy_ratio",
    "total_mae",
    "total_rmse",
    "total_rmse_of_peak",
    "total_p999",
    "total_max",
    "total_energy_ratio",
    "total_noise",
    "processor",
    "adapter",
];

impl Benchmark {
    /// Reads `bench.json`.
    ///
    /// # Errors
    /// What the decoder says, or that it is of another format.
    pub fn parse(json: &[u8]) -> Result<Self, ReportError> {
        let bench: Self = serde_json::from_slice(json).map_err(ReportError::NoBenchmark)?;
        if bench.format == FORMAT { Ok(bench) } else { Err(ReportError::Format { found: bench.format, known: FORMAT }) }
    }

    /// `bench.json`; see the [schema](self).
    ///
    /// # Errors
    /// What the encoder says.
    pub fn json(&self) -> Result<String, ReportError> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(text)
    }

    /// `bench.csv`; see the [schema](self).
    pub fn csv(&self) -> String {
        let mut out = COLUMNS.join(",");
        out.push_str("\r\n");
        for row in &self.rows {
            let fields = self.fields(row).map(|field| table::field(&field));
            out.push_str(&fields.join(","));
            out.push_str("\r\n");
        }
        out
    }

    /// What a row holds, in the order of [`COLUMNS`].
    fn fields(&self, row: &BenchRow) -> [String; COLUMNS.len()] {
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:e}"));
        let word = |value: &Option<String>| value.clone().unwrap_or_default();
        let figures = |f: Option<Figures>| {
            [
                number(f.map(|f| f.mae)),
                number(f.map(|f| f.rmse)),
                number(f.and_then(|f| f.rmse_of_peak)),
                number(f.map(|f| f.p999)),
                number(f.map(|f| f.max)),
                number(f.and_then(|f| f.energy_ratio)),
            ]
        };
        let [mae, rmse, of_peak, p999, max, energy] = figures(Some(row.errors));
        let [total_mae, total_rmse, total_of_peak, total_p999, total_max, total_energy] = figures(row.total);
        [
            row.shape.clone(),
            row.curves.to_string(),
            row.finish.clone(),
            row.backend.clone(),
            row.technique.clone(),
            word(&row.knob),
            row.runs.to_string(),
            number(Some(row.nanoseconds)),
            number(row.spread),
            number(Some(row.prepare_seconds)),
            number(Some(row.parts)),
            number(row.rectangles.map(|r| r.value)),
            number(row.rectangles.and_then(|r| r.spread)),
            number(row.uniforms.map(|r| r.value)),
            number(row.uniforms.and_then(|r| r.spread)),
            mae,
            rmse,
            of_peak,
            p999,
            max,
            energy,
            total_mae,
            total_rmse,
            total_of_peak,
            total_p999,
            total_max,
            total_energy,
            number(row.total_noise),
            self.machine.processor.clone(),
            word(&self.machine.adapter),
        ]
    }

    /// Program, processor, adapter, threads and date, on one line.
    pub fn header(&self) -> String {
        let Self { build, machine, settings, .. } = self;
        let revision = build.revision.as_ref().map_or_else(String::new, |r| format!(" ({r})"));
        let adapter = machine.adapter.as_ref().map_or_else(String::new, |a| format!("; GPU: {a}"));
        let clock = machine.clock.as_ref().map_or_else(String::new, |c| format!(", timed by {c}"));
        let threads = if machine.threads == 1 { "1 thread".into() } else { format!("{} threads", machine.threads) };
        format!(
            "{}{revision}, {} build, {}; {}, {}, {threads}, {}{adapter}{clock}; {} windows of {side} × {side} pixels, median of {} runs",
            self.program,
            build.profile,
            self.date,
            machine.processor,
            machine.simd,
            machine.system,
            settings.windows,
            settings.repeats,
            side = settings.side,
        )
    }
}
