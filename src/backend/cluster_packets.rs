//! Clusters of lights and packets: a tile, or a shading point, in each lane. Each lane gets what [`crate::kernel::cluster_list`] and
//! [`crate::kernel::cluster_walk`] give it alone, to the bit.

use crate::kernel::cluster::{ClusterBudget, Clusters};
use crate::kernel::cluster_list::{ListedCluster, TileWalk};
use crate::kernel::cluster_walk::{ClusterSums, HandedLight};
use crate::kernel::lanes::{Real, Triple, Vector};
use crate::kernel::local::{Local, TERMS};
use crate::kernel::packet::{MAX_LANES, Packet, PacketMask, Processor, Simd, Task};
use crate::kernel::receiver::{Field, LOBES, Loose, Receiver};
use glam::Vec3;

type Lane = [f32; MAX_LANES];
/// Three coordinates or channels for each lane.
type Three = [Lane; 3];

/// Shading points as seen by clusters, a lane each; of tiles, their middles.
#[derive(Clone, Debug)]
struct Points {
    count: usize,
    position: Three,
    fields: [FieldLanes; LOBES],
    shines: [u32; LOBES],
}

#[derive(Clone, Debug)]
struct FieldLanes {
    rows: [Three; 3],
    up: Three,
    squares: Three,
    products: Three,
    scale: Lane,
    weight: Three,
}

/// What tiles leave open: the half-extents of [`Loose`] vectors.
#[derive(Clone, Debug)]
struct Halves {
    position: Three,
    rows: [[Three; 3]; LOBES],
    up: [Three; LOBES],
}

const NONE: Three = [[0.0; MAX_LANES]; 3];
const NO_FIELD: FieldLanes =
    FieldLanes { rows: [NONE; 3], up: NONE, squares: NONE, products: NONE, scale: [0.0; MAX_LANES], weight: NONE };

impl Default for Points {
    fn default() -> Self {
        Self { count: 0, position: NONE, fields: [NO_FIELD; LOBES], shines: [0; LOBES] }
    }
}

impl Points {
    /// Takes in a receiver. There must be room.
    fn push(&mut self, receiver: &Receiver) {
        let lane = self.count;
        self.count += 1;
        put(&mut self.position, lane, receiver.position.middle);
        for (k, (lanes, field)) in self.fields.iter_mut().zip(&receiver.fields).enumerate() {
            // What shines is set lane by lane; what does not is never looked at.
            if !receiver.shines[k] {
                continue;
            }
            self.shines[k] |= 1 << lane;
            lanes.rows.iter_mut().zip(&field.rows).for_each(|(row, value)| put(row, lane, value.middle));
            put(&mut lanes.up, lane, field.up.middle);
            put(&mut lanes.squares, lane, field.squares);
            put(&mut lanes.products, lane, field.products);
            lanes.scale[lane] = field.scale;
            put(&mut lanes.weight, lane, field.weight);
        }
    }

    fn clear(&mut self) {
        (self.count, self.shines) = (0, [0; LOBES]);
    }

    #[inline(always)]
    fn load<S: Simd>(&self, like: Packet<S>) -> Receiver<Packet<S>> {
        let [plain, lobe] = &self.fields;
        let [p, l] = self.shines;
        Receiver {
            position: known(like, &self.position),
            fields: [plain.load(like), lobe.load(like)],
            shines: [PacketMask::load(like, p), PacketMask::load(like, l)],
        }
    }

    /// The lanes in use.
    #[inline(always)]
    fn lanes<S: Simd>(&self, like: Packet<S>) -> PacketMask<S> {
        PacketMask::load(like, (1 << self.count) - 1)
    }
}

impl FieldLanes {
    #[inline(always)]
    fn load<S: Simd>(&self, like: Packet<S>) -> Field<Packet<S>> {
        let [a, b, c] = &self.rows;
        Field {
            rows: [known(like, a), known(like, b), known(like, c)],
            up: known(like, &self.up),
            squares: three(like, &self.squares),
            products: three(like, &self.products),
            scale: like.load(&self.scale),
            weight: three(like, &self.weight),
        }
    }
}

impl Halves {
    fn new(tiles: &[Receiver]) -> Self {
        let mut halves = Self { position: NONE, rows: [[NONE; 3]; LOBES], up: [NONE; LOBES] };
        for (lane, tile) in tiles.iter().enumerate() {
            put(&mut halves.position, lane, tile.position.half);
            for (k, field) in tile.fields.iter().enumerate() {
                halves.rows[k].iter_mut().zip(&field.rows).for_each(|(row, value)| put(row, lane, value.half));
                put(&mut halves.up[k], lane, field.up.half);
            }
        }
        halves
    }

    /// Tiles of which the middles are given.
    #[inline(always)]
    fn around<S: Simd>(&self, like: Packet<S>, mut middles: Receiver<Packet<S>>) -> Receiver<Packet<S>> {
        middles.position.half = three(like, &self.position);
        for (k, field) in middles.fields.iter_mut().enumerate() {
            for (row, half) in field.rows.iter_mut().zip(&self.rows[k]) {
                row.half = three(like, half);
            }
            field.up.half = three(like, &self.up[k]);
        }
        middles
    }
}

#[inline(always)]
fn three<S: Simd>(like: Packet<S>, [x, y, z]: &Three) -> Triple<Packet<S>> {
    Vector::of(like.load(x), like.load(y), like.load(z))
}

#[inline(always)]
fn known<S: Simd>(like: Packet<S>, middle: &Three) -> Loose<Packet<S>> {
    let zero = like.splat(0.0);
    Loose { middle: three(like, middle), half: Vector::of(zero, zero, zero) }
}

fn put(values: &mut Three, lane: usize, v: Vec3) {
    values.iter_mut().zip(v.to_array()).for_each(|(values, value)| values[lane] = value);
}

/// What tiles list.
#[derive(Clone, Debug)]
pub struct Lists {
    /// The clusters that some tile lists, in their order.
    listed: Vec<ListedLanes>,
    visited: [u32; MAX_LANES],
    spent: Lane,
    local: [[Lane; TERMS]; 3],
    locals: [u32; MAX_LANES],
}

/// The tiles that list a cluster, by their bits.
#[derive(Clone, Copy, Debug)]
struct ListedLanes {
    cluster: u32,
    whole: [u32; LOBES],
    open: [u32; LOBES],
}

impl Lists {
    /// Walks the clusters for all tiles of a packet together. Each has its own tolerance, of the reflected radiance.
    pub fn new(processor: Processor, clusters: Clusters<'_>, tiles: &[Receiver], tolerance: &[f32; MAX_LANES]) -> Self {
        let mut middles = Points::default();
        tiles.iter().for_each(|tile| middles.push(tile));
        processor.run(Listing { clusters, middles: &middles, halves: &Halves::new(tiles), tolerance })
    }

    /// What a tile lists.
    pub fn of_tile(&self, lane: usize) -> impl Iterator<Item = ListedCluster> {
        self.listed.iter().filter_map(move |listed| {
            let lobes = |tiles: [u32; LOBES]| tiles[0] >> lane & 1 | (tiles[1] >> lane & 1) << 1;
            let (whole, open) = (lobes(listed.whole), lobes(listed.open));
            (whole | open != 0).then_some(ListedCluster { cluster: listed.cluster, whole, open })
        })
    }

    /// What clusters send to all points of a tile, and how many those are.
    pub fn local(&self, lane: usize) -> (Local, u32) {
        let terms = self.local.each_ref().map(|channel| channel.each_ref().map(|lanes| lanes[lane]));
        (Local { terms }, self.locals[lane])
    }

    /// Clusters visited for a tile.
    pub const fn visited(&self, lane: usize) -> u32 {
        self.visited[lane]
    }

    /// What a tile's decisions leave to each of its points.
    pub const fn budget(&self, lane: usize) -> ClusterBudget {
        ClusterBudget { spent: self.spent[lane] }
    }
}

struct Listing<'a> {
    clusters: Clusters<'a>,
    middles: &'a Points,
    halves: &'a Halves,
    tolerance: &'a Lane,
}

impl Task for Listing<'_> {
    type Output = Lists;

    #[inline(always)]
    fn run<S: Simd>(self, like: Packet<S>) -> Lists {
        let Self { clusters, middles, halves, tolerance } = self;
        let mut lists = Lists {
            listed: Vec::new(),
            visited: [0; MAX_LANES],
            spent: [0.0; MAX_LANES],
            local: [[[0.0; MAX_LANES]; TERMS]; 3],
            locals: [0; MAX_LANES],
        };
        let (lanes, tolerance) = (middles.lanes(like), like.load(tolerance));
        let tiles = halves.around(like, middles.load(like));
        let mut budget = ClusterBudget::new(like);
        let mut walk = TileWalk::new(like);
        while let Some(found) = walk.go_on(clusters, &tiles, tolerance, &mut budget, lanes) {
            lists.listed.push(ListedLanes {
                cluster: found.cluster,
                whole: [found.whole[0].bits(), found.whole[1].bits()],
                open: [found.open[0].bits(), found.open[1].bits()],
            });
        }
        walk.visited.store(&mut lists.visited);
        walk.locals.store(&mut lists.locals);
        for (stored, channel) in lists.local.iter_mut().zip(walk.local.terms) {
            for (stored, term) in stored.iter_mut().zip(channel) {
                term.store(stored);
            }
        }
        budget.spent.store(&mut lists.spent);
        lists
    }
}

/// The points of a packet, and what they gather from the clusters that their tile lists: [`ClusterSums`], with a point in each lane.
#[derive(Clone, Debug)]
pub struct WalkingPacket {
    points: Points,
    sums: [Three; LOBES],
    visited: [u32; MAX_LANES],
    whole: [u32; MAX_LANES],
    handed: Vec<Handed>,
}

/// A light that points of a packet must integrate themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handed {
    /// The index of its emission.
    pub emitter: usize,
    /// Bits of the points, for each lobe.
    pub points: [u32; LOBES],
}

impl Default for WalkingPacket {
    fn default() -> Self {
        Self {
            points: Points::default(),
            sums: [NONE; LOBES],
            visited: [0; MAX_LANES],
            whole: [0; MAX_LANES],
            handed: Vec::new(),
        }
    }
}

impl WalkingPacket {
    /// Leaves no point.
    pub fn clear(&mut self) {
        self.points.clear();
    }

    /// Adds a point. There must be room: [`Processor::lanes`].
    pub fn push(&mut self, point: &Receiver) {
        self.points.push(point);
    }

    /// Gathers from the clusters that the points' tile lists, and from those that send `local`, about the tile's middle. `tolerance`
    /// is of the reflected radiance, `budget` what is left of it to each point.
    pub fn walk(
        &mut self,
        processor: Processor,
        clusters: Clusters<'_>,
        listed: &[ListedCluster],
        local: Option<(Vec3, &Local)>,
        tolerance: f32,
        budget: ClusterBudget,
    ) {
        self.handed.clear();
        processor.run(Walking { packet: self, clusters, listed, local, tolerance, budget });
    }

    /// The lights that points must integrate themselves, each once.
    pub fn handed(&self) -> &[Handed] {
        &self.handed
    }

    /// Radiance that a point's lobe reflects of the clusters.
    pub fn reflected(&self, lane: usize, lobe: usize) -> Vec3 {
        let field = &self.points.fields[lobe];
        let of = |values: &Three| Vec3::new(values[0][lane], values[1][lane], values[2][lane]);
        if self.points.shines[lobe] >> lane & 1 == 1 {
            of(&self.sums[lobe]) * (of(&field.weight) * field.scale[lane])
        } else {
            Vec3::ZERO
        }
    }

    /// Lights that the points decided about.
    pub fn visited(&self) -> u64 {
        self.visited.iter().map(|&n| u64::from(n)).sum()
    }

    /// Expansions evaluated at the points.
    pub fn whole(&self) -> u64 {
        self.whole.iter().map(|&n| u64::from(n)).sum()
    }
}

struct Walking<'a> {
    packet: &'a mut WalkingPacket,
    clusters: Clusters<'a>,
    listed: &'a [ListedCluster],
    local: Option<(Vec3, &'a Local)>,
    tolerance: f32,
    budget: ClusterBudget,
}

impl Task for Walking<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, like: Packet<S>) {
        let Self { packet, clusters, listed, local, tolerance, budget } = self;
        let points = packet.points.load(like);
        let (lanes, tolerance) = (packet.points.lanes(like), like.splat(tolerance));
        let mut budget = ClusterBudget { spent: like.splat(budget.spent) };
        let mut gathered = ClusterSums::new(like);
        gathered.add_whole(clusters, &points, listed, lanes);
        if let Some((middle, local)) = local {
            gathered.add_local(&points, middle, local, lanes);
        }
        for &listed in listed.iter().filter(|listed| listed.open != 0) {
            let handed = gathered.decide(clusters, &points, listed, tolerance, &mut budget, lanes);
            if let Some(HandedLight { emitter, points: [plain, lobe] }) = handed {
                let points = [plain.bits(), lobe.bits()];
                packet.handed.push(Handed { emitter: emitter as usize, points });
            }
        }
        for (stored, sums) in packet.sums.iter_mut().zip(gathered.sums) {
            for (stored, sum) in stored.iter_mut().zip(sums) {
                sum.store(stored);
            }
        }
        gathered.visited.store(&mut packet.visited);
        gathered.whole.store(&mut packet.whole);
    }
}
