//! Pictures embedded in an SVG: decoding, and the view of one placed in light space.

use crate::color::srgb_decode;
use crate::picture::{MAX_SIDE, Picture};
use glam::{DAffine2, DVec2, DVec4, Vec4};
use image::{ImageReader, Limits};
use std::io::Cursor;
use std::sync::Arc;

/// Most pixels along either side of a file, unless a limit says otherwise.
pub(super) const MAX_PIXELS: u32 = 16_384;
/// Most bytes decoding may take.
const MAX_DECODED: u64 = 512 << 20;

/// Width and height of a PNG or JPEG, by its header; or what is wrong with it.
pub(super) fn size(bytes: &[u8]) -> Result<[u32; 2], String> {
    // A PNG says it first of all, whatever is wrong with the rest.
    if let Some(header) = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")
        && let Some(([b'I', b'H', b'D', b'R'], sides)) = header.get(4..16).and_then(|h| h.split_first_chunk())
    {
        let side = |at: usize| sides[at..at + 4].iter().fold(0, |side, &byte| side << 8 | u32::from(byte));
        return Ok([side(0), side(4)]);
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    reader.into_dimensions().map(Into::into).map_err(|e| e.to_string())
}

/// The colours of a PNG or JPEG over the box from (0, 0) to its size in pixels, y up; or what is wrong with it.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_DECODED);
    reader.limits(limits);
    let pixels = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    let (width, height) = pixels.dimensions();
    if width == 0 || height == 0 {
        return Err("it has no pixels".to_owned());
    }
    let linear: Vec<f32> = (0..=255).map(|v| srgb_decode(f64::from(v) / 255.0) as f32).collect();
    let texel = |x, y| {
        let [r, g, b, a] = pixels.get_pixel(x, y).0;
        let alpha = f32::from(a) / 255.0;
        let [r, g, b] = [r, g, b].map(|v| alpha * linear[usize::from(v)]);
        Vec4::new(r, g, b, alpha)
    };
    let kept = [width.min(MAX_SIDE), height.min(MAX_SIDE)];
    let whole = [DVec2::ZERO, DVec2::new(f64::from(width), f64::from(height))];
    Ok(Picture::shrunk([width, height], kept, whole, texel))
}

/// A picture placed in light space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Image {
    picture: Arc<Picture>,
    /// From light space to the picture's box.
    to_own: DAffine2,
    opaque: bool,
}

impl Image {
    /// `to_light` maps the picture's box to light space. `None` if it has no inverse.
    pub(super) fn new(picture: Arc<Picture>, to_light: DAffine2) -> Option<Self> {
        let to_own = to_light.inverse();
        let opaque = picture.texels.iter().all(|t| t.w >= 1.0);
        to_own.is_finite().then_some(Self { picture, to_own, opaque })
    }

    /// The same picture after the plane has been moved by `map`'s inverse.
    pub(super) fn after(&self, from_moved: DAffine2) -> Self {
        Self { to_own: self.to_own * from_moved, ..self.clone() }
    }

    pub(super) const fn is_opaque(&self) -> bool {
        self.opaque
    }

    /// Texels of the picture per metre along the axes of light space.
    pub(super) fn density(&self) -> DVec2 {
        let own = self.texel_from_light();
        DVec2::new(own.x_axis.length(), own.y_axis.length())
    }

    /// The box of light space, in whole texels of the picture, around `low` to `high`, and the texels it holds; `None` where
    /// the picture's rows and columns don't run along the axes.
    pub(super) fn aligned(&self, low: DVec2, high: DVec2) -> Option<([DVec2; 2], [u32; 2])> {
        let own = self.to_own.matrix2;
        let skew = own.x_axis.y.abs() / own.x_axis.x.abs() + own.y_axis.x.abs() / own.y_axis.y.abs();
        if skew.is_nan() || skew > 1e-9 {
            return None;
        }
        let texel = self.picture.texel_size();
        let (a, b) = (self.to_own.transform_point2(low) / texel, self.to_own.transform_point2(high) / texel);
        let size = DVec2::new(f64::from(self.picture.width), f64::from(self.picture.height));
        // What lies on a texel's edge but for rounding does not reach into the next texel.
        let first = (a.min(b) + 1e-6).floor().clamp(DVec2::ZERO, size - 1.0);
        let last = (a.max(b) - 1e-6).ceil().clamp(first + 1.0, size);
        let (from, to) = (self.to_own.inverse(), last - first);
        let (a, b) = (from.transform_point2(first * texel), from.transform_point2(last * texel));
        Some(([a.min(b), a.max(b)], [to.x as u32, to.y as u32]))
    }

    /// What shows the picture with texels of size `cell`: where these are larger than its own, it is averaged by area.
    pub(super) fn view(&self, cell: DVec2) -> View {
        let own = self.texel_from_light();
        // Texels of the picture that a texel of the view reaches over, along the picture's axes.
        let reach = (own.x_axis * cell.x).abs() + (own.y_axis * cell.y).abs();
        let source = &self.picture;
        let fewer =
            |count: u32, reach: f64| if reach > 1.0 + 1e-6 { (f64::from(count) / reach).ceil() as u32 } else { count };
        let size = [fewer(source.width, reach.x), fewer(source.height, reach.y)];
        let picture = if size == [source.width, source.height] {
            Arc::clone(source)
        } else {
            let texel = |x: u32, y: u32| source.texels[y as usize * source.width as usize + x as usize];
            Arc::new(Picture::shrunk([source.width, source.height], size, [source.low, source.high], texel))
        };
        View { picture, to_own: self.to_own }
    }

    fn texel_from_light(&self) -> glam::DMat2 {
        glam::DMat2::from_diagonal(self.picture.texel_size().recip()) * self.to_own.matrix2
    }
}

/// A picture at the right size to be sampled.
pub(super) struct View {
    picture: Arc<Picture>,
    to_own: DAffine2,
}

impl View {
    pub(super) fn at(&self, p: DVec2) -> DVec4 {
        self.picture.sample(self.to_own.transform_point2(p)).as_dvec4()
    }
}
