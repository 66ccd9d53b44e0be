//! Buffers: upload and reading back.

use super::boxes::Boxes;
use super::device::Device;
use super::layout::{Elements, Emitters, Frame};
use crate::backend::BackendError;
use crate::backend::prepared::Prepared;
use crate::brdf::ltc::Table;
use bytemuck::Pod;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{Buffer, BufferDescriptor, BufferUsages};

/// The buffers of group 0, in the order of their bindings.
pub struct SceneBuffers {
    /// The uniform [`Frame`].
    pub frame: Buffer,
    /// Bindings 1 and on.
    pub arrays: Vec<Buffer>,
}

impl SceneBuffers {
    /// Uploads a scene. `boxes` holds the triangles; the light meter has no surfaces.
    pub fn new(
        device: &Device,
        prepared: Option<&Prepared>,
        boxes: &Boxes,
        emitters: &Emitters,
    ) -> Result<Self, BackendError> {
        let arrays = vec![
            storage(device, "triangles", &boxes.triangles)?,
            storage(device, "materials", prepared.map_or(&[], |p| &p.materials))?,
            storage(device, "textures", prepared.map_or(&[], |p| &p.textures))?,
            storage(device, "texels", prepared.map_or(&[], |p| &p.texels))?,
            storage(device, "emitters", &emitters.emitters)?,
            elements(device, "regions of lights", &emitters.regions)?,
            elements(device, "details of lights", &emitters.details)?,
            storage(device, "LTC table", Table::shipped().texels().as_flattened())?,
            storage(device, "boxes", &boxes.boxes)?,
            elements(device, "pictures of lights", &emitters.pictures)?,
            elements(device, "texels of lights", &emitters.picture_texels)?,
            storage(device, "boxes of lights", prepared.map_or(&[], |p| &p.boxes))?,
            storage(device, "clusters of lights", prepared.map_or(&[], |p| &p.clustered.tree.clusters))?,
        ];
        let frame = device.device.create_buffer(&BufferDescriptor {
            label: Some("frame"),
            size: size_of::<Frame>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self { frame, arrays })
    }
}

/// Uploads elements for reading. None become 256 zero bytes, which nothing reads and which hold one of any kind.
fn elements(device: &Device, what: &'static str, elements: &Elements) -> Result<Buffer, BackendError> {
    let bytes = elements.bytes();
    storage(device, what, if bytes.is_empty() { &[0; 256] } else { bytes })
}

/// Uploads an array for reading. An empty one becomes one element of zeros, which nothing reads.
pub fn storage<T: Pod>(device: &Device, what: &'static str, data: &[T]) -> Result<Buffer, BackendError> {
    device.check_size(what, size_of_val(data) as u64)?;
    let zero = [T::zeroed()];
    let contents = bytemuck::cast_slice(if data.is_empty() { &zero } else { data });
    Ok(device.device.create_buffer_init(&BufferInitDescriptor {
        label: Some(what),
        contents,
        usage: BufferUsages::STORAGE,
    }))
}

/// A zeroed array to write and to read back.
pub fn target(device: &Device, what: &'static str, bytes: u64) -> Result<Buffer, BackendError> {
    device.check_size(what, bytes)?;
    Ok(device.device.create_buffer(&BufferDescriptor {
        label: Some(what),
        size: bytes,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}

/// A way back from the device for up to `bytes` at a time.
pub struct Readback {
    staging: Buffer,
}

impl Readback {
    /// Makes room.
    pub fn new(device: &Device, bytes: u64) -> Self {
        let staging = device.device.create_buffer(&BufferDescriptor {
            label: Some("read back"),
            size: bytes,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { staging }
    }

    /// Waits for the queue and shows the first `count` elements of a buffer to `look`.
    pub fn read<T: Pod, R>(
        &self,
        device: &Device,
        buffer: &Buffer,
        count: u64,
        look: impl FnOnce(&[T]) -> R,
    ) -> Result<R, BackendError> {
        let bytes = count * size_of::<T>() as u64;
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &self.staging, 0, bytes);
        device.queue.submit([encoder.finish()]);
        let slice = self.staging.slice(..bytes);
        // A failure shows when the range is asked for.
        slice.map_async(wgpu::MapMode::Read, |_| {});
        device.wait()?;
        let view = slice.get_mapped_range().map_err(|e| BackendError::Device(e.to_string()))?;
        let result = look(bytemuck::cast_slice(&view));
        drop(view);
        self.staging.unmap();
        Ok(result)
    }
}
