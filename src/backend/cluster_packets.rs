//! The expansions of clusters at a packet of shading points: what [`crate::kernel::cluster`] does at one.

use crate::kernel::cluster::{Clusters, LOBES, ListedCluster, Receiver, expansion};
use crate::kernel::lanes::{Real, Triple, Vector};
use crate::kernel::packet::{MAX_LANES, Packet, Processor, Simd, Task};
use glam::Vec3;

/// Three coordinates or channels for each lane.
type Three = [[f32; MAX_LANES]; 3];

/// Shading points as seen by clusters, a lane each.
#[derive(Clone, Debug)]
pub struct ReceiverPacket {
    position: Three,
    /// Rows of each lobe's map from the world to cosine space; nothing for one that reflects nothing.
    rows: [[Three; 3]; LOBES],
}

impl ReceiverPacket {
    /// Of at most as many points as the processor has lanes.
    pub fn new(points: &[Receiver]) -> Self {
        let zero = [[0.0; MAX_LANES]; 3];
        let mut packet = Self { position: zero, rows: [[zero; 3]; LOBES] };
        for (lane, point) in points.iter().enumerate() {
            put(&mut packet.position, lane, point.position());
            for (k, rows) in packet.rows.iter_mut().enumerate() {
                let Some((values, _)) = point.lobe(k) else { continue };
                rows.iter_mut().zip(values).for_each(|(row, value)| put(row, lane, value));
            }
        }
        packet
    }

    /// For each lobe the sum of the expansions that are listed for all points: to be multiplied with what the lobe reflects, and
    /// meaningless for one that reflects nothing.
    pub fn whole(&self, processor: Processor, clusters: Clusters<'_>, listed: &[ListedCluster]) -> [Three; LOBES] {
        processor.run(Whole { points: self, clusters, listed })
    }
}

fn put(values: &mut Three, lane: usize, v: Vec3) {
    values.iter_mut().zip(v.to_array()).for_each(|(values, value)| values[lane] = value);
}

struct Whole<'a> {
    points: &'a ReceiverPacket,
    clusters: Clusters<'a>,
    listed: &'a [ListedCluster],
}

impl Task for Whole<'_> {
    type Output = [Three; LOBES];

    #[inline(always)]
    fn run<S: Simd>(self, like: Packet<S>) -> [Three; LOBES] {
        let mut sums = [[[0.0; MAX_LANES]; 3]; LOBES];
        let load = |[x, y, z]: &Three| -> Triple<Packet<S>> { Vector::of(like.load(x), like.load(y), like.load(z)) };
        let position = load(&self.points.position);
        for (k, sums) in sums.iter_mut().enumerate() {
            let [a, b, c] = &self.points.rows[k];
            let rows = [load(a), load(b), load(c)];
            let mut sum = [like; 3];
            for listed in self.listed {
                if listed.whole & 1 << k == 0 {
                    continue;
                }
                let cluster = &self.clusters.clusters[listed.cluster as usize];
                let center = cluster.center;
                let center = Triple::of(like.splat(center.x), like.splat(center.y), like.splat(center.z));
                let [red, green, blue] = expansion::<Packet<S>>(rows, &cluster.moments, center - position);
                sum = [sum[0] + red, sum[1] + green, sum[2] + blue];
            }
            for (sum, stored) in sum.into_iter().zip(sums) {
                sum.store(stored);
            }
        }
        sums
    }
}
