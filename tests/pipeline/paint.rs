//! Colours from place to place: gradients, images and patterns of SVGs, and the pictures that lights carry.

mod gradients;
mod images;
mod lights;

use crate::svg::options;
use glam::{DVec2, DVec4};
use glyphlight::color::srgb_decode;
use glyphlight::outline::svg::{Art, svg};

/// Units along each side of the drawings here; their light is one metre wide and centred.
const SIDE: f64 = 100.0;

fn drawing(body: &str) -> String {
    format!(r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{body}</svg>"#)
}

fn read(body: &str) -> Art {
    svg(drawing(body).as_bytes(), "test.svg", &options(1.0)).unwrap_or_else(|e| panic!("{e}\n{body}"))
}

/// The light-space point of a point of the drawing.
fn place(p: DVec2) -> DVec2 {
    DVec2::new(p.x / SIDE - 0.5, 0.5 - p.y / SIDE)
}

/// What shines at a point of the drawing: colour, linear and premultiplied, and opacity.
fn shown(art: &Art, p: DVec2) -> DVec4 {
    let p = place(p);
    let layers = art.layers.iter().filter(|layer| layer.shape.winding(p) == 1);
    layers
        .map(|l| l.picture.as_ref().map_or(DVec4::from((l.color.into(), l.opacity)), |c| c.sample(p).as_dvec4()))
        .sum()
}

/// The linear, premultiplied colour of an sRGB colour with alpha.
fn linear(srgb: DVec4) -> DVec4 {
    (DVec4::from_array(srgb.to_array().map(srgb_decode)) * srgb.w).with_w(srgb.w)
}

/// Greatest difference of a channel.
fn off(a: DVec4, b: DVec4) -> f64 {
    (a - b).abs().max_element()
}

pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |chunk: &[u8]| {
        let bits = (0..3).fold(0_u32, |bits, i| bits << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        let digit =
            |i: usize| if i <= chunk.len() { char::from(DIGITS[(bits >> (18 - 6 * i) & 63) as usize]) } else { '=' };
        (0..4).map(digit).collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

/// A PNG of `pixel(x, y)`, y down, as a data URI.
fn png(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> String {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(pixel(x, y)));
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    format!("data:image/png;base64,{}", base64(bytes.get_ref()))
}
