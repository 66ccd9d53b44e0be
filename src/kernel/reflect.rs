//! What a surface point reflects. Twin: `shaders/reflect.wgsl`.

use super::surface::SurfacePoint;
use crate::brdf::ltc::Lobe;
use glam::Vec3;

/// Reflected radiance per unit of radiance and of integral: radiance = weight · L · E.
#[derive(Clone, Copy, Debug)]
pub struct Reflectance {
    /// Weight of the plain cosine.
    pub diffuse: Vec3,
    /// Weight of the lobe, clipped at both horizons.
    pub specular: Vec3,
    /// The specular lobe.
    pub lobe: Lobe,
}

impl SurfacePoint {
    /// F0 and F90: how much the specular lobe reflects at normal and at grazing incidence.
    pub fn fresnel_ends(&self) -> (Vec3, f32) {
        let dielectric = Vec3::splat(0.04 * self.specular);
        let f0 = dielectric.lerp(self.base_color, self.metallic);
        (f0, self.specular + (1.0 - self.specular) * self.metallic)
    }

    /// The weights for a lobe that was looked up at this point's α.
    ///
    /// Specular: directional albedo F0·(magnitude − fresnel) + F90·fresnel (split sum, Schlick's Fresnel), over the
    /// lobe's mass above the true horizon. Diffuse: Lambert, less what the specular lobe takes.
    pub fn reflectance(&self, lobe: Lobe) -> Reflectance {
        let (f0, f90) = self.fresnel_ends();
        let albedo = f0 * (lobe.magnitude - lobe.fresnel) + f90 * lobe.fresnel;
        let rest = (1.0 - albedo.max_element()).max(0.0) * (1.0 - self.metallic);
        Reflectance { diffuse: self.base_color * rest, specular: albedo / lobe.above, lobe }
    }
}
