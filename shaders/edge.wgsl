// The clamped-cosine integral along a straight edge. Twin of src/kernel/edge.rs.

const PI: f32 = 3.14159265358979;
const TAU: f32 = 6.28318530717959;

fn perp_dot(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// theta / sin theta for x = cos theta in [0, 1]: minimax polynomial, relative error 7e-8 (2.2e-7 as evaluated in f32).
fn angle_over_sine(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = (1.5707962 + -0.9999815 * x) + (0.784881 + -0.6609691 * x) * x2;
    let high = (0.5565553 + -0.42358105 * x) + (0.25208457 + -0.09726396 * x) * x2;
    return low + x4 * (high + 0.017478622 * x4);
}

// theta*(b x a)_z / |b x a| for the edge from a to b (relative to the map's foot), theta the angle it subtends at
// the origin: 2 pi times its share of the contour integral (Baum et al. 1989; Heitz et al. 2016, eq. 11).
fn edge_integral(map: CosineMap, a: vec2f, b: vec2f) -> f32 {
    let pa = map_point(map, a);
    let pb = map_point(map, b);
    let inv = 1.0 / (length(pa) * length(pb));
    return edge_angle(edge_normal(map, perp_dot(b - a, a), b - a), dot(pa, pb) * inv, inv);
}

// b x a for an edge with perp_dot(b - a, a) = turn and b - a = u.
fn edge_normal(map: CosineMap, turn: f32, u: vec2f) -> vec3f {
    return map.normal * turn + map.w0 * u.x + map.w1 * u.y;
}

// theta*n_z / |n| for n = b x a, the cosine of the angle theta between a and b, and inv = 1/(|a|*|b|).
fn edge_angle(normal: vec3f, cosine: f32, inv: f32) -> f32 {
    let x = clamp(cosine, -1.0, 1.0);
    let near = angle_over_sine(abs(x)) * inv;
    if x >= 0.0 {
        return normal.z * near;
    }
    let length = length(normal);
    // The edge runs through the origin: its plane is undefined and so is the integral; half the jump is 0.
    if length > 0.0 {
        return normal.z * (PI / length - near);
    }
    return 0.0;
}
