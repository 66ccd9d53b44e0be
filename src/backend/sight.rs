//! The lights as the camera sees them, antialiased: each emission's outline is projected and rasterised by tiny-skia,
//! and laid over the surfaces that it hides. Both backends share this stage.

use super::Settings;
use super::cpu::Surfaces;
use super::emitter::Emitter;
use super::prepared::Prepared;
use crate::shape::CubicBez;
use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;
use tiny_skia::{FillRule, Mask, Path, PathBuilder, Transform};

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

/// One light's outline in the picture: a box of pixels with its radiance (xyz) and how much it hides (w).
struct Outline<'a> {
    light: &'a Emitter,
    origin: [u32; 2],
    size: [u32; 2],
    pixels: Vec<Vec4>,
}

impl Outline<'_> {
    /// What the light puts in a pixel, and hides there.
    fn at(&self, x: u32, y: u32) -> Vec4 {
        let [dx, dy] = [x.wrapping_sub(self.origin[0]), y.wrapping_sub(self.origin[1])];
        if dx >= self.size[0] || dy >= self.size[1] {
            return Vec4::ZERO;
        }
        self.pixels[(dy * self.size[0] + dx) as usize]
    }

    /// Distance of the light's plane along a ray, in lengths of its direction.
    fn distance(&self, direction: Vec3) -> f64 {
        let normal = self.light.placement.normal();
        self.light.placement.origin.dot(normal) / direction.as_dvec3().dot(normal)
    }

    /// Whether no surface stands before the light along a ray that meets its plane at `t`. A light that touches a
    /// surface is not hidden by it.
    fn is_seen(&self, surfaces: &Surfaces<'_>, direction: Vec3, t: f64) -> bool {
        let touch = (1e-5 * t).min(1e-3 * self.light.square.half / f64::from(direction.length()));
        surfaces.nearest(direction).is_none_or(|(_, hit)| f64::from(hit.t) > t - touch)
    }
}

/// Draws the lights over each other, at each sample the nearest in front.
pub fn see(prepared: &Prepared, surfaces: &Surfaces<'_>, settings: &Settings) -> Sight {
    let pixels = settings.width as usize * settings.height as usize;
    let mut sight = Sight { emission: vec![Vec3::ZERO; pixels], through: vec![1.0; pixels] };
    let lights: Vec<&[Emitter]> = prepared.layers.chunk_by(|a, b| a.light == b.light).collect();
    let outlines: Vec<_> = lights.par_iter().filter_map(|layers| outline(prepared, settings, layers)).collect();
    if outlines.is_empty() {
        return sight;
    }
    let width = settings.width as usize;
    let rows = sight.emission.par_chunks_mut(width).zip(sight.through.par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (emission, through))| {
        let mut covering = Vec::new();
        for x in 0..width {
            let there = |o: &'_ Outline<'_>| o.at(x as u32, y as u32);
            covering.clear();
            covering.extend(outlines.iter().filter(|o| there(o) != Vec4::ZERO));
            if covering.is_empty() {
                continue;
            }
            let (mut light, mut rest) = (Vec3::ZERO, 0.0);
            for &offset in &prepared.offsets {
                let direction = settings.direction(&prepared.rays, x as u32, y as u32, offset);
                // The nearest first; of two in one plane, the later in the scene.
                covering.sort_by(|a, b| {
                    let order = a.distance(direction).total_cmp(&b.distance(direction));
                    order.then(b.light.light.cmp(&a.light.light))
                });
                let mut remains = 1.0;
                for outline in &covering {
                    let t = outline.distance(direction);
                    if outline.is_seen(surfaces, direction, t) {
                        light += there(outline).truncate() * remains;
                        remains *= 1.0 - there(outline).w.min(1.0);
                    }
                }
                rest += remains;
            }
            let share = 1.0 / prepared.offsets.len() as f32;
            emission[x] = light * share;
            through[x] = rest * share;
        }
    });
    sight
}

/// The outline of one light, whose layers add up. `None` where it is out of the picture or shows its dark back.
fn outline<'a>(prepared: &Prepared, settings: &Settings, layers: &'a [Emitter]) -> Option<Outline<'a>> {
    let light = &layers[0];
    let front = -light.placement.normal().dot(light.placement.origin);
    if front < 0.0 && !light.two_sided {
        return None;
    }
    let paths: Vec<_> = layers.iter().filter_map(|e| Some((e, projected(prepared, settings, e)?))).collect();
    let edge = |low: f32, limit: u32| (low.max(0.0) as u32).min(limit);
    let reach = |f: fn(&Path) -> f32, pick: fn(f32, f32) -> f32| paths.iter().map(|(_, p)| f(p)).reduce(pick);
    let left = edge(reach(|p| p.bounds().left(), f32::min)?.floor(), settings.width);
    let top = edge(reach(|p| p.bounds().top(), f32::min)?.floor(), settings.height);
    let right = edge(reach(|p| p.bounds().right(), f32::max)?.ceil() + 1.0, settings.width);
    let bottom = edge(reach(|p| p.bounds().bottom(), f32::max)?.ceil() + 1.0, settings.height);
    let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
    let mut mask = Mask::new(width, height)?;
    let mut pixels = vec![Vec4::ZERO; width as usize * height as usize];
    for (layer, path) in &paths {
        mask.clear();
        mask.fill_path(path, FillRule::Winding, true, Transform::from_translate(-(left as f32), -(top as f32)));
        let paint = layer.radiance.extend(layer.opacity) / 255.0;
        pixels.iter_mut().zip(mask.data()).for_each(|(pixel, &c)| *pixel += paint * f32::from(c));
    }
    Some(Outline { light, origin: [left, top], size: [width, height], pixels })
}

/// One emission's contours in pixels. `None` where all of it is behind the camera.
fn projected(prepared: &Prepared, settings: &Settings, emitter: &Emitter) -> Option<Path> {
    let rays = &prepared.rays;
    let (forward, right, up) =
        (rays.forward.truncate().as_dvec3(), rays.right.truncate().as_dvec3(), rays.up.truncate().as_dvec3());
    let near = NEAR * emitter.square.half;
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
    path.finish()
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
