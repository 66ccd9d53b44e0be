//! Work in windows, where a driver ends the loops of a shader early. The shaders' part is `shaders/window.wgsl`.
//!
//! Mesa's llvmpipe lets the invocations that run side by side go 65535 rounds of loops in all (`LP_MAX_TGSI_LOOP_ITERATIONS`);
//! a point that visits that many nodes, or such a one's neighbour, would be dark. Shaders tell when it has happened. The same
//! work is then done by several dispatches, each of which integrates over a window of the elements of each light's region.

use super::device::Device;
use super::layout::Emitters;
use crate::backend::{BackendError, Technique};
use glam::UVec2;

/// Cells of an element, as a power of two: `CELLS_LOG` of the shaders.
const CELLS_LOG: u32 = 8;
/// Windows for each that there was before.
const GROWTH: u32 = 4;
/// Most windows: what takes more would take hours, too.
const MOST: u32 = 1 << 10;

/// How many windows the work of a pass is divided into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Windows(u32);

impl Windows {
    /// So many, of those that there can be.
    pub fn new(count: u32) -> Self {
        Self(count.clamp(1, MOST))
    }

    /// Their number.
    pub const fn count(self) -> u32 {
        self.0
    }

    /// Whether there is more than one.
    pub const fn are_many(self) -> bool {
        self.0 > 1
    }

    /// More of them, where those that there are have been cut.
    ///
    /// # Errors
    /// [`BackendError::Rounds`] where more are of no use: there are too many, no light has elements to be divided, or the
    /// technique's integrals are no sums over elements.
    pub fn more(self, device: &Device, emitters: &Emitters, technique: &Technique) -> Result<Self, BackendError> {
        if self.0 < finest(emitters, technique) {
            return Ok(Self::new(self.0 * GROWTH));
        }
        Err(BackendError::Rounds { adapter: device.adapter.clone(), windows: self.0 })
    }

    /// As many of them as are of use.
    pub fn of_use(self, emitters: &Emitters, technique: &Technique) -> Self {
        Self::new(self.0.min(finest(emitters, technique)))
    }

    /// Each in order: its index, and how many there are.
    pub fn all(self) -> impl Iterator<Item = UVec2> {
        (0..self.0).map(move |k| UVec2::new(k, self.0))
    }
}

/// Windows of which more would be of no use.
fn finest(emitters: &Emitters, technique: &Technique) -> u32 {
    let [past, longest] = emitters.elements();
    // Shaders count cells, and those of a window past the last one, in 32 bits.
    if past >= 1 << (u32::BITS - CELLS_LOG - 1) {
        return 1;
    }
    match technique {
        Technique::Tree | Technique::Textured => MOST.min(longest.saturating_mul(1 << CELLS_LOG)),
        Technique::Kuge { .. } | Technique::Uniform { .. } => MOST.min(longest),
        _ => 1,
    }
}
