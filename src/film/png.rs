//! 8-bit sRGB PNG.

use super::display::Display;
use super::{Film, FilmError};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::Path;

/// Encodes the sum of the layers as seen through `display`. A pixel that isn't finite is an error: it has no colour.
pub(super) fn encode(film: &Film, display: &Display, out: impl Write, path: &Path) -> Result<(), FilmError> {
    let mut bytes = Vec::with_capacity(film.width as usize * film.height as usize * 3);
    for (i, radiance) in film.beauty().enumerate() {
        let (x, y) = ((i % film.width as usize) as u32, (i / film.width as usize) as u32);
        if !radiance.iter().all(|c| c.is_finite()) {
            return Err(FilmError::NotFinite { path: path.into(), x, y, radiance });
        }
        bytes.extend(display.encode(radiance, x, y));
    }
    PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive)
        .write_image(&bytes, film.width, film.height, ExtendedColorType::Rgb8)
        .map_err(|e| FilmError::Encode { path: path.into(), message: e.to_string() })
}
