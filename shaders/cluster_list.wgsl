// The clusters that the points of a tile gather from, listed by the workgroup that shades it: each invocation decides about one of those
// that wait. Twin of src/kernel/cluster_list.rs, which decides about one after the other, and of fill_clusters in src/backend/tile.rs.

// Whether any lights are clustered.
override CLUSTERS: bool = true;

// How far the workgroup is.
struct Listing {
    // Clusters that wait to be decided about.
    waiting: u32,
    // Those listed at the beginning of the list, whose expansions stand for them at all points; those at its end, single lights about
    // which each point decides.
    whole: u32,
    open: u32,
    visited: u32,
    // Sum of the accepted bounds, in tolerances.
    spent: f32,
    // Clusters whose local expansion stands for them.
    local: u32,
}

// Clusters' indices and the lobes in question.
var<workgroup> cluster_list: array<u32, MOST_LISTED>;
var<workgroup> clusters_waiting: array<u32, MOST_WAITING>;
var<workgroup> listing: Listing;
// The invocations whose cluster is whole, open, or in parts: a bit for each, of this step and of the next.
const LIST_MARKS: u32 = 6u;
var<workgroup> marks: array<atomic<u32>, 12>;
// Where this step's marks are.
var<private> now: u32;
// Sum of the accepted bounds, in TO_SPEND-th parts of the tolerance: a sum of whole numbers does not hang by their order.
var<workgroup> tile_spent: atomic<u32>;
// Clusters whose local expansion stands for them.
var<workgroup> tile_locals: atomic<u32>;

const TO_SPEND: f32 = 65536.0;
const LIST_INDEX: u32 = 2u;
const LIST_LOBES: u32 = 3u;

// How many invocations are marked, and how many of those come before one.
struct Ranks {
    count: u32,
    before: u32,
}

fn ranks_of(first: u32, local: u32) -> Ranks {
    let low = atomicLoad(&marks[first]);
    let high = atomicLoad(&marks[first + 1u]);
    let earlier = (1u << (local % 32u)) - 1u;
    let before = select(countOneBits(low & earlier), countOneBits(low) + countOneBits(high & earlier), local >= 32u);
    return Ranks(countOneBits(low) + countOneBits(high), before);
}

fn mark(first: u32, local: u32) {
    atomicOr(&marks[first + local / 32u], 1u << (local % 32u));
}

// Begins some levels below the root, with a cluster for each invocation: what is above is seldom far enough from a tile, and most of
// them would be idle there.
fn begin_listing(local: u32, tile: Receiver) {
    var cluster = 0u;
    // The way down: the second child where a bit is set.
    var way = local;
    for (var level = 1u; level < TILE && (clusters[cluster].link & SINGLE) == 0u; level *= 2u) {
        cluster = select(cluster + 1u, cluster_end(cluster + 1u), (way & 1u) != 0u);
        way /= 2u;
    }
    // Of those whose ways end at the same cluster, the first.
    if way == 0u {
        mark(LIST_MARKS, local);
    }
    workgroupBarrier();
    let ranks = ranks_of(LIST_MARKS, local);
    if way == 0u {
        clusters_waiting[ranks.before] = cluster << LIST_INDEX | u32(tile.shines.x) | u32(tile.shines.y) << 1u;
    }
    if local == 0u {
        listing = Listing(select(0u, ranks.count, any(tile.shines)), 0u, 0u, 0u, 0.0, 0u);
    }
}

// Clusters that are decided about at once don't know what the others spend: it shows in the next step.
//
// Lists clusters for the points of the tile until none wait or there is no room for more, and adds those that need not be listed to what
// the invocation has of them.
fn list_clusters(local: u32, tile: Receiver, tolerance: f32, sum: ptr<function, Local>) -> Listing {
    var before = workgroupUniformLoad(&listing);
    while before.waiting > 0u && before.whole + before.open + 2u * TILE <= MOST_LISTED {
        // The last ones, of which few may wait at any time; where that is many, one by one.
        let room = MOST_WAITING - CLUSTERS_DEEPEST - min(before.waiting, MOST_WAITING - CLUSTERS_DEEPEST);
        let count = min(before.waiting, clamp(room, 1u, TILE));
        let first = before.waiting - count;
        var cluster = 0u;
        var lobes = vec3u();
        if local < count {
            let asked = clusters_waiting[first + local];
            cluster = asked >> LIST_INDEX;
            lobes = ask_cluster(cluster, asked & LIST_LOBES, tile, tolerance, before.spent, sum);
        }
        for (var k = 0u; k < 3u; k++) {
            if lobes[k] != 0u {
                mark(now + 2u * k, local);
            }
        }
        workgroupBarrier();
        var counts = vec3u();
        var ranks = vec3u();
        for (var k = 0u; k < 3u; k++) {
            let found = ranks_of(now + 2u * k, local);
            counts[k] = found.count;
            ranks[k] = found.before;
        }
        if lobes.x != 0u {
            cluster_list[before.whole + ranks.x] = cluster << LIST_INDEX | lobes.x;
        }
        if lobes.y != 0u {
            cluster_list[MOST_LISTED - 1u - before.open - ranks.y] = cluster << LIST_INDEX | lobes.y;
        }
        if lobes.z != 0u {
            let at = first + 2u * ranks.z;
            clusters_waiting[at] = (cluster + 1u) << LIST_INDEX | lobes.z;
            clusters_waiting[at + 1u] = cluster_end(cluster + 1u) << LIST_INDEX | lobes.z;
        }
        now = LIST_MARKS - now;
        if local < LIST_MARKS {
            atomicStore(&marks[now + local], 0u);
        }
        if local == 0u {
            let visited = before.visited + count;
            let spent = f32(atomicLoad(&tile_spent)) / TO_SPEND;
            let locals = atomicLoad(&tile_locals);
            listing = Listing(first + 2u * counts.z, before.whole + counts.x, before.open + counts.y, visited, spent, locals);
        }
        before = workgroupUniformLoad(&listing);
    }
    return before;
}

// After points have gathered from what was listed.
fn clear_listing(local: u32) {
    if local == 0u {
        listing.whole = 0u;
        listing.open = 0u;
    }
}

// The lobes for which a cluster is whole, open, or in parts.
fn ask_cluster(i: u32, asking: u32, tile: Receiver, tolerance: f32, spent: f32, sum: ptr<function, Local>) -> vec3u {
    let view = cluster_view(i, tile.position, true);
    if cluster_is_away(i, view, true) {
        return vec3u();
    }
    var budget = ClusterBudget(spent);
    // Not a loop: what a compiler does not unroll does both lobes' work for each.
    var fates = vec2u();
    if DIFFUSE && (asking & 1u) != 0u {
        fates.x = cluster_fate(tile.plain, i, view, PLAIN, true, tolerance, &budget);
        if fates.x == CLUSTER_LOCAL {
            add_local(sum, i, view.y);
            atomicAdd(&tile_locals, 1u);
        }
    }
    if SPECULAR && (asking & 2u) != 0u {
        fates.y = cluster_fate(tile.lobe, i, view, SPECULAR_LOBE, true, tolerance, &budget);
    }
    atomicAdd(&tile_spent, u32(ceil((budget.spent - spent) * TO_SPEND)));
    let single = (clusters[i].link & SINGLE) != 0u;
    let parts = dot(vec2u(fates == vec2u(CLUSTER_REFINE)), vec2u(1u, 2u));
    let whole = dot(vec2u(fates == vec2u(CLUSTER_WHOLE)), vec2u(1u, 2u));
    return vec3u(whole, select(0u, parts, single), select(parts, 0u, single));
}
