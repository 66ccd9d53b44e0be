//! Packets: one shading point in each lane. This file alone names fearless_simd, which finds at run time what the processor
//! has (SSE2, SSE4.2, AVX2, AVX-512, NEON; scalar code elsewhere).

use super::horizon::{Height, Horizon};
use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use fearless_simd::prelude::*;
pub use fearless_simd::Simd;
use fearless_simd::{Level, dispatch};
use glam::{Vec2, Vec3};

/// Most lanes of any processor.
pub const MAX_LANES: usize = 16;

/// What the processor can do at once.
#[derive(Clone, Copy, Debug)]
pub struct Processor(Level);

/// Something to compute with packets, on whatever processor.
pub trait Task {
    /// What comes out.
    type Output;
    /// Computes it; `like` has as many lanes as the processor has.
    fn run<S: Simd>(self, like: Packet<S>) -> Self::Output;
}

impl Default for Processor {
    fn default() -> Self {
        Self(Level::new())
    }
}

impl Processor {
    /// Lanes of a packet, at most [`MAX_LANES`].
    pub fn lanes(self) -> usize {
        struct Width;
        impl Task for Width {
            type Output = usize;
            #[inline(always)]
            fn run<S: Simd>(self, _like: Packet<S>) -> usize {
                S::f32s::LEN
            }
        }
        self.run(Width)
    }

    /// Runs a task with the packets of this processor.
    pub fn run<T: Task>(self, task: T) -> T::Output {
        dispatch!(self.0, simd => task.run(Packet::zero(simd)))
    }
}

/// An f32 for each shading point.
#[derive(Clone, Copy, Debug)]
pub struct Packet<S: Simd>(S::f32s);

/// A condition for each shading point.
#[derive(Clone, Copy)]
pub struct PacketMask<S: Simd>(<S::f32s as SimdBase<S>>::Mask);

/// A count or index for each shading point.
#[derive(Clone, Copy)]
pub struct PacketIndex<S: Simd>(S::u32s);

/// A point of the light's plane for each shading point.
#[derive(Clone, Copy, Debug)]
pub struct Packet2<S: Simd> {
    x: Packet<S>,
    y: Packet<S>,
}

/// A point of cosine space for each shading point.
#[derive(Clone, Copy, Debug)]
pub struct Packet3<S: Simd> {
    x: Packet<S>,
    y: Packet<S>,
    z: Packet<S>,
}

impl<S: Simd> Packet<S> {
    #[inline(always)]
    fn zero(simd: S) -> Self {
        Self(SimdBase::splat(simd, 0.0))
    }

    /// From the value of each lane.
    #[inline(always)]
    pub fn gather(self, lane: impl FnMut(usize) -> f32) -> Self {
        Self(S::f32s::from_fn(self.0.token(), lane))
    }

    /// From the vector of each lane.
    #[inline(always)]
    pub fn gather_vector(self, lane: impl Fn(usize) -> Vec3) -> Packet3<S> {
        let axis = |axis: usize| self.gather(|i| lane(i)[axis]);
        Packet3::new(axis(0), axis(1), axis(2))
    }

    /// The value of a lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> f32 {
        self.0.as_slice()[lane]
    }

    /// Lanes.
    #[inline(always)]
    pub fn width(self) -> usize {
        S::f32s::LEN
    }

    /// A mask of the first `count` lanes.
    #[inline(always)]
    pub fn first(self, count: usize) -> PacketMask<S> {
        self.gather(|lane| if lane < count { 1.0 } else { 0.0 }).is_positive()
    }
}

impl<S: Simd> PacketIndex<S> {
    /// The value of a lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> u32 {
        self.0.as_slice()[lane]
    }
}

impl<S: Simd> Packet2<S> {
    /// From its coordinates.
    #[inline(always)]
    pub const fn new(x: Packet<S>, y: Packet<S>) -> Self {
        Self { x, y }
    }
}

impl<S: Simd> Packet3<S> {
    /// From its coordinates.
    #[inline(always)]
    pub const fn new(x: Packet<S>, y: Packet<S>, z: Packet<S>) -> Self {
        Self { x, y, z }
    }
}

impl<S: Simd> CosineMap<Packet<S>> {
    /// The maps of the lanes.
    #[inline(always)]
    pub fn gather<'a>(like: Packet<S>, map: impl Fn(usize) -> &'a CosineMap) -> Self {
        let vector = |of: fn(&CosineMap) -> Vec3| like.gather_vector(|lane| of(map(lane)));
        let foot = |axis: usize| like.gather(|lane| map(lane).foot[axis]);
        let gram = |entry: usize| like.gather(|lane| map(lane).gram[entry]);
        Self {
            foot: Packet2::new(foot(0), foot(1)),
            c0: vector(|m| m.c0),
            c1: vector(|m| m.c1),
            c2: vector(|m| m.c2),
            normal: vector(|m| m.normal),
            w0: vector(|m| m.w0),
            w1: vector(|m| m.w1),
            depth: like.gather(|lane| map(lane).depth),
            gram: [gram(0), gram(1), gram(2)],
        }
    }
}

impl<S: Simd> Horizon<Packet<S>> {
    /// The planes of the lanes.
    #[inline(always)]
    pub fn gather<'a>(like: Packet<S>, plane: impl Fn(usize) -> &'a Horizon) -> Self {
        Self {
            height: Height {
                form: like.gather_vector(|lane| plane(lane).height.form),
                margin: like.gather(|lane| plane(lane).height.margin),
            },
            along: like.gather_vector(|lane| plane(lane).along),
            distance: like.gather(|lane| plane(lane).distance),
            slope: like.gather(|lane| plane(lane).slope),
            range: [like.gather(|lane| plane(lane).range[0]), like.gather(|lane| plane(lane).range[1])],
        }
    }
}

/// An operator of two packets, and of a packet and a number.
macro_rules! operator {
    ($Operator:ident, $operate:ident) => {
        impl<S: Simd> $Operator for Packet<S> {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: Self) -> Self {
                Self(self.0.$operate(other.0))
            }
        }
        impl<S: Simd> $Operator<f32> for Packet<S> {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: f32) -> Self {
                Self(self.0.$operate(other))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<S: Simd> Neg for Packet<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

/// An operator of two masks.
macro_rules! mask_operator {
    ($Operator:ident, $operate:ident) => {
        impl<S: Simd> $Operator for PacketMask<S> {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: Self) -> Self {
                Self(self.0.$operate(other.0))
            }
        }
    };
}
mask_operator!(BitAnd, bitand);
mask_operator!(BitOr, bitor);
mask_operator!(BitXor, bitxor);

impl<S: Simd> Not for PacketMask<S> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl<S: Simd> Mask for PacketMask<S> {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.any_true()
    }
}

impl<S: Simd> Real for Packet<S> {
    type Mask = PacketMask<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Self(SimdBase::splat(self.0.token(), value))
    }

    #[inline(always)]
    fn above(self, other: Self) -> PacketMask<S> {
        PacketMask(self.0.simd_gt(other.0))
    }

    #[inline(always)]
    fn select(mask: PacketMask<S>, yes: Self, no: Self) -> Self {
        Self(mask.0.select(yes.0, no.0))
    }
}

impl<S: Simd> Lanes for Packet<S> {
    type Vec2 = Packet2<S>;
    type Vec3 = Packet3<S>;
    type Index = PacketIndex<S>;

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
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> PacketMask<S> {
        PacketMask(self.0.simd_le(other.0))
    }

    #[inline(always)]
    fn mask(self, value: bool) -> PacketMask<S> {
        PacketMask(SimdMask::splat(self.0.token(), value))
    }

    #[inline(always)]
    fn index(self, value: u32) -> PacketIndex<S> {
        PacketIndex(SimdBase::splat(self.0.token(), value))
    }

    #[inline(always)]
    fn reached(index: PacketIndex<S>, value: u32) -> PacketMask<S> {
        PacketMask(index.0.simd_le(value))
    }

    #[inline(always)]
    fn select_index(mask: PacketMask<S>, yes: PacketIndex<S>, no: PacketIndex<S>) -> PacketIndex<S> {
        PacketIndex(mask.0.select(yes.0, no.0))
    }

    #[inline(always)]
    fn count(index: PacketIndex<S>, mask: PacketMask<S>) -> PacketIndex<S> {
        PacketIndex(mask.0.select(index.0 + 1, index.0))
    }
}

impl<S: Simd> Add for Packet2<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl<S: Simd> Sub for Packet2<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl<S: Simd> Mul<Packet<S>> for Packet2<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Packet<S>) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

impl<S: Simd> PlanePoint for Packet2<S> {
    type Lanes = Packet<S>;
    type Scalar = Packet<S>;

    #[inline(always)]
    fn from_foot(high: Vec2, _low: Vec2, foot: Self) -> Self {
        Self::new(foot.x.splat(high.x) - foot.x, foot.y.splat(high.y) - foot.y)
    }

    #[inline(always)]
    fn perp_dot(self, other: Self) -> Packet<S> {
        self.x * other.y - self.y * other.x
    }

    #[inline(always)]
    fn form(self, h: Packet3<S>) -> Packet<S> {
        h.x * self.x + h.y * self.y + h.z
    }

    #[inline(always)]
    fn round(self) -> Self {
        self
    }

    #[inline(always)]
    fn x(self) -> Packet<S> {
        self.x
    }

    #[inline(always)]
    fn y(self) -> Packet<S> {
        self.y
    }

    #[inline(always)]
    fn select(mask: PacketMask<S>, yes: Self, no: Self) -> Self {
        Self::new(Real::select(mask, yes.x, no.x), Real::select(mask, yes.y, no.y))
    }

    #[inline(always)]
    fn of(x: Packet<S>, y: Packet<S>) -> Self {
        Self::new(x, y)
    }
}

impl<S: Simd> Add for Packet3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<S: Simd> Sub for Packet3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<S: Simd> Mul<Packet<S>> for Packet3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Packet<S>) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<S: Simd> Vector<Packet<S>> for Packet3<S> {
    #[inline(always)]
    fn x(self) -> Packet<S> {
        self.x
    }

    #[inline(always)]
    fn y(self) -> Packet<S> {
        self.y
    }

    #[inline(always)]
    fn z(self) -> Packet<S> {
        self.z
    }

    #[inline(always)]
    fn dot(self, other: Self) -> Packet<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
}
