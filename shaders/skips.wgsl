// Counters of what is skipped, by light and reason: behind, below the horizon, without such a lobe, under the tolerance; of the
// first two those that were decided for whole tiles; handed on by clusters to the light itself.
//
// Past the lights are the clusters: visited for tiles, lights that points decided about, expansions; points that clusters light, and
// those with a weight of the plain cosine and of the lobe; clusters whose local expansion stands for them.

const SKIP_REASONS: u32 = 7u;
const NO_LIGHT: u32 = 0xffffffffu;

// Counts a tile that clusters light.
fn count_clustered(row: u32, found: Listing) {
    let points = u32(tile_summary[SLOT_COUNTS]);
    let plain = u32(tile_summary[SLOT_COUNTS + 1u]);
    let specular = u32(tile_summary[SLOT_COUNTS + 2u]);
    count_skips(row, frame.lights, array<u32, SKIP_REASONS>(found.visited, 0u, 0u, points, plain, specular, found.local));
}

// Adds to the 64-bit counters of a light. Rows keep workgroups out of each other's way.
fn count_skips(row: u32, light: u32, reasons: array<u32, SKIP_REASONS>) {
    if !is_first_window() {
        return;
    }
    for (var reason = 0u; reason < SKIP_REASONS; reason++) {
        let count = reasons[reason];
        if count > 0u {
            let at = 2u * ((row * (frame.lights + 1u) + light) * SKIP_REASONS + reason);
            let before = atomicAdd(&skips[at], count);
            if before + count < before {
                atomicAdd(&skips[at + 1u], 1u);
            }
        }
    }
}
