//! A hierarchy of boxes around the triangles, for rays that the rasteriser cannot answer. Walked by `shaders/nearest.wgsl`.

use super::layout::{BOX_COUNT_BITS, Box};
use crate::kernel::surface::{SEAM, SurfaceTriangle};
use glam::Vec3;

/// Most triangles in a leaf.
const LEAF: usize = 4;

/// Boxes in pre-order, and the triangles in the order of the leaves.
pub struct Boxes {
    /// The boxes.
    pub boxes: Vec<Box>,
    /// The triangles.
    pub triangles: Vec<SurfaceTriangle>,
}

/// A triangle's box and index.
struct Item {
    low: Vec3,
    high: Vec3,
    index: usize,
}

impl Boxes {
    /// Halves the triangles by number along the longest side of their centres' box.
    pub fn new(triangles: &[SurfaceTriangle]) -> Self {
        let item = |(index, t): (usize, &SurfaceTriangle)| {
            let p = t.p0.truncate();
            let (q, r) = (p + t.e1.truncate(), p + t.e2.truncate());
            // A hit may lie that far outside, and rounding adds to it.
            let seam = (t.e1.truncate().abs() + t.e2.truncate().abs()) * (2.0 * SEAM);
            Item { low: p.min(q).min(r) - seam, high: p.max(q).max(r) + seam, index }
        };
        let mut items: Vec<Item> = triangles.iter().enumerate().map(item).collect();
        let mut boxes = Self { boxes: Vec::new(), triangles: Vec::with_capacity(triangles.len()) };
        if !items.is_empty() {
            boxes.emit(&mut items, triangles);
        }
        boxes
    }

    fn emit(&mut self, items: &mut [Item], triangles: &[SurfaceTriangle]) {
        let low = items.iter().fold(Vec3::INFINITY, |a, i| a.min(i.low));
        let high = items.iter().fold(Vec3::NEG_INFINITY, |a, i| a.max(i.high));
        let at = self.boxes.len();
        self.boxes.push(Box { low, skip: 0, high, triangles: 0 });
        if items.len() <= LEAF {
            self.boxes[at].triangles = (self.triangles.len() << BOX_COUNT_BITS | items.len()) as u32;
            self.triangles.extend(items.iter().map(|i| triangles[i.index]));
        } else {
            let center = |i: &Item| i.low + i.high;
            let from = items.iter().fold(Vec3::INFINITY, |a, i| a.min(center(i)));
            let to = items.iter().fold(Vec3::NEG_INFINITY, |a, i| a.max(center(i)));
            let axis = (to - from).max_position();
            let middle = items.len() / 2;
            items.select_nth_unstable_by(middle, |a, b| center(a)[axis].total_cmp(&center(b)[axis]));
            let (left, right) = items.split_at_mut(middle);
            self.emit(left, triangles);
            self.emit(right, triangles);
        }
        self.boxes[at].skip = self.boxes.len() as u32;
    }
}
