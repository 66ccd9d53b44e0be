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
    for (var first = MOST_LISTED - listed.open; first < MOST_LISTED; first += 32u) {
        // What becomes of so many open lights by both lobes, a bit for each: the expansion stands for them, or they are integrated.
        var whole = vec2u();
        var handed = vec2u();
        for (var bit = 0u; bit < 32u && first + bit < MOST_LISTED; bit++) {
            let entry = cluster_list[first + bit];
            let i = entry >> LIST_INDEX;
            let asking = point.shines & vec2((entry & 1u) != 0u, (entry & 2u) != 0u);
            visited += u32(any(asking));
            let view = cluster_view(i, point.position, false);
            let open = asking & vec2(!cluster_is_away(i, view, false));
            var fates = vec2u();
            if DIFFUSE && open.x {
                fates.x = cluster_fate(point.plain, i, view, PLAIN, false, cluster_tolerance, cluster_budget);
            }
            if SPECULAR && open.y {
                fates.y = cluster_fate(point.lobe, i, view, SPECULAR_LOBE, false, cluster_tolerance, cluster_budget);
            }
            whole |= vec2u(fates == vec2u(CLUSTER_WHOLE)) << vec2u(bit);
            handed |= vec2u(fates == vec2u(CLUSTER_REFINE)) << vec2u(bit);
        }
        for (var left = whole.x | whole.y; left != 0u; left &= left - 1u) {
            let bit = firstTrailingBit(left);
            let i = cluster_list[first + bit] >> LIST_INDEX;
            let y = clusters[i].center - point.position.middle;
            if DIFFUSE && ((whole.x >> bit) & 1u) != 0u {
                add_expansion(&plain, point.plain, i, y, PLAIN);
            }
            if SPECULAR && ((whole.y >> bit) & 1u) != 0u {
                add_expansion(&lobe, point.lobe, i, y, SPECULAR_LOBE);
            }
        }
        // Invocations go from light to light, so that they integrate them together.
        for (var left = handed.x | handed.y; left != 0u; left &= left - 1u) {
            let bit = firstTrailingBit(left);
            let light = clusters[cluster_list[first + bit] >> LIST_INDEX].link & INDEX_MASK;
            let lobes = ((handed.x >> bit) & 1u) | ((handed.y >> bit) & 1u) << 1u;
            var reasons = array<u32, SKIP_REASONS>();
            reasons[6] = countOneBits(lobes);
            add_light(emitters[light], light, lobes, position, shading, weights, tolerance, budget, sums, &reasons);
            count_skips(row, emitters[light].light, reasons);
        }
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
