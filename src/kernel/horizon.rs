//! Clipping at a half-space through the origin of cosine space. Twin: `shaders/horizon.wgsl`.
//!
//! All crossings of a planar light with such a plane lie on one line, so the closing edges need no order and no
//! pairing: each crossing adds a function of its own place on the line, with the sign of its direction. Two
//! planes are in use: z = 0 of cosine space, where the clamped cosine ends, and the true horizon of the
//! surface, which a tilted lobe dips below.

use super::edge::{angle_over_sine, edge_integral};
use super::lanes::{Lanes, Mask, Real, Vector};
use super::map::{CosineMap, PlanePoint};
use glam::Vec2;

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

impl<L: Lanes> Height<L> {
    /// From the heights of the map's c0, c1, c2, up to a common positive factor.
    #[inline(always)]
    pub fn new(map: &CosineMap<L>, form: L::Vec3) -> Self {
        let reach = form.x().abs() * (map.foot.x().abs() + 1.0) + form.y().abs() * (map.foot.y().abs() + 1.0);
        Self { form, margin: (reach + form.z().abs()) * L::MARGIN }
    }

    /// The height over z = 0.
    #[inline(always)]
    pub fn lobe(map: &CosineMap<L>) -> Self {
        Self::new(map, Vector::of(map.c0.z(), map.c1.z(), map.c2.z()))
    }

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
pub struct TrueHorizon<L: Lanes = f32> {
    /// Its normal, up to a positive factor: the third row of M.
    pub axis: L::Vec3,
    /// The height over it; world-space, so exact.
    pub height: Height<L>,
}

/// What clips a light at a shading point: the plane z = 0, the surface's true horizon, both or neither.
#[derive(Clone, Copy, Debug)]
pub struct Clip<L: Lanes = f32> {
    /// z = 0 and the true horizon. A lane that one of them does not cut has everything above it.
    planes: [Horizon<L>; 2],
    /// Which of them cut the light in some lane: from this one on, up to that one.
    cutting: [usize; 2],
}

/// Where a light lies with respect to both horizons.
#[derive(Clone, Copy, Debug)]
pub struct Clipped<L: Lanes = f32> {
    /// What clips it.
    pub clip: Clip<L>,
    /// Where it is wholly below one of them.
    pub below: L::Mask,
}

impl Clip {
    /// [`Self::of`] at one point; `None` where the light is wholly below a horizon.
    pub fn new(map: &CosineMap, truth: Option<&TrueHorizon>, center: Vec2, half: Vec2) -> Option<Self> {
        let Clipped { clip, below } = Self::of(map, truth, center, half);
        (!below).then_some(clip)
    }
}

impl<L: Lanes> Clip<L> {
    /// Of a light that no plane cuts.
    #[inline(always)]
    pub fn none(map: &CosineMap<L>) -> Self {
        Self { planes: [Horizon::nowhere(map.depth); 2], cutting: [1, 1] }
    }

    /// What clips a light whose box has that centre relative to the foot and those half-extents. Nothing is computed for a plane
    /// that doesn't cut the box.
    #[inline(always)]
    pub fn of(map: &CosineMap<L>, truth: Option<&TrueHorizon<L>>, center: L::Vec2, half: L::Vec2) -> Clipped<L> {
        let lobe = Height::lobe(map);
        let side = lobe.side(center, half);
        let (mut below, cut) = (side.below, !side.above);
        let mut planes = [Horizon::nowhere(map.depth); 2];
        let mut cut_truly = map.depth.mask(false);
        if let Some(truth) = truth {
            let side = truth.height.side(center, half);
            let apart = truth.stands_apart();
            below = below | (apart & side.below);
            cut_truly = apart & !side.above & !below;
        }
        let cut = cut & !below;
        if cut.any() {
            let z = Vector::of(map.depth.splat(0.0), map.depth.splat(0.0), map.depth.splat(1.0));
            planes[0] = Horizon::new(map, z, lobe, cut);
        }
        if let Some(truth) = truth
            && cut_truly.any()
        {
            let axis = truth.axis.unit_or_zero();
            planes[1] = Horizon::new(map, axis, truth.height, cut_truly);
            if (cut & cut_truly).any() {
                Horizon::join(&mut planes, map, axis, cut & cut_truly);
            }
        }
        let cutting = [usize::from(!cut.any()), 1 + usize::from(cut_truly.any())];
        Clipped { clip: Self { planes, cutting }, below }
    }

    /// The planes that cut it.
    #[inline(always)]
    pub fn planes(&self) -> &[Horizon<L>] {
        let [from, to] = self.cutting;
        &self.planes[from.min(to)..to]
    }
}

impl<L: Lanes> TrueHorizon<L> {
    /// Whether the plane is another than z = 0, which must not be closed twice.
    #[inline(always)]
    fn stands_apart(&self) -> L::Mask {
        let (x, y, z) = (self.axis.x(), self.axis.y(), self.axis.z());
        (x * x + y * y).above(z * z * 1e-12)
    }
}

/// One clipping plane that cuts the light, for one map.
#[derive(Clone, Copy, Debug)]
pub struct Horizon<L: Lanes = f32> {
    /// The height over it.
    pub height: Height<L>,
    /// Direction of the line in which the light's plane cuts this one.
    along: L::Vec3,
    /// Distance of that line from the origin.
    distance: L,
    /// z of the unit normal of the plane of origin and line: ±1 for z = 0 itself.
    slope: L,
    /// What a crossing adds that is below the other plane: that of the corner, where the lines of both planes meet.
    corner: L,
}

impl<L: Lanes> Horizon<L> {
    /// A plane that everything is above.
    #[inline(always)]
    fn nowhere(like: L) -> Self {
        let (zero, one) = (like.splat(0.0), like.splat(1.0));
        Self {
            height: Height { form: Vector::of(zero, zero, one), margin: zero },
            along: Vector::of(zero, zero, zero),
            distance: one,
            slope: zero,
            corner: zero,
        }
    }

    /// The plane with the unit normal `axis` where it cuts the light.
    #[inline(always)]
    fn new(map: &CosineMap<L>, axis: L::Vec3, height: Height<L>, cuts: L::Mask) -> Self {
        let n = map.normal;
        let along = n.cross(axis).unit_or_zero();
        // The line's point nearest the origin is −D·n⊥/|n⊥|², n⊥ the part of n across the axis.
        let across = n - axis * n.dot(axis);
        let length = across.length_squared().sqrt();
        let none = Self::nowhere(map.depth);
        let distance = L::select(length.is_positive(), map.depth.abs() / length, length.splat(0.0));
        // `along` × `across` is `axis`.
        let slope = axis.z() * map.depth.splat(1.0).copysign(-map.depth);
        let choose = |yes: L, no: L| L::select(cuts, yes, no);
        let form = |of: fn(L::Vec3) -> L| choose(of(height.form), of(none.height.form));
        Self {
            height: Height {
                form: Vector::of(form(Vector::x), form(Vector::y), form(Vector::z)),
                margin: choose(height.margin, none.height.margin),
            },
            along,
            distance,
            slope,
            corner: none.corner,
        }
    }

    /// Ends the lines of z = 0 and of the plane with the unit normal `axis` where they meet.
    #[inline(always)]
    fn join(planes: &mut [Self; 2], map: &CosineMap<L>, axis: L::Vec3, both: L::Mask) {
        // The corner lies on the line common to both planes, through the origin: one point for both, so that
        // what one line loses there the other gains, however nearly the planes coincide.
        let ridge: L::Vec3 = Vector::of(-axis.y(), axis.x(), axis.x().splat(0.0));
        // Where the lines are parallel the corner is at infinity, on whichever side leaves the right part of each.
        let rate = map.normal.dot(ridge);
        let rate = rate.abs().max(rate.splat(1e-30)).copysign(rate);
        let corner = ridge * (-map.depth / rate).between(-1e30, 1e30);
        for plane in planes {
            plane.corner = L::select(both, plane.crossing(corner), plane.corner);
        }
    }

    /// What a crossing at the image point `p` adds (times 2π) where the contour comes up; where it goes down,
    /// it takes that away.
    #[inline(always)]
    pub fn crossing(&self, p: L::Vec3) -> L {
        self.slope * angle_on_line(p.dot(self.along), self.distance)
    }

    /// What an edge below the other horizon adds: where it crosses this one it does so beyond the corner of the two lines,
    /// where each crossing adds the same, so that only its ends count.
    #[inline(always)]
    pub fn far_crossing<P: PlanePoint<Lanes = L>>(&self, a: P, b: P) -> L {
        let (start, end) = (self.height.is_above(a), self.height.is_above(b));
        L::select(start ^ end, L::select(end, self.corner, -self.corner), self.slope.splat(0.0))
    }
}

/// atan2(place, distance) for distance ≥ 0, by the polynomial of the edges.
#[inline(always)]
fn angle_on_line<L: Lanes>(place: L, distance: L) -> L {
    let largest = place.abs().max(distance);
    let (p, d) = (place / largest, distance / largest);
    let inv = p.splat(1.0) / (p * p + d * d).sqrt();
    L::select(largest.is_positive(), p * inv * angle_over_sine(d * inv), largest.splat(0.0))
}

/// Where an edge meets a horizon.
#[derive(Clone, Copy)]
struct Meeting<P: PlanePoint> {
    /// Whether it starts above.
    start: <P::Lanes as Real>::Mask,
    /// Whether it ends above.
    end: <P::Lanes as Real>::Mask,
    /// Its parameter where it crosses; without meaning where it doesn't.
    at: P::Scalar,
}

impl<P: PlanePoint> Meeting<P> {
    #[inline(always)]
    fn new(horizon: &Horizon<P::Lanes>, a: P, b: P) -> Self {
        let (ha, hb) = (horizon.height.at(a), horizon.height.at(b));
        Self { start: ha.is_positive(), end: hb.is_positive(), at: ha / (ha - hb) }
    }

    /// Of an edge above.
    #[inline(always)]
    fn none(like: P) -> Self {
        let above = like.x().splat(1.0).is_positive();
        Self { start: above, end: above, at: like.x() }
    }

    /// Whether the edge is above where it crosses the other horizon, which it crosses before this one or after.
    #[inline(always)]
    fn is_above(&self, before: <P::Lanes as Real>::Mask) -> <P::Lanes as Real>::Mask {
        (self.start & self.end) | (self.start & before) | (self.end & !before)
    }

    /// Where the part above begins and where it ends; it is empty where that is before.
    #[inline(always)]
    fn part(&self) -> [P::Scalar; 2] {
        let (zero, one) = (self.at.splat(0.0), self.at.splat(1.0));
        let to = P::Scalar::select(
            self.start,
            P::Scalar::select(self.end, one, self.at),
            P::Scalar::select(self.end, one, zero),
        );
        [P::Scalar::select(self.end & !self.start, self.at, zero), to]
    }
}

/// The point at `t` of the edge from `a` to `b`: `b` itself where that is the end, which a crossing a hair before it rounds to. What
/// closes the edge must begin where the edge's own part ends.
#[inline(always)]
fn along<P: PlanePoint>(a: P, b: P, t: P::Scalar) -> P {
    P::select(t.splat(1.0).above(t), a + (b - a) * t, b)
}

/// What an edge's crossing of a horizon adds; `inside` says whether it is above the other horizon. That is asked of the edge, not
/// of the place on the line: where the planes nearly coincide the two would differ by rounding, and the edge's own part must agree.
#[inline(always)]
fn closing<P: PlanePoint>(
    map: &CosineMap<P::Lanes>,
    horizon: &Horizon<P::Lanes>,
    meeting: &Meeting<P>,
    inside: <P::Lanes as Real>::Mask,
    [a, b]: [P; 2],
) -> P::Lanes {
    let nothing = map.depth.splat(0.0);
    let crosses = meeting.start ^ meeting.end;
    if !crosses.any() {
        return nothing;
    }
    let up = horizon.crossing(map.point(along(a, b, meeting.at).round()));
    let up = P::Lanes::select(inside, up, horizon.corner);
    P::Lanes::select(crosses, P::Lanes::select(meeting.end, up, -up), nothing)
}

/// 2π times the integral along the part of the edge from `a` to `b` (relative to the map's foot) that is above all horizons,
/// with what its crossings add.
#[inline(always)]
pub fn cut_edge<P: PlanePoint>(map: &CosineMap<P::Lanes>, horizons: &[Horizon<P::Lanes>], a: P, b: P) -> P::Lanes {
    let (mut first, mut second) = (Meeting::none(a), Meeting::none(a));
    let mut sum = map.depth.splat(0.0);
    if let [h, ..] = horizons {
        first = Meeting::new(h, a, b);
    }
    if let [_, h] = horizons {
        second = Meeting::new(h, a, b);
        let before = first.at.above(second.at);
        sum = closing(map, h, &second, first.is_above(before), [a, b]);
    }
    if let [h, ..] = horizons {
        // Of two crossings at one place, in one direction, this one is inside and that one is not.
        let before = !first.at.above(second.at);
        sum = sum + closing(map, h, &first, second.is_above(before), [a, b]);
    }
    let ([from, to], [second_from, second_to]) = (first.part(), second.part());
    let (from, to) = (from.max(second_from), to.min(second_to));
    let part = to.above(from);
    if part.any() {
        let integral = edge_integral(map, along(a, b, from), along(a, b, to));
        sum = sum + P::Lanes::select(part, integral, map.depth.splat(0.0));
    }
    sum
}
