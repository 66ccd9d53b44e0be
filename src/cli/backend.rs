//! Where to compute, by the flag that all verbs share.

use crate::backend::cpu::CpuBackend;
#[cfg(feature = "gpu")]
use crate::backend::gpu::{AdapterChoice, GpuBackend};
use crate::backend::{Backend, BackendError, Technique};
use clap::ValueEnum;
#[cfg(feature = "gpu")]
use std::cell::OnceCell;

/// Where to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendArg {
    Auto,
    Cpu,
    Gpu,
}

/// The backends, each opened when it is first wanted.
#[derive(Debug)]
pub struct Backends {
    wanted: BackendArg,
    #[cfg(feature = "gpu")]
    gpu: OnceCell<Option<GpuBackend>>,
}

impl Backends {
    pub fn new(wanted: BackendArg) -> Self {
        Self {
            wanted,
            #[cfg(feature = "gpu")]
            gpu: OnceCell::new(),
        }
    }

    /// The backend for a technique. `auto` is the CPU for those that run nowhere else, and where there is no hardware GPU.
    ///
    /// # Errors
    /// There is no GPU and it was asked for.
    pub fn of(&self, technique: &Technique) -> Result<&dyn Backend, BackendError> {
        if self.wanted == BackendArg::Cpu || technique.is_cpu_only() && self.wanted == BackendArg::Auto {
            return Ok(&CpuBackend);
        }
        self.gpu()
    }

    #[cfg(feature = "gpu")]
    fn gpu(&self) -> Result<&dyn Backend, BackendError> {
        if self.gpu.get().is_none() {
            let opened = match self.wanted {
                BackendArg::Auto => match GpuBackend::new(AdapterChoice::Hardware) {
                    Err(BackendError::NoAdapter(_)) => None,
                    found => Some(found?),
                },
                _ => Some(GpuBackend::new(AdapterChoice::Any)?),
            };
            // Nobody else can have opened it meanwhile.
            let _ = self.gpu.set(opened);
        }
        Ok(self.gpu.get().and_then(Option::as_ref).map_or(&CpuBackend as &dyn Backend, |gpu| gpu))
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(&self) -> Result<&dyn Backend, BackendError> {
        match self.wanted {
            BackendArg::Auto => Ok(&CpuBackend),
            _ => Err(BackendError::NoAdapter("built without the feature `gpu`".into())),
        }
    }
}
