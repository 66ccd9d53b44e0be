//! Every glyph of every bundled font: its outline against skrifa, its shape against tiny-skia's coverage.

use crate::mask::skia_path;
use glyphlight::outline::bez_path;
use glyphlight::outline::bundled::{BundledFont, bundled};
use glyphlight::outline::font::{Font, Instance, Tag};
use glyphlight::shape::{CubicBez, Shape};
use kurbo::{Affine, BezPath, PathEl, Point, Shape as _};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use skrifa::MetadataProvider;
use skrifa::instance::{Location, LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen, pen::PathStyle};
use skrifa::raw::TableProvider;
use skrifa::raw::ps::cff::CffFontRef;
use skrifa::raw::types::GlyphId;

/// Greatest distance between our outline's points and skrifa's, font units: both round sums of a dozen deltas, one in
/// f32 and one in 16.16 fixed point.
const TOLERANCE: f64 = 1e-3;

/// How far areas may differ, in square pixels per pixel of perimeter: the mask has 4 samples a pixel, 8 bits each.
const AREA_TOLERANCE: f64 = 0.025;

/// Pixels along the longer side of a glyph's box.
const PIXELS: f64 = 128.0;

/// Every bundled font at its default and, where it is variable, at a place away from it.
///
/// At these values both readers round the normalised place, which is 2.14 fixed point, to the same bits; at many others
/// ttf-parser truncates where skrifa rounds, and outlines are up to 0.03 units apart.
fn places() -> Vec<(Font, Vec<(Tag, f32)>)> {
    let open = |font: &BundledFont| Font::bundled(font.name).expect("a bundled font is sound");
    let mut places: Vec<_> = bundled().iter().map(|f| (open(f), vec![])).collect();
    let at = |font: &str, axes: &[(&[u8; 4], f32)]| {
        (Font::bundled(font).expect("bundled"), axes.iter().map(|(tag, v)| (Tag(**tag), *v)).collect())
    };
    places.push(at("Inter", &[(b"wght", 650.0), (b"slnt", -5.0)]));
    places.push(at("SourceSans3VF", &[(b"wght", 750.0)]));
    places
}

/// skrifa's side of the comparison.
struct Oracle<'a> {
    font: skrifa::FontRef<'a>,
    location: Location,
    cff: Option<CffFontRef<'a>>,
}

impl<'a> Oracle<'a> {
    fn new(font: &'a Font, axes: &[(Tag, f32)]) -> Self {
        let units_per_em = font.units_per_em() as i32;
        let font = skrifa::FontRef::new(font.data().0).expect("skrifa reads it");
        let location = font.axes().location(axes.iter().map(|(tag, v)| (skrifa::Tag::new(&tag.0), *v)));
        let cff = font.cff().map(|t| t.offset_data()).or(font.cff2().map(|t| t.offset_data())).ok();
        let cff = cff.map(|t| CffFontRef::new(t.as_bytes(), 0, Some(units_per_em)).expect("skrifa reads CFF"));
        Self { font, location, cff }
    }

    fn outline(&self, glyph: u16) -> BezPath {
        let (glyph, mut pen) = (GlyphId::new(glyph.into()), Pen::default());
        if let Some(cff) = &self.cff {
            // skrifa's pen drops the fraction of CFF coordinates, as FreeType does; its evaluator keeps it.
            let coordinates = self.location.coords();
            let index = cff.subfont_index(glyph).expect("a subfont");
            let subfont = cff.subfont(index, coordinates).expect("a subfont");
            cff.evaluate_charstring(&subfont, glyph, coordinates, &mut pen).expect("skrifa outlines it");
        } else {
            let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::from(&self.location))
                .with_path_style(PathStyle::HarfBuzz);
            let outline = self.font.outline_glyphs().get(glyph).expect("skrifa has the glyph");
            outline.draw(settings, &mut pen).expect("skrifa outlines it");
        }
        pen.0
    }
}

#[derive(Default)]
struct Pen(BezPath);

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to((x, y));
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to((x, y));
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to((x1, y1), (x, y));
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.curve_to((x1, y1), (x2, y2), (x, y));
    }
    fn close(&mut self) {
        self.0.close_path();
    }
}

/// The elements without the line back to a contour's start, which one reader draws and the other leaves to the closing.
fn normalised(path: &BezPath) -> Vec<PathEl> {
    let mut elements: Vec<PathEl> = Vec::new();
    let mut start = Point::ZERO;
    for &el in path.elements() {
        match el {
            PathEl::MoveTo(p) => start = p,
            PathEl::ClosePath => {
                if let Some(PathEl::LineTo(p)) = elements.last()
                    && p.distance(start) < TOLERANCE
                {
                    elements.pop();
                }
            }
            _ => {}
        }
        elements.push(el);
    }
    elements
}

fn points(el: &PathEl) -> Vec<Point> {
    match *el {
        PathEl::MoveTo(p) | PathEl::LineTo(p) => vec![p],
        PathEl::QuadTo(a, p) => vec![a, p],
        PathEl::CurveTo(a, b, p) => vec![a, b, p],
        PathEl::ClosePath => vec![],
    }
}

/// Greatest distance between corresponding points, font units; infinite if the commands differ.
fn difference(a: &BezPath, b: &BezPath) -> f64 {
    let (a, b) = (normalised(a), normalised(b));
    if a.len() != b.len() || a.iter().zip(&b).any(|(a, b)| std::mem::discriminant(a) != std::mem::discriminant(b)) {
        return f64::INFINITY;
    }
    let pairs = a.iter().flat_map(points).zip(b.iter().flat_map(points));
    pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max)
}

/// Glyphs whose outlines differ by more than the tolerance, and the greatest difference.
fn strangers(ours: &Instance<'_>, oracle: &Oracle<'_>) -> (Vec<u16>, f64) {
    let mut worst = 0.0_f64;
    let strange = |&glyph: &u16| {
        let d = difference(&ours.outline(glyph).expect("a sound glyph"), &oracle.outline(glyph));
        worst = worst.max(d);
        d > TOLERANCE
    };
    let strangers = (0..ours.font().glyph_count()).filter(strange).collect();
    (strangers, worst)
}

#[test]
fn every_outline_is_skrifas() {
    let mut glyphs = 0;
    for (font, axes) in places() {
        let (strangers, worst) = strangers(&font.instance(&axes).expect("in range"), &Oracle::new(&font, &axes));
        assert!(strangers.is_empty(), "{} at {axes:?}: glyphs {strangers:?} differ by up to {worst}", font.name());
        glyphs += usize::from(font.glyph_count());
    }
    assert_eq!(glyphs, 26_183);
}

#[test]
fn an_outline_at_another_weight_is_not() {
    for name in ["Inter", "SourceSans3VF"] {
        let font = Font::bundled(name).expect("bundled");
        let (ours, theirs) = ([(Tag(*b"wght"), 500.0)], [(Tag(*b"wght"), 501.0)]);
        let (strangers, _) = strangers(&font.instance(&ours).expect("in range"), &Oracle::new(&font, &theirs));
        assert!(strangers.len() > 2000, "{name}: only {} glyphs differ", strangers.len());
    }
}

/// What is wrong with `shape` (em) as the region of `path` (font units) under the non-zero rule.
///
/// Both are turned, so that edges along the axes don't fall between the mask's sample rows, and the mask gets chords of
/// 0.01 pixels' precision, since tiny-skia's own are coarser. Area within [`AREA_TOLERANCE`]; winding number 0 or 1 as the mask says, at each pixel centre whose 3×3
/// neighbourhood is wholly covered or wholly free.
pub fn disagreement(shape: &Shape, path: &BezPath, units_per_em: f64) -> Option<String> {
    let turn = Affine::rotate(0.3);
    let path = turn * path.clone();
    let bounds = path.bounding_box();
    if bounds.width().max(bounds.height()) <= 0.0 {
        return (!shape.is_empty()).then(|| "a shape where there is no path".to_owned());
    }
    let scale = PIXELS / bounds.width().max(bounds.height());
    let to_pixels = Affine::translate((2.0, 2.0)) * Affine::scale(scale) * Affine::translate((-bounds.x0, -bounds.y0));
    let (width, height) = ((bounds.width() * scale) as usize + 5, (bounds.height() * scale) as usize + 5);
    let mut mask = tiny_skia::Mask::new(width as u32, height as u32).expect("a mask has pixels");
    let mut flat = BezPath::new();
    kurbo::flatten(to_pixels * path.clone(), 0.01, |el| flat.push(el));
    if let Some(path) = skia_path(&flat) {
        mask.fill_path(&path, tiny_skia::FillRule::Winding, true, tiny_skia::Transform::identity());
    }
    let expected = mask.data().iter().map(|&p| f64::from(p) / 255.0).sum::<f64>();
    let area = shape.area() * (units_per_em * scale).powi(2);
    let allowed = AREA_TOLERANCE * path.perimeter(1e-3 / scale) * scale + 0.1;
    if (area - expected).abs() > allowed {
        return Some(format!("area {area} where the mask has {expected} ± {allowed} pixels"));
    }
    let rows = winding_rows(&(to_pixels * turn * Affine::scale(units_per_em) * bez_path(shape)), width, height);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let at = |k: usize| mask.data()[(y + k / 3 - 1) * width + x + k % 3 - 1];
            let here = at(4);
            if matches!(here, 0 | 255) && (0..9).all(|k| at(k) == here) && rows[y * width + x] != i32::from(here == 255)
            {
                return Some(format!("pixel ({x}, {y}): winding {} where the mask is {here}", rows[y * width + x]));
            }
        }
    }
    None
}

/// Glyphs of `instance` whose shapes, after `change`, disagree with the mask, and how many of those it changed there are.
fn caught(instance: &Instance<'_>, change: impl Fn(Shape, &BezPath) -> Option<Shape> + Sync) -> (usize, usize) {
    let font = instance.font();
    let verdicts = (0..font.glyph_count()).into_par_iter().filter_map(|glyph| {
        let path = instance.outline(glyph).expect("a path");
        let changed = change(instance.glyph(glyph).expect("a shape"), &path)?;
        Some((usize::from(disagreement(&changed, &path, font.units_per_em()).is_some()), 1))
    });
    verdicts.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

#[test]
fn a_shape_without_one_contour_does_not() {
    let font = Font::bundled("Inter").expect("bundled");
    let drop_one = |shape: Shape, _: &BezPath| {
        let mut contours: Vec<_> = shape.contours().iter().map(|c| c.curves().to_vec()).collect();
        contours.pop();
        (!contours.is_empty()).then(|| Shape::from_contours(contours).expect("still closed"))
    };
    let (caught, changed) = caught(&font.instance(&[]).expect("in range"), drop_one);
    assert!(caught == changed && changed > 1500, "{caught} of {changed}");
}

#[test]
fn overlaps_left_in_place_do_not() {
    let font = Font::bundled("SourceSans3VF").expect("bundled");
    let as_drawn = |_: Shape, path: &BezPath| {
        let mut contours = Vec::new();
        for el in path.elements().split(|el| *el == PathEl::ClosePath).filter(|els| !els.is_empty()) {
            let mut contour = BezPath::from_vec(el.to_vec());
            contour.close_path();
            let em = |p: Point| glam::DVec2::new(p.x, p.y) / font.units_per_em();
            let cubics = contour.segments().map(|s| s.to_cubic());
            contours.push(cubics.map(|c| CubicBez::new(em(c.p0), em(c.p1), em(c.p2), em(c.p3))).collect());
        }
        Some(Shape::from_contours(contours).expect("closed"))
    };
    let (caught, changed) = caught(&font.instance(&[]).expect("in range"), as_drawn);
    assert!(caught > 250 && caught < changed / 4, "{caught} of {changed}");
}

/// Winding number at each pixel centre, by scan lines through the flattened path (pixels).
fn winding_rows(path: &BezPath, width: usize, height: usize) -> Vec<i32> {
    let mut windings = vec![0; width * height];
    let (mut start, mut last) = (Point::ZERO, Point::ZERO);
    let mut edge = |a: Point, b: Point| {
        let (low, high, direction) = if a.y < b.y { (a, b, 1) } else { (b, a, -1) };
        let rows = (low.y - 0.5).ceil().max(0.0) as usize..((high.y - 0.5).ceil().max(0.0) as usize).min(height);
        for row in rows {
            let t = (row as f64 + 0.5 - low.y) / (high.y - low.y);
            // An edge that goes up counts for what lies to its left.
            let x = low.x + (high.x - low.x) * t;
            let columns = ((x - 0.5).ceil().max(0.0) as usize).min(width);
            windings[row * width..row * width + columns].iter_mut().for_each(|w| *w += direction);
        }
    };
    kurbo::flatten(path, 0.01, |el| match el {
        PathEl::MoveTo(p) => (start, last) = (p, p),
        PathEl::LineTo(p) => {
            edge(last, p);
            last = p;
        }
        PathEl::ClosePath => edge(last, start),
        PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
    });
    windings
}

#[test]
fn every_shape_covers_what_its_outline_fills() {
    for (font, axes) in places() {
        let instance = font.instance(&axes).expect("in range");
        let wrong: Vec<_> = (0..font.glyph_count())
            .into_par_iter()
            .filter_map(|glyph| {
                let (shape, path) = (instance.glyph(glyph).expect("a shape"), instance.outline(glyph).expect("a path"));
                disagreement(&shape, &path, font.units_per_em()).map(|what| (glyph, what))
            })
            .collect();
        assert!(wrong.is_empty(), "{} at {axes:?}: {} glyphs, the first is {:?}", font.name(), wrong.len(), wrong[0]);
    }
}
