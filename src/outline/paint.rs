//! What is painted: colours, gradients, pictures, and any of them laid over others; and how that becomes a [`Picture`].
//!
//! A paint is a colour for every point of the plane. Laying one over another and fading a group are exact, point by point;
//! only the last step, the picture, has texels.

use super::embedded::{Image, View};
use super::gradient::Gradient;
use crate::picture::{MAX_SIDE, Picture};
use crate::shape::Bounds;
use glam::{DAffine2, DVec2, DVec3, DVec4, Vec4};
use rayon::prelude::*;
use std::sync::Arc;

/// Most texels of a gradient along either side, if its colours change along both.
const GRADIENT_SIDE: f64 = 512.0;
/// Most texels of a gradient whose colours change along one axis only.
const GRADIENT_LENGTH: f64 = 4096.0;
/// Change of a gradient's parameter over the picture that does not show.
const FLAT: f64 = 1e-5;

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

    pub(super) fn vector(self) -> DVec4 {
        DVec3::from_array(self.color).extend(self.alpha)
    }
}

impl From<DVec4> for Premultiplied {
    fn from(v: DVec4) -> Self {
        Self { color: v.truncate().to_array(), alpha: v.w }
    }
}

/// Colours that change from place to place.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Field {
    Gradient(Gradient),
    Image(Image),
}

impl Field {
    fn is_opaque(&self) -> bool {
        match self {
            Self::Gradient(gradient) => gradient.is_opaque(),
            Self::Image(image) => image.is_opaque(),
        }
    }

    /// Texels per metre that show it well, and the most along a side.
    fn density(&self) -> DVec2 {
        match self {
            // The colours between stops are smooth: a few texels each; sums of stops' corners need more.
            Self::Gradient(gradient) => gradient.speed() * (8.0 / gradient.finest()).clamp(256.0, 1024.0),
            Self::Image(image) => image.density(),
        }
    }
}

/// One step of a paint, worked off on a stack of colours.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    Flat(Premultiplied),
    Field(Arc<Field>),
    /// Fades the uppermost colour.
    Scale(f64),
    /// Lays the uppermost colour over the one below it.
    Over,
}

/// A colour for every point of the plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Paint {
    steps: Arc<[Step]>,
    opaque: bool,
}

impl Paint {
    pub(super) fn flat(color: Premultiplied) -> Self {
        Self { steps: Arc::new([Step::Flat(color)]), opaque: color.is_opaque() }
    }

    pub(super) fn field(field: Arc<Field>) -> Self {
        let opaque = field.is_opaque();
        Self { steps: Arc::new([Step::Field(field)]), opaque }
    }

    /// The one colour it has everywhere.
    pub(super) fn as_flat(&self) -> Option<Premultiplied> {
        match *self.steps {
            [Step::Flat(color)] => Some(color),
            _ => None,
        }
    }

    /// How many colours, fields and operations it is made of.
    pub(super) fn steps(&self) -> usize {
        self.steps.len()
    }

    pub(super) const fn is_opaque(&self) -> bool {
        self.opaque
    }

    pub(super) fn is_invisible(&self) -> bool {
        self.as_flat().is_some_and(|c| c.alpha <= 0.0)
    }

    pub(super) fn scaled(&self, by: f64) -> Self {
        if by == 1.0 {
            return self.clone();
        }
        let steps = match &*self.steps {
            [Step::Flat(color)] => return Self::flat(color.scaled(by)),
            [rest @ .., Step::Scale(before)] => rest.iter().cloned().chain([Step::Scale(before * by)]).collect(),
            steps => steps.iter().cloned().chain([Step::Scale(by)]).collect(),
        };
        Self { steps, opaque: self.opaque && by >= 1.0 }
    }

    /// This paint over `below`.
    pub(super) fn over(&self, below: &Self) -> Self {
        let opaque = self.opaque || below.opaque;
        let steps = match (&*self.steps, &*below.steps) {
            ([Step::Flat(top)], [Step::Flat(low)]) => return Self::flat(top.over(*low)),
            // (a over (b over c)) = ((a over b) over c)
            ([Step::Flat(top)], [rest @ .., Step::Flat(low), Step::Over]) => {
                rest.iter().cloned().chain([Step::Flat(top.over(*low)), Step::Over]).collect()
            }
            (top, low) => low.iter().chain(top).cloned().chain([Step::Over]).collect(),
        };
        Self { steps, opaque }
    }

    /// Equal for paints that are made alike.
    pub(super) fn key(&self) -> Vec<u64> {
        let mut key = Vec::with_capacity(5 * self.steps.len());
        for step in &*self.steps {
            match step {
                Step::Flat(c) => {
                    key.push(0);
                    key.extend(c.color.map(f64::to_bits));
                    key.push(c.alpha.to_bits());
                }
                Step::Field(field) => key.extend([1, Arc::as_ptr(field) as usize as u64]),
                Step::Scale(by) => key.extend([2, by.to_bits()]),
                Step::Over => key.push(3),
            }
        }
        key
    }

    /// The paint with all it shows moved by `map`, which has an inverse.
    pub(super) fn moved(&self, map: DAffine2) -> Self {
        let back = map.inverse();
        let step = |step: &Step| match step {
            Step::Field(field) => Step::Field(Arc::new(match &**field {
                Field::Gradient(gradient) => Field::Gradient(gradient.after(back)),
                Field::Image(image) => Field::Image(image.after(back)),
            })),
            other => other.clone(),
        };
        Self { steps: self.steps.iter().map(step).collect(), ..*self }
    }

    fn fields(&self) -> impl Iterator<Item = &Field> {
        self.steps.iter().filter_map(|step| if let Step::Field(field) = step { Some(&**field) } else { None })
    }

    /// The texels that show the paint over a box.
    ///
    /// A lone picture whose rows run along the axes keeps its own texels. Else the outer texel centres lie on the box's border, so that
    /// nothing is cut off by the constant half-texel at the rim.
    pub(super) fn grid(&self, bounds: Bounds) -> Grid {
        let size = bounds.size();
        let mut fields = self.fields();
        if let (Some(Field::Image(image)), None) = (fields.next(), fields.next())
            && let Some(([low, high], [width, height])) = image.aligned(bounds.min, bounds.max)
        {
            return Grid { low, high, width, height };
        }
        let mut count = DVec2::ONE;
        for field in self.fields() {
            let density = field.density();
            let mut wanted = density * size + 1.0;
            let most = match field {
                Field::Image(_) => f64::from(MAX_SIDE),
                Field::Gradient(gradient) => {
                    let changes = gradient.speed() * size;
                    wanted = DVec2::select(changes.cmplt(DVec2::splat(FLAT)), DVec2::ONE, wanted);
                    if changes.min_element() < FLAT { GRADIENT_LENGTH } else { GRADIENT_SIDE }
                }
            };
            count = count.max(wanted.ceil().min(DVec2::splat(most)));
        }
        let margin = DVec2::select(count.cmpgt(DVec2::ONE), 0.5 * size / (count - 1.0), DVec2::ZERO);
        Grid { low: bounds.min - margin, high: bounds.max + margin, width: count.x as u32, height: count.y as u32 }
    }

    /// The paint at the texels of a grid.
    pub(super) fn picture(&self, grid: &Grid) -> Picture {
        let Grid { low, high, width, height } = *grid;
        let cell = (high - low) / DVec2::new(f64::from(width), f64::from(height));
        let views: Vec<_> =
            self.fields().map(|field| if let Field::Image(i) = field { Some(i.view(cell)) } else { None }).collect();
        let mut texels = vec![Vec4::ZERO; width as usize * height as usize];
        texels.par_chunks_mut(width as usize).enumerate().for_each(|(row, texels)| {
            let mut stack = Vec::new();
            for (column, texel) in texels.iter_mut().enumerate() {
                let place = DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * cell;
                let p = DVec2::new(low.x + place.x, high.y - place.y);
                *texel = self.at(p, cell, &views, &mut stack).as_vec4();
            }
        });
        Picture { width, height, texels, low, high }
    }

    /// The colour about `p`, over about a texel of size `cell`; `views` are those of the pictures among its fields.
    fn at(&self, p: DVec2, cell: DVec2, views: &[Option<View>], stack: &mut Vec<DVec4>) -> DVec4 {
        stack.clear();
        let mut views = views.iter();
        for step in &*self.steps {
            match step {
                Step::Flat(color) => stack.push(color.vector()),
                Step::Field(field) => stack.push(match (&**field, views.next()) {
                    (Field::Gradient(gradient), _) => gradient.at(p, cell),
                    (Field::Image(_), view) => view.and_then(Option::as_ref).map_or(DVec4::ZERO, |view| view.at(p)),
                }),
                Step::Scale(by) => stack.iter_mut().last().into_iter().for_each(|color| *color *= *by),
                Step::Over => {
                    if let (Some(top), Some(below)) = (stack.pop(), stack.last_mut()) {
                        *below = top + *below * (1.0 - top.w);
                    }
                }
            }
        }
        stack.pop().unwrap_or_default()
    }
}

/// Where the texels of a picture lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Grid {
    pub(super) fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The same box with a part of the texels along each side, but at least 2 where there were.
    pub(super) fn coarser(self, part: f64) -> Self {
        let fewer = |count: u32| ((f64::from(count) * part) as u32).max(count.min(2));
        Self { width: fewer(self.width), height: fewer(self.height), ..self }
    }
}
