//! How many samples are drawn, and what they tell: mean, variance, when to stop.

use crate::backend::technique::Sampling;
use core::ops::Range;
use glam::DVec3;

/// Batches of an estimate from which its variance is known; the samples are divided into as many, or up to twice as many.
const BATCHES: u32 = 16;
/// Most samples of a batch at each place where sampling may end early.
const ADAPTIVE_BATCH: u32 = 64;

/// How samples are divided over batches of independent random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Samples per batch and place; a power of two.
    pub batch: u32,
    /// Batches at most, at least 2.
    pub batches: u32,
    /// Batches of the first round.
    first: u32,
}

impl Plan {
    /// For an estimate that is the mean over so many places.
    pub fn new(sampling: &Sampling, places: u32) -> Self {
        let each = sampling.spp / places;
        let most = if sampling.max_error.is_some() { ADAPTIVE_BATCH } else { u32::MAX };
        let batch = 1 << (each / BATCHES).clamp(1, most).ilog2();
        let batches = (each / batch).max(2);
        let first = if sampling.max_error.is_some() { BATCHES.min(batches) } else { batches };
        Self { batch, batches, first }
    }

    /// Calls `round` with the batches to draw and a zeroed sum for each, until all are drawn or the standard error is below
    /// `max_error`: that is asked after 16 batches and whenever half as many more are drawn, so that chance has few
    /// occasions to end the sampling where it is small by luck.
    pub fn run(&self, max_error: Option<f32>, mut round: impl FnMut(Range<u32>, &mut [[DVec3; 2]])) -> Estimate {
        let mut estimate = Estimate::default();
        let mut sums = Vec::new();
        let (mut from, mut to) = (0, self.first);
        while from < to {
            sums.clear();
            sums.resize((to - from) as usize, [DVec3::ZERO; 2]);
            round(from..to, &mut sums);
            sums.iter().for_each(|sum| estimate.add(*sum));
            let error = estimate.variance().max_element().sqrt();
            if max_error.is_some_and(|limit| error <= f64::from(limit)) {
                break;
            }
            (from, to) = (to, (to + to.div_ceil(2)).min(self.batches));
        }
        estimate
    }
}

/// Mean and spread of the batches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    /// Batches.
    pub count: u32,
    /// Diffuse and specular.
    pub mean: [DVec3; 2],
    /// Squares of the distances of diffuse + specular from its mean, added up.
    spread: DVec3,
}

impl Estimate {
    /// Takes a batch in (Welford 1962).
    fn add(&mut self, batch: [DVec3; 2]) {
        self.count += 1;
        let sum = batch[0] + batch[1];
        let before = sum - self.mean[0] - self.mean[1];
        for (mean, value) in self.mean.iter_mut().zip(batch) {
            *mean += (value - *mean) / f64::from(self.count);
        }
        self.spread += before * (sum - self.mean[0] - self.mean[1]);
    }

    /// Variance of the mean of diffuse + specular.
    pub fn variance(&self) -> DVec3 {
        let count = f64::from(self.count);
        self.spread.max(DVec3::ZERO) / (count * (count - 1.0)).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(spp: u32, max_error: Option<f32>, places: u32) -> Plan {
        Plan::new(&Sampling { spp, max_error, ..Sampling::default() }, places)
    }

    #[test]
    fn plans_keep_to_the_samples_asked_for() {
        assert_eq!(plan(256, None, 4), Plan { batch: 4, batches: 16, first: 16 });
        assert_eq!(plan(1 << 20, None, 1), Plan { batch: 1 << 16, batches: 16, first: 16 });
        assert_eq!(plan(1 << 20, Some(0.1), 1), Plan { batch: 64, batches: 1 << 14, first: 16 });
        // Two of each are the least that tell a variance.
        assert_eq!(plan(1, None, 4), Plan { batch: 1, batches: 2, first: 2 });
        for spp in [32, 100, 1000, 12_345, 1 << 24] {
            for places in [1, 3, 4, 16] {
                let Plan { batch, batches, .. } = plan(spp, None, places);
                let used = batch * batches * places;
                assert!(used <= spp && f64::from(used) > 0.9 * f64::from(spp) - 16.0, "{spp}: {used}");
            }
        }
    }

    #[test]
    fn the_estimate_is_mean_and_variance() {
        let mut estimate = Estimate::default();
        assert_eq!(estimate.variance(), DVec3::ZERO);
        let values = [1.0, 4.0, 2.0, 7.0, 1.5];
        values.iter().for_each(|&v| estimate.add([DVec3::splat(0.25 * v), DVec3::splat(0.75 * v)]));
        let mean = values.iter().sum::<f64>() / 5.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0 / 5.0;
        assert!((estimate.mean[0].x + estimate.mean[1].x - mean).abs() < 1e-12);
        assert!((estimate.variance().x - variance).abs() < 1e-12);
    }

    #[test]
    fn rounds_cover_every_batch_once_and_stop_early() {
        let drawn = |max_error, value: &dyn Fn(u32) -> f64| {
            let mut seen = Vec::new();
            let estimate = plan(1 << 14, max_error, 1).run(max_error, |batches, sums| {
                sums.iter_mut().zip(batches.clone()).for_each(|(sum, i)| sum[0] = DVec3::splat(value(i)));
                seen.extend(batches);
            });
            assert!(seen.iter().copied().eq(0..estimate.count));
            estimate
        };
        let alternating = |i: u32| f64::from(i % 2);
        assert_eq!(drawn(None, &alternating).count, 16);
        assert_eq!(drawn(Some(0.2), &alternating).count, 16);
        assert_eq!(drawn(Some(0.001), &alternating).count, 256);
        // The standard error is ½/√n: 0.05 from the hundredth on.
        let count = drawn(Some(0.05), &alternating).count;
        assert!((100..152).contains(&count), "{count}");
    }
}
