//! Painter's order: paints laid over each other become layers that do not overlap, whose light adds up.

use super::overlap::{self, OverlapError};
use crate::shape::{Bounds, Shape};
use std::collections::HashMap;
use std::rc::Rc;

/// Most set operations that one drawing may take.
pub const MAX_OPERATIONS: usize = 100_000;
/// Most pieces the regions of one drawing may fall into.
pub const MAX_PIECES: usize = 50_000;

/// Why paints could not be laid over each other.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayerError {
    /// A set operation failed.
    #[error("{element}: {source}")]
    Overlap {
        /// The element painted.
        element: String,
        /// The reason.
        source: OverlapError,
    },
    /// More set operations than [`MAX_OPERATIONS`].
    #[error("{element}: overlapping paints take more than the limit of {limit} set operations")]
    TooManyOperations {
        /// The element at which the limit was passed.
        element: String,
        /// The limit.
        limit: usize,
    },
    /// More pieces than [`MAX_PIECES`].
    #[error("{element}: overlapping paints fall into {count} pieces, more than the limit of {limit}")]
    TooManyPieces {
        /// The element at which the limit was passed.
        element: String,
        /// Pieces so far.
        count: usize,
        /// The limit.
        limit: usize,
    },
}

/// A colour with coverage: linear Rec.709 premultiplied by `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Premultiplied {
    pub(super) color: [f64; 3],
    pub(super) alpha: f64,
}

impl Premultiplied {
    pub(super) fn scaled(self, by: f64) -> Self {
        Self { color: self.color.map(|c| c * by), alpha: self.alpha * by }
    }

    /// This colour over `below` (Porter and Duff 1984).
    fn over(self, below: Self) -> Self {
        let rest = below.scaled(1.0 - self.alpha);
        let color = std::array::from_fn(|i| self.color[i] + rest.color[i]);
        Self { color, alpha: self.alpha + rest.alpha }
    }

    fn is_opaque(self) -> bool {
        self.alpha >= 1.0 - 1e-9
    }
}

/// A region of one colour.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) shape: Rc<Shape>,
    pub(super) paint: Premultiplied,
    pub(super) element: String,
    bounds: Bounds,
    /// What later paints hide of `shape`, taken off all at once by [`Canvas::settle`].
    covers: Vec<Rc<Shape>>,
}

/// Disjoint pieces, built up paint by paint.
#[derive(Default)]
pub(super) struct Canvas {
    pieces: Vec<Piece>,
    operations: usize,
}

impl Canvas {
    /// Lays `shape` in one colour over what is there.
    pub(super) fn paint(&mut self, shape: Shape, paint: Premultiplied, element: &str) -> Result<(), LayerError> {
        if shape.is_empty() || paint.alpha <= 0.0 {
            return Ok(());
        }
        let bounds = shape.bounds();
        let shape = Rc::new(shape);
        let mut top =
            Piece { shape: Rc::clone(&shape), paint, element: element.to_owned(), bounds, covers: Vec::new() };
        let under: Vec<_> = (0..self.pieces.len()).filter(|&i| self.pieces[i].bounds.overlaps(bounds)).collect();
        for i in under {
            if !paint.is_opaque() {
                self.settle(i)?;
                let piece = self.pieces[i].clone();
                let shared = self.operate(element, || overlap::intersection(&piece.shape, &shape))?;
                if shared.is_empty() {
                    continue;
                }
                top.covers.push(Rc::clone(&piece.shape));
                self.pieces.push(Piece {
                    bounds: shared.bounds(),
                    shape: Rc::new(shared),
                    paint: paint.over(piece.paint),
                    element: element.to_owned(),
                    covers: Vec::new(),
                });
            }
            self.pieces[i].covers.push(Rc::clone(&shape));
        }
        self.pieces.push(top);
        if self.pieces.len() > MAX_PIECES {
            let (element, count) = (element.to_owned(), self.pieces.len());
            return Err(LayerError::TooManyPieces { element, count, limit: MAX_PIECES });
        }
        Ok(())
    }

    /// Lays a canvas of its own over this one: a group with an opacity, cut by `clip`.
    pub(super) fn paint_group(&mut self, group: Self, opacity: f64, clip: Option<&Shape>) -> Result<(), LayerError> {
        self.operations += group.operations;
        for piece in group.into_pieces()? {
            let shape = match clip {
                Some(clip) => self.operate(&piece.element, || overlap::intersection(&piece.shape, clip))?,
                None => Shape::clone(&piece.shape),
            };
            self.paint(shape, piece.paint.scaled(opacity), &piece.element)?;
        }
        Ok(())
    }

    /// The pieces, none of which overlaps another.
    pub(super) fn into_pieces(mut self) -> Result<Vec<Piece>, LayerError> {
        for i in 0..self.pieces.len() {
            self.settle(i)?;
        }
        self.pieces.retain(|p| !p.shape.is_empty());
        Ok(self.pieces)
    }

    /// The pieces, those of equal colour joined into one, in the order in which their colours first appear.
    pub(super) fn into_merged_pieces(self) -> Result<Vec<Piece>, LayerError> {
        let mut merged: Vec<Vec<Piece>> = Vec::new();
        let mut place: HashMap<[u64; 4], usize> = HashMap::new();
        for piece in self.into_pieces()? {
            let [r, g, b] = piece.paint.color.map(f64::to_bits);
            let k = *place.entry([r, g, b, piece.paint.alpha.to_bits()]).or_insert(merged.len());
            if k == merged.len() {
                merged.push(Vec::new());
            }
            merged[k].push(piece);
        }
        merged.into_iter().map(join).collect()
    }

    /// Takes what hides piece `i` off its shape.
    fn settle(&mut self, i: usize) -> Result<(), LayerError> {
        let covers = std::mem::take(&mut self.pieces[i].covers);
        if covers.is_empty() || self.pieces[i].shape.is_empty() {
            return Ok(());
        }
        let mut all = Shape::default();
        covers.iter().for_each(|c| all.append(Shape::clone(c)));
        let Piece { shape, element, .. } = self.pieces[i].clone();
        let rest = self.operate(&element, || overlap::difference(&shape, &all))?;
        self.pieces[i].bounds = rest.bounds();
        self.pieces[i].shape = Rc::new(rest);
        Ok(())
    }

    fn operate(
        &mut self,
        element: &str,
        operation: impl FnOnce() -> Result<Shape, OverlapError>,
    ) -> Result<Shape, LayerError> {
        self.operations += 1;
        if self.operations > MAX_OPERATIONS {
            return Err(LayerError::TooManyOperations { element: element.to_owned(), limit: MAX_OPERATIONS });
        }
        operation().map_err(|source| LayerError::Overlap { element: element.to_owned(), source })
    }
}

/// Disjoint pieces of one colour as one; where they may touch, the seams between them go.
fn join(pieces: Vec<Piece>) -> Result<Piece, LayerError> {
    let touching = pieces.iter().enumerate().any(|(i, p)| pieces[..i].iter().any(|q| q.bounds.overlaps(p.bounds)));
    let mut names: Vec<&str> = Vec::new();
    for piece in &pieces {
        if !names.contains(&piece.element.as_str()) {
            names.push(&piece.element);
        }
    }
    let element = match names[..] {
        [ref few @ .., last] if few.len() < 3 => [few, &[last]].concat().join(", "),
        [first, second, ref rest @ ..] => format!("{first}, {second} and {} more", rest.len()),
        _ => String::new(),
    };
    let mut shape = Shape::default();
    pieces.iter().for_each(|p| shape.append(Shape::clone(&p.shape)));
    if touching {
        shape = overlap::union(&shape, &Shape::default())
            .map_err(|source| LayerError::Overlap { element: element.clone(), source })?;
    }
    let bounds = shape.bounds();
    Ok(Piece { shape: Rc::new(shape), paint: pieces[0].paint, element, bounds, covers: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn square(x: f64) -> Shape {
        Shape::rectangle(DVec2::new(x, 0.0), DVec2::new(x + 2.0, 2.0))
    }

    fn gray(value: f64, alpha: f64) -> Premultiplied {
        Premultiplied { color: [value * alpha; 3], alpha }
    }

    /// Premultiplied colour and coverage at a point: the sum over the pieces.
    fn at(pieces: &[Piece], x: f64) -> (f64, f64) {
        let hit = |p: &&Piece| p.shape.winding(DVec2::new(x, 1.0)) == 1;
        pieces.iter().filter(hit).fold((0.0, 0.0), |(c, a), p| (c + p.paint.color[0], a + p.paint.alpha))
    }

    #[test]
    fn opaque_hides_and_translucent_mixes() {
        let mut canvas = Canvas::default();
        canvas.paint(square(0.0), gray(0.8, 1.0), "a").unwrap();
        canvas.paint(square(1.0), gray(0.4, 0.5), "b").unwrap();
        canvas.paint(square(2.5), gray(0.2, 1.0), "c").unwrap();
        let pieces = canvas.into_pieces().unwrap();
        assert_eq!(pieces.len(), 4);
        for (x, color, alpha) in [(0.5, 0.8, 1.0), (1.5, 0.6, 1.0), (2.2, 0.2, 0.5), (2.7, 0.2, 1.0), (9.0, 0.0, 0.0)] {
            let (c, a) = at(&pieces, x);
            assert!((c - color).abs() < 1e-12 && (a - alpha).abs() < 1e-12, "{x}: {c} {a}");
        }
    }

    #[test]
    fn a_group_is_mixed_as_a_whole() {
        let mut group = Canvas::default();
        group.paint(square(0.0), gray(1.0, 1.0), "a").unwrap();
        group.paint(square(1.0), gray(0.5, 1.0), "b").unwrap();
        let mut canvas = Canvas::default();
        canvas.paint_group(group, 0.5, Some(&square(0.5))).unwrap();
        let pieces = canvas.into_pieces().unwrap();
        for (x, color) in [(0.2, 0.0), (0.7, 0.5), (1.5, 0.25), (2.4, 0.25), (2.7, 0.0)] {
            assert!((at(&pieces, x).0 - color).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn equal_colours_become_one_piece_without_seams() {
        let mut canvas = Canvas::default();
        for (x, v) in [(0.0, 0.5), (9.0, 0.7), (1.0, 0.5), (3.0, 0.5)] {
            canvas.paint(square(x), gray(v, 1.0), "tile").unwrap();
        }
        let pieces = canvas.into_merged_pieces().unwrap();
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].shape.contours().len(), 1);
        assert!((pieces[0].shape.area() - 10.0).abs() < 1e-9);
    }
}
