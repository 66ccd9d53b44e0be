//! Prefilters a picture for one fetch per shading point ([`crate::kernel::picture`]): a pyramid of ever wider Gaussians.
//!
//! Inside the light the kernel is cut to it and renormalised, so that nothing dark bleeds in; outside, over a margin, its
//! variance grows with the squared distance to the light (Heitz, Dupuy, Hill, Neubelt 2016, §5.4, where the light is the
//! whole rectangle; Kuge, Yatagawa, Morishima 2022, §3.1, where it is a shape). Both are one filter here: the weight of a
//! texel, w, is 1 over all of a rectangle and the coverage of a shape.

mod distance;

use super::Square;
use crate::kernel::picture::Level;
use crate::picture::Picture;
use distance::distances;
use glam::{DVec2, Vec2, Vec3, Vec4};
use half::f16;
use rayon::prelude::*;

/// Width of the margin over the geometric mean of the picture's sides. Heitz's is an eighth of the texture, margins included.
const MARGIN: f64 = 1.0 / 6.0;
/// What the kernel's variance gains outside, over the squared distance to the light. The papers name no number; of 0 to 2,
/// this changes the RMSE against the yardstick by less than a tenth.
const GROWTH: f64 = 1.0;
/// σ of the widest Gaussian over the picture's longer side: over such a picture it is even to 1 %.
const WIDEST: f64 = 8.0;
/// Exponent at which a Gaussian is cut off: it is 3e-5 there.
const CUT: f64 = 10.5;
/// Fewest texels along a side of a level, where the picture has as many.
const FEWEST: usize = 16;

/// A prefiltered picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefiltered {
    /// What 1 stands for in each channel: the largest value of the picture there, 0 where it is black.
    pub peak: Vec3,
    /// The levels, in the tree space of the square they were made for.
    pub levels: Vec<Level>,
    /// Their texels: linear, 0 to 1 of the peak, as [`crate::kernel::picture::unpack`] reads them.
    pub texels: Vec<[u32; 2]>,
}

impl Prefiltered {
    /// Filters a picture whose texels are xyz the colour × w, w the weight: 1 inside the light, 0 outside, between them
    /// where its edge runs through the texel.
    pub fn new(picture: &Picture, square: &Square) -> Self {
        let source = Source::new(picture);
        let sigmas = source.sigmas();
        let plain: Vec<Grid> = sigmas.iter().map(|&sigma| source.filtered(sigma)).collect();
        let distances = distances(&source);
        let inside = picture.texels.iter().filter(|texel| texel.w > 0.0);
        let peak = inside.map(|texel| texel.truncate() / texel.w).fold(Vec3::ZERO, Vec3::max);
        let unit = peak.map(|v| if v > 0.0 { v.recip() } else { 0.0 });
        let low = ((source.low - square.center) / square.half).as_vec2();
        let per_unit = (square.half / (source.high - source.low)).as_vec2();
        let stack = Stack { source: &source, plain: &plain, sigmas: &sigmas, distances: &distances };
        let mut levels = Vec::with_capacity(plain.len());
        let mut texels = Vec::with_capacity(plain.iter().map(|grid| grid.values.len()).sum());
        for (k, grid) in plain.iter().enumerate() {
            levels.push(Level {
                low,
                per_unit,
                offset: texels.len() as u32,
                size: grid.width as u32 | (grid.height as u32) << 16,
                variance: (sigmas[k] / square.half).powi(2) as f32,
                coarser: (plain.len() - 1 - k) as u32,
            });
            texels.par_extend((0..grid.values.len()).into_par_iter().map(|i| pack(stack.color(k, i) * unit)));
        }
        Self { peak, levels, texels }
    }
}

/// Three 16-bit floats in two words.
fn pack(color: Vec3) -> [u32; 2] {
    let [x, y, z] = color.to_array().map(|v| u32::from(f16::from_f32(v).to_bits()));
    [x | y << 16, z]
}

/// The picture in the box with its margin. Coordinates are texels of the box, from its lower left corner.
struct Source<'a> {
    picture: &'a Picture,
    /// Width and height of a texel, light space.
    texel: DVec2,
    /// Texels of the margin on each side.
    margin: [usize; 2],
    /// Texels of the box.
    size: [usize; 2],
    low: DVec2,
    high: DVec2,
}

/// Values at the centres of the equal cells of the box, row 0 lowest.
struct Grid {
    width: usize,
    height: usize,
    values: Vec<Vec4>,
}

impl<'a> Source<'a> {
    fn new(picture: &'a Picture) -> Self {
        let sides = picture.high - picture.low;
        let texel = sides / DVec2::new(f64::from(picture.width), f64::from(picture.height));
        // Around a hairline no wider than the picture is long.
        let longest = DVec2::splat(f64::from(picture.width.max(picture.height)));
        let margin = (MARGIN * (sides.x * sides.y).sqrt() / texel).ceil().clamp(DVec2::ONE, longest);
        let border = margin * texel;
        let margin = [margin.x as usize, margin.y as usize];
        let size = [picture.width as usize + 2 * margin[0], picture.height as usize + 2 * margin[1]];
        Self { picture, texel, margin, size, low: picture.low - border, high: picture.high + border }
    }

    /// σ of each level, light space: 0, then a texel and its doubles.
    fn sigmas(&self) -> Vec<f64> {
        let first = (self.texel.x * self.texel.y).sqrt();
        let widest = WIDEST * (self.picture.high - self.picture.low).max_element();
        let doubles = core::iter::successors(Some(first), |sigma| (*sigma < widest).then_some(2.0 * sigma));
        core::iter::once(0.0).chain(doubles).collect()
    }

    /// The texel of the picture at column x and row y (from below) of itself.
    fn at(&self, x: usize, y: usize) -> Vec4 {
        let row = self.picture.height as usize - 1 - y;
        self.picture.texels[row * self.picture.width as usize + x]
    }

    /// The mean under a Gaussian cut to the picture, on cells of half its σ: separable, so each axis is renormalised by itself.
    fn filtered(&self, sigma: f64) -> Grid {
        let cells = |axis: usize| {
            let finest = self.size[axis];
            let step = (0.5 * sigma / self.texel[axis]).max(1.0);
            ((finest as f64 / step).ceil() as usize).clamp(FEWEST.min(finest), finest)
        };
        let [width, height] = [cells(0), cells(1)];
        let (columns, rows) = (self.kernels(0, width, sigma), self.kernels(1, height, sigma));
        let source_height = self.picture.height as usize;
        let mut across = vec![Vec4::ZERO; width * source_height];
        across.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (sum, kernel) in row.iter_mut().zip(&columns) {
                *sum = kernel.weights.iter().enumerate().map(|(i, &w)| self.at(kernel.first + i, y) * w).sum();
            }
        });
        let mut values = vec![Vec4::ZERO; width * height];
        values.par_chunks_mut(width).zip(&rows).for_each(|(row, kernel)| {
            for (i, &w) in kernel.weights.iter().enumerate() {
                let source = &across[(kernel.first + i) * width..][..width];
                row.iter_mut().zip(source).for_each(|(sum, &v)| *sum += v * w);
            }
        });
        Grid { width, height, values }
    }

    /// The kernel of each of `cells` equal cells of the box along an axis.
    fn kernels(&self, axis: usize, cells: usize, sigma: f64) -> Vec<Kernel> {
        let texels = [self.picture.width, self.picture.height][axis] as usize;
        let sigma = sigma / self.texel[axis];
        let cell = self.size[axis] as f64 / cells as f64;
        (0..cells)
            .map(|i| Kernel::new((i as f64 + 0.5) * cell - self.margin[axis] as f64 - 0.5, sigma, texels))
            .collect()
    }
}

/// Weights of consecutive texels, of sum 1.
struct Kernel {
    first: usize,
    weights: Vec<f32>,
}

impl Kernel {
    /// The Gaussian about `middle` (0 is the first texel's centre) over `texels` texels. Outside of them it is that about
    /// the nearest, but for the slope: there its own weights would all vanish.
    fn new(middle: f64, sigma: f64, texels: usize) -> Self {
        let last = (texels - 1) as f64;
        let nearest = middle.round().clamp(0.0, last);
        let exponent = |i: f64| {
            let (d, least) = (i - middle, nearest - middle);
            (d * d - least * least) / (2.0 * sigma * sigma)
        };
        if sigma == 0.0 {
            return Self { first: nearest as usize, weights: vec![1.0] };
        }
        let mut first = nearest;
        while first > 0.0 && exponent(first - 1.0) < CUT {
            first -= 1.0;
        }
        let mut end = nearest;
        while end < last && exponent(end + 1.0) < CUT {
            end += 1.0;
        }
        let count = (end - first) as usize + 1;
        let weights: Vec<f64> = (0..count).map(|i| (-exponent(first + i as f64)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        Self { first: first as usize, weights: weights.iter().map(|w| (w / sum) as f32).collect() }
    }
}

/// The cut Gaussians of all widths, and the way to the light.
struct Stack<'a> {
    source: &'a Source<'a>,
    plain: &'a [Grid],
    sigmas: &'a [f64],
    /// From each texel of the box to the nearest with a weight, light space.
    distances: &'a [f32],
}

impl Stack<'_> {
    /// Colour of a level's texel, the kernel grown outside.
    fn color(&self, k: usize, i: usize) -> Vec3 {
        let Grid { width, height, ref values } = self.plain[k];
        let cell = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let at = cell / Vec2::new(width as f32, height as f32);
        let distance = self.distance(at);
        let sum =
            if distance > 0.0 { self.at(at, self.sigmas[k].powi(2) + GROWTH * distance.powi(2)) } else { values[i] };
        if sum.w > 0.0 { sum.truncate() / sum.w } else { Vec3::ZERO }
    }

    /// Distance to the light at a place in 0..1 of the box.
    fn distance(&self, at: Vec2) -> f64 {
        let [width, height] = self.source.size;
        f64::from(bilinear(at, width, height, |i| self.distances[i]))
    }

    /// The mean with the given variance at a place in 0..1 of the box.
    fn at(&self, at: Vec2, variance: f64) -> Vec4 {
        let last = self.plain.len() - 1;
        let level = |i: usize| {
            let Grid { width, height, ref values } = self.plain[i];
            bilinear(at, width, height, |i| values[i])
        };
        let fine = self.sigmas.iter().rposition(|sigma| sigma * sigma <= variance).unwrap_or(0).min(last);
        if fine == last {
            return level(last);
        }
        let [v0, v1] = [fine, fine + 1].map(|i| self.sigmas[i].powi(2));
        level(fine).lerp(level(fine + 1), ((variance - v0) / (v1 - v0)) as f32)
    }
}

/// Between the centres of `width` × `height` equal cells, at a place in 0..1.
fn bilinear<T>(at: Vec2, width: usize, height: usize, value: impl Fn(usize) -> T) -> T
where
    T: Copy + core::ops::Add<Output = T> + core::ops::Mul<f32, Output = T>,
{
    let axis = |v: f32, n: usize| {
        let v = (v * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        (v as usize, (v as usize + 1).min(n - 1), v.fract())
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (axis(at.x, width), axis(at.y, height));
    let row = |y: usize| value(y * width + x0) * (1.0 - fx) + value(y * width + x1) * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::picture::unpack;

    #[test]
    fn packed_colors_are_read_back() {
        // Every finite 16-bit float from 0.
        for bits in 0..0x7c00_u16 {
            let v = f16::from_bits(bits).to_f32();
            assert_eq!(unpack(pack(Vec3::new(v, 1.0, 0.25))), Vec3::new(v, 1.0, 0.25));
            assert_eq!(unpack(pack(Vec3::new(0.5, v, v))), Vec3::new(0.5, v, v));
        }
        assert_ne!(unpack(pack(Vec3::splat(1.0 / 3.0))), Vec3::splat(1.0 / 3.0));
    }
}
