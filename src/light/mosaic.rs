//! Cuts a region that carries a picture into tiles of one colour, in a tree. The walk over it is [`crate::kernel::mosaic`].

use super::Square;
use super::tree::{Tree, TreeError};
use crate::kernel::mosaic::{Tile, Tiles};
use crate::kernel::tree::{Handles, LowEnds, Node};
use crate::picture::Picture;
use crate::shape::{CubicBez, Shape};
use glam::{DVec2, DVec3, UVec2, Vec2};

/// Cells along the longer side of a light.
pub const CELLS: f64 = 128.0;
/// Colours nearer each other than this, of the brightest, are one.
const ALIKE: f64 = 1.0 / 512.0;
/// A part of a region smaller than this, of its square, is rounding.
const NOTHING: f64 = 1e-14;

/// The mosaic of one region.
#[derive(Clone, Debug, Default)]
pub struct Mosaic {
    /// In pre-order.
    pub tiles: Vec<Tile>,
    /// The trees of all tiles, one after the other.
    pub nodes: Vec<Node>,
    /// What f32 lost of the nodes' chord ends.
    pub low: Vec<LowEnds>,
    /// Handles of the cubic leaves.
    pub handles: Vec<Handles>,
}

impl Mosaic {
    /// Cuts `shape` into cells of the size `cell` (light space) and less where the picture changes, each of the picture's
    /// mean colour in it: the picture's details below that are lost to mirrors.
    ///
    /// # Errors
    /// [`TreeError`] where the shape has no area or too many nodes.
    pub fn new(shape: &Shape, picture: &Picture, cell: f64) -> Result<Self, TreeError> {
        let square = Square::around(shape.bounds()).ok_or(TreeError::NoArea)?;
        let grid = Grid::new(shape, picture, cell);
        let mut mosaic = Self::default();
        mosaic.emit(square, &grid, shape, [UVec2::ZERO, grid.size], &mut Vec::new())?.ok_or(TreeError::NoArea)?;
        Ok(mosaic)
    }

    /// What the walk reads.
    pub fn view(&self) -> Tiles<'_> {
        Tiles { tiles: &self.tiles, nodes: &self.nodes, low: &self.low, handles: &self.handles }
    }

    /// Size of the arrays in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.tiles.as_slice())
            + size_of_val(self.nodes.as_slice())
            + size_of_val(self.low.as_slice())
            + size_of_val(self.handles.as_slice())
    }

    /// The part of the region in a range of cells, with all its parts. `None` where there is nothing of it. Its tiles of
    /// one colour are added to `spots`.
    fn emit(
        &mut self,
        square: Square,
        grid: &Grid,
        shape: &Shape,
        cells: [UVec2; 2],
        spots: &mut Vec<Spot>,
    ) -> Result<Option<Colored>, TreeError> {
        if shape.area() <= NOTHING * square.half * square.half {
            return Ok(None);
        }
        let tree = Tree::within(square, shape)?;
        let at = self.tiles.len();
        let root = tree.nodes[0];
        let mut tile: Tile = bytemuck::Zeroable::zeroed();
        tile.center = root.center;
        tile.half = root.half;
        tile.first_node = self.nodes.len() as u32;
        tile.end_node = tile.first_node + tree.nodes.len() as u32;
        tile.first_handles = self.handles.len() as u32;
        self.tiles.push(tile);
        self.nodes.extend(tree.nodes);
        self.low.extend(tree.low);
        self.handles.extend(tree.handles);
        let first_spot = spots.len();
        let halves = match grid.split(square, shape, cells) {
            None => [None, None],
            Some([(left, low), (right, high)]) => {
                [self.emit(square, grid, &left, low, spots)?, self.emit(square, grid, &right, high, spots)?]
            }
        };
        let colored = match halves {
            [Some(a), Some(b)] => a.plus(&b),
            [Some(a), None] | [None, Some(a)] => a,
            [None, None] => {
                let color = grid.mean(cells);
                spots.push(Spot { center: root.center, half: root.half, area: f64::from(root.m0), color });
                Colored::new(&root, color)
            }
        };
        let about = colored.about(tile.center.as_dvec2());
        let tile = &mut self.tiles[at];
        tile.mean = about.mean.as_vec3();
        tile.m1_x = about.m1[0].as_vec3();
        tile.m1_y = about.m1[1].as_vec3();
        tile.m2_xx = about.m2[0].as_vec3();
        tile.m2_xy = about.m2[1].as_vec3();
        tile.m2_yy = about.m2[2].as_vec3();
        let deviation = |weight: &dyn Fn(&Spot) -> f64| -> f64 {
            let off = |s: &Spot| (s.color - about.mean).abs().max_element() * s.area * weight(s);
            spots[first_spot..].iter().map(off).sum()
        };
        let (center, half) = (tile.center, tile.half);
        // What is left of one colour by rounding.
        let some = |v: f64| if v > 1e-9 * about.area * about.mean.max_element() { v as f32 } else { 0.0 };
        tile.deviation = some(deviation(&|_| 1.0));
        tile.deviation_3 = some(deviation(&|s| {
            let reach = ((s.center - center).abs() + s.half) / half;
            f64::from(reach.max_element().min(1.0)).powi(3)
        }));
        self.tiles[at].skip = self.tiles.len() as u32;
        Ok(Some(about))
    }
}

/// The picture as cells of one colour each, over the region's box.
struct Grid {
    low: DVec2,
    step: DVec2,
    size: UVec2,
    /// Row by row from below.
    colors: Vec<DVec3>,
    /// Colour differences below this are none.
    alike: f64,
}

impl Grid {
    fn new(shape: &Shape, picture: &Picture, cell: f64) -> Self {
        let bounds = shape.bounds();
        let extent = bounds.size();
        let size = (extent / cell).ceil().clamp(DVec2::ONE, DVec2::splat(CELLS)).as_uvec2();
        let step = extent / size.as_dvec2();
        let color = |i: u32| {
            let low = bounds.min + DVec2::new(f64::from(i % size.x), f64::from(i / size.x)) * step;
            picture.mean_over(&Shape::rectangle(low, low + step)).truncate().as_dvec3()
        };
        let colors: Vec<_> = (0..size.element_product()).map(color).collect();
        let brightest = colors.iter().map(|c| c.max_element()).fold(0.0, f64::max);
        Self { low: bounds.min, step, size, colors, alike: ALIKE * brightest }
    }

    fn range([low, high]: [UVec2; 2]) -> impl Iterator<Item = UVec2> {
        (low.y..high.y).flat_map(move |y| (low.x..high.x).map(move |x| UVec2::new(x, y)))
    }

    fn color(&self, cell: UVec2) -> DVec3 {
        self.colors[(cell.y * self.size.x + cell.x) as usize]
    }

    fn mean(&self, cells: [UVec2; 2]) -> DVec3 {
        let count = (cells[1] - cells[0]).element_product();
        Self::range(cells).map(|c| self.color(c)).sum::<DVec3>() / f64::from(count)
    }

    /// The two halves of a part across its longer side; `None` where it is of one colour.
    fn split(&self, square: Square, shape: &Shape, cells: [UVec2; 2]) -> Option<[(Shape, [UVec2; 2]); 2]> {
        let first = self.color(cells[0]);
        if Self::range(cells).all(|c| (self.color(c) - first).abs().max_element() <= self.alike) {
            return None;
        }
        let count = cells[1] - cells[0];
        let extent = shape.bounds().size();
        let across_x = count.y == 1 || (count.x > 1 && extent.x >= extent.y);
        let axis = usize::from(!across_x);
        let middle = cells[0][axis] + count[axis] / 2;
        let at = self.low[axis] + f64::from(middle) * self.step[axis];
        let [left, right] = cut(shape, axis, at, square.half);
        let [mut low, mut high] = [cells, cells];
        low[1][axis] = middle;
        high[0][axis] = middle;
        Some([(left, low), (right, high)])
    }
}

/// The parts of a region on the lower and the upper side of a line along an axis (Sutherland, Hodgman 1974, with curves):
/// contours that cross the line go back along it, which winds as the part does.
fn cut(shape: &Shape, axis: usize, at: f64, scale: f64) -> [Shape; 2] {
    // Lines along y become lines along x and back.
    let turned = |p: DVec2| if axis == 0 { DVec2::new(p.y, p.x) } else { p };
    let turn = |c: &CubicBez| {
        let [p0, p1, p2, p3] = c.points().map(turned);
        CubicBez::new(p0, p1, p2, p3)
    };
    let mut parts: [Vec<Vec<CubicBez>>; 2] = Default::default();
    for contour in shape.contours() {
        let mut pieces: [Vec<CubicBez>; 2] = Default::default();
        for curve in contour.curves().iter().map(turn) {
            let mut from = 0.0;
            let mut start = curve.p0;
            let mut side = usize::from(curve.p0.y > at);
            let mut piece = |side: usize, from: f64, to: f64, ends: [DVec2; 2]| {
                let part = if from == 0.0 && to == 1.0 { curve } else { curve.subsegment(from, to) };
                pieces[side].push(part.with_ends(ends[0], ends[1]));
            };
            let mut crossings = Vec::new();
            curve.crossing_parameters(at, |t, _| crossings.push(t));
            for t in crossings {
                let crossing = DVec2::new(curve.eval(t).x, at);
                piece(side, from, t, [start, crossing]);
                (from, start, side) = (t, crossing, 1 - side);
            }
            piece(side, from, 1.0, [start, curve.p3]);
        }
        for (pieces, part) in pieces.into_iter().zip(&mut parts) {
            let closed = close(pieces, 1e-15 * scale);
            if !closed.is_empty() {
                part.push(closed.iter().map(turn).collect());
            }
        }
    }
    parts.map(Shape::of_closed)
}

/// Joins pieces by straight edges along the line; leaves out what is a point.
fn close(pieces: Vec<CubicBez>, point: f64) -> Vec<CubicBez> {
    let mut closed: Vec<CubicBez> = Vec::new();
    let Some(first) = pieces.first().map(|c| c.p0) else { return closed };
    let ends = pieces.iter().skip(1).map(|c| c.p0).chain([first]);
    for (piece, next) in pieces.iter().zip(ends) {
        closed.push(*piece);
        if piece.p3 != next {
            closed.push(CubicBez::line(piece.p3, next));
        }
    }
    let size = closed.iter().flat_map(|c| c.points()).map(|p| (p - first).abs().max_element()).fold(0.0, f64::max);
    if size > point { closed } else { Vec::new() }
}

/// A part of the region with its colours: moments about a point of tree space.
struct Colored {
    about: DVec2,
    /// ∫dA, ∫(x, y) dA, ∫(xx, xy, yy) dA.
    area: f64,
    first: DVec2,
    second: [f64; 3],
    mean: DVec3,
    /// Of the difference to the mean.
    m1: [DVec3; 2],
    m2: [DVec3; 3],
}

/// A tile of one colour.
struct Spot {
    center: Vec2,
    half: Vec2,
    area: f64,
    color: DVec3,
}

impl Colored {
    /// A part of one colour, from the root of its tree.
    fn new(root: &Node, mean: DVec3) -> Self {
        Self {
            about: root.center.as_dvec2(),
            area: f64::from(root.m0),
            first: Vec2::from_array(root.m1).as_dvec2() * f64::from(root.unit()),
            second: root.m2.map(|m| f64::from(m) * f64::from(root.unit()).powi(2)),
            mean,
            m1: [DVec3::ZERO; 2],
            m2: [DVec3::ZERO; 3],
        }
    }

    /// The moments about another point. Those of the difference have no zeroth.
    fn about(&self, point: DVec2) -> Self {
        let d = self.about - point;
        let [xx, xy, yy] = self.second;
        let [mxx, mxy, myy] = self.m2;
        let [mx, my] = self.m1;
        Self {
            about: point,
            area: self.area,
            first: self.first + d * self.area,
            second: [
                xx + 2.0 * d.x * self.first.x + d.x * d.x * self.area,
                xy + d.x * self.first.y + d.y * self.first.x + d.x * d.y * self.area,
                yy + 2.0 * d.y * self.first.y + d.y * d.y * self.area,
            ],
            mean: self.mean,
            m1: self.m1,
            m2: [mxx + 2.0 * d.x * mx, mxy + d.x * my + d.y * mx, myy + 2.0 * d.y * my],
        }
    }

    fn plus(&self, other: &Self) -> Self {
        let [a, b] = [self, &other.about(self.about)];
        let area = a.area + b.area;
        let mean = (a.mean * a.area + b.mean * b.area) / area;
        let [da, db] = [a.mean - mean, b.mean - mean];
        Self {
            about: a.about,
            area,
            first: a.first + b.first,
            second: core::array::from_fn(|i| a.second[i] + b.second[i]),
            mean,
            m1: core::array::from_fn(|i| a.m1[i] + b.m1[i] + da * a.first[i] + db * b.first[i]),
            m2: core::array::from_fn(|i| a.m2[i] + b.m2[i] + da * a.second[i] + db * b.second[i]),
        }
    }
}
