//! The oracle of outline tests: a coverage mask by tiny-skia, which shares no code with ours.

use glam::DVec2;
use glyphlight::outline::FillRule;
use glyphlight::shape::Shape;
use kurbo::{Affine, BezPath, PathEl, Rect};
use tiny_skia::{Color, FillRule as SkiaRule, Paint, PathBuilder, Pixmap, Transform};

/// Pixels along each side of the box.
const RESOLUTION: f64 = 1024.0;
/// tiny-skia samples 4×4 places a pixel; areas are means over pictures shifted by these parts of a pixel.
pub const SHIFTS: [(f64, f64); 4] = [(0.0, 0.125), (0.0625, 0.0), (0.125, 0.1875), (0.1875, 0.0625)];

/// Coverage of a path, antialiased, over a box of the plane; row 0 holds the lowest y.
pub struct Mask {
    pixels: Vec<u8>,
    size: usize,
    origin: DVec2,
    /// Metres per pixel, in x and y.
    pixel: DVec2,
    /// Covered area, m².
    pub area: f64,
}

impl Mask {
    /// Fills `path` under `rule` over `bounds` and a margin of two pixels.
    pub fn of(path: &BezPath, rule: FillRule, bounds: Rect) -> Self {
        let pixel = DVec2::new(bounds.width(), bounds.height()) / RESOLUTION;
        let size = RESOLUTION as usize + 4;
        let origin = DVec2::new(bounds.x0, bounds.y0) - 2.0 * pixel;
        let fill = |shift: (f64, f64)| {
            let to_pixels = Affine::translate(shift)
                * Affine::scale_non_uniform(1.0 / pixel.x, 1.0 / pixel.y)
                * Affine::translate((-origin.x, -origin.y));
            let mut map = Pixmap::new(size as u32, size as u32).expect("a mask has pixels");
            if let Some(path) = skia_path(&(to_pixels * path.clone())) {
                let mut paint = Paint::default();
                paint.set_color(Color::WHITE);
                let rule = if rule == FillRule::NonZero { SkiaRule::Winding } else { SkiaRule::EvenOdd };
                map.fill_path(&path, &paint, rule, Transform::identity(), None);
            }
            map.pixels().iter().map(|p| p.alpha()).collect::<Vec<_>>()
        };
        let masks: Vec<_> = SHIFTS.into_iter().map(fill).collect();
        let covered: f64 = masks.iter().flatten().map(|&p| f64::from(p) / 255.0).sum();
        let area = covered / SHIFTS.len() as f64 * pixel.x * pixel.y;
        Self { pixels: masks.into_iter().next().expect("there is a mask"), size, origin, pixel, area }
    }

    /// Area of the box, m².
    pub fn box_area(&self) -> f64 {
        (self.size * self.size) as f64 * self.pixel.x * self.pixel.y
    }

    /// Centres of every `stride`-th pixel whose 3×3 neighbourhood is wholly inside or wholly outside, with which it is.
    pub fn clear_points(&self, stride: usize) -> Vec<(DVec2, bool)> {
        let mut points = Vec::new();
        for j in (1..self.size - 1).step_by(stride) {
            for i in (1..self.size - 1).step_by(stride) {
                let here = self.pixels[j * self.size + i];
                let same = (0..9).all(|k| self.pixels[(j + k / 3 - 1) * self.size + i + k % 3 - 1] == here);
                if same && (here == 0 || here == 255) {
                    let p = self.origin + DVec2::new(i as f64 + 0.5, j as f64 + 0.5) * self.pixel;
                    points.push((p, here == 255));
                }
            }
        }
        points
    }
}

/// A kurbo path as tiny-skia's; `None` if there is nothing to fill.
pub fn skia_path(path: &BezPath) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    let f = |v: f64| v as f32;
    for el in path.elements() {
        match *el {
            PathEl::MoveTo(p) => builder.move_to(f(p.x), f(p.y)),
            PathEl::LineTo(p) => builder.line_to(f(p.x), f(p.y)),
            PathEl::QuadTo(a, p) => builder.quad_to(f(a.x), f(a.y), f(p.x), f(p.y)),
            PathEl::CurveTo(a, b, p) => builder.cubic_to(f(a.x), f(a.y), f(b.x), f(b.y), f(p.x), f(p.y)),
            PathEl::ClosePath => builder.close(),
        }
    }
    builder.finish()
}

/// Winding number of `shape` about `p` by ray casting over 64 chords per curve: for points away from the edge.
pub fn ray_cast(shape: &Shape, p: DVec2) -> i32 {
    const CHORDS: u32 = 64;
    let mut winding = 0;
    for curve in shape.curves() {
        let [a, b, c, d] = curve.points();
        if [a, b, c, d].iter().all(|q| q.y <= p.y) || [a, b, c, d].iter().all(|q| q.y > p.y) {
            continue;
        }
        let at = |k: u32| if k == CHORDS { d } else { curve.eval(f64::from(k) / f64::from(CHORDS)) };
        for k in 0..CHORDS {
            let (a, b) = (at(k), at(k + 1));
            if (a.y <= p.y) != (b.y <= p.y) {
                let x = a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y);
                if x > p.x {
                    winding += if b.y > a.y { 1 } else { -1 };
                }
            }
        }
    }
    winding
}

/// What is wrong with `shape` as the region of `path` under `rule`: area, winding, or nothing.
///
/// Areas may differ by 1e-3 of the area plus 2e-5 of the box: the mask has 8-bit coverage from 4×4 samples a pixel.
pub fn disagreement(shape: &Shape, path: &BezPath, rule: FillRule, stride: usize) -> Option<String> {
    let mask = Mask::of(path, rule, kurbo::Shape::bounding_box(path));
    let (area, expected) = (shape.area(), mask.area);
    if (area - expected).abs() > 1e-3 * expected + 2e-5 * mask.box_area() {
        return Some(format!("area {area} where the mask has {expected}"));
    }
    mask.clear_points(stride).into_iter().find_map(|(p, inside)| {
        let winding = ray_cast(shape, p);
        let ours = shape.winding(p);
        (winding != i32::from(inside) || ours != winding)
            .then(|| format!("at {p}: winding {winding} by rays, {ours} by Shape, mask {inside}"))
    })
}
