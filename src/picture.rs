//! [`Picture`]: the colours of a light's plane.

use crate::shape::{Bounds, CubicBez, Shape};
use glam::{DVec2, DVec4, Vec4};
use std::ops::Range;

/// Most texels along either side of a picture made from a file; larger ones are shrunk by area average.
pub const MAX_SIDE: u32 = 2048;

/// A picture laid over a light's plane. Between texel centres it is bilinear, beyond the outer ones constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Texels across, at least 1.
    pub width: u32,
    /// Texels down, at least 1.
    pub height: u32,
    /// Linear Rec.709, multiplied by alpha; row 0 is on top, where y is largest. A factor of the layer's radiance.
    pub texels: Vec<Vec4>,
    /// Lower left corner of the picture, light space.
    pub low: DVec2,
    /// Upper right corner of the picture, light space.
    pub high: DVec2,
}

impl Picture {
    /// The picture of `texel(x, y)`, y from the top, shrunk to `width` × `height` texels (at most the `source`'s, or the source's
    /// own number) by area average. The texels are asked for once each, row by row.
    pub fn shrunk(
        source: [u32; 2],
        [width, height]: [u32; 2],
        [low, high]: [DVec2; 2],
        texel: impl Fn(u32, u32) -> Vec4,
    ) -> Self {
        let (width, height) = (width.clamp(1, source[0].max(1)), height.clamp(1, source[1].max(1)));
        let across: Vec<_> = (0..source[0]).map(|x| shares(x, source[0], width)).collect();
        let mut texels = vec![Vec4::ZERO; width as usize * height as usize];
        let mut row = vec![Vec4::ZERO; width as usize];
        for y in 0..source[1] {
            row.fill(Vec4::ZERO);
            for (x, share) in (0..source[0]).zip(&across) {
                let color = texel(x, y);
                share.iter().for_each(|&(to, part)| row[to] += color * part);
            }
            for (to, part) in shares(y, source[1], height) {
                let target = &mut texels[to * width as usize..][..width as usize];
                target.iter_mut().zip(&row).for_each(|(t, &color)| *t += color * part);
            }
        }
        Self { width, height, texels, low, high }
    }

    /// The colour at a point of light space.
    pub fn sample(&self, p: DVec2) -> Vec4 {
        let at = (p - self.low) / (self.high - self.low);
        let place = |part: f64, count: u32| {
            let last = f64::from(count) - 1.0;
            let place = (part * f64::from(count) - 0.5).clamp(0.0, last);
            (place as usize, (place as usize + 1).min(last as usize), place.fract() as f32)
        };
        let (left, right, x) = place(at.x, self.width);
        let (upper, lower, y) = place(1.0 - at.y, self.height);
        let row = |y: usize| &self.texels[y * self.width as usize..];
        row(upper)[left].lerp(row(upper)[right], x).lerp(row(lower)[left].lerp(row(lower)[right], x), y)
    }

    /// Size of a texel, light space.
    pub fn texel_size(&self) -> DVec2 {
        (self.high - self.low) / DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The picture under (x, y) → (x·by.x, y·by.y), exactly; a negative factor mirrors it. Factors are not 0.
    #[must_use]
    pub fn scaled(&self, by: DVec2) -> Self {
        let (a, b) = (self.low * by, self.high * by);
        let mut texels = self.texels.clone();
        if by.x < 0.0 {
            texels.chunks_mut(self.width as usize).for_each(<[_]>::reverse);
        }
        if by.y < 0.0 {
            let rows: Vec<_> = texels.chunks(self.width as usize).rev().flatten().copied().collect();
            texels = rows;
        }
        Self { texels, low: a.min(b), high: a.max(b), ..*self }
    }

    /// Mean colour over a shape, by area; zero for a shape without area.
    ///
    /// By Green's theorem: ∮ F dy over ∮ x dy with F(x, y) = ∫ colour dx, which is exact along each row, and Gauss's three
    /// nodes on pieces of a quarter of a texel along the contour. For a picture of one colour that is the colour to rounding; else within
    /// 1e-4 of the picture's range (measured, shapes of 2 texels across and more).
    pub fn mean_over(&self, shape: &Shape) -> Vec4 {
        let area = shape.area();
        if area.is_nan() || area <= 0.0 {
            return Vec4::ZERO;
        }
        let cell = self.texel_size();
        // In texels, from the picture's upper left corner; y still runs up.
        let enter = |p: DVec2| DVec2::new(p.x - self.low.x, p.y - self.high.y) / cell;
        let Bounds { min, max } = shape.bounds();
        let rows = Rows::new(self, [enter(min).x, enter(max).x], [-enter(max).y, -enter(min).y]);
        let mut sum = DVec4::ZERO;
        for curve in shape.curves() {
            let [p0, p1, p2, p3] = curve.points().map(enter);
            let curve = CubicBez::new(p0, p1, p2, p3);
            let length = p0.distance(p1) + p1.distance(p2) + p2.distance(p3);
            let pieces = (4.0 * length).ceil().clamp(1.0, MOST_PIECES);
            for piece in 0..pieces as u32 {
                for (node, weight) in GAUSS {
                    let t = (f64::from(piece) + node) / pieces;
                    let p = curve.eval(t);
                    sum += rows.integral(p.x, -p.y) * (curve.tangent(t).y * weight / pieces);
                }
            }
        }
        (sum * (cell.x * cell.y / area)).max(DVec4::ZERO).as_vec4()
    }
}

/// Pieces into which one curve is cut at most.
const MOST_PIECES: f64 = 16_384.0;

/// Gauss–Legendre nodes and weights on 0 to 1, exact to degree 5.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// The texels of a coarser row of `to` texels that texel `x` of `from` falls into, with its part of their areas.
fn shares(x: u32, from: u32, to: u32) -> Vec<(usize, f32)> {
    let (from, to, x) = (u64::from(from), u64::from(to), u64::from(x));
    let reach: Range<u64> = x * to..(x + 1) * to; // in units of 1/from of a coarse texel
    let first = reach.start / from;
    let split = ((first + 1) * from).min(reach.end);
    let part = |r: Range<u64>| (r.end - r.start) as f32 / from as f32;
    let mut shares = vec![(first as usize, part(reach.start..split))];
    if split < reach.end {
        shares.push((first as usize + 1, part(split..reach.end)));
    }
    shares
}

/// Integrals along some rows of a picture: at each of some texel centres, from the first of them.
struct Rows<'a> {
    picture: &'a Picture,
    columns: Range<usize>,
    rows: Range<usize>,
    sums: Vec<DVec4>,
}

impl<'a> Rows<'a> {
    /// What it takes for points with `x` and `y` in these ranges, in texels, y from the top down.
    fn new(picture: &'a Picture, x: [f64; 2], y: [f64; 2]) -> Self {
        let reach = |[from, to]: [f64; 2], count: u32| {
            let last = f64::from(count) - 1.0;
            (from - 0.5).clamp(0.0, last) as usize..((to - 0.5).clamp(0.0, last).ceil() as usize + 1)
        };
        let (columns, rows) = (reach(x, picture.width), reach(y, picture.height));
        let mut sums = Vec::with_capacity(columns.len() * rows.len());
        for row in rows.clone() {
            let mut sum = DVec4::ZERO;
            sums.push(sum);
            for pair in picture.texels[row * picture.width as usize..][columns.clone()].windows(2) {
                sum += (pair[0].as_dvec4() + pair[1].as_dvec4()) * 0.5;
                sums.push(sum);
            }
        }
        Self { picture, columns, rows, sums }
    }

    /// ∫ colour dx from the first texel centre to `x` at height `y`, both in texels, y from the top down.
    fn integral(&self, x: f64, y: f64) -> DVec4 {
        let (first, last) = (self.rows.start, self.rows.end - 1);
        let place = (y - 0.5).clamp(first as f64, last as f64);
        let upper = (place as usize).min(last);
        let lower = (upper + 1).min(last);
        self.along(upper, x).lerp(self.along(lower, x), place - upper as f64)
    }

    fn along(&self, row: usize, x: f64) -> DVec4 {
        let (first, last) = (self.columns.start, self.columns.end - 1);
        let texels = &self.picture.texels[row * self.picture.width as usize..];
        let sums = &self.sums[(row - self.rows.start) * self.columns.len()..];
        let place = x - 0.5;
        let inside = place.clamp(first as f64, last as f64);
        let i = (inside as usize).min(last);
        let (here, next) = (texels[i].as_dvec4(), texels[(i + 1).min(last)].as_dvec4());
        let d = inside - i as f64;
        // Outside of the picture, beyond its first or last texel centre.
        let beyond = texels[if place < inside { first } else { last }].as_dvec4();
        sums[i - first] + here * d + (next - here) * (0.5 * d * d) + beyond * (place - inside)
    }
}
