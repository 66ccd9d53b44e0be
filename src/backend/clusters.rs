//! Which emissions are clustered, and the walk that shares them out.

use super::Technique;
use super::emitter::{Emitter, Geometry};
use crate::kernel::cluster::{Answer, Field, LOBES, walk_clusters};
use crate::kernel::tree::{Budget, Node};
use crate::light::cluster::{ClusterTree, FEWEST, Member};
use crate::light::simple::Facing;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// All emissions of a scene: those that are clustered, and the others.
#[derive(Clone, Debug, Default)]
pub struct Clustered {
    /// The tree of clusters; empty where too few emissions would be in it.
    pub tree: ClusterTree,
    /// Emissions outside of it, by index.
    pub apart: Vec<u32>,
}

impl Clustered {
    /// Sorts the emissions. Only those by `tree` that stay where they are can be clustered.
    pub fn new(emitters: &[Emitter], technique: &Technique) -> Self {
        let all = 0..emitters.len() as u32;
        let sides: Vec<Vec<Member>> = emitters.iter().enumerate().map(|(i, e)| members(i, e)).collect();
        let clustered = sides.iter().filter(|s| !s.is_empty()).count();
        if !matches!(technique, Technique::Tree) || clustered < FEWEST {
            return Self { tree: ClusterTree::default(), apart: all.collect() };
        }
        let apart = all.filter(|&i| sides[i as usize].is_empty()).collect();
        Self { tree: ClusterTree::new(sides.concat()), apart }
    }

    /// Hands every emission that must be integrated itself to `single`, with the lobes (a bit for each) it is needed for and
    /// the budget. Answers for the others.
    pub fn share_out(
        &self,
        position: Vec3,
        lobes: &[Option<Field>; LOBES],
        tolerance: f32,
        budget: &mut Budget,
        mut single: impl FnMut(usize, u32, &mut Budget),
    ) -> Answer {
        for &emitter in &self.apart {
            single(emitter as usize, (1 << LOBES) - 1, budget);
        }
        if self.tree.clusters.is_empty() {
            return Answer::default();
        }
        let emitters = &self.tree.emitters;
        walk_clusters(self.tree.view(), position, lobes, tolerance, budget, |member, lobes, budget| {
            single(emitters[member] as usize, lobes, budget);
        })
    }
}

/// The sides of an emission that can be clustered: none of one that turns to the point or is no tree.
fn members(index: usize, emitter: &Emitter) -> Vec<Member> {
    let white = [(DVec3::ONE, [DVec3::ZERO; 2]); 1];
    let (root, [(mean, differences)]): (&Node, _) = match &emitter.geometry {
        Geometry::Tree(tree) => (&tree.nodes[0], white),
        Geometry::Mosaic(mosaic) => {
            let tile = &mosaic.tiles[0];
            (
                &mosaic.nodes[tile.first_node as usize],
                [(tile.mean.as_dvec3(), [tile.m1_x.as_dvec3(), tile.m1_y.as_dvec3()])],
            )
        }
        _ => return Vec::new(),
    };
    let normal = emitter.placement.normal();
    let per_area = normal.length() * emitter.square.half * emitter.square.half;
    if emitter.facing != Facing::Fixed || !(per_area > 0.0 && per_area.is_finite()) {
        return Vec::new();
    }
    let half = emitter.square.half;
    let [x, y] = [emitter.placement.x * half, emitter.placement.y * half];
    let in_light = |p: Vec2| emitter.square.center + p.as_dvec2() * half;
    let [hx, hy] = root.half.as_dvec2().to_array();
    let radiance = emitter.radiance.as_dvec3();
    let m1 = DVec2::from(root.m1.map(f64::from));
    let first = |c: usize| {
        let m = m1 * mean[c] + DVec2::new(differences[0][c], differences[1][c]);
        (x * m.x + y * m.y) * (radiance[c] * per_area)
    };
    let front = Member {
        emitter: index,
        is_half: emitter.two_sided,
        center: emitter.placement.point(in_light(root.center)),
        half: x.abs() * hx + y.abs() * hy,
        normal: normal.normalize(),
        flux: radiance * mean * (per_area * f64::from(root.area())),
        zeroth: radiance * mean * (per_area * f64::from(root.m0)),
        first: [first(0), first(1), first(2)],
    };
    if emitter.two_sided { vec![front, Member { normal: -front.normal, ..front }] } else { vec![front] }
}
