//! The test suite: one binary, one module per stage.

mod fonts;
mod mask;
mod shape;
mod text;
