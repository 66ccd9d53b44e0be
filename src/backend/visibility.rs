//! [`Visibility`]: what the camera rays have met, kept while the camera is still.

use super::Settings;
use super::tile::SIDE;
use crate::kernel::surface::Hit;

/// Most bytes that are kept.
const MOST_BYTES: usize = 1 << 30;

/// A triangle and where a ray meets it, if it meets any.
pub type Seen = Option<(u32, Hit)>;

/// What each sample of each pixel sees: pixel by pixel in rows, sample by sample in a pixel.
#[derive(Debug, Default)]
pub struct Visibility {
    seen: Vec<Seen>,
    is_complete: bool,
}

/// A part of it, of a row of tiles.
pub enum SeenRows<'a> {
    /// It is found, and not kept.
    Unknown,
    /// It is found, and kept here.
    Recorded(&'a mut [Seen]),
    /// It is known.
    Known(&'a [Seen]),
}

impl Visibility {
    /// Ready for a picture: known, or to be recorded where that is wanted and not too large.
    #[must_use]
    pub fn prepared(mut self, records: bool, settings: &Settings) -> Self {
        let count = settings.width as usize * settings.height as usize * settings.samples as usize;
        if !self.is_complete && records && count.saturating_mul(size_of::<Seen>()) <= MOST_BYTES {
            self.seen = vec![None; count];
        }
        self
    }

    /// Whether it is known, of all pixels.
    pub const fn is_known(&self) -> bool {
        self.is_complete
    }

    /// Rows of tiles, from the top.
    pub fn rows(&mut self, settings: &Settings) -> Vec<SeenRows<'_>> {
        let row = settings.width as usize * SIDE as usize * settings.samples as usize;
        match (self.is_complete, self.seen.is_empty()) {
            (true, _) => self.seen.chunks(row).map(SeenRows::Known).collect(),
            (false, false) => self.seen.chunks_mut(row).map(SeenRows::Recorded).collect(),
            (false, true) => (0..settings.height.div_ceil(SIDE)).map(|_| SeenRows::Unknown).collect(),
        }
    }

    /// All rows have been recorded, if they are to be.
    pub fn complete(&mut self) {
        self.is_complete = !self.seen.is_empty();
    }
}

impl SeenRows<'_> {
    /// What a sample sees, by its index in these rows; `find` finds it where it is not known.
    #[inline]
    pub fn get(&mut self, index: usize, find: impl FnOnce() -> Option<(usize, Hit)>) -> Option<(usize, Hit)> {
        match self {
            Self::Unknown => find(),
            Self::Recorded(seen) => {
                let found = find();
                seen[index] = found.map(|(triangle, hit)| (triangle as u32, hit));
                found
            }
            Self::Known(seen) => seen[index].map(|(triangle, hit)| (triangle as usize, hit)),
        }
    }
}
