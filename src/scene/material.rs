//! Materials and textures.

/// A surface material in the metallic-roughness model. Colours are linear Rec.709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Albedo of the diffuse part, and F0 of the metallic part.
    pub base_color: [f32; 3],
    /// 0 = dielectric, 1 = metal.
    pub metallic: f32,
    /// GGX width, 0 to 1. Perceptual roughness r is converted at the border: alpha = r².
    pub alpha: f32,
    /// Weight of the dielectric specular lobe: F0 = 0.04·specular, F90 = specular. 0 leaves a dielectric diffuse.
    pub specular: f32,
    /// Index of the texture that multiplies `base_color` (sRGB texels).
    pub base_color_texture: Option<u32>,
    /// Index of the texture whose green multiplies perceptual roughness and whose blue multiplies `metallic`.
    pub metallic_roughness_texture: Option<u32>,
    /// Index of the tangent-space normal map.
    pub normal_texture: Option<u32>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            base_color: [0.8; 3],
            metallic: 0.0,
            alpha: 0.25,
            specular: 1.0,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

/// An 8-bit RGBA picture, row by row from the top, repeating in both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// One texel per element, R in the lowest byte. sRGB for colours, linear for data.
    pub texels: Vec<u32>,
    /// Whether the texels' RGB are sRGB-encoded.
    pub srgb: bool,
}
