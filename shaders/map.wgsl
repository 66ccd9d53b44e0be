// The affine map from a light's plane to cosine space. Twin of src/kernel/map.rs, in f32 throughout: what would
// cancel is formed in world space, where it is short.

// p = c0*(x - foot.x) + c1*(y - foot.y) + c2 from tree space to cosine space, at one shading point.
struct CosineMap {
    // Tree-space point that c2 belongs to.
    foot: vec2f,
    // Images of the x axis, the y axis and the foot.
    c0: vec3f,
    c1: vec3f,
    c2: vec3f,
    // c0 x c1, c0 x c2, c1 x c2.
    normal: vec3f,
    w0: vec3f,
    w1: vec3f,
    // D = -normal . c2: positive in front of the light. 0 where there is no map.
    depth: f32,
    // c0.c0, c0.c1, c1.c1.
    gram: vec3f,
    // Heights of c0, c1, c2 over the surface itself.
    surface: vec3f,
}

// A light as a shading point sees it: its tree's axes and middle in the shading frame, and -normal . middle.
struct Images {
    x: vec3f,
    y: vec3f,
    center: vec3f,
    normal: vec3f,
    front: f32,
    // 1, or -1 for a face that hides a part of the faces before it.
    sign: f32,
    // What they were formed of.
    seen: Seen,
}

// A light and a shading point: what the images are formed of, before any rounding.
struct Seen {
    // Of the point.
    position: vec3f,
    normal: vec3f,
    // Towards the eye.
    view: vec3f,
    // The power of two that the images are scaled by.
    unit: f32,
}

// A power of two that brings `largest` to about 1: it changes no digit.
fn power_of_two_unit(largest: f32) -> f32 {
    return bitcast<f32>((254u - clamp(bitcast<u32>(largest) >> 23u, 1u, 253u)) << 23u);
}

// The light's images, from its axes and middle in world space relative to the point.
fn light_images(shading: ShadingFrame, emitter: Emitter, position: vec3f) -> Images {
    if BODIES && emitter.form >= FORM_FACING_SPHERE {
        return body_images(shading, emitter, position);
    }
    let center = emitter.center - position;
    let largest = max(max(abs(emitter.x), abs(emitter.y)), abs(center));
    let unit = power_of_two_unit(max(largest.x, max(largest.y, largest.z)));
    var images: Images;
    images.x = to_local(shading, emitter.x * unit);
    images.y = to_local(shading, emitter.y * unit);
    images.center = to_local(shading, center * unit);
    images.normal = to_local(shading, emitter.normal * unit * unit);
    images.front = -dot(emitter.normal * unit * unit, center * unit);
    images.sign = 1.0;
    images.seen = Seen(position, shading.z, shading.view, unit);
    if NEAR && abs(images.front) < 1e-4 * length(images.normal) * length(images.center) {
        images.front = wide_front(emitter, images.seen).hi;
    }
    return images;
}

// The front of a flat light's images with all digits, those of its sign above all.
fn wide_front(emitter: Emitter, seen: Seen) -> Wide {
    let apart = wide_sum3(emitter.center, -seen.position);
    let normal = wide_cross(widened3(emitter.x * seen.unit), widened3(emitter.y * seen.unit));
    return wide_negate(wide_dot(normal, Wide3(apart.hi * seen.unit, apart.lo * seen.unit)));
}

// The map of a light through a lobe's inverse matrix. Normal and depth come from the cofactors of the matrix, which keeps
// their digits where c0 and c1 are nearly parallel.
fn cosine_map(images: Images, lobe: Lobe) -> CosineMap {
    var map: CosineMap;
    map.c0 = lobe_apply(lobe, images.x);
    map.c1 = lobe_apply(lobe, images.y);
    map.normal = lobe_apply_cofactors(lobe, images.normal);
    map.gram = vec3f(dot(map.c0, map.c0), dot(map.c0, map.c1), dot(map.c1, map.c1));
    let middle = lobe_apply(lobe, images.center);
    let h0 = -dot(map.c0, middle);
    let h1 = -dot(map.c1, middle);
    let area2 = dot(map.normal, map.normal);
    if !(area2 > 1e-36) {
        return map;
    }
    let foot = vec2f(h0 * map.gram.z - h1 * map.gram.y, h1 * map.gram.x - h0 * map.gram.y) / area2;
    map.foot = clamp(foot, vec2f(-FOOT_LIMIT), vec2f(FOOT_LIMIT));
    let at_foot = images.center + images.x * map.foot.x + images.y * map.foot.y;
    map.surface = vec3f(images.x.z, images.y.z, at_foot.z);
    map.c2 = lobe_apply(lobe, at_foot);
    map.w0 = cross(map.c0, map.c2);
    map.w1 = cross(map.c1, map.c2);
    map.depth = images.front * lobe_determinant(lobe);
    return map;
}

// The image of a point given relative to the foot.
fn map_point(map: CosineMap, q: vec2f) -> vec3f {
    return map.c0 * q.x + map.c1 * q.y + map.c2;
}
