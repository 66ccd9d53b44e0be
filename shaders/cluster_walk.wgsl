// What a shading point gathers from the clusters that its tile lists. Twin of src/kernel/cluster_walk.rs; the lights that are handed
// on are integrated on the way.

// What a lobe has gathered, and how many expansions that is.
struct ClusterSum {
    reflected: vec3f,
    whole: u32,
}

// The open lights that some point of the tile integrates, a bit for each of so many. One word is written and read, the next is cleared,
// and those who are late may still read the last.
var<workgroup> handed_on: array<atomic<u32>, 3>;
var<private> turn: u32;

// Adds what a point reflects of the clusters that its tile has listed, and of the lights that they hand on. All invocations call it.
fn add_clusters(
    local: u32,
    there: bool,
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
    for (var first = 0u; first < listed.whole; first += SHARED_CLUSTERS) {
        let count = min(listed.whole - first, SHARED_CLUSTERS);
        share_clusters(local, first, count);
        for (var n = 0u; n < select(0u, count, there); n++) {
            let entry = cluster_list[first + n];
            let y = tile_values[n * CLUSTER_PARTS].xyz - point.position.middle;
            let whole = point.shines & vec2((entry & 1u) != 0u, (entry & 2u) != 0u);
            let red = shared_moments(n, 0u);
            let green = shared_moments(n, 1u);
            let blue = shared_moments(n, 2u);
            if DIFFUSE && whole.x {
                plain.reflected += cluster_expansion(point.plain, red, green, blue, y, PLAIN);
                plain.whole += 1u;
            }
            if SPECULAR && whole.y {
                lobe.reflected += cluster_expansion(point.lobe, red, green, blue, y, SPECULAR_LOBE);
                lobe.whole += 1u;
            }
        }
    }
    var visited = 0u;
    for (var first = MOST_LISTED - listed.open; first < MOST_LISTED; first += 32u) {
        // What becomes of so many open lights by both lobes, a bit for each: the expansion stands for them, or they are integrated.
        var whole = vec2u();
        var handed = vec2u();
        for (var bit = 0u; there && bit < 32u && first + bit < MOST_LISTED; bit++) {
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
        // Invocations go together through the lights that any of them integrates.
        atomicOr(&handed_on[turn], handed.x | handed.y);
        let written = turn;
        turn = select(turn + 1u, 0u, turn == 2u);
        atomicStore(&handed_on[turn], 0u);
        workgroupBarrier();
        for (var left = atomicLoad(&handed_on[written]); left != 0u; left &= left - 1u) {
            let bit = firstTrailingBit(left);
            let lobes = ((handed.x >> bit) & 1u) | ((handed.y >> bit) & 1u) << 1u;
            if lobes == 0u {
                continue;
            }
            let light = clusters[cluster_list[first + bit] >> LIST_INDEX].link & INDEX_MASK;
            var reasons = array<u32, SKIP_REASONS>();
            reasons[6] = countOneBits(lobes);
            add_light(emitters[light], light, lobes, position, shading, weights, tolerance, budget, sums, &reasons);
            count_skips(row, emitters[light].light, reasons);
        }
    }
    if !there {
        return;
    }
    if is_first_window() {
        (*sums).reflected[0] += plain.reflected;
        (*sums).reflected[1] += lobe.reflected;
    }
    let whole = plain.whole + lobe.whole;
    count_skips(row, frame.lights, array<u32, SKIP_REASONS>(0u, visited, whole, 0u, 0u, 0u, 0u));
}

fn add_expansion(sum: ptr<function, ClusterSum>, f: Field, i: u32, y: vec3f, lobe: u32) {
    let red = clusters[i].moments[0];
    let green = clusters[i].moments[1];
    let blue = clusters[i].moments[2];
    (*sum).reflected += cluster_expansion(f, red, green, blue, y, lobe);
    (*sum).whole += 1u;
}

// Clusters that all points of a tile need, loaded once for all of them: they take the place of what was known of the tile's points.
const SHARED_CLUSTERS: u32 = 48u;
// A centre, and the columns of three matrices.
const CLUSTER_PARTS: u32 = 13u;

fn share_clusters(local: u32, first: u32, count: u32) {
    workgroupBarrier();
    for (var n = local; n < count * CLUSTER_PARTS; n += TILE) {
        let i = cluster_list[first + n / CLUSTER_PARTS] >> LIST_INDEX;
        let part = n % CLUSTER_PARTS;
        if part == 0u {
            tile_values[n] = vec4f(clusters[i].center, 0.0);
        } else {
            tile_values[n] = clusters[i].moments[(part - 1u) / 4u][(part - 1u) % 4u];
        }
    }
    workgroupBarrier();
}

fn shared_moments(n: u32, channel: u32) -> mat4x4f {
    let at = n * CLUSTER_PARTS + 1u + 4u * channel;
    return mat4x4f(tile_values[at], tile_values[at + 1u], tile_values[at + 2u], tile_values[at + 3u]);
}
