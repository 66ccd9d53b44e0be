//! Values of arguments that several verbs take.

use crate::color::parse_hex;

/// A colour given as #rrggbb, linear Rec.709.
#[derive(Clone, Copy, Debug)]
pub struct Color(pub [f64; 3]);

/// Reads #rrggbb.
pub fn hex(text: &str) -> Result<Color, String> {
    parse_hex(text).map(Color).ok_or_else(|| format!("`{text}` is not of the form #rrggbb"))
}

/// A finite number more than 0, as f64.
pub fn positive_f64(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(format!("{text} is not a finite number above 0")) }
}

/// A finite number more than 0, as f32.
pub fn positive(text: &str) -> Result<f32, String> {
    let value = positive_f64(text)? as f32;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(format!("{text} is beyond the range of f32")) }
}

/// A radiance, within what scene files take as well.
pub fn radiance(text: &str) -> Result<f64, String> {
    let value = positive_f64(text)?;
    if value <= 1e12 { Ok(value) } else { Err(format!("{text} is more than 1e12")) }
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("`{text}` is not a finite number"))
}

/// A number from 0 to 1.
pub fn unit(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v| (0.0..=1.0).contains(v)).ok_or_else(|| format!("`{text}` is not between 0 and 1"))
}
