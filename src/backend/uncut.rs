//! Whether the horizon of any surface may cut a light: where none does, nothing has to be clipped.

use crate::brdf::ltc::{ALPHA_MIN, Table, alpha_at};
use crate::kernel::surface::{NO_TEXTURE, SurfaceMaterial, SurfaceTriangle};
use crate::kernel::tile::LightBox;
use glam::DVec3;
use rayon::prelude::*;

/// Most pairs of a triangle and a light that are looked at; with more, lights count as cut.
const MOST_PAIRS: usize = 1 << 24;
/// Shading normals are bent towards the eye until their cosine is this; see [`crate::kernel::surface::surface_point`].
const LEAST_COSINE: f64 = 1e-3;
/// Rounding of positions and normals, relative to the distance.
const ROUNDING: f64 = 1e-5;

/// Whether a surface may see a light that its horizon cuts, be it that of the surface itself or that of its specular lobe. `false` is
/// proven for every point of every triangle and every view of it; `true` is not.
pub fn may_cut(triangles: &[SurfaceTriangle], materials: &[SurfaceMaterial], lights: &[LightBox]) -> bool {
    if triangles.len().saturating_mul(lights.len()) > MOST_PAIRS {
        return true;
    }
    let tilts: Vec<f64> = materials.iter().map(|m| steepest(Table::shipped(), m)).collect();
    triangles.par_iter().any(|t| {
        let material = t.t2.w.to_bits() as usize;
        let Some(receiver) = Receiver::new(t, &materials[material], tilts[material]) else { return true };
        lights.iter().any(|light| receiver.may_cut(light))
    })
}

/// Of all lobes of a material, the steepest plane where one ends: the tangent of its angle with the surface.
fn steepest(table: &Table, material: &SurfaceMaterial) -> f64 {
    if material.specular <= 0.0 && material.base_color.w <= 0.0 {
        return 0.0;
    }
    let [alphas, thetas] = table.size();
    let at = |row: usize| alpha_at(row as f64 / (alphas - 1) as f64);
    let alpha = f64::from(material.alpha.max(ALPHA_MIN));
    let textured = material.metallic_roughness_texture != NO_TEXTURE;
    // What is looked up lies between the nodes beside it, or anywhere below where a texture lowers it.
    let from = if textured { 0 } else { (0..alphas).rev().find(|&row| at(row) <= alpha).unwrap_or(0) };
    let to = (0..alphas).find(|&row| at(row) >= alpha).unwrap_or(alphas - 1);
    let entries = (from.min(to)..=to).flat_map(|row| (0..thetas).map(move |column| (row, column)));
    let tilt = |(row, column)| {
        let entry = table.entry(row, column);
        f64::from(entry.uz.abs() / entry.ux)
    };
    entries.map(tilt).fold(0.0, f64::max)
}

/// A triangle that light falls on.
struct Receiver {
    corners: [DVec3; 3],
    /// Unit normals of its corners on the viewer's side.
    normals: [DVec3; 3],
    /// How far a normal may be bent towards the eye.
    bend: f64,
    /// Of the steepest lobe.
    tilt: f64,
}

impl Receiver {
    /// `None` where its normals may be anything.
    fn new(t: &SurfaceTriangle, material: &SurfaceMaterial, tilt: f64) -> Option<Self> {
        if material.normal_texture != NO_TEXTURE {
            return None;
        }
        let a = t.p0.truncate().as_dvec3();
        let corners = [a, a + t.e1.truncate().as_dvec3(), a + t.e2.truncate().as_dvec3()];
        let geometric = (corners[1] - a).cross(corners[2] - a).try_normalize()?;
        let farthest = corners.iter().map(|p| p.length()).fold(0.0, f64::max);
        // The camera is at the origin.
        let facing = -geometric.dot(a);
        if facing.abs() <= ROUNDING * farthest {
            return None;
        }
        let normals = [t.n0, t.n1, t.n2].map(|n| n.truncate().as_dvec3().normalize_or_zero() * facing.signum());
        let cosines = normals.iter().flat_map(|n| corners.map(|p| n.dot(-p) / p.length()));
        let lowest = cosines.fold(f64::INFINITY, f64::min);
        // Where normals turn away from the eye, they may be bent by any angle.
        (lowest >= -ROUNDING).then(|| {
            let bend = (LEAST_COSINE - lowest).max(0.0) + ROUNDING;
            Self { corners, normals, bend, tilt }
        })
    }

    /// Whether a plane through a point of the triangle, its horizon or a lobe's, may have a part of the light below it.
    fn may_cut(&self, light: &LightBox) -> bool {
        let axes = [(light.x, light.half_x), (light.y, light.half_y), (light.z, light.half_z)]
            .map(|(axis, half)| axis.as_dvec3() * f64::from(half));
        let (center, normal) = (light.center.as_dvec3(), light.z.as_dvec3());
        let behind = |p: &DVec3| normal.dot(*p - center) < -ROUNDING * (p.length() + center.length());
        if light.one_sided == 1 && self.corners.iter().all(behind) {
            return false;
        }
        let reach = axes.iter().map(|a| a.length()).sum::<f64>();
        let farthest = self.corners.iter().map(|p| (center - *p).length()).fold(0.0, f64::max) + reach;
        let rounding = ROUNDING * self.corners.iter().map(|p| p.length()).fold(center.length(), f64::max);
        // Linear in the point and in the normal before it is brought to length 1, which only makes it longer: least at corners.
        let heights = self.normals.iter().flat_map(|n| {
            let below = axes.iter().map(|a| n.dot(*a).abs()).sum::<f64>();
            self.corners.map(|p| n.dot(center - p) - below)
        });
        let lowest = heights.fold(f64::INFINITY, f64::min) - self.bend * farthest - rounding;
        let is_above = lowest > self.tilt * farthest;
        !is_above
    }
}
