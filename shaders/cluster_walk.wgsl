// What a shading point gathers from the clusters that its tile lists. Twin of src/kernel/cluster_walk.rs; the lights that are handed
// on are integrated on the way.

// What a lobe has gathered, and how many expansions that is.
struct ClusterSum {
    reflected: vec3f,
    whole: u32,
}

// Adds what a point reflects of the clusters that its tile has listed, and of the lights that they hand on.
fn add_clusters(
    listed: Listing,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    row: u32,
    cluster_tolerance: f32,
    tolerance: f32,
    cluster_budget: ptr<function, ClusterBudget>,
    budget: ptr<function, Budget>,
    sums: ptr<function, Sums>,
) {
    let point = receiver_of_point(position, shading, weights);
    var plain = ClusterSum();
    var lobe = ClusterSum();
    for (var n = 0u; n < listed.whole; n++) {
        let entry = cluster_list[n];
        let i = entry >> LIST_INDEX;
        let y = clusters[i].center - point.position.middle;
        let whole = point.shines & vec2((entry & 1u) != 0u, (entry & 2u) != 0u);
        if DIFFUSE && whole.x {
            add_expansion(&plain, point.plain, i, y, PLAIN);
        }
        if SPECULAR && whole.y {
            add_expansion(&lobe, point.lobe, i, y, SPECULAR_LOBE);
        }
    }
    var visited = 0u;
    var next = MOST_LISTED - listed.open;
    loop {
        // Invocations go from light to light, so that they integrate them together.
        var singles = 0u;
        var light = 0u;
        while singles == 0u && next < MOST_LISTED {
            let i = cluster_list[next] >> LIST_INDEX;
            let open = point.shines & vec2((cluster_list[next] & 1u) != 0u, (cluster_list[next] & 2u) != 0u);
            next += 1u;
            visited += 1u;
            let view = cluster_view(i, point.position, false);
            let facing = !cluster_is_away(i, view, false);
            if DIFFUSE && facing && open.x {
                singles |= visit_cluster(&plain, point.plain, i, view, PLAIN, cluster_tolerance, cluster_budget);
            }
            if SPECULAR && facing && open.y {
                singles |= visit_cluster(&lobe, point.lobe, i, view, SPECULAR_LOBE, cluster_tolerance, cluster_budget);
            }
            light = clusters[i].link & INDEX_MASK;
        }
        if singles == 0u {
            break;
        }
        var reasons = array<u32, SKIP_REASONS>();
        reasons[6] = countOneBits(singles);
        add_light(emitters[light], light, singles, position, shading, weights, tolerance, budget, sums, &reasons);
        count_skips(row, emitters[light].light, reasons);
    }
    (*sums).reflected[0] += plain.reflected;
    (*sums).reflected[1] += lobe.reflected;
    let whole = plain.whole + lobe.whole;
    count_skips(row, frame.lights, array<u32, SKIP_REASONS>(0u, visited, whole, 0u, 0u, 0u, 0u));
}

fn add_expansion(sum: ptr<function, ClusterSum>, f: Field, i: u32, y: vec3f, lobe: u32) {
    (*sum).reflected += cluster_expansion(f, i, y, lobe);
    (*sum).whole += 1u;
}

// Adds what stands for a light at the point; gives the bit of the lobe if it must integrate it.
fn visit_cluster(
    sum: ptr<function, ClusterSum>,
    f: Field,
    i: u32,
    view: ClusterView,
    lobe: u32,
    tolerance: f32,
    budget: ptr<function, ClusterBudget>,
) -> u32 {
    let fate = cluster_fate(f, i, view, lobe, false, tolerance, budget);
    if fate == CLUSTER_WHOLE {
        add_expansion(sum, f, i, view.y, lobe);
    }
    return select(0u, 1u << lobe, fate == CLUSTER_REFINE);
}
