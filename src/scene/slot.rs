//! [`Slot`]: the light of a template that is filled with one drawing after the other.

use super::strength::{Strength, StrengthError};
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::outline::svg::Art;
use crate::shape::Bounds;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// What of a drawing is fitted into the slot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// The picture's frame, empty margins and all: drawings of a set keep their proportions to each other.
    #[default]
    Frame,
    /// The box around what shines.
    Outline,
}

/// Which point of what is fitted stands at the slot's position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// Its middle.
    #[default]
    Center,
    /// The middle of its lower side.
    Bottom,
    /// The middle of its upper side.
    Top,
}

/// A light that is to be filled.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    /// Index of the light in the scene.
    pub light: usize,
    /// Width and height that a drawing may take at most, metres.
    pub size: DVec2,
    /// What of it is measured.
    pub fit: Fit,
    /// Which point of it is at `position`.
    pub anchor: Anchor,
    /// Where that is, metres.
    pub position: DVec3,
    /// `Rz·Ry·Rx`, degrees.
    pub rotation: DVec3,
    /// How strongly it shines.
    pub strength: Strength,
    /// What its radiance is multiplied with.
    pub tint: DVec3,
    /// Whether drawings keep their colours; if nothing is said, all but those that are black do.
    pub svg_colors: Option<bool>,
    /// Whether the back shines as well.
    pub two_sided: bool,
}

/// What one drawing has otherwise than the slot says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Change {
    /// Width and height it may take at most, metres.
    pub size: Option<[f64; 2]>,
    /// Where it stands, metres.
    pub position: Option<[f64; 3]>,
    /// `Rz·Ry·Rx`, degrees.
    pub rotation: Option<[f64; 3]>,
    /// Radiance of a white part, W·sr⁻¹·m⁻².
    pub radiance: Option<[f64; 3]>,
    /// What its radiance is multiplied with, linear.
    pub color: Option<[f64; 3]>,
    /// Whether it keeps its colours.
    pub svg_colors: Option<bool>,
}

/// Brightest linear colour of drawings that are taken for black, as ink on paper: some #191919. Their light would leave the picture dark.
pub const NEARLY_BLACK: f64 = 0.01;

/// Why a drawing does not fill a slot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SlotError {
    /// What is fitted has no width or height.
    #[error("it measures {0} × {1} of its own metres and cannot be fitted")]
    Extent(f64, f64),
    /// All of it is black.
    #[error("all of it is black; svg_colors = false lights every part of it")]
    Black,
    /// It cannot shine as strongly as it should.
    #[error(transparent)]
    Strength(#[from] StrengthError),
}

/// A light that fills a slot.
#[derive(Clone, Debug)]
pub struct Filled {
    /// The light.
    pub light: AreaLight,
    /// The drawing is black or nearly ([`NEARLY_BLACK`]), and shines in white since nothing was said of its colours.
    pub was_black: bool,
}

impl Slot {
    /// The slot with what one drawing has otherwise.
    #[must_use]
    pub fn changed(&self, change: &Change) -> Self {
        Self {
            size: change.size.map_or(self.size, DVec2::from_array),
            position: change.position.map_or(self.position, DVec3::from_array),
            rotation: change.rotation.map_or(self.rotation, DVec3::from_array),
            strength: change.radiance.map_or(self.strength, |radiance| Strength::Radiance(radiance.into())),
            tint: change.color.map_or(self.tint, DVec3::from_array),
            svg_colors: change.svg_colors.or(self.svg_colors),
            ..self.clone()
        }
    }

    /// The light that the drawing called `name` makes here.
    ///
    /// # Errors
    /// [`SlotError`].
    pub fn fill(&self, name: &str, art: Art) -> Result<Filled, SlotError> {
        let shines = |own: bool| -> Vec<Layer> { art.layers.iter().map(|l| Layer::of_art(l.clone(), own)).collect() };
        let is_black = |layers: &[Layer], most: f64| {
            // A picture may be dark but for a few stars.
            let most = |l: &Layer| if l.picture.is_some() { 0.0 } else { most };
            layers.iter().all(|l| (l.radiance * l.mean_color().truncate()).max_element() <= most(l))
        };
        let mut layers = shines(self.svg_colors.unwrap_or(true));
        let was_black = self.svg_colors.is_none() && is_black(&layers, NEARLY_BLACK);
        if was_black {
            layers = shines(false);
        }
        if is_black(&layers, 0.0) {
            return Err(SlotError::Black);
        }
        let bounds = match self.fit {
            Fit::Frame => Bounds { min: -0.5 * art.size, max: 0.5 * art.size },
            Fit::Outline => layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union),
        };
        let extent = bounds.size();
        if !(extent.is_finite() && extent.min_element() > 0.0) {
            return Err(SlotError::Extent(extent.x.max(0.0), extent.y.max(0.0)));
        }
        let scale = (self.size / extent).min_element();
        let middle = bounds.center();
        let anchor = match self.anchor {
            Anchor::Center => middle,
            Anchor::Bottom => DVec2::new(middle.x, bounds.min.y),
            Anchor::Top => DVec2::new(middle.x, bounds.max.y),
        };
        let mut placement = Placement::new(self.position, self.rotation, DVec2::splat(scale));
        placement.origin = self.position - placement.x * anchor.x - placement.y * anchor.y;
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        self.strength.apply(&mut layers, placement.normal().length() * sides)?;
        Strength::Radiance(self.tint).apply(&mut layers, 1.0)?;
        let form = Form::Outline;
        let light = AreaLight { name: name.into(), layers, form, placement, two_sided: self.two_sided };
        Ok(Filled { light, was_black })
    }

    /// What stands in the slot while it is empty: nothing that shines.
    pub fn empty(&self) -> AreaLight {
        let placement = Placement::new(self.position, self.rotation, DVec2::ONE);
        AreaLight { name: "slot".into(), layers: Vec::new(), form: Form::Outline, placement, two_sided: self.two_sided }
    }
}
