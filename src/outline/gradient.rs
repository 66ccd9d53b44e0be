//! Linear and radial gradients of SVG, evaluated in f64: SVG 2, "Gradients" (W3C 2018), 14.2.

use crate::color::srgb_decode;
use glam::{DAffine2, DVec2, DVec4};

/// What a gradient shows before its first stop and after its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    Pad,
    Reflect,
    Repeat,
}

/// A colour at a place on the gradient: sRGB and alpha, not multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) offset: f64,
    pub(super) color: DVec4,
}

/// How the gradient's parameter runs over the plane, in the gradient's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    /// 0 at `from`, 1 at `to`, constant across.
    Linear { from: DVec2, to: DVec2 },
    /// 0 on the circle about `focus`, 1 on that about `center`.
    Radial { center: DVec2, radius: f64, focus: DVec2, focus_radius: f64 },
}

/// A gradient in light space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Gradient {
    course: Course,
    spread: Spread,
    ramp: Ramp,
    to_own: DAffine2,
    /// Over less than this change of the parameter, colours are nearly straight lines; 0 where they jump.
    fine: f64,
}

/// Periods over which a mean is that of one period.
const MOST_PERIODS: f64 = 8.0;
/// Stops closer than this are a jump: usvg moves stops of equal offset apart by 1e-7.
const JUMP: f64 = 1e-6;

impl Gradient {
    /// `to_light` maps the gradient's space to light space. `None` if it has no inverse.
    pub(super) fn new(course: Course, spread: Spread, stops: &[Stop], to_light: DAffine2) -> Option<Self> {
        let to_own = to_light.inverse();
        // Without length it is its last stop everywhere.
        let pointless = matches!(course, Course::Linear { from, to } if from == to);
        let stops = if pointless { &stops[stops.len().saturating_sub(1)..] } else { stops };
        if !to_own.is_finite() || stops.is_empty() {
            return None;
        }
        let ramp = Ramp::new(stops);
        let jumps =
            ramp.stops.windows(2).any(|pair| pair[1].offset - pair[0].offset <= JUMP && pair[0].color != pair[1].color);
        let gradient = Self { course, spread, ramp, to_own, fine: 0.0 };
        let fine = if jumps || spread == Spread::Repeat { 0.0 } else { 0.25 * gradient.finest() };
        Some(Self { fine, ..gradient })
    }

    /// The same gradient after the plane has been moved by `map`'s inverse.
    pub(super) fn after(&self, from_moved: DAffine2) -> Self {
        Self { to_own: self.to_own * from_moved, ..self.clone() }
    }

    pub(super) fn is_opaque(&self) -> bool {
        let everywhere = match self.course {
            Course::Linear { .. } => true,
            Course::Radial { center, radius, focus, focus_radius } => {
                focus.distance(center) + focus_radius < radius * (1.0 - 1e-6)
            }
        };
        everywhere && self.ramp.stops.iter().all(|s| s.color.w >= 1.0)
    }

    /// Mean colour, linear and premultiplied, over about a texel of size `cell` about `p`.
    pub(super) fn at(&self, p: DVec2, cell: DVec2) -> DVec4 {
        let Some(t) = self.parameter(p) else { return DVec4::ZERO };
        let span = |step: DVec2| match (self.parameter(p - step), self.parameter(p + step)) {
            (Some(a), Some(b)) => b - a,
            _ => 0.0,
        };
        let width = span(DVec2::new(0.5 * cell.x, 0.0)).hypot(span(DVec2::new(0.0, 0.5 * cell.y)));
        // The mean over a texel would blunt the corners at the stops for nothing.
        let half = if width < self.fine { 0.0 } else { 0.5 * width };
        self.mean(t - half, t + half)
    }

    /// How fast the parameter runs along the axes of light space, at most or nearly so, per metre.
    pub(super) fn speed(&self) -> DVec2 {
        let own = self.to_own.matrix2;
        match self.course {
            Course::Linear { from, to } => {
                let along = (to - from) / (to - from).length_squared();
                let speed = DVec2::new(own.x_axis.dot(along), own.y_axis.dot(along)).abs();
                if speed.is_finite() { speed } else { DVec2::ZERO }
            }
            Course::Radial { center, radius, focus, focus_radius } => {
                let least = (radius - focus_radius - focus.distance(center)).max(0.25 * radius);
                DVec2::new(own.x_axis.length(), own.y_axis.length()) / least
            }
        }
    }

    /// The smallest distance of stops that are no jump.
    pub(super) fn finest(&self) -> f64 {
        let gaps = self.ramp.stops.windows(2).map(|pair| pair[1].offset - pair[0].offset);
        gaps.filter(|&gap| gap > JUMP).fold(1.0, f64::min)
    }

    /// The gradient's parameter at a point; `None` where the gradient paints nothing.
    fn parameter(&self, p: DVec2) -> Option<f64> {
        let p = self.to_own.transform_point2(p);
        match self.course {
            Course::Linear { from, to } => {
                let t = (p - from).dot(to - from) / (to - from).length_squared();
                Some(if t.is_finite() { t } else { 0.0 })
            }
            Course::Radial { center, radius, focus, focus_radius } => {
                // |p − f − t(c − f)| = fr + t(r − fr): the largest t whose circle has a radius.
                let (q, d, grow) = (p - focus, center - focus, radius - focus_radius);
                let a = d.length_squared() - grow * grow;
                let b = q.dot(d) + focus_radius * grow;
                let c = q.length_squared() - focus_radius * focus_radius;
                let discriminant = b * b - a * c;
                if discriminant.is_nan() || discriminant < 0.0 {
                    return None;
                }
                let w = b + discriminant.sqrt().copysign(b);
                let roots = if w == 0.0 { [0.0, 0.0] } else { [w / a, c / w] };
                let valid = |t: &f64| t.is_finite() && focus_radius + t * grow >= 0.0;
                roots.into_iter().filter(valid).max_by(f64::total_cmp)
            }
        }
    }

    /// Mean colour where the parameter runs from `a` to `b`.
    fn mean(&self, a: f64, b: f64) -> DVec4 {
        let ramp = &self.ramp;
        let width = b - a;
        match self.spread {
            Spread::Pad => {
                if a >= 1.0 || b <= 0.0 || width <= 0.0 {
                    return ramp.color(a.clamp(0.0, 1.0));
                }
                let (before, after) = ((-a).max(0.0), (b - 1.0).max(0.0));
                let inside = ramp.integral(a.max(0.0), b.min(1.0));
                (ramp.color(0.0) * before + inside + ramp.color(1.0) * after) / width
            }
            Spread::Reflect | Spread::Repeat => {
                if width > MOST_PERIODS || a.abs() > 1e12 {
                    return ramp.integral(0.0, 1.0);
                }
                let mirrored = |period: f64| self.spread == Spread::Reflect && period.rem_euclid(2.0) == 1.0;
                if width <= 0.0 {
                    let t = a - a.floor();
                    return ramp.color(if mirrored(a.floor()) { 1.0 - t } else { t });
                }
                let (mut sum, mut period) = (DVec4::ZERO, a.floor());
                while period < b {
                    let (from, to) = ((a - period).max(0.0), (b - period).min(1.0));
                    sum += if mirrored(period) { ramp.integral(1.0 - to, 1.0 - from) } else { ramp.integral(from, to) };
                    period += 1.0;
                }
                sum / width
            }
        }
    }
}

/// Colours over 0 to 1: between stops straight lines in sRGB, not premultiplied.
#[derive(Clone, Debug, PartialEq)]
struct Ramp {
    /// From offset 0 to offset 1.
    stops: Vec<Stop>,
    /// Integrals of the linear, premultiplied colour from 0 to each stop.
    sums: Vec<DVec4>,
}

/// Gauss–Legendre nodes and weights on 0 to 1, exact to degree 7.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_92),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_92),
];

impl Ramp {
    fn new(given: &[Stop]) -> Self {
        let mut stops: Vec<Stop> = Vec::with_capacity(given.len() + 2);
        for &stop in given {
            let least = stops.last().map_or(0.0, |s| s.offset);
            let offset = if stop.offset.is_nan() { least } else { stop.offset.clamp(least, 1.0) };
            if stops.is_empty() && offset > 0.0 {
                stops.push(Stop { offset: 0.0, ..stop });
            }
            stops.push(Stop { offset, ..stop });
        }
        if let Some(&last) = stops.last().filter(|s| s.offset < 1.0) {
            stops.push(Stop { offset: 1.0, ..last });
        }
        let mut ramp = Self { sums: vec![DVec4::ZERO], stops };
        for i in 1..ramp.stops.len() {
            let part = ramp.quadrature(i - 1, ramp.stops[i - 1].offset, ramp.stops[i].offset);
            ramp.sums.push(ramp.sums[i - 1] + part);
        }
        ramp
    }

    /// Index of the stop before `t`; there is one after it, unless there is but one in all.
    fn segment(&self, t: f64) -> usize {
        let after = self.stops.partition_point(|s| s.offset <= t);
        after.clamp(1, self.stops.len().max(2) - 1) - 1
    }

    fn color(&self, t: f64) -> DVec4 {
        self.color_in(self.segment(t), t)
    }

    fn color_in(&self, segment: usize, t: f64) -> DVec4 {
        let a = self.stops[segment];
        let b = self.stops.get(segment + 1).copied().unwrap_or(a);
        let span = b.offset - a.offset;
        let part = if span > 0.0 { ((t - a.offset) / span).clamp(0.0, 1.0) } else { 1.0 };
        let mixed = a.color.lerp(b.color, part);
        (DVec4::from_array([mixed.x, mixed.y, mixed.z, 1.0].map(srgb_decode)) * mixed.w).with_w(mixed.w)
    }

    /// ∫ colour dt from `a` to `b`, 0 ≤ a ≤ b ≤ 1.
    fn integral(&self, a: f64, b: f64) -> DVec4 {
        let (first, last) = (self.segment(a), self.segment(b));
        if first == last {
            return self.quadrature(first, a, b);
        }
        self.quadrature(first, a, self.stops[first + 1].offset) + self.sums[last] - self.sums[first + 1]
            + self.quadrature(last, self.stops[last].offset, b)
    }

    /// The integral inside one segment; the colour there is a power of a line, smooth but for the sRGB curve's joint.
    fn quadrature(&self, segment: usize, a: f64, b: f64) -> DVec4 {
        GAUSS.into_iter().map(|(node, weight)| self.color_in(segment, a + (b - a) * node) * (weight * (b - a))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(spread: Spread) -> Gradient {
        let stops = [(0.0, 0.0), (1.0, 1.0)].map(|(offset, v)| Stop { offset, color: DVec4::new(v, v, v, 1.0) });
        let course = Course::Linear { from: DVec2::ZERO, to: DVec2::X };
        Gradient::new(course, spread, &stops, DAffine2::IDENTITY).unwrap()
    }

    #[test]
    fn means_are_those_of_many_samples() {
        for spread in [Spread::Pad, Spread::Reflect, Spread::Repeat] {
            let gradient = two(spread);
            for (a, b) in [(-0.4, 0.3), (0.2, 0.21), (0.7, 2.6), (-3.3, -1.9), (1.2, 1.5)] {
                let n = 20_000;
                let sample = |i: i32| {
                    let t = a + (b - a) * (f64::from(i) + 0.5) / f64::from(n);
                    gradient.mean(t, t)
                };
                let sum: DVec4 = (0..n).map(sample).sum();
                let off = (sum / f64::from(n) - gradient.mean(a, b)).abs().max_element();
                assert!(off < 1e-4, "{spread:?} {a} {b}: {off}");
                let wrong = (sum / f64::from(n) - gradient.mean(a, b + 0.05)).abs().max_element();
                // Before its first stop and past its last a padded gradient is of one colour.
                let constant = spread == Spread::Pad && (a >= 1.0 || b + 0.05 <= 0.0);
                assert!(wrong > 1e-4 || constant, "{spread:?} {a} {b}: {wrong}");
            }
        }
    }

    #[test]
    fn a_gradient_without_length_shows_its_last_stop() {
        let stops = [Stop { offset: 0.0, color: DVec4::W }, Stop { offset: 0.5, color: DVec4::ONE }];
        for spread in [Spread::Pad, Spread::Reflect, Spread::Repeat] {
            let course = Course::Linear { from: DVec2::X, to: DVec2::X };
            let gradient = Gradient::new(course, spread, &stops, DAffine2::IDENTITY).unwrap();
            let there = gradient.at(DVec2::new(0.3, 7.0), DVec2::ONE);
            assert_eq!(there, DVec4::ONE, "{spread:?}");
        }
        assert!(
            Gradient::new(
                Course::Linear { from: DVec2::ZERO, to: DVec2::X },
                Spread::Pad,
                &stops,
                DAffine2::from_scale(DVec2::new(1.0, 0.0))
            )
            .is_none()
        );
    }
}
