//! [`Strength`]: how strongly a light shines, whatever its shape.

use crate::light::Layer;
use core::f64::consts::PI;
use glam::DVec3;

/// How strongly a light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Radiance of a white layer, W·sr⁻¹·m⁻².
    Radiance(DVec3),
    /// Flux of the whole light, W: the mean of the three channels, each of which is π · area · radiance summed over the layers; of
    /// pictures, the mean over the layer.
    Power {
        /// The flux.
        watts: f64,
        /// Its colour, not black, of which only the ratios count.
        color: DVec3,
    },
}

/// Why a light cannot shine so.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StrengthError {
    /// No radiance gives the power.
    #[error("no radiance gives this power, since the light is black")]
    Black,
    /// A radiance is beyond f32.
    #[error("makes a radiance of {0}, too large for 32 bits")]
    TooLarge(DVec3),
}

impl Strength {
    /// Multiplies the radiance of `layers`, which hold their own colours so far. `emitting` is the factor from light-space area
    /// to emitting world area.
    ///
    /// # Errors
    /// [`StrengthError`].
    pub fn apply(&self, layers: &mut [Layer], emitting: f64) -> Result<(), StrengthError> {
        let radiance = match *self {
            Self::Radiance(radiance) => radiance,
            Self::Power { watts, color } => {
                let flux: DVec3 = layers
                    .iter()
                    .map(|l| l.radiance * l.mean_color().truncate() * color * (PI * emitting * l.shape.area()))
                    .sum();
                let mean = flux.element_sum() / 3.0;
                if mean <= 0.0 {
                    return Err(StrengthError::Black);
                }
                color * (watts / mean)
            }
        };
        for layer in layers {
            layer.radiance *= radiance;
            if !layer.radiance.as_vec3().is_finite() {
                return Err(StrengthError::TooLarge(layer.radiance));
            }
        }
        Ok(())
    }
}
