//! The polygonal techniques, `kuge` and `uniform`, against the float64 yardstick.

use crate::cases::{Rng, blob, images, ring};
use glam::{DMat3, DVec2, DVec3, Vec2};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::curve::{Curve, EdgeSum};
use glyphlight::kernel::horizon::Clip;
use glyphlight::kernel::map::CosineMap;
use glyphlight::kernel::polygon::uniform_integral;
use glyphlight::kernel::subdivide::{DIFFUSE_EPS, HALVINGS, INTERVALS, kuge_integral};
use glyphlight::light::Square;
use glyphlight::light::curves::curves;
use glyphlight::shape::{CubicBez, Shape};

/// A technique with its parameter.
#[derive(Clone, Copy, Debug)]
enum By {
    Kuge(f32),
    Uniform(u32),
}

/// Both at a setting that leaves little but the rounding of f32.
const FINE: [By; 2] = [By::Kuge(1e-6), By::Uniform(1024)];

/// A light in cosine space.
#[derive(Clone)]
struct Placed {
    c: [DVec3; 3],
    shape: Shape,
}

impl Placed {
    fn exact(&self) -> f64 {
        exact_integral(&ExactMap { c: self.c, horizon: None }, &self.shape)
    }

    fn by(&self, by: By) -> EdgeSum {
        self.of(&curves(&self.shape, self.square()), by)
    }

    fn square(&self) -> Square {
        Square::around(self.shape.bounds()).unwrap()
    }

    /// The integral of given curves in place of the shape's own.
    fn of(&self, curves: &[Curve], by: By) -> EdgeSum {
        let Square { center, half } = self.square();
        let Some(map) = CosineMap::new(self.c, center, half) else { return EdgeSum::default() };
        if map.depth <= 0.0 {
            return EdgeSum::default();
        }
        let Some(clip) = Clip::new(&map, None, -map.foot, Vec2::ONE) else { return EdgeSum::default() };
        let horizon = clip.planes().first();
        match by {
            By::Kuge(eps) => kuge_integral(&map, horizon, curves, eps),
            By::Uniform(segments) => uniform_integral(&map, horizon, curves, segments),
        }
    }

    fn error(&self, by: By) -> f64 {
        let value = f64::from(self.by(by).value);
        assert!(value.is_finite(), "{value} by {by:?}");
        (value - self.exact()).abs()
    }

    /// One percent larger.
    fn moved(&self) -> Self {
        let [x, y, origin] = self.c;
        Self { c: [x * 1.01, y * 1.01, origin], shape: self.shape.clone() }
    }
}

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn closed(corners: &[DVec2]) -> Vec<CubicBez> {
    (0..corners.len()).map(|i| CubicBez::line(corners[i], corners[(i + 1) % corners.len()])).collect()
}

fn shape(contours: Vec<Vec<CubicBez>>) -> Shape {
    Shape::from_contours(contours).unwrap()
}

/// A lobe like those of the table: its axis leans by up to 1.4 rad, as far as at grazing view.
fn lobe(rng: &mut Rng, alpha: f64, tilt: f64) -> DMat3 {
    let m = DMat3::from_rotation_y(-tilt)
        * DMat3::from_cols(
            DVec3::new(alpha, 0.0, 0.0),
            DVec3::new(0.0, alpha * rng.within(0.5, 1.0), 0.0),
            DVec3::new(alpha * rng.within(-0.3, 0.3), 0.0, 1.0),
        );
    m.inverse()
}

fn turn(rng: &mut Rng) -> DMat3 {
    DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0))
}

/// The shape anywhere at that distance in front of the plain cosine or of a lobe.
fn anywhere(rng: &mut Rng, shape: &Shape, distance: f64) -> Placed {
    let m_inv = if rng.unit() < 0.5 {
        DMat3::IDENTITY
    } else {
        let (alpha, tilt) = (rng.log_within(0.05, 1.0), rng.within(0.0, 1.2));
        lobe(rng, alpha, tilt)
    };
    let origin = rng.direction() * distance;
    Placed { c: images(m_inv, turn(rng), origin, 1.0), shape: shape.clone() }
}

/// The shape with the horizon z = 0 of the plain cosine through the light-space point `at`.
fn cut_at(rng: &mut Rng, shape: &Shape, at: DVec2) -> Placed {
    let turn = turn(rng);
    let o = rng.direction() * rng.log_within(0.3, 3.0);
    let origin = DVec3::new(o.x, o.y, -(turn * at.extend(0.0)).z);
    Placed { c: images(DMat3::IDENTITY, turn, origin, 1.0), shape: shape.clone() }
}

type Maker = fn(&mut Rng) -> Placed;

/// What breaks the published program, with the largest error that ours may have: the rounding of f32, and for kuge what is
/// left of all triangles below eps.
const BREAKS: [(&str, f64, Maker); 9] = [
    ("height nearly quadratic: TrueType curves over the horizon", 1e-5, |rng| {
        let corner = |i: u32| DVec2::from_angle(f64::from(i) * std::f64::consts::FRAC_PI_3) * 0.9;
        let quads = (0..6).map(|i| {
            let (a, b) = (corner(i), corner((i + 1) % 6));
            CubicBez::quad(a, (a + b) * rng.within(0.35, 0.9), b)
        });
        let quads = shape(vec![quads.collect()]);
        let at = p(rng.within(-0.6, 0.6), rng.within(-0.6, 0.6));
        cut_at(rng, &quads, at)
    }),
    ("hole crossing the horizon", 1e-5, |rng| {
        let outer = ring(rng, DVec2::ZERO, 1.0, 7, false);
        let hole = ring(rng, p(0.1, -0.05), 0.45, 5, true);
        let at = p(0.1, -0.05) + p(rng.within(-0.2, 0.2), rng.within(-0.2, 0.2));
        cut_at(rng, &shape(vec![outer, hole]), at)
    }),
    ("handle drawn back into its end", 1e-5, |rng| {
        let handle = p(rng.within(-0.5, 1.5), rng.within(0.3, 1.2));
        let curve = CubicBez::new(p(0.0, 0.0), p(0.0, 0.0), handle, p(1.0, 0.0));
        let curve = if rng.unit() < 0.5 { curve } else { curve.reversed() };
        let retracted =
            shape(vec![vec![curve, CubicBez::line(curve.p3, p(0.5, -0.8)), CubicBez::line(p(0.5, -0.8), curve.p0)]]);
        let distance = rng.log_within(0.1, 2.0);
        anywhere(rng, &retracted, distance)
    }),
    ("handle square to the chord", 1e-5, |rng| {
        let curve = CubicBez::new(p(1.0, 0.0), p(1.0, rng.within(0.2, 1.0)), p(0.0, rng.within(0.2, 1.0)), p(0.0, 0.0));
        let squared = shape(vec![vec![curve, CubicBez::line(curve.p3, curve.p0)]]);
        let distance = rng.log_within(0.1, 2.0);
        anywhere(rng, &squared, distance)
    }),
    ("curve with two parts above the horizon", 1e-5, |rng| {
        // A bay of the horizon: z = −y, and the curve dips below it in the middle.
        let depth = rng.within(0.05, 0.6);
        let low = 0.3 - depth * 2.0;
        let curve = CubicBez::new(p(-1.0, 0.3), p(-0.4, low), p(0.4, low), p(1.0, 0.3));
        let bay = shape(vec![vec![
            curve,
            CubicBez::line(curve.p3, p(1.0, 1.2)),
            CubicBez::line(p(1.0, 1.2), p(-1.0, 1.2)),
            CubicBez::line(p(-1.0, 1.2), curve.p0),
        ]]);
        let bay = bay.transformed(glam::DAffine2::from_scale(p(1.0, if rng.unit() < 0.5 { 1.0 } else { -1.0 })));
        let tilt = DMat3::from_rotation_z(rng.within(-0.2, 0.2)) * DMat3::from_rotation_x(rng.within(0.3, 2.8));
        let origin = DVec3::new(rng.within(-1.0, 1.0), rng.within(0.2, 2.0), rng.within(-0.05, 0.05));
        Placed { c: images(DMat3::IDENTITY, tilt, origin, 1.0), shape: bay }
    }),
    ("grazing view, alpha 0.01", 1e-5, |rng| {
        let tilt = rng.within(1.3, 1.55);
        let m_inv = lobe(rng, 0.01, tilt);
        // In the mirror direction, which lies along −x.
        let origin = (DVec3::new(-tilt.sin(), 0.0, tilt.cos()) + rng.direction() * 0.1) * rng.log_within(0.3, 4.0);
        let shape = blob(rng);
        Placed { c: images(m_inv, turn(rng), origin, 1.0), shape }
    }),
    ("a hundred curves in twenty contours", 3e-5, |rng| {
        let contours =
            (0..20).map(|i| ring(rng, p(f64::from(i % 5) * 0.4 - 0.8, f64::from(i / 5) * 0.4 - 0.6), 0.15, 5, false));
        let many = shape(contours.collect());
        let distance = rng.log_within(0.2, 4.0);
        anywhere(rng, &many, distance)
    }),
    ("near contact", 1e-5, |rng| {
        let shape = blob(rng);
        let all: Vec<_> = shape.curves().copied().collect();
        let at = all[(rng.unit() * all.len() as f64) as usize].eval(rng.unit()) * rng.within(0.0, 1.2);
        let turn = turn(rng);
        let origin = turn * -at.extend(0.0) + rng.direction() * rng.log_within(1e-4, 1e-2);
        Placed { c: images(DMat3::IDENTITY, turn, origin, 1.0), shape }
    }),
    ("horizon through a shared end point", 1e-5, |rng| {
        let shape = blob(rng);
        let all: Vec<_> = shape.curves().copied().collect();
        let at = all[(rng.unit() * all.len() as f64) as usize].p0;
        cut_at(rng, &shape, at)
    }),
];

#[test]
fn breaks_of_the_published_program_are_none_here() {
    for (name, tolerance, make) in BREAKS {
        for by in FINE {
            let mut rng = Rng(23);
            let (mut lit, mut worst, mut noticed) = (0, 0.0_f64, 0);
            for case in 0..400 {
                let placed = make(&mut rng);
                let error = placed.error(by);
                worst = worst.max(error);
                assert!(error <= tolerance, "{name}, {case} by {by:?}: off by {error:e} of {}", placed.exact());
                if (0.005..0.95).contains(&placed.exact()) {
                    lit += 1;
                    let moved = f64::from(placed.moved().by(by).value);
                    noticed += u32::from((moved - placed.exact()).abs() > tolerance);
                }
            }
            println!("{name} by {by:?}: worst {worst:.1e}, {lit} of 400 lit");
            assert!(lit >= 40, "{name}: only {lit} lit");
            // In contact it is the light's edge that counts, hardly its size.
            let share = if name == "near contact" { 0.4 } else { 0.75 };
            assert!(
                f64::from(noticed) > f64::from(lit) * share,
                "{name}: a light larger by 1 % noticed in {noticed} of {lit}"
            );
        }
    }
}

/// Taking a curve with a retracted or square handle for a line is what the published program does.
#[test]
fn a_curve_taken_for_a_line_is_noticed() {
    for (_, tolerance, make) in [BREAKS[2], BREAKS[3]] {
        let mut rng = Rng(29);
        let (mut lit, mut noticed) = (0, 0);
        for _ in 0..400 {
            let placed = make(&mut rng);
            if placed.exact() < 0.005 {
                continue;
            }
            lit += 1;
            let lines: Vec<_> =
                curves(&placed.shape, placed.square()).into_iter().map(|c| Curve { p1: c.p0, p2: c.p3, ..c }).collect();
            let value = f64::from(placed.of(&lines, FINE[0]).value);
            noticed += u32::from((value - placed.exact()).abs() > 10.0 * tolerance);
        }
        assert!(lit >= 40 && noticed * 4 > lit * 3, "{noticed} of {lit}");
    }
}

/// At the shading point itself all that is asked is a finite value; the subdivision ends at its bound.
#[test]
fn contact_is_finite_and_bounded() {
    let mut rng = Rng(31);
    let mut most = 0;
    for case in 0..2000 {
        let shape = blob(&mut rng);
        let all: Vec<_> = shape.curves().copied().collect();
        let at = all[case % all.len()].eval_exact([0.0, 0.5, rng.unit()][case % 3]);
        let turn = turn(&mut rng);
        let nudge = rng.direction() * [0.0, 1e-30, 1e-12, 1e-7][case % 4];
        let placed = Placed { c: images(DMat3::IDENTITY, turn, turn * -at.extend(0.0) + nudge, 1.0), shape };
        for by in [By::Kuge(1e-6), By::Kuge(1e-9), By::Kuge(DIFFUSE_EPS), By::Uniform(30)] {
            let sum = placed.by(by);
            assert!(sum.value.is_finite() && sum.value.abs() < 1.5, "case {case} by {by:?}: {sum:?}");
            most = most.max(sum.edges);
        }
    }
    println!("{most} edges at most");
    // More than the published stack of 12 could hold, and less than the bound for one curve.
    assert!(most > 64 && most < (2 * INTERVALS) << HALVINGS, "{most}");
}

/// Root-mean-square error and mean number of edges over the placements.
fn quality(placed: &[(Placed, f64)], by: By) -> (f64, f64) {
    let (mut squares, mut edges) = (0.0, 0.0);
    for (placed, exact) in placed {
        let sum = placed.by(by);
        squares += (f64::from(sum.value) - exact).powi(2);
        edges += f64::from(sum.edges);
    }
    let n = placed.len() as f64;
    ((squares / n).sqrt(), edges / n)
}

/// Lights over and across the horizon, each with its integral when it stands where `stands` puts it.
fn sample(stands: impl Fn(&Placed) -> Placed) -> Vec<(Placed, f64)> {
    let mut rng = Rng(41);
    let mut sample = Vec::new();
    while sample.len() < 200 {
        let shape = shape(vec![ring(&mut rng, DVec2::ZERO, 1.0, 7, false), ring(&mut rng, DVec2::ZERO, 0.3, 4, true)]);
        let distance = rng.log_within(0.4, 3.0);
        let placed = anywhere(&mut rng, &shape, distance);
        let exact = placed.exact();
        if exact > 0.01 {
            let stood = stands(&placed);
            sample.push((stood, exact));
        }
    }
    sample
}

/// Rates at which the error falls from one setting to the next, by the ratio of the settings. Prints the table and plots the
/// error's logarithm, five columns to the decade above 1e-8.
fn rates(name: &str, sample: &[(Placed, f64)], settings: &[(f64, By)]) -> Vec<f64> {
    println!("{name:>12} {:>9} {:>9} {:>6}", "rms error", "edges", "rate");
    let mut last: Option<(f64, f64)> = None;
    let mut rates = Vec::new();
    for &(setting, by) in settings {
        let (error, edges) = quality(sample, by);
        let rate = last.map(|(before, from)| (error / before).ln() / (setting / from).ln());
        println!(
            "{setting:>12.3e} {error:>9.2e} {edges:>9.1} {:>6} {}*",
            rate.map_or(String::new(), |r| format!("{r:.2}")),
            " ".repeat(((error.log10() + 8.0) * 5.0).max(0.0) as usize)
        );
        rates.extend(rate);
        last = Some((error, setting));
    }
    rates
}

fn uniform_settings() -> Vec<(f64, By)> {
    [2_u32, 4, 8, 16, 32, 64].map(|n| (f64::from(n), By::Uniform(n))).to_vec()
}

fn kuge_settings() -> Vec<(f64, By)> {
    [1e-2_f32, 1e-3, 1e-4, 1e-5, 1e-6].map(|eps| (f64::from(eps), By::Kuge(eps))).to_vec()
}

/// The chord of a smooth curve misses it by the square of the step.
#[test]
fn uniform_error_falls_with_the_square_of_the_segments() {
    let rates = rates("segments", &sample(Placed::clone), &uniform_settings());
    assert!(rates.iter().skip(1).all(|r| (-2.3..-1.7).contains(r)), "{rates:?}");
    let (error, _) = quality(&sample(Placed::clone), By::Uniform(1024));
    assert!(error < 2e-6, "{error}");
}

#[test]
fn uniform_error_of_a_moved_light_stays() {
    let rates = rates("segments", &sample(Placed::moved), &uniform_settings());
    assert!(rates.last().unwrap().abs() < 0.1, "{rates:?}");
}

/// A triangle's contribution falls with the cube of its step, n of them with the square: eps^(2/3).
#[test]
fn kuge_error_falls_with_eps() {
    let rates = rates("eps", &sample(Placed::clone), &kuge_settings());
    // Above 1e-3 it is the four steps of every curve that are seen.
    assert!(rates.iter().skip(1).all(|r| (0.55..0.75).contains(r)), "{rates:?}");
    let (error, _) = quality(&sample(Placed::clone), By::Kuge(1e-6));
    assert!(error < 2e-6, "{error}");
}

#[test]
fn kuge_error_of_a_moved_light_stays() {
    let rates = rates("eps", &sample(Placed::moved), &kuge_settings());
    assert!(rates.last().unwrap().abs() < 0.05, "{rates:?}");
}

/// Curves lie in the square, share their ends, and are lines only where the handles are on the chord.
#[test]
fn curves_share_their_ends_and_lines_are_lines() {
    let line = |c: &Curve| c.p1 == c.p0 && c.p2 == c.p3;
    let of = |c: CubicBez| {
        let shape = shape(vec![vec![c, CubicBez::line(c.p3, p(0.3, -2.0)), CubicBez::line(p(0.3, -2.0), c.p0)]]);
        curves(&shape, Square { center: DVec2::ZERO, half: 2.0 })[0]
    };
    let (a, b) = (p(0.0, 0.0), p(1.0, 0.0));
    let on_chord = CubicBez::new(a, p(0.2, 0.0), p(0.9, 1e-9), b);
    assert!(line(&of(CubicBez::line(a, b))) && line(&of(on_chord)) && line(&of(CubicBez::new(a, a, b, b))));
    for (handle, other) in [(a, p(0.5, 0.5)), (p(0.0, 0.5), b), (p(0.2, 1e-6), b), (p(-0.4, 0.0), b), (a, p(1.5, 0.0))]
    {
        assert!(!line(&of(CubicBez::new(a, handle, other, b))), "{handle} {other}");
    }
    let teardrop = shape(vec![vec![CubicBez::new(a, p(1.0, 0.3), p(1.0, -0.3), a)]]);
    assert_eq!(curves(&teardrop, Square { center: a, half: 1.0 }).len(), 1);

    let mut rng = Rng(53);
    for _ in 0..200 {
        let contours: Vec<_> = (0..3).map(|i| ring(&mut rng, p(f64::from(i) * 3.0, 1.0), 1.0, 9, i == 1)).collect();
        let shape = shape(contours);
        let mut at = 0;
        let found = curves(&shape, Square::around(shape.bounds()).unwrap());
        for contour in shape.contours() {
            let n = contour.curves().len();
            let part = &found[at..at + n];
            assert!((0..n).all(|i| part[i].p3 == part[(i + 1) % n].p0));
            assert!(part.iter().all(|c| [c.p0, c.p1, c.p2, c.p3].iter().all(|q| q.abs().max_element() <= 1.0)));
            at += n;
        }
        assert_eq!(at, found.len());
    }
}

/// What the techniques cost: lines are one edge, four steps of two edges where nothing is subdivided.
#[test]
fn edges_are_counted() {
    let arch = CubicBez::new(p(1.0, 0.0), p(1.0, 1.0), p(-1.0, 1.0), p(-1.0, 0.0));
    let arched = shape(vec![vec![arch, CubicBez::line(arch.p3, arch.p0)]]);
    let c = [DVec3::X, DVec3::NEG_Y, DVec3::Z * 2.0];
    let placed = Placed { c, shape: arched };
    assert_eq!(placed.by(By::Uniform(30)).edges, 31);
    assert_eq!(placed.by(By::Kuge(DIFFUSE_EPS)).edges, 2 * INTERVALS + 1);
    let mut last = 0;
    for eps in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        let edges = placed.by(By::Kuge(eps)).edges;
        assert!(edges >= last, "{eps}: {edges} after {last}");
        last = edges;
    }
    assert!(last > 100, "{last}");
    // Whole below the horizon: nothing at all.
    let below = Placed { c: [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z * 2.0], ..placed.clone() };
    assert_eq!(below.by(By::Uniform(30)), EdgeSum::default());
    let square = shape(vec![closed(&[p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)])]);
    let square = Placed { c, shape: square };
    assert_eq!((square.by(By::Kuge(1e-6)).edges, square.by(By::Uniform(64)).edges), (4, 4));
    assert!((f64::from(square.by(By::Uniform(64)).value) - square.exact()).abs() < 1e-6);
}
