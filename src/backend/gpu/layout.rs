//! What the shaders read and write, byte for byte: twins of the structs of `shaders/types.wgsl` that are not kernel types.
//! Positions are relative to the camera, in metres.

use crate::backend::Technique;
use crate::backend::emitter::{self, Geometry};
use crate::kernel::pal::Polygon;
use crate::kernel::picture::Level;
use crate::kernel::surface::Rays;
use crate::kernel::tree::{self, LowEnds};
use crate::light::prefilter::Prefiltered;
use crate::light::simple::Facing;
use crate::light::{Form, Square};
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
    /// Number of emitters outside of clusters; they come first.
    pub emitters: u32,
    /// Number of boxes.
    pub boxes: u32,
    /// Number of lights.
    pub lights: u32,
    /// `kuge`: least contribution of a triangle that is subdivided; 0 for the paper's own.
    pub eps: f32,
    /// `uniform`: edges per curve. `pal`: the basis.
    pub choice: u32,
    /// Number of clusters of lights; what tiles are sized by.
    pub clusters: u32,
    /// The clusters' unit of length over a metre.
    pub per_metre: f32,
    /// Which window of how many: `shaders/window.wgsl`.
    pub window: UVec2,
    /// 0, which compilers of shaders don't know: `shaders/wide.wgsl` hides values from them with it.
    pub zero: u32,
    /// Rows of workgroups of the tile from one to the next of the dispatch: what software drivers give a thread, rows that follow one
    /// another, is spread over the tile.
    pub row_step: u32,
    /// Of the layout.
    pub pad: UVec2,
}

impl Frame {
    /// The parameters of a technique, in an otherwise empty frame.
    pub fn of(technique: &Technique) -> Self {
        let (mut eps, mut choice) = (0.0, 0);
        match *technique {
            Technique::Kuge { eps: own } => eps = own.unwrap_or(0.0),
            Technique::Uniform { segments } => choice = segments,
            Technique::Pal { basis } => choice = basis as u32,
            _ => {}
        }
        Self { eps, choice, ..Self::zeroed() }
    }
}

/// An emission. The axes and the middle are those of its square.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Emitter {
    /// World image of the square's x axis: half its side.
    pub x: Vec3,
    /// First element of its region, of the kind that the technique reads.
    pub first: u32,
    /// World image of the square's y axis.
    pub y: Vec3,
    /// Past the last element of its region.
    pub end: u32,
    /// The square's middle.
    pub center: Vec3,
    /// First of the region's details, where the technique has any.
    pub first_detail: u32,
    /// x × y.
    pub normal: Vec3,
    /// Index of its light. The emitters of a light that are outside of clusters follow one another, and those in clusters.
    pub light: u32,
    /// W·sr⁻¹·m⁻², linear Rec.709.
    pub radiance: Vec3,
    /// 1 where the back emits as well.
    pub two_sided: u32,
    /// What it is: 0 outline, 1 rectangle, 2 disc, 3 whole sphere, 4 whole tube; turning to the point, 5 silhouette of a sphere,
    /// 6 side of a tube, 7 rim of a tube's end.
    pub form: u32,
    /// Of the sphere or tube, in halves of the square's side.
    pub radius: f32,
    /// Of the tube; of a rim, its place on the axis. In halves of the square's side.
    pub length: f32,
    /// First level of its picture or [`NO_PICTURE`].
    pub picture: u32,
}

/// "No picture" in [`Emitter`].
pub const NO_PICTURE: u32 = u32::MAX;

impl Emitter {
    /// An emission whose region is still to be laid out.
    fn new(emitter: &emitter::Emitter) -> Self {
        let (placement, Square { center, half }) = (&emitter.placement, emitter.square);
        let (x, y) = (placement.x * half, placement.y * half);
        let in_square = |length: f64| (length / half) as f32;
        let (form, radius, length) = match (emitter.facing, emitter.form) {
            (_, Form::Outline) => (0, 0.0, 0.0),
            (_, Form::Rectangle) => (1, 0.0, 0.0),
            (Facing::Whole, Form::Sphere { radius }) => (3, in_square(radius), 0.0),
            (Facing::Whole, Form::Tube { radius, length }) => (4, in_square(radius), in_square(length)),
            (Facing::Fixed | Facing::Whole, _) => (2, 0.0, 0.0),
            (Facing::Sphere { radius }, _) => (5, in_square(radius), 0.0),
            (Facing::Side { radius }, _) => (6, in_square(radius), 0.0),
            (Facing::End { radius, at }, _) => (7, in_square(radius), in_square(at)),
        };
        Self {
            x: x.as_vec3(),
            first: 0,
            y: y.as_vec3(),
            end: 0,
            center: placement.point(center).as_vec3(),
            first_detail: 0,
            normal: x.cross(y).as_vec3(),
            light: emitter.light as u32,
            radiance: emitter.radiance,
            two_sided: u32::from(emitter.two_sided),
            form,
            radius,
            length,
            picture: NO_PICTURE,
        }
    }
}

/// An array of any elements, as bytes.
#[derive(Clone, Debug, Default)]
pub struct Elements(Vec<u8>);

impl Elements {
    /// Lays elements after those that are there. Gives the indices of the first and past the last, in elements.
    fn extend<T: Pod>(&mut self, elements: &[T]) -> [u32; 2] {
        let first = self.0.len() / size_of::<T>();
        self.0.extend_from_slice(bytemuck::cast_slice(elements));
        [first as u32, (first + elements.len()) as u32]
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// All emitters with their regions, one after the other.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    /// The emitters.
    pub emitters: Vec<Emitter>,
    /// The elements of all regions: nodes of trees, curves, quads, polygons or bodies.
    pub regions: Elements,
    /// Their details: handles of trees, edges of polygons and distances to them.
    pub details: Elements,
    /// Levels of the pictures.
    pub pictures: Elements,
    /// Texels of all levels, two words each.
    pub picture_texels: Elements,
}

impl Emitters {
    /// Lays the regions of `emitters` one after the other.
    pub fn new(emitters: &[emitter::Emitter]) -> Self {
        let mut all = Self::default();
        for emitter in emitters {
            let mut packed = Emitter::new(emitter);
            match &emitter.geometry {
                Geometry::Shape | Geometry::Sampled { .. } => {}
                Geometry::Kuge { curves, .. } | Geometry::Uniform { curves, .. } => {
                    [packed.first, packed.end] = all.regions.extend(curves);
                }
                Geometry::Tree(tree) => {
                    [packed.first, packed.end] = all.regions.extend(&tree.nodes);
                    all.details.extend(&low_pairs(&tree.low));
                    [packed.first_detail, _] = all.details.extend(&handles(&tree.handles));
                }
                Geometry::Polygons(polygons, _) => {
                    let [edge, _] = all.details.extend(&polygons.edges);
                    // Four distances take the place of an edge.
                    let quartet =
                        |d: &[f32]| Vec4::from_array(core::array::from_fn(|i| d.get(i).copied().unwrap_or(0.0)));
                    let quartets: Vec<Vec4> = polygons.texels.chunks(4).map(quartet).collect();
                    let [texel, _] = all.details.extend(&quartets).map(|i| 4 * i);
                    let placed = |p: &Polygon| Polygon {
                        first: p.first + edge,
                        outer: p.outer + edge,
                        end: p.end + edge,
                        texels: p.texels + texel,
                        ..*p
                    };
                    let placed: Vec<Polygon> = polygons.polygons.iter().map(placed).collect();
                    [packed.first, packed.end] = all.regions.extend(&placed);
                }
                Geometry::Solid(solid) => [packed.first, packed.end] = all.regions.extend(&[*solid]),
                Geometry::Quad(quad) => [packed.first, packed.end] = all.regions.extend(&[*quad]),
                Geometry::Mosaic(mosaic) => {
                    [packed.first, packed.end] = all.regions.extend(&mosaic.nodes);
                    [packed.first_detail, _] = all.details.extend(&handles(&mosaic.handles));
                    [packed.picture, _] = all.pictures.extend(&mosaic.tiles);
                }
            }
            if let Some(colors) = &emitter.colors {
                packed.picture = all.picture(colors);
            }
            all.emitters.push(packed);
        }
        all
    }

    /// Where the emitters stand now and how they shine; the regions are those that are laid out.
    pub fn moved(&mut self, emitters: &[emitter::Emitter]) {
        for (packed, emitter) in self.emitters.iter_mut().zip(emitters) {
            let Emitter { first, end, first_detail, picture, .. } = *packed;
            *packed = Emitter { first, end, first_detail, picture, ..Emitter::new(emitter) };
        }
    }

    /// Elements of all regions, and of the longest.
    pub fn elements(&self) -> [u32; 2] {
        self.emitters.iter().fold([0; 2], |[past, most], e| [past.max(e.end), most.max(e.end - e.first)])
    }

    /// Lays a picture after those that are there. Gives its index.
    fn picture(&mut self, colors: &Prefiltered) -> u32 {
        let [before, _] = self.picture_texels.extend(&colors.texels);
        let levels: Vec<_> = colors.levels.iter().map(|l| Level { offset: before + l.offset, ..*l }).collect();
        let [first, _] = self.pictures.extend(&levels);
        first
    }
}

/// The handles of a cubic leaf, in two floats each.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Handles {
    /// First handle.
    pub p1: Vec2,
    /// Second handle.
    pub p2: Vec2,
    /// What the first float lost of the first handle.
    pub low1: Vec2,
    /// What the first float lost of the second handle.
    pub low2: Vec2,
}

fn handles(all: &[tree::Handles]) -> Vec<Handles> {
    let two = |h: &tree::Handles| Handles { p1: h.p1, p2: h.p2, low1: h.low1.as_vec2(), low2: h.low2.as_vec2() };
    all.iter().map(two).collect()
}

/// The low ends of nodes, those of two in the place of a cubic's handles: they come before the handles of their tree.
fn low_pairs(low: &[LowEnds]) -> Vec<Handles> {
    let pair = |pair: &[LowEnds]| {
        let [first, second] = [pair[0], pair.get(1).copied().unwrap_or_default()];
        let [p1, p2, low1, low2] = [first.a, first.b, second.a, second.b].map(|low| low.as_vec2());
        Handles { p1, p2, low1, low2 }
    };
    low.chunks(2).map(pair).collect()
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
    /// Bytes of lights' regions that were loaded, lower and upper 32 bits.
    pub bytes: [u32; 2],
    /// Not 0 where the driver has ended a loop early.
    pub cut: u32,
    /// What the windows of the sample so far have left of its budget.
    pub budget: f32,
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

    /// Bytes of lights' regions that were loaded.
    pub fn loaded(&self) -> u64 {
        u64::from(self.bytes[1]) << 32 | u64::from(self.bytes[0])
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
    pub diffuse: Vec3,
    /// Nodes, edges or texels of the first.
    pub diffuse_nodes: u32,
    /// Of the specular lobe, clipped at its horizons.
    pub specular: Vec3,
    /// Nodes, edges or texels of the second.
    pub specular_nodes: u32,
    /// What the windows so far have left of both budgets.
    pub budgets: Vec2,
    /// Not 0 where the driver has ended a loop early.
    pub cut: u32,
    /// Of the layout.
    pub pad: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_counts_beyond_32_bits() {
        let pixel = Pixel { samples: 3 << 16 | 4096, nodes: 7, bytes: [9, 2], ..Pixel::zeroed() };
        assert_eq!((pixel.shaded(), pixel.visited(), pixel.loaded()), (4096, (3 << 32) + 7, (2 << 32) + 9));
    }
}
