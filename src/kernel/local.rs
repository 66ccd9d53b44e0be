//! What clusters of lights send to all points of a tile by the plain cosine: their local expansion about the tile's middle. Twin:
//! `shaders/local.wgsl`.
//!
//! Above all horizons the integral is linear in the surface's normal n, and over a tile nearly so in the place. With d from the tile's
//! middle to a point, y from there to a cluster's centre, and V = −(A·y + a), W = −(b·y + β) what the cluster's moments
//! ([`Cluster::moments`], their columns A, b and their last column a, β) make of y, the expansion at the point is
//!
//! ```text
//! π·E(d) = ∇h(y − d)·(V + A·d) + h(y − d)·(W + b·d),    h(q) = n·q/|q|⁴
//! ```
//!
//! and its value and slope at d = 0 are sums over clusters, twelve for each channel (Greengard, Rokhlin 1987: the translation of a
//! multipole expansion to a local one). With Φ = ∫L dA, w the largest distance of a point of the tile in front of a light, μ the root
//! mean of |δ|² and ρ the tile's radius, both over |y|, what is left out is at most
//!
//! ```text
//! Φ/π · ρ²/(1−ρ)³ · (w/|y|·(6 + 30μ) + 3 + 12μ)/|y|²
//! ```
//!
//! for the k-th term of the series of h is at most (k+1)(k+2)/2·|d|ᵏ/|y|³⁺ᵏ, and that of ∇h along a vector k+1 times the next.

use super::cluster::Cluster;
use super::lanes::{Lanes, Vector};
use super::receiver::dot_fixed;
use glam::{Mat4, Vec3};

/// Numbers of a channel: the values for a normal along x, y and z, and the slopes of each along x, y and z.
pub const TERMS: usize = 12;

/// Sums over clusters, times π: of a tile, or of one in each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local<L = f32> {
    /// Of red, green and blue.
    pub terms: [[L; TERMS]; 3],
}

impl Default for Local {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl<L: Lanes> Local<L> {
    /// Of no clusters.
    #[inline(always)]
    pub fn new(like: L) -> Self {
        Self { terms: [[like.splat(0.0); TERMS]; 3] }
    }

    /// Adds a cluster for the tiles of a mask; `y` leads from their middles to its centre.
    #[inline(always)]
    pub(super) fn add(&mut self, cluster: &Cluster, y: L::Vec3, tiles: L::Mask) {
        let square = y.length_squared();
        let inv = square.splat(1.0) / square.sqrt();
        let u = y * inv;
        let [red, green, blue] = &mut self.terms;
        add_channel(red, &cluster.moments[0], y, u, inv, tiles);
        add_channel(green, &cluster.moments[1], y, u, inv, tiles);
        add_channel(blue, &cluster.moments[2], y, u, inv, tiles);
    }
}

#[inline(always)]
fn add_channel<L: Lanes>(sums: &mut [L; TERMS], m: &Mat4, y: L::Vec3, u: L::Vec3, inv: L, tiles: L::Mask) {
    let axes = [m.x_axis, m.y_axis, m.z_axis];
    let (y, u) = ([y.x(), y.y(), y.z()], [u.x(), u.y(), u.z()]);
    let along = |i: usize| -(y[0] * axes[0][i] + y[1] * axes[1][i] + y[2] * axes[2][i] + m.w_axis[i]);
    let (v, w) = ([along(0), along(1), along(2)], along(3));
    let s = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let per_cube = inv * inv * inv;
    for i in 0..3 {
        let value = (v[i] - u[i] * s * 4.0) * inv + u[i] * w;
        sums[i] = L::select(tiles, sums[i] + value * per_cube, sums[i]);
        for j in 0..3 {
            let diagonal = if i == j { 1.0 } else { 0.0 };
            let across = u[0] * axes[j].x + u[1] * axes[j].y + u[2] * axes[j].z;
            let second = (v[i] * u[j] + v[j] * u[i] + s * diagonal) * 4.0 - u[i] * u[j] * s * 24.0;
            let first = (u[i] * u[j] * 4.0 - diagonal) * w - u[i] * across * 4.0 + axes[j][i];
            let slope = (second * inv + first) * inv + u[i] * axes[j].w;
            let at = 3 + 3 * i + j;
            sums[at] = L::select(tiles, sums[at] + slope * per_cube, sums[at]);
        }
    }
}

impl Local {
    /// The integrals of each channel, times π, for points with those unit normals, `away` from the tile's middle.
    #[inline(always)]
    pub(super) fn at<L: Lanes>(&self, normal: L::Vec3, away: L::Vec3) -> [L; 3] {
        let [red, green, blue] = &self.terms;
        [channel_at(red, normal, away), channel_at(green, normal, away), channel_at(blue, normal, away)]
    }
}

#[inline(always)]
fn channel_at<L: Lanes>(terms: &[f32; TERMS], normal: L::Vec3, away: L::Vec3) -> L {
    let row =
        |i: usize| dot_fixed::<L>(away, Vec3::new(terms[3 + 3 * i], terms[4 + 3 * i], terms[5 + 3 * i])) + terms[i];
    let sum = normal.x() * row(0) + normal.y() * row(1) + normal.z() * row(2);
    sum.max(sum.splat(0.0))
}
