//! What the kernel's formulas compute with: one number, or one for each of several shading points at once.
//!
//! A formula is written once, for any [`Lanes`]: with `f32` it is the scalar form, with a [`super::packet::Packet`] each
//! lane has its own shading point. Where lanes may differ a condition is a [`Mask`], and both outcomes are computed where
//! any lane needs them: with `f32` a mask is a `bool`, and `if mask.any()` the ordinary branch. No operation is fused, so a
//! lane of a packet has the bits that the scalar form has.
//!
//! What runs on packets is inlined into the code of one processor, or it is slow: no `array::map`, nothing handed to a function
//! that is not `inline(always)`.

use super::map::PlanePoint;
use core::convert::identity;
use core::fmt::Debug;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A condition for each lane.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
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
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A condition for each lane.
    type Mask: Mask;

    /// `value` in every lane, as many as `self` has.
    fn splat(self, value: f32) -> Self;
    /// Where it is greater than `other`.
    fn above(self, other: Self) -> Self::Mask;
    /// Where it is at most `other`; not where either is not a number.
    fn at_most(self, other: Self) -> Self::Mask;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The lesser.
    fn min(self, other: Self) -> Self;
    /// The greater.
    fn max(self, other: Self) -> Self;
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
    type Index: Copy + Debug;
    /// Rounding of a height over a plane, relative to the sum of its terms: 16 steps of 1, those of a light's coordinates.
    const MARGIN: f32;

    /// `high` + `low` in every lane, as far as its numbers can tell: f32 keep `high`.
    fn sum(self, high: f32, low: f64) -> Self;
    /// Its absolute value with the sign of another.
    fn copysign(self, sign: Self) -> Self;

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

/// Numbers of the set-up of a shading point: `f64`, or one for each point of a packet.
pub trait Doubles: Real + Mul<f64, Output = Self> {
    /// The same rounded to f32.
    type Narrow: Lanes<Mask = Self::Mask>;
    /// Points of space.
    type Vec3: Vector<Self>;

    /// `value` in every lane.
    fn constant(self, value: f64) -> Self;
    /// To f32.
    fn narrow(self) -> Self::Narrow;
    /// From f32.
    fn widen(narrow: Self::Narrow) -> Self;
    /// `f` of every lane where the mask holds.
    fn repair(self, mask: Self::Mask, f: impl Fn(usize) -> f64) -> Self;
    /// The value of a lane.
    fn lane(self, lane: usize) -> f64;
    /// The power of two that brings it between 1 and 2, as far as there is one.
    fn to_unit(self) -> Self;
}

/// Vectors of space.
pub trait Vector<L: Real>: Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<L, Output = Self> {
    /// From its coordinates.
    fn of(x: L, y: L, z: L) -> Self;
    /// Along x.
    fn x(self) -> L;
    /// Along y.
    fn y(self) -> L;
    /// Along z, the lobe's axis.
    fn z(self) -> L;
    /// Inner product.
    #[inline(always)]
    fn dot(self, other: Self) -> L {
        self.x() * other.x() + self.y() * other.y() + self.z() * other.z()
    }
    /// Outer product.
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        Self::of(
            self.y() * other.z() - other.y() * self.z(),
            self.z() * other.x() - other.z() * self.x(),
            self.x() * other.y() - other.x() * self.y(),
        )
    }
    /// Square of the length.
    #[inline(always)]
    fn length_squared(self) -> L {
        self.dot(self)
    }
    /// The greatest of the coordinates' absolute values.
    #[inline(always)]
    fn largest(self) -> L {
        self.x().abs().max(self.y().abs()).max(self.z().abs())
    }
    /// Of length 1, or nothing where it is nothing.
    #[inline(always)]
    fn unit_or_zero(self) -> Self {
        let square = self.length_squared();
        let factor = square.splat(1.0) / square.sqrt();
        self * L::select(square.is_positive() & factor.is_positive(), factor, square.splat(0.0))
    }
}

/// A vector of space, likewise.
#[derive(Clone, Copy, Debug)]
pub struct Triple<L>([L; 3]);

impl<L: Real> Vector<L> for Triple<L> {
    #[inline(always)]
    fn of(x: L, y: L, z: L) -> Self {
        Self([x, y, z])
    }

    #[inline(always)]
    fn x(self) -> L {
        self.0[0]
    }

    #[inline(always)]
    fn y(self) -> L {
        self.0[1]
    }

    #[inline(always)]
    fn z(self) -> L {
        self.0[2]
    }
}

impl<L: Real> Add for Triple<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::of(self.x() + other.x(), self.y() + other.y(), self.z() + other.z())
    }
}

impl<L: Real> Sub for Triple<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::of(self.x() - other.x(), self.y() - other.y(), self.z() - other.z())
    }
}

impl<L: Real> Mul<L> for Triple<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        Self::of(self.x() * factor, self.y() * factor, self.z() * factor)
    }
}

/// A point of the light's plane, of packets or of numbers that glam has no vectors of.
#[derive(Clone, Copy, Debug)]
pub struct Pair<L>([L; 2]);

impl<L: Lanes> Add for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self([self.0[0] + other.0[0], self.0[1] + other.0[1]])
    }
}

impl<L: Lanes> Sub for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self([self.0[0] - other.0[0], self.0[1] - other.0[1]])
    }
}

impl<L: Lanes> Mul<L> for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor])
    }
}

impl<L: Lanes<Vec2 = Self>> PlanePoint for Pair<L> {
    type Lanes = L;
    type Scalar = L;

    #[inline(always)]
    fn from_foot(high: Vec2, low: DVec2, foot: Self) -> Self {
        let [x, y] = foot.0;
        Self([x.sum(high.x, low.x) - x, y.sum(high.y, low.y) - y])
    }

    #[inline(always)]
    fn perp_dot(self, other: Self) -> L {
        self.x() * other.y() - self.y() * other.x()
    }

    #[inline(always)]
    fn form(self, h: L::Vec3) -> L {
        h.x() * self.x() + h.y() * self.y() + h.z()
    }

    #[inline(always)]
    fn round(self) -> Self {
        self
    }

    #[inline(always)]
    fn x(self) -> L {
        self.0[0]
    }

    #[inline(always)]
    fn y(self) -> L {
        self.0[1]
    }

    #[inline(always)]
    fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        Self([L::select(mask, yes.0[0], no.0[0]), L::select(mask, yes.0[1], no.0[1])])
    }

    #[inline(always)]
    fn of(x: L, y: L) -> Self {
        Self([x, y])
    }
}

/// A number by itself is one lane: a condition is a `bool`, and operations are those of the float in it. `$of` makes the number of
/// its float, `$float` is that.
macro_rules! one_real {
    ($Number:ident, $Float:ident, $of:expr, $float:expr) => {
        impl Real for $Number {
            type Mask = bool;

            #[inline(always)]
            fn splat(self, value: f32) -> Self {
                $of($Float::from(value))
            }

            #[inline(always)]
            fn above(self, other: Self) -> bool {
                $float(self) > $float(other)
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> bool {
                $float(self) <= $float(other)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                $of($float(self).sqrt())
            }

            #[inline(always)]
            fn abs(self) -> Self {
                $of($float(self).abs())
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                $of($float(self).min($float(other)))
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                $of($float(self).max($float(other)))
            }

            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
        }
    };
}
pub(super) use one_real;
one_real!(f32, f32, identity, identity);
one_real!(f64, f64, identity, identity);

/// Such a number among [`Lanes`], with its points, its rounding, and what of a number that is given in two parts it can hold.
macro_rules! one_lane {
    ($Number:ident, $Vec2:ty, $Vec3:ty, $margin:literal, $sum:expr, $of:expr, $float:expr) => {
        impl Lanes for $Number {
            type Vec2 = $Vec2;
            type Vec3 = $Vec3;
            type Index = u32;
            const MARGIN: f32 = $margin;

            #[inline(always)]
            fn sum(self, high: f32, low: f64) -> Self {
                $sum(high, low)
            }

            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                $of($float(self).copysign($float(sign)))
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
    };
}
pub(super) use one_lane;
one_lane!(f32, Vec2, Vec3, 2e-6, |high, _low| high, identity, identity);

impl Doubles for f64 {
    type Narrow = f32;
    type Vec3 = DVec3;

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn narrow(self) -> f32 {
        self as f32
    }

    #[inline(always)]
    fn widen(narrow: f32) -> Self {
        Self::from(narrow)
    }

    #[inline(always)]
    fn repair(self, mask: bool, f: impl Fn(usize) -> f64) -> Self {
        if mask { f(0) } else { self }
    }

    #[inline(always)]
    fn lane(self, _lane: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn to_unit(self) -> Self {
        Self::from_bits((2046 - (self.to_bits() >> 52).min(2045)) << 52)
    }
}

/// glam's vectors are vectors.
macro_rules! vector {
    ($Vector:ty, $number:ty) => {
        impl Vector<$number> for $Vector {
            #[inline(always)]
            fn of(x: $number, y: $number, z: $number) -> Self {
                Self::new(x, y, z)
            }

            #[inline(always)]
            fn x(self) -> $number {
                self.x
            }

            #[inline(always)]
            fn y(self) -> $number {
                self.y
            }

            #[inline(always)]
            fn z(self) -> $number {
                self.z
            }
        }
    };
}
vector!(Vec3, f32);
vector!(DVec3, f64);
