//! The walk over a mosaic: a region whose colour changes from place to place. Twin: `shaders/mosaic.wgsl`.
//!
//! A tile is a part of the region, cut by lines along x and y. Its integral is that of its mean colour, by its
//! chord–moment tree, plus that of what the colour differs from the mean. The latter is the second-order Taylor expansion
//! of the kernel k with the moments of the difference (whose mean is nothing), as in [`super::tree`]; where its error bound
//! is above the tolerance the walk goes on with the two halves of the tile, down to tiles of one colour.

use super::expansion::Expansion;
use super::horizon::Clip;
use super::lanes::Lanes;
use super::map::{CosineMap, PlanePoint};
use super::tree::{Budget, Handles, LowEnds, Node, Nodes, place, tree_integral};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec2, Vec3};

/// A tile of a mosaic, in pre-order. Lengths are tree space, colours linear Rec.709.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Tile {
    /// Centre of the tile's box, about which the moments are taken.
    pub center: Vec2,
    /// Half-extents of the box.
    pub half: Vec2,
    /// Mean colour over the region.
    pub mean: Vec3,
    /// Where the walk goes on past the tile and its parts.
    pub skip: u32,
    /// ∫x·(colour − mean) dA.
    pub m1_x: Vec3,
    /// First node of its tree.
    pub first_node: u32,
    /// ∫y·(colour − mean) dA.
    pub m1_y: Vec3,
    /// Past the last node of its tree.
    pub end_node: u32,
    /// ∫x²·(colour − mean) dA.
    pub m2_xx: Vec3,
    /// First of its tree's handles.
    pub first_handles: u32,
    /// ∫xy·(colour − mean) dA.
    pub m2_xy: Vec3,
    /// ∫|colour − mean| dA of the channel where that is most; 0 for a tile of one colour.
    pub deviation: f32,
    /// ∫y²·(colour − mean) dA.
    pub m2_yy: Vec3,
    /// The same integral of |colour − mean|·ρ³, with ρ the larger of |x| and |y| in half-extents of the box.
    pub deviation_3: f32,
}

/// The arrays of a mosaic.
#[derive(Clone, Copy, Debug)]
pub struct Tiles<'a> {
    /// In pre-order.
    pub tiles: &'a [Tile],
    /// The trees of all tiles, one after the other.
    pub nodes: &'a [Node],
    /// One for each node.
    pub low: &'a [LowEnds],
    /// Of the cubic leaves.
    pub handles: &'a [Handles],
}

/// A value for each channel and what it cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorIntegral<L = f32> {
    /// The integral, normalised: 1 for a full hemisphere of white.
    pub value: [L; 3],
    /// Tiles, nodes and pieces of leaves visited.
    pub visited: u32,
}

/// The clamped-cosine integral of the region's colours over the hemisphere that `clip` leaves, signed as
/// [`tree_integral`] is, and as near.
pub fn mosaic_integral<L: Lanes<Mask = bool, Index = u32>>(
    map: &CosineMap<L>,
    clip: &Clip<L>,
    mosaic: Tiles<'_>,
    tolerance: L,
    budget: &mut Budget<L>,
) -> ColorIntegral<L> {
    let (mut value, mut visited) = ([tolerance.splat(0.0); 3], 0);
    let mut add = |factor: L, color: Vec3| {
        for (sum, channel) in value.iter_mut().zip(color.to_array()) {
            *sum = *sum + factor * channel;
        }
    };
    let mut i = 0;
    while i < mosaic.tiles.len() {
        let tile = &mosaic.tiles[i];
        visited += 1;
        let center = L::Vec2::from_foot(tile.center, DVec2::ZERO, map.foot);
        let half = center.fixed(tile.half);
        let place = place(map.depth, clip.planes(), center, half);
        // A whole region below a horizon: whatever its contours cross elsewhere, they cross back.
        if place.below() {
            i = tile.skip as usize;
            continue;
        }
        if tile.deviation > 0.0 {
            let expansion = Expansion::new(map, center, half);
            let [deviation, deviation_3] = [tile.deviation, tile.deviation_3].map(|v| tolerance.splat(v));
            let bound = expansion.region_bound::<3>(place.above, true, deviation, deviation_3);
            if !budget.accept(bound, tolerance, true) {
                i += 1;
                continue;
            }
            if place.above {
                let d = expansion.derivatives(map, 1.0);
                add(d.gradient[0], tile.m1_x);
                add(d.gradient[1], tile.m1_y);
                add(d.curvature[0], tile.m2_xx);
                add(d.curvature[1], tile.m2_xy);
                add(d.curvature[2], tile.m2_yy);
            }
        }
        let brightest = tile.mean.max_element();
        if brightest > 0.0 {
            let share = tolerance / tolerance.splat(brightest);
            let inner = tree_integral(map, clip, mosaic.tree(tile), share, budget, true);
            add(inner.value, tile.mean);
            visited += inner.visited;
        }
        i = tile.skip as usize;
    }
    ColorIntegral { value, visited }
}

impl<'a> Tiles<'a> {
    /// The tree of one tile.
    fn tree(&self, tile: &Tile) -> Nodes<'a> {
        let nodes = tile.first_node as usize..tile.end_node as usize;
        Nodes {
            nodes: &self.nodes[nodes.clone()],
            low: &self.low[nodes],
            handles: &self.handles[tile.first_handles as usize..],
        }
    }
}
