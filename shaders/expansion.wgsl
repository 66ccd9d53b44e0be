// Taylor's expansion of the kernel over a region far from the shading point, and how far it is off. Twin of
// src/kernel/expansion.rs, which explains it.

// The expansion point of a region in cosine space.
struct Expansion {
    // Unit direction of the region's centre.
    dir: vec3f,
    // 1/|p|.
    inv: f32,
    // D / (pi*|p|^3).
    scale: f32,
    // Squared ratio of the region's radius to |p|.
    s2: f32,
    // Offsets along the line of sight by the x and y axes, over |p|.
    along: vec2f,
    // Heights of the x and y axes, over |p|.
    rise: vec2f,
    // Square of the largest offset along the line of sight in the box.
    t2: f32,
    // The largest difference in height in the box.
    climb: f32,
}

// An error bound, not yet divided out: to be compared it need not be. The denominator is positive.
struct Bound {
    numerator: f32,
    denominator: f32,
}

// Of the box about `center`, which is relative to the map's foot, with those half-extents.
fn expansion_about(map: CosineMap, center: vec2f, half: vec2f) -> Expansion {
    let p = map_point(map, center);
    let inv2 = 1.0 / dot(p, p);
    let inv = sqrt(inv2);
    let dir = p * inv;
    let r2 = half.x * half.x * map.gram.x + half.y * half.y * map.gram.z + 2.0 * half.x * half.y * abs(map.gram.y);
    let along = vec2f(dot(map.c0, dir), dot(map.c1, dir)) * inv;
    let rise = vec2f(map.c0.z, map.c1.z) * inv;
    let t = dot(abs(along), half);
    return Expansion(dir, inv, map.depth / PI * inv2 * inv, r2 * inv2, along, rise, t * t, dot(abs(rise), half));
}

// Two bounds in one word: see `areas` in src/kernel/tree.rs.
fn node_area(areas: u32) -> f32 {
    return bitcast<f32>(areas & 0xffff0000u);
}

fn node_area_4(areas: u32) -> f32 {
    return bitcast<f32>(areas << 16u);
}

// Bound of the terms from the order `first` on, 2 to 4, for a region above the horizon: `area` is the integral of rho^first |dA|.
// Infinite where the region reaches as far as the origin.
fn remainder(e: Expansion, area: f32, first: u32) -> Bound {
    let s = sqrt(e.s2);
    let gap = 1.0 - s;
    if !(gap > 0.0) {
        return Bound(INFINITE_BOUND, 1.0);
    }
    let n = f32(first);
    let z = e.dir.z;
    let gap_3 = gap * gap * gap;
    let s4 = e.s2 * e.s2;
    // Both bounds times s^(5-n)*(1 - s)^3.
    let most = 0.5 * (n + 1.0) * (n + 2.0);
    let leading = min(most * z + select(select(LEVEL_4, LEVEL_3, first == 3u), LEVEL_2, first == 2u), most);
    // The sum of (k+1)(k+2)/2*s^k over k > n.
    let rest = 0.5 * (n + 2.0) * (n + 3.0) - s * ((n + 1.0) * (n + 3.0) - s * most);
    var terms = s4 * s * (leading * gap_3 + s * rest);
    if e.t2 <= ACROSS * e.s2 {
        // The sums of (k+2)/2*s^k and (k+1)/2*s^k over k >= n.
        let of_height = 0.5 * (n + 2.0) - 0.5 * (n + 1.0) * s;
        let of_climb = 0.5 * (n + 1.0) - 0.5 * n * s;
        let across = s4 + e.t2 * (1.5 * e.s2 + 3.61 * e.t2);
        terms = min(terms, across * (z * s * of_height + e.climb * of_climb) * gap);
    }
    let per = select(select(s, e.s2, first == 3u), e.s2 * s, first == 2u) * gap_3;
    return Bound(abs(e.scale) * area * terms, max(per, LEAST));
}

// Bound of the region's whole integral, wherever the horizon cuts it: k is at most (z + s)/(1 - s)^4, and 1/(1 - s)^3, of its
// scale. Infinite where the region reaches as far as the origin.
fn magnitude(e: Expansion, area: f32) -> Bound {
    let s = sqrt(e.s2);
    let gap = 1.0 - s;
    if !(gap > 0.0) {
        return Bound(INFINITE_BOUND, 1.0);
    }
    return Bound(abs(e.scale) * area * clamp((e.dir.z + s) / gap, 0.0, 1.0), max(gap * gap * gap, LEAST));
}

// k and its derivatives of first, second and third order, as the moments m0 to m3 of a node want them.
struct Derivatives {
    value: f32,
    gradient: vec2f,
    curvature: vec3f,
    third: vec4f,
}

// The kernel and its derivatives at the centre, times the factors of Taylor's series, by steps of `unit` along the axes.
fn expansion_derivatives(map: CosineMap, e: Expansion, unit: f32) -> Derivatives {
    let z = e.dir.z;
    let rise = e.rise * unit;
    let along = e.along * unit;
    let step = e.inv * unit;
    let gram = map.gram * step * step;
    let square = vec3f(along.x * along.x, along.x * along.y, along.y * along.y);
    // 12 B^2 - 2 G and 12 G - 32 B^2, by xx, xy and yy.
    let second = (square * 12.0 - gram * 2.0) * vec3f(1.0, 2.0, 1.0);
    let inner = (gram * 12.0 - square * 32.0) * vec3f(1.0, 2.0, 1.0);
    let steep = along * z;
    let curvature = second * z - 4.0 * vec3f(rise.x * along.x, rise.x * along.y + rise.y * along.x, rise.y * along.y);
    let third = vec4f(
        steep.x * inner.x + rise.x * second.x,
        steep.x * inner.y + steep.y * inner.x + rise.x * second.y + rise.y * second.x,
        steep.x * inner.z + steep.y * inner.y + rise.x * second.z + rise.y * second.y,
        steep.y * inner.z + rise.y * second.z,
    );
    return Derivatives(e.scale * z, (rise - steep * 4.0) * e.scale, curvature * e.scale, third * e.scale);
}
