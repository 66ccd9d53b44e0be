//! 8-bit sRGB PNG.

use super::display::Display;
use super::{Film, FilmError};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::Path;

/// Encodes the picture as seen through `display`.
pub(super) fn encode(film: &Film, display: &Display, out: impl Write, path: &Path) -> Result<(), FilmError> {
    encode_rgb(&displayed(film, display, path)?, film.width, film.height, out, path)
}

/// The picture as seen through `display`, row by row from the top. A pixel that isn't finite is an error: it has no colour.
///
/// A light is often many times brighter than white. Its edge would stay jagged if radiance were averaged over the pixel
/// and tone-mapped then, so light and what lies behind it are tone-mapped apart and mixed by the matte.
pub(super) fn displayed(film: &Film, display: &Display, path: &Path) -> Result<Vec<u8>, FilmError> {
    let mut bytes = Vec::with_capacity(film.width as usize * film.height as usize * 3);
    for (i, radiance) in film.beauty().enumerate() {
        let (x, y) = ((i % film.width as usize) as u32, (i / film.width as usize) as u32);
        if !radiance.iter().all(|c| c.is_finite()) {
            return Err(FilmError::NotFinite { path: path.into(), x, y, radiance });
        }
        let matte = film.matte[i];
        if matte <= 0.0 {
            bytes.extend(display.encode(radiance, x, y));
            continue;
        }
        let light = display.develop(film.emission[i].map(|c| c / matte));
        let rest = 1.0 - matte;
        let behind = if rest > 1e-3 { display.develop(film.behind(i).map(|c| c / rest)) } else { [0.0; 3] };
        let [m, r] = [matte, rest].map(f64::from);
        bytes.extend(display.quantize(core::array::from_fn(|c| light[c] * m + behind[c] * r), x, y));
    }
    Ok(bytes)
}

/// Encodes 8-bit sRGB pixels, row by row from the top.
pub(super) fn encode_rgb(bytes: &[u8], width: u32, height: u32, out: impl Write, path: &Path) -> Result<(), FilmError> {
    PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive)
        .write_image(bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| FilmError::Encode { path: path.into(), message: e.to_string() })
}
