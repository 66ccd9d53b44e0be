// What a shading point gathers from the clusters that its tile lists. Twin of src/kernel/cluster_walk.rs; the lights that are handed
// on are integrated on the way.

// What a lobe has gathered, and how many expansions that is.
struct ClusterSum {
    reflected: vec3f,
    whole: u32,
}

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
    var plain = ClusterSum();
    var lobe = ClusterSum();
    for (var n = 0u; n < clusters_listed; n++) {
        let i = cluster_list[n] >> LIST_INDEX;
        let y = clusters[i].center - point.position.middle;
        let whole = point.shines & vec2((cluster_list[n] & 1u) != 0u, (cluster_list[n] & 2u) != 0u);
        if DIFFUSE && whole.x {
            add_expansion(&plain, point.plain, i, y, PLAIN);
        }
        if SPECULAR && whole.y {
            add_expansion(&lobe, point.lobe, i, y, SPECULAR_LOBE);
        }
    }
    var cluster_budget = tile_budget;
    var visited = 0u;
    // The listed cluster, and where the walk through it is and ends: invocations go from light to light, so that they integrate
    // them together.
    var listed = 0u;
    var end = 0u;
    var next = vec2u();
    loop {
        var singles = 0u;
        var light = 0u;
        while singles == 0u {
            let i = min(next.x, next.y);
            if i >= end {
                if listed == clusters_listed {
                    break;
                }
                let entry = cluster_list[listed];
                listed += 1u;
                end = cluster_end(entry >> LIST_INDEX);
                let open = vec2((entry & (1u << LIST_OPEN)) != 0u, (entry & (2u << LIST_OPEN)) != 0u);
                next = select(vec2u(end), vec2u(entry >> LIST_INDEX), point.shines & open);
                continue;
            }
            visited += 1u;
            let view = cluster_view(i, point.position, false);
            let facing = !cluster_is_away(i, view, false);
            let awake = next <= vec2u(i);
            next = select(next, vec2u(cluster_end(i)), awake);
            var refine = vec2(false);
            if DIFFUSE && facing && awake.x {
                refine.x = visit_cluster(&plain, point.plain, i, view, PLAIN, cluster_tolerance, &cluster_budget);
            }
            if SPECULAR && facing && awake.y {
                refine.y = visit_cluster(&lobe, point.lobe, i, view, SPECULAR_LOBE, cluster_tolerance, &cluster_budget);
            }
            if (clusters[i].link & SINGLE) == 0u {
                next = select(next, vec2u(i + 1u), refine);
            } else {
                singles = u32(refine.x) | u32(refine.y) << 1u;
                light = clusters[i].link & INDEX_MASK;
            }
        }
        if singles == 0u {
            break;
        }
        var reasons = array<u32, SKIP_REASONS>();
        reasons[7] = countOneBits(singles);
        add_light(emitters[light], light, singles, position, shading, weights, tolerance, budget, sums, &reasons);
        count_skips(row, emitters[light].light, reasons);
    }
    if is_first_window() {
        (*sums).reflected[0] += plain.reflected;
        (*sums).reflected[1] += lobe.reflected;
    }
    let whole = plain.whole + lobe.whole;
    count_skips(row, frame.lights, array<u32, SKIP_REASONS>(0u, visited, whole, 0u, 0u, 0u, 0u, 0u));
}

fn add_expansion(sum: ptr<function, ClusterSum>, f: Field, i: u32, y: vec3f, lobe: u32) {
    (*sum).reflected += cluster_expansion(f, i, y, lobe);
    (*sum).whole += 1u;
}

// Adds what stands for a cluster at the point, and tells whether it wants its parts.
fn visit_cluster(
    sum: ptr<function, ClusterSum>,
    f: Field,
    i: u32,
    view: ClusterView,
    lobe: u32,
    tolerance: f32,
    budget: ptr<function, ClusterBudget>,
) -> bool {
    let fate = cluster_fate(f, i, view, lobe, false, tolerance, budget);
    if fate == CLUSTER_WHOLE {
        add_expansion(sum, f, i, view.y, lobe);
    }
    return fate == CLUSTER_REFINE;
}
