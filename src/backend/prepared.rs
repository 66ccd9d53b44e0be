//! A scene made ready for shading: flat arrays, relative to the camera, that both backends read.

use super::clusters::Clustered;
use super::emitter::{Emitter, emitters_after, layers};
use super::features::Features;
use super::stage::{Changes, Reuse};
use super::tile::light_box;
use super::{BackendError, Horizons, Settings, Technique};
use crate::brdf::ltc::{Lobe, Table};
use crate::color::{srgb_decode, srgb_encode};
use crate::kernel::surface::{NO_TEXTURE, Rays, SurfaceMaterial, SurfaceTexture, SurfaceTriangle, Textures};
use crate::kernel::tile::LightBox;
use crate::scene::{Material, Scene, Texture, Triangle};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// The scene as the backends read it. Positions are relative to `eye`.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The camera's place in the world.
    pub eye: DVec3,
    /// Ray directions.
    pub rays: Rays,
    /// Triangles.
    pub triangles: Vec<SurfaceTriangle>,
    /// Materials.
    pub materials: Vec<SurfaceMaterial>,
    /// Where each texture's texels lie.
    pub textures: Vec<SurfaceTexture>,
    /// Texels of all textures and levels.
    pub texels: Vec<u32>,
    /// What surfaces gather from, in the order of lights and layers.
    pub emitters: Vec<Emitter>,
    /// How they are clustered.
    pub clustered: Clustered,
    /// Boxes around the emitters.
    pub boxes: Vec<LightBox>,
    /// What the camera sees: every layer of every light.
    pub layers: Vec<Emitter>,
    /// What the emitters are made for.
    pub technique: Technique,
    /// Where specular lobes are clipped.
    pub horizons: Horizons,
    /// What shading them needs.
    pub features: Features,
    /// Sample positions in the pixel, both coordinates 0..1, x right, y down.
    pub offsets: Vec<[f32; 2]>,
}

/// Farthest corner of a surface from the camera along an axis, metres: areas and their sums stay within f32.
const FARTHEST: f64 = 1e16;

impl Prepared {
    /// Prepares `scene` for a picture, the lights for its technique.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self, BackendError> {
        Self::renewed(scene, settings, None, &mut Reuse::default())
    }

    /// As [`Prepared::new`], from what was prepared for the picture before, of the same settings and of a scene with those
    /// `Changes` to this one.
    pub fn renewed(
        scene: &Scene,
        settings: &Settings,
        known: Option<(Self, &Changes)>,
        reuse: &mut Reuse,
    ) -> Result<Self, BackendError> {
        settings.check()?;
        let Settings { width, height, samples, .. } = *settings;
        let frame = scene.camera.frame(f64::from(width) / f64::from(height));
        let pixel = 2.0 * frame.up.length() / f64::from(height);
        let footprint = pixel / f64::from(samples).sqrt();
        let rays = Rays {
            forward: frame.forward.as_vec3().extend(footprint as f32),
            right: frame.right.as_vec3().extend(0.0),
            up: frame.up.as_vec3().extend(0.0),
        };
        let pictured = scene.lights.iter().find(|light| light.layers.iter().any(|layer| layer.picture.is_some()));
        if let (Technique::Exact, Some(light)) = (settings.technique, pictured) {
            return Err(BackendError::Picture { light: light.name.clone() });
        }
        let eye = scene.camera.position;
        let (known, changes) = known.unzip();
        let (known, known_emitters) = match known {
            Some(mut known) => {
                let emitters = core::mem::take(&mut known.emitters);
                (Some(known), emitters)
            }
            None => (None, Vec::new()),
        };
        reuse.count("textures", known.is_some());
        let (triangles, materials, textures, texels) = match known {
            Some(known) => {
                let triangles = (!changes.is_some_and(|c| c.eye)).then_some(known.triangles);
                (triangles, known.materials, known.textures, known.texels)
            }
            None => {
                let (textures, texels) = pack_textures(&scene.textures);
                (None, scene.materials.iter().map(pack_material).collect(), textures, texels)
            }
        };
        let triangles = match triangles {
            Some(triangles) => triangles,
            None => pack_triangles(scene)?,
        };
        let emitters = emitters_after(scene, &settings.technique, known_emitters, changes, reuse)?;
        let horizons = settings.horizons();
        let boxes: Vec<_> = emitters.iter().map(light_box).collect();
        let mut features =
            Features::new(&triangles, &materials, &boxes, &emitters, &settings.technique, horizons, settings.skips);
        let clustered = Clustered::new(&emitters, features.skips);
        features.restrict(&clustered);
        Ok(Self {
            eye,
            rays,
            triangles,
            materials,
            textures,
            texels,
            clustered,
            boxes,
            emitters,
            layers: layers(scene)?,
            technique: settings.technique,
            horizons,
            features,
            offsets: offsets(samples),
        })
    }

    /// The lobe of a surface of GGX width `alpha`, viewed at `cos_theta`.
    #[inline]
    pub fn lobe(&self, table: &Table, alpha: f32, cos_theta: f32) -> Lobe {
        let lobe = table.lobe(alpha, cos_theta);
        if self.horizons == Horizons::Cosine { lobe.with_one_horizon() } else { lobe }
    }

    /// The textures as the kernel reads them.
    pub fn textures(&self) -> Textures<'_> {
        Textures { textures: &self.textures, texels: &self.texels, any: self.features.textures }
    }
}

/// Sample positions: the centre for one, the R2 sequence (Roberts 2018) for more.
fn offsets(samples: u32) -> Vec<[f32; 2]> {
    const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (0..samples).map(|s| R2.map(|r| (0.5 + r * f64::from(s)).fract() as f32)).collect()
}

/// The triangles as seen from the camera.
fn pack_triangles(scene: &Scene) -> Result<Vec<SurfaceTriangle>, BackendError> {
    let eye = scene.camera.position;
    for (triangle, vertex) in scene.triangles.iter().enumerate().flat_map(|(i, t)| t.vertices.map(|v| (i, v))) {
        let position = vertex.position;
        if !(0.0..=FARTHEST).contains(&(position - eye).abs().max_element()) {
            return Err(BackendError::Far { triangle, position, limit: FARTHEST });
        }
    }
    Ok(scene.triangles.par_iter().map(|t| pack_triangle(t, eye)).collect())
}

fn pack_triangle(triangle: &Triangle, eye: DVec3) -> SurfaceTriangle {
    let [a, b, c] = triangle.vertices;
    let relative = |p: DVec3| p - eye;
    let (e1, e2) = ((b.position - a.position).as_vec3(), (c.position - a.position).as_vec3());
    let area = e1.cross(e2).length();
    let uv_area = (b.uv - a.uv).perp_dot(c.uv - a.uv).abs();
    let density = if area > 0.0 { (uv_area / area).sqrt() } else { 0.0 };
    SurfaceTriangle {
        p0: relative(a.position).as_vec3().extend(density),
        e1: e1.extend(a.uv.x),
        e2: e2.extend(a.uv.y),
        n0: a.normal.extend(b.uv.x),
        n1: b.normal.extend(b.uv.y),
        n2: c.normal.extend(c.uv.x),
        t0: a.tangent,
        t1: b.tangent.truncate().extend(c.uv.y),
        t2: c.tangent.truncate().extend(f32::from_bits(triangle.material)),
    }
}

fn pack_material(m: &Material) -> SurfaceMaterial {
    SurfaceMaterial {
        base_color: Vec3::from_array(m.base_color).extend(m.metallic),
        alpha: m.alpha,
        specular: m.specular,
        normal_scale: m.normal_scale,
        base_color_texture: m.base_color_texture.unwrap_or(NO_TEXTURE),
        metallic_roughness_texture: m.metallic_roughness_texture.unwrap_or(NO_TEXTURE),
        normal_texture: m.normal_texture.unwrap_or(NO_TEXTURE),
        pad: [0; 2],
    }
}

/// All levels of all textures, one after the other.
fn pack_textures(textures: &[Texture]) -> (Vec<SurfaceTexture>, Vec<u32>) {
    let mut texels = Vec::new();
    let mut packed = Vec::new();
    for texture in textures {
        let offset = texels.len() as u32;
        let (mut width, mut height) = (texture.width, texture.height);
        let mut level: Vec<Vec4> = texture.texels.iter().map(|&t| decode(t, texture.srgb)).collect();
        texels.extend_from_slice(&texture.texels);
        let mut levels = 1;
        while width > 1 || height > 1 {
            let (w, h) = ((width / 2).max(1), (height / 2).max(1));
            let at = |x: u32, y: u32| level[(y.min(height - 1) * width + x.min(width - 1)) as usize];
            let box_filter = |i: u32| {
                let (x, y) = (i % w * 2, i / w * 2);
                (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) * 0.25
            };
            level = (0..w * h).map(box_filter).collect();
            (width, height) = (w, h);
            levels += 1;
            texels.extend(level.iter().map(|&t| encode(t, texture.srgb)));
        }
        packed.push(SurfaceTexture { offset, width: texture.width, height: texture.height, levels });
    }
    (packed, texels)
}

/// A texel to linear values. Levels are averaged in linear light.
fn decode(texel: u32, srgb: bool) -> Vec4 {
    let c = Vec4::from_array(texel.to_le_bytes().map(|b| f32::from(b) / 255.0));
    let linear = |v: f32| srgb_decode(f64::from(v)) as f32;
    if srgb { Vec4::new(linear(c.x), linear(c.y), linear(c.z), c.w) } else { c }
}

fn encode(c: Vec4, srgb: bool) -> u32 {
    let gamma = |v: f32| srgb_encode(f64::from(v)) as f32;
    let c = if srgb { Vec4::new(gamma(c.x), gamma(c.y), gamma(c.z), c.w) } else { c };
    u32::from_le_bytes(c.to_array().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8))
}
