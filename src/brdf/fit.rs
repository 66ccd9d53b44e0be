//! The fitter: one linearly transformed cosine per (α, θ), by Levenberg–Marquardt on a weighted square error.
//!
//! Every node is solved from its neighbours' answers, in sweeps over the table in all four directions, and keeps the best.

use super::ggx::{self, Albedo};
use super::lobe::{PARAMETERS, Shape};
use super::ltc::{self, ALPHA_MIN, Entry, Provenance, Table, TableError};
use super::quadrature::{self, Grid};
use glam::DVec3;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What the lobe's own horizon may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tilt {
    /// It is fitted.
    Free,
    /// It stands square to the mean direction of the BRDF, as in the published matrix (Heitz 2016): a worse fit, for
    /// comparison.
    MeanDirection,
}

/// How to fit a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FitOptions {
    /// Nodes along α, at least 2.
    pub alphas: usize,
    /// Nodes along θ, at least 2.
    pub thetas: usize,
    /// Directions at which the error is summed.
    pub grid: Grid,
    /// What the lobe's own horizon may do.
    pub tilt: Tilt,
}

impl Default for FitOptions {
    /// The options of the shipped table.
    fn default() -> Self {
        let grid = Grid { normals: [56, 32], directions: [28, 20] };
        Self { alphas: 64, thetas: 64, grid, tilt: Tilt::Free }
    }
}

/// Times each node is solved: down its column, along its row, and back.
const SWEEPS: usize = 3;
/// α below which the error is weighed by one over the density of directions, so that the tail counts.
const NARROW: f64 = 0.05;
/// α above which the error is weighed as it is.
const WIDE: f64 = 0.5;

/// The best lobe found at a node so far.
#[derive(Clone, Debug)]
struct Solution {
    free: Vec<f64>,
    cost: f64,
}

/// One node: what is to be matched, and the lobe's free parameters.
struct Node {
    alpha: f64,
    v: DVec3,
    albedo: Albedo,
    freedom: Freedom,
    /// Direction, f·cos θ, and the square root of the weight.
    samples: Vec<(DVec3, f64, f64)>,
}

/// Which lobes a node chooses from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Freedom {
    /// Normal view: a round lobe about the normal; free: ln a.
    Round,
    /// The horizon's tilt is given; free: asinh tan(ψ − p), ln a, ln of the y entry.
    Pinned(f64),
    /// Free: ψ/α, asinh tan(ψ − p), ln a, ln of the y entry.
    Full,
}

impl Freedom {
    fn start(self) -> Vec<f64> {
        match self {
            Self::Round => vec![0.0],
            Self::Pinned(_) => vec![0.0; 3],
            Self::Full => vec![0.0; 4],
        }
    }

    /// A neighbour's answer as a start. A round lobe hands on its width, the last but one of the others' parameters.
    fn adopt(self, free: &[f64]) -> Vec<f64> {
        let mut start = self.start();
        if start.len() == free.len() {
            start.copy_from_slice(free);
        } else {
            let width = start.len().saturating_sub(2);
            start[width] = free[free.len().saturating_sub(2)];
        }
        start
    }

    fn shape(self, alpha: f64, q: &[f64]) -> Shape {
        match self {
            Self::Round => Shape { axis: 0.0, horizon: 0.0, ln_width: q[0], ln_inv_y: 0.0 },
            Self::Pinned(p) => Shape { axis: p + q[0].sinh().atan(), horizon: p, ln_width: q[1], ln_inv_y: q[2] },
            Self::Full => {
                let axis = alpha * q[0];
                Shape { axis, horizon: axis - q[1].sinh().atan(), ln_width: q[2], ln_inv_y: q[3] }
            }
        }
    }

    /// The gradient by the free parameters, from that by the shape's.
    fn gradient(self, alpha: f64, q: &[f64], [axis, horizon, width, inv_y]: [f64; PARAMETERS]) -> [f64; PARAMETERS] {
        match self {
            Self::Round => [width, 0.0, 0.0, 0.0],
            Self::Pinned(_) => [axis / q[0].cosh(), width, inv_y, 0.0],
            Self::Full => [alpha * (axis + horizon), -horizon / q[1].cosh(), width, inv_y],
        }
    }
}

impl Node {
    fn new(alpha: f64, cos_theta: f64, options: &FitOptions) -> Self {
        let v = ggx::view(cos_theta);
        let directions = quadrature::hemisphere(alpha, v, options.grid);
        let mean: DVec3 = directions.iter().map(|&(l, w)| l * (w * ggx::brdf_cos(alpha, v, l))).sum();
        let freedom = match options.tilt {
            _ if v.x == 0.0 => Freedom::Round,
            Tilt::Free => Freedom::Full,
            Tilt::MeanDirection => Freedom::Pinned((v.z * mean.x + v.x * mean.z).atan2(v.z * mean.z - v.x * mean.x)),
        };
        // Narrow lobes are matched relative to their density, or the tail would not count; wide ones absolutely.
        let relative = ((WIDE.sqrt() - alpha.sqrt()) / (WIDE.sqrt() - NARROW.sqrt())).clamp(0.0, 1.0);
        let sample = |&(l, w): &(DVec3, f64)| {
            let density = 0.8 * ggx::visible_density(alpha, v, l) + 0.2 / TAU;
            (l, ggx::brdf_cos(alpha, v, l), (w * density.powf(-relative)).sqrt())
        };
        let samples = directions.iter().map(sample).collect();
        Self { alpha, v, albedo: ggx::albedo(alpha, cos_theta), freedom, samples }
    }

    fn start(&self) -> Solution {
        Solution { free: self.freedom.start(), cost: f64::INFINITY }
    }

    fn solve(&self, start: &Solution) -> Solution {
        let problem = Problem { node: self, free: DVector::from_vec(self.freedom.adopt(&start.free)) };
        let (problem, report) = LevenbergMarquardt::new().with_patience(60).minimize(problem);
        let free = problem.free.as_slice().to_vec();
        // A lobe whose axis is below the true horizon may match by its tail; it doesn't blend with its neighbours.
        let above = self.freedom.shape(self.alpha, &free).transform(self.alpha, self.v).above().0;
        let sound = report.objective_function.is_finite() && above > 0.5;
        Solution { free, cost: if sound { report.objective_function } else { f64::INFINITY } }
    }

    fn entry(&self, solution: &Solution) -> Entry {
        self.freedom.shape(self.alpha, &solution.free).entry(self.alpha, self.v, self.albedo)
    }
}

struct Problem<'a> {
    node: &'a Node,
    free: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.free.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.free.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let Node { alpha, v, albedo, freedom, samples } = self.node;
        let lobe = freedom.shape(*alpha, self.free.as_slice()).transform(*alpha, *v);
        let scale = albedo.magnitude / lobe.above().0;
        let residual = |&(l, f, weight): &(DVec3, f64, f64)| weight * (scale * lobe.density(l).0 - f);
        Some(DVector::from_iterator(samples.len(), samples.iter().map(residual)))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let Node { alpha, v, albedo, freedom, samples } = self.node;
        let free = self.free.as_slice();
        let lobe = freedom.shape(*alpha, free).transform(*alpha, *v);
        let (above, d_above) = lobe.above();
        let scale = albedo.magnitude / above;
        let mut jacobian = DMatrix::zeros(samples.len(), free.len());
        for (row, &(l, _, weight)) in samples.iter().enumerate() {
            let (density, d_density) = lobe.density(l);
            let by_shape = std::array::from_fn(|k| weight * scale * (d_density[k] - density * d_above[k] / above));
            for (column, d) in freedom.gradient(*alpha, free, by_shape).into_iter().take(free.len()).enumerate() {
                jacobian[(row, column)] = d;
            }
        }
        Some(jacobian)
    }
}

/// Fits a table. `progress` is called from any thread with the finished share, 0 to 1.
///
/// Deterministic: the same options give the same table on every machine with the same elementary functions.
///
/// # Errors
/// [`TableError::Axes`] for fewer than 2 × 2 nodes or too many, [`TableError::Entry`] where no sound lobe was found.
pub fn fit_table(options: &FitOptions, progress: &(dyn Fn(f64) + Sync)) -> Result<Table, TableError> {
    let [rows, columns] = [options.alphas, options.thetas];
    ltc::check_axes(rows, columns, ALPHA_MIN)?;
    let node = |k: usize| {
        let alpha = ltc::alpha_at((k / columns) as f64 / (rows - 1) as f64);
        Node::new(alpha, ltc::cos_theta_at((k % columns) as f64 / (columns - 1) as f64), options)
    };
    let nodes: Vec<Node> = (0..rows * columns).into_par_iter().map(node).collect();

    let solved = AtomicUsize::new(0);
    let solve = |node: &Node, start: &Solution| {
        let count = solved.fetch_add(1, Ordering::Relaxed) + 1;
        progress((count as f64 / (SWEEPS * rows * columns) as f64).min(1.0));
        node.solve(start)
    };
    // The row alpha = 1 from normal view on; every column from there down to the mirror; every row there and back.
    let inner = columns - 1;
    let mut widest: Vec<Solution> = Vec::with_capacity(inner);
    for node in &nodes[(rows - 1) * columns..][..inner] {
        let start = widest.last().cloned().unwrap_or_else(|| node.start());
        widest.push(solve(node, &start));
    }
    let downwards = |(j, top): (usize, Solution)| {
        let mut column = vec![top];
        for i in (0..rows - 1).rev() {
            column.push(solve(&nodes[i * columns + j], &column[column.len() - 1]));
        }
        column
    };
    let by_column: Vec<Vec<Solution>> = widest.into_par_iter().enumerate().map(downwards).collect();
    let sweep = |i: usize| {
        let row = &nodes[i * columns..(i + 1) * columns];
        let mut best: Vec<Solution> = by_column.iter().map(|column| column[rows - 1 - i].clone()).collect();
        let there = (1..inner).map(|j| (j, j - 1));
        let back = (1..inner).rev().map(|j| (j - 1, j));
        for (to, from) in there.chain(back) {
            let found = solve(&row[to], &best[from]);
            if found.cost < best[to].cost {
                best[to] = found;
            }
        }
        best.push(grazing(&row[inner - 1], &best[inner - 1], &row[inner], options));
        best
    };
    let solutions: Vec<Solution> = (0..rows).into_par_iter().flat_map_iter(sweep).collect();
    progress(1.0);
    if let Some(k) = solutions.iter().position(|s| !s.cost.is_finite()) {
        return Err(TableError::Entry { row: k / columns, column: k % columns });
    }
    let entries: Vec<Entry> = nodes.iter().zip(&solutions).map(|(node, s)| node.entry(s)).collect();
    let provenance = Provenance {
        normals: options.grid.normals.map(|n| n as u32),
        directions: options.grid.directions.map(|n| n as u32),
        free_tilt: options.tilt == Tilt::Free,
    };
    Table::new(rows, columns, provenance, &entries)
}

/// The lobe at grazing view, from that of the column before. Narrow lobes turn within cos θ ≈ α, so the way there is
/// taken in small steps.
fn grazing(before: &Node, solution: &Solution, last: &Node, options: &FitOptions) -> Solution {
    let mut step = solution.clone();
    let mut cos_theta = before.v.z;
    while cos_theta > 0.02 * last.alpha {
        cos_theta *= 0.75;
        step = Node::new(last.alpha, cos_theta, options).solve(&step);
    }
    last.solve(&step)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { normals: [8, 6], directions: [6, 5] };

    /// Largest difference of the analytic Jacobian from central differences, relative to the column's largest entry.
    fn jacobian_error(tilt: Tilt, alpha: f64, cos_theta: f64, free: &[f64], meant: &[f64]) -> f64 {
        let node = Node::new(alpha, cos_theta, &FitOptions { alphas: 2, thetas: 2, grid: GRID, tilt });
        let residuals = |free: Vec<f64>| Problem { node: &node, free: DVector::from_vec(free) }.residuals().unwrap();
        let jacobian = Problem { node: &node, free: DVector::from_column_slice(meant) }.jacobian().unwrap();
        let column_error = |k: usize| {
            let moved = |h: f64| {
                let mut free = free.to_vec();
                free[k] += h;
                residuals(free)
            };
            let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            (&difference - jacobian.column(k)).amax() / difference.amax()
        };
        (0..free.len()).map(column_error).fold(0.0, f64::max)
    }

    #[test]
    fn jacobian_is_the_derivative() {
        for (tilt, cos_theta, free) in [
            (Tilt::Free, 1.0, vec![0.5]),
            (Tilt::MeanDirection, 0.4, vec![-0.3, 0.6, 0.2]),
            (Tilt::Free, 0.7, vec![0.2, -0.4, 0.7, 0.3]),
            (Tilt::Free, 0.05, vec![1.5, -2.0, 1.8, 1.6]),
        ] {
            for alpha in [0.02, 0.3, 1.0] {
                let error = jacobian_error(tilt, alpha, cos_theta, &free, &free);
                assert!(error < 1e-5, "{tilt:?} alpha {alpha} cos {cos_theta}: {error}");
                let elsewhere: Vec<f64> = free.iter().map(|x| x * 1.01).collect();
                let error = jacobian_error(tilt, alpha, cos_theta, &free, &elsewhere);
                assert!(error > 1e-4, "{tilt:?} alpha {alpha} cos {cos_theta}: taken elsewhere only {error}");
            }
        }
    }
}
