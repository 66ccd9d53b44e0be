//! A light as a picture: coverage of its shapes by tiny-skia, times their radiance.

use super::Layer;
use crate::picture::Picture;
use crate::shape::{Bounds, Contour, CubicBez, Shape};
use glam::{DVec2, Vec3, Vec4};
use rayon::prelude::*;
use tiny_skia::{FillRule, Mask, Path, PathBuilder, Transform};

/// Samples of tiny-skia's pixels along each side of a texel: with its own 4 × 4, coverage has 256 steps.
const SUPER: usize = 4;
/// Texels along each side of a tile, which is rasterised at once.
const TILE: usize = 128;
/// Largest distance of a chord from its curve, in samples.
const FLATNESS: f64 = 0.05;
/// Most chords of one curve.
const CHORDS: f64 = 4096.0;
/// Most places along each side of a texel at which a finer picture is looked up.
const LOOKS: u32 = 8;

/// What a light shows over its bounding rectangle: xyz the sum of its layers' radiance × coverage × picture,
/// W·sr⁻¹·m⁻², w 1 everywhere, since all of the rectangle counts.
///
/// `size`: texels along the longer side, at least 1. A layer that is the rectangle itself comes out as its radiance to the
/// bit. The mean over the picture is the layers' mean within 1e-3 of the brightest, from 64 texels on. `None` where the
/// rectangle has no area.
pub fn light_picture(layers: &[Layer], size: u32) -> Option<Picture> {
    let bounds = layers.iter().map(|l| l.shape.extent()).fold(Bounds::EMPTY, Bounds::union);
    let mut canvas = Canvas::new(bounds, size)?;
    for layer in layers {
        let radiance = layer.radiance.as_vec3();
        canvas.lay(&layer.shape, layer.picture.as_deref(), |color| (color * radiance).extend(0.0));
    }
    canvas.picture.texels.iter_mut().for_each(|texel| texel.w = 1.0);
    Some(canvas.picture)
}

/// The colours of one shape over its bounding rectangle: xyz coverage × `colors`, w the coverage.
///
/// `size`: texels along the longer side, at least 1. `None` where the rectangle has no area.
pub fn shape_picture(shape: &Shape, colors: &Picture, size: u32) -> Option<Picture> {
    let mut canvas = Canvas::new(shape.extent(), size)?;
    canvas.lay(shape, Some(colors), |color| color.extend(1.0));
    Some(canvas.picture)
}

/// A picture that layers are laid on.
struct Canvas {
    picture: Picture,
    /// Samples per light-space unit.
    samples: DVec2,
}

impl Canvas {
    fn new(bounds: Bounds, size: u32) -> Option<Self> {
        let extent = bounds.size();
        if !(extent.is_finite() && extent.min_element() > 0.0 && size > 0) {
            return None;
        }
        let texels = (extent / extent.max_element() * f64::from(size)).round().max(DVec2::ONE);
        let [width, height] = texels.to_array().map(|v| v as u32);
        let texels_of_nothing = vec![Vec4::ZERO; width as usize * height as usize];
        let picture = Picture { width, height, texels: texels_of_nothing, low: bounds.min, high: bounds.max };
        Some(Self { picture, samples: texels * SUPER as f64 / extent })
    }

    /// Adds `paint(colour) × coverage`; the colour is 1 without a picture.
    fn lay(&mut self, shape: &Shape, colors: Option<&Picture>, paint: impl Fn(Vec3) -> Vec4 + Sync) {
        let Picture { width, height, low, high, .. } = self.picture;
        let (width, height) = (width as usize, height as usize);
        let contours: Vec<Flat> = shape.contours().iter().map(|c| self.flatten(c)).collect();
        let texel = (high - low) / DVec2::new(width as f64, height as f64);
        let place = |x: usize, y: usize, within: DVec2| {
            DVec2::new(low.x + (x as f64 + within.x) * texel.x, high.y - (y as f64 + within.y) * texel.y)
        };
        let looks = colors.map(|colors| Looks::new(colors, texel));
        self.picture.texels.par_chunks_mut(width * TILE).enumerate().for_each(|(band, rows)| {
            for left in (0..width).step_by(TILE) {
                let (across, down) = (TILE.min(width - left), rows.len() / width);
                let Some(coverage) = coverage(&contours, [left, band * TILE], [across, down]) else { continue };
                for (i, covered) in coverage.into_iter().enumerate().filter(|&(_, covered)| covered > 0.0) {
                    let (x, y) = (left + i % across, i / across);
                    let color =
                        looks.as_ref().map_or(Vec3::ONE, |l| l.mean(|within| place(x, band * TILE + y, within)));
                    rows[y * width + x] += paint(color) * covered;
                }
            }
        });
    }

    /// A contour as chords, in samples, y down.
    fn flatten(&self, contour: &Contour) -> Flat {
        let corner = DVec2::new(self.picture.low.x, self.picture.high.y);
        let to_samples = |p: DVec2| (p - corner) * DVec2::new(self.samples.x, -self.samples.y);
        let chords = |curve: &CubicBez| {
            let [p0, p1, p2, p3] = curve.points().map(to_samples);
            // Wang 1984: √(3·2/8·|Δ²|/tolerance) chords are that flat.
            let bend = (p0 - 2.0 * p1 + p2).length().max((p1 - 2.0 * p2 + p3).length());
            let n = (0.75 * bend / FLATNESS).sqrt().ceil().clamp(1.0, CHORDS) as u32;
            let curve = CubicBez::new(p0, p1, p2, p3);
            (0..n).map(move |i| curve.eval_exact(f64::from(i) / f64::from(n)))
        };
        let points: Vec<DVec2> = contour.curves().iter().flat_map(chords).collect();
        Flat { bounds: Bounds::of(points.iter().copied()), points }
    }
}

/// A contour of chords.
struct Flat {
    bounds: Bounds,
    points: Vec<DVec2>,
}

/// How much of each texel of a tile the contours cover, 0 to 1. `None` where they keep off the tile.
fn coverage(contours: &[Flat], origin: [usize; 2], size: [usize; 2]) -> Option<Vec<f32>> {
    let in_samples = |v: [usize; 2]| DVec2::new(v[0] as f64, v[1] as f64) * SUPER as f64;
    let (origin, extent) = (in_samples(origin), in_samples(size));
    let tile = Bounds { min: origin, max: origin + extent };
    let path = path(contours.iter().filter(|c| c.bounds.overlaps(tile)), origin)?;
    let [across, down] = size;
    let mut mask = Mask::new((across * SUPER) as u32, (down * SUPER) as u32)?;
    mask.fill_path(&path, FillRule::Winding, true, Transform::identity());
    let samples = mask.data();
    let texel = |i: usize| {
        let corner = i / across * SUPER * across * SUPER + i % across * SUPER;
        let row = |y: usize| &samples[corner + y * across * SUPER..][..SUPER];
        let sum: u32 = (0..SUPER).flat_map(row).map(|&s| u32::from(s)).sum();
        sum as f32 / (255 * SUPER * SUPER) as f32
    };
    Some((0..across * down).map(texel).collect())
}

/// The contours relative to `origin`.
fn path<'a>(contours: impl Iterator<Item = &'a Flat>, origin: DVec2) -> Option<Path> {
    let mut path = PathBuilder::new();
    for contour in contours {
        for (i, p) in contour.points.iter().map(|p| (*p - origin).as_vec2()).enumerate() {
            if i == 0 { path.move_to(p.x, p.y) } else { path.line_to(p.x, p.y) }
        }
        path.close();
    }
    path.finish()
}

/// Looks up a picture that may be finer than the canvas.
struct Looks<'a> {
    colors: &'a Picture,
    /// Looks along x and y of a texel.
    counts: [u32; 2],
}

impl<'a> Looks<'a> {
    fn new(colors: &'a Picture, texel: DVec2) -> Self {
        let finer = texel / (colors.high - colors.low) * DVec2::new(f64::from(colors.width), f64::from(colors.height));
        Self { colors, counts: finer.to_array().map(|n| (n.ceil() as u32).clamp(1, LOOKS)) }
    }

    /// The mean colour of a texel; `place` maps its 0..1 to light space.
    fn mean(&self, place: impl Fn(DVec2) -> DVec2) -> Vec3 {
        let [across, down] = self.counts;
        let look = |i: u32| {
            let cell = DVec2::new(f64::from(i % across) + 0.5, f64::from(i / across) + 0.5);
            self.colors.sample(place(cell / DVec2::new(f64::from(across), f64::from(down)))).truncate()
        };
        (0..across * down).map(look).sum::<Vec3>() / (across * down) as f32
    }
}
