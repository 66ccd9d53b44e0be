//! The kernel in f64, one shading point at a time: for points so close to a light, or lobes so narrow, that f32 would show
//! ([`super::map::CosineMap::is_close`]). The formulas are those of the modules beside it. The shaders
//! have pairs of f32 instead: `shaders/wide.wgsl`.

use super::lanes::{Doubles, Lanes, Pair, Real, Triple, one_lane, one_real};
use super::tree::Budget;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// An f64 that the kernel computes with.
#[derive(Clone, Copy, Debug)]
pub struct Wide(pub f64);

impl From<f32> for Wide {
    fn from(value: f32) -> Self {
        Self(f64::from(value))
    }
}

impl From<Budget> for Budget<Wide> {
    fn from(Budget { left }: Budget) -> Self {
        Self { left: left.into() }
    }
}

impl From<Budget<Wide>> for Budget {
    fn from(Budget { left }: Budget<Wide>) -> Self {
        Self { left: left.0 as f32 }
    }
}

impl Wide {
    #[inline(always)]
    const fn float(self) -> f64 {
        self.0
    }
}

/// A point of the light's plane.
pub type Wide2 = Pair<Wide>;

/// A point of cosine space.
pub type Wide3 = Triple<Wide>;

/// An operator of two numbers of any width.
macro_rules! operator {
    ($Operator:ident, $operate:ident) => {
        impl $Operator for Wide {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: Self) -> Self {
                Self(self.0.$operate(other.0))
            }
        }
        impl $Operator<f32> for Wide {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: f32) -> Self {
                Self(self.0.$operate(f64::from(other)))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Mul<f64> for Wide {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self(self.0 * other)
    }
}

impl Neg for Wide {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

one_real!(Wide, f64, Wide, Wide::float);
one_lane!(Wide, Wide2, Wide3, 4e-15, |high, low| Self(f64::from(high) + low), Wide, Wide::float);

/// Nothing is rounded after the set-up.
impl Doubles for Wide {
    type Narrow = Self;
    type Vec3 = Wide3;

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self(value)
    }

    #[inline(always)]
    fn narrow(self) -> Self {
        self
    }

    #[inline(always)]
    fn widen(narrow: Self) -> Self {
        narrow
    }

    #[inline(always)]
    fn repair(self, mask: bool, f: impl Fn(usize) -> f64) -> Self {
        Self(self.0.repair(mask, f))
    }

    #[inline(always)]
    fn lane(self, _lane: usize) -> f64 {
        self.0
    }

    #[inline(always)]
    fn to_unit(self) -> Self {
        Self(self.0.to_unit())
    }
}
