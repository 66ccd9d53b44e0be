//! [`Display`]: from linear radiance to the 8-bit sRGB of a PNG.

use crate::color::srgb_encode;

/// How radiance above what a display can show is brought down. Input and output are linear Rec.709; 1 is the
/// display's white.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Nothing but a clip at white: values stay measurable.
    #[default]
    Linear,
    /// `c/(1 + c)` per channel: nothing clips, all is darker.
    Reinhard,
    /// The look of the ACES reference transforms: contrast, and bright colours that fade to white.
    Aces,
    /// Khronos PBR Neutral: base colours as they are, only highlights compressed.
    Neutral,
}

impl ToneMap {
    /// Every tone map with the name it has on the command line.
    pub const ALL: [(&'static str, Self); 4] =
        [("linear", Self::Linear), ("reinhard", Self::Reinhard), ("aces", Self::Aces), ("neutral", Self::Neutral)];

    /// The tone-mapped colour, linear, each component in 0 to 1. `color` is finite and not negative.
    pub fn apply(self, color: [f64; 3]) -> [f64; 3] {
        let mapped = match self {
            Self::Linear => color,
            Self::Reinhard => reinhard(color),
            Self::Aces => aces(color),
            Self::Neutral => neutral(color),
        };
        mapped.map(|c| c.clamp(0.0, 1.0))
    }
}

/// Reinhard, Stark, Shirley, Ferwerda 2002, "Photographic tone reproduction for digital images", eq. 3, on each channel
/// where the paper takes the luminance: no colour leaves the gamut.
fn reinhard(color: [f64; 3]) -> [f64; 3] {
    color.map(|c| c / (1.0 + c))
}

/// Stephen Hill 2016, "ACES fitted" (BakingLab): the RRT and the sRGB ODT as one rational curve between two matrices.
fn aces(color: [f64; 3]) -> [f64; 3] {
    const INPUT: [[f64; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: [[f64; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let times = |m: [[f64; 3]; 3], c: [f64; 3]| m.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2]);
    // Above 1e6 the curve is at its asymptote; its squares must not overflow.
    let curve = |v: f64| {
        let v = v.min(1e6);
        (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081)
    };
    times(OUTPUT, times(INPUT, color).map(curve))
}

/// Khronos Group 2024, "Khronos PBR Neutral Tone Mapper": removes the 4 % of Fresnel reflection, keeps hues, and lets
/// what exceeds 0.76 approach white.
fn neutral(color: [f64; 3]) -> [f64; 3] {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let least = color[0].min(color[1]).min(color[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let compressed = 1.0 - d * d / (peak + d - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    color.map(|c| c * (compressed / peak) * (1.0 - white) + compressed * white)
}

/// How a picture is shown: everything between linear radiance and the bytes of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Exposure in EV: radiance is multiplied by 2^exposure; then 1 is the display's white.
    pub exposure: f64,
    /// What happens to radiance above white.
    pub tone_map: ToneMap,
    /// Whether the rounding to 8 bits is dithered, with a fixed pattern: the same picture gives the same bytes.
    pub dither: bool,
}

impl Display {
    /// sRGB bytes of a radiance at pixel (x, y). Negative components count as 0; `radiance` is finite.
    pub fn encode(&self, radiance: [f32; 3], x: u32, y: u32) -> [u8; 3] {
        self.quantize(self.develop(radiance), x, y)
    }

    /// Exposes and tone-maps: linear light of the display, 0 to 1.
    pub fn develop(&self, radiance: [f32; 3]) -> [f64; 3] {
        let gain = self.exposure.exp2();
        // The bound keeps a huge exposure finite; everything there is white in every tone map.
        self.tone_map.apply(radiance.map(|c| (f64::from(c) * gain).clamp(0.0, 1e30)))
    }

    /// sRGB bytes of the display's light at pixel (x, y).
    pub fn quantize(&self, light: [f64; 3], x: u32, y: u32) -> [u8; 3] {
        let threshold = if self.dither { interleaved_gradient_noise(x, y) } else { 0.5 };
        light.map(|c| (srgb_encode(c) * 255.0 + threshold).floor().clamp(0.0, 255.0) as u8)
    }
}

/// Jimenez 2014, "Next Generation Post Processing in Call of Duty: Advanced Warfare", p. 123: a fixed pattern in [0, 1) in which every
/// 3 × 3 block holds nearly all levels, so that the error is as fine as the pixels.
fn interleaved_gradient_noise(x: u32, y: u32) -> f64 {
    (52.982_918_9 * (0.067_110_56 * f64::from(x) + 0.005_837_15 * f64::from(y)).fract()).fract()
}
