//! [`Film`]: the picture as linear Rec.709 radiance, in layers.

/// A picture in linear Rec.709 radiance (W·sr⁻¹·m⁻²), row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Light reflected by the diffuse part of the materials.
    pub diffuse: Vec<[f32; 3]>,
    /// Light reflected by the specular part.
    pub specular: Vec<[f32; 3]>,
    /// The lights themselves and the background, as the camera sees them.
    pub emission: Vec<[f32; 3]>,
}

impl Film {
    /// A black picture.
    pub fn new(width: u32, height: u32) -> Self {
        let black = vec![[0.0; 3]; width as usize * height as usize];
        Self { width, height, diffuse: black.clone(), specular: black.clone(), emission: black }
    }

    /// The sum of the layers.
    pub fn beauty(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        let layers = self.diffuse.iter().zip(&self.specular).zip(&self.emission);
        layers.map(|((d, s), e)| core::array::from_fn(|c| d[c] + s[c] + e[c]))
    }
}
