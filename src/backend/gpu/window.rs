//! Work in windows, where a driver ends the loops of a shader early. The shaders' part is `shaders/window.wgsl`.
//!
//! Mesa's llvmpipe lets the invocations that run side by side go 65535 rounds of loops in all (`LP_MAX_TGSI_LOOP_ITERATIONS`);
//! a point that visits that many nodes, or such a one's neighbour, would be dark. Shaders tell when it has happened. The same
//! work is then done by several dispatches, each of which integrates over a window of the elements of the lights' regions.

use super::device::Device;
use super::layout::Emitters;
use crate::backend::{BackendError, Technique};
use glam::UVec2;

/// Cells of an element, as a power of two: `CELLS_LOG` of the shaders.
const CELLS_LOG: u32 = 8;
/// Windows for each that there was before.
const GROWTH: u32 = 4;
/// Most windows.
const MOST: u32 = 1 << 12;

/// How the work of a pass is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Windows {
    /// Elements of all regions.
    elements: u32,
    /// Number of windows.
    pub count: u32,
}

impl Windows {
    /// The work on these lights in as many windows.
    pub fn divided(emitters: &Emitters, count: u32) -> Self {
        Self { elements: emitters.elements(), count: count.clamp(1, MOST) }
    }

    /// Whether there is more than one.
    pub const fn are_many(self) -> bool {
        self.count > 1
    }

    /// More of them, where those that there are have been cut.
    ///
    /// # Errors
    /// [`BackendError::Rounds`] where there are too many, or the technique's integrals are no sums over elements.
    pub fn more(self, device: &Device, emitters: &Emitters, technique: &Technique) -> Result<Self, BackendError> {
        let more = Self::divided(emitters, self.count * GROWTH);
        let is_sum = matches!(
            technique,
            Technique::Tree | Technique::Textured | Technique::Kuge { .. } | Technique::Uniform { .. }
        );
        if is_sum && more.count > self.count && more.elements < 1 << (u32::BITS - CELLS_LOG) {
            return Ok(more);
        }
        Err(BackendError::Rounds { adapter: device.adapter.clone(), windows: self.count })
    }

    /// The windows in order: first cell, past the last one.
    pub fn cells(self) -> impl Iterator<Item = UVec2> {
        let past = u64::from(self.elements) << CELLS_LOG;
        let at = move |k: u32| match k == self.count {
            true => u32::MAX,
            false => (past * u64::from(k) / u64::from(self.count)) as u32,
        };
        (0..self.count).map(move |k| UVec2::new(at(k), at(k + 1))).filter(|cells| cells.x < cells.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_all_cells_once() {
        for (elements, count) in [(0, 1), (1, 4), (3, 4), (43, 1000), (100_000, 64), ((1 << 24) - 1, MOST)] {
            let windows = Windows { elements, count };
            let cells: Vec<UVec2> = windows.cells().collect();
            assert_eq!((cells[0].x, cells[cells.len() - 1].y), (0, u32::MAX), "{windows:?}");
            assert!(cells.windows(2).all(|pair| pair[0].y == pair[1].x), "{windows:?}");
            assert!(cells.len() == count as usize || (elements << CELLS_LOG) < count, "{windows:?}");
        }
    }
}
