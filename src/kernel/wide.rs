//! The kernel in f64, one shading point at a time: for points so close to a light, or lobes so narrow, that f32 would show
//! ([`super::map::CosineMap::is_close`]). The formulas are those of the modules beside it. The shaders
//! have pairs of f32 instead: `shaders/wide.wgsl`.

use super::lanes::{Doubles, Lanes, Real, Triple, Vector};
use super::map::PlanePoint;
use super::tree::Budget;
use core::ops::{Add, Div, Mul, Neg, Sub};
use glam::{DVec2, Vec2};

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

/// A point of the light's plane.
#[derive(Clone, Copy, Debug)]
pub struct Wide2 {
    x: Wide,
    y: Wide,
}

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

impl Real for Wide {
    type Mask = bool;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Self(f64::from(value))
    }

    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self.0 > other.0
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self.0 <= other.0
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

impl Lanes for Wide {
    type Vec2 = Wide2;
    type Vec3 = Wide3;
    type Index = u32;
    const MARGIN: f32 = 4e-15;

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0))
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

impl Add for Wide2 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y }
    }
}

impl Sub for Wide2 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }
}

impl Mul<Wide> for Wide2 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Wide) -> Self {
        Self { x: self.x * factor, y: self.y * factor }
    }
}

impl PlanePoint for Wide2 {
    type Lanes = Wide;
    type Scalar = Wide;

    #[inline(always)]
    fn from_foot(high: Vec2, low: DVec2, foot: Self) -> Self {
        let point = high.as_dvec2() + low;
        Self { x: Wide(point.x) - foot.x, y: Wide(point.y) - foot.y }
    }

    #[inline(always)]
    fn perp_dot(self, other: Self) -> Wide {
        self.x * other.y - self.y * other.x
    }

    #[inline(always)]
    fn form(self, h: Wide3) -> Wide {
        h.x() * self.x + h.y() * self.y + h.z()
    }

    #[inline(always)]
    fn round(self) -> Self {
        self
    }

    #[inline(always)]
    fn x(self) -> Wide {
        self.x
    }

    #[inline(always)]
    fn y(self) -> Wide {
        self.y
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn of(x: Wide, y: Wide) -> Self {
        Self { x, y }
    }
}
