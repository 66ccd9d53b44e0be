//! Gradients against their definition, point by point, and against tiny-skia's shaders.

use super::{drawing, linear, off, read, shown};
use crate::cases::Rng;
use crate::svg::options;
use glam::{DAffine2, DVec2, DVec4};
use glyphlight::outline::svg::svg;
use tiny_skia::{
    Color, GradientStop, LinearGradient, Paint, Pixmap, Point, RadialGradient, Rect, SpreadMode, Transform,
};

/// A gradient of user space.
#[derive(Clone, Debug)]
struct Case {
    /// (x1, y1), (x2, y2) or focus, centre.
    ends: [DVec2; 2],
    /// Radii about focus and centre.
    radii: Option<[f64; 2]>,
    spread: &'static str,
    transform: DAffine2,
    /// Offset, sRGB and alpha.
    stops: Vec<(f64, DVec4)>,
}

impl Case {
    fn random(rng: &mut Rng, radial: bool, spread: &'static str) -> Self {
        let mut point = |lo: f64, hi: f64| DVec2::new(rng.within(lo, hi), rng.within(lo, hi));
        let (a, b) = (point(10.0, 45.0), point(55.0, 90.0));
        let center = point(35.0, 65.0);
        let (turn, stretch) = (rng.within(-0.6, 0.6), rng.within(0.7, 1.4));
        let about = DVec2::splat(50.0);
        let transform = DAffine2::from_translation(about)
            * DAffine2::from_scale_angle_translation(DVec2::new(stretch, 1.0), turn, DVec2::ZERO)
            * DAffine2::from_translation(-about);
        let n = 2 + (rng.unit() * 3.0) as usize;
        // Eight bits, so that the drawing says the same as the case.
        let byte = |v: f64| (v * 255.0).round() / 255.0;
        let mut color = || DVec4::new(byte(rng.unit()), byte(rng.unit()), byte(rng.unit()), byte(rng.within(0.3, 1.0)));
        let colors: Vec<_> = (0..n).map(|_| color()).collect();
        let stops = (0..n)
            .map(|i| (0.05 + 0.9 * (i as f64 + rng.within(-0.2, 0.2)).clamp(0.0, n as f64) / n as f64, colors[i]));
        let stops = stops.collect();
        let radii = radial.then(|| [rng.within(0.0, 5.0), rng.within(25.0, 60.0)]);
        let ends = if radial {
            [center + DVec2::from_angle(rng.within(0.0, std::f64::consts::TAU)) * rng.within(0.0, 15.0), center]
        } else {
            [a, b]
        };
        Self { ends, radii, spread, transform, stops }
    }

    fn svg(&self) -> String {
        let [a, b] = self.ends;
        let place = match self.radii {
            None => format!("linearGradient id='g' x1='{}' y1='{}' x2='{}' y2='{}'", a.x, a.y, b.x, b.y),
            Some([fr, r]) => {
                format!("radialGradient id='g' cx='{}' cy='{}' r='{r}' fx='{}' fy='{}' fr='{fr}'", b.x, b.y, a.x, a.y)
            }
        };
        let name = place.split(' ').next().unwrap();
        let m = self.transform.to_cols_array().map(|v| v.to_string()).join(" ");
        let stop = |&(offset, c): &(f64, DVec4)| {
            let [r, g, b] = [c.x, c.y, c.z].map(|v| (v * 255.0).round() as u8);
            format!("<stop offset='{offset}' stop-color='rgb({r},{g},{b})' stop-opacity='{}'/>", c.w)
        };
        let stops: String = self.stops.iter().map(stop).collect();
        format!(
            "<{place} gradientUnits='userSpaceOnUse' spreadMethod='{}' gradientTransform='matrix({m})'>{stops}</{name}>
             <rect width='100' height='100' fill='url(#g)'/>",
            self.spread
        )
    }

    /// The parameter at a point, by its definition; solved by bisection for radial ones.
    fn parameter(&self, p: DVec2) -> f64 {
        let p = self.transform.inverse().transform_point2(p);
        let [a, b] = self.ends;
        let Some([fr, r]) = self.radii else { return (p - a).dot(b - a) / (b - a).length_squared() };
        // How far p lies outside of the circle of parameter t; falls with t, as each circle lies in the next.
        let outside = |t: f64| (p - a.lerp(b, t)).length() - (fr + t * (r - fr));
        let (mut low, mut high) = (-fr / (r - fr), 100.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if outside(middle) > 0.0 { low = middle } else { high = middle }
        }
        low
    }

    /// The colour at a point, by SVG's rules: sRGB, not premultiplied, between stops.
    fn color(&self, p: DVec2) -> DVec4 {
        let t = self.parameter(p);
        let t = match self.spread {
            "pad" => t.clamp(0.0, 1.0),
            "repeat" => t.rem_euclid(1.0),
            _ => 1.0 - (t.rem_euclid(2.0) - 1.0).abs(),
        };
        let after = self.stops.iter().position(|s| s.0 > t).unwrap_or(self.stops.len());
        let mixed = if after == 0 {
            self.stops[0].1
        } else if after == self.stops.len() {
            self.stops[after - 1].1
        } else {
            let ((t0, a), (t1, b)) = (self.stops[after - 1], self.stops[after]);
            a.lerp(b, (t - t0) / (t1 - t0))
        };
        linear(mixed)
    }

    /// Mean and greatest difference from the definition at random points, and the part of them more than 1 % off.
    fn errors(&self, other: &Self, rng: &mut Rng) -> [f64; 3] {
        let art = read(&self.svg());
        assert_eq!(art.warnings, []);
        let n = 2000;
        let mut errors = [0.0; 3];
        for _ in 0..n {
            let p = DVec2::new(rng.within(0.1, 99.9), rng.within(0.1, 99.9));
            let error = off(shown(&art, p), other.color(p));
            errors = [
                errors[0] + error / f64::from(n),
                errors[1].max(error),
                errors[2] + f64::from(error > 0.01) / f64::from(n),
            ];
        }
        errors
    }
}

#[test]
fn gradients_are_their_definition() {
    let mut rng = Rng(7);
    for radial in [false, true] {
        for spread in ["pad", "reflect", "repeat"] {
            for _ in 0..6 {
                let case = Case::random(&mut rng, radial, spread);
                let [mean, worst, wrong] = case.errors(&case, &mut rng);
                println!(
                    "{spread}, radial {radial}: mean {mean:.1e}, worst {worst:.1e}, {wrong:.4} of points off by 1 %"
                );
                // Where a repeat jumps, a texel shows the mean of both sides.
                let jumps = spread == "repeat";
                assert!(mean < if jumps { 5e-3 } else { 1e-4 }, "{case:?}: {mean:e}");
                assert!(if jumps { wrong < 0.05 } else { worst < 2.5e-2 }, "{case:?}: {worst:e} {wrong}");
                let mut moved = case.clone();
                moved.ends[0] += DVec2::new(3.0, -2.0);
                moved.stops[0].1.x = 1.0 - moved.stops[0].1.x;
                assert!(case.errors(&moved, &mut rng)[0] > 2e-3, "{case:?}");
            }
        }
    }
}

#[test]
fn gradients_are_tiny_skias_within_eight_bits() {
    let mut rng = Rng(11);
    for radial in [false, true] {
        for spread in ["pad", "reflect", "repeat"] {
            let mut case = Case::random(&mut rng, radial, spread);
            // Its shaders mix premultiplied colours or not as they like: alpha apart.
            case.stops.iter_mut().for_each(|s| s.1.w = 1.0);
            let painted = paint(&case);
            let difference = |case: &Case| {
                let art = read(&case.svg());
                let mut sum = 0.0;
                for (y, x) in (0..100).flat_map(|y| (0..100).map(move |x| (y, x))) {
                    let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let pixel = painted.pixel(x, y).unwrap();
                    let [r, g, b] = [pixel.red(), pixel.green(), pixel.blue()].map(|v| f64::from(v) / 255.0);
                    sum += off(shown(&art, p), linear(DVec4::new(r, g, b, 1.0)));
                }
                sum / 1e4
            };
            let found = difference(&case);
            println!("{spread}, radial {radial}: mean difference {found:.1e}");
            // Half a step of eight bits, twice that near white; more where repeats jump.
            assert!(found < if spread == "repeat" { 1e-2 } else { 5e-3 }, "{case:?}: {found:e}");
            case.ends[1].x += 4.0;
            assert!(difference(&case) > 1.5 * found, "{case:?}");
        }
    }
}

fn paint(case: &Case) -> Pixmap {
    let stop = |&(offset, c): &(f64, DVec4)| {
        let [r, g, b] = [c.x, c.y, c.z].map(|v| v as f32);
        GradientStop::new(offset as f32, Color::from_rgba(r, g, b, 1.0).unwrap())
    };
    let stops: Vec<_> = case.stops.iter().map(stop).collect();
    let mode = match case.spread {
        "pad" => SpreadMode::Pad,
        "repeat" => SpreadMode::Repeat,
        _ => SpreadMode::Reflect,
    };
    let [a, b] = case.ends.map(|p| Point::from_xy(p.x as f32, p.y as f32));
    let [sx, ky, kx, sy, tx, ty] = case.transform.to_cols_array().map(|v| v as f32);
    let transform = Transform::from_row(sx, ky, kx, sy, tx, ty);
    let shader = match case.radii {
        None => LinearGradient::new(a, b, stops, mode, transform),
        Some([fr, r]) => RadialGradient::new(a, fr as f32, b, r as f32, stops, mode, transform),
    };
    let paint = Paint { shader: shader.expect("a gradient"), ..Paint::default() };
    let mut pixmap = Pixmap::new(100, 100).unwrap();
    pixmap.fill_rect(Rect::from_xywh(0.0, 0.0, 100.0, 100.0).unwrap(), &paint, Transform::identity(), None);
    pixmap
}

#[test]
fn a_straight_gradient_takes_one_row_or_column() {
    let stops = "<stop stop-color='#102030'/><stop offset='.4' stop-color='#fff'/><stop offset='1' stop-color='#f80'/>";
    for (turned, size) in [("x2='0' y2='1'", "1 column"), ("", "1 row"), ("x2='1' y2='1'", "both")] {
        let art = read(&format!(
            "<linearGradient id='g' {turned}>{stops}</linearGradient><circle cx='50' cy='50' r='40' fill='url(#g)'/>"
        ));
        let picture = art.layers[0].picture.as_ref().expect("a picture");
        let found = match (picture.width, picture.height) {
            (1, 64..) => "1 column",
            (64.., 1) => "1 row",
            (64.., 64..) => "both",
            _ => "neither",
        };
        assert_eq!(found, size, "{} × {}", picture.width, picture.height);
    }
}

/// The bounding box, in whose units a gradient is given unless it says otherwise, is the element's.
#[test]
fn units_of_the_bounding_box() {
    let stops = "<stop stop-color='#000'/><stop offset='1' stop-color='#fff'/>";
    let art = read(&format!(
        "<linearGradient id='g' x1='.25' x2='.75'>{stops}</linearGradient>
         <rect x='20' y='10' width='40' height='30' fill='url(#g)' transform='translate(0 40) scale(1 .5)'/>"
    ));
    for (x, srgb) in [(20.5, 0.0), (29.0, 0.0), (35.0, 0.25), (40.0, 0.5), (45.0, 0.75), (59.0, 1.0)] {
        let there = shown(&art, DVec2::new(x, 50.0));
        assert!(off(there, linear(DVec4::new(srgb, srgb, srgb, 1.0))) < 2e-3, "{x}: {there}");
        assert!(off(there, linear(DVec4::new(srgb, srgb, srgb + 0.02, 1.0))) > 1e-3);
    }
}

#[test]
fn paints_over_each_other_mix_point_by_point() {
    let fade = "<linearGradient id='a' gradientUnits='userSpaceOnUse' x2='100'><stop stop-color='#f00'/><stop offset='1' stop-color='#00f' stop-opacity='0'/></linearGradient>";
    let rise = "<linearGradient id='b' gradientUnits='userSpaceOnUse' y1='0' x2='0' y2='100'><stop stop-color='#fff' stop-opacity='.2'/><stop offset='1' stop-color='#0f0' stop-opacity='.8'/></linearGradient>";
    let a = |p: DVec2| linear(DVec4::new(1.0 - p.x / 100.0, 0.0, p.x / 100.0, 1.0 - p.x / 100.0));
    let b = |p: DVec2| {
        let t = p.y / 100.0;
        linear(DVec4::new(1.0 - t, 1.0, 1.0 - t, 0.2 + 0.6 * t))
    };
    let gray = linear(DVec4::new(0.5, 0.5, 0.5, 1.0));
    let over = |top: DVec4, low: DVec4| top + low * (1.0 - top.w);
    let gray_rect = "<rect width='100' height='100' fill='rgb(127.5,127.5,127.5)' fill-opacity='FADE'/>";
    let gray_at = |opacity: &str| gray_rect.replace("FADE", opacity).replace("127.5", "128");
    let gray = gray.with_x(linear(DVec4::splat(128.0 / 255.0).with_w(1.0)).x);
    let gray = DVec4::new(gray.x, gray.x, gray.x, 1.0);
    let rect = |id: &str| format!("<rect width='100' height='100' fill='url(#{id})'/>");
    type Expected<'a> = Box<dyn Fn(DVec2) -> DVec4 + 'a>;
    let cases: [(String, Expected<'_>); 6] = [
        (gray_at("1") + &rect("a"), Box::new(|p| over(a(p), gray))),
        (rect("a") + &gray_at(".5"), Box::new(|p| over(gray * 0.5, a(p)))),
        (rect("a") + &rect("b"), Box::new(|p| over(b(p), a(p)))),
        (
            gray_at("1") + "<g opacity='.5'>" + &rect("a") + &rect("b") + "</g>",
            Box::new(|p| over(over(b(p), a(p)) * 0.5, gray)),
        ),
        (rect("b") + &gray_at(".25") + &gray_at(".5"), Box::new(|p| over(gray * 0.5, over(gray * 0.25, b(p))))),
        (rect("b") + &gray_at("1"), Box::new(|_| gray)),
    ];
    let mut rng = Rng(3);
    for (body, expected) in cases {
        let art = read(&format!("{fade}{rise}{body}"));
        for _ in 0..200 {
            let p = DVec2::new(rng.within(1.0, 99.0), rng.within(1.0, 99.0));
            assert!(off(shown(&art, p), expected(p)) < 2e-3, "{body} at {p}: {} {}", shown(&art, p), expected(p));
        }
        let wrong = |p: DVec2| off(shown(&art, p), expected(DVec2::new(p.y, p.x)));
        assert!(body.ends_with(&gray_at("1")) || wrong(DVec2::new(20.0, 70.0)) > 0.01, "{body}");
    }
}

#[test]
fn an_opaque_gradient_hides_and_equal_ones_join() {
    let g = "<linearGradient id='g' gradientUnits='userSpaceOnUse' x2='100'><stop stop-color='#f00'/><stop offset='1' stop-color='#00f'/></linearGradient>";
    let covered = read(&format!(
        "{g}<circle cx='50' cy='50' r='20' fill='#0f0'/><rect width='100' height='100' fill='url(#g)'/>"
    ));
    assert_eq!(covered.layers.len(), 1);
    let apart = read(&format!(
        "{g}<rect width='20' height='9' fill='url(#g)'/><rect x='60' width='20' height='9' fill='url(#g)'/>"
    ));
    assert_eq!(apart.layers.len(), 1, "one gradient, one layer");
    assert!(off(shown(&apart, DVec2::new(70.0, 5.0)), linear(DVec4::new(0.3, 0.0, 0.7, 1.0))) < 2e-3);
}

#[test]
fn gradients_that_mean_harm() {
    let one = "<stop stop-color='#f00'/>";
    let two = "<stop stop-color='#f00'/><stop offset='1' stop-color='#00f'/>";
    let user = "gradientUnits='userSpaceOnUse'";
    let red = linear(DVec4::new(1.0, 0.0, 0.0, 1.0));
    let blue = linear(DVec4::new(0.0, 0.0, 1.0, 1.0));
    // Each with what shines at the middle; nothing is `None`.
    let cases = [
        (format!("<linearGradient id='g' {user} x1='9' x2='9' y1='5' y2='5'>{two}</linearGradient>"), Some(blue)),
        (format!("<linearGradient id='g' {user} x1='9' x2='9' y1='5' y2='5' spreadMethod='repeat'>{two}</linearGradient>"), Some(blue)),
        (format!("<radialGradient id='g' r='0'>{two}</radialGradient>"), Some(blue)),
        (format!("<linearGradient id='g'>{one}</linearGradient>"), Some(red)),
        ("<linearGradient id='g'/>".to_owned(), None),
        (format!("<linearGradient id='g' gradientTransform='matrix(1 1 1 1 0 0)'>{two}</linearGradient>"), None),
        (format!("<linearGradient id='g' {user} x1='9' x2='9.1' gradientTransform='scale(0)'>{two}</linearGradient>"), Some(blue)),
        (format!("<linearGradient id='g' {user} x1='9' x2='9.1' gradientTransform='scale(1 0)'>{two}</linearGradient>"), Some(blue)),
        (format!("<linearGradient id='g' {user} x1='1e30' x2='2e30'>{two}</linearGradient>"), Some(red)),
        (format!("<linearGradient id='g' {user} x1='-2e30' x2='-1e30'>{two}</linearGradient>"), Some(blue)),
        // A thousandth of a unit wide, repeated: its mean.
        (format!("<linearGradient id='g' {user} x2='1e-6' spreadMethod='repeat'><stop stop-color='#fff'/><stop offset='1' stop-color='#fff'/></linearGradient>"), Some(DVec4::ONE)),
        (format!("<linearGradient id='g' {user} x2='1' gradientTransform='scale(1e-30)'>{two}</linearGradient>"), Some(blue)),
        (format!("<radialGradient id='g' {user} cx='50' cy='50' r='1e-30' spreadMethod='pad'>{two}</radialGradient>"), Some(blue)),
        ("<linearGradient id='g'><stop offset='5' stop-color='#f00'/><stop offset='-3' stop-color='#00f'/></linearGradient>".to_owned(), Some(red)),
    ];
    for (gradient, expected) in cases {
        let body = format!(
            "{gradient}<rect x='20' y='20' width='60' height='60' fill='url(#g)'/><rect width='9' height='9' fill='#fff'/>"
        );
        let art = read(&body);
        let there = shown(&art, DVec2::splat(50.3));
        assert!(off(there, expected.unwrap_or_default()) < 1e-6, "{gradient}: {there}");
        for layer in &art.layers {
            let picture = layer.picture.iter().flat_map(|p| &p.texels);
            assert!(picture.clone().all(|t| t.is_finite()), "{gradient}");
        }
    }
    // What has no inverse says so.
    let art = read(&format!(
        "<linearGradient id='g' gradientTransform='matrix(1 1 1 1 0 0)'>{two}</linearGradient><rect id='r' width='50' height='50' fill='url(#g)'/><rect width='9' height='9' x='60' fill='#fff'/>"
    ));
    assert!(
        art.warnings.iter().any(|w| w.element == "rect \"r\"" && w.message.contains("no inverse")),
        "{:?}",
        art.warnings
    );
    let flat = read(&format!(
        "<linearGradient id='g' gradientTransform='scale(1 0)'>{two}</linearGradient><rect width='9' height='9' fill='url(#g)'/>"
    ));
    let named = |w: &glyphlight::outline::Warning| {
        w.element == "linearGradient \"g\"" && w.message.contains("scale(1 0) flattens it")
    };
    assert!(flat.warnings.iter().any(named), "{:?}", flat.warnings);
    let nan = drawing(&format!("<linearGradient id='g' gradientTransform='rotate(NaN)'>{two}</linearGradient>"));
    let fault = svg(nan.as_bytes(), "t", &options(1.0)).unwrap_err().to_string();
    assert!(fault.contains("linearGradient \"g\"") && fault.contains("gradientTransform"), "{fault}");
}

/// A focus on or outside of the circle, where parts of the plane are painted by no circle.
#[test]
fn a_focus_outside_leaves_a_cone() {
    let gradient = |fx: f64| {
        format!(
            "<radialGradient id='g' gradientUnits='userSpaceOnUse' cx='50' cy='50' r='20' fx='{fx}' fy='50'><stop stop-color='#f00'/><stop offset='1' stop-color='#00f'/></radialGradient>
             <rect width='100' height='100' fill='#0f0'/><rect width='100' height='100' fill='url(#g)'/>"
        )
    };
    let green = linear(DVec4::new(0.0, 1.0, 0.0, 1.0));
    let outside = read(&gradient(90.0));
    assert!(off(shown(&outside, DVec2::new(95.0, 90.0)), green) < 1e-6, "beside the cone");
    assert!(off(shown(&outside, DVec2::new(10.0, 50.0)), green) > 0.5, "in the cone");
    let inside = read(&gradient(60.0));
    assert!(off(shown(&inside, DVec2::new(95.0, 90.0)), green) > 0.5, "no cone");
    assert_eq!(inside.layers.len(), 1, "it hides what lies below");
}

#[test]
fn too_many_at_once_are_coarser_or_refused() {
    let stops = |k: usize| {
        format!(
            "<stop stop-color='#{:06x}' stop-opacity='.9'/><stop offset='1' stop-color='#fff' stop-opacity='.5'/>",
            k * 99
        )
    };
    let rect = |k: usize, size: f64| {
        let (x, y) = ((k % 16) as f64 * 6.0, (k / 16 % 16) as f64 * 6.0);
        format!(
            "<radialGradient id='g{k}' cx='.{k}'>{}</radialGradient><rect x='{x}' y='{y}' width='{size}' height='{size}' fill='url(#g{k})'/>",
            stops(k)
        )
    };
    let many: String = (0..256).map(|k| rect(k, 5.0)).collect();
    let art = read(&many);
    assert_eq!(art.layers.len(), 256);
    let texels: usize = art.layers.iter().filter_map(|l| l.picture.as_ref()).map(|p| p.texels.len()).sum();
    assert!(texels <= 1 << 24 && texels > 1 << 22, "{texels}");
    assert_eq!(art.warnings.len(), 1);
    assert!(art.warnings[0].message.contains("more than the limit of 16777216"), "{:?}", art.warnings);
    let heap: String = (0..80).map(|_| rect(0, 50.0)).collect();
    let fault = svg(drawing(&heap).as_bytes(), "t", &options(1.0)).unwrap_err().to_string();
    assert!(fault.contains("steps, more than the limit of 128"), "{fault}");
}
