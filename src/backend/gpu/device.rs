//! The adapter and its device.

use super::AdapterChoice;
use crate::backend::BackendError;
use std::sync::{Arc, Mutex};
use wgpu::{Adapter, AdapterInfo, Backends, DeviceType, Instance, InstanceDescriptor};

/// Storage buffers of the largest pass.
const STORAGE_BUFFERS: u32 = 15;

/// An open device.
#[derive(Debug)]
pub struct Device {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter's name.
    pub adapter: String,
    /// Adapter, driver and interface.
    pub name: String,
    /// Whether passes can be timed by the device itself.
    pub has_timestamps: bool,
    /// The first error since the last look.
    error: Arc<Mutex<Option<String>>>,
}

impl Device {
    /// Opens the best adapter of the wanted kind, with all that it allows.
    pub fn open(choice: AdapterChoice) -> Result<Self, BackendError> {
        if choice == AdapterChoice::Hardware && !hardware_is_possible() {
            return Err(BackendError::NoAdapter("the system has no graphics device".into()));
        }
        let instance = Instance::new(InstanceDescriptor::new_without_display_handle());
        let mut adapters = pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY));
        let seen: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        adapters.retain(|a| choice == AdapterChoice::Any || rank(&a.get_info()) < SOFTWARE);
        adapters.sort_by_key(|a| rank(&a.get_info()));
        let Some(adapter) = adapters.first() else {
            let missing = match (choice, seen.is_empty()) {
                (_, true) => "the system offers none (no Vulkan driver)".into(),
                (_, false) => format!("the system offers software only ({})", seen.join(", ")),
            };
            return Err(BackendError::NoAdapter(missing));
        };
        Self::from_adapter(adapter)
    }

    fn from_adapter(adapter: &Adapter) -> Result<Self, BackendError> {
        let info = adapter.get_info();
        let limits = adapter.limits();
        if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
            let allowed = limits.max_storage_buffers_per_shader_stage;
            let name = info.name;
            return Err(BackendError::NoAdapter(format!(
                "{name} allows {allowed} storage buffers in a shader; {STORAGE_BUFFERS} are needed"
            )));
        }
        let timestamps = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("glyphlight"),
            required_features: timestamps,
            required_limits: limits,
            memory_hints: wgpu::MemoryHints::Performance,
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| BackendError::NoAdapter(format!("{}: {e}", info.name)))?;
        let error = Arc::new(Mutex::new(None));
        let first = error.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep_first(&first, e.to_string())));
        let first = error.clone();
        device.set_device_lost_callback(move |_, message| keep_first(&first, format!("device lost: {message}")));
        let driver = format!("{} {}", info.driver, info.driver_info);
        let name = format!("{}, {}, {}", info.name, driver.trim(), info.backend);
        Ok(Self { device, queue, adapter: info.name, name, has_timestamps: !timestamps.is_empty(), error })
    }

    /// The first error since the last call.
    pub fn check(&self) -> Result<(), BackendError> {
        match self.error.lock().map(|mut e| e.take()) {
            Ok(None) => Ok(()),
            Ok(Some(message)) => Err(BackendError::Device(message)),
            Err(poisoned) => Err(BackendError::Device(poisoned.to_string())),
        }
    }

    /// Whether a storage buffer may have that size.
    pub fn check_size(&self, what: &'static str, needed: u64) -> Result<(), BackendError> {
        let limits = self.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if needed > limit {
            return Err(BackendError::TooLarge { what, needed, limit, adapter: self.adapter.clone() });
        }
        Ok(())
    }

    /// Waits until the queue is idle.
    pub fn wait(&self) -> Result<(), BackendError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map(|_| ()).map_err(|e| BackendError::Device(e.to_string()))
    }
}

fn keep_first(error: &Mutex<Option<String>>, message: String) {
    if let Ok(mut error) = error.lock() {
        error.get_or_insert(message);
    }
}

const SOFTWARE: u32 = 4;

/// The best first; software last.
fn rank(info: &AdapterInfo) -> u32 {
    match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => SOFTWARE,
    }
}

/// Whether there can be a hardware adapter. On Linux it has a device file; without one, loading the drivers would cost
/// time, and lines of theirs on standard error, for nothing.
fn hardware_is_possible() -> bool {
    const DEVICES: [&str; 6] =
        ["/dev/dri", "/dev/nvidiactl", "/dev/nvidia0", "/dev/dxg", "/dev/kgsl-3d0", "/dev/mali0"];
    !cfg!(target_os = "linux") || DEVICES.iter().any(|device| std::path::Path::new(device).exists())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_buffer_beyond_the_limit_is_refused() {
        let device = match Device::open(AdapterChoice::Any) {
            Ok(device) => device,
            Err(error) => {
                let required = ["CI", "GLYPHLIGHT_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
                assert!(!required, "a GPU is required here: {error}");
                let line = format!("SKIPPED: the GPU's limits were NOT tested: {error}\n");
                std::io::stderr().write_all(line.as_bytes()).unwrap();
                return;
            }
        };
        let limits = device.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        assert!(device.check_size("triangles", limit).is_ok());
        let refused = device.check_size("triangles", limit + 1);
        assert!(
            matches!(refused, Err(BackendError::TooLarge { what: "triangles", needed, .. }) if needed == limit + 1)
        );
    }
}
