//! The bytes of a mesh: GLB chunks, buffers by URI, accessors. Every reach is checked against what is there.

use super::{Located, MAX_BYTES, MeshProblem};
use crate::scene::folder::Folder;
use gltf::accessor::{DataType, Dimensions};
use gltf::json;

/// Most elements of an accessor.
const MAX_ELEMENTS: u64 = 50_000_000;

/// JSON and binary chunk of a GLB (glTF 2.0, section 4.4); a `.gltf` is all JSON.
pub(super) fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshProblem> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if word(4) != Some(2) {
        return Err(MeshProblem::Container("the version is not 2"));
    }
    let length = word(8).map(|l| l as usize).filter(|l| *l <= bytes.len());
    let length = length.ok_or(MeshProblem::Container("the file is shorter than its header says"))?;
    let chunk = |at: usize| -> Option<(&[u8; 4], &[u8])> {
        let kind = bytes.get(at + 4..at + 8)?.first_chunk::<4>()?;
        let end = (at + 8).checked_add(word(at)? as usize).filter(|end| *end <= length)?;
        Some((kind, &bytes[at + 8..end]))
    };
    let Some((b"JSON", json)) = chunk(12) else {
        return Err(MeshProblem::Container("no whole JSON chunk at its start"));
    };
    let next = 20 + json.len().next_multiple_of(4);
    if next >= length {
        return Ok((json, None));
    }
    match chunk(next) {
        Some((b"BIN\0", binary)) => Ok((json, Some(binary))),
        Some(_) => Ok((json, None)),
        None => Err(MeshProblem::Container("the second chunk is cut off")),
    }
}

/// All buffers of a mesh file, and the folder for its images.
#[derive(Debug)]
pub(super) struct Buffers {
    data: Vec<Vec<u8>>,
    folder: Folder,
}

impl Buffers {
    /// Reads every buffer; `blob` is the binary chunk.
    pub(super) fn load(root: &json::Root, blob: Option<&[u8]>, folder: Folder) -> Result<Self, Located> {
        let mut buffers = Self { data: Vec::new(), folder };
        for (i, buffer) in root.buffers.iter().enumerate() {
            let element = format!("buffers[{i}]");
            let data = match (&buffer.uri, blob) {
                (Some(uri), _) => buffers.fetch(uri).map_err(|e| e.at(element.as_str()))?,
                (None, Some(blob)) if i == 0 => blob.to_vec(),
                (None, _) => return Err(MeshProblem::Container("no binary chunk for a buffer without uri").at(element)),
            };
            let (end, available) = (buffer.byte_length.0, data.len() as u64);
            if end > available {
                return Err(MeshProblem::OutOfBounds { end, available }.at(element));
            }
            buffers.data.push(data);
        }
        Ok(buffers)
    }

    /// The bytes behind a URI: base64 data, or a file beside the mesh.
    pub(super) fn fetch(&self, uri: &str) -> Result<Vec<u8>, MeshProblem> {
        let refuse = || MeshProblem::Uri(uri.chars().take(80).collect());
        if uri.starts_with("data:") {
            // Without a base the crate decodes data and opens no file.
            let data = gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None);
            return data.map(|d| d.0).map_err(|_| refuse());
        }
        if uri.contains(':') {
            return Err(refuse());
        }
        let name = percent_decode(uri).ok_or_else(refuse)?;
        Ok(self.folder.read(&name, MAX_BYTES)?)
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, root: &json::Root, index: usize) -> Result<&[u8], Located> {
        let element = || format!("bufferViews[{index}]");
        let out_of_bounds = |end, available: usize| MeshProblem::OutOfBounds { end, available: available as u64 };
        let count = root.buffer_views.len();
        let view = root.buffer_views.get(index).ok_or_else(|| out_of_bounds(index as u64, count).at(element()))?;
        let data = self.data.get(view.buffer.value()).ok_or_else(|| out_of_bounds(0, 0).at(element()))?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let end = start.saturating_add(view.byte_length.0);
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
        range.and_then(|(s, e)| data.get(s..e)).ok_or_else(|| out_of_bounds(end, data.len()).at(element()))
    }

    /// The elements of an accessor as vectors of `N` floats; integers are normalised if the accessor says so.
    pub(super) fn floats<const N: usize>(
        &self,
        root: &json::Root,
        accessor: &gltf::Accessor<'_>,
    ) -> Result<Vec<[f32; N]>, Located> {
        let wanted = match N {
            2 => "VEC2",
            3 => "VEC3",
            _ => "VEC4",
        };
        let element = || format!("accessors[{}]", accessor.index());
        if accessor.dimensions().multiplicity() != N || matches!(accessor.dimensions(), Dimensions::Mat2) {
            return Err(wrong_type(accessor, wanted).at(element()));
        }
        let (kind, normalized) = (accessor.data_type(), accessor.normalized());
        let values = self.elements(root, accessor, |bytes| {
            let size = kind.size();
            core::array::from_fn::<f32, N, _>(|i| component(kind, normalized, &bytes[i * size..(i + 1) * size]))
        })?;
        match values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            Some(bad) => Err(MeshProblem::NotFinite(bad).at(element())),
            None => Ok(values),
        }
    }

    /// The elements of an accessor as indices.
    pub(super) fn indices(&self, root: &json::Root, accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, Located> {
        let whole = matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
        if !whole || accessor.dimensions() != Dimensions::Scalar {
            return Err(
                wrong_type(accessor, "SCALAR of unsigned integers").at(format!("accessors[{}]", accessor.index()))
            );
        }
        self.elements(root, accessor, little_endian)
    }

    /// Walks an accessor, sparse or not. `read` gets exactly the bytes of one element.
    fn elements<T: Clone>(
        &self,
        root: &json::Root,
        accessor: &gltf::Accessor<'_>,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Located> {
        let index = accessor.index();
        let element = || format!("accessors[{index}]");
        let json = &root.accessors[index];
        let (count, size) = (json.count.0, accessor.size());
        if count > MAX_ELEMENTS {
            return Err(MeshProblem::TooMany { count, limit: MAX_ELEMENTS }.at(element()));
        }
        let count = count as usize;
        let mut values = match json.buffer_view {
            None => vec![read(&vec![0; size]); count],
            Some(view) => {
                let data = self.view(root, view.value())?;
                let stride = root.buffer_views[view.value()].byte_stride.map_or(size, |s| s.0).max(1);
                let offset = json.byte_offset.map_or(0, |o| o.0);
                strided(data, offset, stride, size, count).map_err(|e| e.at(element()))?.map(&read).collect()
            }
        };
        if let Some(sparse) = &json.sparse {
            let n = sparse.count.0.min(MAX_ELEMENTS) as usize;
            let kind = match sparse.indices.component_type {
                json::validation::Checked::Valid(kind) => kind.0.size(),
                json::validation::Checked::Invalid => return Err(wrong_type(accessor, "sparse indices").at(element())),
            };
            let at = self.view(root, sparse.indices.buffer_view.value())?;
            let at = strided(at, sparse.indices.byte_offset.0, kind, kind, n).map_err(|e| e.at(element()))?;
            let new = self.view(root, sparse.values.buffer_view.value())?;
            let new = strided(new, sparse.values.byte_offset.0, size, size, n).map_err(|e| e.at(element()))?;
            for (at, new) in at.map(little_endian).zip(new) {
                let slot = values.get_mut(at as usize);
                *slot.ok_or_else(|| MeshProblem::Index { index: at, vertices: count }.at(element()))? = read(new);
            }
        }
        Ok(values)
    }
}

/// `count` slices of `size` bytes, `stride` apart, all inside `data`.
fn strided(
    data: &[u8],
    offset: u64,
    stride: usize,
    size: usize,
    count: usize,
) -> Result<impl Iterator<Item = &[u8]>, MeshProblem> {
    let last = (count as u64).saturating_sub(1).saturating_mul(stride as u64);
    let end = if count == 0 { 0 } else { offset.saturating_add(last).saturating_add(size as u64) };
    if end > data.len() as u64 {
        return Err(MeshProblem::OutOfBounds { end, available: data.len() as u64 });
    }
    Ok((0..count).map(move |i| &data[offset as usize + i * stride..][..size]))
}

/// An unsigned integer of 1, 2 or 4 bytes.
fn little_endian(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, byte| (value << 8) | u32::from(*byte))
}

/// One component as a float (glTF 2.0, section 3.11 for the normalised ones).
fn component(kind: DataType, normalized: bool, bytes: &[u8]) -> f32 {
    let bits = little_endian(bytes);
    let (value, unit) = match kind {
        DataType::F32 => return f32::from_bits(bits),
        DataType::I8 => (f32::from(bits as u8 as i8), 127.0),
        DataType::U8 => (bits as f32, 255.0),
        DataType::I16 => (f32::from(bits as u16 as i16), 32767.0),
        DataType::U16 => (bits as f32, 65535.0),
        DataType::U32 => (bits as f32, u32::MAX as f32),
    };
    if normalized { (value / unit).max(-1.0) } else { value }
}

fn wrong_type(accessor: &gltf::Accessor<'_>, wanted: &'static str) -> MeshProblem {
    MeshProblem::Type { found: format!("{:?} of {:?}", accessor.dimensions(), accessor.data_type()), wanted }
}

/// A URI's path with its `%xx` resolved, or nothing where that isn't UTF-8.
fn percent_decode(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let digits = after.first_chunk::<2>().filter(|d| d.iter().all(u8::is_ascii_hexdigit));
        match (byte, digits) {
            (b'%', Some(digits)) => {
                bytes.push(u8::from_str_radix(core::str::from_utf8(digits).ok()?, 16).ok()?);
                rest = &after[2..];
            }
            (b'%', None) => return None,
            _ => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).ok()
}
