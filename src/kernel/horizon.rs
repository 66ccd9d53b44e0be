//! Clipping at a half-space through the origin of cosine space. Twin: `shaders/horizon.wgsl`.
//!
//! All crossings of a planar light with such a plane lie on one line, so the closing edges need no order and no
//! pairing: each crossing adds a function of its own place on the line, with the sign of its direction. Two
//! planes are in use: z = 0 of cosine space, where the clamped cosine ends, and the true horizon of the
//! surface, which a tilted lobe dips below.

use super::edge::{edge_integral, half_turn};
use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use glam::{Vec2, Vec3};

/// Rounding of a height in f32, relative to the sum of its terms: 16 half-steps.
pub const MARGIN: f32 = 2e-6;

/// The height over a plane through the origin of cosine space, as a function of the light's plane.
#[derive(Clone, Copy, Debug)]
pub struct Height<L: Lanes = f32> {
    /// Height of the point q relative to the foot, up to a positive factor: form.x·q.x + form.y·q.y + form.z.
    pub form: L::Vec3,
    /// Rounding bound anywhere on the light: a box higher than this has every point of every curve in it above.
    pub margin: L,
}

/// Where a box lies with respect to a plane; neither where the plane may cut it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side<M> {
    /// Wholly above, and so is every end point in it.
    pub above: M,
    /// Wholly below, and so is every end point in it.
    pub below: M,
}

impl Height {
    /// From the heights of the map's c0, c1, c2, up to a common positive factor.
    pub fn new(map: &CosineMap, form: Vec3) -> Self {
        let reach = 1.0 + map.foot.abs();
        let margin = MARGIN * (form.x.abs() * reach.x + form.y.abs() * reach.y + form.z.abs());
        Self { form, margin }
    }

    /// The height over z = 0.
    pub fn lobe(map: &CosineMap) -> Self {
        Self::new(map, Vec3::new(map.c0.z, map.c1.z, map.c2.z))
    }
}

impl<L: Lanes> Height<L> {
    /// The height of a point relative to the foot. Above means > 0; every decision about a shared end point is this
    /// very expression, so that crossings pair.
    #[inline(always)]
    pub fn at<P: PlanePoint<Lanes = L>>(&self, q: P) -> P::Scalar {
        q.form(self.form)
    }

    /// Whether a point relative to the foot is above.
    #[inline(always)]
    pub fn is_above<P: PlanePoint<Lanes = L>>(&self, q: P) -> L::Mask {
        self.at(q).is_positive()
    }

    /// Where a box lies, given by its centre relative to the foot and its half-extents.
    #[inline(always)]
    pub fn side(&self, center: L::Vec2, half: L::Vec2) -> Side<L::Mask> {
        let middle = self.at(center);
        let reach = self.form.x().abs() * half.x() + self.form.y().abs() * half.y() + self.margin;
        Side { above: (middle - reach).is_positive(), below: (-(middle + reach)).is_positive() }
    }
}

/// The surface's true horizon in cosine space.
#[derive(Clone, Copy, Debug)]
pub struct TrueHorizon {
    /// Its normal, up to a positive factor: the third row of M.
    pub axis: Vec3,
    /// The height over it; world-space, so exact.
    pub height: Height,
}

/// What clips a light at one shading point.
#[derive(Clone, Copy, Debug)]
pub enum Clip {
    /// The light is above every horizon.
    None,
    /// One plane cuts it.
    One([Horizon; 1]),
    /// z = 0 and the surface's true horizon both cut it.
    Two([Horizon; 2]),
}

impl Clip {
    /// What clips a light whose box has that centre relative to the foot and those half-extents; `None` where it is
    /// wholly below a horizon. Nothing is computed for a plane that doesn't cut the box.
    pub fn new(map: &CosineMap, truth: Option<&TrueHorizon>, center: Vec2, half: Vec2) -> Option<Self> {
        let lobe = Height::lobe(map);
        let side = lobe.side(center, half);
        let truth = truth.filter(|t| t.stands_apart()).map(|t| (t, t.height.side(center, half)));
        if side.below || truth.is_some_and(|(_, side)| side.below) {
            return None;
        }
        let cut = truth.filter(|(_, side)| !side.above).map(|(t, _)| t);
        Some(match (side.above, cut) {
            (true, None) => Self::None,
            (false, None) => Self::One([Horizon::new(map, Vec3::Z, lobe)]),
            (true, Some(truth)) => Self::One([Horizon::new(map, truth.axis.normalize(), truth.height)]),
            (false, Some(truth)) => Self::Two(Horizon::pair(map, lobe, truth)),
        })
    }

    /// The planes that cut it.
    #[inline]
    pub fn planes(&self) -> &[Horizon] {
        match self {
            Self::None => &[],
            Self::One(one) => one,
            Self::Two(two) => two,
        }
    }
}

impl TrueHorizon {
    /// Whether the plane is another than z = 0, which must not be closed twice.
    fn stands_apart(&self) -> bool {
        let n = self.axis;
        n.x * n.x + n.y * n.y > 1e-12 * n.z * n.z
    }
}

/// One clipping plane that cuts the light, for one map.
#[derive(Clone, Copy, Debug)]
pub struct Horizon<L: Lanes = f32> {
    /// The height over it.
    pub height: Height<L>,
    /// Direction of the line in which the light's plane cuts this one.
    pub(super) along: L::Vec3,
    /// Distance of that line from the origin.
    pub(super) distance: L,
    /// z of the unit normal of the plane of origin and line: ±1 for z = 0 itself.
    pub(super) slope: L,
    /// The part of the line inside the other plane's half-space.
    pub(super) range: [L; 2],
}

impl Horizon {
    /// The plane with the unit normal `axis`.
    fn new(map: &CosineMap, axis: Vec3, height: Height) -> Self {
        let n = map.normal;
        let along = n.cross(axis).normalize_or_zero();
        // The line's point nearest the origin is −D·n⊥/|n⊥|², n⊥ the part of n across the axis.
        let across = n - axis * n.dot(axis);
        let length = across.length();
        let distance = if length > 0.0 { map.depth.abs() / length } else { 0.0 };
        let slope = along.cross(across * -map.depth.signum()).normalize_or_zero().z;
        Self { height, along, distance, slope, range: [f32::NEG_INFINITY, f32::INFINITY] }
    }

    /// The planes z = 0 and `truth`, each with its line ending where it meets the other.
    fn pair(map: &CosineMap, lobe: Height, truth: &TrueHorizon) -> [Self; 2] {
        let axis = truth.axis.normalize();
        let mut z = Self::new(map, Vec3::Z, lobe);
        let mut s = Self::new(map, axis, truth.height);
        // The corner lies on the line common to both planes, through the origin: one point for both, so that
        // what one line loses there the other gains, however nearly the planes coincide.
        let ridge = Vec3::new(-axis.y, axis.x, 0.0);
        // Where the lines are parallel the corner is at infinity, on whichever side leaves the right part of each.
        let rate = map.normal.dot(ridge);
        let rate = if rate.abs() > 1e-30 { rate } else { 1e-30_f32.copysign(rate) };
        let corner = ridge * (-map.depth / rate).clamp(-1e30, 1e30);
        z.end_at(corner, rate > 0.0);
        s.end_at(corner, rate < 0.0);
        [z, s]
    }

    /// Ends the line at `corner`; it goes on upwards from there, or downwards.
    fn end_at(&mut self, corner: Vec3, upwards: bool) {
        self.range[usize::from(!upwards)] = corner.dot(self.along);
    }

    /// A plane that everything is above: what clips a lane which fewer planes cut than others of its packet.
    pub(super) const NOWHERE: Self = Self {
        height: Height { form: Vec3::Z, margin: 0.0 },
        along: Vec3::ZERO,
        distance: 1.0,
        slope: 0.0,
        range: [f32::NEG_INFINITY, f32::INFINITY],
    };
}

impl<L: Lanes> Horizon<L> {
    /// What a crossing at the image point `p` adds (times 2π) where the contour comes up; where it goes down,
    /// it takes that away.
    #[inline(always)]
    pub fn crossing(&self, p: L::Vec3) -> L {
        let place = p.dot(self.along).max(self.range[0]).min(self.range[1]);
        self.slope * half_turn(place, self.distance)
    }

    /// What an edge below the other horizon adds: where it crosses this one it does so beyond the corner of the two lines,
    /// where each crossing adds the same, so that only its ends count.
    #[inline(always)]
    pub fn far_crossing<P: PlanePoint<Lanes = L>>(&self, a: P, b: P) -> L {
        let (start, end) = (self.height.is_above(a), self.height.is_above(b));
        let none = self.slope.splat(0.0);
        if !(start ^ end).any() {
            return none;
        }
        let ends_low = self.range[0].above(none.splat(f32::NEG_INFINITY));
        let corner = L::select(ends_low, self.range[0], self.range[1]);
        let up = self.slope * half_turn(corner, self.distance);
        L::select(start ^ end, L::select(end, up, -up), none)
    }
}

/// 2π times the integral along the part of the edge from `a` to `b` (relative to the map's foot) that is above all horizons,
/// with what its crossings add.
#[inline(always)]
pub fn cut_edge<P: PlanePoint>(
    map: &CosineMap<P::Lanes>,
    horizons: &[Horizon<P::Lanes>],
    a: P,
    b: P,
) -> P::Lanes {
    let (zero, one) = (a.x().splat(0.0), a.x().splat(1.0));
    let nothing = map.depth.splat(0.0);
    let mut sum = nothing;
    let (mut from, mut to) = (zero, one);
    for h in horizons {
        let (ha, hb) = (h.height.at(a), h.height.at(b));
        let (start, end) = (ha.is_positive(), hb.is_positive());
        if (start ^ end).any() {
            let t = ha / (ha - hb);
            let up = h.crossing(map.point((a + (b - a) * t).round()));
            sum = sum + P::Lanes::select(start ^ end, P::Lanes::select(end, up, -up), nothing);
            to = P::Scalar::select(start & !end & to.above(t), t, to);
            from = P::Scalar::select(end & !start & t.above(from), t, from);
        }
        to = P::Scalar::select(start | end, to, zero);
    }
    let part = to.above(from);
    if part.any() {
        let whole = !one.above(to);
        let end = P::select(whole, b, a + (b - a) * to);
        sum = sum + P::Lanes::select(part, edge_integral(map, a + (b - a) * from, end), nothing);
    }
    sum
}
