//! Surfaces as triangles.

use glam::{DVec3, Vec2, Vec3, Vec4};

/// A corner of a triangle, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Metres.
    pub position: DVec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Unit tangent (direction of growing u) and the sign of the bitangent `w·(normal × tangent)`, which points up in
    /// the image (to falling v) as glTF has it: the green of a normal map leans that way.
    pub tangent: Vec4,
    /// Texture coordinate, v down.
    pub uv: Vec2,
}

/// A triangle with its material. Both sides are seen and lit: the normal is turned to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The corners.
    pub vertices: [Vertex; 3],
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
}

/// The two triangles of a rectangle.
///
/// `normal` need not be unit. The rectangle's first axis (u, `size.x`) is world x where the plane is level,
/// and level where it isn't; the second is `normal × first` turned so that v grows downwards or towards the reader.
/// Texture coordinates are in metres divided by `uv_scale`.
pub fn plane(position: DVec3, normal: DVec3, size: [f64; 2], uv_scale: f64, material: u32) -> [Triangle; 2] {
    let n = normal.normalize_or(DVec3::Y);
    let level = DVec3::Y.cross(n);
    let u = if level.length_squared() > 1e-12 { level.normalize() } else { DVec3::X };
    let v = u.cross(n);
    let corner = |su: f64, sv: f64| Vertex {
        position: position + u * (su * size[0] * 0.5) + v * (sv * size[1] * 0.5),
        normal: n.as_vec3(),
        tangent: u.as_vec3().extend(1.0),
        uv: Vec2::new((su * size[0] * 0.5 / uv_scale) as f32, (sv * size[1] * 0.5 / uv_scale) as f32),
    };
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    [Triangle { vertices: [a, b, c], material }, Triangle { vertices: [a, c, d], material }]
}
