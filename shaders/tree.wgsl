// The walk over the chord-moment tree. Twin of src/kernel/tree.rs, which explains it; the kinds of node come from there.

const PLACE_ABOVE: u32 = 0u;
const PLACE_CUT: u32 = 1u;
// Wholly below the first horizon, and the next value below the second.
const PLACE_BELOW: u32 = 2u;

// Past all nodes.
const NO_NODE: u32 = 0xffffffffu;
// No top is shared: see top.wgsl. The pass has a function `top_node`, which gives the nodes of tops, each up to NO_NODE.
const NO_TOP: u32 = 0xffffffffu;
// Where the shared top of the next tree to be walked begins.
var<private> top: u32 = 0xffffffffu;

// A value and what it cost.
struct Integral {
    // Normalised: 1 for a full hemisphere.
    value: f32,
    // Nodes and pieces of leaves visited.
    visited: u32,
}

// The expansion's integral over a node with those half-extents.
fn region_integral(map: CosineMap, e: Expansion, half: vec2f, i: u32) -> f32 {
    let d = expansion_derivatives(map, e, max(half.x, half.y));
    loaded += 40u;
    let first = d.gradient.x * nodes[i].m1[0] + d.gradient.y * nodes[i].m1[1];
    let second = d.curvature.x * nodes[i].m2[0] + d.curvature.y * nodes[i].m2[1] + d.curvature.z * nodes[i].m2[2];
    let third = d.third.x * nodes[i].m3[0] + d.third.y * nodes[i].m3[1] + d.third.z * nodes[i].m3[2] + d.third.w * nodes[i].m3[3];
    return d.value * nodes[i].m0 + first + second + third;
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

// Bound of what an expansion leaves out of a region above the horizons, from the integral of rho^first |dA|; of the whole of one that
// they may cut, from its area.
fn region_bound(e: Expansion, place: u32, area: f32, area_first: f32, first: u32) -> Bound {
    if place == PLACE_ABOVE {
        return remainder(e, area_first, first);
    }
    return magnitude(e, area);
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

// How much of a node, or of a piece of a leaf, the window has.
fn node_in_window(emitter: Emitter, i: u32, link: u32, level: u32, index: u32) -> u32 {
    if !WINDOWS {
        return WINDOW_HAS;
    }
    let kind = link & ~LINK_MASK;
    let begin = cell_of(i, level, index);
    let end = select(begin + max(CELLS >> level, 1u), (emitter.first + (link & LINK_MASK)) << CELLS_LOG, kind <= RUN);
    return window_part(begin, end, kind != SEGMENT);
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
    // The next node that is refined for the whole workgroup.
    var at_top = top;
    var refined = NO_NODE;
    if at_top != NO_TOP {
        refined = top_node(at_top);
    }
    // Inside a leaf: piece `index` of 2^level, from `a`.
    var leaf: Cubic;
    var level = 0u;
    var index = 0u;
    var a: vec2f;
    while true {
        while i == refined {
            i += 1u;
            at_top += 1u;
            refined = top_node(at_top);
        }
        if is_past(i, emitter.end, level, index) {
            break;
        }
        visited += 1u;
        let piece = level > 0u;
        var link = CUBIC;
        var b: vec2f;
        var center: vec2f;
        var half: vec2f;
        var area: f32;
        var area_4: f32;
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
            loaded += 40u;
            link = nodes[i].link;
            a = nodes[i].a - map.foot;
            b = nodes[i].b - map.foot;
            center = nodes[i].center - map.foot;
            half = nodes[i].half;
            area = node_area(nodes[i].areas);
            area_4 = node_area_4(nodes[i].areas);
        }
        let kind = link & ~LINK_MASK;
        let part = node_in_window(emitter, i, link, level, index);
        let place = box_place(clip, center, half);
        let e = expansion_about(map, center, half);
        var accept = false;
        if kind != SEGMENT && place < PLACE_BELOW && part == WINDOW_HAS {
            // Of pieces the zeroth order about the centroid of a sliver, whose integral of rho^2 |dA| is no more than half its area.
            let bound = region_bound(e, place, abs(area), select(area_4, 0.5 * abs(area), piece), select(4u, 2u, piece));
            accept = budget_accept(budget, bound.numerator, bound.denominator, tolerance);
        }
        let refine = !accept && kind != SEGMENT && place < PLACE_BELOW && level < DEEPEST && part == WINDOW_HAS;
        if refine || part == WINDOW_CUTS {
            if piece {
                level += 1u;
                index *= 2u;
            } else if kind == CUBIC {
                let ends = handles[emitter.first_detail + (link & LINK_MASK)];
                loaded += 16u;
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
                region += region_integral(map, e, half, i);
            }
        }
        if kind != CLUSTER && part == WINDOW_HAS {
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
