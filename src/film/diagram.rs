//! A drawing of shapes with the direction of their contours.

use super::{FilmError, Pending, png};
use crate::shape::{Bounds, Contour, Shape};
use glam::DVec2;
use std::path::Path;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Stroke, Transform};

/// Pixels along the longer side.
const SIZE: f64 = 1200.0;
/// Pixels around the shapes.
const MARGIN: f64 = 24.0;
/// Outer contours.
const OUTER: [u8; 3] = [20, 120, 60];
/// Holes.
const HOLE: [u8; 3] = [200, 40, 40];
/// The lit region.
const INSIDE: [u8; 3] = [226, 226, 210];

/// Draws `shapes` over each other: the inside filled, outer contours green, holes red, a dot at each joint and an
/// arrow in the middle of each curve.
///
/// # Errors
/// Shapes without extent, or what the system says.
pub fn write(path: &Path, shapes: &[&Shape]) -> Result<(), FilmError> {
    let bounds = shapes.iter().map(|s| s.bounds()).fold(Bounds::EMPTY, Bounds::union);
    let scale = (SIZE - 2.0 * MARGIN) / bounds.size().max_element();
    let pixels = (bounds.size() * scale + 2.0 * MARGIN).ceil();
    let (width, height) = (pixels.x as u32, pixels.y as u32);
    let size_error = || FilmError::Size { path: path.into(), width, height, layers: [0; 3] };
    let mut map = Pixmap::new(width, height).ok_or_else(size_error)?;
    map.fill(Color::WHITE);
    let to_pixel = |p: DVec2| DVec2::new((p.x - bounds.min.x) * scale + MARGIN, (bounds.max.y - p.y) * scale + MARGIN);
    for shape in shapes {
        let outlines: Vec<_> = shape.contours().iter().filter_map(|c| Some((c, outline(c, &to_pixel)?))).collect();
        let mut all = PathBuilder::new();
        outlines.iter().for_each(|(_, path)| all.push_path(path));
        if let Some(all) = all.finish() {
            map.fill_path(&all, &paint(INSIDE), FillRule::Winding, Transform::identity(), None);
        }
        for (contour, outline) in &outlines {
            let paint = paint(if contour.is_hole() { HOLE } else { OUTER });
            let stroke = Stroke { width: 1.5, ..Stroke::default() };
            map.stroke_path(outline, &paint, &stroke, Transform::identity(), None);
            if let Some(marks) = marks(contour, &to_pixel) {
                map.fill_path(&marks, &paint, FillRule::Winding, Transform::identity(), None);
            }
        }
    }
    let rgb: Vec<u8> = map.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    Pending::new(path, |out| png::encode_rgb(&rgb, width, height, out, path))?.keep()
}

fn paint([r, g, b]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

fn outline(contour: &Contour, to_pixel: &impl Fn(DVec2) -> DVec2) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    let start = to_pixel(contour.curves()[0].p0).as_vec2();
    path.move_to(start.x, start.y);
    for curve in contour.curves() {
        let [_, p1, p2, p3] = curve.points().map(|p| to_pixel(p).as_vec2());
        path.cubic_to(p1.x, p1.y, p2.x, p2.y, p3.x, p3.y);
    }
    path.close();
    path.finish()
}

/// Dots at the joints; arrow heads in the middle of curves long enough to carry one.
fn marks(contour: &Contour, to_pixel: &impl Fn(DVec2) -> DVec2) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    for curve in contour.curves() {
        let joint = to_pixel(curve.p0).as_vec2();
        path.push_circle(joint.x, joint.y, 2.5);
        if to_pixel(curve.p0).distance(to_pixel(curve.p3)) < 16.0 {
            continue;
        }
        let tip = to_pixel(curve.eval(0.5));
        let ahead = (to_pixel(curve.eval(0.51)) - tip).normalize_or_zero();
        let [a, b, c] =
            [tip + ahead * 6.0, tip - ahead * 5.0 + ahead.perp() * 4.0, tip - ahead * 5.0 - ahead.perp() * 4.0];
        path.move_to(a.x as f32, a.y as f32);
        path.line_to(b.x as f32, b.y as f32);
        path.line_to(c.x as f32, c.y as f32);
        path.close();
    }
    path.finish()
}
