//! The colours of [`super::Trial::Picture`]: as a picture, and as flat bands that a contour integral can take.

use crate::light::Layer;
use crate::outline::{OutlineError, overlap};
use crate::picture::Picture;
use crate::shape::{Bounds, Shape};
use glam::{DAffine2, DVec2, Vec4};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};
use std::sync::Arc;

/// Texels along a side.
const SIDE: u32 = 256;

/// Colours at equal steps up the diagonal, linear Rec.709; between them they change in proportion.
const STOPS: [[f32; 3]; 3] = [[1.0, 0.6, 0.1], [0.8, 0.1, 0.3], [0.1, 0.2, 1.0]];

/// Where the colours change fastest: to the right and up.
const ACROSS: DVec2 = DVec2::splat(FRAC_1_SQRT_2);

/// Flat bands in place of the gradient. With twice as many, reflections change by less than 1e-6 (rms; test
/// `bands_are_narrow_enough`).
pub const BANDS: u32 = 64;

/// A gradient over a box, from its lower left corner to its upper right one. Bilinear interpolation leaves it as it is, but for
/// the texels at a stop.
pub(super) fn gradient(bounds: Bounds) -> Picture {
    let Bounds { min: low, max: high } = bounds;
    let texel = (high - low) / f64::from(SIDE);
    let color = |i: u32| {
        let from_left_and_top = DVec2::new(f64::from(i % SIDE), f64::from(i / SIDE)) + 0.5;
        let p = DVec2::new(low.x, high.y) + from_left_and_top * texel * DVec2::new(1.0, -1.0);
        let place = (p - low).dot(ACROSS) / (high - low).dot(ACROSS) * (STOPS.len() - 1) as f64;
        let stop = (place as usize).min(STOPS.len() - 2);
        let [from, to] = [STOPS[stop], STOPS[stop + 1]].map(|[r, g, b]| Vec4::new(r, g, b, 1.0));
        from.lerp(to, (place - stop as f64) as f32)
    };
    Picture { width: SIDE, height: SIDE, texels: (0..SIDE * SIDE).map(color).collect(), low, high }
}

/// `layer` in `count` bands across the gradient of its picture, each of the colour along its middle. A layer without a picture is
/// as it was.
///
/// # Errors
/// What cutting says.
pub fn bands(layer: &Layer, count: u32) -> Result<Vec<Layer>, OutlineError> {
    let Some(picture) = &layer.picture else { return Ok(vec![layer.clone()]) };
    // The colours change upwards then.
    let turn = DAffine2::from_angle(FRAC_PI_4);
    let back = turn.inverse();
    let turned = layer.shape.transformed(turn);
    let Bounds { min, max } = turned.bounds();
    let step = (max.y - min.y) / f64::from(count);
    let mut layers = Vec::new();
    for band in 0..count {
        let low = min.y + step * f64::from(band);
        let strip = Shape::rectangle(DVec2::new(min.x - step, low), DVec2::new(max.x + step, low + step));
        let part = overlap::intersection(&turned, &strip);
        let part = part.map_err(|source| OutlineError::Overlap { what: format!("band {band}"), source })?;
        if part.is_empty() {
            continue;
        }
        let middle = DVec2::new(part.bounds().center().x, low + 0.5 * step);
        let color = picture.sample(back.transform_point2(middle)).truncate().as_dvec3();
        layers.push(Layer {
            shape: part.transformed(back),
            radiance: layer.radiance * color,
            opacity: layer.opacity,
            picture: None,
        });
    }
    Ok(layers)
}

/// The layer with such colours.
pub(super) fn colored(layer: Layer) -> Layer {
    let picture = Some(Arc::new(gradient(layer.shape.bounds())));
    Layer { picture, ..layer }
}
