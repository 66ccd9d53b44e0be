//! [`Picture`]: the colours of a light's plane.

use glam::{DVec2, Vec4};

/// A picture laid over a light's plane. Between texel centres it is bilinear, beyond the outer ones constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Texels across, at least 1.
    pub width: u32,
    /// Texels down, at least 1.
    pub height: u32,
    /// Linear Rec.709, multiplied by alpha; row 0 is on top, where y is largest. A factor of the layer's radiance.
    pub texels: Vec<Vec4>,
    /// Lower left corner of the picture, light space.
    pub low: DVec2,
    /// Upper right corner of the picture, light space.
    pub high: DVec2,
}
