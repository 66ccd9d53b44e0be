//! The tree's walk against the float64 yardstick.

use crate::cases::{Rng, blob, images};
use glam::{DMat3, DVec3};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::horizon::{Clip, Height, TrueHorizon};
use glyphlight::kernel::map::CosineMap;
use glyphlight::kernel::tree::tree_integral;
use glyphlight::light::tree::Tree;
use glyphlight::shape::Shape;

fn tree_value(c: [DVec3; 3], horizon: Option<DVec3>, shape: &Shape, tolerance: f32) -> (f32, u32) {
    let tree = Tree::new(shape).unwrap();
    let Some(map) = CosineMap::new(c, tree.center, tree.half) else { return (0.0, 0) };
    if map.depth <= 0.0 {
        return (0.0, 0);
    }
    let truth = horizon.map(|m| {
        let form = map.height_form(c.map(|c| c.dot(m)), tree.center, tree.half);
        TrueHorizon { axis: m.as_vec3(), height: Height::new(&map, form) }
    });
    let root = tree.nodes[0];
    let Some(clip) = Clip::new(&map, truth.as_ref(), root.center - map.foot, root.half) else { return (0.0, 0) };
    let integral = tree_integral(&map, &clip, tree.view(), tolerance);
    (integral.value, integral.visited)
}

fn random_lobe(rng: &mut Rng) -> DMat3 {
    if rng.unit() < 0.3 {
        return DMat3::IDENTITY;
    }
    let alpha = rng.log_within(1e-3, 1.0);
    let m = DMat3::from_rotation_y(rng.within(-1.5, 0.0))
        * DMat3::from_cols(
            DVec3::new(alpha, 0.0, 0.0),
            DVec3::new(0.0, alpha * rng.within(0.3, 1.0), 0.0),
            DVec3::new(alpha * rng.within(-0.5, 0.5), 0.0, 1.0),
        );
    m.inverse()
}

#[test]
fn tree_agrees_with_exact() {
    for tolerance in [1e-3_f32, 1e-4, 1e-5] {
        let mut rng = Rng(7);
        let (mut worst, mut sum2, mut visits, mut count) = (0.0_f64, 0.0, 0_u64, 0_u32);
        for case in 0..20_000 {
            let shape = blob(&mut rng);
            let turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
            let distance = rng.log_within(0.02, 30.0);
            let origin = rng.direction() * distance;
            let m_inv = random_lobe(&mut rng);
            let c = images(m_inv, turn, origin, 1.0);
            let two = rng.unit() < 0.5;
            let horizon = two.then(|| m_inv.inverse().row(2));
            let truth = exact_integral(&ExactMap { c, horizon }, &shape);
            let (value, visited) = tree_value(c, horizon, &shape, tolerance);
            let error = (f64::from(value) - truth).abs();
            if error > f64::from(tolerance) + 2e-5 {
                println!(
                    "tol {tolerance} case {case} two {two} truth {truth} value {value} error {error:e} visited {visited} dist {distance} minv {m_inv}"
                );
            }
            worst = worst.max(error);
            sum2 += error * error;
            visits += u64::from(visited);
            count += 1;
        }
        println!(
            "tol {tolerance}: worst {worst:e} rms {:e} visits {}",
            (sum2 / f64::from(count)).sqrt(),
            visits as f64 / f64::from(count)
        );
    }
}

#[test]
fn hostile_placements() {
    for tolerance in [1e-3_f32, 1e-5] {
        let mut rng = Rng(11);
        let mut worst = [0.0_f64; 6];
        let mut visits = [0_u64; 6];
        let mut over = [0_u32; 6];
        let mut count = [0_u32; 6];
        for case in 0..30_000 {
            let kind = case % 6;
            let scale = [1.0, 1e-4, 1e4][(case / 6) % 3];
            let shape = blob(&mut rng);
            let curves: Vec<_> = shape.curves().copied().collect();
            let curve = curves[(rng.unit() * curves.len() as f64) as usize];
            let turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
            let mut m_inv = random_lobe(&mut rng);
            let on = |p: glam::DVec2| turn.x_axis * p.x + turn.y_axis * p.y;
            let origin = match kind {
                // Near an edge of the light.
                0 => -on(curve.eval(rng.unit())) + rng.direction() * rng.log_within(1e-5, 1e-2),
                // Near its inside.
                1 => -on(curve.p0 * rng.unit()) + rng.direction() * rng.log_within(1e-5, 1e-2),
                // The horizon through a shared end point.
                2 => {
                    let o = rng.direction() * rng.log_within(0.1, 3.0);
                    DVec3::new(o.x, o.y, -on(curve.p0).z)
                }
                // The horizon touching a curve.
                3 => {
                    let t = rng.unit();
                    let o = rng.direction() * rng.log_within(0.1, 3.0);
                    let tangent = on(curve.tangent(t));
                    m_inv = DMat3::IDENTITY;
                    let lowest = (0..=1000).map(|i| on(curve.eval(i as f64 / 1000.0)).z).fold(f64::INFINITY, f64::min);
                    let _ = tangent;
                    DVec3::new(o.x, o.y, -lowest + rng.within(-1.0, 1.0) * 1e-7)
                }
                // A near mirror.
                4 => {
                    let alpha = rng.log_within(1e-4, 1e-2);
                    m_inv = DMat3::from_cols(
                        DVec3::new(alpha, 0.0, 0.0),
                        DVec3::new(0.0, alpha, 0.0),
                        DVec3::new(rng.within(-1.0, 1.0), 0.0, 1.0),
                    )
                    .inverse();
                    rng.direction() * rng.log_within(0.1, 3.0)
                }
                // Grazing: nearly in the light's plane.
                _ => {
                    let q = rng.direction() * rng.log_within(0.5, 5.0);
                    on(glam::DVec2::new(q.x, q.y)) + turn.z_axis * rng.log_within(1e-9, 1e-2) * -1.0
                }
            };
            let c = images(m_inv, turn * scale, origin * scale, 1.0);
            let horizon = (rng.unit() < 0.3).then(|| m_inv.inverse().row(2));
            let truth = exact_integral(&ExactMap { c, horizon }, &shape);
            let (value, visited) = tree_value(c, horizon, &shape, tolerance);
            let error = (f64::from(value) - truth).abs();
            assert!(error.is_finite(), "{case}");
            if error > f64::from(tolerance) + 2e-5 {
                over[kind] += 1;
                if over[kind] < 4 {
                    println!(
                        "tol {tolerance} case {case} kind {kind} truth {truth} value {value} error {error:e} visited {visited} origin {origin} minv {m_inv}"
                    );
                }
            }
            worst[kind] = worst[kind].max(error);
            visits[kind] += u64::from(visited);
            count[kind] += 1;
        }
        for k in 0..6 {
            println!(
                "tol {tolerance} kind {k}: worst {:e} over {} of {} visits {}",
                worst[k],
                over[k],
                count[k],
                visits[k] / u64::from(count[k])
            );
        }
    }
}
