//! Overlap removal and set operations on paths of few, often coinciding points.

#![no_main]

use glam::DVec2;
use glyphlight::outline::{FillRule, bez_path, overlap};
use glyphlight::shape::Shape;
use glyphlight_fuzz::{abort_on_our_panics, beside, check_shape, strewn};
use kurbo::{BezPath, PathEl, Point};
use libfuzzer_sys::fuzz_target;

/// Most path elements: the time that it takes is another target's matter.
const MOST: usize = 96;

/// Reads paths from bytes. A coordinate is one byte, so that points coincide often, or two, so that they nearly do.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }

    fn coordinate(&mut self, fine: bool) -> Option<f64> {
        let whole = f64::from(self.byte()? as i8);
        let part = if fine { f64::from(self.byte()? as i8) * 1e-3 } else { 0.0 };
        Some(whole + part)
    }

    fn point(&mut self, fine: bool) -> Option<Point> {
        Some(Point::new(self.coordinate(fine)?, self.coordinate(fine)?))
    }

    /// A path up to a byte that ends it, and the power of ten by which it is to be scaled.
    fn path(&mut self) -> (BezPath, f64) {
        let mut path = BezPath::new();
        let exponent = self.byte().map_or(0, |b| b as i8).clamp(-30, 30);
        if self.elements(&mut path).is_none() {
            self.0 = &[];
        }
        (path, 10_f64.powi(exponent.into()))
    }

    fn elements(&mut self, path: &mut BezPath) -> Option<()> {
        while path.elements().len() < MOST {
            let code = self.byte()?;
            let fine = code & 8 != 0;
            // What follows a closed subpath starts another.
            let draws = path.elements().last().is_some_and(|e| *e != PathEl::ClosePath);
            match code % 8 {
                1..=2 if draws => path.line_to(self.point(fine)?),
                3 if draws => path.quad_to(self.point(fine)?, self.point(fine)?),
                4..=5 if draws => path.curve_to(self.point(fine)?, self.point(fine)?, self.point(fine)?),
                6 if draws => path.close_path(),
                7 => break,
                _ => path.move_to(self.point(fine)?),
            }
        }
        Some(())
    }
}

/// The path as edges of polygons within 1e-4, its subpaths closed.
fn edges(path: &BezPath) -> Vec<[Point; 2]> {
    let mut edges = Vec::new();
    let [mut start, mut at] = [Point::ZERO; 2];
    kurbo::flatten(path, 1e-4, |element| match element {
        PathEl::LineTo(p) => {
            edges.push([at, p]);
            at = p;
        }
        PathEl::MoveTo(p) => {
            edges.push([at, start]);
            [start, at] = [p, p];
        }
        _ => {
            edges.push([at, start]);
            at = start;
        }
    });
    edges.push([at, start]);
    edges
}

/// How often the polygons wind round `p`.
fn winding(edges: &[[Point; 2]], p: Point) -> i32 {
    let crossing = |[a, b]: &[Point; 2]| match (a.y <= p.y, b.y <= p.y) {
        (true, false) if (*b - *a).cross(p - *a) > 0.0 => 1,
        (false, true) if (*b - *a).cross(p - *a) < 0.0 => -1,
        _ => 0,
    };
    edges.iter().map(crossing).sum()
}

/// The result is inside where the path's polygons are, which are made before it is scaled.
fn check_inside(path: &BezPath, scale: f64, rule: FillRule, shape: &Shape) {
    let edges = edges(path);
    let bounds = path.control_box();
    let (min, max) = (DVec2::new(bounds.x0, bounds.y0), DVec2::new(bounds.x1, bounds.y1));
    let extent = (max - min).max_element();
    for p in strewn(min, max, 24) {
        let wrong = |p: DVec2| (shape.winding(p * scale) == 1) != rule.is_inside(winding(&edges, Point::new(p.x, p.y)));
        assert!(!beside(p, extent).into_iter().all(wrong), "{rule:?} is wrong at {p} of {scale} × {}", path.to_svg());
    }
}

fuzz_target!(init: abort_on_our_panics(), |data: &[u8]| {
    let mut reader = Reader(data);
    let paths = [reader.path(), reader.path()];
    let mut regions = Vec::new();
    for (path, scale) in &paths {
        let scaled = kurbo::Affine::scale(*scale) * path.clone();
        for rule in [FillRule::NonZero, FillRule::EvenOdd] {
            let Ok(shape) = overlap::resolve(&scaled, rule) else { continue };
            check_shape(&shape, path.control_box().width().max(path.control_box().height()) * scale);
            check_inside(path, *scale, rule, &shape);
            regions.push(shape);
        }
    }
    let [a, .., b] = &regions[..] else { return };
    let whole = |s: &Shape| s.extent().size().max_element();
    let extent = whole(a).max(whole(b));
    let near = |x: f64, y: f64| assert!((x - y).abs() <= 1e-4 * extent * extent, "areas {x} and {y} of extent {extent}");
    let both = overlap::intersection(a, b);
    if let Ok(both) = &both {
        check_shape(both, extent);
    }
    if let Ok(either) = overlap::union(a, b) {
        check_shape(&either, extent);
        if let Ok(both) = &both {
            near(either.area() + both.area(), a.area() + b.area());
        }
    }
    if let Ok(rest) = overlap::difference(a, b) {
        check_shape(&rest, extent);
        if let Ok(both) = &both {
            near(rest.area() + both.area(), a.area());
        }
    }
    // What is a region already stays one.
    if let Ok(again) = overlap::resolve(&bez_path(a), FillRule::NonZero) {
        near(again.area(), a.area());
    }
});
