//! Linear 32-bit EXR with the layers as dotted channel names.

use super::{Film, FilmError};
use ::exr::meta::attribute::{Chromaticities, Text};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    SmallVec, Vec2, WritableImage,
};
use std::io::{Seek, Write};
use std::path::Path;

/// Rec. ITU-R BT.709-6, item 1.3 and 1.4: CIE xy of the primaries and of D65.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Encodes R, G, B (the sum) and `diffuse.*`, `specular.*`, `emission.*` (with the matte as its alpha), `background.*`, `variance.*` (where there is one) in one part, so that every viewer finds the
/// picture and those that know layers find them. 32-bit float, ZIP: every bit comes back.
pub(super) fn encode(film: &Film, out: impl Write + Seek, path: &Path) -> Result<(), FilmError> {
    let beauty: Vec<_> = film.beauty().collect();
    let layers = [
        ("", &beauty),
        ("diffuse.", &film.diffuse),
        ("specular.", &film.specular),
        ("emission.", &film.emission),
        ("background.", &film.background),
    ];
    let mut channels: SmallVec<[_; 4]> = layers
        .into_iter()
        .chain(film.variance.iter().map(|variance| ("variance.", variance)))
        .flat_map(|(layer, pixels)| {
            ["R", "G", "B"].iter().enumerate().map(move |(c, name)| {
                let samples = pixels.iter().map(|p| p[c]).collect();
                AnyChannel::new(Text::from(format!("{layer}{name}").as_str()), FlatSamples::F32(samples))
            })
        })
        .collect();
    channels.push(AnyChannel::new(Text::from("emission.A"), FlatSamples::F32(film.matte.clone())));
    let attributes = LayerAttributes {
        software_name: Some(Text::from(concat!("glyphlight ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (film.width as usize, film.height as usize);
    let mut image = Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels)));
    image.attributes.chromaticities = Some(REC_709);
    image.write().to_buffered(out).map_err(|e| FilmError::Encode { path: path.into(), message: e.to_string() })
}
