//! Whether f32 may show in the integral of a light: near to it, or in a narrow lobe. The shaders keep more digits only then.

use crate::kernel::surface::{NO_TEXTURE, SurfaceMaterial, SurfaceTriangle};
use crate::kernel::tile::LightBox;
use glam::Vec3;
use rayon::prelude::*;

/// Widest lobe (GGX width) whose axis needs more digits than an f32 frame has: 1e-7 of a radian is 3e-6 of its width.
pub const NARROW: f32 = 0.03;
/// Distance over the light's half-width below which a light is near: by [`NARROW`] and the shaders' own measure, a 256th of it in
/// cosine space, where the widest lobe that is not narrow stretches it.
const NEAR: f32 = 0.2;
/// Most pairs of a triangle and a light that are looked at; with more, all lights count as near.
const MOST_PAIRS: usize = 1 << 24;

/// Whether some surface comes near some light, or has a narrow lobe. `false` is proven by boxes; `true` is not.
pub fn may_be_near(triangles: &[SurfaceTriangle], materials: &[SurfaceMaterial], lights: &[LightBox]) -> bool {
    let is_narrow = |m: &SurfaceMaterial| {
        let shines = m.specular > 0.0 || m.base_color.w > 0.0;
        shines && (m.alpha < NARROW || m.metallic_roughness_texture != NO_TEXTURE)
    };
    if materials.iter().any(is_narrow) || triangles.len().saturating_mul(lights.len()) > MOST_PAIRS {
        return true;
    }
    let boxes: Vec<[Vec3; 2]> = lights
        .iter()
        .map(|light| {
            let [x, y, z] =
                [(light.x, light.half_x), (light.y, light.half_y), (light.z, light.half_z)].map(|(a, h)| a.abs() * h);
            let reach = x + y + z + light.half_x.max(light.half_y).max(light.half_z) * NEAR;
            [light.center - reach, light.center + reach]
        })
        .collect();
    triangles.par_iter().any(|t| {
        let a = t.p0.truncate();
        let (b, c) = (a + t.e1.truncate(), a + t.e2.truncate());
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // What is no number counts as near.
        boxes.iter().any(|[from, to]| !(low.cmpgt(*to).any() || high.cmplt(*from).any()))
    })
}
