//! PNG and JPEG bytes to [`Texture`].

use super::material::Texture;
use crate::color::srgb_decode;
use crate::light::Layer;
use crate::picture::{MAX_SIDE as PICTURE_SIDE, Picture};
use crate::shape::Bounds;
use glam::Vec4;
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::sync::Arc;

/// Largest width and height of a texture, texels.
pub const MAX_SIDE: u32 = 8192;

/// Largest texture file, bytes.
pub const MAX_BYTES: u64 = 64 << 20;

/// Why bytes aren't a texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// Neither PNG nor JPEG by its first bytes.
    #[error("not a PNG or JPEG picture")]
    Format,
    /// Too many texels, or none.
    #[error("a picture of {width} × {height} texels; each side must be 1 to {MAX_SIDE}")]
    Size {
        /// Texels across.
        width: u32,
        /// Texels down.
        height: u32,
    },
    /// The decoder failed.
    #[error("{0}")]
    Decode(String),
}

impl Texture {
    /// Decodes PNG or JPEG, told apart by their first bytes. 16-bit channels are rounded to 8; grey becomes RGB.
    /// `srgb` says whether the RGB are colours (sRGB-encoded) or data (linear); alpha is kept.
    ///
    /// # Errors
    /// Another format, sides beyond [`MAX_SIDE`] (checked before anything is allocated), broken data.
    pub fn decode(bytes: &[u8], srgb: bool) -> Result<Self, TextureError> {
        let format = image::guess_format(bytes).ok().filter(|f| matches!(f, ImageFormat::Png | ImageFormat::Jpeg));
        let format = format.ok_or(TextureError::Format)?;
        let decode = |e: image::ImageError| TextureError::Decode(e.to_string());
        let (width, height) = ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(decode)?;
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(TextureError::Size { width, height });
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        // RGBA in 16 bits at the largest size, once in the decoder and once beside it.
        limits.max_alloc = Some(2 * 8 * u64::from(MAX_SIDE) * u64::from(MAX_SIDE));
        reader.limits(limits);
        let picture = reader.decode().map_err(decode)?.into_rgba8();
        let texels = picture.pixels().map(|p| u32::from_le_bytes(p.0)).collect();
        Ok(Self { width, height, texels, srgb })
    }

    /// Lays the texture over the smallest box around `layers`, stretched to it, as the colours of each. At most
    /// [`PICTURE_SIDE`] texels of it are kept along a side.
    pub fn lay_over(&self, layers: &mut [Layer]) {
        let bounds = layers.iter().map(|l| l.shape.extent()).fold(Bounds::EMPTY, Bounds::union);
        let linear: Vec<f32> = (0..=255).map(|v| srgb_decode(f64::from(v) / 255.0) as f32).collect();
        let texel = |x: u32, y: u32| {
            let index = y as usize * self.width as usize + x as usize;
            let [r, g, b, alpha] = self.texels[index].to_le_bytes();
            let alpha = f32::from(alpha) / 255.0;
            let [r, g, b] = [r, g, b].map(|v| if self.srgb { linear[usize::from(v)] } else { f32::from(v) / 255.0 });
            Vec4::new(r * alpha, g * alpha, b * alpha, alpha)
        };
        let kept = [self.width.min(PICTURE_SIDE), self.height.min(PICTURE_SIDE)];
        let picture = Arc::new(Picture::shrunk([self.width, self.height], kept, [bounds.min, bounds.max], texel));
        layers.iter_mut().for_each(|layer| layer.picture = Some(Arc::clone(&picture)));
    }
}
