//! Draws cases, reads them, judges them and counts.

use super::case::Case;
use super::draw::Draw;
use super::judge::{Fault, Judged, judge};
use super::meter::Meter;
use super::places::{self, Kinds, stage};
use crate::backend::BackendError;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Cases of a block: the unit of work. Their numbers are consecutive.
pub const BLOCK: u64 = 64;
/// Curves that the points of one light may have integrated in all: a light of many curves gets one point, a small one ten.
const WORK: usize = 1 << 9;
/// Most points of one light.
const POINTS: usize = 10;
/// Most faults that are kept.
pub const KEPT: usize = 1000;

/// What has been found in one kind of cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tally {
    /// Cases.
    pub cases: u64,
    /// NaN or infinite.
    pub not_finite: u64,
    /// Below 0.
    pub negative: u64,
    /// Above 1.
    pub above_one: u64,
    /// Off by more than the tolerance and the floor of rounding.
    pub beyond: u64,
    /// Off by more than 0.01.
    pub coarse: u64,
    /// Where the yardstick jumps between inputs that differ by their rounding, and the value lies in the jump.
    pub undecided: u64,
    /// Largest error, of values that are numbers.
    pub worst: f64,
    /// Largest excess of an error over its tolerance: the floor of rounding, measured.
    pub floor: f64,
    /// Sum of squared errors of values that are numbers.
    pub squares: f64,
}

impl Tally {
    fn count(&mut self, judged: &Judged, tolerance: f64) {
        self.cases += 1;
        self.undecided += u64::from(judged.undecided);
        match judged.fault {
            Some(Fault::NotFinite) => self.not_finite += 1,
            Some(Fault::Negative) => self.negative += 1,
            Some(Fault::AboveOne) => self.above_one += 1,
            Some(Fault::Beyond) => self.beyond += 1,
            None => {}
        }
        let error = judged.error();
        if error.is_finite() {
            self.coarse += u64::from(error > 0.01);
            self.worst = self.worst.max(error);
            self.floor = self.floor.max(error - tolerance);
            self.squares += error * error;
        }
    }

    /// Adds another's cases.
    pub fn add(&mut self, other: &Self) {
        self.cases += other.cases;
        self.not_finite += other.not_finite;
        self.negative += other.negative;
        self.above_one += other.above_one;
        self.beyond += other.beyond;
        self.coarse += other.coarse;
        self.undecided += other.undecided;
        self.worst = self.worst.max(other.worst);
        self.floor = self.floor.max(other.floor);
        self.squares += other.squares;
    }

    /// Root mean square error of values that are numbers.
    pub fn rms(&self) -> f64 {
        (self.squares / self.cases.saturating_sub(self.not_finite).max(1) as f64).sqrt()
    }

    /// Cases with anything wrong.
    pub const fn faults(&self) -> u64 {
        self.not_finite + self.negative + self.above_one + self.beyond
    }
}

/// A case with something wrong.
#[derive(Clone, Debug)]
pub struct Fail {
    /// Its number.
    pub index: u64,
    /// What it is out for.
    pub kinds: Kinds,
    /// The case.
    pub case: Case,
    /// What is wrong.
    pub judged: Judged,
}

/// What a run has found.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// All cases.
    pub all: Tally,
    /// By what the cases are out for: a pair such as (`place`, `on an edge`).
    pub kinds: BTreeMap<(&'static str, &'static str), Tally>,
    /// The first faults, [`KEPT`] at most.
    pub fails: Vec<Fail>,
}

impl Findings {
    fn count(&mut self, index: u64, kinds: Kinds, case: &Case, judged: Judged) {
        let tolerance = f64::from(case.tolerance);
        self.all.count(&judged, tolerance);
        for kind in kinds.names() {
            self.kinds.entry(kind).or_default().count(&judged, tolerance);
        }
        if judged.fault.is_some() {
            self.fails.push(Fail { index, kinds, case: case.clone(), judged });
        }
    }

    fn add(&mut self, other: Self) {
        self.all.add(&other.all);
        for (kind, tally) in other.kinds {
            self.kinds.entry(kind).or_default().add(&tally);
        }
        let room = KEPT.saturating_sub(self.fails.len());
        self.fails.extend(other.fails.into_iter().take(room));
    }
}

/// The cases of one block; the last ones of the run may be left out.
pub fn block(seed: u64, index: u64, length: usize) -> Vec<(Kinds, Case)> {
    let mut draw = Draw::new(seed, index);
    let mut cases = Vec::with_capacity(length);
    while cases.len() < length {
        let (shape, stage) = stage(&mut draw);
        let points = (WORK / stage.shape.curves().count().max(1)).clamp(1, POINTS);
        let stage = Arc::new(stage);
        for _ in 0..points.min(length - cases.len()) {
            cases.push(places::case(&mut draw, shape, &stage));
        }
    }
    cases
}

/// Reads and judges `count` cases. The same seed gives the same cases and findings, whatever the number of threads.
/// `report` is told how many of how many cases are done.
///
/// # Errors
/// What the backend says.
pub fn run(
    meter: &dyn Meter,
    seed: u64,
    count: u64,
    report: &(dyn Fn(u64, u64) + Sync),
) -> Result<Findings, BackendError> {
    let mut findings = Findings::default();
    let blocks = count.div_ceil(BLOCK);
    let mut first = 0;
    while first < blocks {
        let past = (first + meter.batch() as u64).min(blocks);
        let drawn: Vec<_> = (first..past)
            .into_par_iter()
            .map(|index| block(seed, index, (count - index * BLOCK).min(BLOCK) as usize))
            .collect();
        let (kinds, cases): (Vec<Vec<_>>, Vec<Vec<_>>) = drawn.into_iter().map(|b| b.into_iter().unzip()).unzip();
        let values = meter.read(&cases)?;
        let judged: Vec<_> = (0..cases.len())
            .into_par_iter()
            .map(|i| {
                let mut found = Findings::default();
                for (k, case) in cases[i].iter().enumerate() {
                    let judged = judge(meter, case, values[i][k]);
                    found.count((first + i as u64) * BLOCK + k as u64, kinds[i][k], case, judged);
                }
                found
            })
            .collect();
        // In order, so that sums are the same for any number of threads.
        judged.into_iter().for_each(|found| findings.add(found));
        first = past;
        report((first * BLOCK).min(count), count);
    }
    Ok(findings)
}
