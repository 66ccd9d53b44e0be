//! Shapes that break things.

use super::draw::Draw;
use crate::outline::font::Font;
use crate::outline::text::{TextStyle, layout};
use crate::shape::{CubicBez, Shape};
use core::f64::consts::TAU;
use glam::{DAffine2, DMat2, DVec2};
use std::sync::LazyLock;

/// What a shape is out for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShapeKind {
    /// Straight edges only.
    Polygon,
    /// Curves of every kind round a middle.
    Blob,
    /// A cubic with a cusp, or nearly one.
    Cusp,
    /// A cubic that crosses itself: its loop turns the other way or counts twice.
    Loop,
    /// S-curves: ribbons, and an S with its chord, whose halves cancel.
    SCurve,
    /// Handles on the chord, beyond its ends, on each other or on the ends; curves that are a point.
    Degenerate,
    /// Quadratics raised to cubics, with rounding noise.
    Elevated,
    /// Regions up to 1e9 times longer than wide.
    Sliver,
    /// Contours of very different sizes, down to 1e-12 of the light.
    Scales,
    /// A letter of a bundled font.
    Glyph,
    /// A line or paragraph of text.
    Text,
    /// Holes, and islands in them.
    Holes,
    /// Contours that overlap: they count by their winding number.
    Overlap,
    /// Contours that share corners or edges.
    Touching,
    /// 10⁴ to 10⁵ cubics.
    Many,
}

/// How often each kind is drawn, and what it is called.
const WEIGHTS: [(ShapeKind, f64, &str); 15] = [
    (ShapeKind::Polygon, 8.0, "polygon"),
    (ShapeKind::Blob, 8.0, "blob"),
    (ShapeKind::Cusp, 8.0, "cusp"),
    (ShapeKind::Loop, 8.0, "loop"),
    (ShapeKind::SCurve, 8.0, "S-curve"),
    (ShapeKind::Degenerate, 8.0, "degenerate"),
    (ShapeKind::Elevated, 8.0, "elevated quadratics"),
    (ShapeKind::Sliver, 8.0, "sliver"),
    (ShapeKind::Scales, 8.0, "scales"),
    (ShapeKind::Glyph, 5.0, "glyph"),
    (ShapeKind::Text, 0.3, "text"),
    (ShapeKind::Holes, 8.0, "holes"),
    (ShapeKind::Overlap, 6.0, "overlap"),
    (ShapeKind::Touching, 6.0, "touching"),
    (ShapeKind::Many, 0.002, "many curves"),
];

impl ShapeKind {
    /// Draws a kind.
    pub fn any(draw: &mut Draw) -> Self {
        draw.weighted(&WEIGHTS)
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        name(&WEIGHTS, self)
    }

    /// Whether its winding number is 0 or 1 everywhere, as a [`Shape`] promises.
    pub const fn is_simple(self) -> bool {
        !matches!(self, Self::Loop | Self::SCurve | Self::Cusp | Self::Degenerate | Self::Overlap)
    }

    /// A shape of this kind, about the size 1.
    pub fn shape(self, draw: &mut Draw) -> Shape {
        let contours = match self {
            Self::Polygon => vec![polygon(draw)],
            Self::Blob => vec![ring(draw, DVec2::ZERO, 1.0, 12)],
            Self::Cusp => vec![closed(vec![bow(draw, 1.0)])],
            Self::Loop => {
                let cross = draw.within(1.05, 6.0);
                vec![closed(vec![bow_of(draw, cross)])]
            }
            Self::SCurve => vec![s_curve(draw)],
            Self::Degenerate => vec![degenerate(draw)],
            Self::Elevated => vec![elevated(draw)],
            Self::Sliver => vec![sliver(draw)],
            Self::Scales => scales(draw),
            Self::Glyph => return GLYPHS[draw.index(GLYPHS.len())].clone(),
            Self::Text => return TEXTS[draw.index(TEXTS.len())].clone(),
            Self::Holes => holes(draw),
            Self::Overlap => {
                let second = draw.square() * draw.pick(&[0.0, 0.5, 1.0]);
                vec![ring(draw, DVec2::ZERO, 1.0, 6), ring(draw, second, 0.8, 6)]
            }
            Self::Touching => touching(draw),
            Self::Many => vec![many(draw)],
        };
        let shape = Shape::from_contours(contours).unwrap_or_else(|_| Shape::rectangle(DVec2::NEG_ONE, DVec2::ONE));
        oriented(shape)
    }
}

/// What a kind is called in its table.
pub(super) fn name<K: Copy + PartialEq>(table: &[(K, f64, &'static str)], kind: K) -> &'static str {
    table.iter().find(|row| row.0 == kind).map_or("", |row| row.2)
}

/// The shape, turned round where its area is negative.
fn oriented(shape: Shape) -> Shape {
    if shape.area() >= 0.0 {
        return shape;
    }
    let reversed = |c: &crate::shape::Contour| c.curves().iter().rev().map(CubicBez::reversed).collect();
    Shape::of_closed(shape.contours().iter().map(reversed).collect())
}

/// Joins the end of the last curve to the start of the first by a line, and each to the next.
fn closed(mut curves: Vec<CubicBez>) -> Vec<CubicBez> {
    let (start, end) = (curves[0].p0, curves[curves.len() - 1].p3);
    if start != end {
        curves.push(CubicBez::line(end, start));
    }
    curves
}

/// Corners of a star-shaped polygon, counter-clockwise.
fn corners(draw: &mut Draw, center: DVec2, radius: f64, count: usize) -> Vec<DVec2> {
    let step = TAU / count as f64;
    let corner = |i| DVec2::from_angle((i as f64 + draw.within(-0.4, 0.4)) * step) * radius * draw.within(0.4, 1.0);
    (0..count).map(corner).map(|p| p + center).collect()
}

/// A curve from each corner to the next.
fn around(corners: &[DVec2], mut curve: impl FnMut(DVec2, DVec2) -> CubicBez) -> Vec<CubicBez> {
    (0..corners.len()).map(|i| curve(corners[i], corners[(i + 1) % corners.len()])).collect()
}

fn polygon(draw: &mut Draw) -> Vec<CubicBez> {
    if draw.chance(0.3) {
        let half = DVec2::new(1.0, draw.log_within(0.05, 1.0));
        return Shape::rectangle(-half, half).curves().copied().collect();
    }
    let count = 3 + draw.index(6);
    around(&corners(draw, DVec2::ZERO, 1.0, count), CubicBez::line)
}

/// A loop with curves of every kind, counter-clockwise.
fn ring(draw: &mut Draw, center: DVec2, radius: f64, most: usize) -> Vec<CubicBez> {
    let count = 3 + draw.index(most - 2);
    let corners = corners(draw, center, radius, count);
    around(&corners, |a, b| {
        let side = (a - b).perp();
        match draw.index(4) {
            0 => CubicBez::line(a, b),
            1 => CubicBez::quad(a, a.lerp(b, 0.5) + side * draw.within(-0.1, 0.3), b),
            2 => CubicBez::new(a, a.lerp(b, 0.3) + side * 0.2, a.lerp(b, 0.7) - side * draw.within(-0.2, 0.2), b),
            _ => CubicBez::new(a, a.lerp(b, 0.2) + side * 0.3, b, b),
        }
    })
}

/// A symmetrical cubic whose handles reach `cross` times across: 1 is a cusp, more a loop. Turned, sheared, moved.
fn bow_of(draw: &mut Draw, cross: f64) -> CubicBez {
    let height = draw.within(0.3, 2.0);
    let flat = CubicBez::new(DVec2::NEG_X, DVec2::new(cross, height), DVec2::new(-cross, height), DVec2::X);
    let shear = DMat2::from_cols(DVec2::X, DVec2::new(draw.within(-0.5, 0.5), 1.0));
    let turn = DAffine2::from_mat2(DMat2::from_angle(draw.within(0.0, TAU)) * shear);
    let [p0, p1, p2, p3] = flat.points().map(|p| turn.transform_point2(p));
    CubicBez::new(p0, p1, p2, p3)
}

/// As [`bow_of`], `cross` missed by nothing or by up to 1e-2.
fn bow(draw: &mut Draw, cross: f64) -> CubicBez {
    let off = if draw.chance(0.4) { 0.0 } else { draw.sign() * draw.log_within(1e-16, 1e-2) };
    bow_of(draw, cross * (1.0 + off))
}

fn s_curve(draw: &mut Draw) -> Vec<CubicBez> {
    let height = draw.within(0.2, 3.0);
    let (a, b) = (DVec2::NEG_X, DVec2::X);
    let s =
        CubicBez::new(a, DVec2::new(draw.within(-0.8, 0.8), height), DVec2::new(draw.within(-0.8, 0.8), -height), b);
    if draw.chance(0.5) {
        return closed(vec![s]);
    }
    let width = DVec2::new(0.0, draw.log_within(1e-3, 1.0));
    let [p0, p1, p2, p3] = s.points().map(|p| p + width);
    closed(vec![s, CubicBez::line(s.p3, p3), CubicBez::new(p3, p2, p1, p0)])
}

fn degenerate(draw: &mut Draw) -> Vec<CubicBez> {
    let count = 3 + draw.index(4);
    let corners = corners(draw, DVec2::ZERO, 1.0, count);
    let mut curves = Vec::new();
    for curve in around(&corners, CubicBez::line) {
        let (a, b) = (curve.p0, curve.p3);
        let off = (a - b).perp() * draw.within(-0.5, 0.5);
        let next = match draw.index(9) {
            0 => curve,
            1 => CubicBez::new(a, a, b, b),
            2 => {
                let [p1, p2] = [(); 2].map(|()| a.lerp(b, draw.within(-1.0, 2.0)));
                CubicBez::new(a, p1, p2, b)
            }
            3 => CubicBez::new(a, b, a, b),
            4 => CubicBez::new(a, a, a.lerp(b, 0.5) + off, b),
            5 => CubicBez::new(a, a.lerp(b, 0.5) + off, a.lerp(b, 0.5) + off, b),
            6 => CubicBez::new(a, a, a, b),
            7 => CubicBez::new(a, b + off, b, b),
            _ => {
                // A drop that begins and ends in the corner, then the edge.
                curves.push(CubicBez::new(a, a + off * 0.3, a + off.perp() * 0.3, a));
                CubicBez::line(a, b)
            }
        };
        curves.push(next);
        if draw.chance(0.2) {
            curves.push(CubicBez::new(b, b, b, b));
        }
    }
    curves
}

fn elevated(draw: &mut Draw) -> Vec<CubicBez> {
    let count = 3 + draw.index(6);
    let corners = corners(draw, DVec2::ZERO, 1.0, count);
    let noise = if draw.chance(0.3) { 0.0 } else { draw.log_within(1e-17, 1e-7) };
    around(&corners, |a, b| {
        let handle = a.lerp(b, 0.5) + (a - b).perp() * draw.within(-0.2, 0.6);
        let mut curve = CubicBez::quad(a, handle, b);
        curve.p1 += draw.square() * noise;
        curve.p2 += draw.square() * noise;
        curve
    })
}

fn sliver(draw: &mut Draw) -> Vec<CubicBez> {
    let thin = DMat2::from_diagonal(DVec2::new(1.0, draw.log_within(1e-9, 1e-2)));
    let turn = DMat2::from_angle(if draw.chance(0.3) { 0.0 } else { draw.within(0.0, TAU) });
    let curves = if draw.chance(0.3) { polygon(draw) } else { ring(draw, DVec2::ZERO, 1.0, 5) };
    let map = |p: DVec2| turn * (thin * p);
    curves
        .iter()
        .map(|c| {
            let [p0, p1, p2, p3] = c.points().map(map);
            CubicBez::new(p0, p1, p2, p3)
        })
        .collect()
}

/// A contour of size 1 and, off it, ever smaller ones.
fn scales(draw: &mut Draw) -> Vec<Vec<CubicBez>> {
    let mut contours = vec![ring(draw, DVec2::ZERO, 1.0, 5)];
    let mut from = 1.2;
    for _ in 0..1 + draw.index(3) {
        let size = draw.log_within(1e-12, 0.3);
        let side = draw.sign();
        let center = DVec2::new(side * (from + size), draw.within(-1.0, 1.0));
        contours.push(ring(draw, center, size, 4));
        from += 2.0 * size + draw.log_within(1e-9, 1.0);
    }
    contours
}

/// The ring run backwards, a hole.
fn hole(draw: &mut Draw, center: DVec2, radius: f64) -> Vec<CubicBez> {
    ring(draw, center, radius, 5).iter().rev().map(CubicBez::reversed).collect()
}

fn holes(draw: &mut Draw) -> Vec<Vec<CubicBez>> {
    if draw.chance(0.5) {
        let center = draw.square() * 0.03;
        // Star-shaped outlines keep 0.3 and more off their middle.
        let mut contours = vec![around(&corners(draw, DVec2::ZERO, 1.0, 9), CubicBez::line), hole(draw, center, 0.15)];
        if draw.chance(0.5) {
            contours.push(around(&corners(draw, center, 0.03, 4), CubicBez::line));
        }
        return contours;
    }
    // A frame: its hole as near to the edge as one likes.
    let width = draw.log_within(1e-6, 0.5);
    let outer = Shape::rectangle(DVec2::NEG_ONE, DVec2::ONE);
    let inner = Shape::rectangle(DVec2::splat(width - 1.0), DVec2::splat(1.0 - width));
    let backwards = inner.curves().map(CubicBez::reversed).collect::<Vec<_>>().into_iter().rev().collect();
    vec![outer.curves().copied().collect(), backwards]
}

fn touching(draw: &mut Draw) -> Vec<Vec<CubicBez>> {
    let step = draw.pick(&[DVec2::new(2.0, 0.0), DVec2::new(2.0, 2.0), DVec2::new(2.0, 1.0)]);
    (0..2 + draw.index(3))
        .map(|i| {
            let middle = step * i as f64;
            Shape::rectangle(middle - 1.0, middle + 1.0).curves().copied().collect()
        })
        .collect()
}

/// A wavy ring.
fn many(draw: &mut Draw) -> Vec<CubicBez> {
    let count = draw.log_within(1e4, 1e5) as usize;
    let wave = draw.log_within(1e-5, 0.2);
    let corner = |i: usize| {
        let swing = if i.is_multiple_of(2) { 1.0 } else { 1.0 - wave };
        DVec2::from_angle(i as f64 / count as f64 * TAU) * swing
    };
    let corners: Vec<_> = (0..count).map(corner).collect();
    around(&corners, |a, b| CubicBez::quad(a, a.lerp(b, 0.5) + (a - b).perp() * 0.2, b))
}

/// Letters of bundled fonts: quadratics raised to cubics, cubics, and overlaps that were removed.
static GLYPHS: LazyLock<Vec<Shape>> = LazyLock::new(|| {
    let letters = [("Inter", "&OiaSg%"), ("DejaVu Sans", "B@x8eR"), ("Source Sans 3", "Qs&4æ"), ("Amiri", "شجaه")];
    let of_font = |(name, text): (&str, &'static str)| {
        let font = Font::bundled(name).ok();
        text.chars().filter_map(move |c| {
            let font = font.as_ref()?;
            let instance = font.instance(&[]).ok()?;
            instance.glyph(instance.glyph_index(c)?).ok().filter(|shape| !shape.is_empty())
        })
    };
    letters.into_iter().flat_map(of_font).collect()
});

/// Lines and a paragraph.
static TEXTS: LazyLock<Vec<Shape>> = LazyLock::new(|| {
    let fonts: Vec<_> = ["Inter", "Amiri"].into_iter().filter_map(|name| Font::bundled(name).ok()).collect();
    let lines = ["OPEN", "Open until late", "سلام", "Text and SVG art\nas area lights,\nexact to 1e-5."];
    let set = |text| layout(text, &fonts, &TextStyle::default()).ok().map(|text| text.shape);
    lines.into_iter().filter_map(set).collect()
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_shapes() {
        assert!(GLYPHS.len() == 22 && TEXTS.len() == 4, "{} {}", GLYPHS.len(), TEXTS.len());
        for (i, (kind, ..)) in WEIGHTS.into_iter().enumerate() {
            let repeat = if kind == ShapeKind::Many { 1 } else { 50 };
            for index in 0..repeat {
                let shape = kind.shape(&mut Draw::new(i as u64, index));
                let contours = shape.contours().iter().map(|c| c.curves().to_vec()).collect();
                assert_eq!(Shape::from_contours(contours).as_ref(), Ok(&shape), "{kind:?} {index}");
                let size = shape.bounds().size().max_element();
                assert!(size > 0.1 && size < 30.0 && shape.area() >= 0.0, "{kind:?} {index}: {size}");
            }
        }
    }
}
