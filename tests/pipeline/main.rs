//! The test suite: one binary, one module per stage.

#[cfg(feature = "gpu")]
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
#[cfg(feature = "gpu")]
mod shaders;
mod shape;
mod text;
