//! From a camera ray and a triangle to the point to shade. Twin: `shaders/surface.wgsl`.
//!
//! Positions are relative to the camera, so that a scene far from the world's origin costs no digits.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

/// "No texture" in [`SurfaceMaterial`].
pub const NO_TEXTURE: u32 = u32::MAX;

/// How far a triangle reaches over its edges, of its size: rounding must not open a crack between neighbours.
pub const SEAM: f32 = 4e-6;

/// The camera, positions relative to it: a ray's direction is forward + x·right + y·up, x and y in −1..1.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Rays {
    /// Into the picture; w: angle of a sample's footprint, radians.
    pub forward: Vec4,
    /// To the right edge.
    pub right: Vec4,
    /// To the upper edge.
    pub up: Vec4,
}

impl Rays {
    /// The direction (not unit) through the point (x, y) of the picture, both in −1..1, y up.
    #[inline]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        self.forward.truncate() + self.right.truncate() * x + self.up.truncate() * y
    }
}

/// A triangle, ready for shading.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceTriangle {
    /// First corner relative to the camera; w: texture coordinates per metre.
    pub p0: Vec4,
    /// Second corner − first; w: u of the first corner.
    pub e1: Vec4,
    /// Third corner − first; w: v of the first corner.
    pub e2: Vec4,
    /// Normal of the first corner; w: u of the second.
    pub n0: Vec4,
    /// Normal of the second corner; w: v of the second.
    pub n1: Vec4,
    /// Normal of the third corner; w: u of the third.
    pub n2: Vec4,
    /// Tangent of the first corner; w: sign of the bitangent.
    pub t0: Vec4,
    /// Tangent of the second corner; w: v of the third.
    pub t1: Vec4,
    /// Tangent of the third corner; w: the material's index, as bits.
    pub t2: Vec4,
}

/// A material, ready for shading. See [`crate::scene::Material`].
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceMaterial {
    /// Linear Rec.709; w: metallic.
    pub base_color: Vec4,
    /// GGX width.
    pub alpha: f32,
    /// Weight of the dielectric lobe.
    pub specular: f32,
    /// Scale of the normal map.
    pub normal_scale: f32,
    /// Index of a [`SurfaceTexture`] or [`NO_TEXTURE`].
    pub base_color_texture: u32,
    /// Index of a [`SurfaceTexture`] or [`NO_TEXTURE`].
    pub metallic_roughness_texture: u32,
    /// Index of a [`SurfaceTexture`] or [`NO_TEXTURE`].
    pub normal_texture: u32,
    /// To the size WGSL gives the struct.
    pub pad: [u32; 2],
}

/// A texture's place in the array of texels: level after level, each half the size of the one before, rounded
/// down, to 1 × 1.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceTexture {
    /// First texel of level 0.
    pub offset: u32,
    /// Texels across at level 0.
    pub width: u32,
    /// Texels down at level 0.
    pub height: u32,
    /// Number of levels.
    pub levels: u32,
}

/// Textures and their texels (RGBA8, R lowest; colours sRGB-encoded).
#[derive(Clone, Copy, Debug)]
pub struct Textures<'a> {
    /// Where each texture lies.
    pub textures: &'a [SurfaceTexture],
    /// All texels of all levels.
    pub texels: &'a [u32],
    /// Whether any material has one.
    pub any: bool,
}

/// Where a ray from the camera meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// A point to shade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Relative to the camera, metres.
    pub position: Vec3,
    /// Unit shading normal, on the viewer's side.
    pub normal: Vec3,
    /// Unit vector towards the eye.
    pub view: Vec3,
    /// Linear Rec.709.
    pub base_color: Vec3,
    /// 0 to 1.
    pub metallic: f32,
    /// GGX width.
    pub alpha: f32,
    /// Weight of the dielectric lobe.
    pub specular: f32,
}

/// The ray from the origin along `direction` against a triangle grown by [`SEAM`], both sides (Möller, Trumbore 1997). `None` where it
/// misses or runs in the triangle's plane.
#[inline]
pub fn intersect(triangle: &SurfaceTriangle, direction: Vec3) -> Option<Hit> {
    let (e1, e2) = (triangle.e1.truncate(), triangle.e2.truncate());
    let p = direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let from = -triangle.p0.truncate();
    let q = from.cross(e1);
    // Inside or not is decided before any division, whose rounding differs between processors.
    let (u, v, t) = (from.dot(p) * det.signum(), direction.dot(q) * det.signum(), e2.dot(q) * det.signum());
    let det = det.abs();
    let seam = SEAM * det;
    (u >= -seam && v >= -seam && u + v <= det + seam && t > 0.0).then(|| Hit { t: t / det, u: u / det, v: v / det })
}

/// The point where `direction` meets a triangle, with its material and textures looked up.
pub fn surface_point(
    triangle: &SurfaceTriangle,
    materials: &[SurfaceMaterial],
    textures: &Textures<'_>,
    rays: &Rays,
    direction: Vec3,
    hit: Hit,
) -> SurfacePoint {
    let (e1, e2) = (triangle.e1.truncate(), triangle.e2.truncate());
    let position = triangle.p0.truncate() + e1 * hit.u + e2 * hit.v;
    let view = -direction.normalize();
    let w = 1.0 - hit.u - hit.v;
    let blend = |a: Vec4, b: Vec4, c: Vec4| a.truncate() * w + b.truncate() * hit.u + c.truncate() * hit.v;
    let geometric = e1.cross(e2).normalize();
    let facing = if geometric.dot(view) < 0.0 { -1.0 } else { 1.0 };
    let mut normal = blend(triangle.n0, triangle.n1, triangle.n2).normalize() * facing;
    let material = &materials[triangle.t2.w.to_bits() as usize];
    let mut base_color = material.base_color.truncate();
    let mut metallic = material.base_color.w;
    let mut alpha = material.alpha;
    if textures.any {
        let uv = Vec2::new(triangle.e1.w, triangle.e2.w) * w
            + Vec2::new(triangle.n0.w, triangle.n1.w) * hit.u
            + Vec2::new(triangle.n2.w, triangle.t1.w) * hit.v;
        // Width of the sample's footprint in texture coordinates, the mean of its two axes.
        let slant = geometric.dot(view).abs().max(0.01);
        let footprint = triangle.p0.w * rays.forward.w * position.length() / slant.sqrt();
        if material.base_color_texture != NO_TEXTURE {
            base_color *= sample(textures, material.base_color_texture, uv, footprint, true);
        }
        if material.metallic_roughness_texture != NO_TEXTURE {
            let texel = sample(textures, material.metallic_roughness_texture, uv, footprint, false);
            // Perceptual roughness is multiplied: alpha is its square.
            alpha *= texel.y * texel.y;
            metallic *= texel.z;
        }
        if material.normal_texture != NO_TEXTURE {
            let texel = sample(textures, material.normal_texture, uv, footprint, false) * 2.0 - 1.0;
            let tangent = blend(triangle.t0, triangle.t1, triangle.t2);
            let tangent = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
            let bitangent = normal.cross(tangent) * (triangle.t0.w * facing);
            let scale = material.normal_scale;
            let bent = tangent * (texel.x * scale) + bitangent * (texel.y * scale) + normal * texel.z.max(0.01);
            normal = bent.normalize();
        }
    }
    // A normal that looks away from the eye, by interpolation or by a normal map, is turned until it doesn't.
    let away = normal.dot(view);
    if away < 1e-3 {
        normal = (normal + view * (1e-3 - away)).normalize();
    }
    SurfacePoint { position, normal, view, base_color, metallic, alpha, specular: material.specular }
}

/// Trilinear look-up, repeating in both directions; `footprint` is the sample's width in texture coordinates.
fn sample(textures: &Textures<'_>, index: u32, uv: Vec2, footprint: f32, srgb: bool) -> Vec3 {
    let texture = textures.textures[index as usize];
    let texels = footprint * texture.width.max(texture.height) as f32;
    let level = texels.max(1.0).log2().min((texture.levels - 1) as f32);
    let fine = level.floor();
    let a = bilinear(textures, texture, fine as u32, uv, srgb);
    if level == fine {
        return a;
    }
    a.lerp(bilinear(textures, texture, fine as u32 + 1, uv, srgb), level - fine)
}

fn bilinear(textures: &Textures<'_>, texture: SurfaceTexture, level: u32, uv: Vec2, srgb: bool) -> Vec3 {
    let mut offset = texture.offset;
    let (mut width, mut height) = (texture.width, texture.height);
    for _ in 0..level {
        offset += width * height;
        width = (width / 2).max(1);
        height = (height / 2).max(1);
    }
    let at = (uv - uv.floor()) * Vec2::new(width as f32, height as f32) - 0.5;
    let corner = at.floor();
    let f = at - corner;
    let wrap = |i: i32, n: u32| i.rem_euclid(n as i32) as u32;
    let (x0, x1) = (wrap(corner.x as i32, width), wrap(corner.x as i32 + 1, width));
    let (y0, y1) = (wrap(corner.y as i32, height), wrap(corner.y as i32 + 1, height));
    let texel = |x: u32, y: u32| unpack(textures.texels[(offset + y * width + x) as usize], srgb);
    texel(x0, y0).lerp(texel(x1, y0), f.x).lerp(texel(x0, y1).lerp(texel(x1, y1), f.x), f.y)
}

fn unpack(texel: u32, srgb: bool) -> Vec3 {
    let c = Vec3::new((texel & 255) as f32, (texel >> 8 & 255) as f32, (texel >> 16 & 255) as f32) / 255.0;
    if srgb { Vec3::new(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z)) } else { c }
}

/// IEC 61966-2-1.
fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
