//! What is wrong with a value: the yardstick and the verdict.

use super::case::Case;
use super::meter::Meter;
use crate::backend::Horizons;
use crate::backend::exact::{ExactMap, exact_integral, rough_integral};
use crate::kernel::frame::ShadingFrame;
use crate::light::{Placement, Square};
use crate::shape::{Bounds, CubicBez, Shape};
use glam::{DVec2, DVec3};
use serde::Serialize;

/// What rounding to f32 may add to the tolerance.
pub const FLOOR: f64 = 2e-5;

/// A contour nearer to the shading point than this, in sizes of the light, passes through it.
const TOUCHING: f64 = 1e-11;
/// Halvings of a curve that find out.
const HALVINGS: u32 = 45;

/// What is wrong with a value, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// NaN or infinite.
    NotFinite,
    /// Below 0.
    Negative,
    /// Above 1 by more than [`FLOOR`].
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
    /// The yardstick itself jumps here: the contour passes through the shading point, or inputs that differ by their rounding
    /// give values on either side of this one.
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

    fn map(&self, case: &Case, horizons: Horizons) -> ExactMap {
        let c = self.c.map(|v| self.frame.to_local(v));
        let Some(lobe) = case.lobe(&self.frame) else { return ExactMap { c, horizon: None } };
        let m_inv = lobe.m_inv.widen();
        let axis = lobe.m_row_z.as_dvec3();
        let horizon = (horizons == Horizons::Both && axis.truncate() != DVec2::ZERO).then_some(axis);
        ExactMap { c: c.map(|v| m_inv.apply(v)), horizon }
    }

    /// Whether the contour passes through the shading point, where the integral has no value.
    fn is_on_contour(&self, shape: &Shape) -> bool {
        let [x, y, origin] = self.c;
        let plane = Placement { origin, x, y };
        let (normal, bounds) = (plane.normal(), shape.bounds());
        let reach = TOUCHING * (bounds.size().max_element() + bounds.min.abs().max(bounds.max.abs()).max_element());
        let height = origin.dot(normal) / normal.length();
        if height.abs() > reach * x.length().max(y.length()) {
            return false;
        }
        let foot = plane.light_point(DVec3::ZERO);
        let mut pieces: Vec<(CubicBez, u32)> = shape.curves().map(|c| (*c, 0)).collect();
        while let Some((piece, depth)) = pieces.pop() {
            let Bounds { min, max } = Bounds::of(piece.points());
            if foot.cmplt(min - reach).any() || foot.cmpgt(max + reach).any() {
                continue;
            }
            if (max - min).max_element() <= reach || depth == HALVINGS {
                return true;
            }
            pieces.extend([(0.0, 0.5), (0.5, 1.0)].map(|(t0, t1)| (piece.subsegment(t0, t1), depth + 1)));
        }
        false
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
            let mut map = Self { c: [x, y, moved], frame: self.frame }.map(case, horizons);
            // In cosine space, which is stretched, each image is rounded once more.
            let stretched = map.c[2].length() + half * map.c[0].length().max(map.c[1].length());
            map.c[2] += DVec3::new(by(1), by(2), by(0)) * (4.0 * f64::EPSILON * stretched / step);
            let exact = exact_integral(&map, &case.stage.shape).clamp(0.0, 1.0);
            (low, high) = (low.min(exact), high.max(exact));
        }
        value >= low - within && value <= high + within
    }
}

/// Judges what a meter has read of a case.
pub fn judge(meter: &dyn Meter, case: &Case, value: f64) -> Judged {
    let case = &meter.given(case);
    let horizons = meter.horizons();
    let Some(seen) = Seen::new(case) else { return Judged { value, exact: 0.0, fault: None, undecided: true } };
    if seen.is_on_contour(&case.stage.shape) {
        let range = verdict(case, value, value.clamp(0.0, 1.0));
        return Judged { undecided: range.fault.is_none(), ..range };
    }
    let map = seen.map(case, horizons);
    let rough = verdict(case, value, rough_integral(&map, &case.stage.shape));
    if rough.fault != Some(Fault::Beyond) && rough.fault != Some(Fault::AboveOne) || !meter.is_bounded() {
        return rough;
    }
    let judged = verdict(case, value, exact_integral(&map, &case.stage.shape));
    let undecided = judged.fault == Some(Fault::Beyond)
        && seen.straddles(case, horizons, meter.hair(), value, f64::from(case.tolerance) + FLOOR);
    if undecided { Judged { fault: None, undecided, ..judged } } else { judged }
}

fn verdict(case: &Case, value: f64, exact: f64) -> Judged {
    // Where contours overlap they count by their winding number, but a light fills a hemisphere once.
    let exact = exact.clamp(0.0, 1.0);
    let fault = match () {
        () if !value.is_finite() => Some(Fault::NotFinite),
        () if value < 0.0 => Some(Fault::Negative),
        () if value > 1.0 + FLOOR => Some(Fault::AboveOne),
        () if (value - exact).abs() > f64::from(case.tolerance) + FLOOR => Some(Fault::Beyond),
        () => None,
    };
    Judged { value, exact, fault, undecided: false }
}
