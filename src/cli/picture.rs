//! What a picture is to be like, by the flags that verbs share. Defaults stand here; a verb that has others changes them by `mut_arg`.

use super::backend::BackendArg;
use super::technique::TechniqueArgs;
use super::values::positive;
use crate::backend::Settings;
use crate::error::Error;

/// How large it is.
#[derive(Debug, clap::Args)]
pub struct SizeArgs {
    /// Pixels across
    #[arg(long, default_value_t = 1280)]
    pub width: u32,
    /// Pixels down
    #[arg(long, default_value_t = 720)]
    pub height: u32,
    /// Samples per pixel
    #[arg(long, default_value_t = 4)]
    pub samples: u32,
}

/// How large it is, and how and where it is computed.
#[derive(Debug, clap::Args)]
pub struct PictureArgs {
    #[command(flatten)]
    pub size: SizeArgs,
    /// tree, textured: largest error of the picture's radiance by integration [default: 1e-4]
    #[arg(long, value_parser = positive)]
    tolerance: Option<f32>,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Where to compute: auto takes a hardware GPU if there is one, else the CPU; gpu takes a software driver as well
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
}

impl PictureArgs {
    /// The settings; nothing is skipped but what is by default.
    ///
    /// # Errors
    /// [`Error::Usage`] for a flag that has no effect on the technique, and for a picture that cannot be.
    pub fn settings(&self) -> Result<Settings, Error> {
        let SizeArgs { width, height, samples } = self.size;
        let (technique, horizons) = self.technique.resolve()?;
        self.technique.check_tolerance(self.tolerance)?;
        let default = Settings::default();
        let tolerance = self.tolerance.unwrap_or(default.tolerance);
        let settings = Settings { width, height, samples, tolerance, technique, horizons, ..default };
        settings.check()?;
        Ok(settings)
    }
}
