//! The tree's walk against the float64 yardstick.

use crate::cases::{Rng, blob, images};
use glam::{DMat3, DVec3, Vec3};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::horizon::Horizon;
use glyphlight::kernel::map::CosineMap;
use glyphlight::kernel::tree::{Clip, tree_integral};
use glyphlight::light::tree::Tree;
use glyphlight::shape::Shape;

fn tree_value(c: [DVec3; 3], horizon: Option<[f64; 3]>, shape: &Shape, tolerance: f32) -> (f32, u32) {
    let tree = Tree::new(shape).unwrap();
    let Some(map) = CosineMap::new(c, tree.center, tree.half) else { return (0.0, 0) };
    if map.depth <= 0.0 {
        return (0.0, 0);
    }
    let clip = match horizon {
        None => Clip::Lobe(Horizon::lobe(&map)),
        Some(h) => {
            let m = DMat3::from_cols(c[0], c[1], c[2]).transpose().inverse() * DVec3::from_array(h);
            match Horizon::pair(&map, m.as_vec3(), map.height_form(h, tree.center, tree.half)) {
                Some(pair) => Clip::Both(pair),
                None => Clip::Lobe(Horizon::lobe(&map)),
            }
        }
    };
    let integral = tree_integral(&map, &clip, &tree.nodes, &tree.handles, tolerance);
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
            let horizon = two.then(|| [turn.x_axis.z, turn.y_axis.z, origin.z]);
            let truth = exact_integral(&ExactMap { c, horizon }, &shape);
            let (value, visited) = tree_value(c, horizon, &shape, tolerance);
            let error = (f64::from(value) - truth).abs();
            if error > f64::from(tolerance) + 2e-5 {
                println!("tol {tolerance} case {case} two {two} truth {truth} value {value} error {error:e} visited {visited} dist {distance} minv {m_inv}");
            }
            worst = worst.max(error);
            sum2 += error * error;
            visits += u64::from(visited);
            count += 1;
        }
        println!("tol {tolerance}: worst {worst:e} rms {:e} visits {}", (sum2 / f64::from(count)).sqrt(), visits as f64 / f64::from(count));
    }
}
