//! How pictures are shown, by the flags that all verbs share.

use super::values::finite;
use crate::film::{Display, ToneMap};
use clap::ValueEnum;

/// How pictures are shown.
#[derive(Debug, clap::Args)]
pub struct DisplayArgs {
    /// Exposure of PNGs, stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    exposure: f64,
    /// Tone mapping of PNGs
    #[arg(long, value_enum, default_value_t = ToneMapArg::Neutral)]
    tone_map: ToneMapArg,
}

impl DisplayArgs {
    /// Without dither.
    pub fn display(&self) -> Display {
        Display { exposure: self.exposure, tone_map: self.tone_map.into(), dither: false }
    }
}

/// Tone mapping by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ToneMapArg {
    /// Clip at white
    Linear,
    /// Reinhard's curve
    Reinhard,
    /// ACES film curve
    Aces,
    /// Khronos PBR Neutral: keeps hues, compresses highlights only
    Neutral,
}

impl From<ToneMapArg> for ToneMap {
    fn from(arg: ToneMapArg) -> Self {
        match arg {
            ToneMapArg::Linear => Self::Linear,
            ToneMapArg::Reinhard => Self::Reinhard,
            ToneMapArg::Aces => Self::Aces,
            ToneMapArg::Neutral => Self::Neutral,
        }
    }
}
