//! Random numbers, the same on every machine and in every thread.

use glam::{DMat3, DVec2, DVec3};

/// A stream of random numbers (SplitMix64: Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub struct Draw(u64);

impl Draw {
    /// The stream of part `index` of what `seed` stands for.
    pub fn new(seed: u64, index: u64) -> Self {
        let mut parent = Self(seed);
        let key = parent.bits() ^ index.wrapping_mul(0xd6e8_feb8_6659_fd93);
        let mut stream = Self(key);
        stream.0 = stream.bits();
        stream
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to 1 (exclusive).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Between two positive numbers, uniform in the logarithm.
    pub fn log_within(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    /// A whole number below `count`, which is at least 1.
    pub fn index(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// One of some things.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.index(of.len())]
    }

    /// One of some things, by weight.
    pub fn weighted<T: Copy>(&mut self, of: &[(T, f64, &str)]) -> T {
        let mut left = self.unit() * of.iter().map(|(_, weight, _)| weight).sum::<f64>();
        let found = of.iter().find(|(_, weight, _)| {
            left -= weight;
            left < 0.0
        });
        found.unwrap_or(&of[0]).0
    }

    /// True with that probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// 1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// A point of the square \[−1, 1\]².
    pub fn square(&mut self) -> DVec2 {
        DVec2::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.within(-1.0, 1.0);
        let around = DVec2::from_angle(self.within(0.0, core::f64::consts::TAU)) * (1.0 - z * z).sqrt();
        around.extend(z)
    }

    /// A rotation; `axis_aligned` ones map axes to axes.
    pub fn rotation(&mut self, axis_aligned: bool) -> DMat3 {
        if axis_aligned {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
            let x = self.index(6);
            let y = (x + 1 + self.index(2)) % 3 + 3 * self.index(2);
            return DMat3::from_cols(axes[x], axes[y], axes[x].cross(axes[y]));
        }
        let z = self.direction();
        let x = z.any_orthonormal_vector();
        let turn = DVec2::from_angle(self.within(0.0, core::f64::consts::TAU));
        let x = x * turn.x + z.cross(x) * turn.y;
        DMat3::from_cols(x, z.cross(x), z)
    }
}
