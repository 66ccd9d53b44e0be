// The triangle that a camera ray meets first. The rasteriser snaps corners to fractions of a pixel, so its answer is taken
// where the triangle covers the four pixels beside as well; elsewhere the ray is traced through the boxes of
// src/backend/gpu/boxes.rs. Either way the hit itself is that of the CPU.

struct Nearest {
    // The triangle's index.
    index: u32,
    // t < 0 where there is none.
    hit: Hit,
}

// What the ray through a pixel of the tile meets.
fn nearest_at(tile_pixel: vec2u, direction: vec3f) -> Nearest {
    let middle = vec2i(tile_pixel) + 1;
    let seen = textureLoad(visibility, middle, 0).x;
    // A triangle is convex: one that covers these four covers the pixel well inside.
    let alone = textureLoad(visibility, middle - vec2i(1, 0), 0).x == seen
        && textureLoad(visibility, middle + vec2i(1, 0), 0).x == seen
        && textureLoad(visibility, middle - vec2i(0, 1), 0).x == seen
        && textureLoad(visibility, middle + vec2i(0, 1), 0).x == seen;
    let none = Nearest(0u, Hit(-1.0, 0.0, 0.0));
    if alone && seen == 0u {
        return none;
    }
    if alone {
        let hit = intersect(seen - 1u, direction);
        if hit.t > 0.0 {
            return Nearest(seen - 1u, hit);
        }
    }
    return nearest_along(direction);
}

// What the ray meets, by its boxes in pre-order.
fn nearest_along(direction: vec3f) -> Nearest {
    let slow = abs(direction) < vec3f(1e-20);
    let inverse = 1.0 / select(direction, vec3f(1e-20), slow);
    var nearest = Nearest(0u, Hit(-1.0, 0.0, 0.0));
    var i = 0u;
    while i < frame.boxes {
        let t0 = boxes[i].low * inverse;
        let t1 = boxes[i].high * inverse;
        let near = min(t0, t1);
        let far = max(t0, t1);
        let enter = max(max(near.x, near.y), max(near.z, 0.0));
        let leave = min(min(far.x, far.y), far.z);
        // A box is left out only where rounding cannot be the reason.
        let missed = enter * 0.999999 > leave * 1.000001 || (nearest.hit.t > 0.0 && enter * 0.999999 > nearest.hit.t);
        if missed {
            i = boxes[i].skip;
            continue;
        }
        let first = boxes[i].triangles >> BOX_COUNT_BITS;
        let count = boxes[i].triangles & ((1u << BOX_COUNT_BITS) - 1u);
        for (var k = first; k < first + count; k++) {
            let hit = intersect(k, direction);
            if hit.t > 0.0 && (nearest.hit.t < 0.0 || hit.t < nearest.hit.t) {
                nearest = Nearest(k, hit);
            }
        }
        i += 1u;
    }
    return nearest;
}
