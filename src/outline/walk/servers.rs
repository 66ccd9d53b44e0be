//! Paint servers of usvg's tree as paints: gradients, embedded pictures, and patterns, whose tiles become layers.

use super::{SvgError, Walk, affine};
use crate::color::srgb_decode;
use crate::outline::embedded::Image;
use crate::outline::gradient::{Course, Gradient, Spread, Stop};
use crate::outline::layers::{Canvas, Piece};
use crate::outline::overlap::{self, OverlapError};
use crate::outline::paint::{Field, Paint, Premultiplied};
use crate::shape::{Bounds, Shape};
use glam::{DAffine2, DVec2, DVec4};
use kurbo::Affine;
use std::sync::Arc;
use usvg::{BaseGradient, LinearGradient, Pattern, RadialGradient, SpreadMethod};

/// Most curves that the tiles of one pattern may come to in one place.
const MAX_TILED_CURVES: usize = 20_000;
/// Most gradients and pictures that the tiles of one pattern may come to in one place.
const MAX_TILED_PICTURES: usize = 256;

/// What to fill with.
pub(super) enum Server<'a> {
    Paint(Paint),
    Pattern(&'a Pattern),
    Nothing,
}

impl Walk<'_> {
    /// What `paint` paints with; `at` maps the space of the element to light space.
    pub(super) fn server<'a>(&mut self, paint: &'a usvg::Paint, at: Affine, element: &str) -> Server<'a> {
        let field = match paint {
            usvg::Paint::Color(c) => {
                let color = [c.red, c.green, c.blue].map(|v| srgb_decode(f64::from(v) / 255.0));
                return Server::Paint(Paint::flat(Premultiplied { color, alpha: 1.0 }));
            }
            usvg::Paint::Pattern(pattern) => return Server::Pattern(pattern),
            usvg::Paint::LinearGradient(g) => {
                self.field(Arc::as_ptr(g) as usize, at, |at| linear(g, at).map(Field::Gradient))
            }
            usvg::Paint::RadialGradient(g) => {
                self.field(Arc::as_ptr(g) as usize, at, |at| radial(g, at).map(Field::Gradient))
            }
        };
        match (field, paint) {
            (Some(field), _) => Server::Paint(Paint::field(field)),
            (None, usvg::Paint::LinearGradient(g)) => self.without_inverse(element, g.id()),
            (None, usvg::Paint::RadialGradient(g)) => self.without_inverse(element, g.id()),
            (None, _) => Server::Nothing,
        }
    }

    fn without_inverse<'a>(&mut self, element: &str, id: &str) -> Server<'a> {
        self.warn(element, format!("the transform of its gradient \"{id}\" has no inverse: it is left unpainted"));
        Server::Nothing
    }

    /// The paint of an embedded picture whose pixels `at` maps to light space.
    pub(super) fn picture(&mut self, image: &usvg::Image, at: Affine) -> Result<Option<Paint>, &'static str> {
        let (usvg::ImageKind::PNG(data) | usvg::ImageKind::JPEG(data)) = image.kind() else {
            return Err("it is neither PNG nor JPEG");
        };
        let picture = self.images.get(data).map(Arc::clone).ok_or("it was not decoded")?;
        // The picture's y runs up.
        let flip = Affine::new([1.0, 0.0, 0.0, -1.0, 0.0, picture.high.y]);
        let key = Arc::as_ptr(&picture) as usize;
        Ok(self.field(key, at * flip, |at| Image::new(picture, at).map(Field::Image)).map(Paint::field))
    }

    /// What `build` makes for `at`, once for each key and place: equal fields are one, so that their layers join.
    fn field(&mut self, key: usize, at: Affine, build: impl FnOnce(DAffine2) -> Option<Field>) -> Option<Arc<Field>> {
        let known = self.fields.entry((key, at.as_coeffs().map(f64::to_bits)));
        known.or_insert_with(|| build(map(at)).map(Arc::new)).clone()
    }

    /// Fills `region` with the tiles of a pattern, or with its mean colour where they are too many.
    pub(super) fn tile(
        &mut self,
        pattern: &Pattern,
        at: Affine,
        opacity: f64,
        region: Shape,
        element: &str,
        canvas: &mut Canvas,
    ) -> Result<(), SvgError> {
        let rect = pattern.rect();
        let size = DVec2::new(f64::from(rect.width()), f64::from(rect.height()));
        let corner = DVec2::new(f64::from(rect.x()), f64::from(rect.y()));
        let to_light = map(at * affine(pattern.transform()));
        let to_own = to_light.inverse();
        if !to_own.is_finite() {
            let message =
                format!("the transform of its pattern \"{}\" has no inverse: it is left unpainted", pattern.id());
            self.warn(element, message);
            return Ok(());
        }
        let content = self.content(pattern, size)?;
        let Bounds { min, max } = region.bounds();
        let corners = [min, max, DVec2::new(min.x, max.y), DVec2::new(max.x, min.y)];
        let reach = Bounds::of(corners.map(|p| (to_own.transform_point2(p) - corner) / size));
        // A tile that the region only touches is none.
        let (first, last) = ((reach.min + 1e-6).floor(), (reach.max - 1e-6).ceil());
        let tiles = (last - first).max(DVec2::ONE);
        let count = tiles.x * tiles.y;
        let (flat, varied): (Vec<_>, Vec<_>) = content.iter().partition(|piece| piece.paint.as_flat().is_some());
        let curves: usize = content.iter().map(|piece| piece.shape.curves().count()).sum();
        let reason = if count * curves as f64 > MAX_TILED_CURVES as f64 {
            format!("is repeated {count} times")
        } else if count * varied.len() as f64 > MAX_TILED_PICTURES as f64 {
            format!("with gradients or pictures is repeated {count} times")
        } else {
            let place = |i: u32, j: u32| {
                let tile = first + DVec2::new(f64::from(i), f64::from(j));
                to_light * DAffine2::from_translation(corner + size * tile)
            };
            let places: Vec<_> = (0..tiles.y as u32).flat_map(|j| (0..tiles.x as u32).map(move |i| (i, j))).collect();
            let places = places.into_iter().map(|(i, j)| place(i, j));
            match tiled(&flat, &varied, places, &region) {
                Ok(pieces) => {
                    for (shape, paint) in pieces {
                        canvas.paint(shape, &paint.scaled(opacity), element)?;
                    }
                    return Ok(());
                }
                Err(fault) => format!("cannot be laid out ({fault})"),
            }
        };
        self.warn(element, format!("its pattern \"{}\" {reason}: it becomes its mean colour", pattern.id()));
        let mean = Paint::flat(mean(&content, size));
        Ok(canvas.paint(region, &mean.scaled(opacity), element)?)
    }

    /// What the tile of a pattern holds; its corner is the origin, y as in the SVG.
    fn content(&mut self, pattern: &Pattern, size: DVec2) -> Result<Arc<Vec<Piece>>, SvgError> {
        if let Some(known) = self.patterns.get(pattern.id()) {
            return Ok(Arc::clone(known));
        }
        let frame = std::mem::replace(&mut self.frame, Shape::rectangle(DVec2::ZERO, size));
        let mut canvas = Canvas::default();
        let drawn = self.children(pattern.root(), Affine::IDENTITY, &mut canvas);
        self.frame = frame;
        drawn?;
        let content = Arc::new(canvas.into_merged_pieces()?);
        self.patterns.insert(pattern.id().to_owned(), Arc::clone(&content));
        Ok(content)
    }
}

/// The pieces of a tile at all places, cut to `region`: those of one colour as one, those with gradients or pictures one by one.
fn tiled(
    flat: &[&Piece],
    varied: &[&Piece],
    places: impl Iterator<Item = DAffine2> + Clone,
    region: &Shape,
) -> Result<Vec<(Shape, Paint)>, OverlapError> {
    let mut pieces = Vec::new();
    for piece in flat {
        let mut copies = Shape::default();
        places.clone().for_each(|place| copies.append(piece.shape.transformed(place)));
        pieces.push((overlap::intersection(&copies, region)?, piece.paint.clone()));
    }
    for piece in varied {
        for place in places.clone() {
            let shape = overlap::intersection(&piece.shape.transformed(place), region)?;
            pieces.push((shape, piece.paint.moved(place)));
        }
    }
    Ok(pieces)
}

/// Mean colour of a tile.
fn mean(content: &[Piece], size: DVec2) -> Premultiplied {
    let mut mean = DVec4::ZERO;
    for piece in content {
        let color = match piece.paint.as_flat() {
            Some(color) => color.vector(),
            None => piece.paint.picture(&piece.paint.grid(piece.shape.bounds())).mean_over(&piece.shape).as_dvec4(),
        };
        mean += color * (piece.shape.area() / (size.x * size.y));
    }
    mean.into()
}

fn linear(g: &LinearGradient, at: DAffine2) -> Option<Gradient> {
    let [x1, y1, x2, y2] = [g.x1(), g.y1(), g.x2(), g.y2()].map(f64::from);
    gradient(Course::Linear { from: DVec2::new(x1, y1), to: DVec2::new(x2, y2) }, g, at)
}

fn radial(g: &RadialGradient, at: DAffine2) -> Option<Gradient> {
    let [cx, cy, fx, fy] = [g.cx(), g.cy(), g.fx(), g.fy()].map(f64::from);
    let (center, focus) = (DVec2::new(cx, cy), DVec2::new(fx, fy));
    let (radius, focus_radius) = (f64::from(g.r().get()), f64::from(g.fr().get()));
    gradient(Course::Radial { center, radius, focus, focus_radius }, g, at)
}

fn gradient(course: Course, base: &BaseGradient, at: DAffine2) -> Option<Gradient> {
    let spread = match base.spread_method() {
        SpreadMethod::Pad => Spread::Pad,
        SpreadMethod::Reflect => Spread::Reflect,
        SpreadMethod::Repeat => Spread::Repeat,
    };
    let stop = |s: &usvg::Stop| {
        let [r, g, b] = [s.color().red, s.color().green, s.color().blue].map(|v| f64::from(v) / 255.0);
        Stop { offset: f64::from(s.offset().get()), color: DVec4::new(r, g, b, f64::from(s.opacity().get())) }
    };
    let stops: Vec<_> = base.stops().iter().map(stop).collect();
    Gradient::new(course, spread, &stops, at * map(affine(base.transform())))
}

fn map(at: Affine) -> DAffine2 {
    DAffine2::from_cols_array(&at.as_coeffs())
}
