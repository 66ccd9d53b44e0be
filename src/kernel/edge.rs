//! The clamped-cosine integral along a straight edge. Twin: `shaders/edge.wgsl`.

use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use core::f32::consts::{FRAC_PI_2, PI};

/// c0 + c1·x + … + c8·x⁸ by halves (Estrin 1960).
#[inline(always)]
fn polynomial<L: Lanes>(c: [f32; 9], x: L) -> L {
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = (x * c[1] + c[0]) + (x * c[3] + c[2]) * x2;
    let high = (x * c[5] + c[4]) + (x * c[7] + c[6]) * x2;
    low + x4 * (high + x4 * c[8])
}

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
    polynomial(C, x)
}

/// The angle of the point (x, y) with x ≥ 0, from −π/2 to π/2; 0 at the origin. Minimax polynomial of atan(t)/t in t²,
/// absolute error 2e-7 as evaluated in f32.
#[inline(always)]
pub fn half_turn<L: Lanes>(y: L, x: L) -> L {
    const C: [f32; 9] = [
        1.0,
        -0.333_330_72,
        0.199_926_2,
        -0.142_036_45,
        0.106_409_35,
        -0.075_042_963,
        0.042_691_533,
        -0.016_068_636,
        0.002_849_890_6,
    ];
    let height = y.abs();
    let steep = height.above(x);
    let t = L::select(steep, x, height) / L::select(steep, height, x).max(x.splat(f32::MIN_POSITIVE));
    let flat = t * polynomial(C, t * t);
    L::select(steep, -flat + FRAC_PI_2, flat).copysign(y)
}

/// θ·(b×a)_z / |b×a| for the edge from `a` to `b` (relative to the map's foot), θ the angle it subtends at the
/// origin: 2π times its share of the contour integral (Baum et al. 1989; Heitz et al. 2016, eq. 11).
///
/// The cross product comes from light-space differences, b×a = N'·(u ⟂ a) + u.x·w0 + u.y·w1 with u = b − a.
/// Absolute error about 4e-7 where the edge keeps off the origin.
#[inline(always)]
pub fn edge_integral<P: PlanePoint>(map: &CosineMap<P::Lanes>, a: P, b: P) -> P::Lanes {
    let (pa, pb) = (map.point(a.round()), map.point(b.round()));
    let inv = map.depth.splat(1.0) / (pa.length_squared() * pb.length_squared()).sqrt();
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
