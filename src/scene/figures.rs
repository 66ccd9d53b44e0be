//! Bundled scenes after the figures of the papers: the same questions, with shapes of our own.

use super::bundled::{Bundled, BundledError, Kind, bundled};
use super::file::{self, Loaded};

/// All figures. Kuge 2022 is Kuge, Yatagawa, Morishima, JCGT 11(1); Heitz 2016 is Heitz, Dupuy, Hill, Neubelt, SIGGRAPH 2016.
pub const FIGURES: [Bundled; 11] = [
    bundled!("figures", "hole", "a light with a hole (Kuge 2022, fig. 1)"),
    bundled!("figures", "letter", "a letter (Kuge 2022, fig. 1)"),
    bundled!("figures", "picture", "a light coloured by a picture (Kuge 2022, fig. 1)"),
    bundled!("figures", "alpha-0.01", "thresholds of subdivision at GGX alpha 0.01 (Kuge 2022, figs. 4 and 5)"),
    bundled!("figures", "alpha-0.1", "thresholds of subdivision at GGX alpha 0.1 (Kuge 2022, figs. 4 and 5)"),
    bundled!("figures", "alpha-0.25", "thresholds of subdivision at GGX alpha 0.25 (Kuge 2022, figs. 4 and 5)"),
    bundled!("figures", "samples", "6, 18 and 30 edges per curve (Kuge 2022, fig. 8)"),
    bundled!("figures", "mask", "a masked rectangle against the contour (Kuge 2022, fig. 9)"),
    bundled!("figures", "quad-near", "a masked rectangle that stands on the floor (Heitz 2016, fig. 12)"),
    bundled!("figures", "quad-horizon", "a masked rectangle that dips through the floor (Heitz 2016, fig. 12)"),
    bundled!("figures", "quad-grazing", "a masked rectangle seen at a grazing angle (Heitz 2016, fig. 12)"),
];

const KIND: Kind = Kind {
    name: "figure",
    scenes: &FIGURES,
    files: &[("sunset.svg", include_bytes!("../../svg/sunset.svg"))],
    parse: file::parse,
};

/// Loads a figure by its name, without `figure:`.
///
/// # Errors
/// [`BundledError::Unknown`], which lists the figures.
pub fn load(name: &str) -> Result<Loaded, BundledError> {
    KIND.load(name)
}
