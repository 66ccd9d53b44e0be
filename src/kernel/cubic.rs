//! A cubic by its differences. Twin: `shaders/cubic.wgsl`.

use super::lanes::Real;
use super::map::PlanePoint;

/// The point at t of the cubic with these ends and these differences of neighbouring control points, as a displacement from
/// the nearer end, which keeps the ends' digits.
#[inline(always)]
pub fn cubic_point<P: PlanePoint>([p0, p3]: [P; 2], [d0, d1, d2]: [P; 3], t: f32) -> P {
    let scalar = |value: f32| p0.x().splat(value);
    let (s, near, three) = (scalar(1.0 - t), scalar(t), scalar(3.0));
    let (e0, e1) = (d1 - d0, d2 - d1);
    if t < 1.0 - t {
        p0 + (d0 * three + (e0 * three + (e1 - e0) * near) * near) * near
    } else {
        p3 - (d2 * three - (e1 * three - (e1 - e0) * s) * s) * s
    }
}
