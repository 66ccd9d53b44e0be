// Curves as the polygonal techniques read them, their corners and edges. Twin of src/kernel/curve.rs.

@group(0) @binding(6) var<storage, read> curves: array<Curve>;

// An integral by edges, and how many it took.
struct EdgeSum {
    // The integral, normalised: 1 for a full hemisphere; negative behind the light.
    value: f32,
    // Edges integrated: those with a part above the horizon, closing edges apart.
    edges: u32,
}

// A curve relative to the map's foot.
fn local_curve(curve: Curve, foot: vec2f) -> Cubic {
    return Cubic(curve.p0 - foot, curve.p3 - foot, curve.p1 - curve.p0, curve.p2 - curve.p1, curve.p3 - curve.p2);
}

// Whether it is a straight line.
fn is_line(curve: Cubic) -> bool {
    return all(curve.d0 == vec2f()) && all(curve.d2 == vec2f());
}

// The heights of the control points; those of the ends are what every curve that meets there finds.
fn control_heights(curve: Cubic, plane: Horizon) -> vec4f {
    return vec4f(
        height_at(plane.height, curve.p0),
        height_at(plane.height, curve.p0 + curve.d0),
        height_at(plane.height, curve.p3 - curve.d2),
        height_at(plane.height, curve.p3),
    );
}

// A corner of a polygon: a point of the light's plane and what its two edges share.
struct Corner {
    // Relative to the map's foot.
    q: vec2f,
    // Its image.
    p: vec3f,
    // 1/|p|.
    inv: f32,
}

// At the point q relative to the map's foot.
fn corner_at(map: CosineMap, q: vec2f) -> Corner {
    let p = map_point(map, q);
    return Corner(q, p, 1.0 / max(length(p), NEAREST_IMAGE));
}

// 2 pi times the contour integral along the edge from a to b (see edge_integral).
fn corner_edge(map: CosineMap, a: Corner, b: Corner) -> f32 {
    let u = b.q - a.q;
    let inv = a.inv * b.inv;
    return edge_angle(edge_normal(map, perp_dot(u, a.q), u), dot(a.p, b.p) * inv, inv);
}

// corner_edge of the edge's part above the horizon, with the closing term where it crosses. `cut` is whether the horizon may cut
// its curve.
fn clipped_edge(map: CosineMap, clip: Clip, cut: bool, a: Corner, b: Corner) -> EdgeSum {
    if !cut {
        return EdgeSum(corner_edge(map, a, b), 1u);
    }
    let ha = height_at(clip.first.height, a.q);
    let hb = height_at(clip.first.height, b.q);
    if ha > 0.0 && hb > 0.0 {
        return EdgeSum(corner_edge(map, a, b), 1u);
    }
    if !(ha > 0.0) && !(hb > 0.0) {
        return EdgeSum(0.0, 0u);
    }
    let c = corner_at(map, a.q + (b.q - a.q) * (ha / (ha - hb)));
    let closing = plane_crossing(clip.first, c.p);
    if ha > 0.0 {
        return EdgeSum(corner_edge(map, a, c) - closing, 1u);
    }
    return EdgeSum(corner_edge(map, c, b) + closing, 1u);
}

// What clips a light at one shading point by a technique that knows z = 0 only. The light is taken for its whole square.
fn clip_square(map: CosineMap) -> Clip {
    return clip_light(map, vec3f(0.0, 0.0, 1.0), -map.foot, vec2f(1.0));
}
