//! The test suite: one binary, one module per stage.

mod film;
mod fonts;
mod mesh;
mod preset;
mod scene;
mod text;
