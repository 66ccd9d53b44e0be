//! Heat maps: a number for each pixel as a colour.

use super::{FilmError, Pending, png};
use std::path::Path;

/// The colour map *viridis* (Stéfan van der Walt and Nathaniel Smith for matplotlib, 2015, CC0), sRGB, at 33 equal steps: even
/// to the eye, dark to light, and told apart by the colour-blind. Between the steps it is within 2 of 255 of the original.
#[rustfmt::skip]
const VIRIDIS: [[u8; 3]; 33] = [
    [68, 1, 84], [71, 13, 96], [72, 24, 106], [72, 35, 116], [71, 45, 123], [69, 54, 129],
    [66, 64, 134], [63, 73, 137], [59, 82, 139], [55, 90, 141], [51, 99, 141], [47, 106, 142],
    [44, 114, 142], [41, 122, 142], [38, 129, 142], [35, 137, 142], [33, 144, 140], [31, 152, 139],
    [31, 159, 136], [33, 166, 133], [40, 174, 128], [49, 181, 123], [62, 188, 116], [76, 194, 108],
    [93, 201, 99], [110, 206, 88], [130, 211, 76], [150, 216, 63], [171, 220, 50], [192, 223, 36],
    [213, 226, 26], [234, 229, 26], [253, 231, 37],
];

/// What the colours of a heat map stand for: the darkest is `min`, the lightest `max`, evenly between. 0 is black.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Scale {
    /// Least value above 0; 0 where there is none.
    pub min: f32,
    /// Greatest value.
    pub max: f32,
    /// Mean of the values above 0; 0 where there is none.
    pub mean: f32,
}

impl Scale {
    /// The scale of values that are finite and 0 or more.
    pub fn of(values: &[f32]) -> Self {
        let above = || values.iter().copied().filter(|&v| v > 0.0);
        let count = above().count();
        if count == 0 {
            return Self { min: 0.0, max: 0.0, mean: 0.0 };
        }
        let sum: f64 = above().map(f64::from).sum();
        Self {
            min: above().fold(f32::INFINITY, f32::min),
            max: above().fold(0.0, f32::max),
            mean: (sum / count as f64) as f32,
        }
    }

    /// The colour of a value, sRGB.
    pub fn color(&self, value: f32) -> [u8; 3] {
        if value <= 0.0 {
            return [0; 3];
        }
        let last = VIRIDIS.len() - 1;
        let range = self.max - self.min;
        let place = if range > 0.0 { ((value - self.min) / range).clamp(0.0, 1.0) * last as f32 } else { 0.0 };
        let step = (place as usize).min(last - 1);
        let part = place - step as f32;
        let mix = |c: usize| f32::from(VIRIDIS[step][c]) * (1.0 - part) + f32::from(VIRIDIS[step + 1][c]) * part;
        core::array::from_fn(|c| mix(c).round() as u8)
    }
}

/// Makes the PNG of `values`, one for each pixel row by row from the top, finite and 0 or more, with its scale.
///
/// # Errors
/// A number of values that is not `width` times `height`, no pixels, or what the system or the encoder says.
pub fn encode(path: &Path, width: u32, height: u32, values: &[f32]) -> Result<(Pending, Scale), FilmError> {
    let scale = Scale::of(values);
    if values.is_empty() || values.len() != width as usize * height as usize {
        return Err(FilmError::Size { path: path.into(), width, height, layers: [values.len(); 3] });
    }
    let bytes: Vec<u8> = values.iter().flat_map(|&v| scale.color(v)).collect();
    Ok((Pending::new(path, |out| png::encode_rgb(&bytes, width, height, out, path))?, scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_run_from_dark_to_light() {
        let values = [0.0, 5.0, 7.0, 11.0, 15.0];
        let scale = Scale::of(&values);
        assert_eq!(scale, Scale { min: 5.0, max: 15.0, mean: 9.5 });
        // A fifth and three fifths along matplotlib's own 256 entries, to the integer.
        let expected = [[0; 3], VIRIDIS[0], [65, 68, 135], [34, 168, 132], VIRIDIS[32]];
        assert_eq!(values.map(|v| scale.color(v)), expected);
        let lightness = |v: f32| scale.color(v).map(u32::from).iter().sum::<u32>();
        assert!((1..=50).all(|i| lightness(5.0 + i as f32 * 0.2) > lightness(4.8 + i as f32 * 0.2)));
        assert_eq!(Scale::of(&[0.0]), Scale { min: 0.0, max: 0.0, mean: 0.0 });
        assert_eq!(Scale::of(&[0.0, 3.0, 3.0]).color(3.0), VIRIDIS[0]);
    }
}
