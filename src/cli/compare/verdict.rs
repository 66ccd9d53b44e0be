//! From pictures to rows, error maps and what they are drawn with.

use super::measure::{All, Measured, Role, per_megapixel, stem};
use crate::backend::{Horizons, Settings};
use crate::error::Error;
use crate::film::{Display, png_of};
use crate::metrics::{Figures, MetricsError, figures, flip, less_noise, signed_error};
use crate::report::page::PagePicture;
use crate::report::scale::ErrorScale;
use crate::report::{Block, LeftOut, Row};
use std::path::Path;

/// Size of the colour bar, pixels.
const BAR: [u32; 2] = [512, 24];

/// What `compare` found.
pub struct Verdict {
    pub blocks: Vec<Block>,
    /// Pictures and error maps.
    pub pictures: Vec<PagePicture>,
    pub scale: Option<ErrorScale>,
    /// The colour bar, a PNG.
    pub bar: Option<Vec<u8>>,
    /// Techniques whose pictures are none.
    pub failed: Vec<LeftOut>,
}

/// A picture in the form in which it is compared.
struct Shown<'m> {
    measured: &'m Measured,
    label: String,
    reflected: Vec<[f32; 3]>,
    displayed: Vec<u8>,
}

/// An error map before it has colours.
struct Map {
    file: String,
    errors: Vec<f32>,
}

/// Judges all pictures.
///
/// # Errors
/// A yardstick that isn't a picture, or what an encoder says.
pub fn of(all: &All, settings: &Settings, display: &Display) -> Result<Verdict, Error> {
    let mut failed = Vec::new();
    let mut shown = Vec::new();
    for measured in &all.entries {
        let label = measured.entry.label();
        match developed(measured, display) {
            Ok((reflected, displayed)) => shown.push(Shown { measured, label, reflected, displayed }),
            Err(error) if measured.entry.role == Role::Technique => {
                failed.push(LeftOut { technique: label, reason: error.to_string() });
            }
            Err(error) => return Err(error),
        }
    }
    let judge = Judge { all, settings, shown: &shown };
    let mut maps = Vec::new();
    let mut blocks = vec![judge.integrals(&mut maps)?];
    blocks.extend(judge.totals(&mut maps)?);
    let size = [settings.width, settings.height];
    let encode = |rgb: &[u8], [width, height]: [u32; 2], file: &str| png_of(rgb, width, height, Path::new(file));
    let largest = maps.iter().flat_map(|m| &m.errors).fold(0.0_f32, |most, e| most.max(e.abs()));
    // Errors within the tolerance are nothing to be alarmed at: they do not fill the scale.
    let scale = (!maps.is_empty()).then(|| ErrorScale::new(f64::from(largest.max(settings.tolerance))));
    let mut pictures = Vec::new();
    for picture in &shown {
        let file = picture.measured.file("png");
        pictures.push(PagePicture { png: encode(&picture.displayed, size, &file)?, file });
    }
    for Map { file, errors } in maps {
        if let Some(scale) = &scale {
            pictures.push(PagePicture { png: encode(&scale.paint(&errors), size, &file)?, file });
        }
    }
    let bar = scale.map(|_| encode(&ErrorScale::bar(BAR[0], BAR[1]), BAR, "error-scale.png")).transpose()?;
    Ok(Verdict { blocks, pictures, scale, bar, failed })
}

/// What surfaces reflect, every value finite, and the picture as displayed.
fn developed(measured: &Measured, display: &Display) -> Result<(Vec<[f32; 3]>, Vec<u8>), Error> {
    let reflected: Vec<_> = measured.film.reflected().collect();
    // Against itself: whether it is a picture at all.
    figures(&reflected, &reflected)?;
    let displayed = measured.film.displayed(display, Path::new(&measured.file("png")))?;
    Ok((reflected, displayed))
}

struct Judge<'a> {
    all: &'a All,
    settings: &'a Settings,
    shown: &'a [Shown<'a>],
}

impl Judge<'_> {
    /// Every technique against a yardstick that integrates the same lobe and clips at the same horizon.
    fn integrals(&self, maps: &mut Vec<Map>) -> Result<Block, MetricsError> {
        let yardstick = |horizons: Horizons| {
            let judges =
                |s: &&Shown<'_>| s.role() == Role::Yardstick && s.measured.entry.settings.horizons() == horizons;
            self.shown.iter().find(judges)
        };
        let mut rows = Vec::new();
        for shown in self.shown.iter().filter(|s| s.role() == Role::Technique) {
            let yardstick = yardstick(shown.measured.entry.settings.horizons());
            rows.push(self.row("integral", shown, yardstick, maps)?);
        }
        for shown in self.shown.iter().filter(|s| s.role() == Role::Yardstick) {
            rows.push(self.row("integral", shown, None, maps)?);
        }
        let about = "Each technique against a yardstick that integrates the same linearly transformed cosine, clipped at the \
                     same horizon as the technique clips it: what is left is the error of the integral.";
        Ok(Block { name: "integral".into(), about: about.into(), rows })
    }

    /// Every picture against Monte Carlo with the BRDF itself, where there is one.
    fn totals(&self, maps: &mut Vec<Map>) -> Result<Option<Block>, MetricsError> {
        let Some(truth) = self.shown.iter().find(|s| s.role() == Role::Truth) else { return Ok(None) };
        let mut rows = Vec::new();
        for shown in self.shown.iter().filter(|s| s.role() != Role::Truth) {
            rows.push(self.row("total", shown, Some(truth), maps)?);
        }
        rows.push(self.row("total", truth, None, maps)?);
        let about = "Each picture against Monte Carlo with the GGX BRDF itself: the errors of integral, fit and horizon \
                     together, and the noise of the Monte Carlo picture.";
        Ok(Some(Block { name: "total".into(), about: about.into(), rows }))
    }

    fn row(
        &self,
        block: &str,
        shown: &Shown<'_>,
        yardstick: Option<&Shown<'_>>,
        maps: &mut Vec<Map>,
    ) -> Result<Row, MetricsError> {
        let mut error_map = None;
        let mut errors: Option<Figures> = None;
        let mut difference = None;
        if let Some(yardstick) = yardstick {
            let file = format!("errors/{block}-{}.png", stem(&shown.label));
            let (picture, truth) = (&shown.reflected, &yardstick.reflected);
            errors = Some(figures(picture, truth)?);
            let Settings { width, height, .. } = *self.settings;
            difference = Some(flip(&shown.displayed, &yardstick.displayed, width, height)?);
            maps.push(Map { file: file.clone(), errors: signed_error(picture, truth)? });
            error_map = Some(file);
        }
        let yardstick_noise = yardstick.and_then(|y| y.measured.noise());
        let measured = shown.measured;
        let seconds = measured.seconds();
        let rectangle = self.all.rectangle(&measured.backend).filter(|time| *time > 0.0);
        Ok(Row {
            technique: shown.label.clone(),
            backend: measured.backend.clone(),
            device: measured.device.clone(),
            runs: measured.runs(),
            seconds,
            prepare_seconds: measured.prepare_seconds(),
            ms_per_megapixel: per_megapixel(seconds, self.settings),
            rectangles: rectangle.map(|time| seconds / time),
            yardstick: yardstick.map(|y| y.label.clone()),
            errors,
            flip: difference,
            noise: measured.noise(),
            yardstick_noise,
            rmse_less_noise: yardstick_noise.zip(errors).map(|(noise, e)| less_noise(e.rmse, noise)),
            picture: measured.file("png"),
            error_map,
        })
    }
}

impl Shown<'_> {
    fn role(&self) -> Role {
        self.measured.entry.role
    }
}
