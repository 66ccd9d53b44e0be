//! 8-bit sRGB PNG.

use super::display::Display;
use super::{Film, FilmError};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;
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
    let place = |i: usize| ((i % film.width as usize) as u32, (i / film.width as usize) as u32);
    if let Some((i, radiance)) = film.beauty().enumerate().find(|(_, radiance)| !radiance.iter().all(|c| c.is_finite()))
    {
        let (x, y) = place(i);
        return Err(FilmError::NotFinite { path: path.into(), x, y, radiance });
    }
    let mut bytes = vec![0; film.width as usize * film.height as usize * 3];
    bytes.par_chunks_mut(3).with_min_len(1 << 10).enumerate().for_each(|(i, pixel)| {
        let (x, y) = place(i);
        pixel.copy_from_slice(&shown(film, display, i, x, y));
    });
    Ok(bytes)
}

/// One pixel.
fn shown(film: &Film, display: &Display, i: usize, x: u32, y: u32) -> [u8; 3] {
    let matte = film.matte[i];
    if matte <= 0.0 {
        return display.encode(film.radiance(i), x, y);
    }
    let light = display.develop(film.emission[i].map(|c| c / matte));
    let rest = 1.0 - matte;
    let behind = if rest > 1e-3 { display.develop(film.behind(i).map(|c| c / rest)) } else { [0.0; 3] };
    let [m, r] = [matte, rest].map(f64::from);
    display.quantize(core::array::from_fn(|c| light[c] * m + behind[c] * r), x, y)
}

/// Encodes 8-bit sRGB pixels, row by row from the top.
pub(super) fn encode_rgb(bytes: &[u8], width: u32, height: u32, out: impl Write, path: &Path) -> Result<(), FilmError> {
    PngEncoder::new_with_quality(out, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| FilmError::Encode { path: path.into(), message: e.to_string() })
}
