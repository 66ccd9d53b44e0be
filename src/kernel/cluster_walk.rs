//! What shading points gather from the clusters that their tile lists: a point, or one in each lane. Twin:
//! `shaders/cluster_walk.wgsl`.

use super::cluster::{Cluster, ClusterBudget, Clusters, Fates, INDEX_MASK, View, expansion};
use super::cluster_list::ListedCluster;
use super::lanes::{Lanes, Mask};
use super::local::Local;
use super::receiver::{LOBES, PLAIN, Receiver, SPECULAR, fixed};
use glam::Vec3;

/// What shading points have gathered from the clusters that their tile lists.
#[derive(Clone, Copy, Debug)]
pub struct ClusterSums<L: Lanes = f32> {
    /// For each lobe the sum of the expansions, to be multiplied with its weight and det M⁻¹/π.
    pub sums: [[L; 3]; LOBES],
    /// Single lights that the points decided about.
    pub visited: L::Index,
    /// Expansions summed up.
    pub whole: L::Index,
}

/// A light that points must integrate themselves.
#[derive(Clone, Copy, Debug)]
pub struct HandedLight<M> {
    /// The index of its emission.
    pub emitter: u32,
    /// The points that ask for it, by each lobe.
    pub points: [M; LOBES],
}

impl<L: Lanes> ClusterSums<L> {
    /// Nothing.
    #[inline(always)]
    pub fn new(like: L) -> Self {
        let (zero, none) = (like.splat(0.0), like.index(0));
        Self { sums: [[zero; 3]; LOBES], visited: none, whole: none }
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

    /// Adds what clusters send to all points of a tile by the plain cosine: their local expansion about `middle`.
    #[inline(always)]
    pub fn add_local(&mut self, points: &Receiver<L>, middle: Vec3, local: &Local, lanes: L::Mask) {
        let shines = lanes & points.shines[PLAIN];
        if !shines.any() {
            return;
        }
        let [red, green, blue] = self.sums[PLAIN];
        let away = points.position.middle - fixed(red, middle);
        let [r, g, b] = local.at::<L>(points.fields[PLAIN].rows[2].middle, away);
        self.sums[PLAIN] =
            [L::select(shines, red + r, red), L::select(shines, green + g, green), L::select(shines, blue + b, blue)];
    }

    /// Decides about a listed light that the tile left open: adds what stands for it, or hands it to the points that must integrate it
    /// themselves.
    ///
    /// `tolerance` is for the reflected radiance; `budget` what is left of it at each point.
    #[inline(always)]
    pub fn decide(
        &mut self,
        clusters: Clusters<'_>,
        points: &Receiver<L>,
        listed: ListedCluster,
        tolerance: L,
        budget: &mut ClusterBudget<L>,
        lanes: L::Mask,
    ) -> Option<HandedLight<L::Mask>> {
        let cluster = &clusters.clusters[listed.cluster as usize];
        let open = |k: usize| lanes & points.shines[k] & tolerance.mask(listed.open & 1 << k != 0);
        let open = [open(PLAIN), open(SPECULAR)];
        self.visited = L::count(self.visited, open[PLAIN] | open[SPECULAR]);
        let view = View::new::<false>(tolerance, cluster, &points.position);
        let facing = !view.is_away::<false>(cluster);
        let points = [
            self.visit::<PLAIN>(cluster, &view, points, tolerance, budget, open[PLAIN] & facing),
            self.visit::<SPECULAR>(cluster, &view, points, tolerance, budget, open[SPECULAR] & facing),
        ];
        (points[PLAIN] | points[SPECULAR]).any().then_some(HandedLight { emitter: cluster.link & INDEX_MASK, points })
    }

    /// Adds what stands for a light at points that ask, and tells which of them must integrate it.
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
