//! How far a table is from GGX: relative L1, L2, L3 errors over α and θ.

use super::ggx;
use super::ltc::{self, Lobe, Table};
use super::quadrature::{self, Grid};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Errors at one (α, θ): E_k = (∫ |fit − f cos θ|^k dω / ∫ (f cos θ)^k dω)^(1/k) over the directions above the true
/// horizon, for k = 1, 2, 3 (the norms of Heitz 2016, made relative). The fit is (magnitude/above)·D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeError {
    /// GGX width.
    pub alpha: f64,
    /// View cosine.
    pub cos_theta: f64,
    /// E_1, E_2, E_3.
    pub norms: [f64; 3],
}

/// Errors over a grid of α and θ.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// Rows of equal α, each with all cosines.
    pub rows: Vec<Vec<LobeError>>,
}

impl ErrorMap {
    /// The errors of `table` in the middle of `n` × `n` equal parts of its axes (√α, √(1 − cos θ)).
    pub fn between_nodes(table: &Table, n: usize) -> Self {
        let middle = |k: usize| (k as f64 + 0.5) / n as f64;
        let alphas: Vec<f64> = (0..n).map(|k| ltc::alpha_at(middle(k))).collect();
        let cosines: Vec<f64> = (0..n).map(|k| ltc::cos_theta_at(middle(k))).collect();
        table.error_map(&alphas, &cosines)
    }

    /// Mean of E_1, E_2, E_3 over the map.
    pub fn mean(&self) -> [f64; 3] {
        let count = self.cells().count() as f64;
        std::array::from_fn(|k| self.cells().map(|e| e.norms[k]).sum::<f64>() / count)
    }

    /// Largest E_1, E_2, E_3 of the map.
    pub fn max(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.cells().map(|e| e.norms[k]).fold(0.0, f64::max))
    }

    fn cells(&self) -> impl Iterator<Item = &LobeError> {
        self.rows.iter().flatten()
    }
}

/// Density of `lobe` at the direction `l` per steradian, in f64: D_o(M⁻¹l/|M⁻¹l|)·det M⁻¹/|M⁻¹l|³.
pub fn density(lobe: &Lobe, l: DVec3) -> f64 {
    let m_inv: DMat3 = lobe.m_inv.mat3().as_dmat3();
    let p = m_inv * l;
    p.z.max(0.0) * m_inv.determinant() / (PI * p.length_squared().powi(2))
}

impl Table {
    /// The errors of the look-up at every pair of `alphas` and `cosines`, whether or not they are nodes.
    pub fn error_map(&self, alphas: &[f64], cosines: &[f64]) -> ErrorMap {
        let row = |&alpha: &f64| cosines.iter().map(|&c| self.error_at(alpha, c)).collect();
        ErrorMap { rows: alphas.par_iter().map(row).collect() }
    }

    fn error_at(&self, alpha: f64, cos_theta: f64) -> LobeError {
        const FINE: Grid = Grid { normals: [96, 48], directions: [48, 48] };
        let v = ggx::view(cos_theta);
        let lobe = self.lobe(alpha as f32, cos_theta as f32);
        let scale = f64::from(lobe.magnitude / lobe.above);
        let (mut miss, mut whole) = ([0.0; 3], [0.0; 3]);
        for (l, w) in quadrature::hemisphere(alpha, v, FINE) {
            let f = ggx::brdf_cos(alpha, v, l);
            let error = (scale * density(&lobe, l) - f).abs();
            for k in 0..3 {
                miss[k] += w * error.powi(k as i32 + 1);
                whole[k] += w * f.powi(k as i32 + 1);
            }
        }
        let norms = std::array::from_fn(|k| (miss[k] / whole[k]).powf(1.0 / (k as f64 + 1.0)));
        LobeError { alpha, cos_theta, norms }
    }
}
