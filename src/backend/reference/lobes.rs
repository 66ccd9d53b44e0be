//! What a surface point reflects: values, densities and samples of its lobes, in f64.
//!
//! Directions are unit vectors of the shading frame: z the normal, the view (sin θ, 0, cos θ).

use crate::backend::technique::ReferenceLobe;
use crate::brdf::ggx;
use crate::brdf::ltc;
use crate::brdf::ltc::ALPHA_MIN;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::surface::SurfacePoint;
use core::f64::consts::{PI, TAU};
use glam::{DMat3, DVec2, DVec3};

/// One reflection of a surface point, with the weight it has.
#[derive(Clone, Copy, Debug)]
pub enum Lobe {
    /// The plain cosine max(z, 0)/π times a weight.
    Cosine(DVec3),
    /// GGX, height-correlated, with Schlick's Fresnel at the half vector.
    Ggx {
        /// Width; not under the least of the lobes' table, so that a mirror is a very narrow lobe.
        alpha: f64,
        /// Towards the eye.
        view: DVec3,
        /// Reflectance at normal incidence.
        f0: DVec3,
        /// Reflectance at grazing incidence.
        f90: f64,
    },
    /// A linearly transformed cosine.
    Ltc {
        /// Cosine space to the shading frame, and back.
        maps: [DMat3; 2],
        /// Determinant of the way back, over π.
        scale: f64,
        /// The second plane it is clipped at, as a covector of cosine space: the surface's, or z = 0 again.
        horizon: DVec3,
        /// Reflected radiance per unit of radiance and of integral.
        weight: DVec3,
    },
}

/// The diffuse and the specular reflection of a point with the weights they have with every other technique: the diffuse part is
/// Lambert's less what the specular one takes by the table. `None` where the weight is zero. `lobe` is the point's.
pub fn of_surface(
    point: &SurfacePoint,
    frame: &ShadingFrame,
    lobe: ltc::Lobe,
    kind: ReferenceLobe,
) -> [Option<Lobe>; 2] {
    let reflectance = point.reflectance(lobe);
    let visible = |weight: DVec3| (weight.max_element() > 0.0).then_some(weight);
    let specular = visible(reflectance.specular.as_dvec3()).map(|weight| match kind {
        ReferenceLobe::Ltc => Lobe::ltc(&lobe, weight),
        ReferenceLobe::Ggx => {
            let (f0, f90) = point.fresnel_ends();
            Lobe::ggx(point.alpha, frame, f0.as_dvec3(), f90.into())
        }
    });
    [visible(reflectance.diffuse.as_dvec3()).map(Lobe::Cosine), specular]
}

impl Lobe {
    /// A lobe of the table with the weight it is reflected by.
    pub fn ltc(lobe: &ltc::Lobe, weight: DVec3) -> Self {
        let back = lobe.m_inv.mat3().as_dmat3();
        let horizon = lobe.m_row_z.as_dvec3();
        Self::Ltc { maps: [back.inverse(), back], scale: back.determinant() / PI, horizon, weight }
    }

    /// GGX of width `alpha`.
    pub fn ggx(alpha: f32, frame: &ShadingFrame, f0: DVec3, f90: f64) -> Self {
        Self::Ggx { alpha: alpha.clamp(ALPHA_MIN, 1.0).into(), view: ggx::view(frame.cos_theta), f0, f90 }
    }

    /// f(v, l)·cos θ_l, 1/sr; zero for a direction below the horizon.
    pub fn value(&self, l: DVec3) -> DVec3 {
        match *self {
            Self::Cosine(weight) => weight * (l.z.max(0.0) / PI),
            Self::Ggx { .. } if l.z <= 0.0 => DVec3::ZERO,
            Self::Ggx { alpha, view, f0, f90 } => {
                let x = (1.0 - view.dot((view + l).normalize())).max(0.0).powi(5);
                f0.lerp(DVec3::splat(f90), x) * ggx::brdf_cos(alpha, view, l)
            }
            Self::Ltc { maps: [_, back], horizon, weight, .. } => {
                if horizon.dot(back * l) > 0.0 {
                    weight * self.density(l)
                } else {
                    DVec3::ZERO
                }
            }
        }
    }

    /// Density of [`Lobe::sample`], 1/sr, at a direction whose value is not zero.
    pub fn density(&self, l: DVec3) -> f64 {
        match *self {
            Self::Cosine(_) => l.z.max(0.0) / PI,
            Self::Ggx { alpha, view, .. } => ggx::visible_density(alpha, view, l),
            Self::Ltc { maps: [_, back], scale, .. } => {
                let p = back * l;
                p.z.max(0.0) * scale / p.length_squared().powi(2)
            }
        }
    }

    /// A direction for a point of the unit square; it may be below the surface.
    ///
    /// GGX by its visible normals: Dupuy, Benyoub, *Sampling Visible GGX Normals with Spherical Caps*, HPG 2023. The
    /// transformed cosine by transforming a cosine: Heitz 2016, §3.
    pub fn sample(&self, [u, v]: [f64; 2]) -> DVec3 {
        let cosine = || (DVec2::from_angle(TAU * u) * v.sqrt()).extend((1.0 - v).max(0.0).sqrt());
        match *self {
            Self::Cosine(_) => cosine(),
            Self::Ggx { alpha, view, .. } => {
                let stretched = DVec3::new(alpha * view.x, alpha * view.y, view.z).normalize();
                let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
                let cap = (DVec2::from_angle(TAU * u) * ((1.0 - z) * (1.0 + z)).max(0.0).sqrt()).extend(z);
                let h = cap + stretched;
                let h = DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(DVec3::Z);
                h * (2.0 * view.dot(h)) - view
            }
            Self::Ltc { maps: [there, _], .. } => (there * cosine()).normalize_or(DVec3::Z),
        }
    }

    /// Roughly what is reflected per radiance and solid angle of a patch of light, to share samples out by: the patch is seen
    /// under the angle 2·`radius` about `l`, and `highest` is the largest cosine in it. More than 0 where that is.
    pub fn worth(&self, l: DVec3, highest: f64, radius: f64) -> f64 {
        // A lobe narrower than a patch may lie between the middles of two. Its own samples find it; here it counts as much.
        const MISSED: f64 = 0.1;
        match self {
            Self::Cosine(_) => highest,
            _ => MISSED * highest + self.value(l).max_element().min(1.0 / (PI * radius * radius)),
        }
    }

    /// Whether light from below the surface is reflected: by a lobe that is clipped at z = 0 of cosine space only.
    pub fn dips(&self) -> bool {
        matches!(self, Self::Ltc { horizon, .. } if horizon.truncate() == DVec2::ZERO)
    }
}
