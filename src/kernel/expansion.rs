//! Taylor's expansion of the kernel over a region far from the shading point, and how far it is off. Twin:
//! `shaders/expansion.wgsl`.
//!
//! About the middle c of the region's box the kernel k = D·z / (π·|p|⁴) is, with δ the offset in cosine space over |c|,
//!
//! ```text
//! k = D/(π·|c|³) · (ẑ + δz) · (1 + 2B + G)⁻²,    B = δ·ĉ,    G = |δ|²
//!   = D/(π·|c|³) · (ẑ + δz) · (1 − 4B + (12B² − 2G) + B·(12G − 32B²) + ...)
//! ```
//!
//! The term of nth order is ẑ·rⁿ·Cₙ(−B/r) + δz·rⁿ⁻¹·Cₙ₋₁(−B/r) with r = |δ| and Gegenbauer's Cₙ = Cₙ^(2). Two bounds hold:
//!
//! - It is at most (n+1)(n+2)/2·rⁿ: p/|p|⁴ has the complex generating function (1 − r·e^iθ)⁻²(1 − r·e^−iθ)⁻¹.
//! - |Cₙ(cos θ)| = |(n+3)·sin((n+1)θ) − (n+1)·sin((n+3)θ)|/(4 sin³θ) ≤ (n+2)/(2 sin³θ). Over a box with r ≤ s and |B| ≤ t,
//!   rⁿ·|Cₙ| is at most sⁿ·(n+2)/2·w, w = 1 + 1.5x + 3.61x² ≥ (1 − x)^−1.5 with x = (t/s)², up to t = 0.65·s: regions
//!   that lie across the line of sight, as those of most lights do, err far less than those along it.

use super::lanes::{Lanes, Mask, Vector};
use super::map::{CosineMap, PlanePoint};
use super::tree::Node;
use core::f32::consts::FRAC_1_PI;

/// Largest (t/s)² for which the second bound holds.
pub const ACROSS: f32 = 0.4225;
/// The terms of second, third and fourth order are at most (n+1)(n+2)/2·ẑ + this·√(1 − ẑ²), over rⁿ.
pub const LEVEL: [f32; 3] = [2.0, 3.52, 5.48];
/// Least denominator of a bound, so that tolerances times it are numbers; what is so near to 0 or 1 decides nothing.
pub const LEAST: f32 = 1e-20;

/// The expansion point of a region in cosine space.
pub(super) struct Expansion<L: Lanes> {
    /// Unit direction of the region's centre.
    dir: L::Vec3,
    /// 1/|p|.
    inv: L,
    /// D / (π·|p|³).
    scale: L,
    /// Squared ratio of the region's radius to |p|.
    s2: L,
    /// Offsets along the line of sight by the x and y axes, over |p|.
    along: [L; 2],
    /// Heights of the x and y axes, over |p|.
    rise: [L; 2],
    /// Square of the largest offset along the line of sight in the box.
    t2: L,
    /// The largest difference in height in the box.
    climb: L,
}

/// An error bound, not yet divided out: to be compared it need not be. The denominator is positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound<L> {
    pub(super) numerator: L,
    pub(super) denominator: L,
}

impl<L: Lanes> Bound<L> {
    /// `yes` where the mask holds, elsewhere `no`.
    #[inline(always)]
    fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        Self {
            numerator: L::select(mask, yes.numerator, no.numerator),
            denominator: L::select(mask, yes.denominator, no.denominator),
        }
    }
}

impl<L: Lanes> Expansion<L> {
    /// Of the box about `center`, which is relative to the map's foot, with those half-extents.
    #[inline(always)]
    pub(super) fn new(map: &CosineMap<L>, center: L::Vec2, half: L::Vec2) -> Self {
        let p = map.point(center);
        let inv2 = map.depth.splat(1.0) / p.length_squared();
        let inv = inv2.sqrt();
        let dir = p * inv;
        let [g00, g01, g11] = map.gram;
        let (x, y) = (half.x(), half.y());
        let r2 = x * x * g00 + y * y * g11 + x * y * g01.abs() * 2.0;
        let along = [map.c0.dot(dir) * inv, map.c1.dot(dir) * inv];
        let rise = [map.c0.z() * inv, map.c1.z() * inv];
        let t = along[0].abs() * x + along[1].abs() * y;
        let climb = rise[0].abs() * x + rise[1].abs() * y;
        Self { dir, inv, scale: map.depth * FRAC_1_PI * inv2 * inv, s2: r2 * inv2, along, rise, t2: t * t, climb }
    }

    /// |D|/(π·|p|³) · area · terms(s)/per(s, (1 − s)³). Infinite where the region reaches as far as the origin.
    #[inline(always)]
    fn bound(&self, area: L, terms: impl Fn(L, L) -> L, per: impl Fn(L, L) -> L) -> Bound<L> {
        let s = self.s2.sqrt();
        let gap = -s + 1.0;
        let gap_3 = gap * gap * gap;
        let apart = gap.is_positive();
        let numerator = self.scale.abs() * area * terms(s, gap_3);
        Bound {
            numerator: L::select(apart, numerator, s.splat(f32::INFINITY)),
            denominator: L::select(apart, per(s, gap_3).max(s.splat(LEAST)), s.splat(1.0)),
        }
    }

    /// Bound of the terms from the order `FIRST` on, 2 to 4, for a region above the horizon: `area` is ∫ρⁿ|dA| with n = `FIRST`,
    /// ρ the larger of |x| and |y| in half-extents of the box.
    #[inline(always)]
    fn remainder<const FIRST: usize>(&self, area: L) -> Bound<L> {
        let n = FIRST as f32;
        let z = self.dir.z();
        let leading = (z * ((n + 1.0) * (n + 2.0) / 2.0) + LEVEL[FIRST - 2]).min(z.splat((n + 1.0) * (n + 2.0) / 2.0));
        // Both bounds times s⁵⁻ⁿ·(1 − s)³.
        self.bound(
            area,
            |s, gap_3| {
                let s4 = self.s2 * self.s2;
                // Σ (k+1)(k+2)/2·sᵏ over k > n.
                let rest =
                    -s * (-s * ((n + 1.0) * (n + 2.0) / 2.0) + (n + 1.0) * (n + 3.0)) + (n + 2.0) * (n + 3.0) / 2.0;
                let anyhow = s4 * s * (leading * gap_3 + s * rest);
                // Σ (k+2)/2·sᵏ and Σ (k+1)/2·sᵏ over k ≥ n.
                let of_height = -s * ((n + 1.0) / 2.0) + (n + 2.0) / 2.0;
                let of_climb = -s * (n / 2.0) + (n + 1.0) / 2.0;
                let across = s4 + self.t2 * (self.s2 * 1.5 + self.t2 * 3.61);
                let across = across * (z * s * of_height + self.climb * of_climb) * (-s + 1.0);
                L::select(self.t2.at_most(self.s2 * ACROSS), across.min(anyhow), anyhow)
            },
            |s, gap_3| match FIRST {
                2 => self.s2 * s * gap_3,
                3 => self.s2 * gap_3,
                _ => s * gap_3,
            },
        )
    }

    /// Bound of the region's whole integral, wherever the horizon cuts it: k is at most (ẑ + s)/(1 − s)⁴, and 1/(1 − s)³, of its
    /// scale.
    #[inline(always)]
    fn magnitude(&self, area: L) -> Bound<L> {
        self.bound(area, |s, _| ((self.dir.z() + s) / (-s + 1.0)).between(0.0, 1.0), |_, gap_3| gap_3)
    }

    /// Bound of what is left out by the expansion up to the order before `FIRST`: in lanes where the region is above the horizons the
    /// remainder, from `area_first` = ∫ρⁿ|dA|; where they may cut it, of those that ask, the whole, from its area.
    #[inline(always)]
    pub(super) fn region_bound<const FIRST: usize>(
        &self,
        above: L::Mask,
        asking: L::Mask,
        area: L,
        area_first: L,
    ) -> Bound<L> {
        let remainder = self.remainder::<FIRST>(area_first);
        if (asking & !above).any() { Bound::select(above, remainder, self.magnitude(area)) } else { remainder }
    }

    /// The expansion's integral over a node.
    #[inline(always)]
    pub(super) fn region(&self, map: &CosineMap<L>, node: &Node) -> L {
        let Derivatives { value, gradient, curvature, third } = self.derivatives(map, node.unit());
        let mut sum = value * node.m0 + gradient[0] * node.m1[0] + gradient[1] * node.m1[1];
        for (derivative, moment) in curvature.into_iter().zip(node.m2) {
            sum = sum + derivative * moment;
        }
        for (derivative, moment) in third.into_iter().zip(node.m3) {
            sum = sum + derivative * moment;
        }
        sum
    }

    /// The kernel and its derivatives at the centre, times the factors of Taylor's series, by steps of `unit` along the axes.
    #[inline(always)]
    pub(super) fn derivatives(&self, map: &CosineMap<L>, unit: f32) -> Derivatives<L> {
        let z = self.dir.z();
        let ([z0, z1], [b0, b1]) = (self.rise.map(|v| v * unit), self.along.map(|v| v * unit));
        let step = self.inv * unit;
        let [g00, g01, g11] = map.gram.map(|g| g * step * step);
        let (b00, b01, b11) = (b0 * b0, b0 * b1, b1 * b1);
        // 12B² − 2G and 12G − 32B², by xx, xy and yy.
        let second = [b00 * 12.0 - g00 * 2.0, b01 * 24.0 - g01 * 4.0, b11 * 12.0 - g11 * 2.0];
        let inner = [g00 * 12.0 - b00 * 32.0, g01 * 24.0 - b01 * 64.0, g11 * 12.0 - b11 * 32.0];
        let (zb0, zb1) = (z * b0, z * b1);
        let scaled = |v: L| v * self.scale;
        Derivatives {
            value: self.scale * z,
            gradient: [z0 - zb0 * 4.0, z1 - zb1 * 4.0].map(scaled),
            curvature: [
                z * second[0] - z0 * b0 * 4.0,
                z * second[1] - (z0 * b1 + z1 * b0) * 4.0,
                z * second[2] - z1 * b1 * 4.0,
            ]
            .map(scaled),
            third: [
                zb0 * inner[0] + z0 * second[0],
                zb0 * inner[1] + zb1 * inner[0] + z0 * second[1] + z1 * second[0],
                zb0 * inner[2] + zb1 * inner[1] + z0 * second[2] + z1 * second[1],
                zb1 * inner[2] + z1 * second[2],
            ]
            .map(scaled),
        }
    }
}

/// k and its derivatives of first, second and third order, as the moments m0 to m3 of a node want them.
pub(super) struct Derivatives<L> {
    pub(super) value: L,
    pub(super) gradient: [L; 2],
    pub(super) curvature: [L; 3],
    pub(super) third: [L; 4],
}
