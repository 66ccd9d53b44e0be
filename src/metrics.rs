//! How wrong a picture is: figures, FLIP and the signed error of every pixel.
//!
//! A *picture* here is what surfaces reflect ([`Film::reflected`]): diffuse and specular light, linear Rec.709 radiance,
//! W·sr⁻¹·m⁻². Lights in view and the background are the same whatever evaluates the integrals, and would only hide errors
//! behind their brightness. Every figure is over all pixels of the picture and their three channels, each component counted
//! once, also where no surface is seen. The only file that names nv-flip.
//!
//! [`Film::reflected`]: crate::film::Film::reflected

/// What a picture differs by from its yardstick.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Figures {
    /// Mean of the absolute differences, W·sr⁻¹·m⁻².
    pub mae: f64,
    /// Root of the mean of the squared differences, W·sr⁻¹·m⁻².
    pub rmse: f64,
    /// [`Figures::rmse`] over the yardstick's largest component; nothing where the yardstick is black.
    pub rmse_of_peak: Option<f64>,
    /// The largest absolute difference, W·sr⁻¹·m⁻².
    pub max: f64,
    /// The least value that 99.9 % of the absolute differences do not exceed (nearest rank), W·sr⁻¹·m⁻².
    pub p999: f64,
    /// Sum of the picture's components over the sum of the yardstick's; nothing where the yardstick is black.
    pub energy_ratio: Option<f64>,
}

/// Why pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// They are not of one size, or have no pixels.
    #[error("pictures of {0} and {1} values: both must be of one size, not 0")]
    Size(usize, usize),
    /// A picture holds something that is no radiance.
    #[error("{pixels} pixels are not finite, the first is number {first}: {value:?}")]
    NotFinite {
        /// How many.
        pixels: usize,
        /// Index of the first, row by row from the top.
        first: usize,
        /// What it holds.
        value: [f32; 3],
    },
}

/// Compares a picture with its yardstick.
///
/// # Errors
/// Different sizes, no pixels, or a value that isn't finite in either.
pub fn figures(picture: &[[f32; 3]], yardstick: &[[f32; 3]]) -> Result<Figures, MetricsError> {
    check(picture, yardstick)?;
    let values = |pixels: &[[f32; 3]]| pixels.as_flattened().iter().map(|&c| f64::from(c)).collect::<Vec<_>>();
    let (picture, yardstick) = (values(picture), values(yardstick));
    let mut errors: Vec<f64> = picture.iter().zip(&yardstick).map(|(a, b)| (a - b).abs()).collect();
    let n = errors.len() as f64;
    let mae = errors.iter().sum::<f64>() / n;
    let rmse = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let rank = (errors.len() * 999).div_ceil(1000) - 1;
    let (_, &mut p999, above) = errors.select_nth_unstable_by(rank, f64::total_cmp);
    let max = above.iter().copied().fold(p999, f64::max);
    let peak = yardstick.iter().copied().fold(0.0, f64::max);
    let energy = yardstick.iter().sum::<f64>();
    let rmse_of_peak = (peak > 0.0).then(|| rmse / peak);
    let energy_ratio = (energy > 0.0).then(|| picture.iter().sum::<f64>() / energy);
    Ok(Figures { mae, rmse, rmse_of_peak, max, p999, energy_ratio })
}

/// An RMSE without what the yardstick's noise adds to it: `√(rmse² − noise²)`, and 0 where the noise is larger. `noise` is the
/// root mean square of the yardstick's standard error over the same pixels and channels, W·sr⁻¹·m⁻². An estimate: it is right
/// where noise and error are independent, and says little where it is much below the noise.
pub fn less_noise(rmse: f64, noise: f64) -> f64 {
    (rmse * rmse - noise * noise).max(0.0).sqrt()
}

/// The signed error of every pixel: picture − yardstick in the channel that differs most, W·sr⁻¹·m⁻². Not the luminance,
/// where too much red and too little blue cancel.
///
/// # Errors
/// As [`figures`].
pub fn signed_error(picture: &[[f32; 3]], yardstick: &[[f32; 3]]) -> Result<Vec<f32>, MetricsError> {
    check(picture, yardstick)?;
    let worst = |(a, b): (&[f32; 3], &[f32; 3])| {
        let differences: [f32; 3] = core::array::from_fn(|c| a[c] - b[c]);
        differences.into_iter().max_by(|x, y| x.abs().total_cmp(&y.abs())).unwrap_or_default()
    };
    Ok(picture.iter().zip(yardstick).map(worst).collect())
}

fn check(picture: &[[f32; 3]], yardstick: &[[f32; 3]]) -> Result<(), MetricsError> {
    if picture.len() != yardstick.len() || picture.is_empty() {
        return Err(MetricsError::Size(picture.len(), yardstick.len()));
    }
    for pixels in [yardstick, picture] {
        let mut bad = pixels.iter().enumerate().filter(|(_, p)| !p.iter().all(|c| c.is_finite()));
        if let Some((first, &value)) = bad.next() {
            return Err(MetricsError::NotFinite { pixels: 1 + bad.count(), first, value });
        }
    }
    Ok(())
}

/// Mean of FLIP, 0 (same) to 1: how much a viewer who flips between the two pictures sees change. Andersson, Nilsson,
/// Akenine-Möller, Oskarsson, Åström, Fairchild 2020, "FLIP: a difference evaluator for alternating images", by its authors'
/// implementation, on 8-bit sRGB pictures as displayed, row by row, at the 67 pixels per degree of their default viewer.
///
/// # Errors
/// Other than `width · height · 3` bytes in either, or no pixels.
pub fn flip(picture: &[u8], yardstick: &[u8], width: u32, height: u32) -> Result<f64, MetricsError> {
    let size = width as usize * height as usize * 3;
    if size == 0 || picture.len() != size || yardstick.len() != size {
        return Err(MetricsError::Size(picture.len(), yardstick.len()));
    }
    let image = |bytes| nv_flip::FlipImageRgb8::with_data(width, height, bytes);
    let map = nv_flip::flip(image(yardstick), image(picture), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    Ok(map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64)
}
