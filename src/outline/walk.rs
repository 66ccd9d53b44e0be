//! From usvg's tree to layers: fills, strokes, groups, clip paths, and the mean colours of what is not one colour.
//! The only file that names usvg.

use super::document::Findings;
use super::layers::{Canvas, LayerError, Premultiplied};
use super::overlap::{self, OverlapError};
use super::svg::{Art, ArtLayer, SvgError, SvgOptions};
use super::{FillRule, Warning, embedded, stroke};
use crate::color::srgb_decode;
use crate::shape::Shape;
use glam::DVec2;
use kurbo::{Affine, BezPath, Cap, Join};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use usvg::tiny_skia_path::PathSegment;
use usvg::{Fill, Group, ImageHrefResolver, ImageKind, Node, Paint, PaintOrder, Path, Stop, Text, Tree, fontdb};

/// Most dashes one stroke may fall into.
const MAX_DASHES: usize = 50_000;

/// Reads the text with the given fonts and nothing else; adds to `findings` what fonts and pictures lack.
pub(super) fn parse(text: &str, options: &SvgOptions, findings: &mut Findings) -> Result<Tree, SvgError> {
    let mut fonts = fontdb::Database::new();
    for font in &options.fonts {
        fonts.load_font_source(fontdb::Source::Binary(Arc::clone(font)));
    }
    let known = |name: &str| fonts.faces().any(|f| f.families.iter().any(|(family, _)| family == name));
    let first = fonts.faces().next().and_then(|f| f.families.first().map(|(family, _)| family.clone()));
    let default = match first {
        Some(first) if !known(&options.font_family) => first,
        _ => options.font_family.clone(),
    };
    for set in [
        fontdb::Database::set_serif_family,
        fontdb::Database::set_sans_serif_family,
        fontdb::Database::set_monospace_family,
        fontdb::Database::set_cursive_family,
        fontdb::Database::set_fantasy_family,
    ] {
        set(&mut fonts, default.clone());
    }
    if fonts.is_empty() {
        let left_out = |element: String| Warning { element, message: "there is no font for it: left out".to_owned() };
        findings.warnings.extend(std::mem::take(&mut findings.texts).into_iter().map(left_out));
    }
    let noted = Mutex::new(Vec::new());
    let note = |element: &str, message: String| {
        if let Ok(mut noted) = noted.lock() {
            noted.push(Warning { element: element.to_owned(), message });
        }
    };
    let select = usvg::FontResolver::default_font_selector();
    let usvg_options = usvg::Options {
        font_family: default.clone(),
        fontdb: Arc::new(fonts),
        image_href_resolver: ImageHrefResolver {
            resolve_data: Box::new(|mime, data, _| {
                if let Err(reason) = embedded::mean_color(&data) {
                    note("embedded image", format!("cannot be decoded: {reason}: left out"));
                    return None;
                }
                match mime {
                    "image/png" => Some(ImageKind::PNG(data)),
                    "image/jpeg" | "image/jpg" => Some(ImageKind::JPEG(data)),
                    _ => None,
                }
            }),
            resolve_string: Box::new(|_, _| None),
        },
        font_resolver: usvg::FontResolver {
            select_font: Box::new(|font, database| {
                let chosen = select(font, database)?;
                let given = |name: &str| {
                    database.face(chosen).is_some_and(|f| f.families.iter().any(|(family, _)| family == name))
                };
                for family in font.families() {
                    match family {
                        usvg::FontFamily::Named(name) if given(name) => break,
                        usvg::FontFamily::Named(name) => {
                            note(&format!("font family \"{name}\""), "is not among the fonts given".to_owned());
                        }
                        _ => break,
                    }
                }
                Some(chosen)
            }),
            select_fallback: usvg::FontResolver::default_fallback_selector(),
        },
        ..usvg::Options::default()
    };
    let tree = Tree::from_str(text, &usvg_options).map_err(|e| SvgError::Syntax { reason: e.to_string() })?;
    drop(usvg_options);
    findings.warnings.extend(noted.into_inner().unwrap_or_default());
    Ok(tree)
}

/// Draws the tree with its longer side `size` metres long.
pub(super) fn draw(tree: &Tree, size: f64, findings: Findings) -> Result<Art, SvgError> {
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let scale = size / width.max(height);
    let at = Affine::scale_non_uniform(scale, -scale) * Affine::translate((-0.5 * width, -0.5 * height));
    let half = DVec2::new(width, height) * (0.5 * scale);
    let mut walk = Walk {
        labels: findings.labels,
        warnings: findings.warnings,
        patterns: HashMap::new(),
        frame: Shape::rectangle(-half, half),
        paths: 0,
    };
    let mut canvas = Canvas::default();
    walk.group(tree.root(), at, &mut canvas)?;
    let layers = canvas.into_merged_pieces()?.into_iter().map(|piece| ArtLayer {
        shape: Shape::clone(&piece.shape),
        color: piece.paint.color,
        opacity: piece.paint.alpha,
        element: piece.element,
    });
    Ok(Art { layers: layers.collect(), size: 2.0 * half, warnings: walk.warnings })
}

struct Walk {
    /// What messages call the elements that have an id.
    labels: HashMap<String, String>,
    warnings: Vec<Warning>,
    /// Mean colours of the patterns met so far.
    patterns: HashMap<String, Premultiplied>,
    /// What of the plane is seen.
    frame: Shape,
    /// Paths met so far, by which those without an id are called.
    paths: usize,
}

impl Walk {
    fn label(&self, id: &str) -> String {
        match self.labels.get(id) {
            Some(label) => label.clone(),
            None if id.is_empty() => format!("path {} (without id)", self.paths),
            None => format!("\"{id}\""),
        }
    }

    fn warn(&mut self, element: &str, message: impl Into<String>) {
        self.warnings.push(Warning { element: element.to_owned(), message: message.into() });
    }

    /// Draws what `group` holds on `canvas`; `at` maps the space around the group to light space.
    fn group(&mut self, group: &Group, at: Affine, canvas: &mut Canvas) -> Result<(), SvgError> {
        let inside = at * affine(group.transform());
        self.warn_of_effects(group);
        let opacity = f64::from(group.opacity().get());
        if opacity >= 1.0 && group.clip_path().is_none() {
            return self.children(group, inside, canvas);
        }
        let mut own = Canvas::default();
        self.children(group, inside, &mut own)?;
        let clip = group.clip_path().map(|clip| {
            let fault = |source| LayerError::Overlap { element: format!("clipPath \"{}\"", clip.id()), source };
            clip_region(clip, inside).map_err(fault)
        });
        let clip = clip.transpose()?;
        Ok(canvas.paint_group(own, opacity, clip.as_ref())?)
    }

    fn warn_of_effects(&mut self, group: &Group) {
        let blends = group.blend_mode() != usvg::BlendMode::Normal;
        if group.filters().is_empty() && group.mask().is_none() && !blends {
            return;
        }
        let id = std::iter::once(group.id()).chain(group.children().iter().map(Node::id)).find(|id| !id.is_empty());
        let element = match id {
            Some(id) => self.label(id),
            None => format!("group before path {}", self.paths + 1),
        };
        for filter in group.filters() {
            self.warn(&element, format!("its filter \"{}\" is ignored", filter.id()));
        }
        if let Some(mask) = group.mask() {
            self.warn(&element, format!("its mask \"{}\" is ignored", mask.id()));
        }
        if blends {
            self.warn(&element, format!("its blend mode {} is ignored", group.blend_mode()));
        }
    }

    fn children(&mut self, group: &Group, at: Affine, canvas: &mut Canvas) -> Result<(), SvgError> {
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, at, canvas)?,
                Node::Path(path) => self.path(path, at, canvas)?,
                Node::Text(text) => self.text(text, at, canvas)?,
                Node::Image(image) if image.is_visible() => {
                    self.paths += 1;
                    let element = self.label(group.id());
                    self.warn(&element, "takes the mean colour of its pixels");
                    let mean = match image.kind() {
                        ImageKind::PNG(data) | ImageKind::JPEG(data) => embedded::mean_color(data),
                        _ => Err("it is neither PNG nor JPEG".to_owned()),
                    };
                    match mean {
                        Ok(mean) => {
                            let (w, h) = (f64::from(image.size().width()), f64::from(image.size().height()));
                            let outline = kurbo::Shape::to_path(&kurbo::Rect::new(0.0, 0.0, w, h), 0.0);
                            self.paint(&outline, at, FillRule::NonZero, mean, &element, canvas)?;
                        }
                        Err(reason) => self.warn(&element, format!("left out: {reason}")),
                    }
                }
                Node::Image(_) => {}
            }
        }
        Ok(())
    }

    fn path(&mut self, path: &Path, at: Affine, canvas: &mut Canvas) -> Result<(), SvgError> {
        self.paths += 1;
        if !path.is_visible() {
            return Ok(());
        }
        let element = self.label(path.id());
        let outline = bez_path(path);
        for stroked in
            [path.paint_order() == PaintOrder::StrokeAndFill, path.paint_order() == PaintOrder::FillAndStroke]
        {
            if let (false, Some(fill)) = (stroked, path.fill()) {
                let color = self.mean(fill.paint(), &element)?.scaled(f64::from(fill.opacity().get()));
                self.paint(&outline, at, fill_rule(fill), color, &element, canvas)?;
            }
            if let (true, Some(stroke)) = (stroked, path.stroke()) {
                let color = self.mean(stroke.paint(), &element)?.scaled(f64::from(stroke.opacity().get()));
                let outline = self.stroke_outline(&outline, stroke, &element)?;
                self.paint(&outline, at, FillRule::NonZero, color, &element, canvas)?;
            }
        }
        Ok(())
    }

    fn stroke_outline(&mut self, path: &BezPath, stroke: &usvg::Stroke, element: &str) -> Result<BezPath, SvgError> {
        let cap = match stroke.linecap() {
            usvg::LineCap::Butt => Cap::Butt,
            usvg::LineCap::Round => Cap::Round,
            usvg::LineCap::Square => Cap::Square,
        };
        let join = match stroke.linejoin() {
            usvg::LineJoin::Miter => Join::Miter,
            usvg::LineJoin::MiterClip => {
                self.warn(element, "its joins are mitred or bevelled, not clipped");
                Join::Miter
            }
            usvg::LineJoin::Round => Join::Round,
            usvg::LineJoin::Bevel => Join::Bevel,
        };
        let mut style = kurbo::Stroke::new(f64::from(stroke.width().get()))
            .with_caps(cap)
            .with_join(join)
            .with_miter_limit(f64::from(stroke.miterlimit().get()));
        if let Some(dashes) = stroke.dasharray() {
            style = style.with_dashes(f64::from(stroke.dashoffset()), dashes.iter().map(|&d| f64::from(d)));
        }
        stroke::expand(path, &style, MAX_DASHES).map_err(|count| {
            let element = element.to_owned();
            SvgError::TooMany { element, what: "dashes", count, limit: MAX_DASHES }
        })
    }

    fn text(&mut self, text: &Text, at: Affine, canvas: &mut Canvas) -> Result<(), SvgError> {
        let element = self.label(text.id());
        for glyph in text.layouted().iter().flat_map(|span| &span.positioned_glyphs) {
            if let (0, Some(c)) = (glyph.id.0, glyph.text.chars().next()) {
                self.warn(&element, format!("no font has a glyph for U+{:04X} '{c}'", u32::from(c)));
            }
        }
        self.group(text.flattened(), at, canvas)
    }

    /// Fills an outline in one colour, cut to the frame.
    fn paint(
        &mut self,
        outline: &BezPath,
        at: Affine,
        rule: FillRule,
        color: Premultiplied,
        element: &str,
        canvas: &mut Canvas,
    ) -> Result<(), SvgError> {
        let fault = |source| LayerError::Overlap { element: element.to_owned(), source };
        let mut shape = overlap::resolve(&(at * outline.clone()), rule).map_err(fault)?;
        let (bounds, frame) = (shape.bounds(), self.frame.bounds());
        if !shape.is_empty() && bounds.union(frame) != frame {
            shape = overlap::intersection(&shape, &self.frame).map_err(fault)?;
        }
        Ok(canvas.paint(shape, color, element)?)
    }

    /// One colour for a paint; a warning if it is not of one colour.
    fn mean(&mut self, paint: &Paint, element: &str) -> Result<Premultiplied, SvgError> {
        let (kind, id, mean) = match paint {
            Paint::Color(c) => return Ok(premultiplied(*c, 1.0)),
            Paint::LinearGradient(g) => ("gradient", g.id(), mean_of_stops(g.stops())),
            Paint::RadialGradient(g) => ("gradient", g.id(), mean_of_stops(g.stops())),
            Paint::Pattern(p) => ("pattern", p.id(), self.mean_of_pattern(p)?),
        };
        self.warn(element, format!("its {kind} \"{id}\" becomes its mean colour"));
        Ok(mean)
    }

    fn mean_of_pattern(&mut self, pattern: &usvg::Pattern) -> Result<Premultiplied, SvgError> {
        if let Some(&known) = self.patterns.get(pattern.id()) {
            return Ok(known);
        }
        let rect = pattern.rect();
        // The content is given in the space of the tile, whose corner is its origin.
        let tile = Shape::rectangle(DVec2::ZERO, DVec2::new(f64::from(rect.width()), f64::from(rect.height())));
        let whole = tile.area();
        let frame = std::mem::replace(&mut self.frame, tile);
        let mut canvas = Canvas::default();
        let drawn = self.children(pattern.root(), Affine::IDENTITY, &mut canvas);
        self.frame = frame;
        drawn?;
        let mut mean = Premultiplied { color: [0.0; 3], alpha: 0.0 };
        for piece in canvas.into_pieces()? {
            let part = piece.paint.scaled(piece.shape.area() / whole);
            mean.color = std::array::from_fn(|i| mean.color[i] + part.color[i]);
            mean.alpha += part.alpha;
        }
        self.patterns.insert(pattern.id().to_owned(), mean);
        Ok(mean)
    }
}

/// The union of what a clip path holds.
fn region(group: &Group, at: Affine) -> Result<Shape, OverlapError> {
    let at = at * affine(group.transform());
    let mut all = Shape::default();
    for node in group.children() {
        match node {
            Node::Path(path) if path.is_visible() => {
                if let Some(fill) = path.fill() {
                    all.append(overlap::resolve(&(at * bez_path(path)), fill_rule(fill))?);
                }
            }
            Node::Group(group) => all.append(region(group, at)?),
            Node::Text(text) => all.append(region(text.flattened(), at)?),
            Node::Path(_) | Node::Image(_) => {}
        }
    }
    let all = overlap::union(&all, &Shape::default())?;
    match group.clip_path() {
        Some(clip) => overlap::intersection(&all, &clip_region(clip, at)?),
        None => Ok(all),
    }
}

/// The region a clip path leaves; `at` maps the space of the element it cuts to light space.
fn clip_region(clip: &usvg::ClipPath, at: Affine) -> Result<Shape, OverlapError> {
    let region = region(clip.root(), at * affine(clip.transform()))?;
    match clip.clip_path() {
        Some(outer) => overlap::intersection(&region, &clip_region(outer, at)?),
        None => Ok(region),
    }
}

fn fill_rule(fill: &Fill) -> FillRule {
    match fill.rule() {
        usvg::FillRule::NonZero => FillRule::NonZero,
        usvg::FillRule::EvenOdd => FillRule::EvenOdd,
    }
}

fn affine(t: usvg::Transform) -> Affine {
    Affine::new([t.sx, t.ky, t.kx, t.sy, t.tx, t.ty].map(f64::from))
}

fn bez_path(path: &Path) -> BezPath {
    let p = |p: usvg::tiny_skia_path::Point| (f64::from(p.x), f64::from(p.y));
    let mut outline = BezPath::new();
    for segment in path.data().segments() {
        match segment {
            PathSegment::MoveTo(a) => outline.move_to(p(a)),
            PathSegment::LineTo(a) => outline.line_to(p(a)),
            PathSegment::QuadTo(a, b) => outline.quad_to(p(a), p(b)),
            PathSegment::CubicTo(a, b, c) => outline.curve_to(p(a), p(b), p(c)),
            PathSegment::Close => outline.close_path(),
        }
    }
    outline
}

fn premultiplied(color: usvg::Color, alpha: f64) -> Premultiplied {
    let color = [color.red, color.green, color.blue].map(|v| alpha * srgb_decode(f64::from(v) / 255.0));
    Premultiplied { color, alpha }
}

/// Mean over the offsets 0 to 1 of a gradient, which interpolates in sRGB without premultiplying; averaged in linear.
fn mean_of_stops(stops: &[Stop]) -> Premultiplied {
    const SAMPLES: u32 = 1024;
    let value = |s: &Stop| {
        let c = s.color();
        [c.red, c.green, c.blue].map(|v| f64::from(v) / 255.0).into_iter().chain([f64::from(s.opacity().get())])
    };
    let mut sum = Premultiplied { color: [0.0; 3], alpha: 0.0 };
    for k in 0..SAMPLES {
        let t = (f64::from(k) + 0.5) / f64::from(SAMPLES);
        let offset = |s: &Stop| f64::from(s.offset().get());
        let before = stops.iter().rev().find(|s| offset(s) <= t).or(stops.first());
        let after = stops.iter().find(|s| offset(s) > t).or(stops.last());
        let (Some(a), Some(b)) = (before, after) else { continue };
        let span = offset(b) - offset(a);
        let part = if span > 0.0 { (t - offset(a)) / span } else { 0.0 };
        let mixed: Vec<f64> = value(a).zip(value(b)).map(|(a, b)| a + (b - a) * part).collect();
        let weight = mixed[3] / f64::from(SAMPLES);
        sum.color = std::array::from_fn(|i| sum.color[i] + weight * srgb_decode(mixed[i]));
        sum.alpha += weight;
    }
    sum
}
