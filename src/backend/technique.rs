//! [`Technique`]: what can evaluate a light's integral, and by which names users call it.

use super::Skips;
use core::fmt;
use core::str::FromStr;

/// How a light's integral is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Technique {
    /// The chord–moment tree: error bounded by the tolerance, cost nearly independent of the curve count.
    #[default]
    Tree,
    /// Adaptive contour integration in float64: the yardstick, right to 1e-10 and slow. CPU only; a light with a picture
    /// is an error.
    Exact,
    /// Curves subdivided by what they contribute, clipped by roots (Kuge, Yatagawa, Morishima, JCGT 11(1), 2022).
    Kuge {
        /// Least contribution of a triangle that is subdivided; the paper's own for each lobe where `None`.
        eps: Option<f32>,
    },
    /// Every curve a polygon of equal steps in its parameter, every edge clipped (Heitz, Dupuy, Hill, Neubelt, SIGGRAPH 2016).
    Uniform {
        /// Edges per curve, 1 to [`MAX_SEGMENTS`]; a line is one edge.
        segments: u32,
    },
    /// The bounding rectangle with a prefiltered mask (Heitz et al. 2016, §5).
    Quad {
        /// Texels along the longer side of the mask, [`MASK_SIZES`].
        mask: u32,
    },
    /// The contour by the tree, the colours by a prefiltered picture (Kuge et al. 2022, §3.1).
    Textured,
    /// Petryaev's *Polygons as lights*.
    Pal {
        /// What the polygon is projected on.
        basis: Basis,
    },
    /// The representative point (Karis 2013) of a sphere, disc, rectangle or tube; of the bounding rectangle for outlines.
    Representative,
    /// Monte Carlo with multiple importance sampling. CPU only.
    Reference(Sampling),
}

/// At which planes a specular lobe is clipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Horizons {
    /// At z = 0 of cosine space and at the surface's true horizon, the lobe's mass below the latter made up for.
    #[default]
    Both,
    /// At z = 0 of cosine space only, as published: a light that dips below the surface leaks.
    Cosine,
}

/// What `pal` projects a polygon on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Basis {
    /// The plane across the direction to the polygon's centroid.
    #[default]
    Centred,
    /// Across the direction to the mean of its corners, the nearer ones weighing more.
    Weighted,
    /// The centred one, projected on from farther back.
    Biased,
}

/// How the Monte Carlo reference samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Light samples per pixel at most, 1 to [`MAX_SPP`]; but at least two for each of the picture's samples are taken.
    pub spp: u32,
    /// Standard error of a pixel's radiance at which its sampling ends early, W·sr⁻¹·m⁻².
    pub max_error: Option<f32>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// What the surface reflects by.
    pub lobe: ReferenceLobe,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { spp: 256, max_error: None, seed: 0, lobe: ReferenceLobe::Ggx }
    }
}

/// What the Monte Carlo reference integrates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReferenceLobe {
    /// The GGX BRDF itself: what it differs by is the error of integral and fit together.
    #[default]
    Ggx,
    /// The linearly transformed cosine: what it differs by is the error of the integral.
    Ltc,
}

/// Most edges per curve of [`Technique::Uniform`].
pub const MAX_SEGMENTS: u32 = 1 << 16;
/// Mask resolutions of [`Technique::Quad`].
pub const MASK_SIZES: core::ops::RangeInclusive<u32> = 4..=4096;
/// Most light samples per pixel of [`Technique::Reference`].
pub const MAX_SPP: u32 = 1 << 24;

/// The names of all techniques.
pub const NAMES: [&str; 9] =
    ["tree", "exact", "kuge", "uniform", "quad", "textured", "pal", "representative", "reference"];

impl Technique {
    /// Whether only the CPU backend has it.
    pub const fn is_cpu_only(&self) -> bool {
        matches!(self, Self::Exact | Self::Reference(_))
    }

    /// Whether it can clip at the true horizon; the published techniques don't.
    pub const fn knows_true_horizon(&self) -> bool {
        matches!(self, Self::Tree | Self::Exact | Self::Textured | Self::Reference(_))
    }

    /// Those of `skips` that leave its picture what it is. The yardstick has none that is decided by bounds; approximations that
    /// light a surface from below its horizon still do; and only what heeds the tolerance makes use of it.
    pub fn skips(&self, skips: Skips) -> Skips {
        let bounded = !matches!(self, Self::Exact | Self::Reference(_));
        let clipped = bounded && !matches!(self, Self::Pal { .. } | Self::Representative);
        let tolerant = matches!(self, Self::Tree | Self::Textured);
        Skips {
            behind: skips.behind && bounded,
            below_horizon: skips.below_horizon && clipped,
            under_tolerance: skips.under_tolerance && tolerant,
            clusters: skips.clusters && matches!(self, Self::Tree),
            ..skips
        }
    }

    /// What its integrals are made of, for the reader of [`super::Stats::nodes`].
    pub const fn parts(&self) -> &'static str {
        match self {
            Self::Tree | Self::Textured => "nodes",
            Self::Kuge { .. } | Self::Uniform { .. } | Self::Quad { .. } | Self::Pal { .. } => "edges",
            Self::Exact | Self::Representative | Self::Reference(_) => "samples",
        }
    }

    /// Whether it takes a sphere or tube for what it is, and not for the faces that it shows each point.
    pub const fn takes_bodies_whole(&self) -> bool {
        matches!(self, Self::Representative | Self::Reference(_))
    }

    /// Its name without parameters.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Tree => NAMES[0],
            Self::Exact => NAMES[1],
            Self::Kuge { .. } => NAMES[2],
            Self::Uniform { .. } => NAMES[3],
            Self::Quad { .. } => NAMES[4],
            Self::Textured => NAMES[5],
            Self::Pal { .. } => NAMES[6],
            Self::Representative => NAMES[7],
            Self::Reference(_) => NAMES[8],
        }
    }
}

/// `kuge`, `kuge:1e-6`, `uniform:30`, `quad:512`, `pal:weighted`, `reference:1024` …: what [`FromStr`] reads.
impl fmt::Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Kuge { eps: Some(eps) } => write!(f, ":{eps:e}"),
            Self::Uniform { segments } => write!(f, ":{segments}"),
            Self::Quad { mask } => write!(f, ":{mask}"),
            Self::Pal { basis } => write!(f, ":{basis}"),
            Self::Reference(sampling) => write!(f, ":{}", sampling.spp),
            _ => Ok(()),
        }
    }
}

impl FromStr for Technique {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, parameter) = match text.split_once([':', ' ']) {
            Some((name, parameter)) => (name, Some(parameter.trim())),
            None => (text, None),
        };
        Ok(match name {
            "tree" | "exact" | "textured" | "representative" if parameter.is_some() => {
                return Err(format!("`{name}` takes no parameter"));
            }
            "tree" => Self::Tree,
            "exact" => Self::Exact,
            "kuge" => Self::Kuge { eps: parameter.map(eps).transpose()? },
            "uniform" => Self::Uniform { segments: whole(name, parameter, 30, 1..=MAX_SEGMENTS)? },
            "quad" => Self::Quad { mask: whole(name, parameter, 512, MASK_SIZES)? },
            "textured" => Self::Textured,
            "pal" => Self::Pal { basis: parameter.map_or(Ok(Basis::default()), str::parse)? },
            "representative" => Self::Representative,
            "reference" => {
                let default = Sampling::default();
                Self::Reference(Sampling { spp: whole(name, parameter, default.spp, 1..=MAX_SPP)?, ..default })
            }
            _ => return Err(format!("`{name}` is none of {}", NAMES.join(", "))),
        })
    }
}

fn eps(text: &str) -> Result<f32, String> {
    let value = text.parse().ok().filter(|v: &f32| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| format!("kuge: eps `{text}` is not a finite number above 0"))
}

fn whole(name: &str, text: Option<&str>, default: u32, range: core::ops::RangeInclusive<u32>) -> Result<u32, String> {
    let Some(text) = text else { return Ok(default) };
    let value = text.parse().ok().filter(|v| range.contains(v));
    value.ok_or_else(|| format!("{name}: `{text}` is not a whole number from {} to {}", range.start(), range.end()))
}

impl fmt::Display for Basis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Centred => "centred",
            Self::Weighted => "weighted",
            Self::Biased => "biased",
        })
    }
}

impl FromStr for Basis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = [Self::Centred, Self::Weighted, Self::Biased];
        let found = all.into_iter().find(|basis| basis.to_string() == text);
        found.ok_or_else(|| format!("pal: basis `{text}` is none of centred, weighted, biased"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for text in
            ["tree", "exact", "kuge", "kuge:1e-6", "uniform:6", "quad:64", "textured", "pal:biased", "reference:8"]
        {
            assert_eq!(text.parse::<Technique>().unwrap().to_string(), text);
        }
        assert_eq!("uniform 18".parse(), Ok(Technique::Uniform { segments: 18 }));
        for (text, message) in [
            ("trees", "none of"),
            ("tree:1", "no parameter"),
            ("kuge:0", "above 0"),
            ("kuge:x", "above 0"),
            ("uniform:0", "from 1 to"),
            ("quad:3", "from 4 to"),
            ("pal:skew", "none of"),
            ("reference:0", "from 1 to"),
        ] {
            let error = text.parse::<Technique>().unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
