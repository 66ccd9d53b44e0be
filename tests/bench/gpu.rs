//! The GPU, if this is built with it.

use glyphlight::backend::{Backend, BackendError};

#[cfg(feature = "gpu")]
pub fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    use glyphlight::backend::gpu::{AdapterChoice, GpuBackend};
    Ok(Box::new(GpuBackend::new(AdapterChoice::Any)?))
}

#[cfg(not(feature = "gpu"))]
pub fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NoAdapter("built without the feature `gpu`".into()))
}
