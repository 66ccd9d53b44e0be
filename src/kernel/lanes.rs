//! What the kernel's formulas compute with: one number, or one for each of several shading points at once.
//!
//! A formula is written once, for any [`Lanes`]: with `f32` it is the scalar form, with a [`super::packet::Packet`] each
//! lane has its own shading point. Where lanes may differ a condition is a [`Mask`], and both outcomes are computed where
//! any lane needs them: with `f32` a mask is a `bool`, and `if mask.any()` the ordinary branch. No operation is fused, so a
//! lane of a packet has the bits that the scalar form has.

use super::map::PlanePoint;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use glam::{Vec2, Vec3};

/// A condition for each lane.
pub trait Mask:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
{
    /// Whether it holds in some lane.
    fn any(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

/// Real numbers: `f32`, `f64`, or one for each lane.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A condition for each lane.
    type Mask: Mask;

    /// `value` in every lane, as many as `self` has.
    fn splat(self, value: f32) -> Self;
    /// Where it is greater than `other`.
    fn above(self, other: Self) -> Self::Mask;
    /// `yes` where the mask holds, elsewhere `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Where it is positive.
    #[inline(always)]
    fn is_positive(self) -> Self::Mask {
        self.above(self.splat(0.0))
    }
}

/// Numbers of the kernel: `f32`, or one for each shading point of a packet.
pub trait Lanes: Real + Add<f32, Output = Self> + Sub<f32, Output = Self> + Mul<f32, Output = Self> {
    /// Points of the light's plane.
    type Vec2: PlanePoint<Lanes = Self, Scalar = Self>;
    /// Points of cosine space.
    type Vec3: Vector<Self>;
    /// Counts and indices.
    type Index: Copy;

    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The lesser.
    fn min(self, other: Self) -> Self;
    /// The greater.
    fn max(self, other: Self) -> Self;
    /// Its absolute value with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// Where it is at most `other`; not where either is not a number.
    fn at_most(self, other: Self) -> Self::Mask;

    /// The condition in every lane.
    fn mask(self, value: bool) -> Self::Mask;
    /// The index in every lane.
    fn index(self, value: u32) -> Self::Index;
    /// Where the index is at most `value`.
    fn reached(index: Self::Index, value: u32) -> Self::Mask;
    /// `yes` where the mask holds, elsewhere `no`.
    fn select_index(mask: Self::Mask, yes: Self::Index, no: Self::Index) -> Self::Index;
    /// One more where the mask holds.
    fn count(index: Self::Index, mask: Self::Mask) -> Self::Index;

    /// Between `low` and `high`.
    #[inline(always)]
    fn between(self, low: f32, high: f32) -> Self {
        self.max(self.splat(low)).min(self.splat(high))
    }
}

/// Vectors of cosine space.
pub trait Vector<L>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<L, Output = Self> {
    /// Along x.
    fn x(self) -> L;
    /// Along y.
    fn y(self) -> L;
    /// Along z, the lobe's axis.
    fn z(self) -> L;
    /// Inner product.
    fn dot(self, other: Self) -> L;
    /// Square of the length.
    #[inline(always)]
    fn length_squared(self) -> L {
        self.dot(self)
    }
}

impl Real for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

impl Real for f64 {
    type Mask = bool;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Self::from(value)
    }

    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

impl Lanes for f32 {
    type Vec2 = Vec2;
    type Vec3 = Vec3;
    type Index = u32;

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.copysign(sign)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn mask(self, value: bool) -> bool {
        value
    }

    #[inline(always)]
    fn index(self, value: u32) -> u32 {
        value
    }

    #[inline(always)]
    fn reached(index: u32, value: u32) -> bool {
        index <= value
    }

    #[inline(always)]
    fn select_index(mask: bool, yes: u32, no: u32) -> u32 {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn count(index: u32, mask: bool) -> u32 {
        index + u32::from(mask)
    }
}

impl Vector<f32> for Vec3 {
    #[inline(always)]
    fn x(self) -> f32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32 {
        self.y
    }

    #[inline(always)]
    fn z(self) -> f32 {
        self.z
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f32 {
        self.dot(other)
    }
}
