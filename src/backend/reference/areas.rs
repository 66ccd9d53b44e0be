//! How much of a shape lies in each box of a grid.

use crate::shape::{CubicBez, Shape};
use glam::DVec2;

/// Areas of `shape` in the boxes between the lines x = `columns` and y = `rows` (each ascending, around the shape), row by row
/// from the lowest. Contours count by their winding number. Right to rounding.
///
/// By Green's theorem: what a contour adds to a box is ∫ clamp(x) dy over its part in the box's rows. Curves are cut where
/// they meet a line, so that each part is in one box: it adds ∫ (x − left side) dy to that, and its height times the width to
/// every box left of it.
pub fn areas(shape: &Shape, columns: &[f64], rows: &[f64]) -> Vec<f64> {
    let across = columns.len() - 1;
    let mut areas = vec![0.0; across * (rows.len() - 1)];
    for curve in shape.curves() {
        for [from, to] in parts(curve, columns, rows) {
            let part = curve.subsegment(from, to);
            let middle = curve.eval(0.5 * (from + to));
            let (column, row) = (interval(columns, middle.x), interval(rows, middle.y));
            let row = &mut areas[row * across..][..=column];
            let rise = part.p3.y - part.p0.y;
            for (k, area) in row[..column].iter_mut().enumerate() {
                *area += (columns[k + 1] - columns[k]) * rise;
            }
            // About the side of the box, so that nothing cancels.
            let shift = |p: DVec2| DVec2::new(p.x - columns[column], p.y - part.p0.y);
            let [p0, p1, p2, p3] = part.points().map(shift);
            let part = CubicBez::new(p0, p1, p2, p3);
            row[column] += part.signed_area() + 0.5 * (p3.x * p3.y - p0.x * p0.y);
        }
    }
    areas
}

/// The interval between ascending `lines` in which `v` lies, or that is nearest.
fn interval(lines: &[f64], v: f64) -> usize {
    lines[1..lines.len() - 1].partition_point(|&line| line <= v)
}

/// The parameter intervals of a curve between all its cuts with the lines.
fn parts(curve: &CubicBez, columns: &[f64], rows: &[f64]) -> Vec<[f64; 2]> {
    let swapped = {
        let [p0, p1, p2, p3] = curve.points().map(|p| DVec2::new(p.y, p.x));
        CubicBez::new(p0, p1, p2, p3)
    };
    let mut cuts = vec![0.0, 1.0];
    for (curve, lines) in [(curve, rows), (&swapped, columns)] {
        let mut stops: Vec<f64> = [0.0].into_iter().chain(curve.turns()).chain([1.0]).collect();
        stops.sort_by(f64::total_cmp);
        for piece in stops.windows(2) {
            let [start, end] = [piece[0], piece[1]].map(|t| curve.eval_exact(t).y);
            let inner = lines.iter().filter(|&&line| start.min(end) < line && line < start.max(end));
            cuts.extend(inner.map(|&line| crossing(curve, line, piece[0], piece[1], start < end)));
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.windows(2).map(|pair| [pair[0], pair[1]]).filter(|[from, to]| from < to).collect()
}

/// Where a curve that rises or falls all the way from `lo` to `hi` passes the height `y`, by bisection.
fn crossing(curve: &CubicBez, y: f64, mut lo: f64, mut hi: f64, rises: bool) -> f64 {
    loop {
        let middle = 0.5 * (lo + hi);
        if middle <= lo || middle >= hi {
            return lo;
        }
        if (curve.eval(middle).y < y) == rises { lo = middle } else { hi = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc under a grid that cuts it off-centre: its parts by the closed form of a circle's segment.
    #[test]
    fn a_discs_parts_are_those_of_a_circle() {
        let disc = Shape::disc(64);
        let cut = 0.3_f64;
        let parts = areas(&disc, &[-1.1, cut, 1.1], &[-1.2, 0.0, 1.2]);
        let segment = cut.acos() - cut * (1.0 - cut * cut).sqrt();
        let right = 0.5 * segment;
        let left = 0.5 * core::f64::consts::PI - right;
        for (part, truth) in parts.iter().zip([left, right, left, right]) {
            assert!((part - truth).abs() < 1e-8, "{part} instead of {truth}");
        }
        assert!((parts[0] - left - 0.01).abs() > 1e-3);
    }

    /// The parts add up to the whole, however the lines run: through corners, along sides.
    #[test]
    fn parts_add_up() {
        let hole = Shape::rectangle(DVec2::new(0.25, 0.25), DVec2::new(0.75, 0.5));
        let reversed: Vec<_> = hole.contours()[0].curves().iter().rev().map(CubicBez::reversed).collect();
        let outer = Shape::rectangle(DVec2::ZERO, DVec2::ONE).contours()[0].curves().to_vec();
        let frame = Shape::from_contours(vec![outer, reversed]).unwrap();
        let quarters = [0.0, 0.25, 0.5, 0.75, 1.0];
        let parts = areas(&frame, &quarters, &quarters);
        let solid = 1.0 / 16.0;
        for (k, part) in parts.iter().enumerate() {
            let truth = if k == 5 || k == 6 { 0.0 } else { solid };
            assert!((part - truth).abs() < 1e-15, "{k}: {part}");
        }
        let uneven = areas(&frame, &[0.0, 0.1, 0.6, 1.0], &[0.0, 0.3, 0.5, 0.9, 1.0]);
        assert!((uneven.iter().sum::<f64>() - frame.area()).abs() < 1e-15);
    }
}
