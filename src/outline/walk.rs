//! From usvg's tree to layers: fills, strokes, groups, clip paths; `walk/servers.rs` has gradients, patterns and pictures.
//! These two are the only files that name usvg.

mod servers;

use super::document::Findings;
use super::layers::{Canvas, LayerError, Piece};
use super::overlap::{self, OverlapError};
use super::paint::{Field, Grid};
use super::svg::{Art, ArtLayer, FontBytes, SvgError, SvgLimits, SvgOptions};
use super::{FillRule, Warning, embedded, stroke};
use crate::picture::Picture;
use crate::shape::Shape;
use glam::{DVec2, Vec4};
use kurbo::{Affine, BezPath, Cap, Join};
use rayon::prelude::*;
use servers::Server;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use usvg::tiny_skia_path::PathSegment;
use usvg::{
    Fill, Group, Image, ImageHrefResolver, ImageKind, ImageRendering, Node, PaintOrder, Path, Text, Tree, fontdb,
};

/// Most dashes one stroke may fall into.
const MAX_DASHES: usize = 50_000;
/// Most texels that the embedded pictures of one drawing may keep.
const MAX_EMBEDDED: usize = 1 << 25;
/// Most texels that the layers of one drawing may have; beyond, all get fewer.
const MAX_TEXELS: u64 = 1 << 24;
/// Difference of colours, linear, below which a picture is of one colour.
const ONE_COLOR: f32 = 1e-6;

/// The pictures embedded in a drawing, by the bytes of their files.
type Images = HashMap<Arc<Vec<u8>>, Arc<Picture>>;

/// A drawing as usvg reads it.
pub(super) struct Drawing {
    tree: Tree,
    images: Images,
}

/// The fonts as usvg looks them up; those of the last call are kept, since reading them takes longer than most drawings.
fn database(fonts: &[FontBytes]) -> Arc<fontdb::Database> {
    type Last = Option<(Vec<FontBytes>, Arc<fontdb::Database>)>;
    static LAST: Mutex<Last> = Mutex::new(None);
    // The bytes are the same where their place in memory is: they are kept, so that no others can come to lie there.
    let place = |font: &FontBytes| (**font).as_ref().as_ptr_range();
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((known, database)) = &*last
        && known.iter().map(place).eq(fonts.iter().map(place))
    {
        return Arc::clone(database);
    }
    let mut database = fontdb::Database::new();
    for font in fonts {
        database.load_font_source(fontdb::Source::Binary(Arc::clone(font)));
    }
    let database = Arc::new(database);
    *last = Some((fonts.to_vec(), Arc::clone(&database)));
    database
}

/// Reads the text with the given fonts and nothing else; adds to `findings` what fonts and pictures lack.
pub(super) fn parse(text: &str, options: &SvgOptions, findings: &mut Findings) -> Result<Drawing, SvgError> {
    let mut fonts = fontdb::Database::clone(&database(&options.fonts));
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
    let images = Mutex::new(Ok(Images::new()));
    let select = usvg::FontResolver::default_font_selector();
    let usvg_options = usvg::Options {
        font_family: default.clone(),
        fontdb: Arc::new(fonts),
        image_href_resolver: ImageHrefResolver {
            resolve_data: Box::new(|mime, data, _| {
                let mut images = images.lock().unwrap_or_else(PoisonError::into_inner);
                match keep(&mut images, &data, &options.limits) {
                    Ok(()) => {}
                    Err(reason) => {
                        note("embedded image", format!("cannot be decoded: {reason}: left out"));
                        return None;
                    }
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
    let images = images.into_inner().unwrap_or_else(PoisonError::into_inner)?;
    Ok(Drawing { tree, images })
}

/// Decodes an embedded picture and puts it with the others; an error that is the drawing's takes the place of them all.
fn keep(images: &mut Result<Images, SvgError>, data: &Arc<Vec<u8>>, limits: &SvgLimits) -> Result<(), String> {
    let Ok(known) = images else { return Ok(()) };
    if known.contains_key(data) {
        return Ok(());
    }
    let [width, height] = embedded::size(data)?;
    let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let all = pixels([width, height]) + known.keys().filter_map(|k| embedded::size(k).ok()).map(pixels).sum::<u64>();
    let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    for (what, found, limit) in [
        ("pixels along a side of an embedded image", width.max(height).into(), limits.image_side.into()),
        ("pixels of embedded images", all, limits.image_pixels),
    ] {
        if found > limit {
            let element = "drawing".to_owned();
            *images = Err(SvgError::TooMany { element, what, count: count(found), limit: count(limit) });
            return Ok(());
        }
    }
    let picture = embedded::decode(data)?;
    let count = known.values().map(|p| p.texels.len()).sum::<usize>() + picture.texels.len();
    if count > MAX_EMBEDDED {
        let what = "texels of embedded images";
        *images = Err(SvgError::TooMany { element: "drawing".to_owned(), what, count, limit: MAX_EMBEDDED });
        return Ok(());
    }
    known.insert(Arc::clone(data), Arc::new(picture));
    Ok(())
}

/// Draws the tree with its longer side `size` metres long.
pub(super) fn draw(drawing: &Drawing, size: f64, findings: Findings, limits: &SvgLimits) -> Result<Art, SvgError> {
    let tree = &drawing.tree;
    let (width, height) = (f64::from(tree.size().width()), f64::from(tree.size().height()));
    let scale = size / width.max(height);
    let at = Affine::scale_non_uniform(scale, -scale) * Affine::translate((-0.5 * width, -0.5 * height));
    let half = DVec2::new(width, height) * (0.5 * scale);
    let mut walk = Walk {
        labels: findings.labels,
        warnings: findings.warnings,
        images: &drawing.images,
        patterns: HashMap::new(),
        fields: HashMap::new(),
        frame: Shape::rectangle(-half, half),
        paths: 0,
        most_paths: limits.paths,
    };
    let mut canvas = Canvas::default();
    walk.group(tree.root(), at, &mut canvas)?;
    let pieces = canvas.into_merged_pieces()?;
    let grid = |piece: &Piece| piece.paint.as_flat().is_none().then(|| piece.paint.grid(piece.shape.bounds()));
    let mut grids: Vec<Option<Grid>> = pieces.iter().map(grid).collect();
    let texels: u64 = grids.iter().flatten().map(Grid::texels).sum();
    if texels > MAX_TEXELS {
        let part = (MAX_TEXELS as f64 / texels as f64).sqrt();
        grids.iter_mut().for_each(|grid| *grid = grid.map(|g| g.coarser(part)));
        let message =
            format!("its gradients and images take {texels} texels, more than the limit of {MAX_TEXELS}: coarser");
        walk.warn("drawing", message);
    }
    let layers: Vec<_> = pieces.into_par_iter().zip(grids).filter_map(|(piece, grid)| layer(piece, grid)).collect();
    Ok(Art { layers, size: 2.0 * half, warnings: walk.warnings })
}

/// The layer of a piece; `None` if all of it is transparent.
fn layer(piece: Piece, grid: Option<Grid>) -> Option<ArtLayer> {
    let shape = Arc::unwrap_or_clone(piece.shape);
    let flat = piece.paint.as_flat();
    let picture = grid.map(|grid| piece.paint.picture(&grid));
    let (color, picture) = match (flat, picture) {
        (None, Some(picture)) => {
            let off = |texel: &Vec4| (*texel - picture.texels[0]).abs().max_element() > ONE_COLOR;
            let mean = picture.mean_over(&shape).as_dvec4().into();
            (mean, picture.texels.iter().any(off).then(|| Arc::new(picture)))
        }
        (Some(color), _) => (color, None),
        (None, None) => return None,
    };
    let shown = color.alpha > 0.0;
    shown.then_some(ArtLayer { shape, color: color.color, opacity: color.alpha, picture, element: piece.element })
}

struct Walk<'d> {
    /// What messages call the elements that have an id.
    labels: HashMap<String, String>,
    warnings: Vec<Warning>,
    /// The pictures embedded in the drawing.
    images: &'d Images,
    /// What the tiles of the patterns met so far hold.
    patterns: HashMap<String, Arc<Vec<Piece>>>,
    /// Gradients and pictures met so far, by address and place.
    fields: HashMap<(usize, [u64; 6]), Option<Arc<Field>>>,
    /// What of the plane is seen.
    frame: Shape,
    /// Paths met so far, by which those without an id are called.
    paths: usize,
    /// Most paths that are drawn.
    most_paths: usize,
}

impl Walk<'_> {
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
                    self.image(image, at, &element, canvas)?;
                }
                Node::Image(_) => {}
            }
        }
        Ok(())
    }

    fn path(&mut self, path: &Path, at: Affine, canvas: &mut Canvas) -> Result<(), SvgError> {
        self.paths += 1;
        if self.paths > self.most_paths {
            let (element, limit) = (self.label(path.id()), self.most_paths);
            return Err(SvgError::TooMany { element, what: "paths up to there", count: self.paths, limit });
        }
        if !path.is_visible() {
            return Ok(());
        }
        let element = self.label(path.id());
        let outline = bez_path(path);
        for stroked in
            [path.paint_order() == PaintOrder::StrokeAndFill, path.paint_order() == PaintOrder::FillAndStroke]
        {
            if let (false, Some(fill)) = (stroked, path.fill()) {
                let region = self.region(&outline, at, fill_rule(fill), &element)?;
                self.paint(region, at, fill.paint(), f64::from(fill.opacity().get()), &element, canvas)?;
            }
            if let (true, Some(stroke)) = (stroked, path.stroke()) {
                let outline = self.stroke_outline(&outline, stroke, &element)?;
                let region = self.region(&outline, at, FillRule::NonZero, &element)?;
                self.paint(region, at, stroke.paint(), f64::from(stroke.opacity().get()), &element, canvas)?;
            }
        }
        Ok(())
    }

    fn image(&mut self, image: &Image, at: Affine, element: &str, canvas: &mut Canvas) -> Result<(), SvgError> {
        if matches!(
            image.rendering_mode(),
            ImageRendering::OptimizeSpeed | ImageRendering::CrispEdges | ImageRendering::Pixelated
        ) {
            self.warn(element, "its pixels are drawn smooth");
        }
        match self.picture(image, at) {
            Ok(Some(paint)) => {
                let (w, h) = (f64::from(image.size().width()), f64::from(image.size().height()));
                let outline = kurbo::Shape::to_path(&kurbo::Rect::new(0.0, 0.0, w, h), 0.0);
                let region = self.region(&outline, at, FillRule::NonZero, element)?;
                canvas.paint(region, &paint, element)?;
            }
            // Flattened to a line, it covers nothing.
            Ok(None) => {}
            Err(reason) => self.warn(element, format!("left out: {reason}")),
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

    /// What an outline encloses, cut to the frame.
    fn region(&self, outline: &BezPath, at: Affine, rule: FillRule, element: &str) -> Result<Shape, SvgError> {
        let fault = |source| LayerError::Overlap { element: element.to_owned(), source };
        let mut shape = overlap::resolve(&(at * outline.clone()), rule).map_err(fault)?;
        let (bounds, frame) = (shape.bounds(), self.frame.bounds());
        if !shape.is_empty() && bounds.union(frame) != frame {
            shape = overlap::intersection(&shape, &self.frame).map_err(fault)?;
        }
        Ok(shape)
    }

    /// Fills a region of light space with a paint given in the space that `at` maps to it.
    fn paint(
        &mut self,
        region: Shape,
        at: Affine,
        paint: &usvg::Paint,
        opacity: f64,
        element: &str,
        canvas: &mut Canvas,
    ) -> Result<(), SvgError> {
        if region.is_empty() {
            return Ok(());
        }
        match self.server(paint, at, element) {
            Server::Paint(paint) => Ok(canvas.paint(region, &paint.scaled(opacity), element)?),
            Server::Pattern(pattern) => self.tile(pattern, at, opacity, region, element, canvas),
            Server::Nothing => Ok(()),
        }
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
