//! Whether a boolean operation gave the right region, found by code that shares nothing with what made it.

use super::sweep::Sets;
use crate::shape::{Bounds, CubicBez};

/// Where result and path disagree: height in working space, and the covered parts of the width there.
pub(super) struct Disagreement {
    pub(super) y: f64,
    pub(super) found: f64,
    pub(super) expected: f64,
}

/// Most horizontals along which a result is judged.
const MAX_LINES: usize = 256;
/// Horizontals for a result of fewer curves, each of which has several then; otherwise there is one a curve.
const FEW_LINES: usize = 64;
/// Where the horizontals beside one are, in extents: farther than slivers are thick, nearer than features are tall.
const BESIDE: [f64; 3] = [0.0, 3.1e-6, -4.3e-6];
/// The places on a curve through which they go. Not the middle, where symmetric art has its vertices; and near the ends,
/// where curves that leave a point side by side may cross unnoticed.
const PLACES: [f64; 4] = [0.062, 0.287, 0.586_1, 0.913];

/// Compares a result with the sets of loops it was made from, along horizontals through the curves of both: where
/// `inside` holds for the windings of the sets, and nowhere else, the result is to wind once; it may differ on a
/// part of the extent of `agreement`.
///
/// A horizontal may graze a curve, where 1e-9 upwards is much sideways, or run along a dropped sliver; so a horizontal is
/// believed to differ only if two more beside it do.
pub(super) fn judge(
    sets: &Sets,
    result: &[Vec<CubicBez>],
    inside: impl Fn(i32, i32) -> bool,
    agreement: f64,
) -> Result<(), Disagreement> {
    let input = || sets.iter().flatten().flatten();
    let mut heights: Vec<f64> = input()
        .chain(result.iter().flatten())
        .filter(|c| c.points().iter().any(|p| p.y != c.p0.y))
        .flat_map(|c| PLACES.map(|t| c.eval(t).y))
        .collect();
    heights.sort_by(f64::total_cmp);
    let bounds = Bounds::of(input().flat_map(CubicBez::points));
    let extent = bounds.size().max_element();
    let lines = heights.len().min((heights.len() / PLACES.len()).clamp(FEW_LINES, MAX_LINES));
    for k in 0..lines {
        let y = heights[k * heights.len() / lines];
        let mut worst = None;
        for shift in BESIDE {
            let y = y + shift * extent;
            let expected = spans(&[&sets[0], &sets[1]], y, |w| inside(w[0], w[1]));
            let found = spans(&[result], y, |w| w[0] == 1);
            let stray = length(&spans(&[result], y, |w| w[0] != 0 && w[0] != 1));
            let differ = stray + length(&symmetric_difference(&expected, &found));
            if differ <= agreement * extent {
                worst = None;
                break;
            }
            let width = extent.max(f64::MIN_POSITIVE);
            worst =
                Some(Disagreement { y, found: (length(&found) + stray) / width, expected: length(&expected) / width });
        }
        if let Some(disagreement) = worst {
            return Err(disagreement);
        }
    }
    Ok(())
}

/// The intervals of the horizontal through `y` where the windings of the sets are inside.
fn spans(sets: &[&[Vec<CubicBez>]], y: f64, inside: impl Fn([i32; 2]) -> bool) -> Vec<[f64; 2]> {
    let mut crossings = Vec::new();
    for (k, set) in sets.iter().enumerate() {
        for curve in set.iter().flatten() {
            // Upwards is +1 for what lies to the left of it, so −1 from left to right.
            curve.crossings(y, |x, direction| crossings.push((x, k, direction)));
        }
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut windings = [0; 2];
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut open = None;
    for (x, k, direction) in crossings {
        windings[k] -= direction;
        match (open, inside(windings)) {
            (None, true) => open = Some(x),
            (Some(from), false) => {
                spans.push([from, x]);
                open = None;
            }
            _ => {}
        }
    }
    spans
}

fn length(spans: &[[f64; 2]]) -> f64 {
    // From +0: the sum of nothing would be −0.
    spans.iter().map(|s| s[1] - s[0]).fold(0.0, |a, b| a + b)
}

/// What is in one list of spans and not in the other.
fn symmetric_difference(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut ends: Vec<f64> = a.iter().chain(b).flatten().copied().collect();
    ends.sort_by(f64::total_cmp);
    ends.chunks_exact(2).map(|c| [c[0], c[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn judge_refuses_a_wrong_result() {
        let square = |r: f64| {
            let p = [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| DVec2::new(x, y));
            (0..4).map(|i| CubicBez::line(p[i], p[(i + 1) % 4])).collect::<Vec<_>>()
        };
        let hole = |r| square(r).iter().rev().map(CubicBez::reversed).collect::<Vec<_>>();
        let rule = |a: i32, b: i32| a != 0 || b != 0;
        let sets = [vec![square(2.0), hole(1.0)], vec![]];
        assert!(judge(&sets, &[square(2.0), hole(1.0)], rule, 1e-6).is_ok());
        // Hole lost, hole turned round (winding 2), wrong size, nothing at all.
        for wrong in [vec![square(2.0)], vec![square(2.0), square(1.0)], vec![square(2.1), hole(1.0)], vec![]] {
            assert!(judge(&sets, &wrong, rule, 1e-5).is_err(), "{wrong:?}");
        }
    }
}
