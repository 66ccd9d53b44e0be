//! The test suite: one binary, one module per stage.
mod brdf;
