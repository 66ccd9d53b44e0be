//! The test suite: one binary, one module per stage.

#[cfg(feature = "gpu")]
mod backends;
mod cases;
mod kernel;
