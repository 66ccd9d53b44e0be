//! What shading points gather from the clusters that their tile lists: a point, or one in each lane. Twin:
//! `shaders/cluster_walk.wgsl`.

use super::cluster::{Cluster, ClusterBudget, Clusters, Fates, INDEX_MASK, View, expansion};
use super::cluster_list::ListedCluster;
use super::lanes::{Lanes, Mask};
use super::receiver::{LOBES, PLAIN, Receiver, SPECULAR};

/// The walk through what is open of a listed cluster, and what it has gathered. It stops at every light that must be integrated
/// itself, and goes on from there.
#[derive(Clone, Copy, Debug)]
pub struct ClusterWalk<L: Lanes = f32> {
    /// For each lobe the sum of the expansions, to be multiplied with its weight and det M⁻¹/π.
    pub sums: [[L; 3]; LOBES],
    /// Clusters visited.
    pub visited: L::Index,
    /// Expansions summed up.
    pub whole: L::Index,
    /// The cluster where the walk is, and where it ends.
    at: [u32; 2],
    /// Where each lobe of each point goes on.
    next: [L::Index; LOBES],
}

/// A light that points must integrate themselves.
#[derive(Clone, Copy, Debug)]
pub struct HandedLight<M> {
    /// The index of its emission.
    pub emitter: u32,
    /// The points that ask for it, by each lobe.
    pub points: [M; LOBES],
}

impl<L: Lanes> ClusterWalk<L> {
    /// Nowhere, with nothing gathered.
    #[inline(always)]
    pub fn new(like: L) -> Self {
        let (zero, none) = (like.splat(0.0), like.index(0));
        Self { sums: [[zero; 3]; LOBES], visited: none, whole: none, at: [0; 2], next: [none; LOBES] }
    }

    /// Adds the expansions of the clusters that stand for their lights at all points of the tile.
    #[inline(always)]
    pub fn add_whole(
        &mut self,
        clusters: Clusters<'_>,
        points: &Receiver<L>,
        listed: &[ListedCluster],
        lanes: L::Mask,
    ) {
        self.add_whole_of::<PLAIN>(clusters, points, listed, lanes);
        self.add_whole_of::<SPECULAR>(clusters, points, listed, lanes);
    }

    #[inline(always)]
    fn add_whole_of<const LOBE: usize>(
        &mut self,
        clusters: Clusters<'_>,
        points: &Receiver<L>,
        listed: &[ListedCluster],
        lanes: L::Mask,
    ) {
        let shines = lanes & points.shines[LOBE];
        if !shines.any() {
            return;
        }
        let field = &points.fields[LOBE];
        let [mut red, mut green, mut blue] = self.sums[LOBE];
        for listed in listed {
            if listed.whole & 1 << LOBE == 0 {
                continue;
            }
            let cluster = &clusters.clusters[listed.cluster as usize];
            let view = View::new::<false>(red, cluster, &points.position);
            let [r, g, b] = expansion::<L, LOBE>(field, cluster, view.y);
            (red, green, blue) = (red + r, green + g, blue + b);
            self.whole = L::count(self.whole, shines);
        }
        self.sums[LOBE] = [red, green, blue];
    }

    /// Goes to a listed cluster.
    #[inline(always)]
    pub fn enter(&mut self, like: L, clusters: Clusters<'_>, listed: ListedCluster) {
        let end = clusters.clusters[listed.cluster as usize].end(listed.cluster);
        let first = |k: u32| like.index(if listed.open & 1 << k != 0 { listed.cluster } else { end });
        self.next = [first(0), first(1)];
        self.at = [if listed.open == 0 { end } else { listed.cluster }, end];
    }

    /// Goes on to the next light that must be integrated itself, if there is one.
    #[inline(always)]
    pub fn go_on(
        &mut self,
        clusters: Clusters<'_>,
        points: &Receiver<L>,
        tolerance: L,
        budget: &mut ClusterBudget<L>,
        lanes: L::Mask,
    ) -> Option<HandedLight<L::Mask>> {
        let [mut i, end] = self.at;
        while i < end {
            let cluster = &clusters.clusters[i as usize];
            let skip = cluster.end(i);
            let awake = [
                lanes & points.shines[PLAIN] & L::reached(self.next[PLAIN], i),
                lanes & points.shines[SPECULAR] & L::reached(self.next[SPECULAR], i),
            ];
            self.visited = L::count(self.visited, awake[PLAIN] | awake[SPECULAR]);
            let view = View::new::<false>(tolerance, cluster, &points.position);
            let facing = !view.is_away::<false>(cluster);
            let asking = [awake[PLAIN] & facing, awake[SPECULAR] & facing];
            let past = tolerance.index(skip);
            self.next[PLAIN] = L::select_index(awake[PLAIN], past, self.next[PLAIN]);
            self.next[SPECULAR] = L::select_index(awake[SPECULAR], past, self.next[SPECULAR]);
            let refined = [
                self.visit::<PLAIN>(cluster, &view, points, tolerance, budget, asking[PLAIN]),
                self.visit::<SPECULAR>(cluster, &view, points, tolerance, budget, asking[SPECULAR]),
            ];
            let goes_on = refined[PLAIN] | refined[SPECULAR];
            if cluster.is_single() {
                i = skip;
                self.at = [i, end];
                if goes_on.any() {
                    return Some(HandedLight { emitter: cluster.link & INDEX_MASK, points: refined });
                }
            } else {
                let child = tolerance.index(i + 1);
                self.next[PLAIN] = L::select_index(refined[PLAIN], child, self.next[PLAIN]);
                self.next[SPECULAR] = L::select_index(refined[SPECULAR], child, self.next[SPECULAR]);
                i = if goes_on.any() { i + 1 } else { skip };
            }
        }
        self.at = [end; 2];
        None
    }

    /// Adds what stands for a cluster at points that ask, and tells which of them want its parts.
    #[inline(always)]
    fn visit<const LOBE: usize>(
        &mut self,
        cluster: &Cluster,
        view: &View<L>,
        points: &Receiver<L>,
        tolerance: L,
        budget: &mut ClusterBudget<L>,
        asking: L::Mask,
    ) -> L::Mask {
        if !asking.any() {
            return asking;
        }
        let field = &points.fields[LOBE];
        let fates = Fates::new::<false, LOBE, L>(field, cluster, view, tolerance, budget, asking);
        if fates.whole.any() {
            let [r, g, b] = expansion::<L, LOBE>(field, cluster, view.y);
            let [red, green, blue] = self.sums[LOBE];
            self.sums[LOBE] = [
                L::select(fates.whole, red + r, red),
                L::select(fates.whole, green + g, green),
                L::select(fates.whole, blue + b, blue),
            ];
            self.whole = L::count(self.whole, fates.whole);
        }
        fates.refine
    }
}
