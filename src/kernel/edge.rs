//! The clamped-cosine integral along a straight edge. Twin: `shaders/edge.wgsl`.

use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use core::f32::consts::PI;

/// θ / sin θ for x = cos θ in \[0, 1\]: minimax polynomial, relative error 7e-8 (2.2e-7 as evaluated in f32).
#[inline(always)]
pub fn angle_over_sine<L: Lanes>(x: L) -> L {
    const C: [f32; 9] = [
        1.570_796_2,
        -0.999_981_5,
        0.784_881,
        -0.660_969_1,
        0.556_555_3,
        -0.423_581_05,
        0.252_084_57,
        -0.097_263_96,
        0.017_478_622,
    ];
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = (x * C[1] + C[0]) + (x * C[3] + C[2]) * x2;
    let high = (x * C[5] + C[4]) + (x * C[7] + C[6]) * x2;
    low + x4 * (high + x4 * C[8])
}

/// θ·(b×a)_z / |b×a| for the edge from `a` to `b` (relative to the map's foot), θ the angle it subtends at the
/// origin: 2π times its share of the contour integral (Baum et al. 1989; Heitz et al. 2016, eq. 11).
///
/// The cross product comes from light-space differences, b×a = N'·(u ⟂ a) + u.x·w0 + u.y·w1 with u = b − a.
/// Absolute error about 4e-7 where the edge keeps off the origin.
#[inline(always)]
pub fn edge_integral<P: PlanePoint>(map: &CosineMap<P::Lanes>, a: P, b: P) -> P::Lanes {
    let (pa, pb) = (map.point(a.round()), map.point(b.round()));
    let inv = map.depth.splat(1.0) / (pa.length_squared().sqrt() * pb.length_squared().sqrt());
    edge_angle(edge_normal(map, (b - a).perp_dot(a), (b - a).round()), pa.dot(pb) * inv, inv)
}

/// b × a for an edge with (b − a) ⟂ a = `turn` and b − a = `u`.
#[inline(always)]
pub fn edge_normal<L: Lanes>(map: &CosineMap<L>, turn: L, u: L::Vec2) -> L::Vec3 {
    map.normal * turn + map.w0 * u.x() + map.w1 * u.y()
}

/// θ·n_z / |n| for n = b × a, the cosine of the angle θ between a and b, and `inv` = 1/(|a|·|b|).
#[inline(always)]
pub fn edge_angle<L: Lanes>(normal: L::Vec3, cosine: L, inv: L) -> L {
    let x = cosine.between(-1.0, 1.0);
    let near = angle_over_sine(x.abs()) * inv;
    let acute = normal.z() * near;
    let obtuse = (-x).is_positive();
    if !obtuse.any() {
        return acute;
    }
    // The edge runs through the origin: its plane is undefined and so is the integral; half the jump is 0.
    let length = normal.length_squared().sqrt();
    let away = L::select(length.is_positive(), normal.z() * (length.splat(PI) / length - near), x.splat(0.0));
    L::select(obtuse, away, acute)
}
