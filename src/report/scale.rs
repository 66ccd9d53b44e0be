//! [`ErrorScale`]: from signed errors to colours, the same for all maps of a comparison.

use serde::Serialize;

/// Decades between the end of the scale and the errors that are drawn as none.
const DECADES: i32 = 4;

/// A colour scale for signed errors: linear about 0, logarithmic towards both ends, so that an error of a thousandth and
/// one of a half are both seen. Dark is right, blue is too dark, orange too bright.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorScale {
    /// The error at the end of the scale, W·sr⁻¹·m⁻²; larger ones have the same colour.
    pub end: f64,
    /// Errors well below this are drawn as none; above it the scale is logarithmic, W·sr⁻¹·m⁻².
    pub linear: f64,
}

/// Colours at equal steps from the lower end to the upper, sRGB.
const COLORS: [[u8; 3]; 9] = [
    [176, 224, 255],
    [94, 174, 242],
    [36, 116, 196],
    [18, 58, 104],
    [14, 15, 18],
    [98, 44, 14],
    [192, 84, 22],
    [246, 150, 62],
    [255, 222, 164],
];

impl ErrorScale {
    /// The scale that holds errors up to `largest`, a finite number: its end is `largest`, rounded up to 1, 2 or 5 times
    /// a power of ten. Where there is no error at all it ends at 1e-6.
    pub fn new(largest: f64) -> Self {
        let largest = largest.abs().max(1e-6);
        let power = 10_f64.powf(largest.log10().floor());
        // The last is there for a power that was rounded down.
        let end = [1.0, 2.0, 5.0, 10.0, 100.0].map(|m| m * power).into_iter().find(|e| largest <= e * (1.0 + 1e-9));
        let end = end.unwrap_or(largest);
        Self { end, linear: end / 10_f64.powi(DECADES) }
    }

    /// Where an error lies: −1 at the lower end of the scale, 0 for no error, 1 at the upper end.
    pub fn place(&self, error: f64) -> f64 {
        let reach = (1.0 + error.abs().min(self.end) / self.linear).ln() / (1.0 + self.end / self.linear).ln();
        reach.copysign(error)
    }

    /// The colour of an error, sRGB.
    pub fn color(&self, error: f64) -> [u8; 3] {
        color_at(self.place(error))
    }

    /// The colours of a map, row by row, 3 bytes each.
    pub fn paint(&self, errors: &[f32]) -> Vec<u8> {
        errors.iter().flat_map(|&e| self.color(f64::from(e))).collect()
    }

    /// Errors to label on a colour bar, in order: 0 and each decade on both sides.
    pub fn ticks(&self) -> Vec<f64> {
        let side = (0..DECADES).map(|k| self.end / 10_f64.powi(k));
        let lower = side.clone().map(|e| -e);
        lower.chain([0.0]).chain(side.rev()).collect()
    }

    /// A bar of all colours, lower end on the left: `width · height` pixels of 3 bytes.
    pub fn bar(width: u32, height: u32) -> Vec<u8> {
        let step = 2.0 / f64::from(width.max(2) - 1);
        let row: Vec<u8> = (0..width).flat_map(|x| color_at(f64::from(x) * step - 1.0)).collect();
        row.repeat(height as usize)
    }
}

fn color_at(place: f64) -> [u8; 3] {
    let steps = (COLORS.len() - 1) as f64;
    let at = (place.clamp(-1.0, 1.0) + 1.0) * 0.5 * steps;
    let first = (at as usize).min(COLORS.len() - 2);
    let part = at - first as f64;
    let mix = |c: usize| f64::from(COLORS[first][c]) * (1.0 - part) + f64::from(COLORS[first + 1][c]) * part;
    core::array::from_fn(|c| mix(c).round() as u8)
}
