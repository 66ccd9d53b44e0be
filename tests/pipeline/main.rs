//! The test suite: one binary, one module per stage.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "tests report what they measure and what they skip")]

mod approximations;
mod backends;
mod batch;
mod batch_plan;
mod bench;
mod brdf;
mod browser;
mod cases;
mod cli;
mod clusters;
mod compare;
mod edges;
mod film;
mod fonts;
#[cfg(feature = "gpu")]
mod frames;
mod fuzz_finds;
mod kernel;
mod mask;
mod mesh;
mod metrics;
mod mosaic;
mod packets;
mod page;
mod paint;
mod painter;
mod pal;
mod polygon;
mod prefilter;
mod preset;
mod quad;
mod reference;
mod representative;
mod roots;
mod scene;
mod shaders;
mod shape;
mod simple;
mod stress;
mod svg;
mod svg_hostile;
mod text;
mod tile;
#[cfg(feature = "gpu")]
mod windows;
mod yardstick;
