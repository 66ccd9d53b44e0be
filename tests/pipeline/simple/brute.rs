//! The oracle: what reaches a point from a body, summed over the parts of its surface whose normal looks at the point.

use glam::{DMat3, DVec3};
use glyphlight::brdf::ltc::Lobe;
use glyphlight::kernel::frame::ShadingFrame;
use std::f64::consts::{PI, TAU};

/// A body in world space.
#[derive(Clone, Copy, Debug)]
pub enum Body {
    Sphere {
        center: DVec3,
        radius: f64,
    },
    /// A cylinder with flat caps.
    Tube {
        center: DVec3,
        axis: DVec3,
        radius: f64,
        length: f64,
    },
}

impl Body {
    /// Midpoints of n² pieces of each smooth part: place, outer normal, area. Of the round parts only the side that looks at
    /// `from` is cut into pieces, which are smaller the nearer they are.
    fn pieces(&self, from: DVec3, n: u32, mut visit: impl FnMut(DVec3, DVec3, f64)) {
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        let cells = f64::from(n * n);
        match *self {
            Self::Sphere { center, radius } => {
                let up = (from - center).normalize();
                let (x, y) = up.any_orthonormal_pair();
                let seen = (1.0 - radius / (from - center).length()).max(0.0);
                for i in 0..n {
                    let u = middle(i);
                    let z = 1.0 - seen * u * u;
                    let s = (1.0 - z * z).sqrt();
                    for j in 0..n {
                        let (sin, cos) = (TAU * middle(j)).sin_cos();
                        let normal = x * (s * cos) + y * (s * sin) + up * z;
                        visit(center + normal * radius, normal, TAU * 2.0 * u * seen * radius * radius / cells);
                    }
                }
            }
            Self::Tube { center, axis, radius, length } => {
                let across = (from - center) - axis * (from - center).dot(axis);
                let rho = across.length();
                let (x, y) = axis.any_orthonormal_pair();
                if rho > radius {
                    let front = across / rho;
                    let side = axis.cross(front);
                    let half = (radius / rho).acos();
                    // Along the tube in equal angles as seen from `from`.
                    let along = (from - center).dot(axis);
                    let angle = |at: f64| ((at - along) / (rho - radius)).atan();
                    let (low, high) = (angle(-0.5 * length), angle(0.5 * length));
                    for i in 0..n {
                        let (sin, cos) = (half * (2.0 * middle(i) - 1.0)).sin_cos();
                        let normal = front * cos + side * sin;
                        for j in 0..n {
                            let angle = low + (high - low) * middle(j);
                            let place = center + axis * (along + (rho - radius) * angle.tan()) + normal * radius;
                            let step = (high - low) * (rho - radius) / angle.cos().powi(2);
                            visit(place, normal, 2.0 * half * radius * step / cells);
                        }
                    }
                }
                for outward in [axis, -axis] {
                    for i in 0..n {
                        let r = radius * middle(i);
                        for j in 0..n {
                            let (sin, cos) = (TAU * middle(j)).sin_cos();
                            let place = center + outward * (0.5 * length) + x * (r * cos) + y * (r * sin);
                            visit(place, outward, TAU * radius * r / cells);
                        }
                    }
                }
            }
        }
    }

    /// The normalised integral of the plain cosine, or of a lobe above the true horizon.
    pub fn integral(&self, frame: &ShadingFrame, position: DVec3, lobe: Option<&Lobe>, n: u32) -> f64 {
        let m_inv = lobe.map_or(DMat3::IDENTITY, |l| l.m_inv.mat3().as_dmat3());
        let determinant = m_inv.determinant();
        let mut sum = 0.0;
        self.pieces(position, n, |place, normal, area| {
            let to = place - position;
            let d2 = to.length_squared();
            let cosine = -to.dot(normal) / d2.sqrt();
            let w = frame.to_local(to / d2.sqrt());
            if cosine > 0.0 && w.z > 0.0 {
                let image = m_inv * w;
                let length2 = image.length_squared();
                // The clamped cosine at M⁻¹w, times the change of solid angle.
                let density = image.z.max(0.0) * determinant / (length2 * length2 * PI);
                sum += density * cosine * area / d2;
            }
        });
        sum
    }
}
