//! Buffers: upload and reading back.

use super::boxes::Boxes;
use super::device::Device;
use super::layout::{Emitters, Frame};
use super::order::Ordered;
use super::pipelines::ARRAYS;
use crate::backend::BackendError;
use crate::backend::prepared::Prepared;
use crate::backend::stage::{Kept, Reuse};
use crate::brdf::ltc::Table;
use bytemuck::Pod;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{Buffer, BufferDescriptor, BufferUsages};

/// What one of the scene's buffers is to hold.
pub struct Content<'a> {
    what: &'static str,
    bytes: &'a [u8],
    /// It is what it was for the picture before.
    is_kept: bool,
}

/// Bytes that nothing reads, in place of none; they hold one element of any kind.
const NOTHING: [u8; 512] = [0; 512];

/// What bindings 1 and on of a scene hold. `boxes` holds the triangles; the light meter has no surfaces.
pub fn contents<'a>(
    prepared: Option<&'a Prepared>,
    boxes: &'a Boxes,
    emitters: &'a Emitters,
    ordered: &'a Ordered,
    kept: Kept,
) -> [Content<'a>; ARRAYS] {
    fn of<'a, T: Pod>(what: &'static str, data: &'a [T], is_kept: bool) -> Content<'a> {
        let bytes = bytemuck::cast_slice(data);
        Content { what, bytes: if bytes.is_empty() { &NOTHING } else { bytes }, is_kept }
    }
    let Kept { surfaces, textures, regions } = kept;
    [
        of("triangles", &boxes.triangles, surfaces),
        of("materials", prepared.map_or(&[], |p| &p.materials), textures),
        of("textures", prepared.map_or(&[], |p| &p.textures), textures),
        of("texels", prepared.map_or(&[], |p| &p.texels), textures),
        of("emitters", &ordered.emitters, false),
        of("regions of lights", emitters.regions.bytes(), regions),
        of("details of lights", emitters.details.bytes(), regions),
        of("LTC table", Table::shipped().texels().as_flattened(), true),
        of("boxes", &boxes.boxes, surfaces),
        of("pictures of lights", emitters.pictures.bytes(), regions),
        of("texels of lights", emitters.picture_texels.bytes(), regions),
        of("boxes of lights", &ordered.boxes, false),
        of("clusters of lights", &ordered.clusters, false),
    ]
}

/// The buffers of group 0, in the order of their bindings.
pub struct SceneBuffers {
    /// The uniform [`Frame`].
    pub frame: Buffer,
    /// Bindings 1 and on.
    pub arrays: Vec<Buffer>,
}

impl SceneBuffers {
    /// Uploads a scene.
    pub fn new(device: &Device, contents: &[Content<'_>]) -> Result<Self, BackendError> {
        let arrays = contents.iter().map(|c| storage(device, c.what, c.bytes)).collect::<Result<_, _>>()?;
        let frame = device.device.create_buffer(&BufferDescriptor {
            label: Some("frame"),
            size: size_of::<Frame>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self { frame, arrays })
    }

    /// Uploads what is not kept of the next picture's contents, into the same buffers where it is as long as what they hold.
    /// Whether there are others now, to be bound anew.
    pub fn renew(&mut self, device: &Device, contents: &[Content<'_>]) -> Result<bool, BackendError> {
        let mut are_others = false;
        for (array, content) in self.arrays.iter_mut().zip(contents) {
            if content.is_kept {
                continue;
            }
            if array.size() == content.bytes.len() as u64 {
                device.queue.write_buffer(array, 0, content.bytes);
            } else {
                *array = storage(device, content.what, content.bytes)?;
                are_others = true;
            }
        }
        Ok(are_others)
    }
}

/// Counts the buffers that are uploaded and those that are not, of which there were none before the first picture.
pub fn count(contents: &[Content<'_>], are_there: bool, reuse: &mut Reuse) {
    for content in contents {
        reuse.count("buffers", are_there && content.is_kept);
    }
}

/// Uploads an array for reading. An empty one becomes one element of zeros, which nothing reads.
pub fn storage<T: Pod>(device: &Device, what: &'static str, data: &[T]) -> Result<Buffer, BackendError> {
    device.check_size(what, size_of_val(data) as u64)?;
    let zero = [T::zeroed()];
    let contents = bytemuck::cast_slice(if data.is_empty() { &zero } else { data });
    Ok(device.device.create_buffer_init(&BufferInitDescriptor {
        label: Some(what),
        contents,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
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
