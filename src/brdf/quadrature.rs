//! Directions and solid angles that follow a GGX lobe: the sums of the fit and of the error map.

use super::ggx;
use glam::DVec3;
use std::f64::consts::PI;

/// Size of a `hemisphere`: rings × azimuths of visible normals, heights × azimuths of plain directions. Azimuths
/// cover half a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Rings and azimuths of the visible normals.
    pub normals: [usize; 2],
    /// Heights and azimuths of the plain directions.
    pub directions: [usize; 2],
}

/// Directions above the horizon with their solid angles, for integrands that are even in y and peak with the lobe.
///
/// Two midpoint rules, over the visible normals and over the hemisphere, joined by the balance heuristic. The rings of
/// normals step evenly in the cube root of the mass outside them, so that the tail is covered however narrow the lobe.
pub fn hemisphere(alpha: f64, v: DVec3, grid: Grid) -> Vec<(DVec3, f64)> {
    let [rings, azimuths] = grid.normals;
    let [heights, turns] = grid.directions;
    let normals = VisibleNormals::new(alpha, v);
    // Points per solid angle of both rules together; the mass outside the ring is τ³, so a ring holds 3τ²dτ.
    let density = |l: DVec3, tau: f64| {
        let near = (rings * azimuths) as f64 * 2.0 * ggx::visible_density(alpha, v, l) / (3.0 * tau * tau);
        near + (heights * turns) as f64 / PI
    };
    let mut points = Vec::with_capacity(rings * azimuths + heights * turns);
    for i in 0..rings {
        let tau = (i as f64 + 0.5) / rings as f64;
        for j in 0..azimuths {
            let phi = PI * ((j as f64 + 0.5) / azimuths as f64 - 0.5);
            let h = normals.at((1.0 - tau.powi(3)).sqrt(), phi);
            let l = h * (2.0 * v.dot(h)) - v;
            if l.z > 0.0 {
                points.push((l, 2.0 / density(l, tau)));
            }
        }
    }
    for i in 0..heights {
        let z = (i as f64 + 0.5) / heights as f64;
        for j in 0..turns {
            let (sin, cos) = (PI * (j as f64 + 0.5) / turns as f64).sin_cos();
            let l = DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
            let tau = normals.mass_outside((v + l).normalize()).cbrt();
            points.push((l, 2.0 / density(l, tau)));
        }
    }
    points
}

/// The map from the unit disc to visible normals. Heitz, *Sampling the GGX Distribution of Visible Normals*,
/// JCGT 7(4) 2018: a hemisphere seen from the stretched view, projected.
struct VisibleNormals {
    alpha: f64,
    /// View in the space where the surface is a hemisphere.
    view: DVec3,
    /// In that space, the disc's second axis; its first is y.
    across: DVec3,
    /// Half height of the visible part along `across`.
    half: f64,
}

impl VisibleNormals {
    /// `v` is a unit vector of the plane y = 0.
    fn new(alpha: f64, v: DVec3) -> Self {
        let view = DVec3::new(alpha * v.x, 0.0, v.z).normalize();
        Self { alpha, view, across: DVec3::new(-view.z, 0.0, view.x), half: 0.5 * (1.0 + view.z) }
    }

    /// The normal at a point of the disc; `radius`² is the mass of the normals inside. y ≥ 0 for |phi| ≤ π/2.
    fn at(&self, radius: f64, phi: f64) -> DVec3 {
        let y = radius * phi.cos();
        let across = (1.0 - self.half) * (1.0 - y * y).sqrt() + self.half * radius * phi.sin();
        let along = (1.0 - y * y - across * across).max(0.0).sqrt();
        let n = DVec3::Y * y + self.across * across + self.view * along;
        DVec3::new(self.alpha * n.x, self.alpha * n.y, n.z.max(0.0)).normalize()
    }

    /// The mass of the visible normals outside the ring through `h`, positive.
    fn mass_outside(&self, h: DVec3) -> f64 {
        let n = DVec3::new(h.x, h.y, self.alpha * h.z).normalize();
        let across = (n.dot(self.across) - (1.0 - self.half) * (1.0 - n.y * n.y).sqrt()) / self.half;
        (1.0 - n.y * n.y - across * across).max(1e-12)
    }
}
