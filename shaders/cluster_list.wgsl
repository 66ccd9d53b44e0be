// The clusters that the points of a tile gather from, listed by the workgroup that shades it. Twin of fill_clusters in
// src/backend/tile.rs and of list_clusters in src/kernel/cluster.rs.

// Whether any lights are clustered.
override CLUSTERS: bool = true;

// A cluster's index, the lobes for which its expansion stands for it at all points, and those for which each point decides.
var<workgroup> cluster_list: array<u32, MOST_LISTED>;
var<workgroup> clusters_listed: u32;
var<workgroup> clusters_visited: u32;
var<workgroup> tile_budget: Budget;

const LIST_OPEN: u32 = 2u;
const LIST_INDEX: u32 = 4u;

// Walks the clusters for the points of the tile; by one invocation.
fn list_clusters(bounds: TileBounds, tolerance: f32) {
    let tile = receiver_of_tile(bounds);
    let middle = at_middle(tile);
    var budget = Budget(0.0, SHARE);
    var count = 0u;
    var visited = 0u;
    // Where each lobe goes on.
    var next = array(select(frame.clusters, 0u, tile.shines[0]), select(frame.clusters, 0u, tile.shines[1]));
    for (var i = min(next[0], next[1]); i < frame.clusters; i = min(next[0], next[1])) {
        visited += 1u;
        let is_single = (clusters[i].link & SINGLE) != 0u;
        let view = cluster_view(i, tile.position);
        let away = cluster_is_away(i, view);
        var found = 0u;
        for (var k = 0u; k < 2u; k++) {
            if next[k] > i {
                continue;
            }
            next[k] = cluster_end(i);
            if away {
                continue;
            }
            let fate = cluster_fate(tile.fields[k], i, view, tolerance, &budget);
            if fate == CLUSTER_WHOLE {
                found |= 1u << k;
            } else if fate == CLUSTER_REFINE {
                // Where the middle could do with the cluster, many points can.
                var own = budget;
                let decide = is_single
                    || cluster_fate(middle.fields[k], i, cluster_view(i, middle.position), tolerance, &own) != CLUSTER_REFINE;
                if decide {
                    found |= 1u << (LIST_OPEN + k);
                } else {
                    next[k] = i + 1u;
                }
            }
        }
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
        tile_budget = Budget(0.0, SHARE);
    }
}
