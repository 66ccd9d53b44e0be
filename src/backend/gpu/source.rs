//! The shaders, put together from `shaders/*.wgsl`: plain concatenation, with the constants that Rust owns in front.

use super::layout::BOX_COUNT_BITS;
use crate::brdf::ltc::{ALPHA_MIN, Table};
use crate::kernel::horizon::MARGIN;
use crate::kernel::map::FOOT_LIMIT;
use crate::kernel::surface::{NO_TEXTURE, SEAM};
use crate::kernel::tree::{CLUSTER, CUBIC, DEEPEST, LINK_MASK, RUN, SEGMENT, SLACK};

/// Rows of the skip counters: workgroups of different rows do not wait for each other.
pub const SKIP_ROWS: u32 = 32;

/// The source of one pass.
#[derive(Clone, Debug)]
pub struct Source {
    /// The pass.
    pub name: &'static str,
    /// WGSL.
    pub code: String,
}

macro_rules! concatenate {
    ($name:literal: $($stem:literal)*) => {
        Source {
            name: $name,
            code: [constants().as_str(), $(include_str!(concat!("../../../shaders/", $stem, ".wgsl"))),*].join("\n"),
        }
    };
}

/// Which triangle each sample sees: `draw_triangle`, `store_triangle`.
pub fn gbuffer() -> Source {
    concatenate!("gbuffer": "types" "raster" "gbuffer")
}

/// Shading: `light_pixels`, with the overrides `DIFFUSE`, `SPECULAR` and `TEXTURES`.
pub fn light() -> Source {
    concatenate!("light": "types" "ltc" "frame" "map" "edge" "horizon" "tree" "surface" "nearest" "shade" "light")
}

/// The light meter: `read_meter`.
pub fn meter() -> Source {
    concatenate!("meter": "types" "ltc" "frame" "map" "edge" "horizon" "tree" "surface" "shade" "meter")
}

/// The constants that Rust owns.
fn constants() -> String {
    let [alphas, thetas] = Table::shipped().size();
    let unsigned = [
        ("LINK_MASK", LINK_MASK),
        ("CLUSTER", CLUSTER),
        ("RUN", RUN),
        ("SEGMENT", SEGMENT),
        ("CUBIC", CUBIC),
        ("DEEPEST", DEEPEST),
        ("NO_TEXTURE", NO_TEXTURE),
        ("BOX_COUNT_BITS", BOX_COUNT_BITS),
        ("SKIP_ROWS", SKIP_ROWS),
        ("LTC_ALPHAS", alphas as u32),
        ("LTC_THETAS", thetas as u32),
    ];
    let mut code: String = unsigned.iter().map(|(name, value)| format!("const {name}: u32 = {value}u;\n")).collect();
    let floats = [
        ("LTC_ALPHA_MIN", ALPHA_MIN),
        ("SEAM", SEAM),
        ("SLACK", SLACK),
        ("MARGIN", MARGIN),
        ("FOOT_LIMIT", FOOT_LIMIT as f32),
    ];
    for (name, value) in floats {
        code += &format!("const {name}: f32 = {value:e};\n");
    }
    code
}
