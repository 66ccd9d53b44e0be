//! The mean colour of a picture embedded in an SVG.

use super::layers::Premultiplied;
use crate::color::srgb_decode;
use image::{ImageReader, Limits};
use std::io::Cursor;

/// Most pixels along either side.
const MAX_SIDE: u32 = 16_384;
/// Most bytes decoding may take.
const MAX_DECODED: u64 = 512 << 20;

/// Mean of the linear colours of a PNG or JPEG, weighted by alpha, with the mean alpha; or what is wrong with it.
pub(super) fn mean_color(bytes: &[u8]) -> Result<Premultiplied, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODED);
    reader.limits(limits);
    let pixels = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    let linear: Vec<f64> = (0..=255).map(|v| srgb_decode(f64::from(v) / 255.0)).collect();
    let mut sum = [0.0; 4];
    for p in pixels.pixels() {
        let alpha = f64::from(p.0[3]) / 255.0;
        for (channel, sum) in sum.iter_mut().enumerate().take(3) {
            *sum += alpha * linear[usize::from(p.0[channel])];
        }
        sum[3] += alpha;
    }
    let count = pixels.pixels().len().max(1) as f64;
    let [r, g, b, alpha] = sum.map(|v| v / count);
    Ok(Premultiplied { color: [r, g, b], alpha })
}
