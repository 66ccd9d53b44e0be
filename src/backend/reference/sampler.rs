//! Numbers for the samples: Owen-scrambled Sobol points in two dimensions, as many independent randomisations as
//! there are keys.

/// A key of random numbers, and the hash that tells it from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u64);

impl Key {
    /// The key of a user's seed.
    pub const fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    /// The key of part `index` of what this key stands for.
    #[must_use]
    pub const fn part(self, index: u64) -> Self {
        Self(mix(self.0 ^ mix(index.wrapping_add(0x9e37_79b9_7f4a_7c15))))
    }

    /// A point of the unit square, independent of all others.
    pub fn unit_square(self) -> [f64; 2] {
        [0, 1].map(|k| (self.part(k).0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// A bijection of 64 bits in which every bit hangs on every other (Stafford's mix 13, as in SplitMix64: Steele, Lea,
/// Flood 2014).
const fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A (0, 2)-sequence in base 2, randomised by its key: every run of 2ⁿ points that starts at a multiple of 2ⁿ has one point in
/// each elementary box of area 2⁻ⁿ, and every single point is uniform over the unit square.
///
/// The first two dimensions of Sobol's sequence, scrambled after Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4)
/// 2020; points are shuffled, so that sequences of two keys can be paired.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    order: u32,
    scramble: [u32; 2],
    /// Added without carry: makes each point uniform however good the scrambling is.
    shift: [u32; 2],
    /// Below the 32 bits of the points.
    rest: [f64; 2],
}

impl Sequence {
    /// The sequence of `key`.
    pub fn new(key: Key) -> Self {
        let words = [0, 1, 2, 3].map(|k| key.part(k).0);
        let high = |k: usize| (words[k] >> 32) as u32;
        let low = |k: usize| words[k] as u32;
        let fraction = |bits: u32| f64::from(bits >> 11) / f64::from(1_u32 << 21);
        Self {
            order: high(0),
            scramble: [low(0), high(1)],
            shift: [low(1), high(2)],
            rest: [fraction(low(2)), fraction(high(3))],
        }
    }

    /// Point `index`, both coordinates in 0..1 (1 exclusive) with 53 bits.
    pub fn point(&self, index: u32) -> [f64; 2] {
        let index = owen(index.reverse_bits(), self.order).reverse_bits();
        // With their bits reversed the two coordinates are the index itself and its image under Pascal's triangle mod 2.
        let mirrored = [index, pascal(index)];
        core::array::from_fn(|k| {
            let bits = owen(mirrored[k], self.scramble[k]).reverse_bits() ^ self.shift[k];
            (f64::from(bits) + self.rest[k]) / 4_294_967_296.0
        })
    }
}

/// Bit j of the result is the sum mod 2 of the bits k with C(k, j) odd, which are those with j ⊆ k in binary (Lucas).
const fn pascal(mut bits: u32) -> u32 {
    bits ^= bits >> 16;
    bits ^= (bits >> 8) & 0x00ff_00ff;
    bits ^= (bits >> 4) & 0x0f0f_0f0f;
    bits ^= (bits >> 2) & 0x3333_3333;
    bits ^ ((bits >> 1) & 0x5555_5555)
}

/// A bijection in which a bit hangs on the lower ones only: Owen scrambling of a number whose bits are reversed
/// (Laine, Karras 2011; constants by Vegdahl, *Building a Better LK Hash*, 2021).
const fn owen(bits: u32, seed: u32) -> u32 {
    let bits = bits ^ bits.wrapping_mul(0x3d20_adea);
    let bits = bits.wrapping_add(seed).wrapping_mul((seed >> 16) | 1);
    let bits = bits ^ bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of 2⁻ᵃ × 2⁻ᵇ hit by the points of one run.
    fn boxes(sequence: &Sequence, run: u32, m: u32, a: u32) -> usize {
        let cell = |i: u32| {
            let [x, y] = sequence.point((run << m) + i);
            ((x * f64::from(1 << a)) as u32, (y * f64::from(1 << (m - a))) as u32)
        };
        (0..1 << m).map(cell).collect::<std::collections::HashSet<_>>().len()
    }

    #[test]
    fn every_elementary_box_holds_one_point() {
        for key in 0..20 {
            let sequence = Sequence::new(Key::new(key));
            for (m, run) in [(4, 0), (6, 3), (10, 0), (10, 5)] {
                for a in 0..=m {
                    assert_eq!(boxes(&sequence, run, m, a), 1 << m, "key {key}, run {run}, 2^{a} columns");
                }
            }
        }
        // A run that starts elsewhere, or pairs of two sequences, have no such order.
        let [one, other] = [1, 2].map(|k| Sequence::new(Key::new(k)));
        let paired = |i: u32| ((one.point(i)[0] * 8.0) as u32, (other.point(i)[0] * 8.0) as u32);
        assert!((0..64).map(paired).collect::<std::collections::HashSet<_>>().len() < 60);
    }

    /// Every point is uniform over the keys, and two sequences are independent: χ² of 64 boxes.
    #[test]
    fn points_are_uniform_over_the_keys() {
        let chi_square = |point: &dyn Fn(Key) -> [f64; 2]| {
            let mut counts = [0_u32; 64];
            let n = 64_000;
            for k in 0..n {
                let [x, y] = point(Key::new(9).part(k));
                counts[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
            }
            let mean = n as f64 / 64.0;
            counts.iter().map(|&c| (f64::from(c) - mean).powi(2) / mean).sum::<f64>()
        };
        // 63 degrees of freedom: 1e-4 of all lie above 115.
        for index in [0, 1, 2, 7, 100, 65_535] {
            let alone = chi_square(&|key| Sequence::new(key).point(index));
            assert!(alone < 115.0, "point {index}: {alone}");
            let pair = chi_square(&|key| {
                let [a, b] = [0, 1].map(|part| Sequence::new(key.part(part)).point(index)[0]);
                [a, b]
            });
            assert!(pair < 115.0, "pairs of {index}: {pair}");
        }
        let skewed = chi_square(&|key| Sequence::new(key).point(3).map(|v| v * 0.99));
        assert!(skewed > 115.0, "{skewed}");
    }

    #[test]
    fn a_key_has_its_own_numbers() {
        let of = |seed: u64| (0..8).map(|i| Sequence::new(Key::new(seed)).point(i)).collect::<Vec<_>>();
        assert_eq!(of(5), of(5));
        assert_ne!(of(5), of(6));
        assert!(of(5).iter().flatten().all(|v| (0.0..1.0).contains(v)));
    }
}
