//! Which technique, by the flags that all verbs share.

use super::values::positive;
use crate::backend::technique::{Basis, MASK_SIZES, MAX_SEGMENTS, MAX_SPP, NAMES, ReferenceLobe, Sampling};
use crate::backend::{Horizons, Technique};
use crate::error::Error;
use clap::ValueEnum;
use core::str::FromStr;

/// Why a technique has nothing to show of lights of which some have a `picture`, or none has.
pub fn why_not(technique: &Technique, picture: bool) -> Option<&'static str> {
    match technique {
        Technique::Textured if !picture => Some("no light has a picture; it would be the tree"),
        Technique::Exact if picture => Some("a light has a picture, which a contour cannot hold"),
        _ => None,
    }
}

/// How integrals are evaluated.
#[derive(Debug, clap::Args)]
pub struct TechniqueArgs {
    /// How integrals are evaluated: tree, exact (f64, slow), kuge[:EPS], uniform[:N], quad[:MASK], textured, pal[:BASIS],
    /// representative, reference[:SPP] (Monte Carlo, slow)
    #[arg(long, default_value = "tree", value_name = "NAME")]
    technique: Spelled,
    /// kuge: least contribution of a triangle that is subdivided, 2π being a hemisphere [default: the paper's, 0.1·alpha, and 1000 for diffuse light]
    #[arg(long, value_parser = positive)]
    eps: Option<f32>,
    /// uniform: edges per curve [default: 30]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SEGMENTS)))]
    segments: Option<u32>,
    /// quad: texels along the longer side of the mask [default: 512]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(i64::from(*MASK_SIZES.start())..=i64::from(*MASK_SIZES.end())))]
    mask_size: Option<u32>,
    /// pal: what polygons are projected on, centred, weighted or biased [default: centred]
    #[arg(long)]
    basis: Option<Basis>,
    /// reference: light samples per pixel, at most [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SPP)))]
    spp: Option<u32>,
    /// reference: standard error of a pixel's radiance at which its sampling ends early
    #[arg(long, value_name = "RADIANCE", value_parser = positive)]
    max_error: Option<f32>,
    /// reference: which random numbers; the same seed gives the same picture [default: 0]
    #[arg(long)]
    seed: Option<u64>,
    /// reference: what surfaces reflect by [default: ggx]
    #[arg(long, value_enum)]
    lobe: Option<LobeArg>,
    /// Where specular lobes are clipped; kuge, uniform, quad, pal and representative know the cosine's horizon only
    #[arg(long, value_enum)]
    horizon: Option<HorizonArg>,
}

/// Lobes by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LobeArg {
    /// The GGX BRDF: shows what all of a technique's error is
    Ggx,
    /// The linearly transformed cosine: shows the error of its integral
    Ltc,
}

impl From<LobeArg> for ReferenceLobe {
    fn from(arg: LobeArg) -> Self {
        match arg {
            LobeArg::Ggx => Self::Ggx,
            LobeArg::Ltc => Self::Ltc,
        }
    }
}

/// Horizons by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum HorizonArg {
    /// At the surface's true horizon as well
    Both,
    /// At that of the cosine only, as published
    Cosine,
}

/// A technique as it was written.
#[derive(Clone, Copy, Debug)]
struct Spelled {
    technique: Technique,
    /// Whether it came with its parameter.
    parameter: bool,
}

impl FromStr for Spelled {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self { technique: text.parse()?, parameter: text.contains([':', ' ']) })
    }
}

impl TechniqueArgs {
    /// Refuses a tolerance for a technique that heeds none.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check_tolerance(&self, tolerance: Option<f32>) -> Result<(), Error> {
        match self.technique.technique {
            Technique::Tree | Technique::Textured => Ok(()),
            _ if tolerance.is_none() => Ok(()),
            other => {
                let name = other.name();
                Err(Error::Usage(format!("--tolerance goes with tree and textured; it has no effect on {name}")))
            }
        }
    }

    /// The technique with its parameters, and where lobes are clipped.
    ///
    /// # Errors
    /// [`Error::Usage`] for a flag that has no effect on the technique.
    pub fn resolve(&self) -> Result<(Technique, Horizons), Error> {
        let Spelled { mut technique, parameter } = self.technique;
        let name = technique.name();
        let given = [
            ("eps", self.eps.is_some(), "kuge"),
            ("segments", self.segments.is_some(), "uniform"),
            ("mask-size", self.mask_size.is_some(), "quad"),
            ("basis", self.basis.is_some(), "pal"),
            ("spp", self.spp.is_some(), "reference"),
            ("max-error", self.max_error.is_some(), "reference"),
            ("seed", self.seed.is_some(), "reference"),
            ("lobe", self.lobe.is_some(), "reference"),
        ];
        if let Some((flag, _, of)) = given.iter().find(|(_, given, of)| *given && *of != name) {
            return Err(Error::Usage(format!("--{flag} goes with --technique {of}; it has no effect on {name}")));
        }
        let parameters = ["eps", "segments", "mask-size", "basis", "spp"];
        if let Some((flag, ..)) = given.iter().find(|(flag, given, _)| parameter && *given && parameters.contains(flag))
        {
            return Err(Error::Usage(format!(
                "--technique {technique} and --{flag} both give the parameter; give it once"
            )));
        }
        match &mut technique {
            Technique::Kuge { eps } => *eps = self.eps.or(*eps),
            Technique::Uniform { segments } => *segments = self.segments.unwrap_or(*segments),
            Technique::Quad { mask } => *mask = self.mask_size.unwrap_or(*mask),
            Technique::Pal { basis } => *basis = self.basis.unwrap_or(*basis),
            Technique::Reference(sampling) => {
                sampling.spp = self.spp.unwrap_or(sampling.spp);
                sampling.max_error = self.max_error.or(sampling.max_error);
                sampling.seed = self.seed.unwrap_or(sampling.seed);
                sampling.lobe = self.lobe.map_or(sampling.lobe, Into::into);
            }
            _ => {}
        }
        let horizons = match self.horizon {
            Some(HorizonArg::Both) if !technique.knows_true_horizon() => {
                let knowing: Vec<_> =
                    NAMES.into_iter().filter(|n| n.parse().is_ok_and(|t: Technique| t.knows_true_horizon())).collect();
                let message = format!("--horizon both goes with {}; {name} cannot", knowing.join(", "));
                return Err(Error::Usage(message));
            }
            Some(_) if matches!(technique, Technique::Reference(Sampling { lobe: ReferenceLobe::Ggx, .. })) => {
                return Err(Error::Usage(
                    "--horizon goes with --lobe ltc; GGX itself has no horizon but the surface".into(),
                ));
            }
            Some(HorizonArg::Cosine) => Horizons::Cosine,
            _ => Horizons::Both,
        };
        Ok((technique, horizons))
    }
}
