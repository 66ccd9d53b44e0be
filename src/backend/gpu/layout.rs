//! What the shaders read and write, byte for byte: twins of the structs of `shaders/types.wgsl` that are not kernel types.
//! Positions are relative to the camera, in metres.

use crate::backend::prepared::{self, Prepared};
use crate::kernel::surface::Rays;
use crate::kernel::tree::{Handles, Node};
use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3, Vec4};

/// One dispatch: a sample of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Frame {
    /// The camera.
    pub rays: Rays,
    /// From the picture's −1..1 to the tile's, border included: scale x, scale y, shift x, shift y.
    pub raster: Vec4,
    /// Pixels of the picture.
    pub picture: UVec2,
    /// The tile's first pixel in the picture.
    pub tile_origin: UVec2,
    /// Pixels of the tile, without its border.
    pub tile_size: UVec2,
    /// The sample's place in its pixel, 0..1, y down.
    pub offset: Vec2,
    /// Width and height of a pixel where the picture is −1..1.
    pub steps: Vec2,
    /// Largest error of the picture's radiance by integration, W·sr⁻¹·m⁻².
    pub tolerance: f32,
    /// Number of emitters.
    pub emitters: u32,
    /// Number of boxes.
    pub boxes: u32,
    /// Number of lights.
    pub lights: u32,
    /// To the size WGSL gives the struct.
    pub pad: UVec2,
}

/// An emission. The axes and the middle are those of its tree's square.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Emitter {
    /// World image of the tree's x axis.
    pub x: Vec3,
    /// First of its nodes.
    pub first_node: u32,
    /// World image of the tree's y axis.
    pub y: Vec3,
    /// Past the last of its nodes.
    pub end_node: u32,
    /// The tree's middle.
    pub center: Vec3,
    /// First of its handles.
    pub first_handles: u32,
    /// x × y.
    pub normal: Vec3,
    /// Index of its light. The emitters of a light follow one another.
    pub light: u32,
    /// W·sr⁻¹·m⁻², linear Rec.709.
    pub radiance: Vec3,
    /// 1 where the back emits as well.
    pub two_sided: u32,
}

impl Emitter {
    fn new(emitter: &prepared::Emitter, first_node: usize, first_handles: usize) -> Self {
        let (placement, tree) = (&emitter.placement, &emitter.tree);
        let (x, y) = (placement.x * tree.half, placement.y * tree.half);
        Self {
            x: x.as_vec3(),
            first_node: first_node as u32,
            y: y.as_vec3(),
            end_node: (first_node + tree.nodes.len()) as u32,
            center: placement.point(tree.center).as_vec3(),
            first_handles: first_handles as u32,
            normal: x.cross(y).as_vec3(),
            light: emitter.light as u32,
            radiance: emitter.radiance,
            two_sided: u32::from(emitter.two_sided),
        }
    }
}

/// All emitters with their trees, one after the other.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    /// The emitters.
    pub emitters: Vec<Emitter>,
    /// The nodes of all trees.
    pub nodes: Vec<Node>,
    /// The handles of all trees.
    pub handles: Vec<Handles>,
}

impl Emitters {
    /// Lays the trees of `emitters` one after the other.
    pub fn new(emitters: &[prepared::Emitter]) -> Self {
        let mut all = Self::default();
        for emitter in emitters {
            all.emitters.push(Emitter::new(emitter, all.nodes.len(), all.handles.len()));
            all.nodes.extend_from_slice(&emitter.tree.nodes);
            all.handles.extend_from_slice(&emitter.tree.handles);
        }
        all
    }
}

/// What the samples of a pixel have added up to.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Reflected by the diffuse part, summed over samples.
    pub diffuse: Vec3,
    /// Samples that met a surface (lower 16 bits); carries of `nodes` (upper 16 bits).
    pub samples: u32,
    /// Reflected by the specular part, summed over samples.
    pub specular: Vec3,
    /// Tree nodes visited, lower 32 bits.
    pub nodes: u32,
}

impl Pixel {
    /// Samples that met a surface.
    pub fn shaded(&self) -> u32 {
        self.samples & 0xffff
    }

    /// Tree nodes visited.
    pub fn visited(&self) -> u64 {
        u64::from(self.samples >> 16) << 32 | u64::from(self.nodes)
    }
}

/// A box around triangles, in pre-order.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Box {
    /// Lowest corner.
    pub low: Vec3,
    /// Where the walk goes on past it.
    pub skip: u32,
    /// Highest corner.
    pub high: Vec3,
    /// Of a leaf: first triangle and, in the lowest [`BOX_COUNT_BITS`] bits, their number; 0 for an inner box.
    pub triangles: u32,
}

/// Bits that hold the number of triangles in a [`Box`].
pub const BOX_COUNT_BITS: u32 = 3;

/// Where and how the light meter measures.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeterPoint {
    /// Relative to the camera.
    pub position: Vec3,
    /// Index of the emitter.
    pub emitter: u32,
    /// Unit.
    pub normal: Vec3,
    /// GGX width of the specular lobe.
    pub alpha: f32,
    /// Unit vector towards the eye.
    pub view: Vec3,
    /// Largest error of each integral.
    pub tolerance: f32,
}

/// What the light meter reads. Integrals are normalised: 1 for a full hemisphere.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Reading {
    /// Of the plain cosine.
    pub diffuse: f32,
    /// Of the specular lobe, clipped at both horizons.
    pub specular: f32,
    /// Nodes visited for the first.
    pub diffuse_nodes: u32,
    /// Nodes visited for the second.
    pub specular_nodes: u32,
}

/// Parts of the shaders that a scene may do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Features {
    /// Some material has a diffuse part.
    pub diffuse: bool,
    /// Some material has a specular lobe.
    pub specular: bool,
    /// Some material has a texture.
    pub textures: bool,
}

impl Features {
    /// What a scene needs.
    pub fn of(prepared: &Prepared) -> Self {
        let none = crate::kernel::surface::NO_TEXTURE;
        let materials = &prepared.materials;
        Self {
            // A metallic texture only lowers the metallic value.
            diffuse: materials.iter().any(|m| {
                let black = m.base_color.truncate().max_element() <= 0.0;
                !black && (m.base_color.w < 1.0 || m.metallic_roughness_texture != none)
            }),
            specular: materials.iter().any(|m| m.specular > 0.0 || m.base_color.w > 0.0),
            textures: materials.iter().any(|m| {
                [m.base_color_texture, m.metallic_roughness_texture, m.normal_texture].iter().any(|&t| t != none)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_counts_beyond_32_bits() {
        let pixel = Pixel { samples: 3 << 16 | 4096, nodes: 7, ..Pixel::zeroed() };
        assert_eq!((pixel.shaded(), pixel.visited()), (4096, (3 << 32) + 7));
    }
}
