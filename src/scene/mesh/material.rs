//! Materials of a mesh file.

use super::buffer::Buffers;
use super::{Located, Materials, MeshProblem};
use crate::scene::{Material, Texture};
use gltf::texture::WrappingMode;
use std::collections::BTreeMap;

/// Reads every material, and the textures that they use.
pub(super) fn read(document: &gltf::Document, buffers: &Buffers) -> Result<Materials, Located> {
    let mut reader = Reader { document, buffers, textures: Vec::new(), known: BTreeMap::new(), warnings: Vec::new() };
    let mut materials = document.materials().map(|m| reader.material(&m)).collect::<Result<Vec<_>, _>>()?;
    // A primitive without material has all the defaults of glTF 2.0, section 3.9.
    materials.push(Material { base_color: [1.0; 3], metallic: 1.0, alpha: 1.0, ..Material::default() });
    Ok(Materials { materials, textures: reader.textures, warnings: reader.warnings })
}

struct Reader<'a> {
    document: &'a gltf::Document,
    buffers: &'a Buffers,
    textures: Vec<Texture>,
    /// Index of what is read already, by image and whether it is sRGB.
    known: BTreeMap<(usize, bool), u32>,
    warnings: Vec<String>,
}

impl Reader<'_> {
    fn material(&mut self, material: &gltf::Material<'_>) -> Result<Material, Located> {
        let element = format!("materials[{}]", material.index().unwrap_or_default());
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let unit = |name, value: f32| -> Result<f32, Located> {
            let problem = MeshProblem::Range { name, value, range: "0 to 1" };
            if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(problem.at(element.as_str())) }
        };
        for c in [r, g, b] {
            unit("baseColorFactor", c)?;
        }
        let roughness = unit("roughnessFactor", pbr.roughness_factor())?;
        let metallic = unit("metallicFactor", pbr.metallic_factor())?;
        if material.alpha_mode() != gltf::material::AlphaMode::Opaque {
            self.warnings.push(format!("{element}: transparency is ignored: the material is opaque"));
        }
        if material.emissive_factor() != [0.0; 3] {
            self.warnings.push(format!("{element}: emission is ignored: only the scene's lights shine"));
        }
        let mut texture = |name: &str, texture: gltf::Texture<'_>, set: u32, srgb| {
            self.texture(&format!("{element}.{name}"), &texture, set, srgb)
        };
        let base_color_texture = match pbr.base_color_texture() {
            Some(info) => texture("baseColorTexture", info.texture(), info.tex_coord(), true)?,
            None => None,
        };
        let metallic_roughness_texture = match pbr.metallic_roughness_texture() {
            Some(info) => texture("metallicRoughnessTexture", info.texture(), info.tex_coord(), false)?,
            None => None,
        };
        let normal = material.normal_texture();
        let normal_scale = normal.as_ref().map_or(1.0, |n| n.scale());
        if !normal_scale.is_finite() {
            let range = "the finite numbers";
            return Err(MeshProblem::Range { name: "normalTexture.scale", value: normal_scale, range }.at(element));
        }
        let normal_texture = match normal {
            Some(info) => texture("normalTexture", info.texture(), info.tex_coord(), false)?,
            None => None,
        };
        Ok(Material {
            base_color: [r, g, b],
            metallic,
            alpha: roughness * roughness,
            specular: 1.0,
            base_color_texture,
            metallic_roughness_texture,
            normal_texture,
            normal_scale,
        })
    }

    /// The index of a texture, read once; nothing (and a warning) where we cannot sample it as it is meant.
    fn texture(
        &mut self,
        element: &str,
        texture: &gltf::Texture<'_>,
        set: u32,
        srgb: bool,
    ) -> Result<Option<u32>, Located> {
        if set != 0 {
            self.warnings.push(format!("{element}: ignored, since it uses uv set {set} and only set 0 is read"));
            return Ok(None);
        }
        let sampler = texture.sampler();
        if sampler.wrap_s() != WrappingMode::Repeat || sampler.wrap_t() != WrappingMode::Repeat {
            self.warnings.push(format!("{element}: repeats, where the file asks for clamping or mirroring"));
        }
        let image = texture.source().index();
        if let Some(&index) = self.known.get(&(image, srgb)) {
            return Ok(Some(index));
        }
        let element = format!("images[{image}]");
        let root = self.document.as_json();
        let json = &root.images[image];
        let decoded = match (&json.uri, json.buffer_view) {
            (Some(uri), _) => {
                let bytes = self.buffers.fetch(uri).map_err(|e| e.at(element.as_str()))?;
                Texture::decode(&bytes, srgb)
            }
            (None, Some(view)) => Texture::decode(self.buffers.view(root, view.value())?, srgb),
            (None, None) => return Err(MeshProblem::NoImage.at(element)),
        };
        self.textures.push(decoded.map_err(|e| MeshProblem::from(e).at(element))?);
        let index = self.textures.len() as u32 - 1;
        self.known.insert((image, srgb), index);
        Ok(Some(index))
    }
}
