//! [`Polygons`]: a shape cut into polygons, each with a baked texture of the distance to it, for `kernel::pal`.

use super::Square;
use crate::kernel::pal::{PHI, Polygon, PolygonsView};
use crate::shape::{Bounds, Contour, CubicBez, Shape};
use glam::{DVec2, Vec4};
use rayon::prelude::*;

/// Largest distance of an edge from its curve, in halves of the contour's longer extent.
pub const FLATNESS: f64 = 5e-4;
/// Handles nearer the chord than this (halves of the square's side) make one edge.
const STRAIGHT: f64 = 1e-9;
/// Most edges of one curve.
const EDGES: f64 = 1024.0;
/// Texels along the side of a light's texture, which its polygons share: each has a square of their number's root.
pub const TEXTURE: usize = 512;
/// Fewest texels along the side of a polygon's share.
pub const SMALLEST: usize = 32;
/// Most points of a hole that are asked what they are in.
const ASKED: usize = 9;
/// Texels along the side of a block, which has one list of the edges that may be nearest.
const BLOCK: usize = 16;

/// The polygons of one emission.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// One for each outer contour.
    pub polygons: Vec<Polygon>,
    /// Edges: xy from, zw to, in the square.
    pub edges: Vec<Vec4>,
    /// Distances.
    pub texels: Vec<f32>,
}

/// A contour cut into edges; its points are in the metric of the world, in halves of the square's longer side.
struct Outline {
    points: Vec<DVec2>,
    area: f64,
    bounds: Bounds,
}

/// An outer contour and its holes, and where it goes on the texture.
struct Group<'a> {
    contours: Vec<&'a Outline>,
    circle: DVec2,
    radius: f64,
}

impl Polygons {
    /// Cuts curves to within [`FLATNESS`] and bakes the distances, exact to f32 at the texels' centres.
    ///
    /// `stretch`: the lengths of the square's sides in the world, over the longer one. A hole belongs to the smallest outer
    /// contour around most of it. Without an outer contour there are no polygons.
    pub fn new(shape: &Shape, square: Square, stretch: DVec2) -> Self {
        let place = |p: DVec2| (p - square.center) / square.half * stretch;
        let outlines: Vec<Outline> = shape.contours().iter().map(|c| Outline::new(c, place)).collect();
        let groups = grouped(&outlines);
        let row = (groups.len() as f64).sqrt().ceil().max(1.0) as usize;
        let side = (TEXTURE / row).clamp(SMALLEST, TEXTURE);
        let mut all = Self::default();
        for group in &groups {
            let first = all.edges.len() as u32;
            let mut ends = group.contours.iter().map(|outline| {
                let edge = |(a, b): (DVec2, DVec2)| {
                    let (a, b) = ((a / stretch).as_vec2(), (b / stretch).as_vec2());
                    Vec4::new(a.x, a.y, b.x, b.y)
                };
                all.edges.extend(outline.edges().map(edge));
                all.edges.len() as u32
            });
            let outer = ends.next().unwrap_or(first);
            let end = ends.last().unwrap_or(outer);
            all.polygons.push(Polygon {
                circle: (group.circle / stretch).as_vec2(),
                centroid: (group.centroid() / stretch).as_vec2(),
                radius: group.radius as f32,
                first,
                outer,
                end,
                texels: (all.polygons.len() * side * side) as u32,
                side: side as u32,
            });
        }
        all.texels = groups.par_iter().flat_map(|group| group.bake(side)).collect();
        all
    }

    /// As the kernel reads it.
    pub fn view(&self) -> PolygonsView<'_> {
        PolygonsView { polygons: &self.polygons, edges: &self.edges, texels: &self.texels }
    }
}

impl Outline {
    fn new(contour: &Contour, place: impl Fn(DVec2) -> DVec2) -> Self {
        let ends = Bounds::of(contour.curves().iter().flat_map(|c| c.points().map(&place)));
        let flatness = FLATNESS * 0.5 * ends.size().max_element();
        let mut points = Vec::new();
        for curve in contour.curves() {
            let [p0, p1, p2, p3] = curve.points().map(&place);
            // A curve is off its chord by an eighth of its second derivative, which is largest at one of its ends.
            let bend = (p0 - 2.0 * p1 + p2).length().max((p1 - 2.0 * p2 + p3).length()) * 6.0;
            let edges = if CubicBez::new(p0, p1, p2, p3).is_line(STRAIGHT) {
                1.0
            } else {
                (bend / (8.0 * flatness)).sqrt().ceil().clamp(1.0, EDGES)
            };
            points.extend((0..edges as usize).map(|i| place(curve.eval_exact(i as f64 / edges))));
        }
        points.dedup();
        let bounds = Bounds::of(points.iter().copied());
        let mut outline = Self { points, area: 0.0, bounds };
        outline.area = outline.moments().0;
        outline
    }

    /// Edges in turn, the last back to the first point.
    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
        self.points.iter().copied().zip(self.points.iter().copied().cycle().skip(1))
    }

    /// Area, and the integral of the place over it; signed.
    fn moments(&self) -> (f64, DVec2) {
        let origin = self.bounds.center();
        let (mut area, mut moment) = (0.0, DVec2::ZERO);
        for (a, b) in self.edges() {
            let (a, b) = (a - origin, b - origin);
            let twice = a.perp_dot(b);
            area += 0.5 * twice;
            moment += (a + b) * (twice / 6.0);
        }
        (area, moment + origin * area)
    }

    fn has_inside(&self, p: DVec2) -> bool {
        let crosses = |&(a, b): &(DVec2, DVec2)| {
            (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y))
        };
        self.edges().filter(crosses).count() % 2 == 1
    }
}

/// Outer contours with their holes.
fn grouped(outlines: &[Outline]) -> Vec<Group<'_>> {
    let outer: Vec<&Outline> = outlines.iter().filter(|o| o.area > 0.0).collect();
    let mut holes: Vec<Vec<&Outline>> = vec![Vec::new(); outer.len()];
    for hole in outlines.iter().filter(|o| o.area < 0.0) {
        let asked: Vec<DVec2> = hole.points.iter().copied().step_by(hole.points.len().div_ceil(ASKED)).collect();
        let half = asked.len().div_ceil(2);
        let around = |o: &Outline| {
            if o.bounds.overlaps(hole.bounds) {
                asked.iter().filter(|p| o.has_inside(**p)).count().min(half)
            } else {
                0
            }
        };
        let best = (0..outer.len())
            .map(|i| (i, around(outer[i])))
            .max_by(|(i, n), (j, m)| n.cmp(m).then(outer[*j].area.total_cmp(&outer[*i].area)));
        if let Some((i, _)) = best {
            holes[i].push(hole);
        }
    }
    outer
        .into_iter()
        .zip(holes)
        .map(|(outer, holes)| {
            let circle = outer.bounds.center();
            let radius = outer.points.iter().map(|p| p.distance(circle)).fold(0.0, f64::max);
            let contours = core::iter::once(outer).chain(holes).collect();
            Group { contours, circle, radius }
        })
        .collect()
}

impl Group<'_> {
    fn centroid(&self) -> DVec2 {
        let (area, moment) =
            self.contours.iter().map(|o| o.moments()).fold((0.0, DVec2::ZERO), |sum, m| (sum.0 + m.0, sum.1 + m.1));
        let centroid = moment / area;
        // Contours that cancel have none.
        if area > 0.0 && centroid.is_finite() { centroid } else { self.circle }
    }

    /// Signed distances over the radius at the centres of side × side texels, negative inside.
    fn bake(&self, side: usize) -> Vec<f32> {
        let edges: Vec<(DVec2, DVec2)> = self.contours.iter().flat_map(|o| o.edges()).collect();
        let reach = f64::from(PHI) * self.radius;
        let pitch = 2.0 * reach / side as f64;
        let low = self.circle - DVec2::splat(reach);
        let at = |x: usize, y: usize| low + (DVec2::new(x as f64, y as f64) + 0.5) * pitch;
        let mut texels = vec![0.0; side * side];
        for (by, rows) in texels.chunks_mut(BLOCK * side).enumerate() {
            for bx in 0..side.div_ceil(BLOCK) {
                let (x0, y0) = (bx * BLOCK, by * BLOCK);
                let (x1, y1) = ((x0 + BLOCK).min(side), y0 + rows.len() / side);
                let (first, last) = (at(x0, y0), at(x1 - 1, y1 - 1));
                let middle = (first + last) * 0.5;
                let far: Vec<f64> = edges.iter().map(|&(a, b)| distance(middle, a, b)).collect();
                let nearest = far.iter().copied().fold(f64::INFINITY, f64::min);
                // The distance changes by no more than the place does.
                let limit = nearest + first.distance(last) * (1.0 + 1e-9);
                let near: Vec<_> = edges.iter().zip(&far).filter(|(_, d)| **d <= limit).map(|(e, _)| *e).collect();
                for y in y0..y1 {
                    for x in x0..x1 {
                        let p = at(x, y);
                        let d = near.iter().map(|&(a, b)| distance(p, a, b)).fold(f64::INFINITY, f64::min);
                        rows[(y - y0) * side + x] = (d / self.radius) as f32;
                    }
                }
            }
            for (y, row) in rows.chunks_mut(side).enumerate() {
                self.sign(&edges, at(0, by * BLOCK + y), pitch, row);
            }
        }
        texels
    }

    /// Turns the distances of a row negative inside. `start` is its first texel.
    fn sign(&self, edges: &[(DVec2, DVec2)], start: DVec2, pitch: f64, row: &mut [f32]) {
        let y = start.y;
        let mut crossings: Vec<f64> = edges
            .iter()
            .filter(|(a, b)| (a.y <= y) != (b.y <= y))
            .map(|(a, b)| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)))
            .collect();
        crossings.sort_by(f64::total_cmp);
        let mut passed = 0;
        for (x, texel) in row.iter_mut().enumerate() {
            let x = start.x + x as f64 * pitch;
            while crossings.get(passed).is_some_and(|c| *c <= x) {
                passed += 1;
            }
            if passed % 2 == 1 {
                *texel = -*texel;
            }
        }
    }
}

/// Distance of a point from a segment.
fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (u, v) = (b - a, p - a);
    let length2 = u.length_squared();
    let t = if length2 > 0.0 { (v.dot(u) / length2).clamp(0.0, 1.0) } else { 0.0 };
    v.distance(u * t)
}
