//! [`Meter`]: what is put to the test.

use super::case::Case;
#[cfg(feature = "gpu")]
use super::case::{Stage, scene};
#[cfg(feature = "gpu")]
use crate::backend::Settings;
use crate::backend::emitter::Emitter;
use crate::backend::gather::Images;
#[cfg(feature = "gpu")]
use crate::backend::gpu::GpuBackend;
#[cfg(feature = "gpu")]
use crate::backend::gpu::layout::{MeterPoint, Reading};
#[cfg(feature = "gpu")]
use crate::backend::prepared::Prepared;
use crate::backend::{BackendError, Horizons, Technique};
use crate::kernel::tree::Budget;
#[cfg(feature = "gpu")]
use crate::light::{Placement, Square};
#[cfg(feature = "gpu")]
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Something that gives the integrals of cases.
pub trait Meter: Sync {
    /// The integrals of each block of cases.
    ///
    /// # Errors
    /// What the backend says.
    fn read(&self, blocks: &[Vec<Case>]) -> Result<Vec<Vec<f64>>, BackendError>;

    /// Where lobes are clipped.
    fn horizons(&self) -> Horizons;

    /// Whether it is to keep the tolerance. What is off by more is then looked at again, with the yardstick's full digits.
    fn is_bounded(&self) -> bool {
        true
    }

    /// The case with its inputs as the backend is given them.
    fn given(&self, case: &Case) -> Case {
        case.clone()
    }

    /// Relative rounding of the inputs in the backend's own first steps.
    fn hair(&self) -> f64 {
        F64_HAIR
    }

    /// Blocks to be read at once.
    fn batch(&self) -> usize {
        64
    }
}

/// The roundings of some fifty operations of the set-up.
const F64_HAIR: f64 = 1e-14;
/// The same of pairs of f32 (2⁻⁴⁶ each), in which the shaders set up what is near.
#[cfg(feature = "gpu")]
const PAIR_HAIR: f64 = 1e-12;

/// Where lobes are clipped, by what a technique can.
pub const fn horizons(technique: &Technique) -> Horizons {
    if technique.knows_true_horizon() { Horizons::Both } else { Horizons::Cosine }
}

const fn is_bounded(technique: &Technique) -> bool {
    matches!(technique, Technique::Tree | Technique::Textured | Technique::Exact)
}

/// A technique on the CPU.
#[derive(Clone, Copy, Debug)]
pub struct Cpu {
    /// The technique.
    pub technique: Technique,
    /// Where it clips lobes.
    pub horizons: Horizons,
}

impl Cpu {
    fn integral(&self, emitter: &Emitter, case: &Case) -> f64 {
        let Some(frame) = case.frame() else { return 0.0 };
        let lobe = case.lobe(&frame).map(|lobe| match self.horizons {
            Horizons::Both => lobe,
            Horizons::Cosine => lobe.with_one_horizon(),
        });
        let integral = Images::new(emitter, &frame, case.place())
            .and_then(|images| images.integral(emitter, lobe.as_ref(), case.tolerance, &mut Budget::default()));
        // A skipped light is dark.
        integral.map_or(0.0, |integral| integral.value.x)
    }
}

impl Meter for Cpu {
    fn read(&self, blocks: &[Vec<Case>]) -> Result<Vec<Vec<f64>>, BackendError> {
        let block = |cases: &Vec<Case>| {
            let mut values = Vec::with_capacity(cases.len());
            for cases in cases.chunk_by(|a, b| Arc::ptr_eq(&a.stage, &b.stage)) {
                let emitter = cases[0].stage.emitter(&self.technique)?;
                values.extend(cases.iter().map(|case| self.integral(&emitter, case)));
            }
            Ok(values)
        };
        blocks.par_iter().map(block).collect()
    }

    fn horizons(&self) -> Horizons {
        self.horizons
    }

    fn is_bounded(&self) -> bool {
        is_bounded(&self.technique)
    }
}

/// A technique on the GPU, by the light meter.
#[cfg(feature = "gpu")]
#[derive(Debug)]
pub struct Gpu<'a> {
    /// The backend.
    pub backend: &'a GpuBackend,
    /// The technique.
    pub technique: Technique,
    /// Where it clips lobes.
    pub horizons: Horizons,
}

#[cfg(feature = "gpu")]
impl Meter for Gpu<'_> {
    fn read(&self, blocks: &[Vec<Case>]) -> Result<Vec<Vec<f64>>, BackendError> {
        let cases = || blocks.iter().flatten();
        let mut stages: Vec<&Arc<Stage>> = Vec::new();
        let mut points = Vec::new();
        for case in cases() {
            if stages.last().is_none_or(|last| !Arc::ptr_eq(last, &case.stage)) {
                stages.push(&case.stage);
            }
            points.push(MeterPoint {
                position: case.place().as_vec3(),
                emitter: stages.len() as u32 - 1,
                normal: case.normal.normalize_or_zero().as_vec3(),
                alpha: case.alpha.unwrap_or(1.0) as f32,
                view: case.view.normalize_or_zero().as_vec3(),
                tolerance: case.tolerance,
            });
        }
        let settings = Settings { technique: self.technique, horizons: self.horizons, ..Settings::default() };
        let mut prepared = Prepared::new(&scene(DVec3::ZERO, Vec::new()), &settings)?;
        let emitters: Result<_, _> = stages.par_iter().map(|stage| stage.emitter(&self.technique)).collect();
        prepared.emitters = emitters?;
        let readings = self.backend.measure(&prepared, &points)?;
        let value = |(case, reading): (&Case, &Reading)| {
            f64::from(if case.alpha.is_some() { reading.specular.x } else { reading.diffuse.x })
        };
        let mut values = cases().zip(&readings).map(value);
        Ok(blocks.iter().map(|block| values.by_ref().take(block.len()).collect()).collect())
    }

    fn horizons(&self) -> Horizons {
        self.horizons
    }

    fn is_bounded(&self) -> bool {
        is_bounded(&self.technique)
    }

    /// Places relative to the camera, directions and the axes of the light's square in f32.
    fn given(&self, case: &Case) -> Case {
        let Stage { shape, placement, eye } = &*case.stage;
        let Some(Square { center, half }) = Square::around(shape.bounds()) else { return case.clone() };
        let relative = Placement { origin: placement.origin - eye, ..*placement };
        let rounded = |v: DVec3| v.as_vec3().as_dvec3();
        let middle = rounded(relative.point(center));
        let (x, y) = (rounded(placement.x * half) / half, rounded(placement.y * half) / half);
        let stage = Stage {
            shape: shape.clone(),
            placement: Placement { origin: middle - x * center.x - y * center.y, x, y },
            eye: DVec3::ZERO,
        };
        Case {
            stage: Arc::new(stage),
            position: rounded(case.place()),
            normal: rounded(case.normal.normalize_or_zero()),
            view: rounded(case.view.normalize_or_zero()),
            ..*case
        }
    }

    fn hair(&self) -> f64 {
        PAIR_HAIR
    }

    fn batch(&self) -> usize {
        512
    }
}
