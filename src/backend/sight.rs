//! The lights as the camera sees them, antialiased: each emission's outline is projected and rasterised by tiny-skia,
//! and laid over the surfaces that it hides. Both backends share this stage.

use super::Settings;
use super::cpu::Surfaces;
use super::prepared::{Emitter, Prepared};
use crate::shape::CubicBez;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use tiny_skia::{FillRule, Mask, PathBuilder, Transform};

/// Chords that stand for one curve in the mask: a sagitta under 1/100 pixel for curves up to 2000 pixels long.
const CHORDS: u32 = 64;
/// Nearest visible distance over the light's own size.
const NEAR: f64 = 1e-4;

/// What the lights put in the picture.
pub struct Sight {
    /// Radiance of the lights, W·sr⁻¹·m⁻², per pixel.
    pub emission: Vec<Vec3>,
    /// How much of what lies behind the lights remains, per pixel.
    pub through: Vec<f32>,
}

/// Draws the lights, the farthest first.
pub fn see(prepared: &Prepared, surfaces: &Surfaces<'_>, settings: &Settings) -> Sight {
    let pixels = settings.width as usize * settings.height as usize;
    let mut sight = Sight { emission: vec![Vec3::ZERO; pixels], through: vec![1.0; pixels] };
    let mut order: Vec<&[Emitter]> = prepared.emitters.chunk_by(|a, b| a.light == b.light).collect();
    let distance = |layers: &[Emitter]| {
        let middle = layers.iter().map(|e| e.placement.point(e.shape.bounds().center())).sum::<DVec3>();
        (middle / layers.len() as f64).length()
    };
    order.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    for layers in order {
        lay_over(&mut sight, prepared, surfaces, settings, layers);
    }
    sight
}

/// Lays one light, whose layers add up, over what is there.
fn lay_over(sight: &mut Sight, prepared: &Prepared, surfaces: &Surfaces<'_>, settings: &Settings, layers: &[Emitter]) {
    let light = &layers[0];
    let front = -light.placement.normal().dot(light.placement.origin);
    if front < 0.0 && !light.two_sided {
        return;
    }
    let masks: Vec<_> = layers.par_iter().map(|e| mask(prepared, settings, e)).collect();
    if masks.iter().all(Option::is_none) {
        return;
    }
    let width = settings.width as usize;
    let rows = sight.emission.par_chunks_mut(width).zip(sight.through.par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (emission, through))| {
        for x in 0..width {
            let (mut radiance, mut hidden) = (Vec3::ZERO, 0.0);
            for (layer, mask) in layers.iter().zip(&masks) {
                let Some(mask) = mask else { continue };
                let coverage = f32::from(mask.data()[y * width + x]) / 255.0;
                radiance += layer.radiance * coverage;
                hidden += layer.opacity * coverage;
            }
            if hidden == 0.0 && radiance == Vec3::ZERO {
                continue;
            }
            let seen = unhidden(prepared, surfaces, settings, light, x as u32, y as u32);
            let remains = 1.0 - hidden.min(1.0) * seen;
            emission[x] = emission[x] * remains + radiance * seen;
            through[x] *= remains;
        }
    });
}

/// The fraction of a pixel's samples at which no surface stands before the light's plane.
fn unhidden(prepared: &Prepared, surfaces: &Surfaces<'_>, settings: &Settings, light: &Emitter, x: u32, y: u32) -> f32 {
    let normal = light.placement.normal();
    let depth = light.placement.origin.dot(normal);
    let seen = prepared.offsets.iter().filter(|offset| {
        let direction = settings.direction(&prepared.rays, x, y, **offset);
        let t = depth / direction.as_dvec3().dot(normal);
        // A light that touches a surface is not hidden by it.
        surfaces.nearest(direction).is_none_or(|(_, hit)| f64::from(hit.t) > t * (1.0 - 1e-5))
    });
    seen.count() as f32 / prepared.offsets.len() as f32
}

/// Coverage of the picture's pixels by one emission. `None` where it is out of the picture.
fn mask(prepared: &Prepared, settings: &Settings, emitter: &Emitter) -> Option<Mask> {
    let rays = &prepared.rays;
    let (forward, right, up) =
        (rays.forward.truncate().as_dvec3(), rays.right.truncate().as_dvec3(), rays.up.truncate().as_dvec3());
    let near = NEAR * emitter.tree.half;
    let size = DVec2::new(f64::from(settings.width), f64::from(settings.height));
    let to_pixel = |p: DVec3| {
        let depth = p.dot(forward);
        let ndc = DVec2::new(p.dot(right) / right.length_squared(), -p.dot(up) / up.length_squared()) / depth;
        // Far outside the picture, where only the direction matters; tiny-skia's numbers are f32.
        ((ndc + 1.0) * 0.5 * size).clamp(-16.0 * size, 17.0 * size)
    };
    let mut path = PathBuilder::new();
    for contour in emitter.shape.contours() {
        let points: Vec<DVec3> = contour.curves().iter().flat_map(chords).map(|p| emitter.placement.point(p)).collect();
        let polygon = clip_near(&points, forward, near);
        for (i, p) in polygon.into_iter().map(to_pixel).enumerate() {
            if i == 0 { path.move_to(p.x as f32, p.y as f32) } else { path.line_to(p.x as f32, p.y as f32) }
        }
        path.close();
    }
    let path = path.finish()?;
    let bounds = path.bounds();
    if bounds.right() < 0.0
        || bounds.bottom() < 0.0
        || bounds.left() > settings.width as f32
        || bounds.top() > settings.height as f32
    {
        return None;
    }
    let mut mask = Mask::new(settings.width, settings.height)?;
    mask.fill_path(&path, FillRule::Winding, true, Transform::identity());
    Some(mask)
}

/// Points along a curve without its end.
fn chords(curve: &CubicBez) -> impl Iterator<Item = DVec2> {
    let n = if curve.is_line(1e-9 * (curve.p3 - curve.p0).length()) { 1 } else { CHORDS };
    let curve = *curve;
    (0..n).map(move |i| curve.eval(f64::from(i) / f64::from(n)))
}

/// The part of a polygon at least `near` in front of the camera (Sutherland, Hodgman 1974).
fn clip_near(points: &[DVec3], forward: DVec3, near: f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(points.len());
    for (i, &p) in points.iter().enumerate() {
        let q = points[(i + 1) % points.len()];
        let (dp, dq) = (p.dot(forward) - near, q.dot(forward) - near);
        if dp >= 0.0 {
            out.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            out.push(p.lerp(q, dp / (dp - dq)));
        }
    }
    out
}
