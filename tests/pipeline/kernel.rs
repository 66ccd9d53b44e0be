//! The tree's walk against the float64 yardstick.

use crate::cases::{Rng, blob, images, wide};
use glam::{DAffine2, DMat2, DMat3, DVec2, DVec3};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::expansion::{ACROSS, LEVEL};
use glyphlight::kernel::horizon::{Clip, Clipped, Height, TrueHorizon};
use glyphlight::kernel::lanes::{Doubles, Lanes};
use glyphlight::kernel::map::{CosineMap, PlanePoint};
use glyphlight::kernel::tree::{Budget, Integral, tree_integral};
use glyphlight::kernel::wide::Wide;
use glyphlight::light::tree::Tree;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::shape::{CubicBez, Shape};

fn tree_value(c: [DVec3; 3], horizon: Option<DVec3>, shape: &Shape, tolerance: f32) -> (f32, u32) {
    walk(c, horizon, &Tree::new(shape).unwrap(), tolerance)
}

/// As shading points do it: in f64 where the light is close.
fn walk(c: [DVec3; 3], horizon: Option<DVec3>, tree: &Tree, tolerance: f32) -> (f32, u32) {
    let Some(map) = CosineMap::new(c, tree.center, tree.half) else { return (0.0, 0) };
    if map.depth <= 0.0 {
        return (0.0, 0);
    }
    let heights = |m: DVec3| c.map(|c| c.dot(m));
    if map.is_close() {
        let horizon = horizon.map(|m| (wide(m), heights(m).map(Wide)));
        let integral = walk_in::<Wide, Wide>(c.map(wide), horizon, tree, tolerance.into());
        return integral.map_or((0.0, 0), |integral| (integral.value.0 as f32, integral.visited));
    }
    let horizon = horizon.map(|m| (m.as_vec3(), heights(m)));
    walk_in::<f64, f32>(c, horizon, tree, tolerance).map_or((0.0, 0), |integral| (integral.value, integral.visited))
}

/// The true horizon by its axis and the heights of the images over it.
fn walk_in<D: Doubles<Narrow = L, Mask = bool>, L: Lanes<Mask = bool>>(
    c: [D::Vec3; 3],
    horizon: Option<(L::Vec3, [D; 3])>,
    tree: &Tree,
    tolerance: L,
) -> Option<Integral<L>> {
    let (map, _) = CosineMap::<L>::of::<D>(c, tree.center, tree.half);
    let truth = horizon.map(|(axis, heights)| {
        let form = map.height_form::<D>(heights, tree.center, tree.half);
        TrueHorizon { axis, height: Height::new(&map, form) }
    });
    let root = tree.nodes[0];
    let at = L::Vec2::from_foot(root.center, DVec2::ZERO, map.foot);
    let Clipped { clip, below } = Clip::of(&map, truth.as_ref(), at, at.fixed(root.half));
    let left = tolerance.splat(Budget::default().left);
    (!below).then(|| tree_integral(&map, &clip, tree.view(), tolerance, &mut Budget { left }, true))
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

/// A light in cosine space and what clips it besides z = 0.
struct Placed {
    c: [DVec3; 3],
    horizon: Option<DVec3>,
    shape: Shape,
}

impl Placed {
    fn exact(&self) -> f64 {
        exact_integral(&ExactMap { c: self.c, horizon: self.horizon }, &self.shape)
    }

    fn tree(&self, tolerance: f32) -> f64 {
        f64::from(tree_value(self.c, self.horizon, &self.shape, tolerance).0)
    }
}

/// Any light anywhere, half of them with both horizons.
fn anywhere(rng: &mut Rng) -> Placed {
    let shape = blob(rng);
    let turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
    let origin = rng.direction() * rng.log_within(0.02, 30.0);
    let m_inv = random_lobe(rng);
    let horizon = (rng.unit() < 0.5).then(|| m_inv.inverse().row(2));
    Placed { c: images(m_inv, turn, origin, 1.0), horizon, shape }
}

/// f32 leaves 1e-6 of rounding; 2e-5 is what is promised.
const FLOOR: f64 = 2e-5;

#[test]
fn tree_is_within_tolerance_of_exact() {
    for tolerance in [1e-3_f32, 1e-4, 1e-5] {
        let mut rng = Rng(7);
        for case in 0..6000 {
            let placed = anywhere(&mut rng);
            let (value, truth) = (placed.tree(tolerance), placed.exact());
            let error = (value - truth).abs();
            assert!(error <= f64::from(tolerance) + FLOOR, "case {case} at {tolerance}: {value} for {truth}");
        }
    }
}

#[test]
fn a_light_moved_by_one_percent_is_noticed() {
    let mut rng = Rng(7);
    let (mut seen, mut noticed) = (0, 0);
    for _ in 0..2000 {
        let placed = anywhere(&mut rng);
        let truth = placed.exact();
        if !(0.01..0.9).contains(&truth) {
            continue;
        }
        let moved = Placed { c: [placed.c[0] * 1.01, placed.c[1] * 1.01, placed.c[2]], ..placed };
        seen += 1;
        noticed += u32::from((moved.tree(1e-5) - truth).abs() > 1e-5 + FLOOR);
    }
    assert!(seen > 100 && noticed * 10 > seen * 9, "{noticed} of {seen}");
}

/// The value does not depend on the common scale of a light and its distance.
#[test]
fn scale_costs_no_digits() {
    let mut rng = Rng(5);
    for case in 0..2000 {
        let placed = anywhere(&mut rng);
        let unit = placed.tree(1e-4);
        for scale in [1e-12, 1e-4, 1e4, 1e12] {
            let scaled =
                Placed { c: placed.c.map(|c| c * scale), horizon: placed.horizon, shape: placed.shape.clone() };
            assert!((scaled.tree(1e-4) - unit).abs() < 2e-6, "case {case}, scale {scale}");
        }
    }
}

type Maker = fn(&mut Rng) -> Placed;

/// The kinds of placement that are known to break integrators.
const HOSTILE: [(&str, Maker); 7] = [
    ("near an edge", |rng| near(rng, 1.0)),
    ("near the inside", |rng| {
        let inward = rng.unit();
        near(rng, inward)
    }),
    ("horizon through a shared end point", |rng| {
        let (turn, shape) = (turn(rng), blob(rng));
        let corner = turn * any_curve(rng, &shape).p0.extend(0.0);
        let o = rng.direction() * rng.log_within(0.1, 3.0);
        place(rng, turn, DVec3::new(o.x, o.y, -corner.z), shape)
    }),
    ("horizon touching a curve", |rng| {
        let (turn, shape) = (turn(rng), blob(rng));
        let height = |p: DVec2| (turn * p.extend(0.0)).z;
        let samples = (0..=200).map(|i| f64::from(i) / 200.0);
        let lowest =
            shape.curves().flat_map(|c| samples.clone().map(|t| height(c.eval(t)))).fold(f64::INFINITY, f64::min);
        let o = rng.direction() * rng.log_within(0.1, 3.0);
        let z = -lowest + rng.within(-1.0, 1.0) * 1e-7;
        Placed { c: images(DMat3::IDENTITY, turn, DVec3::new(o.x, o.y, z), 1.0), horizon: None, shape }
    }),
    ("the two horizons' lines parallel: the light's normal in the plane of incidence", |rng| {
        let shape = blob(rng);
        let turn = DMat3::from_rotation_y(rng.within(-3.0, 3.0));
        let alpha = rng.log_within(1e-2, 1.0);
        let m = DMat3::from_rotation_y(rng.within(-1.5, 0.0)) * DMat3::from_diagonal(DVec3::new(alpha, alpha, 1.0));
        let origin = DVec3::new(rng.within(-1.0, 1.0), rng.within(-0.5, 0.5), rng.within(-0.5, 0.5));
        Placed { c: images(m.inverse(), turn, origin, 1.0), horizon: Some(m.row(2)), shape }
    }),
    ("near mirror", |rng| {
        let alpha = rng.log_within(1e-4, 1e-2);
        let m = DMat3::from_cols(
            DVec3::new(alpha, 0.0, 0.0),
            DVec3::new(0.0, alpha, 0.0),
            DVec3::new(rng.within(-1.0, 1.0), 0.0, 1.0),
        );
        let (turn, shape) = (turn(rng), blob(rng));
        let origin = rng.direction() * rng.log_within(0.1, 3.0);
        Placed { c: images(m.inverse(), turn, origin, 1.0), horizon: Some(m.row(2)), shape }
    }),
    ("nearly in the light's plane", |rng| {
        let (turn, shape) = (turn(rng), blob(rng));
        let q = rng.direction() * rng.log_within(0.5, 5.0);
        let origin = turn * DVec3::new(q.x, q.y, -rng.log_within(1e-9, 1e-2));
        place(rng, turn, origin, shape)
    }),
];

fn turn(rng: &mut Rng) -> DMat3 {
    DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0))
}

fn any_curve(rng: &mut Rng, shape: &Shape) -> CubicBez {
    let curves: Vec<_> = shape.curves().copied().collect();
    curves[(rng.unit() * curves.len() as f64) as usize]
}

/// A random lobe over a light that is scaled by 1e-4, 1 or 1e4.
fn place(rng: &mut Rng, turn: DMat3, origin: DVec3, shape: Shape) -> Placed {
    let scale = [1.0, 1e-4, 1e4][(rng.unit() * 3.0) as usize];
    let m_inv = random_lobe(rng);
    let horizon = (rng.unit() < 0.3).then(|| m_inv.inverse().row(2));
    let c = images(m_inv, turn, origin, 1.0).map(|c| c * scale);
    Placed { c, horizon, shape }
}

/// A point 1e-5 to 1e-2 from a point of the outline, drawn to the middle by `inward`.
fn near(rng: &mut Rng, inward: f64) -> Placed {
    let (turn, shape) = (turn(rng), blob(rng));
    let at = any_curve(rng, &shape).eval(rng.unit()) * inward;
    let origin = turn * -at.extend(0.0) + rng.direction() * rng.log_within(1e-5, 1e-2);
    place(rng, turn, origin, shape)
}

#[test]
fn hostile_placements_are_within_tolerance() {
    for (name, make) in HOSTILE {
        for tolerance in [1e-3_f32, 1e-5] {
            let mut rng = Rng(11);
            for case in 0..2000 {
                let placed = make(&mut rng);
                let (value, truth) = (placed.tree(tolerance), placed.exact());
                let error = (value - truth).abs();
                assert!(error <= f64::from(tolerance) + FLOOR, "{name}, {case} at {tolerance}: {value} for {truth}");
            }
        }
    }
}

/// A disc seen from the middle of its axis has the form factor r²/(r² + h²); a huge one fills the hemisphere.
#[test]
fn a_disc_has_its_closed_form() {
    let k = 0.552_284_749_830_793_4;
    let quarter = |i: u32| {
        let turn = DMat2::from_angle(f64::from(i) * std::f64::consts::FRAC_PI_2);
        let [a, b, c, d] = [(1.0, 0.0), (1.0, k), (k, 1.0), (0.0, 1.0)].map(|(x, y)| turn * DVec2::new(x, y));
        CubicBez::new(a, b, c, d)
    };
    let mut curves: Vec<_> = (0..4).map(quarter).collect();
    for i in 0..4 {
        curves[i].p3 = curves[(i + 1) % 4].p0;
    }
    let disc = Shape::from_contours(vec![curves]).unwrap();
    for height in [1e-6, 0.1, 1.0, 30.0] {
        // Above the point, facing down: the light's y axis is the world's −y.
        let c = [DVec3::X, DVec3::NEG_Y, DVec3::Z * height];
        let placed = Placed { c, horizon: None, shape: disc.clone() };
        let form_factor = 1.0 / (1.0 + height * height);
        // The quarter-circle cubics are 2.7e-4 off a circle.
        assert!((placed.tree(1e-6) - form_factor).abs() < 4e-4 * form_factor, "{height}");
        assert!((placed.exact() - form_factor).abs() < 4e-4 * form_factor, "{height}");
        // From behind there is nothing.
        let behind = Placed { c: [DVec3::X, DVec3::Y, DVec3::Z * height], horizon: None, shape: disc.clone() };
        assert_eq!((behind.tree(1e-6), behind.exact()), (0.0, 0.0));
    }
}

/// An S-shaped run has no area and yet a first moment: dropping it was wrong by up to 2.
#[test]
fn s_curves_are_not_dropped() {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let s = CubicBez::new(p(-1.0, 0.0), p(-0.3, -1.6), p(0.3, 1.6), p(1.0, 0.0));
    let lines = [(1.0, 0.0), (1.0, 1.5), (-1.0, 1.5), (-1.0, 0.0)].map(|(x, y)| p(x, y));
    let mut curves = vec![s];
    curves.extend(lines.windows(2).map(|w| CubicBez::line(w[0], w[1])));
    let shape = Shape::from_contours(vec![curves]).unwrap();
    let mut rng = Rng(3);
    for tolerance in [1e-2_f32, 1e-3, 1e-5] {
        for _ in 0..500 {
            let origin = rng.direction() * rng.log_within(0.05, 5.0);
            let turn = turn(&mut rng);
            let placed =
                Placed { c: images(random_lobe(&mut rng), turn, origin, 1.0), horizon: None, shape: shape.clone() };
            let (value, truth) = (placed.tree(tolerance), placed.exact());
            assert!((value - truth).abs() <= f64::from(tolerance) + FLOOR, "{value} for {truth}");
        }
    }
}

/// Lights of many parts: the errors of the parts add up within the tolerance.
#[test]
fn many_parts_stay_within_the_tolerance() {
    let square = |x: u32, y: u32| {
        let low = DVec2::new(f64::from(x), f64::from(y)) / 20.0 - 1.0;
        Shape::rectangle(low, low + 0.03)
    };
    let mut grid = Shape::default();
    (0..1600).for_each(|i| grid.append(square(i % 40, i / 40)));
    let font = Font::bundled("DejaVu Sans").unwrap();
    let words = "Light in the shape of\nletters falls on every\nfloor that it can see,\nand the farther it is,\nthe softer it becomes.";
    let text = layout(words, &[font], &TextStyle { size: 0.15, ..TextStyle::default() }).unwrap().shape;
    for (name, shape) in [("grid", grid), ("text", text)] {
        let tree = Tree::new(&shape).unwrap();
        let mut rng = Rng(17);
        for case in 0..40 {
            let m_inv = random_lobe(&mut rng);
            let origin = rng.direction() * rng.log_within(0.1, 3.0);
            let placed = Placed { c: images(m_inv, turn(&mut rng), origin, 1.0), horizon: None, shape: shape.clone() };
            let truth = placed.exact();
            for tolerance in [1e-3_f32, 1e-4, 1e-5] {
                let value = f64::from(walk(placed.c, None, &tree, tolerance).0);
                let error = (value - truth).abs();
                assert!(error <= f64::from(tolerance) + FLOOR, "{name} {case} at {tolerance}: {value} for {truth}");
            }
        }
    }
}

/// A hole whose box also lies in the box of a smaller outer contour that does not hold it; a contour that crosses itself.
#[test]
fn clusters_know_what_they_weigh() {
    let contour = |points: &[(f64, f64)]| -> Vec<CubicBez> {
        let p = |i: usize| DVec2::from(points[i % points.len()]);
        (0..points.len()).map(|i| CubicBez::line(p(i), p(i + 1))).collect()
    };
    let ring = contour(&[(-0.3, -1.0), (0.3, -1.0), (0.3, 1.0), (-0.3, 1.0)]);
    let hole = contour(&[(-0.2, -0.9), (-0.2, -0.4), (0.2, -0.4), (0.2, -0.9)]);
    let cup = contour(&[
        (-0.42, -1.1),
        (0.42, -1.1),
        (0.42, -0.3),
        (0.35, -0.3),
        (0.35, -1.05),
        (-0.35, -1.05),
        (-0.35, -0.3),
        (-0.42, -0.3),
    ]);
    let eight = contour(&[(-1.0, -0.5), (1.0, 0.5), (1.0, -0.5), (-1.0, 0.6)]);
    let shapes = [vec![ring, hole, cup], vec![eight]].map(|c| Shape::from_contours(c).unwrap());
    let mut rng = Rng(23);
    for (kind, shape) in shapes.into_iter().enumerate() {
        for case in 0..400 {
            let origin = rng.direction() * rng.log_within(0.3, 8.0);
            let c = images(random_lobe(&mut rng), turn(&mut rng), origin, 1.0);
            let placed = Placed { c, horizon: None, shape: shape.clone() };
            let (value, truth) = (placed.tree(1e-5), placed.exact());
            assert!((value - truth).abs() <= 1e-5 + FLOOR, "{kind} {case}: {value} for {truth}");
        }
    }
}

/// Cost follows the tolerance and not the number of curves: ten copies of a blob far away cost about as much as one.
#[test]
fn far_curves_cost_little() {
    let mut rng = Rng(9);
    let mut near_only = blob(&mut rng);
    let origin = DVec3::new(0.2, 0.1, 1.5);
    let c = images(DMat3::IDENTITY, DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)), origin, 1.0);
    let (_, alone) = tree_value(c, None, &near_only, 1e-3);
    for i in 0..40 {
        let away = DAffine2::from_translation(DVec2::new(20.0 + 3.0 * f64::from(i), 0.0));
        near_only.append(blob(&mut rng).transformed(away));
    }
    let (_, together) = tree_value(c, None, &near_only, 1e-3);
    assert!(together <= alone + 16, "{alone} nodes alone, {together} with forty more blobs");
}

/// Cₙ^(2)(x) for n below `count`.
fn gegenbauer(x: f64, count: usize) -> Vec<f64> {
    let mut c = vec![1.0, 4.0 * x];
    for n in 2..count {
        let k = n as f64;
        c.push((2.0 * x * (k + 1.0) * c[n - 1] - (k + 2.0) * c[n - 2]) / k);
    }
    c
}

/// The largest of the coefficients that bounds are made of over their bounds: of regions across the line of sight up to (t/s)² =
/// `across`, and of the leading terms with `level` of [`LEVEL`].
fn coefficients_over_their_bounds(across: f64, level: f64) -> [f64; 2] {
    let steps = |count: u32| (0..=count).map(move |i| f64::from(i) / f64::from(count));
    let series: Vec<_> = steps(2000).map(|c| (c, gegenbauer(c, 40))).collect();
    let mut worst = [0.0_f64; 2];
    for x in steps(40).map(|part| part * across) {
        let w = 1.0 + 1.5 * x + 3.61 * x * x;
        for (c, of) in &series {
            let reach = if c * c > x { x.sqrt() / c } else { 1.0 };
            for (n, of) in of.iter().enumerate().skip(1) {
                let n = n as f64;
                worst[0] = worst[0].max(reach.powf(n) * of.abs() / ((n + 2.0) / 2.0 * w));
            }
        }
    }
    for z in steps(40) {
        let rest = (1.0 - z * z).sqrt();
        for (c, of) in &series {
            // Directions at that angle from the line of sight, the highest and the lowest of them.
            let spread = (1.0 - c * c).sqrt() * rest;
            for (c, rise) in [(*c, c * z + spread), (*c, c * z - spread), (-c, spread - c * z)] {
                let sign = |n: usize| if c < 0.0 || n.is_multiple_of(2) { 1.0 } else { -1.0 };
                for n in 2..=4 {
                    let most = ((n + 1) * (n + 2)) as f64 / 2.0;
                    let term = z * sign(n) * of[n] + rise * sign(n - 1) * of[n - 1];
                    let bound = most * z + f64::from(LEVEL[n - 2]) * level * rest;
                    worst[1] = worst[1].max(term.abs() / bound);
                }
            }
        }
    }
    worst
}

#[test]
fn bounds_hold_the_coefficients_of_the_series() {
    let [across, leading] = coefficients_over_their_bounds(f64::from(ACROSS), 1.0);
    assert!(across <= 1.0 && leading <= 1.0 + 1e-9, "{across}, {leading}");
    // Neither bound could be much less.
    let [across, leading] = coefficients_over_their_bounds(0.5, 0.99);
    assert!(across > 1.0 && leading > 1.0, "{across}, {leading}");
}
