//! Distances to the light over the texels of a picture and its margin.

use super::Source;
use rayon::prelude::*;

/// From each texel of the box, row 0 lowest, to the edge of the nearest texel with a weight: 0 in those and beside them,
/// light space (Felzenszwalb, Huttenlocher, *Distance transforms of sampled functions*, 2012).
///
/// All 0 where no texel has a weight.
pub fn distances(source: &Source<'_>) -> Vec<f32> {
    let [width, height] = source.size;
    let [left, below] = source.margin;
    let (inner_width, inner_height) = (source.picture.width as usize, source.picture.height as usize);
    let seeded = |x: usize, y: usize| {
        let (x, y) = (x.wrapping_sub(left), y.wrapping_sub(below));
        x < inner_width && y < inner_height && source.at(x, y).w > 0.0
    };
    if !source.picture.texels.iter().any(|texel| texel.w > 0.0) {
        return vec![0.0; width * height];
    }
    // Columns first, stored as rows.
    let mut squares = vec![f64::INFINITY; width * height];
    squares.par_chunks_mut(height).enumerate().for_each(|(x, column)| {
        column.iter_mut().enumerate().filter(|(y, _)| seeded(x, *y)).for_each(|(_, v)| *v = 0.0);
        lower_envelope(column, source.texel.y);
    });
    let mut distances = vec![0.0; width * height];
    let half_texel = 0.5 * source.texel.min_element();
    distances.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let mut row: Vec<f64> = (0..width).map(|x| squares[x * height + y]).collect();
        lower_envelope(&mut row, source.texel.x);
        out.iter_mut().zip(row).for_each(|(d, square)| *d = (square.sqrt() - half_texel).max(0.0) as f32);
    });
    distances
}

/// Replaces each value f(i) by the least f(j) + (i − j)²·step².
fn lower_envelope(values: &mut [f64], step: f64) {
    // The parabolas that are somewhere lowest, each with where it begins to be.
    let mut parabolas: Vec<(usize, f64)> = Vec::new();
    let height = |j: usize| values[j] / (step * step);
    for j in (0..values.len()).filter(|&j| values[j].is_finite()) {
        let mut start = f64::NEG_INFINITY;
        while let Some(&(k, begin)) = parabolas.last() {
            let (a, b) = (k as f64, j as f64);
            start = ((height(j) + b * b) - (height(k) + a * a)) / (2.0 * (b - a));
            if start > begin {
                break;
            }
            parabolas.pop();
            start = f64::NEG_INFINITY;
        }
        parabolas.push((j, start));
    }
    let mut at = 0;
    let lowest: Vec<f64> = (0..values.len())
        .map(|i| {
            while at + 1 < parabolas.len() && parabolas[at + 1].1 <= i as f64 {
                at += 1;
            }
            let Some(&(j, _)) = parabolas.get(at) else { return f64::INFINITY };
            let d = (i as f64 - j as f64) * step;
            values[j] + d * d
        })
        .collect();
    values.copy_from_slice(&lowest);
}
