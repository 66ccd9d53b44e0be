//! Text and SVG art as area lights.
//!
//! ```text
//! font + text ─┐                                   ┌─ CPU ─┐
//! SVG ─────────┼─ Shape ─ AreaLight ─ Scene ─ Tree ┤       ├─ Film ─ PNG, EXR
//! path data ───┘                                   └─ GPU ─┘
//! ```

pub mod backend;
pub mod batch;
pub mod brdf;
pub mod cli;
pub mod color;
pub mod digest;
pub mod error;
pub mod film;
pub mod kernel;
pub mod light;
pub mod metrics;
pub mod outline;
pub mod picture;
pub mod report;
pub mod scene;
pub mod shape;
pub mod stress;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
