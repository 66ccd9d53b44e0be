//! Shading points where things break, and lobes.

use super::case::{Case, Stage};
use super::draw::Draw;
use super::shapes::{ShapeKind, name};
use crate::brdf::ltc::Table;
use crate::light::{Placement, Square};
use crate::shape::{Bounds, Contour};
use glam::{DAffine2, DMat3, DVec2, DVec3};
use std::sync::Arc;

/// Where a shading point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PlaceKind {
    /// A hundredth of the light's size to a hundred times as far.
    Ordinary,
    /// In the light's plane, where the light shines: it passes through the point.
    Through,
    /// In the light's plane, outside the light.
    InPlane,
    /// On an edge.
    OnEdge,
    /// On a corner.
    OnCorner,
    /// Before or behind the plane by 1e-9 to 1e-3 of the light's size, on an edge, beside it by as little, or elsewhere.
    Near,
    /// 1e4 to 1e6 times the light's size away.
    Far,
    /// Straight before an edge or corner: it runs through the axis of a lobe that is aimed there.
    Facing,
    /// Behind the light.
    Behind,
    /// A horizon touches a curve, runs along an edge, or misses either by a hair.
    Tangent,
    /// A horizon runs through a corner, or misses it by a hair.
    Corner,
    /// A horizon cuts a contour, a hole if there is one.
    Cut,
}

const PLACES: [(PlaceKind, f64, &str); 12] = [
    (PlaceKind::Ordinary, 2.0, "ordinary"),
    (PlaceKind::Through, 0.5, "light through the point"),
    (PlaceKind::InPlane, 0.5, "in the plane"),
    (PlaceKind::OnEdge, 0.5, "on an edge"),
    (PlaceKind::OnCorner, 0.5, "on a corner"),
    (PlaceKind::Near, 1.5, "near contact"),
    (PlaceKind::Far, 0.7, "far"),
    (PlaceKind::Facing, 1.5, "before an edge"),
    (PlaceKind::Behind, 0.3, "behind"),
    (PlaceKind::Tangent, 1.5, "horizon tangent"),
    (PlaceKind::Corner, 1.0, "horizon through a corner"),
    (PlaceKind::Cut, 1.0, "horizon cuts"),
];

/// What is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LobeKind {
    /// The plain cosine.
    Diffuse,
    /// Alpha 0, or below the table's least.
    Mirror,
    /// Alpha below 0.05.
    Narrow,
    /// Alpha up to 1.
    Wide,
    /// Alpha 1.
    Rough,
}

const LOBES: [(LobeKind, f64, &str); 5] = [
    (LobeKind::Diffuse, 2.0, "diffuse"),
    (LobeKind::Mirror, 1.5, "alpha 0"),
    (LobeKind::Narrow, 2.0, "alpha < 0.05"),
    (LobeKind::Wide, 2.0, "alpha 0.05 to 1"),
    (LobeKind::Rough, 1.0, "alpha 1"),
];

/// From where the surface is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ViewKind {
    /// In between.
    Slanted,
    /// Along the normal, or nearly.
    Normal,
    /// Along the surface, or nearly.
    Grazing,
    /// From below the surface.
    Below,
}

const VIEWS: [(ViewKind, f64, &str); 4] = [
    (ViewKind::Slanted, 3.0, "slanted"),
    (ViewKind::Normal, 1.0, "along the normal"),
    (ViewKind::Grazing, 1.5, "grazing"),
    (ViewKind::Below, 0.5, "from below"),
];

/// What a case is out for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kinds {
    /// The light's shape.
    pub shape: ShapeKind,
    /// Where the point stands.
    pub place: PlaceKind,
    /// What is integrated.
    pub lobe: LobeKind,
    /// From where it is seen.
    pub view: ViewKind,
}

impl Kinds {
    /// What each is called, with what it is a kind of.
    pub fn names(self) -> [(&'static str, &'static str); 4] {
        [
            ("shape", self.shape.name()),
            ("place", name(&PLACES, self.place)),
            ("lobe", name(&LOBES, self.lobe)),
            ("view", name(&VIEWS, self.view)),
        ]
    }
}

/// Draws a light: its shape, in units of 1e-6 to 1e6, where it stands, and the camera.
pub fn stage(draw: &mut Draw) -> (ShapeKind, Stage) {
    let kind = ShapeKind::any(draw);
    let unit = |draw: &mut Draw| if draw.chance(0.5) { 1.0 } else { draw.log_within(1e-6, 1e6) };
    let (size, scale) = (unit(draw), unit(draw));
    let shift = if draw.chance(0.7) { DVec2::ZERO } else { draw.square() * 3.0 * size };
    let shape = kind.shape(draw).transformed(DAffine2::from_scale(DVec2::splat(size)));
    let shape = shape.transformed(DAffine2::from_translation(shift));
    let stretch = if draw.chance(0.8) { DVec2::ONE } else { DVec2::new(1.0, draw.log_within(0.01, 100.0)) };
    let axis_aligned = draw.chance(0.3);
    let turn = draw.rotation(axis_aligned);
    let reach = size * scale;
    let offset = match draw.index(4) {
        0 => DVec3::ZERO,
        1 | 2 => draw.direction() * reach * 3.0,
        // A million metres from the world's origin, the camera with it.
        _ => draw.direction() * 1e6,
    };
    let eye = offset + draw.direction() * reach * draw.log_within(0.1, 100.0);
    let origin = offset + draw.direction() * reach;
    let placement = Placement { origin, x: turn.x_axis * (scale * stretch.x), y: turn.y_axis * (scale * stretch.y) };
    (kind, Stage { shape, placement, eye })
}

/// Draws a shading point for a light.
pub fn case(draw: &mut Draw, shape: ShapeKind, stage: &Arc<Stage>) -> (Kinds, Case) {
    let place = match draw.weighted(&PLACES) {
        // Where contours overlap or cross themselves there is no telling what a point on them may see.
        PlaceKind::OnEdge | PlaceKind::OnCorner if !shape.is_simple() => PlaceKind::Near,
        place => place,
    };
    let (lobe, view) = (draw.weighted(&LOBES), draw.weighted(&VIEWS));
    let kinds = Kinds { shape, place, lobe, view };
    let alpha = match lobe {
        LobeKind::Diffuse => None,
        LobeKind::Mirror => Some(if draw.chance(0.7) { 0.0 } else { draw.log_within(1e-7, 1e-4) }),
        LobeKind::Narrow => Some(draw.log_within(1e-4, 0.05)),
        LobeKind::Wide => Some(draw.within(0.05, 1.0)),
        LobeKind::Rough => Some(1.0),
    };
    let hair = |draw: &mut Draw| if draw.chance(0.5) { 0.0 } else { draw.log_within(1e-16, 1e-3) };
    let cos_theta = match view {
        ViewKind::Slanted => draw.unit(),
        ViewKind::Normal => 1.0 - hair(draw),
        ViewKind::Grazing => hair(draw),
        ViewKind::Below => -draw.unit(),
    };
    let Spot { position, aim } = spot(draw, place, stage);
    let turn = oriented(draw, alpha, cos_theta, aim);
    let view = turn * DVec3::new((1.0 - cos_theta * cos_theta).max(0.0).sqrt(), 0.0, cos_theta);
    let tolerance = draw.pick(&[1e-3, 1e-4, 1e-5]);
    let case = Case { stage: Arc::clone(stage), position, normal: turn.z_axis, view, alpha, tolerance };
    (kinds, case)
}

/// A shading point and what its frame is turned by.
struct Spot {
    position: DVec3,
    aim: Aim,
}

/// What a shading frame is turned by; unit vectors of the world.
enum Aim {
    /// Nothing.
    Free,
    /// The lobe's axis points there.
    Axis(DVec3),
    /// A horizon has this normal.
    Horizon(DVec3),
}

/// A place on the outline of a light.
struct Anchor {
    point: DVec2,
    tangent: DVec2,
}

fn anchor(draw: &mut Draw, contour: &Contour, corner: bool) -> Anchor {
    let curve = contour.curves()[draw.index(contour.curves().len())];
    let t = if corner { 0.0 } else { draw.unit() };
    let tangent = curve.tangent(t);
    let tangent = if tangent == DVec2::ZERO { curve.p3 - curve.p0 } else { tangent };
    Anchor { point: curve.eval_exact(t), tangent }
}

/// A point off the outline: somewhere in the contour's box, or well outside all.
fn beside(draw: &mut Draw, bounds: Bounds, inside: bool) -> DVec2 {
    if inside {
        let middle = bounds.center();
        return middle + draw.square() * bounds.size() * 0.5 * draw.pick(&[0.0, 0.3, 1.0]);
    }
    bounds.center() + draw.square().normalize_or(DVec2::X) * bounds.size().max_element() * draw.log_within(0.8, 100.0)
}

fn spot(draw: &mut Draw, kind: PlaceKind, stage: &Stage) -> Spot {
    let Stage { shape, placement, .. } = stage;
    let normal = placement.normal().normalize();
    let contour = &shape.contours()[draw.index(shape.contours().len())];
    // Lengths are those of the whole light, or of the contour at hand.
    let bounds = if draw.chance(0.7) { shape.bounds() } else { contour.bounds() };
    let half =
        Square::around(bounds).map_or(1.0, |square| square.half) * placement.x.length().max(placement.y.length());
    let corner = draw.chance(0.4);
    let at = |p: DVec2, height: f64| placement.point(p) + normal * (height * half);
    let free = |position| Spot { position, aim: Aim::Free };
    match kind {
        PlaceKind::Ordinary => {
            let from = bounds.center() + draw.square() * bounds.size() * draw.pick(&[0.5, 1.0, 3.0]);
            let position = at(from, draw.log_within(1e-2, 1e2));
            let aim = if draw.chance(0.5) { towards(placement.point(bounds.center()), position) } else { Aim::Free };
            Spot { position, aim }
        }
        PlaceKind::Through => free(at(beside(draw, contour.bounds(), true), 0.0)),
        PlaceKind::InPlane => free(at(beside(draw, bounds, false), 0.0)),
        PlaceKind::OnEdge => free(at(anchor(draw, contour, false).point, 0.0)),
        PlaceKind::OnCorner => free(at(anchor(draw, contour, true).point, 0.0)),
        PlaceKind::Near => {
            let tiny = |draw: &mut Draw| if draw.chance(0.5) { 1e-7 } else { draw.log_within(1e-9, 1e-3) };
            let inside = draw.chance(0.5);
            let on_light = match draw.index(3) {
                0 => anchor(draw, contour, corner).point,
                1 => {
                    let Anchor { point, tangent } = anchor(draw, contour, corner);
                    let aside = tangent.perp().normalize_or(DVec2::X) * draw.sign() * tiny(draw);
                    point + aside * bounds.size().max_element()
                }
                _ => beside(draw, contour.bounds(), inside),
            };
            let position = at(on_light, tiny(draw) * if draw.chance(0.9) { 1.0 } else { -1.0 });
            let aim = if draw.chance(0.3) { Aim::Axis(-normal) } else { Aim::Free };
            Spot { position, aim }
        }
        PlaceKind::Far => {
            let position = at(bounds.center(), 0.0) + facing_half(draw, normal) * half * draw.log_within(1e4, 1e6);
            Spot { position, aim: towards(placement.point(bounds.center()), position) }
        }
        PlaceKind::Facing => {
            let Anchor { point, .. } = anchor(draw, contour, corner);
            let slant = if draw.chance(0.5) { normal } else { facing_half(draw, normal) };
            let position = at(point, 0.0) + slant * half * draw.log_within(1e-3, 1e2);
            Spot { position, aim: towards(placement.point(point), position) }
        }
        PlaceKind::Behind => {
            let position = at(beside(draw, bounds, true), -draw.log_within(1e-3, 1e2));
            Spot { position, aim: towards(placement.point(bounds.center()), position) }
        }
        PlaceKind::Tangent | PlaceKind::Corner | PlaceKind::Cut => {
            let Anchor { point, tangent } = match kind {
                PlaceKind::Cut => {
                    let hole = shape.contours().iter().find(|c| c.is_hole()).unwrap_or(contour);
                    Anchor { point: beside(draw, hole.bounds(), true), tangent: draw.square() }
                }
                _ => anchor(draw, contour, kind == PlaceKind::Corner),
            };
            let tangent = if kind == PlaceKind::Corner { draw.square() } else { tangent };
            let from = bounds.center() + draw.square() * bounds.size();
            let position = at(from, draw.log_within(1e-3, 10.0));
            let along = placement.x * tangent.x + placement.y * tangent.y;
            let across = (placement.point(point) - position).cross(along).try_normalize();
            let Some(across) = across else { return free(position) };
            let miss = if draw.chance(0.5) { 0.0 } else { draw.log_within(1e-16, 1e-3) };
            let horizon = (across * draw.sign() + draw.direction() * miss).normalize();
            Spot { position, aim: Aim::Horizon(horizon) }
        }
    }
}

fn towards(point: DVec3, from: DVec3) -> Aim {
    (point - from).try_normalize().map_or(Aim::Free, Aim::Axis)
}

/// A direction on the side of `normal`.
fn facing_half(draw: &mut Draw, normal: DVec3) -> DVec3 {
    let d = draw.direction();
    if d.dot(normal) < 0.0 { -d } else { d }
}

/// A rotation from the shading frame to the world, as `aim` has it.
fn oriented(draw: &mut Draw, alpha: Option<f64>, cos_theta: f64, aim: Aim) -> DMat3 {
    let seen = cos_theta.clamp(0.0, 1.0);
    let lobe = alpha.map(|alpha| Table::shipped().lobe(alpha as f32, seen as f32));
    let local = lobe.and_then(|lobe| {
        let inverse = lobe.m_inv.mat3().as_dmat3();
        let horizon = inverse.transpose() * DVec3::Z;
        let axis = inverse.inverse() * DVec3::Z;
        Some((horizon.try_normalize()?, axis.try_normalize()?))
    });
    let (horizon, axis) = local.unwrap_or((DVec3::Z, DVec3::Z));
    let (from, to) = match aim {
        Aim::Free => {
            let axis_aligned = draw.chance(0.3);
            return draw.rotation(axis_aligned);
        }
        Aim::Axis(world) => (axis, world),
        // The lobe's own horizon, or the surface's.
        Aim::Horizon(world) => (if draw.chance(0.5) { horizon } else { DVec3::Z }, world),
    };
    let around = DVec2::from_angle(draw.within(0.0, core::f64::consts::TAU));
    let tangents = |z: DVec3| {
        let x = z.any_orthonormal_vector();
        DMat3::from_cols(x, z.cross(x), z)
    };
    let turned = DMat3::from_cols(DVec3::new(around.x, around.y, 0.0), DVec3::new(-around.y, around.x, 0.0), DVec3::Z);
    tangents(to) * turned * tangents(from).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::frame::ShadingFrame;

    #[test]
    fn horizons_pass_where_they_are_aimed() {
        for index in 0..200 {
            let mut draw = Draw::new(7, index);
            let aim = draw.direction();
            let (alpha, cos_theta) = (draw.unit(), draw.unit());
            let turn = oriented(&mut draw, Some(alpha), cos_theta, Aim::Axis(aim));
            let view = turn * DVec3::new((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta);
            let frame = ShadingFrame::new(turn.z_axis, view);
            let lobe = Table::shipped().lobe(alpha as f32, frame.cos_theta as f32);
            let seen = (lobe.m_inv.mat3().as_dmat3() * frame.to_local(aim)).normalize();
            assert!(seen.distance(DVec3::Z) < 1e-3, "{index}: the axis is seen at {seen}");
            let off = turn * DVec3::X;
            assert!((lobe.m_inv.mat3().as_dmat3() * frame.to_local(off)).normalize().distance(DVec3::Z) > 1e-3);
        }
    }
}
