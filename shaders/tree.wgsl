// The walk over the chord-moment tree. Twin of src/kernel/tree.rs, which explains it; the kinds of node come from there.

const PLACE_ABOVE: u32 = 0u;
const PLACE_CUT: u32 = 1u;
// Wholly below the first horizon, and the next value below the second.
const PLACE_BELOW: u32 = 2u;

// A value and what it cost.
struct Integral {
    // Normalised: 1 for a full hemisphere.
    value: f32,
    // Nodes and pieces of leaves visited.
    visited: u32,
}

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
}

fn expansion_about(map: CosineMap, center: vec2f, half: vec2f) -> Expansion {
    let p = map_point(map, center);
    let inv2 = 1.0 / dot(p, p);
    let inv = sqrt(inv2);
    let r2 = half.x * half.x * map.gram.x + half.y * half.y * map.gram.z + 2.0 * half.x * half.y * abs(map.gram.y);
    return Expansion(p * inv, inv, map.depth / PI * inv2 * inv, r2 * inv2);
}

// Two bounds in one word: see `areas` in src/kernel/tree.rs.
fn node_area(areas: u32) -> f32 {
    return bitcast<f32>(areas & 0xffff0000u);
}

fn node_area_3(areas: u32) -> f32 {
    return bitcast<f32>(areas << 16u);
}

// Bound of what an expansion leaves out, for a region above the horizon: of the second order for a node, from the integral of
// rho^3 |dA|; of the zeroth about its centroid for a piece of a leaf, whose integral of rho^2 |dA| is no more than half its
// area. For a region that a horizon may cut, the bound of its whole integral, from its area. Infinite where the region reaches
// as far as the origin.
//
// The nth term of k about p is at most (n+1)(n+2)/2*s^n of the scale: p/|p|^4 has the complex generating function
// (1 - s*e^(i*theta))^-2 (1 - s*e^(-i*theta))^-1. Of the third, 10*z + 3.52*sqrt(1 - z^2) is the exact maximum.
fn expansion_bound(e: Expansion, area: f32, area_3: f32, place: u32, piece: bool) -> f32 {
    let s = sqrt(e.s2);
    let gap = 1.0 - s;
    if !(gap > 0.0) {
        return INFINITE_BOUND;
    }
    let gap_3 = 1.0 / (gap * gap * gap);
    let third = min(10.0 * e.dir.z + 3.52, 10.0);
    let second = min(6.0 * e.dir.z + 2.0, 6.0);
    var terms = area * clamp((e.dir.z + s) / gap, 0.0, 1.0) * gap_3;
    if place == PLACE_ABOVE {
        let remainder = area_3 * e.s2 * s * (third + s * (15.0 - s * (24.0 - 10.0 * s)) * gap_3);
        let remainder_at_centroid = 0.5 * area * e.s2 * (second + s * (10.0 - s * (15.0 - 6.0 * s)) * gap_3);
        terms = select(remainder, remainder_at_centroid, piece);
    }
    return abs(e.scale) * terms;
}

// k, grad k and the parts of H that go with the moments m0, m1 and m2.
struct Derivatives {
    value: f32,
    gradient: vec2f,
    curvature: vec3f,
}

// The kernel and its derivatives at the centre, times the factors of Taylor's series.
fn expansion_derivatives(map: CosineMap, e: Expansion) -> Derivatives {
    let z = e.dir.z;
    let z0 = map.c0.z * e.inv;
    let z1 = map.c1.z * e.inv;
    let b0 = dot(map.c0, e.dir) * e.inv;
    let b1 = dot(map.c1, e.dir) * e.inv;
    let inv2 = e.inv * e.inv;
    let h00 = 6.0 * z * b0 * b0 - 2.0 * z0 * b0 - z * map.gram.x * inv2;
    let h01 = 6.0 * z * b0 * b1 - z0 * b1 - z1 * b0 - z * map.gram.y * inv2;
    let h11 = 6.0 * z * b1 * b1 - 2.0 * z1 * b1 - z * map.gram.z * inv2;
    let gradient = vec2f(z0 - 4.0 * z * b0, z1 - 4.0 * z * b1) * e.scale;
    return Derivatives(e.scale * z, gradient, vec3f(2.0 * h00, 4.0 * h01, 2.0 * h11) * e.scale);
}

// k*m0 + grad k*m1 + 1/2 H:m2.
fn region_integral(map: CosineMap, e: Expansion, i: u32) -> f32 {
    let d = expansion_derivatives(map, e);
    let first = d.gradient.x * nodes[i].m1[0] + d.gradient.y * nodes[i].m1[1];
    let second = d.curvature.x * nodes[i].m2[0] + d.curvature.y * nodes[i].m2[1] + d.curvature.z * nodes[i].m2[2];
    return d.value * nodes[i].m0 + first + second;
}

// Where a box lies with respect to all horizons.
fn box_place(clip: Clip, center: vec2f, half: vec2f) -> u32 {
    if clip.planes == 0u {
        return PLACE_ABOVE;
    }
    let first = box_side(clip.first.height, center, half);
    if first == SIDE_BELOW {
        return PLACE_BELOW;
    }
    if clip.planes == 1u {
        return first;
    }
    let second = box_side(clip.second.height, center, half);
    return select(max(first, second), PLACE_BELOW + 1u, second == SIDE_BELOW);
}

// A curve below one horizon still crosses the other: beyond the corner of the two lines, where each crossing
// adds the same, so that only the end points count.
fn far_crossing(clip: Clip, place: u32, a: vec2f, b: vec2f) -> f32 {
    if clip.planes < 2u {
        return 0.0;
    }
    if place == PLACE_BELOW {
        return clip.second.corner * far_sign(clip.second.height, a, b);
    }
    return clip.first.corner * far_sign(clip.first.height, a, b);
}

// 1 where the edge comes up, -1 where it goes down.
fn far_sign(height: Height, a: vec2f, b: vec2f) -> f32 {
    return f32(height_at(height, b) > 0.0) - f32(height_at(height, a) > 0.0);
}

// The edge's part above all horizons, with the closing terms of its crossings.
fn edge_above(map: CosineMap, clip: Clip, place: u32, a: vec2f, b: vec2f) -> f32 {
    if place >= PLACE_BELOW {
        return far_crossing(clip, place, a, b);
    }
    return cut_edge(map, clip, place == PLACE_CUT, a, b);
}

// A third of the derivative at t.
fn cubic_tangent(c: Cubic, t: f32) -> vec2f {
    let s = 1.0 - t;
    return c.d0 * (s * s) + c.d1 * (2.0 * s * t) + c.d2 * (t * t);
}

// The clamped-cosine integral of an emission over the hemisphere that `clip` leaves, signed: positive in front of
// the light (map.depth > 0), negative behind. Nodes whose error bound is within their share of `tolerance` are not refined.
//
// Nodes and the pieces of a refined cubic leaf take turns in one loop, so that invocations of which some are inside a leaf
// stay together. A piece is its chord plus the sliver's area times the kernel at the sliver's centroid (0.4 of the sagitta
// off the chord).
fn tree_integral(
    map: CosineMap,
    clip: Clip,
    emitter: Emitter,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Integral {
    var contour = 0.0;
    var region = 0.0;
    var visited = 0u;
    var i = emitter.first;
    // Inside a leaf: piece `index` of 2^level, from `a`.
    var leaf: Cubic;
    var level = 0u;
    var index = 0u;
    var a: vec2f;
    while i < emitter.end {
        visited += 1u;
        let piece = level > 0u;
        var link = CUBIC;
        var b: vec2f;
        var center: vec2f;
        var half: vec2f;
        var area: f32;
        var area_3: f32;
        var centroid: vec2f;
        if piece {
            let width = 1.0 / f32(1u << level);
            let t0 = f32(index) * width;
            let t1 = t0 + width;
            b = leaf.p3;
            if index + 1u != 1u << level {
                b = cubic_point(leaf, t1);
            }
            let h0 = cubic_tangent(leaf, t0) * width;
            let h1 = cubic_tangent(leaf, t1) * width;
            let chord = b - a;
            let q2 = chord - h1;
            area = (3.0 * perp_dot(h0, q2) + 3.0 * perp_dot(h0, chord) + 6.0 * perp_dot(q2, chord)) / 20.0;
            let low = min(min(a, a + h0), min(b - h1, b));
            let high = max(max(a, a + h0), max(b - h1, b));
            center = (low + high) * 0.5;
            half = (high - low) * 0.5;
            centroid = a + chord * 0.5 + (h0 - h1) * (0.375 * 0.4);
        } else {
            link = nodes[i].link;
            a = nodes[i].a - map.foot;
            b = nodes[i].b - map.foot;
            center = nodes[i].center - map.foot;
            half = nodes[i].half;
            area = node_area(nodes[i].areas);
            area_3 = node_area_3(nodes[i].areas);
        }
        let kind = link & ~LINK_MASK;
        let place = box_place(clip, center, half);
        let e = expansion_about(map, center, half);
        var accept = false;
        if kind != SEGMENT && place < PLACE_BELOW {
            accept = budget_accept(budget, expansion_bound(e, abs(area), area_3, place, piece), tolerance);
        }
        if !accept && kind != SEGMENT && place < PLACE_BELOW && level < DEEPEST {
            if piece {
                level += 1u;
                index *= 2u;
            } else if kind == CUBIC {
                let ends = handles[emitter.first_detail + (link & LINK_MASK)];
                let p1 = ends.p1 - map.foot;
                let p2 = ends.p2 - map.foot;
                leaf = Cubic(a, b, p1 - a, p2 - p1, b - p2);
                // The first halving is certain: the whole leaf has just been refused.
                level = 1u;
                index = 0u;
            } else {
                i += 1u;
            }
            continue;
        }
        if place == PLACE_ABOVE && accept && kind != SEGMENT {
            if piece {
                let p = map_point(map, centroid);
                let inv2 = 1.0 / dot(p, p);
                region += map.depth / PI * p.z * inv2 * inv2 * area;
            } else {
                region += region_integral(map, e, i);
            }
        }
        if kind != CLUSTER {
            contour += edge_above(map, clip, place, a, b);
        }
        if piece {
            a = b;
            index += 1u;
            let up = min(countTrailingZeros(index), level);
            index >>= up;
            level -= up;
            i += u32(level == 0u);
        } else {
            i = select(i + 1u, emitter.first + (link & LINK_MASK), kind <= RUN);
        }
    }
    return Integral(contour / TAU + region, visited);
}
