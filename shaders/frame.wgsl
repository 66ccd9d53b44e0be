// The shading frame. Twin of src/kernel/frame.rs.

// Orthonormal, right-handed: z is the normal, x the tangential part of the view direction.
struct ShadingFrame {
    x: vec3f,
    y: vec3f,
    z: vec3f,
    // cos theta of the view direction, 0 to 1. A view from below the surface counts as grazing.
    cos_theta: f32,
    // Towards the eye, as given.
    view: vec3f,
}

// From a unit normal and a unit vector towards the eye.
fn shading_frame(normal: vec3f, view: vec3f) -> ShadingFrame {
    let cos_theta = dot(normal, view);
    let tangent = view - normal * cos_theta;
    // Once more across the normal: what rounding left along it is large against a short tangent, and may be all there is of one.
    let across = tangent - normal * dot(normal, tangent);
    var x: vec3f;
    if dot(across, across) > 1e-14 {
        x = normalize(across);
    } else {
        // Along the normal every tangent serves: lobes there are round.
        x = any_orthonormal_vector(normal);
    }
    return ShadingFrame(x, cross(normal, x), normal, clamp(unit_cosine(normal, view), 0.0, 1.0), view);
}

// The cosine between two vectors whose lengths are 1 but for their rounding, rounded once: the axis of a needle follows its last
// digit.
fn unit_cosine(a: vec3f, b: vec3f) -> f32 {
    let length_a = wide_dot(widened3(a), widened3(a));
    let length_b = wide_dot(widened3(b), widened3(b));
    let lengths = (length_a.hi - 1.0 + length_a.lo) + (length_b.hi - 1.0 + length_b.lo);
    let cosine = wide_dot(widened3(a), widened3(b));
    return cosine.hi + (cosine.lo - 0.5 * lengths * cosine.hi);
}

// Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin 2017, "Building an Orthonormal Basis, Revisited".
fn any_orthonormal_vector(n: vec3f) -> vec3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return vec3f(b, s + n.y * n.y * a, -n.y);
}

// World to shading frame.
fn to_local(shading: ShadingFrame, v: vec3f) -> vec3f {
    return vec3f(dot(shading.x, v), dot(shading.y, v), dot(shading.z, v));
}
