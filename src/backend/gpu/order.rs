//! The order in which the shaders have the emissions: those that they go through for every tile come first.

use super::layout::{Emitter, Emitters};
use crate::backend::prepared::Prepared;
use crate::kernel::cluster::{Cluster, INDEX_MASK};
use crate::kernel::tile::LightBox;

/// Emissions in the shaders' order, and what knows them by their places in it.
#[derive(Clone, Debug, Default)]
pub struct Ordered {
    /// Those outside of clusters, then those in clusters.
    pub emitters: Vec<Emitter>,
    /// Boxes around those outside of clusters.
    pub boxes: Vec<LightBox>,
    /// Their links lead to places.
    pub clusters: Vec<Cluster>,
}

impl Ordered {
    /// Of a scene whose emissions have been laid out.
    pub fn new(prepared: &Prepared, all: &Emitters) -> Self {
        let apart = prepared.clustered.apart.iter().map(|&emitter| emitter as usize);
        let order: Vec<usize> = apart.clone().chain(prepared.clustered.emitters()).collect();
        let mut places = vec![0; all.emitters.len()];
        order.iter().zip(0..).for_each(|(&emitter, place)| places[emitter] = place);
        let placed = |cluster: &Cluster| {
            let emitter = cluster.link & INDEX_MASK;
            let link =
                if cluster.is_single() { cluster.link & !INDEX_MASK | places[emitter as usize] } else { cluster.link };
            Cluster { link, ..*cluster }
        };
        Self {
            emitters: order.iter().map(|&emitter| all.emitters[emitter]).collect(),
            boxes: apart.map(|emitter| prepared.boxes[emitter]).collect(),
            clusters: prepared.clustered.tree.clusters.iter().map(placed).collect(),
        }
    }

    /// Of emissions that are asked for one by one, as they are laid out.
    pub fn single(all: &Emitters) -> Self {
        Self { emitters: all.emitters.clone(), ..Self::default() }
    }
}
