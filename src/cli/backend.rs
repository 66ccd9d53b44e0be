//! Where to compute, by the flag that all verbs share.

use super::progress;
use crate::backend::cpu::CpuBackend;
#[cfg(feature = "gpu")]
use crate::backend::gpu::{AdapterChoice, GpuBackend};
use crate::backend::{Backend, BackendError, Horizons, Rendering, Session, Settings, Technique, reference};
use crate::scene::{Motion, Scene};
#[cfg(feature = "gpu")]
use crate::stress::meter::Gpu;
use crate::stress::meter::{Cpu, Meter};
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
        if self.on_cpu(technique) {
            return Ok(&CpuBackend);
        }
        self.gpu()
    }

    /// Where that is: `Cpu` or `Gpu`.
    ///
    /// # Errors
    /// There is no GPU and it was asked for.
    pub fn kind(&self, technique: &Technique) -> Result<BackendArg, BackendError> {
        #[cfg(feature = "gpu")]
        if !self.on_cpu(technique) && self.open_gpu()?.is_some() {
            return Ok(BackendArg::Gpu);
        }
        self.of(technique).map(|_| BackendArg::Cpu)
    }

    /// What measures single integrals by a technique.
    ///
    /// # Errors
    /// There is no GPU and it was asked for, or it does not have the technique.
    pub fn meter(&self, technique: Technique, horizons: Horizons) -> Result<Box<dyn Meter + '_>, BackendError> {
        if self.on_cpu(&technique) {
            return Ok(Box::new(Cpu { technique, horizons }));
        }
        self.gpu_meter(technique, horizons)
    }

    fn on_cpu(&self, technique: &Technique) -> bool {
        self.wanted == BackendArg::Cpu || technique.is_cpu_only() && self.wanted == BackendArg::Auto
    }

    /// Renders on the backend for the technique; the Monte Carlo reference with a progress bar.
    ///
    /// # Errors
    /// What the backend says.
    pub fn render(&self, scene: &Scene, settings: &Settings) -> Result<Rendering, BackendError> {
        match (&settings.technique, self.wanted) {
            (Technique::Reference(sampling), BackendArg::Auto | BackendArg::Cpu) => {
                progress::shown("sampling", |report| reference::render(scene, settings, sampling, report))
            }
            (technique, _) => self.of(technique)?.render(scene, settings),
        }
    }

    /// Begins a sequence of pictures on the backend for the technique.
    ///
    /// # Errors
    /// What the backend says.
    pub fn begin<'a>(
        &'a self,
        scene: &'a Scene,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Box<dyn Session + 'a>, BackendError> {
        self.of(&settings.technique)?.begin(scene, motion, settings)
    }

    #[cfg(feature = "gpu")]
    fn gpu(&self) -> Result<&dyn Backend, BackendError> {
        Ok(self.open_gpu()?.map_or(&CpuBackend as &dyn Backend, |gpu| gpu))
    }

    #[cfg(feature = "gpu")]
    fn gpu_meter(&self, technique: Technique, horizons: Horizons) -> Result<Box<dyn Meter + '_>, BackendError> {
        match self.open_gpu()? {
            Some(_) if technique.is_cpu_only() => Err(BackendError::CpuOnly(technique.name())),
            Some(backend) => Ok(Box::new(Gpu { backend, technique, horizons })),
            None => Ok(Box::new(Cpu { technique, horizons })),
        }
    }

    /// The GPU; `None` where the CPU will do and there is no hardware.
    #[cfg(feature = "gpu")]
    fn open_gpu(&self) -> Result<Option<&GpuBackend>, BackendError> {
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
        Ok(self.gpu.get().and_then(Option::as_ref))
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu_meter(&self, technique: Technique, horizons: Horizons) -> Result<Box<dyn Meter + '_>, BackendError> {
        self.gpu().map(|_| Box::new(Cpu { technique, horizons }) as Box<dyn Meter>)
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(&self) -> Result<&dyn Backend, BackendError> {
        match self.wanted {
            BackendArg::Auto => Ok(&CpuBackend),
            _ => Err(BackendError::NoAdapter("built without the feature `gpu`".into())),
        }
    }
}
