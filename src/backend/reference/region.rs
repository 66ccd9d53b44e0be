//! [`Region`]: points spread evenly over a shape, and the test whether a point is in it.

use super::areas::areas;
use super::sampler::Key;
use crate::shape::{Bounds, CubicBez, Shape};
use core::ops::Range;
use glam::DVec2;

/// Fewest and most cells of the grid.
const CELLS: Range<f64> = 4096.0..1_048_576.0;
/// Cells a curve may cost.
const CELLS_PER_CURVE: f64 = 4096.0;
/// Part of the covering cells that lies in the shape, at which the grid is fine enough.
const FILLED: f64 = 0.8;
/// How far a curve's box is grown, of a cell.
const MARGIN: f64 = 1e-6;
/// Halvings of a curve until its boxes are as small as cells.
const HALVINGS: u32 = 24;
/// Most tiles.
const TILES: f64 = 64.0;
/// Most points that are tried until one is in the shape.
const TRIALS: u32 = 16;
/// State of a cell that a curve may cross.
const CROSSED: i8 = i8::MIN;

/// A shape under a grid of cells: those that no curve crosses have one winding number, known; in those that are crossed
/// it comes from the curves of the row, as [`Shape::winding`] finds it.
#[derive(Clone, Debug)]
pub struct Region {
    bounds: Bounds,
    cell: DVec2,
    columns: usize,
    rows: usize,
    /// Winding number of each cell or [`CROSSED`], row by row from the lowest.
    states: Vec<i8>,
    tiles: Vec<Tile>,
    /// Tiles across and down, and cells of each (of the last ones: at most).
    tiling: [usize; 2],
    tile_cells: [usize; 2],
    /// Columns of the cells with winding or crossed, tile by tile and in it row by row.
    covering: Vec<u32>,
    /// Where each row of each tile begins in `covering`, and the end.
    starts: Vec<u32>,
    /// The shape's parts in the tiles up to each, added up, the last 1.
    even: Vec<f64>,
    area: f64,
    curves: Vec<Boxed>,
    /// Indices of the curves that reach each row.
    crossing: Vec<u32>,
    /// Where each row begins in `crossing`, and the end.
    crossing_rows: Vec<u32>,
}

/// A part of the grid.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Its middle, light space.
    pub center: DVec2,
    /// Half its sides.
    pub half: DVec2,
    /// Area of the shape in it, light-space units².
    pub area: f64,
    /// Chance that one of the points tried is in the shape.
    found: f64,
    /// Cells in it that hold some of the shape.
    cells: u32,
    /// Its lowest row, and where that is in the region's `starts`.
    row: u32,
    start: u32,
    rows: u32,
}

#[derive(Clone, Copy, Debug)]
struct Boxed {
    curve: CubicBez,
    left: f64,
    right: f64,
}

impl Boxed {
    /// What the curve adds to the winding number of `p`: its crossings with the ray to the right.
    fn winding(&self, p: DVec2) -> i32 {
        if self.right <= p.x {
            return 0;
        }
        if self.left > p.x {
            // All of it lies to the right: only the ends matter.
            return i32::from(self.curve.p0.y <= p.y) - i32::from(self.curve.p3.y <= p.y);
        }
        let mut winding = 0;
        self.curve.crossings(p.y, |x, direction| {
            if x > p.x {
                winding += direction;
            }
        });
        winding
    }
}

impl Region {
    /// The grid over `shape`, whose winding number is 0 or 1 everywhere. Refined until four fifths of the cells' area lie in the shape, or until
    /// there are 4096 cells for each curve, or 2²⁰.
    pub fn new(shape: &Shape) -> Self {
        let most = (CELLS_PER_CURVE * shape.curves().count() as f64).clamp(CELLS.start, CELLS.end);
        let area = shape.area();
        let mut cells = CELLS.start;
        loop {
            let region = Self::with_cells(shape, cells);
            if area >= FILLED * region.covering.len() as f64 * region.cell_area() || 4.0 * cells > most {
                return region.with_areas(shape);
            }
            cells *= 4.0;
        }
    }

    fn with_cells(shape: &Shape, cells: f64) -> Self {
        let bounds = shape.bounds();
        let size = bounds.size();
        let columns = (cells * size.x / size.y).sqrt().round().clamp(1.0, cells);
        let rows = (cells / columns).round().max(1.0);
        let cell = size / DVec2::new(columns, rows);
        let boxed = |&curve: &CubicBez| {
            let x = curve.points().map(|p| p.x);
            let fold = |f: fn(f64, f64) -> f64| f(f(x[0], x[1]), f(x[2], x[3]));
            Boxed { curve, left: fold(f64::min), right: fold(f64::max) }
        };
        let mut region = Self {
            bounds,
            cell,
            columns: columns as usize,
            rows: rows as usize,
            states: vec![0; columns as usize * rows as usize],
            tiles: Vec::new(),
            tiling: [1; 2],
            tile_cells: [1; 2],
            covering: Vec::new(),
            starts: vec![0],
            even: Vec::new(),
            area: 0.0,
            curves: shape.curves().map(boxed).collect(),
            crossing: Vec::new(),
            crossing_rows: Vec::new(),
        };
        region.list_crossings();
        for i in 0..region.curves.len() {
            region.mark(region.curves[i].curve, HALVINGS);
        }
        region.wind();
        region.cover();
        region
    }

    /// The cells that a box meets, columns and rows, with a margin.
    fn cells_of(&self, bounds: Bounds) -> [Range<usize>; 2] {
        let low = (bounds.min - self.bounds.min) / self.cell - MARGIN;
        let high = (bounds.max - self.bounds.min) / self.cell + MARGIN;
        let range =
            |low: f64, high: f64, n: usize| (low.max(0.0) as usize).min(n - 1)..(high.max(0.0) as usize + 1).min(n);
        [range(low.x, high.x, self.columns), range(low.y, high.y, self.rows)]
    }

    fn list_crossings(&mut self) {
        let spans: Vec<Range<usize>> = self
            .curves
            .iter()
            .map(|c| {
                let [_, rows] = self.cells_of(Bounds::of(c.curve.points()));
                rows
            })
            .collect();
        let mut starts = vec![0_u32; self.rows + 1];
        for row in spans.iter().cloned().flatten() {
            starts[row + 1] += 1;
        }
        for row in 0..self.rows {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        self.crossing = vec![0; starts[self.rows] as usize];
        for (i, span) in spans.into_iter().enumerate() {
            for row in span {
                self.crossing[next[row] as usize] = i as u32;
                next[row] += 1;
            }
        }
        self.crossing_rows = starts;
    }

    /// Marks the cells that a curve may pass through: those under the boxes of parts as small as a cell.
    fn mark(&mut self, curve: CubicBez, halvings: u32) {
        let bounds = Bounds::of(curve.points());
        if halvings > 0 && bounds.size().cmpgt(self.cell).any() {
            self.mark(curve.subsegment(0.0, 0.5), halvings - 1);
            self.mark(curve.subsegment(0.5, 1.0), halvings - 1);
            return;
        }
        let [columns, rows] = self.cells_of(bounds);
        for row in rows {
            self.states[row * self.columns..][columns.clone()].fill(CROSSED);
        }
    }

    /// Finds the winding number of the cells without a curve: neighbours in a row share it.
    fn wind(&mut self) {
        for row in 0..self.rows {
            let mut known = None;
            for column in 0..self.columns {
                let i = row * self.columns + column;
                if self.states[i] == CROSSED {
                    known = None;
                    continue;
                }
                let middle = self.bounds.min + self.cell * DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                // Contours that wind more often than an i8 counts are left to the curves.
                let winding = *known.get_or_insert_with(|| self.winding_in_row(row, middle));
                self.states[i] = i8::try_from(winding).unwrap_or(CROSSED);
            }
        }
    }

    /// Lists the cells that hold some of the shape, tile by tile.
    fn cover(&mut self) {
        let size = self.bounds.size();
        let across = (TILES * size.x / size.y).sqrt().round().clamp(1.0, TILES);
        let wanted = [(across as usize).min(self.columns), ((TILES / across) as usize).clamp(1, self.rows)];
        self.tile_cells = [self.columns.div_ceil(wanted[0]), self.rows.div_ceil(wanted[1])];
        self.tiling = [self.columns.div_ceil(self.tile_cells[0]), self.rows.div_ceil(self.tile_cells[1])];
        for row in (0..self.rows).step_by(self.tile_cells[1]) {
            for column in (0..self.columns).step_by(self.tile_cells[0]) {
                self.cover_tile(column, row);
            }
        }
    }

    /// Finds how much of the shape is in each tile.
    fn with_areas(mut self, shape: &Shape) -> Self {
        let lines = |low: f64, high: f64, step: f64, count: usize| -> Vec<f64> {
            (0..count).map(|k| low + step * k as f64).chain([high]).collect()
        };
        let Bounds { min, max } = self.bounds;
        let step = self.cell * DVec2::new(self.tile_cells[0] as f64, self.tile_cells[1] as f64);
        let columns = lines(min.x, max.x, step.x, self.tiling[0]);
        let rows = lines(min.y, max.y, step.y, self.tiling[1]);
        let cell = self.cell_area();
        for (tile, area) in self.tiles.iter_mut().zip(areas(shape, &columns, &rows)) {
            let covered = f64::from(tile.cells) * cell;
            // Less than rounding leaves of a tile without any of the shape is none.
            if area > 1e-12 * covered {
                tile.area = area.min(covered);
                tile.found = 1.0 - (1.0 - tile.area / covered).powi(TRIALS as i32);
            }
        }
        self.area = self.tiles.iter().map(|tile| tile.area).sum();
        let mut sum = 0.0;
        let share = |tile: &Tile| {
            sum += tile.area;
            sum / self.area
        };
        self.even = self.tiles.iter().map(share).collect();
        self
    }

    fn cover_tile(&mut self, column: usize, row: usize) {
        let (right, top) = ((column + self.tile_cells[0]).min(self.columns), (row + self.tile_cells[1]).min(self.rows));
        let before = self.covering.len();
        let start = self.starts.len() as u32 - 1;
        for row in row..top {
            let states = &self.states[row * self.columns..][column..right];
            let held = (column as u32..).zip(states).filter(|(_, state)| **state != 0);
            self.covering.extend(held.map(|(column, _)| column));
            self.starts.push(self.covering.len() as u32);
        }
        let (low, high) = (DVec2::new(column as f64, row as f64), DVec2::new(right as f64, top as f64));
        self.tiles.push(Tile {
            center: self.bounds.min + self.cell * (low + high) * 0.5,
            half: self.cell * (high - low) * 0.5,
            area: 0.0,
            found: 0.0,
            cells: (self.covering.len() - before) as u32,
            row: row as u32,
            start,
            rows: (top - row) as u32,
        });
    }

    fn winding_in_row(&self, row: usize, p: DVec2) -> i32 {
        let list = self.crossing_rows[row] as usize..self.crossing_rows[row + 1] as usize;
        self.crossing[list].iter().map(|&i| self.curves[i as usize].winding(p)).sum()
    }

    /// How often the contours wind round `p`: [`Shape::winding`].
    pub fn winding(&self, p: DVec2) -> i32 {
        if !(p.cmpge(self.bounds.min).all() && p.cmple(self.bounds.max).all()) {
            return 0;
        }
        let [column, row] = self.cell_of(p);
        match self.states[row * self.columns + column] {
            CROSSED => self.winding_in_row(row, p),
            winding => i32::from(winding),
        }
    }

    /// Column and row of the cell of a point in the bounds.
    fn cell_of(&self, p: DVec2) -> [usize; 2] {
        let at = (p - self.bounds.min) / self.cell;
        [(at.x as usize).min(self.columns - 1), (at.y as usize).min(self.rows - 1)]
    }

    /// The parts of the grid among which [`Region::sample`] chooses.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Chances with which points are even over the shape: sums over the tiles up to each.
    pub fn even(&self) -> &[f64] {
        &self.even
    }

    /// The area of the shape, light-space units².
    pub const fn area(&self) -> f64 {
        self.area
    }

    fn cell_area(&self) -> f64 {
        self.cell.x * self.cell.y
    }

    /// A point of the shape for a point of the unit square, and its density per light-space unit²: in a tile by the `chances`
    /// (sums over the tiles up to each, the last 1; 0 for tiles with nothing of the shape), even over the shape in it,
    /// keeping the order in both directions. Rarely none, where all points that were tried are outside.
    pub fn sample(&self, chances: &[f64], uv: [f64; 2]) -> Option<(DVec2, f64)> {
        let (k, rest) = choose(chances, uv[1]);
        let tile = &self.tiles[k];
        let mut at = [uv[0], rest];
        // What a second trial needs is in the low bits of the first.
        let mut key = Key::new(uv[0].to_bits()).part(uv[1].to_bits());
        for _ in 0..TRIALS {
            let p = self.place(tile, at);
            if self.winding(p) > 0 {
                return Some((p, chance(chances, k) * tile.found / tile.area));
            }
            key = key.part(0);
            at = key.unit_square();
        }
        None
    }

    /// The place of a point of the unit square in the cells of a tile, row by row.
    fn place(&self, tile: &Tile, [u, v]: [f64; 2]) -> DVec2 {
        let starts = &self.starts[tile.start as usize..=(tile.start + tile.rows) as usize];
        let cells = f64::from(tile.cells);
        let place = f64::from(starts[0]) + (v * cells).min(cells.next_down());
        let row = starts[1..].partition_point(|&end| f64::from(end) <= place).min(tile.rows as usize - 1);
        let (start, end) = (starts[row] as usize, starts[row + 1] as usize);
        let across = u * (end - start) as f64;
        let k = (across as usize).min(end - start - 1);
        let inner = DVec2::new(across - k as f64, (place - start as f64) / (end - start) as f64);
        let corner = DVec2::new(f64::from(self.covering[start + k]), f64::from(tile.row) + row as f64);
        self.bounds.min + self.cell * (corner + inner.clamp(DVec2::ZERO, DVec2::ONE))
    }

    /// The density with which [`Region::sample`] finds a point of the shape, per light-space unit².
    pub fn density(&self, chances: &[f64], p: DVec2) -> f64 {
        let [column, row] = self.cell_of(p);
        let k = row / self.tile_cells[1] * self.tiling[0] + column / self.tile_cells[0];
        let tile = &self.tiles[k];
        if tile.area > 0.0 { chance(chances, k) * tile.found / tile.area } else { 0.0 }
    }

    /// The box around the shape's control points, light space.
    pub const fn bounds(&self) -> Bounds {
        self.bounds
    }
}

/// The chance of one of several things, by the sums up to each.
pub fn chance(chances: &[f64], k: usize) -> f64 {
    chances[k] - if k == 0 { 0.0 } else { chances[k - 1] }
}

/// Which of several things to take by their `chances` (sums up to each, the last 1), and what of `v` is left, 0 to 1 again.
pub fn choose(chances: &[f64], v: f64) -> (usize, f64) {
    let k = chances.partition_point(|&end| end <= v).min(chances.len() - 1);
    let start = if k == 0 { 0.0 } else { chances[k - 1] };
    let rest = (v - start) / (chances[k] - start);
    (k, if rest < 1.0 { rest.max(0.0) } else { 1.0 - f64::EPSILON })
}
