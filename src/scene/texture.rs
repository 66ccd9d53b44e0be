//! PNG and JPEG bytes to [`Texture`].

use super::material::Texture;
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;

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
}
