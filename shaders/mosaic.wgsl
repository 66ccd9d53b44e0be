// The walk over a mosaic: a region whose colour changes from place to place. Twin of src/kernel/mosaic.rs, which explains it.

// A tile of a mosaic, in pre-order.
struct Tile {
    center: vec2f,
    half: vec2f,
    mean: vec3f,
    skip: u32,
    m1_x: vec3f,
    first_node: u32,
    m1_y: vec3f,
    end_node: u32,
    m2_xx: vec3f,
    first_handles: u32,
    m2_xy: vec3f,
    deviation: f32,
    m2_yy: vec3f,
    deviation_3: f32,
}

@group(0) @binding(10) var<storage, read> tiles: array<Tile>;

// A value for each channel and what it cost.
struct ColorIntegral {
    // Normalised: 1 for a full hemisphere of white.
    value: vec3f,
    // Tiles, nodes and pieces of leaves visited.
    visited: u32,
}

// What a colour's difference to its mean adds: the terms of first and second order.
fn difference_integral(map: CosineMap, e: Expansion, i: u32) -> vec3f {
    let d = expansion_derivatives(map, e, 1.0);
    loaded += 60u;
    return tiles[i].m1_x * d.gradient.x + tiles[i].m1_y * d.gradient.y
        + tiles[i].m2_xx * d.curvature.x + tiles[i].m2_xy * d.curvature.y + tiles[i].m2_yy * d.curvature.z;
}

// The clamped-cosine integral of an emission's colours over the hemisphere that `clip` leaves, signed as tree_integral
// is, and as near.
fn mosaic_integral(
    map: CosineMap,
    clip: Clip,
    emitter: Emitter,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> ColorIntegral {
    var sum = ColorIntegral(vec3f(), 0u);
    let end = emitter.picture + tiles[emitter.picture].skip;
    var i = emitter.picture;
    while i < end {
        sum.visited += 1u;
        // Box, skip and deviation; what else a tile is read for is added there.
        loaded += 24u;
        let after = emitter.picture + tiles[i].skip;
        let center = tiles[i].center - map.foot;
        let half = tiles[i].half;
        let place = box_place(clip, center, half);
        // A whole region below a horizon: whatever its contours cross elsewhere, they cross back.
        if place >= PLACE_BELOW {
            i = after;
            continue;
        }
        if tiles[i].deviation > 0.0 {
            let e = expansion_about(map, center, half);
            let bound = region_bound(e, place, tiles[i].deviation, tiles[i].deviation_3, 3u);
            if !budget_accept(budget, bound.numerator, bound.denominator, tolerance) {
                i += 1u;
                continue;
            }
            if place == PLACE_ABOVE {
                sum.value += difference_integral(map, e, i);
            }
        }
        let mean = tiles[i].mean;
        loaded += 12u;
        let brightest = max(mean.x, max(mean.y, mean.z));
        if brightest > 0.0 {
            loaded += 12u;
            // The tiles' trees have no shared top.
            top = NO_TOP;
            var tile = emitter;
            tile.first = emitter.first + tiles[i].first_node;
            tile.end = emitter.first + tiles[i].end_node;
            tile.first_detail = emitter.first_detail + tiles[i].first_handles;
            let inner = tree_integral(map, clip, tile, tolerance / brightest, budget);
            sum.value += mean * inner.value;
            sum.visited += inner.visited;
        }
        i = after;
    }
    return sum;
}
