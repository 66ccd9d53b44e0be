//! Painter's order: paints laid over each other become layers that do not overlap, whose light adds up.

use super::overlap::{self, OverlapError};
use super::paint::Paint;
use crate::shape::{Bounds, Shape};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// Most set operations that one drawing may take.
pub const MAX_OPERATIONS: usize = 100_000;
/// Most pieces the regions of one drawing may fall into.
pub const MAX_PIECES: usize = 50_000;
/// Most steps in which the colour of one piece is worked out: about two for each translucent gradient or picture.
pub const MAX_STEPS: usize = 128;

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
    /// More colours, gradients and pictures over each other than [`MAX_STEPS`] allows.
    #[error(
        "{element}: translucent gradients and pictures over each other take {count} steps, more than the limit of {limit}"
    )]
    TooManySteps {
        /// The element at which the limit was passed.
        element: String,
        /// Steps so far.
        count: usize,
        /// The limit.
        limit: usize,
    },
}

/// A region of one paint.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) shape: Arc<Shape>,
    pub(super) paint: Paint,
    pub(super) element: String,
    bounds: Bounds,
    /// What later paints hide of `shape`, taken off all at once by [`Piece::settle`].
    covers: Vec<Arc<Shape>>,
}

impl Piece {
    /// Takes what hides the piece off its shape.
    fn settle(&mut self) -> Result<(), LayerError> {
        let covers = std::mem::take(&mut self.covers);
        if covers.is_empty() || self.shape.is_empty() {
            return Ok(());
        }
        let mut all = Shape::default();
        covers.iter().for_each(|c| all.append(Shape::clone(c)));
        let rest = overlap::difference(&self.shape, &all)
            .map_err(|source| LayerError::Overlap { element: self.element.clone(), source })?;
        self.bounds = rest.bounds();
        self.shape = Arc::new(rest);
        Ok(())
    }
}

/// Disjoint pieces, built up paint by paint.
#[derive(Default)]
pub(super) struct Canvas {
    pieces: Vec<Piece>,
    operations: usize,
}

impl Canvas {
    /// Lays `shape` in one paint over what is there.
    pub(super) fn paint(&mut self, shape: Shape, paint: &Paint, element: &str) -> Result<(), LayerError> {
        if shape.is_empty() || paint.is_invisible() {
            return Ok(());
        }
        let bounds = shape.bounds();
        let shape = Arc::new(shape);
        let mut top = Piece {
            shape: Arc::clone(&shape),
            paint: paint.clone(),
            element: element.to_owned(),
            bounds,
            covers: Vec::new(),
        };
        let under: Vec<_> = (0..self.pieces.len()).filter(|&i| self.pieces[i].bounds.overlaps(bounds)).collect();
        for i in under {
            if !paint.is_opaque() {
                self.count(element)?;
                self.pieces[i].settle()?;
                let piece = self.pieces[i].clone();
                let shared = self.operate(element, || overlap::intersection(&piece.shape, &shape))?;
                if shared.is_empty() {
                    continue;
                }
                top.covers.push(Arc::clone(&piece.shape));
                let mixed = paint.over(&piece.paint);
                if mixed.steps() > MAX_STEPS {
                    let (element, count) = (element.to_owned(), mixed.steps());
                    return Err(LayerError::TooManySteps { element, count, limit: MAX_STEPS });
                }
                self.pieces.push(Piece {
                    bounds: shared.bounds(),
                    shape: Arc::new(shared),
                    paint: mixed,
                    element: element.to_owned(),
                    covers: Vec::new(),
                });
            }
            self.pieces[i].covers.push(Arc::clone(&shape));
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
            self.paint(shape, &piece.paint.scaled(opacity), &piece.element)?;
        }
        Ok(())
    }

    /// The pieces, none of which overlaps another.
    pub(super) fn into_pieces(mut self) -> Result<Vec<Piece>, LayerError> {
        let covered = self.pieces.iter().filter(|p| !p.covers.is_empty());
        if let Some(piece) = covered.clone().nth(MAX_OPERATIONS.saturating_sub(self.operations)) {
            return Err(LayerError::TooManyOperations { element: piece.element.clone(), limit: MAX_OPERATIONS });
        }
        self.pieces.par_iter_mut().try_for_each(Piece::settle)?;
        self.pieces.retain(|p| !p.shape.is_empty());
        Ok(self.pieces)
    }

    /// The pieces, those of equal paint joined into one, in the order in which their paints first appear.
    pub(super) fn into_merged_pieces(self) -> Result<Vec<Piece>, LayerError> {
        let mut merged: Vec<Vec<Piece>> = Vec::new();
        let mut place: HashMap<Vec<u64>, usize> = HashMap::new();
        for piece in self.into_pieces()? {
            let k = *place.entry(piece.paint.key()).or_insert(merged.len());
            if k == merged.len() {
                merged.push(Vec::new());
            }
            merged[k].push(piece);
        }
        merged.into_par_iter().map(join).collect()
    }

    fn operate(
        &mut self,
        element: &str,
        operation: impl FnOnce() -> Result<Shape, OverlapError>,
    ) -> Result<Shape, LayerError> {
        self.count(element)?;
        operation().map_err(|source| LayerError::Overlap { element: element.to_owned(), source })
    }

    /// Counts a set operation.
    fn count(&mut self, element: &str) -> Result<(), LayerError> {
        self.operations += 1;
        if self.operations > MAX_OPERATIONS {
            return Err(LayerError::TooManyOperations { element: element.to_owned(), limit: MAX_OPERATIONS });
        }
        Ok(())
    }
}

/// Disjoint pieces of one paint as one; where they may touch, the seams between them go.
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
    Ok(Piece { shape: Arc::new(shape), paint: pieces[0].paint.clone(), element, bounds, covers: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::super::paint::Premultiplied;
    use super::*;
    use glam::DVec2;

    fn square(x: f64) -> Shape {
        Shape::rectangle(DVec2::new(x, 0.0), DVec2::new(x + 2.0, 2.0))
    }

    fn gray(value: f64, alpha: f64) -> Paint {
        Paint::flat(Premultiplied { color: [value * alpha; 3], alpha })
    }

    /// Premultiplied colour and coverage at a point: the sum over the pieces.
    fn at(pieces: &[Piece], x: f64) -> (f64, f64) {
        let hit = |p: &&Piece| p.shape.winding(DVec2::new(x, 1.0)) == 1;
        let paints = pieces.iter().filter(hit).map(|p| p.paint.as_flat().expect("one colour"));
        paints.fold((0.0, 0.0), |(c, a), p| (c + p.color[0], a + p.alpha))
    }

    #[test]
    fn opaque_hides_and_translucent_mixes() {
        let mut canvas = Canvas::default();
        canvas.paint(square(0.0), &gray(0.8, 1.0), "a").unwrap();
        canvas.paint(square(1.0), &gray(0.4, 0.5), "b").unwrap();
        canvas.paint(square(2.5), &gray(0.2, 1.0), "c").unwrap();
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
        group.paint(square(0.0), &gray(1.0, 1.0), "a").unwrap();
        group.paint(square(1.0), &gray(0.5, 1.0), "b").unwrap();
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
            canvas.paint(square(x), &gray(v, 1.0), "tile").unwrap();
        }
        let pieces = canvas.into_merged_pieces().unwrap();
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].shape.contours().len(), 1);
        assert!((pieces[0].shape.area() - 10.0).abs() < 1e-9);
    }
}
