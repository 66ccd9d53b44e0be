// The clusters that the points of a tile gather from, listed by the workgroup that shades it. Twin of src/kernel/cluster_list.rs, and
// of fill_clusters in src/backend/tile.rs.

// Whether any lights are clustered.
override CLUSTERS: bool = true;

// A cluster's index, the lobes for which its expansion stands for it at all points, and those for which each point decides.
var<workgroup> cluster_list: array<u32, MOST_LISTED>;
var<workgroup> clusters_listed: u32;
var<workgroup> clusters_visited: u32;
var<workgroup> tile_budget: ClusterBudget;

const LIST_OPEN: u32 = 2u;
const LIST_INDEX: u32 = 4u;

// Walks the clusters for the points of the tile; by one invocation.
fn list_clusters(bounds: TileBounds, tolerance: f32) {
    let tile = receiver_of_tile(bounds);
    var budget = ClusterBudget(0.0);
    var count = 0u;
    var visited = 0u;
    // Where each lobe goes on.
    var next = select(vec2u(frame.clusters), vec2u(), tile.shines);
    for (var i = min(next.x, next.y); i < frame.clusters; i = min(next.x, next.y)) {
        visited += 1u;
        let view = cluster_view(i, tile.position, true);
        let facing = !cluster_is_away(i, view, true);
        let awake = next <= vec2u(i);
        next = select(next, vec2u(cluster_end(i)), awake);
        var fates = vec2u();
        if DIFFUSE && facing && awake.x {
            fates.x = list_cluster(tile.plain, i, view, tile.position, PLAIN, tolerance, &budget);
        }
        if SPECULAR && facing && awake.y {
            fates.y = list_cluster(tile.lobe, i, view, tile.position, SPECULAR_LOBE, tolerance, &budget);
        }
        next = select(next, vec2u(i + 1u), fates == vec2u(LIST_PARTS));
        let listed = select(fates, vec2u(), fates == vec2u(LIST_PARTS));
        let found = listed.x | listed.y << 1u;
        if found != 0u {
            if count < MOST_LISTED {
                cluster_list[count] = i << LIST_INDEX | found;
            }
            count += 1u;
        }
    }
    clusters_visited = visited;
    clusters_listed = count;
    tile_budget = budget;
    if count > MOST_LISTED {
        // No room: each point walks for itself.
        cluster_list[0] = 3u << LIST_OPEN;
        clusters_listed = 1u;
        tile_budget = ClusterBudget(0.0);
    }
}

// Not the cluster is listed for a lobe but its parts.
const LIST_PARTS: u32 = 16u;

// How a cluster is listed for a lobe; 0 for not at all.
fn list_cluster(
    f: Field,
    i: u32,
    view: ClusterView,
    position: Loose,
    lobe: u32,
    tolerance: f32,
    budget: ptr<function, ClusterBudget>,
) -> u32 {
    let fate = cluster_fate(f, i, view, lobe, true, tolerance, budget);
    if fate != CLUSTER_REFINE {
        return select(0u, 1u, fate == CLUSTER_WHOLE);
    }
    if (clusters[i].link & SINGLE) == 0u {
        // Where the middle could do with the cluster, many points can.
        var own = *budget;
        if cluster_fate(f, i, cluster_view(i, position, false), lobe, false, tolerance, &own) == CLUSTER_REFINE {
            return LIST_PARTS;
        }
    }
    return 1u << LIST_OPEN;
}
