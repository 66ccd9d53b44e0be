//! Materials and textures of a scene file.

use super::error::SceneError;
use super::table::{Limit, Table, Value};
use crate::scene::folder::Folder;
use crate::scene::texture::MAX_BYTES;
use crate::scene::{Material, Texture};
use std::collections::BTreeMap;

const UNIT: Limit = Limit::new(|v| (0.0..=1.0).contains(&v), "between 0 and 1");
const FINITE: Limit = Limit::new(|v| v.abs() <= 1e6, "within ±1e6");

/// The textures of a scene, each file read once per use as colour or as data.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) list: Vec<Texture>,
    known: BTreeMap<(String, bool), u32>,
}

impl Textures {
    fn load(&mut self, value: &Value<'_>, folder: &Folder, srgb: bool) -> Result<u32, SceneError> {
        let name = value.string()?;
        let key = (name.to_owned(), srgb);
        if let Some(&index) = self.known.get(&key) {
            return Ok(index);
        }
        let bytes = folder.read(name, MAX_BYTES).map_err(|e| value.resource(e))?;
        self.list.push(Texture::decode(&bytes, srgb).map_err(|e| value.resource(e))?);
        let index = self.list.len() as u32 - 1;
        self.known.insert(key, index);
        Ok(index)
    }
}

/// A material; keys that are missing have the values of [`Material::default`], but factors of a texture are 1.
pub(super) fn read(table: &Table<'_>, folder: &Folder, textures: &mut Textures) -> Result<Material, SceneError> {
    table.only(&[
        "base_color",
        "metallic",
        "alpha",
        "roughness",
        "specular",
        "base_color_texture",
        "metallic_roughness_texture",
        "normal_texture",
        "normal_scale",
    ])?;
    let unit = |v: &Value<'_>| v.number(&UNIT).map(|n| n as f32);
    let mut texture = |key: &str, srgb: bool| table.read(key, |v| textures.load(v, folder, srgb));
    let base_color_texture = texture("base_color_texture", true)?;
    let metallic_roughness_texture = texture("metallic_roughness_texture", false)?;
    let normal_texture = texture("normal_texture", false)?;
    let mut default = Material::default();
    if base_color_texture.is_some() {
        default.base_color = [1.0; 3];
    }
    if metallic_roughness_texture.is_some() {
        (default.metallic, default.alpha) = (1.0, 1.0);
    }
    let alpha = table.read("alpha", unit)?;
    let roughness = table.read("roughness", unit)?;
    let alpha = match (alpha, roughness) {
        (Some(_), Some(_)) => {
            return Err(table.error("alpha and roughness are the same thing: give one (alpha = roughness²)"));
        }
        (Some(alpha), None) => alpha,
        (None, Some(roughness)) => roughness * roughness,
        (None, None) => default.alpha,
    };
    Ok(Material {
        base_color: table.read("base_color", |v| v.color(&UNIT))?.map_or(default.base_color, |c| c.map(|v| v as f32)),
        metallic: table.read("metallic", unit)?.unwrap_or(default.metallic),
        alpha,
        specular: table.read("specular", unit)?.unwrap_or(default.specular),
        base_color_texture,
        metallic_roughness_texture,
        normal_texture,
        normal_scale: table.read("normal_scale", |v| v.number(&FINITE))?.map_or(default.normal_scale, |s| s as f32),
    })
}
