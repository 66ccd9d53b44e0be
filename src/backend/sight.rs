//! The lights as the camera sees them, antialiased: each emission's outline is projected and rasterised by tiny-skia,
//! and laid over the surfaces that it hides. Both backends share this stage.

use super::Settings;
use super::emitter::Emitter;
use super::prepared::Prepared;
use super::silhouette::Body;
use super::surfaces::Surfaces;
use crate::picture::Picture;
use crate::shape::{Contour, CubicBez};
use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;
use tiny_skia::{FillRule, Mask, Path, PathBuilder, Transform};

/// Chords that stand for one curve in the mask: a sagitta under 1/100 pixel for curves up to 2000 pixels long.
const CHORDS: u32 = 64;
/// Nearest visible distance over the light's own size.
const NEAR: f64 = 1e-4;
/// How far outlines are drawn, in halves of the picture from its middle: tiny-skia's numbers are f32.
const FAR_OUT: f64 = 16.0;

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
    body: Option<Body>,
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

    /// Distance of the light's plane, or of the body, along a ray, in lengths of its direction.
    fn distance(&self, direction: Vec3) -> f64 {
        if let Some(body) = &self.body {
            return body.entry(direction.as_dvec3());
        }
        let normal = self.light.placement.normal();
        self.light.placement.origin.dot(normal) / direction.as_dvec3().dot(normal)
    }

    /// Whether no surface stands before the light along a ray that meets it at `t`. A light that touches a
    /// surface is not hidden by it.
    fn is_seen(&self, prepared: &Prepared, surfaces: &Surfaces, direction: Vec3, t: f64) -> bool {
        let touch = (1e-5 * t).min(1e-3 * self.light.world_half() / f64::from(direction.length()));
        surfaces.nearest(&prepared.triangles, direction).is_none_or(|(_, hit)| f64::from(hit.t) > t - touch)
    }
}

/// Draws the lights over each other, at each sample the nearest in front.
pub fn see(prepared: &Prepared, surfaces: &Surfaces, settings: &Settings) -> Sight {
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
                    if outline.is_seen(prepared, surfaces, direction, t) {
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

/// Most looks at a picture along each side of a pixel.
const MAX_LOOKS: f64 = 16.0;

/// A part of the camera's picture.
struct View<'a> {
    prepared: &'a Prepared,
    settings: &'a Settings,
    origin: [u32; 2],
}

impl View<'_> {
    /// The mean colour of a light's picture in a pixel, by about one look per texel.
    fn color(&self, layer: &Emitter, picture: &Picture, x: u32, y: u32) -> Vec4 {
        let at = |dx: f32, dy: f32| self.light_point(layer, x, y, [dx, dy]);
        let texel = picture.texel_size();
        let [across, down] = [at(1.0, 0.5) - at(0.0, 0.5), at(0.5, 1.0) - at(0.5, 0.0)].map(|step| {
            let looks = (step / texel).length();
            // Where the pixel looks along the plane there is no end to it.
            if looks.is_finite() { looks.ceil().clamp(1.0, MAX_LOOKS) as u32 } else { MAX_LOOKS as u32 }
        });
        let look = |i: u32| {
            let place = |i: u32, count: u32| (i as f32 + 0.5) / count as f32;
            let p = at(place(i % across, across), place(i / across, down));
            if p.is_finite() { picture.sample(p) } else { Vec4::ZERO }
        };
        (0..across * down).map(look).sum::<Vec4>() / (across * down) as f32
    }

    /// Where the light's plane is met by the ray through a place in a pixel.
    fn light_point(&self, layer: &Emitter, x: u32, y: u32, offset: [f32; 2]) -> DVec2 {
        let ray =
            self.settings.direction(&self.prepared.rays, self.origin[0] + x, self.origin[1] + y, offset).as_dvec3();
        let normal = layer.placement.normal();
        layer.placement.light_point(ray * (layer.placement.origin.dot(normal) / ray.dot(normal)))
    }
}

/// The outline of one light, whose layers add up. `None` where it is out of the picture or shows its dark
/// back or inside.
fn outline<'a>(prepared: &Prepared, settings: &Settings, layers: &'a [Emitter]) -> Option<Outline<'a>> {
    let light = &layers[0];
    let near = NEAR * light.world_half();
    let body = Body::of(light);
    let paths: Vec<_> = if let Some(body) = &body {
        vec![(light, projected(prepared, settings, [body.silhouette()?], near)?)]
    } else {
        let front = -light.placement.normal().dot(light.placement.origin);
        if front < 0.0 && !light.two_sided {
            return None;
        }
        let path = |e| Some((e, projected(prepared, settings, contours(e), NEAR * e.world_half())?));
        layers.iter().filter_map(path).collect()
    };
    let edge = |low: f32, limit: u32| (low.max(0.0) as u32).min(limit);
    let reach = |f: fn(&Path) -> f32, pick: fn(f32, f32) -> f32| paths.iter().map(|(_, p)| f(p)).reduce(pick);
    let left = edge(reach(|p| p.bounds().left(), f32::min)?.floor(), settings.width);
    let top = edge(reach(|p| p.bounds().top(), f32::min)?.floor(), settings.height);
    let right = edge(reach(|p| p.bounds().right(), f32::max)?.ceil() + 1.0, settings.width);
    let bottom = edge(reach(|p| p.bounds().bottom(), f32::max)?.ceil() + 1.0, settings.height);
    let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
    let mut mask = Mask::new(width, height)?;
    let mut pixels = vec![Vec4::ZERO; width as usize * height as usize];
    let view = View { prepared, settings, origin: [left, top] };
    for (layer, path) in &paths {
        mask.clear();
        mask.fill_path(path, FillRule::Winding, true, Transform::from_translate(-(left as f32), -(top as f32)));
        let paint = layer.radiance.extend(layer.opacity) / 255.0;
        let rows = pixels.par_chunks_mut(width as usize).zip(mask.data().par_chunks(width as usize));
        rows.enumerate().for_each(|(y, (pixels, covered))| {
            for (x, (pixel, &c)) in pixels.iter_mut().zip(covered).enumerate().filter(|(_, (_, c))| **c > 0) {
                let color = layer.picture.as_ref().map_or(Vec4::ONE, |p| view.color(layer, p, x as u32, y as u32));
                *pixel += paint * color * f32::from(c);
            }
        });
    }
    Some(Outline { light, body, origin: [left, top], size: [width, height], pixels })
}

/// Closed polygons in pixels. `None` where all of them are behind the camera.
fn projected(
    prepared: &Prepared,
    settings: &Settings,
    polygons: impl IntoIterator<Item = Vec<DVec3>>,
    near: f64,
) -> Option<Path> {
    let rays = &prepared.rays;
    let (forward, right, up) =
        (rays.forward.truncate().as_dvec3(), rays.right.truncate().as_dvec3(), rays.up.truncate().as_dvec3());
    let size = DVec2::new(f64::from(settings.width), f64::from(settings.height));
    let to_pixel = |p: DVec3| {
        let depth = p.dot(forward);
        let ndc = DVec2::new(p.dot(right) / right.length_squared(), -p.dot(up) / up.length_squared()) / depth;
        (ndc + 1.0) * 0.5 * size
    };
    // Inside is where the sides of a wide pyramid are positive, and before the camera.
    let side = |axis: DVec3| forward * FAR_OUT + axis / axis.length_squared();
    let planes = [(forward, near), (side(right), 0.0), (side(-right), 0.0), (side(up), 0.0), (side(-up), 0.0)];
    let mut path = PathBuilder::new();
    for mut polygon in polygons {
        for (normal, distance) in planes {
            polygon = clip(polygon, normal, distance);
        }
        for (i, p) in polygon.into_iter().map(to_pixel).enumerate() {
            if i == 0 { path.move_to(p.x as f32, p.y as f32) } else { path.line_to(p.x as f32, p.y as f32) }
        }
        path.close();
    }
    path.finish()
}

/// The contours of an emission, as polygons.
fn contours(emitter: &Emitter) -> impl Iterator<Item = Vec<DVec3>> {
    let points = |c: &Contour| c.curves().iter().flat_map(chords).map(|p| emitter.placement.point(p)).collect();
    emitter.shape.contours().iter().map(points)
}

/// Points along a curve without its end.
fn chords(curve: &CubicBez) -> impl Iterator<Item = DVec2> {
    let n = if curve.is_line(1e-9 * (curve.p3 - curve.p0).length()) { 1 } else { CHORDS };
    let curve = *curve;
    (0..n).map(move |i| curve.eval(f64::from(i) / f64::from(n)))
}

/// The part of a polygon where p·normal is at least `distance` (Sutherland, Hodgman 1974).
fn clip(points: Vec<DVec3>, normal: DVec3, distance: f64) -> Vec<DVec3> {
    let height = |p: DVec3| p.dot(normal) - distance;
    if points.iter().all(|&p| height(p) >= 0.0) {
        return points;
    }
    let mut out = Vec::with_capacity(points.len());
    for (i, &p) in points.iter().enumerate() {
        let q = points[(i + 1) % points.len()];
        let (dp, dq) = (height(p), height(q));
        if dp >= 0.0 {
            out.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            out.push(p.lerp(q, dp / (dp - dq)));
        }
    }
    out
}
