//! Which emissions are clustered.

use super::Skips;
use super::emitter::{Emitter, Geometry};
use crate::kernel::cluster::INDEX_MASK;
use crate::kernel::tree::Node;
use crate::light::cluster::{ClusterTree, Member};
use crate::light::simple::Facing;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

/// Fewest emissions that are worth a tree. On the CPU diffuse floors gain from some fifteen signs on and sharp gloss from some fifty;
/// on a software driver of the GPU both do from fewer than fifty on.
pub const FEWEST: usize = 40;

/// All emissions of a scene: those that are clustered, and the others.
#[derive(Clone, Debug, Default)]
pub struct Clustered {
    /// The tree of clusters; empty where too few emissions would be in it.
    pub tree: ClusterTree,
    /// Emissions outside of it, by index.
    pub apart: Vec<u32>,
}

impl Clustered {
    /// Sorts the emissions: none is clustered unless there are [`FEWEST`] that can be.
    pub fn new(emitters: &[Emitter], skips: Skips) -> Self {
        let clusterable = emitters.iter().enumerate().filter(|(i, e)| !sides(*i, e).is_empty());
        if skips.clusters && clusterable.take(FEWEST).count() == FEWEST {
            return Self::of(emitters);
        }
        Self { tree: ClusterTree::default(), apart: (0..emitters.len() as u32).collect() }
    }

    /// Clusters every emission that can be: chord–moment trees that stay where they are.
    pub fn of(emitters: &[Emitter]) -> Self {
        let sides: Vec<Vec<Member>> = emitters.iter().enumerate().map(|(i, e)| sides(i, e)).collect();
        let apart = (0..emitters.len() as u32).filter(|&i| sides[i as usize].is_empty()).collect();
        Self { tree: ClusterTree::new(sides.concat()), apart }
    }

    /// The emissions that are clustered, each once.
    pub fn emitters(&self) -> impl Iterator<Item = usize> {
        // Both sides of an emission are members.
        let mut emitters: Vec<usize> =
            self.tree.clusters.iter().filter(|c| c.is_single()).map(|c| (c.link & INDEX_MASK) as usize).collect();
        emitters.sort_unstable();
        emitters.dedup();
        emitters.into_iter()
    }
}

/// A region of one or more colours: its root node, its mean colour, and ∫x·(colour − mean) dA and the same of y.
struct Root<'a> {
    node: &'a Node,
    mean: DVec3,
    off: [Vec3; 2],
}

/// The sides of an emission that can be clustered: none of one that turns to the point or is no tree.
fn sides(index: usize, emitter: &Emitter) -> Vec<Member> {
    let root = match &emitter.geometry {
        Geometry::Tree(tree) => Root { node: &tree.nodes[0], mean: DVec3::ONE, off: [Vec3::ZERO; 2] },
        Geometry::Mosaic(mosaic) => {
            let tile = &mosaic.tiles[0];
            let node = &mosaic.nodes[tile.first_node as usize];
            Root { node, mean: tile.mean.as_dvec3(), off: [tile.m1_x, tile.m1_y] }
        }
        _ => return Vec::new(),
    };
    let half = emitter.square.half;
    let normal = emitter.placement.normal();
    let per_area = normal.length() * half * half;
    if emitter.facing != Facing::Fixed || !(per_area > 0.0 && per_area.is_finite()) {
        return Vec::new();
    }
    let [x, y] = [emitter.placement.x * half, emitter.placement.y * half];
    let node = root.node;
    let in_light = |p: Vec2| emitter.square.center + p.as_dvec2() * half;
    let radiance = emitter.radiance.as_dvec3();
    let unit = f64::from(node.unit());
    let [m1_x, m1_y] = node.m1.map(|m| f64::from(m) * unit);
    let first = |c: usize| {
        let m =
            DVec2::new(m1_x, m1_y) * root.mean[c] + DVec2::new(f64::from(root.off[0][c]), f64::from(root.off[1][c]));
        (x * m.x + y * m.y) * (radiance[c] * per_area)
    };
    let front = Member {
        emitter: index,
        is_half: emitter.two_sided,
        center: emitter.placement.point(in_light(node.center)),
        half: x.abs() * f64::from(node.half.x) + y.abs() * f64::from(node.half.y),
        normal: normal.normalize(),
        flux: radiance * root.mean * (per_area * f64::from(node.area())),
        zeroth: radiance * root.mean * (per_area * f64::from(node.m0)),
        first: [first(0), first(1), first(2)],
        spread: spread(&root, x, y),
    };
    if emitter.two_sided { vec![front, Member { normal: -front.normal, ..front }] } else { vec![front] }
}

/// Mean of δδᵀ over a region, δ the world offset from its root's centre, or more: what its box allows where colours differ or parts
/// of the region count negative.
fn spread(root: &Root<'_>, x: DVec3, y: DVec3) -> DMat3 {
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let node = root.node;
    // Of a sound region the two areas are the same but for their rounding.
    let sound = node.area() <= node.m0 * 1.02 && root.off == [Vec3::ZERO; 2];
    if sound {
        let [xx, xy, yy] = node.m2.map(|m| f64::from(m) * f64::from(node.unit()).powi(2) / f64::from(node.m0));
        outer(x, x) * xx + (outer(x, y) + outer(y, x)) * xy + outer(y, y) * yy
    } else {
        let half = node.half.as_dvec2();
        // (a + b)² ≤ 2a² + 2b².
        outer(x, x) * (2.0 * half.x * half.x) + outer(y, y) * (2.0 * half.y * half.y)
    }
}
