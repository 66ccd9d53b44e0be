//! The fitter: one linearly transformed cosine per (α, θ), by Levenberg–Marquardt on a weighted square error.
//!
//! Every node is solved from its neighbours' answers, in sweeps over the table in all four directions, and keeps the best.

use super::ggx::{self, Albedo};
use super::lobe::{PARAMETERS, Shape};
use super::ltc::{Entry, Provenance, Table, TableError};
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
    /// The horizon's tilt is given; free: tan(ψ − p), ln a, ln of the y entry.
    Pinned(f64),
    /// Free: ψ/α, tan(ψ − p), ln a, ln of the y entry.
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

    /// A neighbour's answer as a start, whatever its freedom was.
    fn adopt(self, free: &[f64]) -> Vec<f64> {
        let mut start = self.start();
        let common = start.len().min(free.len());
        if common == 1 {
            let at = start.len().saturating_sub(2);
            start[at] = free[free.len().saturating_sub(2)];
        } else {
            start.copy_from_slice(&free[..common]);
        }
        start
    }

    fn shape(self, alpha: f64, q: &[f64]) -> Shape {
        match self {
            Self::Round => Shape { axis: 0.0, horizon: 0.0, ln_width: q[0], ln_inv_y: 0.0 },
            Self::Pinned(p) => Shape { axis: p + q[0].atan(), horizon: p, ln_width: q[1], ln_inv_y: q[2] },
            Self::Full => {
                let axis = alpha * q[0];
                Shape { axis, horizon: axis - q[1].atan(), ln_width: q[2], ln_inv_y: q[3] }
            }
        }
    }

    /// The gradient by the free parameters, from that by the shape's.
    fn gradient(self, alpha: f64, q: &[f64], [axis, horizon, width, inv_y]: [f64; PARAMETERS]) -> [f64; PARAMETERS] {
        match self {
            Self::Round => [width, 0.0, 0.0, 0.0],
            Self::Pinned(_) => [axis / (1.0 + q[0] * q[0]), width, inv_y, 0.0],
            Self::Full => [alpha * (axis + horizon), -horizon / (1.0 + q[1] * q[1]), width, inv_y],
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
        let relative = ((0.5f64.sqrt() - alpha.sqrt()) / (0.5f64.sqrt() - 0.1f64.sqrt())).clamp(0.0, 1.0);
        let sample = |&(l, w): &(DVec3, f64)| {
            let density = 0.8 * ggx::visible_density(alpha, v, l) + 0.2 / TAU;
            (l, ggx::brdf_cos(alpha, v, l), (w * density.powf(-relative)).sqrt())
        };
        let samples = directions.iter().map(sample).collect();
        Self { alpha, v, albedo: ggx::albedo(alpha, cos_theta), freedom, samples }
    }

    fn solve(&self, start: &[f64]) -> Solution {
        let problem = Problem { node: self, free: DVector::from_column_slice(start) };
        let (problem, report) = LevenbergMarquardt::new().with_patience(60).minimize(problem);
        let free = problem.free.as_slice().to_vec();
        // A lobe whose axis is below the true horizon may match by its tail; it doesn't blend with its neighbours.
        let above = self.freedom.shape(self.alpha, &free).transform(self.alpha, self.v).above().0;
        let sound = report.objective_function.is_finite() && above > 0.5;
        Solution { free, cost: if sound { report.objective_function } else { f64::INFINITY } }
    }

    fn entry(&self, free: &[f64]) -> Entry {
        self.freedom.shape(self.alpha, free).entry(self.alpha, self.v, self.albedo)
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
/// [`TableError::Axes`] for fewer than 2 × 2 nodes.
pub fn fit_table(options: &FitOptions, progress: &(dyn Fn(f64) + Sync)) -> Result<Table, TableError> {
    let [rows, columns] = [options.alphas, options.thetas];
    let p = options.grid;
    let provenance = Provenance {
        half_vectors: p.normals.map(|n| n as u32),
        hemisphere: p.directions.map(|n| n as u32),
        free_tilt: options.tilt == Tilt::Free,
    };
    // Sizes, and the axes, are checked by an empty table of the same shape.
    let axes = Table::new(
        rows,
        columns,
        provenance,
        &vec![Entry { ux: 1.0, beta: 1.0, magnitude: 1.0, ..Entry::default() }; rows * columns],
    )?;
    let nodes: Vec<Node> = (0..rows * columns)
        .into_par_iter()
        .map(|k| Node::new(axes.alpha(k / columns), axes.cos_theta(k % columns), options))
        .collect();

    let solved = AtomicUsize::new(0);
    let solve = |node: &Node, start: &[f64]| {
        let count = solved.fetch_add(1, Ordering::Relaxed) + 1;
        progress((count as f64 / (SWEEPS * rows * columns) as f64).min(1.0));
        node.solve(&node.freedom.adopt(start))
    };
    // First the row alpha = 1 from normal view on, then every column down to the mirror.
    let mut last_row = Vec::with_capacity(columns);
    for node in &nodes[(rows - 1) * columns..] {
        let start = last_row.last().map_or_else(|| node.freedom.start(), |s: &Solution| s.free.clone());
        last_row.push(solve(node, &start));
    }
    let by_column: Vec<Vec<Solution>> = last_row
        .into_par_iter()
        .enumerate()
        .map(|(j, top)| {
            let mut column = vec![top];
            for i in (0..rows - 1).rev() {
                column.push(solve(&nodes[i * columns + j], &column[column.len() - 1].free));
            }
            column.reverse();
            column
        })
        .collect();
    let mut best: Vec<Solution> = (0..rows * columns).map(|k| by_column[k % columns][k / columns].clone()).collect();
    let keep = |line: &mut [Solution], line_nodes: &[&Node], to: usize, from: usize| {
        let found = solve(line_nodes[to], &line[from].free);
        if found.cost < line[to].cost {
            line[to] = found;
        }
    };
    best.par_chunks_mut(columns).enumerate().for_each(|(i, line)| {
        let line_nodes: Vec<&Node> = nodes[i * columns..(i + 1) * columns].iter().collect();
        (1..columns).for_each(|j| keep(line, &line_nodes, j, j - 1));
        (0..columns - 1).rev().for_each(|j| keep(line, &line_nodes, j, j + 1));
    });
    let entries: Vec<Entry> = nodes.iter().zip(&best).map(|(node, s)| node.entry(&s.free)).collect();
    progress(1.0);
    Table::new(rows, columns, provenance, &entries)
}

/// Times each node is solved: down its column, along its row, and back.
const SWEEPS: usize = 3;
