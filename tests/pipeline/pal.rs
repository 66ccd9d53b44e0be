//! Petryaev's polygons: areas against the yardstick, distances against geometry, and every awkward place.

use crate::cases::{Rng, blob};
use glam::{DMat3, DVec2, DVec3, Vec2};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::map::CosineMap;
use glyphlight::kernel::pal::{BIASED, CENTRED, PHI, WEIGHTED, pal_diffuse, pal_specular};
use glyphlight::light::Square;
use glyphlight::light::distance::Polygons;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::shape::{CubicBez, Shape};
use std::f64::consts::PI;

const BASES: [(&str, u32); 3] = [("centred", CENTRED), ("weighted", WEIGHTED), ("biased", BIASED)];

fn square(shape: &Shape) -> Square {
    Square::around(shape.bounds()).unwrap()
}

fn baked(shape: &Shape) -> Polygons {
    Polygons::new(shape, square(shape), DVec2::ONE)
}

fn map(shape: &Shape, c: [DVec3; 3]) -> Option<CosineMap> {
    let Square { center, half } = square(shape);
    CosineMap::new(c, center, half)
}

/// The images of a light whose middle is `distance` away along the direction at `light_angle` from the surface's
/// normal, turned by `own_angle` from facing the point.
fn placed(distance: f64, light_angle: f64, own_angle: f64) -> [DVec3; 3] {
    let turn = DMat3::from_rotation_y(light_angle);
    let own = turn * DMat3::from_rotation_y(PI + own_angle);
    [own.x_axis, own.y_axis, turn * DVec3::Z * distance]
}

fn diffuse(shape: &Shape, polygons: &Polygons, c: [DVec3; 3], basis: u32) -> f64 {
    map(shape, c).map_or(0.0, |map| f64::from(pal_diffuse(&map, polygons.view(), basis).value))
}

fn exact(shape: &Shape, c: [DVec3; 3]) -> f64 {
    exact_integral(&ExactMap { c, horizon: None }, shape)
}

fn hexagon() -> Shape {
    let corner = |i: i32| DVec2::from_angle(f64::from(i) * PI / 3.0);
    let corners: Vec<DVec2> = (0..6).map(corner).collect();
    Shape::from_contours(vec![(0..6).map(|i| CubicBez::line(corners[i], corners[(i + 1) % 6])).collect()]).unwrap()
}

fn letter(text: &str) -> Shape {
    layout(text, &[Font::bundled("DejaVu Sans").unwrap()], &TextStyle::default()).unwrap().shape
}

#[test]
fn far_straight_above_it_is_the_irradiance() {
    // Ten half-widths away along the normal, whichever way the light is turned: the basis hardly matters, the area is the
    // solid angle. Biased, the light seems farther by its circle's radius, so it has to be farther still.
    let mut rng = Rng(21);
    let shapes: Vec<Shape> = (0..12).map(|_| blob(&mut rng)).chain([hexagon(), letter("&"), letter("B")]).collect();
    for (name, basis) in BASES {
        let (distance, tolerance) = if basis == BIASED { (400.0, 0.01) } else { (12.0, 0.012) };
        let mut worst = 0.0_f64;
        for shape in &shapes {
            let polygons = baked(shape);
            let Square { center, half } = square(shape);
            for own in [0.0, 0.4, 1.0, 1.3] {
                let [x, y, _] = placed(1.0, 0.0, own).map(|v| v / half);
                let middle = DVec3::Z * distance;
                let c = [x, y, middle - x * center.x - y * center.y];
                let (value, truth) = (diffuse(shape, &polygons, c, basis), exact(shape, c));
                worst = worst.max((value / truth - 1.0).abs());
                let nearer = [c[0], c[1], c[2] - DVec3::Z * (0.02 * distance)];
                let moved = diffuse(shape, &polygons, nearer, basis) / truth - 1.0;
                assert!(moved > tolerance, "{name}: a light nearer by 2 % is the same: {moved}");
            }
        }
        println!("pal {name}, {distance} half-widths above: worst error {:.2} %", 100.0 * worst);
        assert!(worst < tolerance, "{name}: {worst}");
    }
}

#[test]
fn where_it_is_not_the_irradiance() {
    let shape = hexagon();
    let polygons = baked(&shape);
    println!("pal over exact, hexagon of radius 1; angle of the light from the surface's normal, and its own turn");
    println!("distance  angle  turn    exact   centred  weighted  biased");
    let ratio = |distance: f64, angle: f64, turn: f64| {
        let c = placed(distance, angle.to_radians(), turn.to_radians());
        let truth = exact(&shape, c);
        let ratios = BASES.map(|(_, basis)| diffuse(&shape, &polygons, c, basis) / truth);
        println!("{distance:8} {angle:6} {turn:5} {truth:9.5}  {:7.3} {:8.3} {:8.3}", ratios[0], ratios[1], ratios[2]);
        ratios
    };
    for angle in [0.0, 30.0, 60.0, 80.0] {
        // No cosine at the surface: too bright by 1/cos.
        let [centred, weighted, _] = ratio(50.0, angle, 0.0);
        let expected = 1.0 / angle.to_radians().cos();
        assert!((centred / expected - 1.0).abs() < 0.01 && (weighted / expected - 1.0).abs() < 0.01, "{angle}");
    }
    for distance in [0.1, 0.3, 1.0, 3.0] {
        // Near, the area runs to infinity where the irradiance ends at 1; in front of a light that is level with the surface,
        // the circle's lower half counts as below the horizon. Biased, the light seems farther away.
        let [centred, _, biased] = ratio(distance, 0.0, 0.0);
        assert!(if distance < 1.0 { centred < 0.8 } else { centred > 1.05 }, "{distance}");
        assert!(biased < 0.7, "{distance}");
    }
    for turn in [30.0, 60.0, 80.0] {
        // Turned away: seen edge-on, near.
        let [centred, weighted, _] = ratio(1.5, 0.0, turn);
        assert!(centred > 1.0 && weighted > 1.0, "{turn}");
    }
    for angle in [60.0, 80.0, 90.0, 100.0] {
        // Through the horizon: local occlusion is linear in the height of the circle.
        ratio(1.5, angle, 0.0);
    }
}

#[test]
fn local_occlusion_is_the_share_of_the_diameter_above() {
    let shape = hexagon();
    let polygons = baked(&shape);
    let at = |height: f64| {
        let mut c = placed(100.0, PI / 2.0, 0.0);
        c[2].z += height;
        diffuse(&shape, &polygons, c, CENTRED)
    };
    let whole = at(1.0);
    for height in [-1.1, -1.0, -0.5, 0.0, 0.5] {
        let share = f64::midpoint(height, 1.0).max(0.0);
        let value = at(height) / whole;
        assert!((value - share).abs() < 2e-3, "{height}: {value}");
    }
    assert!(at(-1.1) == 0.0 && at(0.5) > 1.2 * at(0.0));
}

#[test]
fn an_area_by_any_cut_is_the_area() {
    // Near lights that reach behind the basis: the area does not depend on how the contour is cut into edges.
    let mut rng = Rng(5);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
    let sides = |parts: usize| -> Vec<CubicBez> {
        let side = |i: usize| (corners[i], corners[(i + 1) % 4]);
        let point = |i: usize, k: usize| side(i).0.lerp(side(i).1, k as f64 / parts as f64);
        let part = |i: usize, k: usize| {
            let end = if k + 1 == parts { side(i).1 } else { point(i, k + 1) };
            CubicBez::line(if k == 0 { side(i).0 } else { point(i, k) }, end)
        };
        (0..4).flat_map(|i| (0..parts).map(move |k| part(i, k)).collect::<Vec<_>>()).collect()
    };
    let [whole, cut] = [1, 7].map(|parts| Shape::from_contours(vec![sides(parts)]).unwrap());
    let [of_whole, of_cut] = [&whole, &cut].map(baked);
    let mut clipped = 0;
    for _ in 0..3000 {
        let turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
        let c = [turn.x_axis, turn.y_axis, rng.direction() * rng.log_within(0.02, 2.0)];
        let [a, b] = [diffuse(&whole, &of_whole, c, CENTRED), diffuse(&cut, &of_cut, c, CENTRED)];
        assert!((a - b).abs() < 1e-4 * a.max(0.1), "{c:?}: {a}, {b}");
        clipped += usize::from(a > 0.0 && a < 1.0);
    }
    assert!(clipped > 500, "{clipped}");
}

#[test]
fn the_baked_distance_is_the_distance() {
    let mut rng = Rng(9);
    for shape in [blob(&mut rng), blob(&mut rng), hexagon(), letter("B")] {
        let polygons = baked(&shape);
        let p = &polygons.polygons[0];
        let edges = &polygons.edges[p.first as usize..p.end as usize];
        for _ in 0..4000 {
            let [i, j] = [0; 2].map(|_| (rng.unit() * f64::from(p.side)) as u32);
            let at = (Vec2::new(i as f32, j as f32) + 0.5) * 2.0 / p.side as f32 - 1.0;
            let q = p.circle.as_dvec2() + at.as_dvec2() * f64::from(PHI * p.radius);
            let (mut nearest, mut winding) = (f64::INFINITY, 0.0);
            for edge in edges.iter().map(|e| e.as_dvec4()) {
                let (a, b) = (DVec2::new(edge.x, edge.y) - q, DVec2::new(edge.z, edge.w) - q);
                let u = b - a;
                nearest = nearest.min((a + u * (-a.dot(u) / u.length_squared()).clamp(0.0, 1.0)).length());
                winding += a.angle_to(b);
            }
            let sign = if (winding / (2.0 * PI)).round() != 0.0 { -1.0 } else { 1.0 };
            let expected = sign * nearest / f64::from(p.radius);
            let stored = f64::from(polygons.texels[(p.texels + j * p.side + i) as usize]);
            assert!((stored - expected).abs() < 1e-5, "{i} {j}: {stored}, {expected}");
        }
        // A texture of another shape is another one.
        let other = baked(&blob(&mut rng));
        let off = |k: &usize| (other.texels[*k] - polygons.texels[*k]).abs() > 1e-2;
        assert!((0..1000).map(|k| k * 200).filter(off).count() > 100);
    }
}

#[test]
fn holes_go_with_their_contours() {
    // "B" has two holes, "i" two outer contours, "®" a ring with an "R" with a hole in it.
    for (text, expected) in [("B", vec![2]), ("i", vec![0, 0]), ("O8", vec![1, 2]), ("®", vec![1, 1])] {
        let shape = letter(text);
        let polygons = baked(&shape);
        let mut holes: Vec<usize> = Vec::new();
        let mut area = 0.0;
        for p in &polygons.polygons {
            let mut starts = 0;
            for (k, edge) in polygons.edges[p.first as usize..p.end as usize].iter().enumerate() {
                let inner = p.first as usize + k >= p.outer as usize;
                let before = polygons.edges[(p.first as usize + k).max(1) - 1];
                starts += usize::from(inner && (before.z, before.w) != (edge.x, edge.y));
                area += f64::from(edge.x * edge.w - edge.y * edge.z) * 0.5;
            }
            holes.push(starts);
        }
        holes.sort_unstable();
        assert_eq!(holes, expected, "{text}");
        let expected = shape.area() / square(&shape).half.powi(2);
        assert!((area / expected - 1.0).abs() < 2e-3, "{text}: {area}, {expected}");
    }
}

fn specular(shape: &Shape, polygons: &Polygons, c: [DVec3; 3], alpha: f32, cos_theta: f32) -> f32 {
    map(shape, c).map_or(0.0, |map| pal_specular(&map, polygons.view(), alpha, cos_theta).value)
}

#[test]
fn the_reflection_follows_the_formula() {
    let shape = hexagon();
    let polygons = baked(&shape);
    // Straight above at a height of 2; the mirror ray of a view at cos θ meets the plane at x = −2 tan θ, and the light is
    // moved so that the place is `beyond` outside its right side (apothem √3/2), level with its middle.
    let radius = 1.0;
    for (alpha, cos_theta) in [(0.01_f32, 1.0_f32), (0.09, 0.9), (0.25, 0.7), (1.0, 0.8)] {
        for beyond in [-0.5, -0.1, 0.1, 0.3, 0.6, 0.8] {
            let place = DVec2::from_angle(PI / 6.0) * (3.0_f64.sqrt() / 2.0 + beyond);
            let tan = f64::from((1.0 - cos_theta * cos_theta).sqrt() / cos_theta);
            // Seen from in front, light-space x runs against the frame's.
            let origin = DVec3::new(-2.0 * tan + place.x, -place.y, 2.0);
            let c = [-DVec3::X, DVec3::Y, origin];
            let value = f64::from(specular(&shape, &polygons, c, alpha, cos_theta));
            let exponent = 100.0 * (1.0 - f64::from(alpha).sqrt());
            let rim = 1.0 - place.length() / (f64::from(PHI) * radius);
            let fade = (radius * f64::from(cos_theta) / 2.0).min(1.0) * rim.max(0.0);
            let expected = fade * (1.0 + beyond.max(0.0) / radius).powf(-exponent);
            assert!((value - expected).abs() < 5e-3 * fade + 1e-6, "{alpha} {beyond}: {value}, {expected}");
            let rougher = f64::from(specular(&shape, &polygons, c, alpha.sqrt(), cos_theta));
            assert!(!(0.1..=0.7).contains(&beyond) || alpha == 1.0 || rougher > value, "{alpha} {beyond}");
        }
    }
}

#[test]
fn it_is_total() {
    let mut rng = Rng(17);
    let shapes = [hexagon(), letter("&"), blob(&mut rng)];
    let all: Vec<Polygons> = shapes.iter().map(baked).collect();
    let (mut lit, mut mirrored) = (0, 0);
    for i in 0..60_000 {
        let (shape, polygons) = (&shapes[i % 3], &all[i % 3]);
        let Square { center, half } = square(shape);
        let mut turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
        let mut middle = rng.direction() * rng.log_within(1e-7, 1e4);
        match (rng.unit() * 5.0) as u32 {
            // Almost in the light's plane; the light square to the surface, or level with it.
            0 => middle -= turn.z_axis * (middle.dot(turn.z_axis) - 1e-9),
            1 => turn = DMat3::from_rotation_x(PI / 2.0),
            2 => turn = DMat3::from_rotation_x(PI),
            _ => {}
        }
        let scale = rng.log_within(1e-5, 1e5) / half;
        let (x, y) = (turn.x_axis * scale, turn.y_axis * scale);
        let c = [x, y, middle * scale - x * center.x - y * center.y];
        for (name, basis) in BASES {
            let value = diffuse(shape, polygons, c, basis);
            assert!(value.is_finite() && (0.0..=8.0).contains(&value), "{name} {c:?}: {value}");
            lit += usize::from(value > 0.0);
        }
        for alpha in [0.0, 1e-4, 0.3, 1.0] {
            for cos_theta in [0.0, 1e-6, 0.5, 1.0] {
                let value = specular(shape, polygons, c, alpha, cos_theta);
                assert!(value.is_finite() && (0.0..=8.0).contains(&value), "{c:?} {alpha} {cos_theta}: {value}");
                mirrored += usize::from(value > 0.0);
            }
        }
    }
    assert!(lit > 50_000 && mirrored > 10_000, "{lit} {mirrored}");
}
