//! The test suite: one binary, one module per stage.

mod cases;
mod film;
mod fonts;
mod kernel;
mod mask;
mod mesh;
mod painter;
mod preset;
mod shape;
mod svg;
mod svg_hostile;
mod text;
