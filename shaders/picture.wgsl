// The colour of a light as a shading point sees it: one fetch from a prefiltered picture. Twin of src/kernel/picture.rs,
// which explains it.

@group(0) @binding(10) var<storage, read> picture_levels: array<Level>;
@group(0) @binding(11) var<storage, read> picture_texels: array<vec2u>;

// Places beyond this (tree space) are as far as the edge of any picture.
const FARTHEST_PLACE: f32 = 1e6;
const WIDEST_VARIANCE: f32 = 3e38;

// The Gaussian that stands for the clamped cosine on a light.
struct Footprint {
    // Its middle, tree space.
    place: vec2f,
    // sigma^2 along each axis, tree space.
    variance: f32,
}

// For one shading point. Finite for every map.
//
// The plane's point nearest the origin is foot + (w1.N, -w0.N)/|N|^2: the map's own foot is kept near the light. The
// parallelogram over the unit square of tree space has the area |N|.
fn light_footprint(map: CosineMap) -> Footprint {
    let extents = abs(map.normal);
    let largest = max(extents.x, max(extents.y, extents.z));
    if !(largest > 0.0) {
        return Footprint(map.foot, WIDEST_VARIANCE);
    }
    // |N|^2 itself would leave the range of f32 for lights that are small and far.
    let n = map.normal / largest;
    let length = length(n);
    let across = vec2f(dot(map.w1, n), -dot(map.w0, n)) / (length * length) / largest;
    let place = min(max(map.foot + across, vec2f(-FARTHEST_PLACE)), vec2f(FARTHEST_PLACE));
    let distance = abs(map.depth) / length / largest;
    let variance = distance / largest * distance / (2.0 * length);
    return Footprint(place, min(variance, WIDEST_VARIANCE));
}

// A picture's colour under a footprint: bilinear in two levels, mixed so that the variance is that of the footprint.
fn fetch(first: u32, footprint: Footprint) -> vec3f {
    var i = first;
    while picture_levels[i].coarser > 0u && picture_levels[i + 1u].variance <= footprint.variance {
        i += 1u;
    }
    let color = fetch_level(i, footprint.place);
    if picture_levels[i].coarser == 0u {
        return color;
    }
    let fine = picture_levels[i].variance;
    let coarse = picture_levels[i + 1u].variance;
    let share = (footprint.variance - fine) / (coarse - fine);
    if share <= 0.0 {
        return color;
    }
    return mix(color, fetch_level(i + 1u, footprint.place), share);
}

// Bilinear between the texels' centres; beyond the outer ones the edge goes on.
fn fetch_level(i: u32, place: vec2f) -> vec3f {
    let level = picture_levels[i];
    let width = level.size & 0xffffu;
    let height = level.size >> 16u;
    let last = vec2f(f32(width - 1u), f32(height - 1u));
    let at = min(max((place - level.low) * level.per_unit * (last + 1.0) - 0.5, vec2f()), last);
    let cell = floor(at);
    let part = at - cell;
    let x = u32(cell.x);
    let right = min(x + 1u, width - 1u);
    let row = level.offset + u32(cell.y) * width;
    let above = level.offset + min(u32(cell.y) + 1u, height - 1u) * width;
    let lower = mix(picture_texel(row + x), picture_texel(row + right), part.x);
    return mix(lower, mix(picture_texel(above + x), picture_texel(above + right), part.x), part.y);
}

fn picture_texel(i: u32) -> vec3f {
    let words = picture_texels[i];
    loaded += 8u;
    return vec3f(unpack2x16float(words.x), unpack2x16float(words.y).x);
}

// An integral in the colours that the point sees of the emitter.
fn painted(gathered: Gathered, emitter: Emitter, map: CosineMap) -> Gathered {
    var result = gathered;
    if PICTURES && emitter.picture != NO_PICTURE {
        result.value *= fetch(emitter.picture, light_footprint(map));
    }
    return result;
}
