//! The test suite: one binary, one module per stage.

mod backends;
mod brdf;
mod cases;
mod film;
mod fonts;
mod kernel;
mod mask;
mod mesh;
mod preset;
mod scene;
mod shaders;
mod shape;
mod text;
