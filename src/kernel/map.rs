//! The affine map from a light's plane to cosine space. Twin: `shaders/map.wgsl`.

use core::ops::{Add, Div, Mul, Sub};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// How far outside the tree's square \[−1, 1\]² the origin of the map may lie.
pub const FOOT_LIMIT: f64 = 1.5;
/// Least distance from the light's plane over its half-width, in cosine space: 1/|p|⁴ must stay within f32.
const TOUCHING: f64 = 1e-9;
/// Distance from the light's plane over its half-width, in cosine space, below which coordinates need their low
/// parts: rounding by 2⁻²⁵ turns an edge by 2⁻²⁵/CLOSE of a radian.
const CLOSE: f32 = 1.0 / 256.0;

/// The map p = c0·(x − foot.x) + c1·(y − foot.y) + c2 from tree space to cosine space, at one shading point.
///
/// Tree space is light space moved and scaled into \[−1, 1\]². `foot` is the plane's point nearest the origin of
/// cosine space (kept near the light): about it nothing cancels, so p has the full relative precision of f32
/// however near the light is, and products of edges come from light-space differences.
#[derive(Clone, Copy, Debug)]
pub struct CosineMap {
    /// Tree-space point that `c2` belongs to.
    pub foot: Vec2,
    /// Image of the x axis.
    pub c0: Vec3,
    /// Image of the y axis.
    pub c1: Vec3,
    /// Image of `foot`.
    pub c2: Vec3,
    /// N' = c0 × c1.
    pub normal: Vec3,
    /// c0 × c2.
    pub w0: Vec3,
    /// c1 × c2.
    pub w1: Vec3,
    /// D = −N'·c2: positive in front of the light.
    pub depth: f32,
    /// c0·c0, c0·c1, c1·c1.
    pub gram: [f32; 3],
}

/// A point of the light's plane relative to the map's foot: [`Vec2`] as a rule, [`DVec2`] where the light is close
/// ([`CosineMap::is_close`]) and f32 would turn a long edge about the foot. The formulas are the same.
pub trait PlanePoint: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Self::Scalar, Output = Self> {
    /// f32 or f64.
    type Scalar: Copy
        + PartialOrd
        + From<f32>
        + Add<Output = Self::Scalar>
        + Sub<Output = Self::Scalar>
        + Mul<Output = Self::Scalar>
        + Div<Output = Self::Scalar>;

    /// The point `high` + `low` relative to `foot`.
    fn from_foot(high: Vec2, low: Vec2, foot: Vec2) -> Self;
    /// x·other.y − y·other.x.
    fn perp_dot(self, other: Self) -> f32;
    /// h.x·x + h.y·y + h.z.
    fn form(self, h: Vec3) -> Self::Scalar;
    /// To f32.
    fn round(self) -> Vec2;
}

impl PlanePoint for Vec2 {
    type Scalar = f32;

    #[inline(always)]
    fn from_foot(high: Vec2, _low: Vec2, foot: Vec2) -> Self {
        high - foot
    }

    #[inline(always)]
    fn perp_dot(self, other: Self) -> f32 {
        Self::perp_dot(self, other)
    }

    #[inline(always)]
    fn form(self, h: Vec3) -> f32 {
        h.x * self.x + h.y * self.y + h.z
    }

    #[inline(always)]
    fn round(self) -> Vec2 {
        self
    }
}

impl PlanePoint for DVec2 {
    type Scalar = f64;

    #[inline(always)]
    fn from_foot(high: Vec2, low: Vec2, foot: Vec2) -> Self {
        (high.as_dvec2() + low.as_dvec2()) - foot.as_dvec2()
    }

    #[inline(always)]
    fn perp_dot(self, other: Self) -> f32 {
        Self::perp_dot(self, other) as f32
    }

    #[inline(always)]
    fn form(self, h: Vec3) -> f64 {
        let h = h.as_dvec3();
        h.x * self.x + h.y * self.y + h.z
    }

    #[inline(always)]
    fn round(self) -> Vec2 {
        self.as_vec2()
    }
}

impl CosineMap {
    /// The map from the images `c` of the light-space x axis, y axis and origin, and the tree's square (its
    /// centre and half-width in light space). A common positive factor of `c` is immaterial.
    ///
    /// Formed in f64 and rounded once: where an edge runs through a narrow lobe's axis, a map formed in f32
    /// moves the integral by up to 1e-3. `None` where the point lies in the light's plane (D = 0; the sign is
    /// exact, by adaptive arithmetic), or where an image is not finite or the plane is seen as a line. A point nearer to the
    /// plane than 1e-9 of the light's half-width is taken for one that far from it.
    pub fn new(c: [DVec3; 3], center: DVec2, half: f64) -> Option<Self> {
        let largest = (c[0].abs().max(c[1].abs()) * half).max(c[2].abs()).max_element();
        if !(largest.is_finite() && largest > f64::MIN_POSITIVE) {
            return None;
        }
        // A power of two changes no digit.
        let unit = f64::from_bits((2046 - (largest.to_bits() >> 52).min(2045)) << 52);
        let coord = |v: DVec3| robust::Coord3D { x: v.x, y: v.y, z: v.z };
        let [x, y, origin] = c.map(|v| v * unit);
        let depth = -robust::orient3d(coord(x), coord(y), coord(origin), coord(DVec3::ZERO)) * half * half;
        let (c0, c1, c2) = (x * half, y * half, origin + x * center.x + y * center.y);
        let (g00, g01, g11) = (c0.dot(c0), c0.dot(c1), c1.dot(c1));
        let (h0, h1) = (-c0.dot(c2), -c1.dot(c2));
        let normal = c0.cross(c1);
        let foot = DVec2::new(h0 * g11 - h1 * g01, h1 * g00 - h0 * g01) / normal.length_squared();
        let foot = foot.clamp(DVec2::splat(-FOOT_LIMIT), DVec2::splat(FOOT_LIMIT)).as_vec2();
        if depth == 0.0 || !foot.is_finite() {
            return None;
        }
        let at = center + foot.as_dvec2() * half;
        let (mut c2, mut depth) = (origin + x * at.x + y * at.y, depth);
        let least = (TOUCHING * g00.max(g11).sqrt() * normal.length()).copysign(depth);
        if depth.abs() < least.abs() {
            c2 -= normal * ((least - depth) / normal.length_squared());
            depth = least;
        }
        Some(Self {
            foot,
            c0: c0.as_vec3(),
            c1: c1.as_vec3(),
            c2: c2.as_vec3(),
            normal: normal.as_vec3(),
            w0: c0.cross(c2).as_vec3(),
            w1: c1.cross(c2).as_vec3(),
            depth: depth as f32,
            gram: [g00 as f32, g01 as f32, g11 as f32],
        })
    }

    /// Whether the light comes so near the origin, or the lobe's footprint on it is so small, that the rounding of the
    /// light's coordinates to f32 would show.
    #[inline(always)]
    pub fn is_close(&self) -> bool {
        self.c2.length_squared() < CLOSE * CLOSE * self.gram[0].max(self.gram[2])
    }

    /// The image of a point given relative to the foot.
    #[inline(always)]
    pub fn point(&self, q: Vec2) -> Vec3 {
        self.c0 * q.x + self.c1 * q.y + self.c2
    }

    /// The heights over a plane of a point relative to the foot (see [`super::horizon::Height`]), from the
    /// plane's heights of the light-space axes and origin and the tree's square, formed in f64.
    pub fn height_form(&self, [x, y, origin]: [f64; 3], center: DVec2, half: f64) -> Vec3 {
        let at = center + self.foot.as_dvec2() * half;
        let form = DVec3::new(x * half, y * half, origin + x * at.x + y * at.y);
        (form / form.abs().max_element().max(f64::MIN_POSITIVE)).as_vec3()
    }
}
