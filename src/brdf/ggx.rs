//! The truth the lobes are fitted to: GGX with the height-correlated Smith masking-shadowing, in f64.
//!
//! Shading frame: z is the normal, the view direction v = (sin θ, 0, cos θ). Fresnel is 1 throughout; its split-sum
//! terms are in [`Albedo`].
//!
//! Walter, Marschner, Li, Torrance, *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007;
//! Heitz, *Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs*, JCGT 3(2) 2014.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// D(h), the density of microfacet normals per unit solid angle and area. Walter 2007 eq. 33, with tan² written as
/// sin²/cos² so that a narrow lobe keeps its digits.
///
/// `h` is a unit vector; 0 below the horizon.
pub fn normal_density(alpha: f64, h: DVec3) -> f64 {
    if h.z <= 0.0 {
        return 0.0;
    }
    let spread = h.x * h.x + h.y * h.y + alpha * alpha * h.z * h.z;
    alpha * alpha / (PI * spread * spread)
}

/// cos·(1 + 2Λ) = √(cos² + α² sin²). Heitz 2014 eq. 72 multiplied by the cosine, which keeps grazing angles finite.
fn smith(alpha: f64, cos: f64) -> f64 {
    (cos * cos + alpha * alpha * (1.0 - cos * cos)).sqrt()
}

/// Height-correlated masking-shadowing G2 = 1/(1 + Λ(v) + Λ(l)). Heitz 2014 eq. 99.
///
/// `cos_v` and `cos_l` are the cosines with the normal, 0 to 1.
pub fn masking_shadowing(alpha: f64, cos_v: f64, cos_l: f64) -> f64 {
    2.0 * cos_v * cos_l / (cos_l * smith(alpha, cos_v) + cos_v * smith(alpha, cos_l))
}

/// f(v, l)·cos θ_l = D·G2/(4 cos θ_v), in 1/sr, with Fresnel = 1. 0 where `l` is at or below the horizon.
///
/// `v` and `l` are unit vectors, v.z ≥ 0; finite at grazing view.
pub fn brdf_cos(alpha: f64, v: DVec3, l: DVec3) -> f64 {
    if l.z <= 0.0 {
        return 0.0;
    }
    let d = normal_density(alpha, (v + l).normalize());
    d * l.z / (2.0 * (l.z * smith(alpha, v.z) + v.z * smith(alpha, l.z)))
}

/// The view direction at the given cosine: (sin θ, 0, cos θ).
pub fn view(cos_theta: f64) -> DVec3 {
    DVec3::new(((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt(), 0.0, cos_theta)
}

/// The two split-sum terms: specular albedo = F0·(magnitude − fresnel) + F90·fresnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Albedo {
    /// ∫ f cos θ dω, the directional albedo with Fresnel = 1.
    pub magnitude: f64,
    /// ∫ f (1 − v·h)⁵ cos θ dω.
    pub fresnel: f64,
}

/// Directional albedo by Gauss–Legendre quadrature over the microfacet slopes, right to about 1e-7.
///
/// Slopes are taken in polar form, radius α·tan ζ. The reflected ray stays above the horizon inside a circle of
/// the slope plane (centre tan θ, radius 1/cos θ), which gives ζ its upper end; panels shrink towards that end
/// and towards the azimuth π/2, where the circle's edge turns sharply at grazing view.
pub fn albedo(alpha: f64, cos_theta: f64) -> Albedo {
    let v = view(cos_theta);
    let rule = gauss_legendre(10);
    let mut sum = Albedo { magnitude: 0.0, fresnel: 0.0 };
    for (phi, w_phi) in graded(&rule, 0.0, FRAC_PI_2, 18).chain(graded(&rule, PI, FRAC_PI_2, 18)) {
        let t = v.x / v.z * phi.cos();
        let radius = if t >= 0.0 { t + t.hypot(1.0) } else { 1.0 / (t.hypot(1.0) - t) };
        for (zeta, w) in graded(&rule, 0.0, radius.atan2(alpha), 5) {
            let r = alpha * zeta.tan();
            let hz = 1.0 / r.hypot(1.0);
            let facing = v.x * r * phi.cos() + v.z;
            let cos_l = 2.0 * facing * hz * hz - v.z;
            if cos_l <= 0.0 {
                continue;
            }
            let g_over_cos = 2.0 * cos_l / (cos_l * smith(alpha, v.z) + v.z * smith(alpha, cos_l));
            // The azimuths π..2π double the integral over 0..π.
            let value = 2.0 * w_phi * w * zeta.sin() * zeta.cos() / PI * g_over_cos * facing;
            sum.magnitude += value;
            sum.fresnel += value * (1.0 - facing * hz).max(0.0).powi(5);
        }
    }
    sum
}

/// Nodes and weights on `from..to` in panels that halve towards `to`. The direction does not change the sign.
fn graded(rule: &[(f64, f64)], from: f64, to: f64, panels: i32) -> impl Iterator<Item = (f64, f64)> {
    (0..panels).flat_map(move |k| {
        let near = if k + 1 == panels { 0.0 } else { 0.5f64.powi(k + 1) };
        let (a, b) = (to + (from - to) * 0.5f64.powi(k), to + (from - to) * near);
        rule.iter().map(move |&(x, w)| (0.5 * (a + b) + 0.5 * (b - a) * x, 0.5 * (b - a).abs() * w))
    })
}

/// Gauss–Legendre nodes and weights on −1..1 (Newton's method on the Legendre recurrence).
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut p, mut p_before) = (1.0, 0.0);
                for k in 0..n {
                    let k = k as f64;
                    (p, p_before) = (((2.0 * k + 1.0) * x * p - k * p_before) / (k + 1.0), p);
                }
                slope = n as f64 * (x * p - p_before) / (x * x - 1.0);
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Density with which the visible normals' reflections fall about `l`, per steradian (Heitz 2014, G1·D/(4 cos θ_v)).
/// It follows the lobe within a factor, at any view.
pub fn visible_density(alpha: f64, v: DVec3, l: DVec3) -> f64 {
    normal_density(alpha, (v + l).normalize()) / (2.0 * (v.z + smith(alpha, v.z)))
}
