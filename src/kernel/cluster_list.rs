//! What a tile of shading points gathers from clusters of lights, decided for all of its points at once; or for a tile in each
//! lane. Twin: `shaders/cluster_list.wgsl`.

use super::cluster::{Cluster, ClusterBudget, Clusters, Fates, View};
use super::lanes::{Lanes, Mask};
use super::local::Local;
use super::receiver::{LOBES, PLAIN, Receiver, SPECULAR};

/// Most clusters that a tile of a GPU lists at a time; its points gather from these before it goes on.
pub const MOST_LISTED: usize = 320;
/// Clusters that may wait for a tile of a GPU to decide about them.
pub const MOST_WAITING: usize = 352;
/// No tree of clusters is as deep: as many may wait where they are decided about one by one.
pub const DEEPEST: usize = 112;

/// A cluster that shading points of a tile gather from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedCluster {
    /// Its index.
    pub cluster: u32,
    /// Lobes for which the expansion stands for it at all points; a bit for each.
    pub whole: u32,
    /// Lobes for which each point decides; of single lights only.
    pub open: u32,
}

/// The tiles that gather from a cluster.
#[derive(Clone, Copy, Debug)]
pub struct TilesOfCluster<M> {
    /// Its index.
    pub cluster: u32,
    /// Those for all points of which the expansion stands for it, of each lobe.
    pub whole: [M; LOBES],
    /// Those whose points decide.
    pub open: [M; LOBES],
}

/// The walk over all clusters for the points of a tile in each lane. It stops at every cluster that points of a tile must look at
/// themselves, and goes on from there.
#[derive(Clone, Copy, Debug)]
pub struct TileWalk<L: Lanes = f32> {
    /// Clusters visited.
    pub visited: L::Index,
    /// What clusters send to all points of a tile.
    pub local: Local<L>,
    /// How many those are.
    pub locals: L::Index,
    /// The cluster where the walk is.
    at: u32,
    /// Where each lobe of each tile goes on.
    next: [L::Index; LOBES],
}

impl<L: Lanes> TileWalk<L> {
    /// At the root.
    #[inline(always)]
    pub fn new(like: L) -> Self {
        let first = like.index(0);
        Self { visited: first, local: Local::new(like), locals: first, at: 0, next: [first; LOBES] }
    }

    /// Goes on to the next cluster that the points of some tile gather from, of the tiles in `lanes`.
    ///
    /// `tolerance` is for the reflected radiance; `budget` what is left of it at each of the points.
    #[inline(always)]
    pub fn go_on(
        &mut self,
        clusters: Clusters<'_>,
        tiles: &Receiver<L>,
        tolerance: L,
        budget: &mut ClusterBudget<L>,
        lanes: L::Mask,
    ) -> Option<TilesOfCluster<L::Mask>> {
        let mut i = self.at;
        while i < clusters.clusters.len() as u32 {
            let cluster = &clusters.clusters[i as usize];
            let (index, skip) = (i, cluster.end(i));
            let awake = [
                lanes & tiles.shines[PLAIN] & L::reached(self.next[PLAIN], i),
                lanes & tiles.shines[SPECULAR] & L::reached(self.next[SPECULAR], i),
            ];
            self.visited = L::count(self.visited, awake[PLAIN] | awake[SPECULAR]);
            let view = View::new::<true>(tolerance, cluster, &tiles.position);
            let facing = !view.is_away::<true>(cluster);
            let asking = [awake[PLAIN] & facing, awake[SPECULAR] & facing];
            let past = tolerance.index(skip);
            self.next[PLAIN] = L::select_index(awake[PLAIN], past, self.next[PLAIN]);
            self.next[SPECULAR] = L::select_index(awake[SPECULAR], past, self.next[SPECULAR]);
            let [plain, lobe] = [
                visit::<PLAIN, L>(cluster, &view, tiles, tolerance, budget, asking[PLAIN]),
                visit::<SPECULAR, L>(cluster, &view, tiles, tolerance, budget, asking[SPECULAR]),
            ];
            if plain.local.any() {
                self.local.add(cluster, view.y, plain.local);
                self.locals = L::count(self.locals, plain.local);
            }
            let child = tolerance.index(i + 1);
            self.next[PLAIN] = L::select_index(plain.refine, child, self.next[PLAIN]);
            self.next[SPECULAR] = L::select_index(lobe.refine, child, self.next[SPECULAR]);
            i = if (plain.refine | lobe.refine).any() { i + 1 } else { skip };
            if (plain.whole | plain.open | lobe.whole | lobe.open).any() {
                self.at = i;
                return Some(TilesOfCluster {
                    cluster: index,
                    whole: [plain.whole, lobe.whole],
                    open: [plain.open, lobe.open],
                });
            }
        }
        self.at = i;
        None
    }
}

/// What becomes of a cluster for the tiles that ask.
struct Decided<M> {
    whole: M,
    local: M,
    /// It is a single light about which each point decides.
    open: M,
    /// Its parts are to be looked at.
    refine: M,
}

#[inline(always)]
fn visit<const LOBE: usize, L: Lanes>(
    cluster: &Cluster,
    view: &View<L>,
    tiles: &Receiver<L>,
    tolerance: L,
    budget: &mut ClusterBudget<L>,
    asking: L::Mask,
) -> Decided<L::Mask> {
    let none = tolerance.mask(false);
    if !asking.any() {
        return Decided { whole: none, local: none, open: none, refine: none };
    }
    let fates = Fates::new::<true, LOBE, L>(&tiles.fields[LOBE], cluster, view, tolerance, budget, asking);
    let (open, refine) = if cluster.is_single() { (fates.refine, none) } else { (none, fates.refine) };
    Decided { whole: fates.whole, local: fates.local, open, refine }
}
