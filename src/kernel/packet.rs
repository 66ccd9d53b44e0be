//! Packets: one shading point in each lane. This file alone names fearless_simd, which finds at run time what the processor
//! has (SSE2, SSE4.2, AVX2, AVX-512, NEON; scalar code elsewhere).

use super::lanes::{Doubles, Lanes, Mask, Pair, Real, Triple};
use core::fmt;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
pub use fearless_simd::Simd;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};

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

/// What it is called, and how many lanes its packets have: `AVX2, 8 lanes`.
impl fmt::Display for Processor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} lanes", self.name(), self.lanes())
    }
}

impl Processor {
    /// What this one can do, and what lesser ones of its kind can, the least first: the last is the default.
    pub fn all() -> Vec<Self> {
        let most = Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let lesser = [
            most.as_sse2().map(Level::Sse2),
            most.as_sse4_2().map(Level::Sse4_2),
            most.as_avx2().map(Level::Avx2),
            most.as_avx512().map(Level::Avx512),
        ];
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let lesser = [Some(most)];
        lesser.into_iter().flatten().map(Self).collect()
    }

    /// The instructions of its packets.
    pub const fn name(self) -> &'static str {
        match self.0 {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx512(_) => "AVX-512",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx2(_) => "AVX2",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse4_2(_) => "SSE4.2",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse2(_) => "SSE2",
            #[cfg(target_arch = "aarch64")]
            Level::Neon(_) => "NEON",
            _ => "no SIMD",
        }
    }

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

impl<S: Simd> fmt::Debug for PacketMask<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:b}", self.bits())
    }
}

/// A count or index for each shading point.
#[derive(Clone, Copy, Debug)]
pub struct PacketIndex<S: Simd>(S::u32s);

/// A point of the light's plane for each shading point.
pub type Packet2<S> = Pair<Packet<S>>;

/// A point of cosine space for each shading point.
pub type Packet3<S> = Triple<Packet<S>>;

/// An f64 for each shading point, in two halves.
#[derive(Clone, Copy, Debug)]
pub struct DoublePacket<S: Simd>([S::f64s; 2]);

impl<S: Simd> Packet<S> {
    #[inline(always)]
    fn zero(simd: S) -> Self {
        Self(SimdBase::splat(simd, 0.0))
    }

    /// From the values of the lanes.
    #[inline(always)]
    pub fn load(self, values: &[f32; MAX_LANES]) -> Self {
        Self(S::f32s::from_slice(self.0.token(), &values[..S::f32s::LEN]))
    }

    /// To the values of the lanes.
    #[inline(always)]
    pub fn store(self, values: &mut [f32; MAX_LANES]) {
        self.0.store_slice(&mut values[..S::f32s::LEN]);
    }
}

impl<S: Simd> PacketMask<S> {
    /// From the bits of the lanes, that of the first the lowest.
    #[inline(always)]
    pub fn load(like: Packet<S>, bits: u32) -> Self {
        Self(SimdMask::from_bitmask(like.0.token(), u64::from(bits)))
    }

    /// The bits of the lanes.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0.to_bitmask() as u32
    }
}

impl<S: Simd> PacketIndex<S> {
    /// To the values of the lanes.
    #[inline(always)]
    pub fn store(self, values: &mut [u32; MAX_LANES]) {
        self.0.store_slice(&mut values[..S::u32s::LEN]);
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
    fn at_most(self, other: Self) -> PacketMask<S> {
        PacketMask(self.0.simd_le(other.0))
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
    const MARGIN: f32 = f32::MARGIN;

    #[inline(always)]
    fn sum(self, high: f32, _low: f64) -> Self {
        self.splat(high)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0))
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

impl<S: Simd> DoublePacket<S> {
    /// From the values of the lanes; `like` tells how many.
    #[inline(always)]
    pub fn load(like: Packet<S>, values: &[f64; MAX_LANES]) -> Self {
        let half = S::f64s::LEN;
        let simd = like.0.token();
        Self([S::f64s::from_slice(simd, &values[..half]), S::f64s::from_slice(simd, &values[half..2 * half])])
    }

    /// The same number in every lane.
    #[inline(always)]
    pub fn all(like: Packet<S>, value: f64) -> Self {
        Self([SimdBase::splat(like.0.token(), value); 2])
    }
}

/// An operator of two packets of doubles.
macro_rules! double_operator {
    ($Operator:ident, $operate:ident) => {
        impl<S: Simd> $Operator for DoublePacket<S> {
            type Output = Self;
            #[inline(always)]
            fn $operate(self, other: Self) -> Self {
                Self([self.0[0].$operate(other.0[0]), self.0[1].$operate(other.0[1])])
            }
        }
    };
}
double_operator!(Add, add);
double_operator!(Sub, sub);
double_operator!(Mul, mul);
double_operator!(Div, div);

impl<S: Simd> Mul<f64> for DoublePacket<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor])
    }
}

impl<S: Simd> Neg for DoublePacket<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1]])
    }
}

impl<S: Simd> Real for DoublePacket<S> {
    type Mask = PacketMask<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        self.constant(f64::from(value))
    }

    #[inline(always)]
    fn above(self, other: Self) -> PacketMask<S> {
        PacketMask(self.0[0].simd_gt(other.0[0]).narrow(self.0[1].simd_gt(other.0[1])))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> PacketMask<S> {
        PacketMask(self.0[0].simd_le(other.0[0]).narrow(self.0[1].simd_le(other.0[1])))
    }

    #[inline(always)]
    fn select(mask: PacketMask<S>, yes: Self, no: Self) -> Self {
        let (low, high) = mask.0.widen();
        Self([low.select(yes.0[0], no.0[0]), high.select(yes.0[1], no.0[1])])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([self.0[0].sqrt(), self.0[1].sqrt()])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self([self.0[0].abs(), self.0[1].abs()])
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].min(other.0[1])])
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self([self.0[0].max(other.0[0]), self.0[1].max(other.0[1])])
    }
}

impl<S: Simd> Doubles for DoublePacket<S> {
    type Narrow = Packet<S>;
    type Vec3 = Triple<Self>;

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self([SimdBase::splat(self.0[0].token(), value); 2])
    }

    #[inline(always)]
    fn narrow(self) -> Packet<S> {
        Packet(self.0[0].narrow(self.0[1]))
    }

    #[inline(always)]
    fn widen(narrow: Packet<S>) -> Self {
        let (low, high) = narrow.0.widen();
        Self([low, high])
    }

    #[inline(always)]
    fn repair(self, mask: PacketMask<S>, f: impl Fn(usize) -> f64) -> Self {
        if !mask.any() {
            return self;
        }
        let half = S::f64s::LEN;
        let simd = self.0[0].token();
        let one = |lane: usize| if mask.0.test(lane) { f(lane) } else { self.lane(lane) };
        Self([S::f64s::from_fn(simd, one), S::f64s::from_fn(simd, |lane| one(lane + half))])
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        let half = S::f64s::LEN;
        self.0[lane / half].as_slice()[lane % half]
    }

    #[inline(always)]
    fn to_unit(self) -> Self {
        let simd = self.0[0].token();
        let all = |bits: u64| -> S::u64s { SimdBase::splat(simd, bits) };
        let unit = |half: S::f64s| -> S::f64s {
            let exponent = half.bitcast::<S::u64s>() & all(0x7ff << 52);
            (all(2046 << 52) - exponent.min(all(2045 << 52))).bitcast()
        };
        Self([unit(self.0[0]), unit(self.0[1])])
    }
}
