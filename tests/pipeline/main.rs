//! The test suite: one binary, one module per stage.

mod film;
mod mesh;
mod preset;
