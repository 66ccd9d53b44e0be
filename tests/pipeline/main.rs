//! The test suite: one binary, one module per stage.

mod cases;
mod fonts;
mod kernel;
mod mask;
mod shape;
mod text;
