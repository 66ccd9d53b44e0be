//! Strokes as outlines: caps, joins, miter limit and dashes, by kurbo.

use kurbo::{BezPath, PathEl, Shape, Stroke, StrokeOpts};

/// Largest deviation of the outline, as a part of the stroke's width.
const TOLERANCE: f64 = 1e-4;
/// Length given to dashes and subpaths of no length, as a part of the width: with a round or square cap they show as
/// dots, and kurbo would leave them out.
const DOT: f64 = 1e-4;

/// The outline of `path` drawn with `style`; it may overlap itself, and is to be filled by the non-zero rule.
/// Dashes are counted in `dashes`; more than `max_dashes` of them (or curves) give `Err` with their number.
pub(super) fn expand(path: &BezPath, style: &Stroke, max_dashes: usize) -> Result<BezPath, usize> {
    let mut style = style.clone();
    let dot = DOT * style.width;
    let period: f64 = style.dash_pattern.iter().sum();
    if period > 0.0 {
        let dashes = path.perimeter(0.01 * period) / period * style.dash_pattern.len() as f64;
        if dashes > max_dashes as f64 {
            return Err(dashes as usize);
        }
        for pair in style.dash_pattern.chunks_mut(2) {
            if pair[0] < dot {
                let missing = dot - pair[0];
                pair[0] = dot;
                if let Some(gap) = pair.get_mut(1) {
                    *gap = (*gap - missing).max(0.0);
                }
            }
        }
    } else {
        style.dash_pattern.clear();
    }
    let path = with_dots(path, dot);
    Ok(kurbo::stroke(path, &style, &StrokeOpts::default(), TOLERANCE * style.width))
}

/// The path with a line of length `dot` for every subpath of no length.
fn with_dots(path: &BezPath, dot: f64) -> BezPath {
    let mut dotted = BezPath::new();
    for subpath in path.subpaths() {
        let mut ends = subpath.iter().map(|el| super::coordinates(el).collect::<Vec<_>>());
        match subpath[0] {
            PathEl::MoveTo(p) if subpath.len() > 1 && ends.all(|c| c.chunks(2).all(|c| c == [p.x, p.y])) => {
                dotted.move_to(p);
                dotted.line_to((p.x + dot, p.y));
            }
            _ => dotted.extend(subpath.iter().copied()),
        }
    }
    dotted
}
