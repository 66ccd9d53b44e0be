//! The affine map from a light's plane to cosine space. Twin: `shaders/map.wgsl`.

use super::lanes::{Doubles, Lanes, Real, Vector};
use core::fmt::Debug;
use core::ops::{Add, Mul, Sub};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// How far outside the tree's square \[−1, 1\]² the origin of the map may lie.
pub const FOOT_LIMIT: f64 = 1.5;
/// Distance from the light's plane over its half-width, in cosine space, below which coordinates need their low
/// parts: rounding by 2⁻²⁵ turns an edge by 2⁻²⁵/CLOSE of a radian.
const CLOSE: f32 = 1.0 / 256.0;

/// The map p = c0·(x − foot.x) + c1·(y − foot.y) + c2 from tree space to cosine space, at one shading point.
///
/// Tree space is light space moved and scaled into \[−1, 1\]². `foot` is the plane's point nearest the origin of
/// cosine space (kept near the light): about it nothing cancels, so p has the full relative precision of f32
/// however near the light is, and products of edges come from light-space differences.
#[derive(Clone, Copy, Debug)]
pub struct CosineMap<L: Lanes = f32> {
    /// Tree-space point that `c2` belongs to.
    pub foot: L::Vec2,
    /// Image of the x axis.
    pub c0: L::Vec3,
    /// Image of the y axis.
    pub c1: L::Vec3,
    /// Image of `foot`.
    pub c2: L::Vec3,
    /// N' = c0 × c1.
    pub normal: L::Vec3,
    /// c0 × c2.
    pub w0: L::Vec3,
    /// c1 × c2.
    pub w1: L::Vec3,
    /// D = −N'·c2: positive in front of the light.
    pub depth: L,
    /// c0·c0, c0·c1, c1·c1.
    pub gram: [L; 3],
}

/// A point of the light's plane relative to the map's foot: [`Vec2`], the same in f64 where the light is close
/// ([`CosineMap::is_close`]), or one for each lane. The formulas are the same.
pub trait PlanePoint:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Self::Scalar, Output = Self>
{
    /// Numbers of the map.
    type Lanes: Lanes;
    /// Coordinates: f32, f64 or one for each lane.
    type Scalar: Real<Mask = <Self::Lanes as Real>::Mask>;

    /// The point `high` + `low` relative to `foot`.
    fn from_foot(high: Vec2, low: DVec2, foot: <Self::Lanes as Lanes>::Vec2) -> Self;
    /// x·other.y − y·other.x.
    fn perp_dot(self, other: Self) -> Self::Lanes;
    /// h.x·x + h.y·y + h.z.
    fn form(self, h: <Self::Lanes as Lanes>::Vec3) -> Self::Scalar;
    /// To f32.
    fn round(self) -> <Self::Lanes as Lanes>::Vec2;
    /// The first coordinate.
    fn x(self) -> Self::Scalar;
    /// The second coordinate.
    fn y(self) -> Self::Scalar;
    /// `yes` where the mask holds, elsewhere `no`.
    fn select(mask: <Self::Lanes as Real>::Mask, yes: Self, no: Self) -> Self;
    /// From its coordinates.
    fn of(x: Self::Scalar, y: Self::Scalar) -> Self;
    /// `point` in every lane.
    #[inline(always)]
    fn fixed(self, point: Vec2) -> Self {
        Self::of(self.x().splat(point.x), self.y().splat(point.y))
    }
}

impl PlanePoint for Vec2 {
    type Lanes = f32;
    type Scalar = f32;

    #[inline(always)]
    fn from_foot(high: Vec2, _low: DVec2, foot: Vec2) -> Self {
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

    #[inline(always)]
    fn x(self) -> f32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32 {
        self.y
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn of(x: f32, y: f32) -> Self {
        Self::new(x, y)
    }
}

impl<L: Lanes> CosineMap<L> {
    /// The image of a point given relative to the foot.
    #[inline(always)]
    pub fn point(&self, q: L::Vec2) -> L::Vec3 {
        self.c0 * q.x() + self.c1 * q.y() + self.c2
    }
}

impl CosineMap {
    /// [`Self::of`] at one point; `None` where there is no map.
    pub fn new(c: [DVec3; 3], center: DVec2, half: f64) -> Option<Self> {
        let (map, is_map) = Self::of::<f64>(c, center, half);
        is_map.then_some(map)
    }
}

impl<L: Lanes> CosineMap<L> {
    /// The map from the images `c` of the light-space x axis, y axis and origin, and the tree's square (its
    /// centre and half-width in light space). A common positive factor of `c` is immaterial.
    ///
    /// Formed in f64 and rounded once: where an edge runs through a narrow lobe's axis, a map formed in f32
    /// moves the integral by up to 1e-3. There is none where the point lies in the light's plane (D = 0; the sign is
    /// exact, by adaptive arithmetic), or where an image is not finite or the plane is seen as a line.
    #[inline(always)]
    pub fn of<D: Doubles<Narrow = L, Mask = L::Mask>>(c: [D::Vec3; 3], center: DVec2, half: f64) -> (Self, L::Mask) {
        let [x, y, origin] = c;
        let constant = |value: f64| x.x().constant(value);
        let largest = (x.largest().max(y.largest()) * half).max(origin.largest());
        let ordinary = largest.above(constant(f64::MIN_POSITIVE)) & largest.at_most(constant(f64::MAX));
        // A power of two changes no digit.
        let unit = largest.to_unit();
        let (x, y, origin) = (x * unit, y * unit, origin * unit);
        let depth = -triple_product::<D>(x, y, origin) * half * half;
        let (c0, c1) = (x * constant(half), y * constant(half));
        let c2 = origin + x * constant(center.x) + y * constant(center.y);
        let (g00, g01, g11) = (c0.dot(c0), c0.dot(c1), c1.dot(c1));
        let (h0, h1) = (-c0.dot(c2), -c1.dot(c2));
        let normal = c0.cross(c1);
        let square = normal.length_squared();
        let foot = [(h0 * g11 - h1 * g01) / square, (h1 * g00 - h0 * g01) / square];
        let number = |v: D| v.at_most(constant(f64::INFINITY));
        let is_map = ordinary & depth.abs().is_positive() & number(foot[0]) & number(foot[1]);
        let near = |v: D| v.max(constant(-FOOT_LIMIT)).min(constant(FOOT_LIMIT)).narrow();
        let (foot_x, foot_y) = (near(foot[0]), near(foot[1]));
        let at = [D::widen(foot_x) * half + constant(center.x), D::widen(foot_y) * half + constant(center.y)];
        // Across the plane the foot's image is what D says: near contact the sum for it cancels, and D has all its digits.
        let c2 = origin + x * at[0] + y * at[1];
        let c2 = c2 - normal * ((depth + normal.dot(c2)) / square);
        let map = Self {
            foot: PlanePoint::of(foot_x, foot_y),
            c0: narrow::<D>(c0),
            c1: narrow::<D>(c1),
            c2: narrow::<D>(c2),
            normal: narrow::<D>(normal),
            w0: narrow::<D>(c0.cross(c2)),
            w1: narrow::<D>(c1.cross(c2)),
            depth: depth.narrow(),
            gram: [g00.narrow(), g01.narrow(), g11.narrow()],
        };
        (map, is_map)
    }

    /// Whether the light comes so near the origin, or the lobe's footprint on it is so small, that the rounding of the
    /// light's coordinates to f32 would show.
    #[inline(always)]
    pub fn is_close(&self) -> L::Mask {
        // By the distance of the whole plane, D/|N'|: in a stretched space the foot, once it is kept near the light, may be far.
        let reach = self.gram[0].max(self.gram[2]) * (CLOSE * CLOSE) * self.normal.length_squared();
        reach.above(self.depth * self.depth)
    }

    /// The heights over a plane of a point relative to the foot (see [`super::horizon::Height`]), from the
    /// plane's heights of the light-space axes and origin and the tree's square, formed in f64.
    #[inline(always)]
    pub fn height_form<D: Doubles<Narrow = L, Mask = L::Mask>>(
        &self,
        [x, y, origin]: [D; 3],
        center: DVec2,
        half: f64,
    ) -> L::Vec3 {
        let at = |foot: L, center: f64| D::widen(foot) * half + x.constant(center);
        let at = [at(self.foot.x(), center.x), at(self.foot.y(), center.y)];
        let form: D::Vec3 = Vector::of(x * half, y * half, origin + x * at[0] + y * at[1]);
        let largest = form.largest().max(x.constant(f64::MIN_POSITIVE));
        narrow::<D>(form * (x.constant(1.0) / largest))
    }
}

/// A vector to f32.
#[inline(always)]
fn narrow<D: Doubles>(v: D::Vec3) -> <D::Narrow as Lanes>::Vec3 {
    Vector::of(v.x().narrow(), v.y().narrow(), v.z().narrow())
}

/// a·(b × c), its sign exact (Shewchuk 1997).
#[inline(always)]
fn triple_product<D: Doubles>(a: D::Vec3, b: D::Vec3, c: D::Vec3) -> D {
    /// Relative to the sum of the products' absolute values: (7 + 56ε)ε, ε half a step of 1.
    const ERROR: f64 = 7.771_561_172_376_103e-16;
    let (bc, cb) = (b.x() * c.y(), c.x() * b.y());
    let (ca, ac) = (c.x() * a.y(), a.x() * c.y());
    let (ab, ba) = (a.x() * b.y(), b.x() * a.y());
    let product = a.z() * (bc - cb) + b.z() * (ca - ac) + c.z() * (ab - ba);
    let sum =
        (bc.abs() + cb.abs()) * a.z().abs() + (ca.abs() + ac.abs()) * b.z().abs() + (ab.abs() + ba.abs()) * c.z().abs();
    let unsure = product.abs().at_most(sum * ERROR);
    let lane = |lane: usize| {
        let at = |v: D::Vec3| robust::Coord3D { x: v.x().lane(lane), y: v.y().lane(lane), z: v.z().lane(lane) };
        robust::orient3d(at(a), at(b), at(c), robust::Coord3D { x: 0.0, y: 0.0, z: 0.0 })
    };
    product.repair(unsure, lane)
}
