//! The shaders, put together from `shaders/*.wgsl`: plain concatenation, with the constants that Rust owns in front.

use super::layout::{BOX_COUNT_BITS, NO_PICTURE};
use crate::backend::features::TOPPED;
use crate::backend::near::NARROW;
use crate::brdf::ltc::{ALPHA_MIN, Table};
use crate::kernel::cluster::{
    CLUSTER_PART, CLUSTER_SLACK, FIRST_SHARE, HALF, INDEX_MASK, LEFT_OUT, LOCAL_SHARE, ROUNDING, SINGLE,
};
use crate::kernel::cluster_list::{DEEPEST as CLUSTERS_DEEPEST, MOST_LISTED, MOST_WAITING};
use crate::kernel::curve::NEAREST_IMAGE;
use crate::kernel::expansion::{ACROSS, LEAST, LEVEL};
use crate::kernel::lanes::Lanes;
use crate::kernel::map::FOOT_LIMIT;
use crate::kernel::receiver::{PLAIN, SPECULAR};
use crate::kernel::roots::{ROOT_NOISE, ROOT_STEPS};
use crate::kernel::subdivide::{DIFFUSE_EPS, HALVINGS, INTERVALS, SPECULAR_EPS, START_LEVEL};
use crate::kernel::surface::{NO_TEXTURE, SEAM};
use crate::kernel::tile::{BUCKETS, SKIP_SHARE};
use crate::kernel::tree::{CLUSTER, CUBIC, DEEPEST, LINK_MASK, RUN, SEGMENT, SHARE, SLACK};
use crate::kernel::{pal, representative};

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

/// Files of `shaders/`, in order.
macro_rules! files {
    ($($stem:literal)*) => { &[$(include_str!(concat!("../../../shaders/", $stem, ".wgsl"))),*] };
}

/// What every technique needs to find its integrals.
const LIGHTS: &[&str] = files!("types" "window" "wide" "ltc" "frame" "body" "map" "edge" "horizon" "shade");

/// What evaluates the integrals of a technique: the function `gather`.
fn technique(name: &str) -> &'static [&'static str] {
    match name {
        "kuge" => files!("cubic" "curve" "roots" "subdivide" "picture" "gather_contour" "gather_kuge"),
        "uniform" => files!("cubic" "curve" "polygon" "picture" "gather_contour" "gather_uniform"),
        "quad" => files!("quad" "picture" "gather_contour" "gather_quad"),
        "textured" => files!("cubic" "expansion" "tree" "near" "picture" "gather_near" "gather_textured"),
        "pal" => files!("pal" "picture" "gather_pal"),
        "representative" => files!("representative" "picture" "gather_representative"),
        _ => files!("cubic" "expansion" "tree" "near" "mosaic" "gather_near" "gather_tree"),
    }
}

/// Whether the techniques of that name walk trees, whose top the points of a workgroup share.
pub fn has_tops(name: &str) -> bool {
    !matches!(name, "kuge" | "uniform" | "quad" | "pal" | "representative")
}

fn concatenate(name: &'static str, files: &[&[&str]]) -> Source {
    Source {
        name,
        code: [constants()]
            .into_iter()
            .chain(files.concat().into_iter().map(str::to_owned))
            .collect::<Vec<_>>()
            .join("\n"),
    }
}

/// Which triangle each sample sees: `draw_triangle`, `store_triangle`.
pub fn gbuffer() -> Source {
    concatenate("gbuffer", &[files!("types" "raster" "gbuffer")])
}

/// Shading by the technique of that name: `light_pixels`, with the overrides `DIFFUSE`, `SPECULAR`, `TEXTURES`,
/// `PICTURES`, `BODIES` and `TRUE_HORIZON` and those of what is skipped.
pub fn light(name: &str) -> Source {
    concatenate(
        "light",
        &[
            LIGHTS,
            technique(name),
            files!("surface" "reflect" "nearest" "tile" "skips" "receiver" "cluster" "local" "cluster_list" "cluster_walk" "light_list"),
            if has_tops(name) { files!("top") } else { files!("no_top") },
            files!("light"),
        ],
    )
}

/// The light meter of the technique of that name: `read_meter`, with the overrides `PICTURES`, `BODIES` and
/// `TRUE_HORIZON`.
pub fn meter(name: &str) -> Source {
    concatenate("meter", &[LIGHTS, technique(name), files!("meter")])
}

/// Work for the clocks to be compared by: `spin`.
pub fn clock() -> Source {
    Source { name: "clock", code: files!("clock").concat() }
}

/// The constants that Rust owns.
fn constants() -> String {
    let [alphas, thetas] = Table::shipped().size();
    let unsigned = [
        ("TOPPED", TOPPED as u32),
        ("SINGLE", SINGLE),
        ("HALF", HALF),
        ("INDEX_MASK", INDEX_MASK),
        ("MOST_LISTED", MOST_LISTED as u32),
        ("MOST_WAITING", MOST_WAITING as u32),
        ("CLUSTERS_DEEPEST", CLUSTERS_DEEPEST as u32),
        ("PLAIN", PLAIN as u32),
        ("SPECULAR_LOBE", SPECULAR as u32),
        ("LINK_MASK", LINK_MASK),
        ("CLUSTER", CLUSTER),
        ("RUN", RUN),
        ("SEGMENT", SEGMENT),
        ("CUBIC", CUBIC),
        ("DEEPEST", DEEPEST),
        ("ROOT_STEPS", ROOT_STEPS),
        ("START_LEVEL", START_LEVEL),
        ("INTERVALS", INTERVALS),
        ("HALVINGS", HALVINGS),
        ("NO_TEXTURE", NO_TEXTURE),
        ("NO_PICTURE", NO_PICTURE),
        ("BOX_COUNT_BITS", BOX_COUNT_BITS),
        ("SKIP_ROWS", SKIP_ROWS),
        ("BUCKETS", BUCKETS),
        ("PAL_WEIGHTED", pal::WEIGHTED),
        ("PAL_BIASED", pal::BIASED),
        ("SOLID_RECTANGLE", representative::RECTANGLE),
        ("SOLID_DISC", representative::DISC),
        ("SOLID_SPHERE", representative::SPHERE),
        ("SOLID_TUBE", representative::TUBE),
        ("LTC_ALPHAS", alphas as u32),
        ("LTC_THETAS", thetas as u32),
    ];
    let mut code: String = unsigned.iter().map(|(name, value)| format!("const {name}: u32 = {value}u;\n")).collect();
    let first = ALPHA_MIN.sqrt();
    let floats = [
        ("LTC_FIRST", first),
        ("LTC_STEPS", (alphas - 1) as f32 / (1.0 - first)),
        ("LTC_ALPHA_MIN", ALPHA_MIN),
        ("NARROW", NARROW),
        ("SEAM", SEAM),
        ("SHARE", SHARE),
        ("SLACK", SLACK),
        ("SKIP_SHARE", SKIP_SHARE),
        ("FIRST_SHARE", FIRST_SHARE),
        ("LOCAL_SHARE", LOCAL_SHARE),
        ("CLUSTER_SLACK", CLUSTER_SLACK),
        ("CLUSTER_PART", CLUSTER_PART),
        ("LEFT_OUT", LEFT_OUT),
        ("ROUNDING", ROUNDING),
        ("MARGIN", f32::MARGIN),
        ("ACROSS", ACROSS),
        ("LEVEL_2", LEVEL[0]),
        ("LEVEL_3", LEVEL[1]),
        ("LEVEL_4", LEVEL[2]),
        ("LEAST", LEAST),
        ("FOOT_LIMIT", FOOT_LIMIT as f32),
        ("PAL_BIAS", pal::BIAS),
        ("PAL_NEAR", pal::NEAR),
        ("PAL_PHI", pal::PHI),
        ("PAL_MIRROR_EXPONENT", pal::MIRROR_EXPONENT),
        ("NEAREST_IMAGE", NEAREST_IMAGE),
        ("ROOT_NOISE", ROOT_NOISE),
        ("DIFFUSE_EPS", DIFFUSE_EPS),
        ("SPECULAR_EPS", SPECULAR_EPS),
    ];
    for (name, value) in floats {
        code += &format!("const {name}: f32 = {value:e};\n");
    }
    code
}
