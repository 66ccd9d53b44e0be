//! The test suite: one binary, one module per stage.

mod cases;
mod film;
mod fonts;
mod kernel;
mod mask;
mod mesh;
mod preset;
mod shape;
mod text;
