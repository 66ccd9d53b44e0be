//! The test suite: one binary, one module per stage.

mod film;
mod fonts;
mod mask;
mod mesh;
mod preset;
mod scene;
mod shape;
mod text;
