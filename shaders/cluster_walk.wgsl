// What a shading point gathers from the clusters that its tile lists. Twin of src/kernel/cluster_walk.rs; the lights that are handed
// on are integrated on the way.

// Adds what a point reflects of the clusters that its tile has listed, and of the lights that they hand on.
fn add_clusters(
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    row: u32,
    cluster_tolerance: f32,
    tolerance: f32,
    budget: ptr<function, Budget>,
    sums: ptr<function, Sums>,
) {
    let point = receiver_of_point(position, shading, weights);
    var cluster_budget = tile_budget;
    var visited = 0u;
    var whole = 0u;
    for (var n = 0u; n < clusters_listed; n++) {
        let listed = cluster_list[n];
        let first = listed >> LIST_INDEX;
        let end = cluster_end(first);
        var next = array(end, end);
        for (var k = 0u; k < 2u; k++) {
            if !point.shines[k] {
                continue;
            }
            if (listed & (1u << k)) != 0u {
                let y = clusters[first].center - point.position.middle;
                (*sums).reflected[k] += cluster_expansion(point.fields[k], first, y, k);
                whole += 1u;
            }
            if (listed & (1u << (LIST_OPEN + k))) != 0u {
                next[k] = first;
            }
        }
        for (var i = min(next[0], next[1]); i < end; i = min(next[0], next[1])) {
            visited += 1u;
            let is_single = (clusters[i].link & SINGLE) != 0u;
            let view = cluster_view(i, point.position);
            let away = cluster_is_away(i, view);
            var singles = 0u;
            for (var k = 0u; k < 2u; k++) {
                if next[k] > i {
                    continue;
                }
                next[k] = cluster_end(i);
                if away {
                    continue;
                }
                let fate = cluster_fate(point.fields[k], i, view, k, false, cluster_tolerance, &cluster_budget);
                if fate == CLUSTER_WHOLE {
                    (*sums).reflected[k] += cluster_expansion(point.fields[k], i, view.y, k);
                    whole += 1u;
                } else if fate == CLUSTER_REFINE {
                    if is_single {
                        singles |= 1u << k;
                    } else {
                        next[k] = i + 1u;
                    }
                }
            }
            if singles != 0u {
                let emitter = emitters[clusters[i].link & INDEX_MASK];
                var reasons = array<u32, SKIP_REASONS>();
                reasons[7] = countOneBits(singles);
                add_light(emitter, singles, position, shading, weights, tolerance, budget, sums, &reasons);
                count_skips(row, emitter.light, reasons);
            }
        }
    }
    count_skips(row, frame.lights, array<u32, SKIP_REASONS>(0u, visited, whole, 0u, 0u, 0u, 0u, 0u));
}
