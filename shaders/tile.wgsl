// What a tile of shading points may receive from a light, for all of its points at once. Twin of src/kernel/tile.rs.
//
// The tile is known by boxes of vectors: of its positions, of its normals and of the rows r of its lobes' inverse matrices in world
// axes. The light is a box as well. So a point of the light relative to a point of the tile, w, lies in a box, and each coordinate
// r.w of its image in cosine space lies in an interval. All bounds are taken on the safe side of their rounding.

// A box of vectors.
struct Extent {
    low: vec3f,
    high: vec3f,
}

// What the shading points of a tile have in common.
struct TileBounds {
    position: Extent,
    normal: Extent,
    // Rows x, y, z of the inverse matrices, of points with a specular weight.
    rows: array<Extent, 3>,
    // Largest determinant of them.
    determinant: f32,
    // Largest weights of the plain cosine and of the lobe, per channel.
    weights: array<vec3f, 2>,
}

// From the points of a tile to those of a light.
struct Offsets {
    // From middle to middle.
    middle: vec3f,
    // Half-extents of the tile.
    tile: vec3f,
    // Largest magnitude of each coordinate.
    reach: vec3f,
    // What each coordinate may be off by rounding.
    noise: vec3f,
    // Largest height of the tile over a flat light's plane on the side that shines; of a body, its largest distance.
    height: f32,
}

fn offsets_to(tile: TileBounds, light: LightBox) -> Offsets {
    let origin = (tile.position.low + tile.position.high) * 0.5;
    let middle = light.center - origin;
    let extent = (tile.position.high - tile.position.low) * 0.5;
    let reach = abs(middle)
        + extent
        + abs(light.x) * light.half_x
        + abs(light.y) * light.half_y
        + abs(light.z) * light.half_z;
    let noise = (abs(light.center) + abs(origin) + reach) * MARGIN;
    let across = dot(abs(light.z), extent + noise);
    let over = -dot(light.z, middle);
    let flat = select(abs(over), over, light.one_sided == 1u) + across;
    return Offsets(middle, extent, reach, noise, select(flat, length(reach), light.half_z > 0.0));
}

// Whether all of the tile is behind the light.
fn tile_is_behind(offsets: Offsets, light: LightBox) -> bool {
    return light.one_sided == 1u && offsets.height < 0.0;
}

// Bounds of r.w for all rows r in a box.
fn interval(offsets: Offsets, light: LightBox, row: Extent) -> vec2f {
    let r = (row.low + row.high) * 0.5;
    let half = (row.high - row.low) * 0.5;
    let middle = dot(r, offsets.middle);
    let along = abs(dot(r, light.x)) * light.half_x
        + abs(dot(r, light.y)) * light.half_y
        + abs(dot(r, light.z)) * light.half_z;
    let radius = along + dot(abs(r), offsets.tile + offsets.noise) + dot(half, offsets.reach + offsets.noise);
    return vec2f(middle - radius, middle + radius);
}

// Whether all of the light is below the plane with those normals at all of the tile.
fn light_is_below(offsets: Offsets, light: LightBox, normal: Extent) -> bool {
    return interval(offsets, light, normal).y < 0.0;
}

// Bound of the plain cosine's integral over the light at any point of the tile.
fn diffuse_bound(offsets: Offsets, tile: TileBounds, light: LightBox) -> f32 {
    // The distance in the light's own axes.
    let extent = offsets.tile + offsets.noise;
    let nearest = vec3f(
        gap(dot(light.x, offsets.middle), light.half_x + dot(abs(light.x), extent)),
        gap(dot(light.y, offsets.middle), light.half_y + dot(abs(light.y), extent)),
        gap(dot(light.z, offsets.middle), light.half_z + dot(abs(light.z), extent)),
    );
    return sent(offsets, light, length(nearest), interval(offsets, light, tile.normal).y, 1.0);
}

// Bound of the lobe's integral over the light at any point of the tile.
fn specular_bound(offsets: Offsets, tile: TileBounds, light: LightBox) -> f32 {
    let x = interval(offsets, light, tile.rows[0]);
    let y = interval(offsets, light, tile.rows[1]);
    let z = interval(offsets, light, tile.rows[2]);
    let middle = vec3f(x.x + x.y, y.x + y.y, z.x + z.y) * 0.5;
    let radius = vec3f(x.y - x.x, y.y - y.x, z.y - z.x) * 0.5;
    let nearest = vec3f(gap(middle.x, radius.x), gap(middle.y, radius.y), gap(middle.z, radius.z));
    return sent(offsets, light, length(nearest), z.y, tile.determinant);
}

// determinant * area * height * z / (pi |p|^4), the area form of the integral at its largest, or the 1 that no integral exceeds.
// `nearest` is the least |p|, `z` the largest height of p.
fn sent(offsets: Offsets, light: LightBox, nearest: f32, z: f32, determinant: f32) -> f32 {
    if !(nearest > 0.0) {
        return 1.0;
    }
    let inv = 1.0 / nearest;
    let slant = clamp(z * inv, 0.0, 1.0);
    let bound = (light.area * inv * inv) * (max(offsets.height, 0.0) * inv) * (slant * determinant) * 0.31830989;
    return min(bound, 1.0);
}

// The least magnitude in an interval.
fn gap(middle: f32, radius: f32) -> f32 {
    return max(abs(middle) - radius, 0.0);
}

// Where a bound belongs that is `share` of what skipped lights may use up: in bucket j it is less than 2^-j. Past the last where it
// is 1 or more, or no number.
fn bucket(share: f32) -> u32 {
    if !(share < 1.0) {
        return BUCKETS;
    }
    return min(126u - min(bitcast<u32>(share) >> 23u, 126u), BUCKETS - 1u);
}
