//! What is wrong with a value: the yardstick and the verdict.

use super::case::Case;
use crate::backend::Horizons;
use crate::backend::exact::{ExactMap, exact_integral};
use crate::kernel::frame::ShadingFrame;
use crate::light::Square;
use glam::{DVec2, DVec3};
use serde::Serialize;

/// What rounding to f32 may add to the tolerance.
pub const FLOOR: f64 = 2e-5;

/// What is wrong with a value, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// NaN or infinite.
    NotFinite,
    /// Below 0.
    Negative,
    /// Above 1 by more than [`FLOOR`] (where contours overlap: above the winding number's integral).
    AboveOne,
    /// Off by more than the tolerance and [`FLOOR`].
    Beyond,
}

/// A value and what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// What was measured.
    pub value: f64,
    /// The yardstick's.
    pub exact: f64,
    /// What is wrong.
    pub fault: Option<Fault>,
    /// The yardstick itself jumps here: inputs that differ by their rounding give values on either side of this one.
    pub undecided: bool,
}

impl Judged {
    /// |value − exact|; infinite for what is no number, 0 where the yardstick is undecided.
    pub fn error(&self) -> f64 {
        match () {
            () if self.undecided => 0.0,
            () if self.value.is_finite() => (self.value - self.exact).abs(),
            () => f64::INFINITY,
        }
    }
}

/// The light's axes and origin as a shading point sees them, by the arithmetic that backends state for it: places relative
/// to the camera are rounded to f64, and nothing after.
struct Seen {
    c: [DVec3; 3],
    frame: ShadingFrame,
}

impl Seen {
    fn new(case: &Case) -> Option<Self> {
        let placement = &case.stage.placement;
        let to_light = (placement.origin - case.stage.eye) - case.place();
        Some(Self { c: [placement.x, placement.y, to_light], frame: case.frame()? })
    }

    fn integral(&self, case: &Case, horizons: Horizons) -> f64 {
        let local = self.c.map(|v| self.frame.to_local(v));
        let Some(lobe) = case.lobe(&self.frame) else {
            return exact_integral(&ExactMap { c: local, horizon: None }, &case.stage.shape).max(0.0);
        };
        let m_inv = lobe.m_inv.mat3().as_dmat3();
        let axis = lobe.m_row_z.as_dvec3();
        let horizon = (horizons == Horizons::Both && axis.truncate() != DVec2::ZERO).then_some(axis);
        exact_integral(&ExactMap { c: local.map(|v| m_inv * v), horizon }, &case.stage.shape).max(0.0)
    }

    /// Whether inputs that differ from these by `hair` of their size give values both above and below `value`, or as near.
    fn straddles(&self, case: &Case, horizons: Horizons, hair: f64, value: f64, within: f64) -> bool {
        let [x, y, origin] = self.c;
        let half = Square::around(case.stage.shape.bounds()).map_or(0.0, |s| s.half + s.center.length());
        let step = hair * (origin.length() + half * x.length().max(y.length()));
        let normal = x.cross(y).normalize_or(DVec3::Z);
        let steps = [normal, x.normalize_or(DVec3::X), y.normalize_or(DVec3::Y)];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for index in 0..27 {
            let by = |k: u32| f64::from(index / 3_i32.pow(k) % 3 - 1) * step;
            let moved = origin + steps[0] * by(0) + steps[1] * by(1) + steps[2] * by(2);
            let exact = Self { c: [x, y, moved], frame: self.frame }.integral(case, horizons);
            (low, high) = (low.min(exact), high.max(exact));
        }
        value >= low - within && value <= high + within
    }
}

/// The yardstick's value of a case; `None` where its frame has no direction.
pub fn exact(case: &Case, horizons: Horizons) -> Option<f64> {
    Some(Seen::new(case)?.integral(case, horizons))
}

/// Judges a value. `hair` is the relative rounding of the inputs that the backend computes with.
pub fn judge(case: &Case, horizons: Horizons, hair: f64, value: f64) -> Judged {
    let Some(seen) = Seen::new(case) else { return Judged { value, exact: 0.0, fault: None, undecided: true } };
    let exact = seen.integral(case, horizons);
    let within = f64::from(case.tolerance) + FLOOR;
    let fault = match () {
        () if !value.is_finite() => Some(Fault::NotFinite),
        () if value < 0.0 => Some(Fault::Negative),
        () if value > exact.max(1.0) + FLOOR => Some(Fault::AboveOne),
        () if (value - exact).abs() > within => Some(Fault::Beyond),
        () => None,
    };
    let undecided = fault == Some(Fault::Beyond) && seen.straddles(case, horizons, hair, value, within);
    Judged { value, exact, fault: fault.filter(|_| !undecided), undecided }
}
