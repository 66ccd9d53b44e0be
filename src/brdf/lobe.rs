//! A linearly transformed cosine in f64, with its derivatives: what the fitter moves.

use super::ggx::Albedo;
use super::ltc::Entry;
use glam::DVec3;
use std::f64::consts::PI;

/// A lobe by the four numbers that mirror symmetry leaves, seen from the mirror direction (see [`super::ltc`]).
///
/// Columns of M in the plane of incidence, x towards (cos θ, 0, sin θ), z the mirror direction:
/// α·a·(cos p, −sin p) and (sin ψ, cos ψ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// ψ: tilt of the lobe's axis, rad.
    pub axis: f64,
    /// p: tilt of the normal of the lobe's own horizon, rad; |ψ − p| < π/2.
    pub horizon: f64,
    /// ln a: width in the plane of incidence over α.
    pub ln_width: f64,
    /// ln of the y entry of M⁻¹, where M⁻¹ is scaled to a first row of unit length.
    pub ln_inv_y: f64,
}

/// Number of parameters of a [`Shape`].
pub(super) const PARAMETERS: usize = 4;

/// A [`Shape`] at one α and θ, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    shape: Shape,
    width: f64,
    inv_y: f64,
    /// sin and cos of θ.
    theta: (f64, f64),
    axis: (f64, f64),
    horizon: (f64, f64),
}

impl Shape {
    pub(super) fn transform(self, alpha: f64, v: DVec3) -> Transform {
        Transform {
            shape: self,
            width: alpha * self.ln_width.exp(),
            inv_y: self.ln_inv_y.exp(),
            theta: (v.x, v.z),
            axis: self.axis.sin_cos(),
            horizon: self.horizon.sin_cos(),
        }
    }

    /// The table's form of the lobe.
    pub(super) fn entry(self, alpha: f64, v: DVec3, albedo: Albedo) -> Entry {
        let (sin_p, cos_p) = self.horizon.sin_cos();
        let (sin_axis, cos_axis) = self.axis.sin_cos();
        let shrink = (-self.ln_width).exp();
        Entry {
            ux: (cos_p * v.z + sin_p * v.x) as f32,
            uz: (cos_p * v.x - sin_p * v.z) as f32,
            beta: ((self.axis - self.horizon).cos() * (-self.ln_inv_y).exp()).sqrt() as f32,
            tau_x: (sin_axis * shrink / alpha) as f32,
            tau_z: (cos_axis * shrink) as f32,
            magnitude: albedo.magnitude as f32,
            fresnel: albedo.fresnel as f32,
        }
    }
}

impl Transform {
    /// Density at the direction `l` (shading frame) per steradian, and its derivatives by the shape's parameters in
    /// the order of the fields.
    pub(super) fn density(&self, l: DVec3) -> (f64, [f64; PARAMETERS]) {
        let ((s, c), (sin_axis, cos_axis), (sin_p, cos_p)) = (self.theta, self.axis, self.horizon);
        let (x, z) = (c * l.x + s * l.z, c * l.z - s * l.x);
        let q = DVec3::new(cos_axis * x - sin_axis * z, self.inv_y * l.y, self.width * (sin_p * x + cos_p * z));
        if q.z <= 0.0 {
            return (0.0, [0.0; PARAMETERS]);
        }
        let tilt = self.shape.axis - self.shape.horizon;
        let det = self.width * tilt.cos() * self.inv_y;
        let r2 = q.length_squared();
        let scale = det / (PI * r2 * r2);
        let value = scale * q.z;
        // value = det·q.z/(π|q|⁴): derivatives of ln det, of q.z and of |q|².
        let slope = |d_ln_det: f64, d_z: f64, q_dq: f64| scale * d_z + value * (d_ln_det - 4.0 * q_dq / r2);
        let tan = tilt.tan();
        let turned = self.width * (cos_p * x - sin_p * z);
        let by_axis = slope(-tan, 0.0, -q.x * (sin_axis * x + cos_axis * z));
        let by_horizon = slope(tan, turned, q.z * turned);
        let by_width = slope(1.0, q.z, q.z * q.z);
        let by_inv_y = slope(1.0, 0.0, q.y * q.y);
        (value, [by_axis, by_horizon, by_width, by_inv_y])
    }

    /// The lobe's mass above the true horizon, and its derivatives.
    pub(super) fn above(&self) -> (f64, [f64; PARAMETERS]) {
        let ((s, c), (sin_axis, cos_axis), (sin_p, cos_p)) = (self.theta, self.axis, self.horizon);
        // Third row of M; y is 0.
        let (x, z) = (self.width * (cos_p * s - sin_p * c), sin_axis * s + cos_axis * c);
        let length = x.hypot(z);
        let slope = |dx: f64, dz: f64| 0.5 * x * (x * dz - z * dx) / length.powi(3);
        let by_axis = slope(0.0, cos_axis * s - sin_axis * c);
        let by_horizon = slope(-self.width * (sin_p * s + cos_p * c), 0.0);
        let by_width = slope(x, 0.0);
        (0.5 + 0.5 * z / length, [by_axis, by_horizon, by_width, 0.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::errors::density;
    use crate::brdf::ltc::{ALPHA_MIN, Provenance, Table, alpha_at, cos_theta_at};

    #[test]
    fn table_gives_the_lobe_back() {
        let shape = Shape { axis: 0.2, horizon: 0.9, ln_width: 0.6, ln_inv_y: 0.3 };
        let albedo = Albedo { magnitude: 0.9, fresnel: 0.1 };
        let provenance = Provenance { normals: [0, 0], directions: [0, 0], free_tilt: true };
        let (alpha, cos_theta) = (alpha_at(0.5), cos_theta_at(0.5));
        let v = crate::brdf::ggx::view(cos_theta);
        let entry = shape.entry(alpha, v, albedo);
        let table = Table::new(3, 3, provenance, &[entry; 9]).unwrap();
        let lobe = table.lobe(alpha as f32, cos_theta as f32);
        let transform = shape.transform(alpha, v);
        assert!(alpha > f64::from(ALPHA_MIN) && (f64::from(lobe.above) - transform.above().0).abs() < 1e-6);
        let other = Shape { axis: 0.201, ..shape }.transform(alpha, v);
        for l in [DVec3::Z, DVec3::new(-0.6, 0.0, 0.8), DVec3::new(-0.48, 0.6, 0.64), DVec3::new(0.28, 0.0, 0.96)] {
            let (kept, fitted) = (density(&lobe, l), transform.density(l).0);
            assert!((kept - fitted).abs() < 1e-5 * fitted, "{l}: {kept} instead of {fitted}");
            assert!((kept - other.density(l).0).abs() > 1e-5 * fitted, "{l}: another lobe is the same");
        }
    }
}
