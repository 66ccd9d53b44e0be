//! Masks, prefiltered pictures, the fetch, and the integral of a rectangle.

use crate::cases::{Rng, images, wide};
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};
use glyphlight::backend::exact::{ExactMap, exact_integral};
use glyphlight::kernel::horizon::{Clip, Clipped};
use glyphlight::kernel::map::{CosineMap, PlanePoint};
use glyphlight::kernel::picture::{Footprint, Level, fetch, unpack};
use glyphlight::kernel::quad::{Quad, quad_integral};
use glyphlight::kernel::wide::{Wide, Wide2};
use glyphlight::light::mask::{light_picture, shape_picture};
use glyphlight::light::prefilter::Prefiltered;
use glyphlight::light::{Layer, Square};
use glyphlight::outline::bundled::bundled;
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::picture::Picture;
use glyphlight::shape::{CubicBez, Shape};
use std::sync::Arc;

fn text_in(words: &str, family: &str) -> Option<Shape> {
    let font = Font::bundled(family).unwrap();
    layout(words, &[font], &TextStyle { size: 1.0, ..TextStyle::default() }).ok().map(|text| text.shape)
}

pub fn text(words: &str) -> Shape {
    text_in(words, "DejaVu Sans").unwrap()
}

pub fn layer(shape: Shape, radiance: DVec3) -> Layer {
    Layer { shape, radiance, opacity: 1.0, picture: None }
}

pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Shape {
    Shape::rectangle(low.into(), high.into())
}

fn mask(shape: &Shape, size: u32) -> Picture {
    light_picture(&[layer(shape.clone(), DVec3::ONE)], size).unwrap()
}

fn mean(picture: &Picture) -> f64 {
    picture.texels.iter().map(|t| f64::from(t.x)).sum::<f64>() / picture.texels.len() as f64
}

#[test]
fn a_mask_weighs_what_its_shape_weighs() {
    let mut checked = 0;
    for font in bundled() {
        for letter in ["&", "g", "8", "Å", "W", "ﷺ", "光"] {
            let Some(shape) = text_in(letter, font.family).filter(|s| s.area() > 0.0) else { continue };
            let area = shape.extent().size();
            let expected = shape.area() / (area.x * area.y);
            for size in [64, 200, 512] {
                let error = (mean(&mask(&shape, size)) - expected).abs();
                assert!(error < 1e-3, "{letter} of {} at {size}: {error}", font.family);
                checked += 1;
            }
            // A hundredth of the box more is too much.
            let corner = shape.extent().min;
            let more = layer(Shape::rectangle(corner, corner + area * 0.1), DVec3::ONE);
            let picture = light_picture(&[layer(shape, DVec3::ONE), more], 200).unwrap();
            assert!((mean(&picture) - expected).abs() > 5e-3);
        }
    }
    assert!(checked > 60, "{checked}");
}

/// The box of the curves, not that of the handles.
#[test]
fn a_mask_ends_where_the_shape_ends() {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let arch = CubicBez::new(p(1.0, 0.0), p(1.0, 4.0), p(-1.0, 4.0), p(-1.0, 0.0));
    let shape = Shape::from_contours(vec![vec![CubicBez::line(p(-1.0, 0.0), p(1.0, 0.0)), arch]]).unwrap();
    let bounds = shape.extent();
    assert!((bounds.min - p(-1.0, 0.0)).length() < 1e-12 && (bounds.max - p(1.0, 3.0)).length() < 1e-12);
    assert!(shape.bounds().max.y > 3.9);
    let mask = mask(&shape, 90);
    assert_eq!((mask.width, mask.height), (60, 90));
    let coverage = |x: usize, y: usize| mask.texels[y * 60 + x].x;
    // The apex in the first row, the foot in the last.
    assert!(coverage(30, 0) > 0.5 && coverage(0, 89) > 0.9 && coverage(0, 0) == 0.0);
}

#[test]
fn a_rectangle_is_one_throughout() {
    let radiance = DVec3::new(3.0, 0.1, 7e5);
    for (low, high) in [
        ([0.0, 0.0], [1.0, 1.0]),
        ([-0.3, 2.1], [7.7, 2.9]),
        ([1e4, 0.0], [1.00001e4, 0.37]),
        ([0.0, 0.0], [1.0, 1e-15]),
    ] {
        for size in [4, 37, 512] {
            let shape = rectangle(low, high);
            let picture = light_picture(&[layer(shape.clone(), radiance)], size).unwrap();
            let sent = radiance.as_vec3();
            assert!(picture.texels.iter().all(|t| *t == sent.extend(1.0)), "{low:?} {size}");
            let filtered = Prefiltered::new(&picture, &Square::around(shape.extent()).unwrap());
            assert_eq!(filtered.peak, sent);
            assert!(filtered.texels.iter().all(|&t| unpack(t) == Vec3::ONE), "{low:?} {size}");
        }
    }
    let with_hole = text("O");
    assert!(!mask(&with_hole, 64).texels.iter().all(|t| *t == Vec4::ONE));
}

/// A prefiltered mask and what it was made of.
struct Case {
    picture: Picture,
    square: Square,
    filtered: Prefiltered,
}

impl Case {
    fn new(picture: Picture) -> Self {
        let bounds = glyphlight::shape::Bounds { min: picture.low, max: picture.high };
        let square = Square::around(bounds).unwrap();
        Self { filtered: Prefiltered::new(&picture, &square), picture, square }
    }

    fn fetch(&self, place: Vec2, variance: f32) -> Vec3 {
        fetch(&self.filtered.levels, &self.filtered.texels, &Footprint { place, variance })
    }

    /// All texels of a level: place in light space and value.
    fn texels(&self, level: &Level) -> impl Iterator<Item = (DVec2, Vec3)> {
        let (width, height) = (level.size & 0xffff, level.size >> 16);
        (0..width * height).map(move |i| {
            let cell = DVec2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let part = cell / DVec2::new(f64::from(width), f64::from(height));
            let place = level.low.as_dvec2() + part / level.per_unit.as_dvec2();
            let color = unpack(self.filtered.texels[(level.offset + i) as usize]) * self.filtered.peak;
            (self.square.center + place * self.square.half, color)
        })
    }

    /// The mean under a Gaussian cut to the picture, texel by texel.
    fn by_force(&self, at: DVec2, sigma: f64) -> DVec3 {
        let Picture { width, height, ref texels, low, high } = self.picture;
        let texel = (high - low) / DVec2::new(f64::from(width), f64::from(height));
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for (i, color) in texels.iter().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let p = DVec2::new(low.x + (f64::from(x) + 0.5) * texel.x, high.y - (f64::from(y) + 0.5) * texel.y);
            let w = (-(p - at).length_squared() / (2.0 * sigma * sigma)).exp();
            sum += color.truncate().as_dvec3() * w;
            weight += f64::from(color.w) * w;
        }
        sum / weight
    }
}

/// A level against Gaussians by force, whose variance is `variance(σ² of the level, squared distance to the light)`: the
/// largest difference inside the light, and the RMS over the margin.
fn level_errors(case: &Case, level: &Level, variance: impl Fn(f64, f64) -> f64) -> [f64; 2] {
    let Picture { low, high, .. } = case.picture;
    let (mut inside, mut outside, mut count) = (0.0_f64, 0.0, 0.0);
    for (at, color) in case.texels(level).step_by(7) {
        let distance = (at - at.clamp(low, high)).length();
        let sigma = variance(f64::from(level.variance) * case.square.half.powi(2), distance * distance).sqrt();
        let error = f64::from(color.x) - case.by_force(at, sigma).x;
        if distance > 0.0 {
            outside += error * error;
            count += 1.0;
        } else {
            inside = inside.max(error.abs());
        }
    }
    [inside, (outside / count).sqrt()]
}

#[test]
fn levels_are_gaussians_cut_to_the_light() {
    let case = Case::new(mask(&text("&"), 48));
    for level in &case.filtered.levels[1..] {
        let [inside, outside] = level_errors(&case, level, |own, squared| own + squared);
        println!("σ {:.4}: inside {inside:.1e}, outside {outside:.1e}", level.variance.sqrt());
        assert!(inside < 1e-3 && outside < 0.04, "σ {}: {inside}, {outside}", level.variance.sqrt());
    }
    // A wider kernel, and one that does not grow.
    let level = &case.filtered.levels[2];
    assert!(level_errors(&case, level, |own, squared| 1.2 * own + squared)[0] > 5e-3);
    let [_, outside] = level_errors(&case, level, |own, _| own);
    assert!(outside > 0.08, "{outside}");
}

#[test]
fn the_widest_level_is_the_mean() {
    for words in ["&", "Light on the floor"] {
        let case = Case::new(mask(&text(words), 256));
        let mean = mean(&case.picture) as f32;
        let last = case.filtered.levels.last().unwrap();
        assert_eq!(last.coarser, 0);
        let error = case.texels(last).map(|(_, c)| (c.x - mean).abs()).fold(0.0, f32::max);
        assert!(error < 0.01 * mean, "{words}: {error}");
        let finer = &case.filtered.levels[case.filtered.levels.len() - 5];
        assert!(case.texels(finer).any(|(_, c)| (c.x - mean).abs() > 0.01 * mean));
    }
}

/// Two rectangles that leave the middle of their box dark.
fn two_bars() -> Shape {
    let mut bars = rectangle([-1.0, -0.6], [-0.4, 0.6]);
    bars.append(rectangle([0.2, -0.6], [1.0, 0.6]));
    bars
}

#[test]
fn a_wider_footprint_is_smoother() {
    let case = Case::new(mask(&two_bars(), 128));
    let contrast = |v: f32| case.fetch(Vec2::new(0.5, 0.1), v).x - case.fetch(Vec2::new(-0.1, 0.1), v).x;
    let contrasts: Vec<f32> = (0..400).map(|i| contrast(1e-8 * 10.0_f32.powf(i as f32 * 0.03))).collect();
    assert!(contrasts[0] > 0.999 && contrasts[399].abs() < 0.01);
    for pair in contrasts.windows(2) {
        // Falls, and without a jump where the level changes; 16-bit texels are right to 5e-4.
        assert!(pair[1] <= pair[0] + 5e-4 && pair[1] > pair[0] - 0.06, "{pair:?}");
    }
    // It is the place that counts too.
    let along = [0.18, 0.22, 0.25].map(|x| case.fetch(Vec2::new(x, 0.1), 1e-4).x);
    assert!(along[0] < 0.1 && along[1] > 0.9 && along[2] > 0.999, "{along:?}");
}

/// Walks along a line over the light, the margin and beyond for jumps.
#[test]
fn there_is_no_seam() {
    let case = Case::new(mask(&two_bars(), 128));
    for sigma in [0.02_f32, 0.0651, 0.2, 0.7] {
        let (mut worst, mut last) = (0.0_f32, None::<f32>);
        for i in 0..4000 {
            let here = case.fetch(Vec2::new(0.7, -2.0 + 1e-3 * i as f32), sigma * sigma).x;
            worst = worst.max(last.map_or(0.0, |l| (here - l).abs()));
            last = Some(here);
        }
        // No step is steeper than the steepest Gaussian edge.
        assert!(worst < 0.5 * 1e-3 / sigma + 5e-4, "σ {sigma}: {worst}");
    }
}

pub fn two_colors(low: DVec2, high: DVec2) -> Picture {
    let red_and_blue = |i: u32| if i % 16 < 8 { Vec4::new(0.8, 0.0, 0.0, 1.0) } else { Vec4::new(0.0, 0.0, 0.4, 1.0) };
    Picture { width: 16, height: 4, texels: (0..64).map(red_and_blue).collect(), low, high }
}

#[test]
fn colors_bleed_outward_and_never_darken() {
    let mut shape = text("&");
    shape.append(rectangle([0.9, 0.0], [0.905, 0.4]));
    let bounds = shape.extent();
    let case = Case::new(shape_picture(&shape, &two_colors(bounds.min, bounds.max), 100).unwrap());
    assert!((case.filtered.peak - Vec3::new(0.8, 0.0, 0.4)).abs().max_element() < 1e-6);
    for texel in case.filtered.texels.iter().copied().map(unpack) {
        // A mix of the two, however far from the contour and through every hole.
        assert!((texel.x + texel.z - 1.0).abs() < 1e-3 && texel.y == 0.0, "{texel}");
    }
    let reds = case.filtered.texels.iter().filter(|&&t| unpack(t).x > 0.99).count();
    assert!(reds > 100 && reds < case.filtered.texels.len());
    // As a quad's mask the same picture is dark between the letters.
    let painted = Layer { picture: Some(Arc::new(two_colors(bounds.min, bounds.max))), ..layer(shape, DVec3::ONE) };
    let quad = Case::new(light_picture(&[painted], 100).unwrap());
    assert!(quad.filtered.texels.iter().any(|&t| unpack(t).dot(Vec3::ONE) < 0.01));
}

/// A light's rectangle, lobe and place.
fn placed(rng: &mut Rng) -> ([DVec3; 3], DVec2) {
    let turn = DMat3::from_rotation_z(rng.within(-3.0, 3.0)) * DMat3::from_rotation_x(rng.within(-3.0, 3.0));
    let origin = rng.direction() * rng.log_within(0.01, 30.0);
    let alpha = rng.log_within(3e-3, 1.0);
    let m = DMat3::from_rotation_y(rng.within(-1.5, 0.0)) * DMat3::from_diagonal(DVec3::new(alpha, alpha, 1.0));
    let m_inv = if rng.unit() < 0.3 { DMat3::IDENTITY } else { m.inverse() };
    (images(m_inv, turn, origin, 1.0), DVec2::new(1.0, rng.log_within(0.02, 1.0)))
}

fn map_of(c: [DVec3; 3]) -> Option<CosineMap> {
    CosineMap::new(c, DVec2::ZERO, 1.0).filter(|map| map.depth > 0.0)
}

#[test]
fn the_rectangle_is_that_of_the_yardstick() {
    let mut rng = Rng(41);
    let (mut lit, mut noticed, mut worst) = (0, 0, 0.0_f64);
    for case in 0..6000 {
        let (c, half) = placed(&mut rng);
        let Some(map) = map_of(c) else { continue };
        let value = |half: DVec2| {
            let quad = Quad::new(half);
            if map.is_close() {
                let (map, _) = CosineMap::<Wide>::of::<Wide>(c.map(wide), DVec2::ZERO, 1.0);
                let middle = Wide2::of(-map.foot.x(), -map.foot.y());
                let Clipped { clip, below } = Clip::of(&map, None, middle, middle.fixed(quad.half));
                return if below { 0.0 } else { quad_integral(&map, &clip, &quad).0 };
            }
            Clip::new(&map, None, -map.foot, quad.half).map_or(0.0, |clip| f64::from(quad_integral(&map, &clip, &quad)))
        };
        let exact = exact_integral(&ExactMap { c, horizon: None }, &Shape::rectangle(-half, half));
        let error = (value(half) - exact).abs();
        assert!(error < 1e-6, "{case}: {} for {exact}", value(half));
        worst = worst.max(error);
        if (0.02..0.8).contains(&exact) {
            lit += 1;
            noticed += u32::from((value(half * DVec2::new(1.0, 1.01)) - exact).abs() > 1e-5);
        }
    }
    println!("worst {worst:.1e} of {lit}");
    assert!(lit > 200 && noticed * 10 > lit * 8, "{noticed} of {lit}");
}

#[test]
fn the_footprint_is_the_projection_of_the_origin() {
    let mut rng = Rng(43);
    let mut far = 0;
    for case in 0..20_000 {
        let (c, _) = placed(&mut rng);
        let Some(map) = map_of(c) else { continue };
        let normal = c[0].cross(c[1]);
        let nearest = normal * (normal.dot(c[2]) / normal.length_squared());
        // nearest = c0·x + c1·y + c2.
        let solve = DMat3::from_cols(c[0], c[1], normal).inverse() * (nearest - c[2]);
        let variance = nearest.length_squared() / (2.0 * normal.length());
        let found = Footprint::new(&map);
        // A hundredth of a texel of the sharpest level there is for that variance.
        let allowed = 1e-3 * variance.sqrt() + 1e-6 * solve.truncate().length();
        let off = (found.place.as_dvec2() - solve.truncate()).length();
        assert!(off <= allowed, "{case}: {} for {solve}, σ {}", found.place, variance.sqrt());
        assert!((f64::from(found.variance) / variance - 1.0).abs() < 1e-4, "{case}: {} for {variance}", found.variance);
        far += u32::from(solve.x.abs() > 2.0);
    }
    assert!(far > 1000, "{far}");
}

/// Nothing makes the fetch leave the colours there are.
#[test]
fn the_fetch_is_total() {
    let case = Case::new(mask(&text("&"), 32));
    let mut rng = Rng(47);
    let mut spicy = vec![0.0_f32, -0.0, 1.0, -1.0, 1e-30, 1e-38, 1e30, 3e38, f32::INFINITY, f32::NAN];
    spicy.extend((0..6).map(|_| rng.within(-2.0, 2.0) as f32));
    let any = |rng: &mut Rng| spicy[(rng.unit() * spicy.len() as f64) as usize];
    for _ in 0..20_000 {
        let mut vector = || Vec3::new(any(&mut rng), any(&mut rng), any(&mut rng));
        let (c0, c1, c2, normal) = (vector(), vector(), vector(), vector());
        let map = CosineMap {
            foot: vector().truncate(),
            c0,
            c1,
            c2,
            normal,
            w0: vector(),
            w1: vector(),
            depth: vector().x,
            gram: vector().to_array(),
        };
        let color = fetch(&case.filtered.levels, &case.filtered.texels, &Footprint::new(&map));
        assert!((0.0..=1.0).contains(&color.x), "{color} for {map:?}");
    }
}
