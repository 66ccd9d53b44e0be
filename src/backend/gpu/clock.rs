//! What shading takes: by the device's own timestamps where they can be trusted, else by the wall clock.

use super::buffers::{Readback, storage};
use super::device::Device;
use super::pipelines::compute;
use super::source;
use crate::backend::BackendError;
use std::time::Instant;
use wgpu::{Buffer, BufferDescriptor, BufferUsages, ComputePassTimestampWrites, QuerySet};

/// Passes that are timed before their times are read.
const PASSES: u32 = 256;
/// A trial of this length tells whether timestamps are right, seconds.
const TRIAL: f64 = 4e-3;
/// Steps of the first trial, and the most.
const STEPS: [u32; 2] = [1 << 12, 1 << 28];
/// Trials of full length of which one must agree: on a busy machine a wait may come between a pass and the news of its end.
const TRIALS: u32 = 4;
/// Least and most that a pass may take by its timestamps, over what the wall clock says of its submission and wait.
const PLAUSIBLE: [f64; 2] = [0.5, 1.02];
/// Words of the trial's buffer: the number of steps and one for each of its invocations.
const WORDS: usize = 65;

/// How passes are timed.
#[derive(Clone, Debug)]
pub enum Clock {
    /// By timestamps at the beginning and the end of a pass.
    Timestamps,
    /// From the submission of a pass alone until the device is idle; and why.
    Wall(String),
}

impl Clock {
    /// The clock for a device. Where it has timestamps they are held against the wall clock first.
    pub fn of(device: &Device) -> Result<Self, BackendError> {
        if !device.has_timestamps {
            return Ok(Self::Wall("the adapter has no timestamps".into()));
        }
        let pipeline = compute(device, &source::clock(), None, "spin", &[]);
        let mut timer = Timer::new(device, &Self::Timestamps);
        let mut spin = |steps: u32| {
            let mut words = [0_u32; WORDS];
            words[0] = steps;
            let words = storage(device, "steps", &words)?;
            let bind = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("clock"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: words.as_entire_binding() }],
            });
            device.wait()?;
            let since = Instant::now();
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("clock"),
                timestamp_writes: timer.writes(),
            });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind, &[]);
            pass.dispatch_workgroups(1, 1, 1);
            drop(pass);
            device.queue.submit([encoder.finish()]);
            device.wait()?;
            let wall = since.elapsed().as_secs_f64();
            Ok([timer.take(device)?, wall])
        };
        // Compiles.
        spin(1)?;
        let mut steps = STEPS[0];
        let mut told = spin(steps)?;
        while told[1] < TRIAL && steps < STEPS[1] {
            steps *= 4;
            told = spin(steps)?;
        }
        for _ in 0..TRIALS {
            if is_plausible(told) {
                return Ok(Self::Timestamps);
            }
            told = spin(steps)?;
        }
        let [stamped, wall] = told.map(|seconds| seconds * 1e3);
        Ok(Self::Wall(format!("the adapter's timestamps say {stamped:.3} ms of a pass of {wall:.3} ms")))
    }

    /// As reports name it.
    pub fn name(&self) -> String {
        match self {
            Self::Timestamps => "timestamps".into(),
            Self::Wall(why) => format!("wall clock ({why})"),
        }
    }
}

/// Whether timestamps of a pass may be right, by what the wall clock says of it.
fn is_plausible([stamped, wall]: [f64; 2]) -> bool {
    (PLAUSIBLE[0] * wall..=PLAUSIBLE[1] * wall).contains(&stamped)
}

/// Adds up what passes take.
pub struct Timer {
    queries: Option<Queries>,
    seconds: f64,
}

/// Timestamps, and their way back.
struct Queries {
    set: QuerySet,
    resolved: Buffer,
    readback: Readback,
    passes: u32,
}

impl Timer {
    /// At nought.
    pub fn new(device: &Device, clock: &Clock) -> Self {
        let queries = matches!(clock, Clock::Timestamps).then(|| {
            let bytes = u64::from(2 * PASSES) * 8;
            Queries {
                set: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("passes"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2 * PASSES,
                }),
                resolved: device.device.create_buffer(&BufferDescriptor {
                    label: Some("timestamps"),
                    size: bytes,
                    usage: BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
                readback: Readback::new(device, bytes),
                passes: 0,
            }
        });
        Self { queries, seconds: 0.0 }
    }

    /// Whether passes write timestamps; else each is to be given to [`Self::by_the_wall`].
    pub const fn has_timestamps(&self) -> bool {
        self.queries.is_some()
    }

    /// Where the next pass writes its timestamps. [`Self::is_full`] is asked before.
    pub fn writes(&mut self) -> Option<ComputePassTimestampWrites<'_>> {
        let queries = self.queries.as_mut()?;
        let first = 2 * queries.passes;
        queries.passes += 1;
        Some(ComputePassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Whether there is no room for another pass until [`Self::collect`].
    pub fn is_full(&self) -> bool {
        self.queries.as_ref().is_some_and(|q| q.passes == PASSES)
    }

    /// Adds what the submitted passes have taken; waits for them.
    pub fn collect(&mut self, device: &Device) -> Result<(), BackendError> {
        let Some(queries) = self.queries.as_mut().filter(|q| q.passes > 0) else { return Ok(()) };
        let count = 2 * queries.passes;
        queries.passes = 0;
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.resolve_query_set(&queries.set, 0..count, &queries.resolved, 0);
        device.queue.submit([encoder.finish()]);
        let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
        // As wide as it is, a counter may still wrap.
        let passes = |stamps: &[u64]| stamps.chunks_exact(2).map(|s| s[1].wrapping_sub(s[0]) as f64 * period).sum();
        let seconds: f64 = queries.readback.read(device, &queries.resolved, u64::from(count), passes)?;
        self.seconds += seconds;
        Ok(())
    }

    /// Runs a pass alone and adds what it took.
    pub fn by_the_wall(
        &mut self,
        device: &Device,
        pass: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> Result<(), BackendError> {
        device.wait()?;
        let since = Instant::now();
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        pass(&mut encoder);
        device.queue.submit([encoder.finish()]);
        device.wait()?;
        self.seconds += since.elapsed().as_secs_f64();
        Ok(())
    }

    /// Seconds since the last call.
    pub fn take(&mut self, device: &Device) -> Result<f64, BackendError> {
        self.collect(device)?;
        Ok(core::mem::take(&mut self.seconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_that_disagree_with_the_wall_are_not_trusted() {
        assert!(is_plausible([0.009, 0.010]) && is_plausible([0.005, 0.010]));
        for wrong in [0.0, 1e-9, 0.0049, 0.011, 9.0, f64::NAN] {
            assert!(!is_plausible([wrong, 0.010]), "{wrong}");
        }
    }
}
