//! Seeded shapes and placements that the tests draw from.

use glam::{DMat3, DVec2, DVec3};
use glyphlight::kernel::lanes::Vector;
use glyphlight::kernel::wide::{Wide, Wide3};
use glyphlight::shape::{CubicBez, Shape};

/// SplitMix64: small, seeded, the same everywhere.
pub struct Rng(pub u64);

impl Rng {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    pub fn log_within(&mut self, lo: f64, hi: f64) -> f64 {
        self.within(lo.ln(), hi.ln()).exp()
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(-1.0, 1.0));
            if v.length_squared() < 1.0 && v.length_squared() > 1e-4 {
                return v.normalize();
            }
        }
    }
}

/// A loop around `center` with curves of every kind: cubics, raised quadratics, lines, S-curves.
pub fn ring(rng: &mut Rng, center: DVec2, radius: f64, n: usize, hole: bool) -> Vec<CubicBez> {
    let points: Vec<DVec2> = (0..n)
        .map(|i| {
            let angle = (i as f64 + rng.within(-0.3, 0.3)) / n as f64 * std::f64::consts::TAU;
            center + DVec2::from_angle(angle) * radius * rng.within(0.6, 1.0)
        })
        .collect();
    let mut curves: Vec<CubicBez> = (0..n)
        .map(|i| {
            let (a, b) = (points[i], points[(i + 1) % n]);
            let side = (b - a).perp() * -1.0;
            match (rng.unit() * 4.0) as u32 {
                0 => CubicBez::line(a, b),
                1 => CubicBez::quad(a, a.lerp(b, 0.5) + side * rng.within(-0.1, 0.3), b),
                2 => CubicBez::new(a, a.lerp(b, 0.3) + side * 0.2, a.lerp(b, 0.7) - side * rng.within(-0.2, 0.2), b),
                _ => CubicBez::new(a, a.lerp(b, 0.2) + side * 0.3, b, b),
            }
        })
        .collect();
    if hole {
        curves.reverse();
        curves.iter_mut().for_each(|c| *c = c.reversed());
    }
    curves
}

/// A blob, sometimes with a hole.
pub fn blob(rng: &mut Rng) -> Shape {
    let n = 3 + (rng.unit() * 12.0) as usize;
    let mut contours = vec![ring(rng, DVec2::ZERO, 1.0, n, false)];
    if rng.unit() < 0.5 {
        contours.push(ring(rng, DVec2::new(0.05, -0.03), 0.3, 5, true));
    }
    Shape::from_contours(contours).unwrap()
}

/// The cosine-space images of a light's axes and origin for a light at `origin` turned by `turn`, seen through
/// `m_inv`.
pub fn images(m_inv: DMat3, turn: DMat3, origin: DVec3, scale: f64) -> [DVec3; 3] {
    [m_inv * turn.x_axis * scale, m_inv * turn.y_axis * scale, m_inv * origin]
}

/// A vector for the kernel in f64.
pub fn wide(v: DVec3) -> Wide3 {
    Vector::of(Wide(v.x), Wide(v.y), Wide(v.z))
}
