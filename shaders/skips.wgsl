// Counters of what is skipped, by light and reason: behind, below the horizon, without such a lobe, under the tolerance; of the
// first two those that were decided for whole tiles; left to clusters, and of these handed on to the light itself.
//
// Past the lights are the clusters: visited for tiles, visited by points, expansions.

const SKIP_REASONS: u32 = 8u;
const NO_LIGHT: u32 = 0xffffffffu;

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
