//! [`Features`]: parts of the shading that a scene may do without, decided once when it is made ready.

use super::clusters::Clustered;
use super::near::may_be_near;
use super::uncut::may_cut;
use super::{Horizons, Skips, Technique};
use crate::backend::emitter::{Emitter, Geometry};
use crate::kernel::surface::{NO_TEXTURE, SurfaceMaterial, SurfaceTriangle};
use crate::kernel::tile::LightBox;

/// Fewest emitters about which tiles decide: a decision costs a tile about as much as one point saves by it.
const TILED_EMITTERS: usize = 4;

/// Most emitters of which tops are shared: each is found by one invocation of a workgroup for each lobe.
pub const TOPPED: usize = 8;
/// Least nodes of a tree that has a top worth sharing.
const TALL: usize = 64;

/// Whether an emitter has a tree with a top.
fn has_top(emitter: &Emitter) -> bool {
    matches!(&emitter.geometry, Geometry::Tree(tree) if tree.nodes.len() >= TALL)
}

/// Parts of the shading that a scene needs. The shaders are compiled for them only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Features {
    /// Some material has a diffuse part.
    pub diffuse: bool,
    /// Some material has a specular lobe.
    pub specular: bool,
    /// Some material has a texture.
    pub textures: bool,
    /// Some light is a sphere or a tube.
    pub bodies: bool,
    /// Some emitter has a picture.
    pub pictures: bool,
    /// The horizon of some surface may cut some light.
    pub horizons: bool,
    /// Some surface comes so near a light, or has so narrow a lobe, that f32 may show.
    pub near: bool,
    /// The points of a GPU's workgroup share the top of the trees.
    pub tops: bool,
    /// Specular lobes are clipped at the true horizon.
    pub true_horizon: bool,
    /// A GPU has the lights integrated in windows, several dispatches for a picture.
    pub windows: bool,
    /// What is left out.
    pub skips: Skips,
    /// Name of the technique.
    pub technique: &'static str,
}

impl Features {
    /// What shading needs for those materials and emitters. With a skip off, its part is needed.
    pub fn new(
        triangles: &[SurfaceTriangle],
        materials: &[SurfaceMaterial],
        boxes: &[LightBox],
        emitters: &[Emitter],
        technique: &Technique,
        horizons: Horizons,
        skips: Skips,
    ) -> Self {
        let skips = technique.skips(skips);
        // A metallic texture only lowers the metallic value.
        let diffuse = materials.iter().any(|m| {
            let black = m.base_color.truncate().max_element() <= 0.0;
            !black && (m.base_color.w < 1.0 || m.metallic_roughness_texture != NO_TEXTURE)
        });
        let specular = materials.iter().any(|m| m.specular > 0.0 || m.base_color.w > 0.0);
        let textures = materials.iter().any(|m| {
            let of_material = [m.base_color_texture, m.metallic_roughness_texture, m.normal_texture];
            of_material.iter().any(|&texture| texture != NO_TEXTURE)
        });
        Self {
            diffuse: diffuse || !skips.lobes,
            specular: specular || !skips.lobes,
            textures: textures || !skips.textures,
            bodies: emitters.iter().any(|e| e.form.is_body()),
            pictures: emitters.iter().any(|e| e.picture.is_some()),
            tops: emitters.len() <= TOPPED && emitters.iter().any(has_top),
            near: may_be_near(triangles, materials, boxes),
            true_horizon: horizons == Horizons::Both,
            windows: false,
            horizons: !skips.horizons || may_cut(triangles, materials, boxes),
            skips,
            technique: technique.name(),
        }
    }

    /// Leaves out what nothing is decided by: clusters where there are none, tiles where few emitters are outside of them.
    pub fn restrict(&mut self, clustered: &Clustered) {
        let skips = &mut self.skips;
        let tiled = clustered.apart.len() >= TILED_EMITTERS;
        skips.clusters = !clustered.tree.clusters.is_empty();
        skips.behind &= tiled;
        skips.below_horizon &= tiled;
        skips.under_tolerance &= tiled;
    }

    /// The parts that are left out for the whole picture, by name.
    pub fn left_out(&self) -> Vec<String> {
        let parts = [
            ("diffuse", self.diffuse),
            ("specular", self.specular),
            ("textures", self.textures),
            ("horizons", self.horizons),
        ];
        parts.iter().filter(|(_, needed)| !needed).map(|(name, _)| (*name).to_owned()).collect()
    }
}
