// Polygons as lights: projected areas and distances for integrals. Twin of src/kernel/pal.rs, which says what is whose.
//
// This file depends on the globals
//     polygons: array<Polygon>, edges: array<vec4f>   read-only storage; xy from, zw to, or four distances of a texture
// and on the constants PAL_* (WEIGHTED, BIASED: u32; BIAS, NEAR, PHI, MIRROR_EXPONENT: f32), which come from there.

// An outer contour with its holes.
struct Polygon {
    // Middle of the circumscribed circle: of the bounding box.
    circle: vec2f,
    // Centroid of the area.
    centroid: vec2f,
    // Radius of the circle.
    radius: f32,
    // First edge; past the last of the outer contour; past the last of the holes.
    first: u32,
    outer: u32,
    end: u32,
    // First texel; texels along a side, at least 2.
    texels: u32,
    side: u32,
}

// An integral and what it is made of.
struct PalIntegral {
    // 1 for a full hemisphere; at least 0, from either side.
    value: f32,
    // Edges visited, or texels read.
    visited: u32,
}

// The approximate integral of the plain cosine over the polygons first..end; `map` is not to have D = 0.
fn pal_diffuse(map: CosineMap, first: u32, end: u32, basis: u32) -> PalIntegral {
    let scale = sqrt(max(map.gram.x, map.gram.z));
    var sum = PalIntegral();
    for (var i = first; i < end; i++) {
        let polygon = polygons[i];
        loaded += 40u;
        let radius = polygon.radius * scale;
        let height = map_point(map, polygon.circle - map.foot).z;
        let occlusion = clamp((height + radius) / (2.0 * radius), 0.0, 1.0);
        if !(occlusion > 0.0) {
            continue;
        }
        var place = map_point(map, polygon.centroid - map.foot);
        if basis == PAL_WEIGHTED {
            place = weighted_place(map, polygon, place);
            sum.visited += polygon.outer - polygon.first;
        }
        let back = select(0.0, PAL_BIAS * radius, basis == PAL_BIASED);
        let area = projected_area(map, polygon, place, back);
        sum.visited += polygon.end - polygon.first;
        if area > 0.0 {
            sum.value += min(area / PI, 1.0) * occlusion;
        }
    }
    return sum;
}

// The mean of the outer contour's corners, each weighted by the mean length of its two edges over its distance.
fn weighted_place(map: CosineMap, polygon: Polygon, otherwise: vec3f) -> vec3f {
    var place = vec3f();
    var weights = 0.0;
    for (var i = polygon.first; i < polygon.outer; i++) {
        loaded += 16u;
        let a = map_point(map, edges[i].xy - map.foot);
        let b = map_point(map, edges[i].zw - map.foot);
        let span = length(b - a);
        let wa = span / length(a);
        let wb = span / length(b);
        place += a * wa + b * wb;
        weights += wa + wb;
    }
    if weights > 0.0 && weights < 3e38 {
        return place / weights;
    }
    return otherwise;
}

// Area of the projection to the plane z' = 1, z' towards `place`, from a point `back` behind the origin. Positive for outer
// contours, from either side; 0 where `place` is the origin.
//
// An edge adds half of (a x b).z'/(a_z'*b_z'). Edges are cut at z' = near; all such cuts lie on one line, where an edge from
// one to the other adds the difference of a function of its ends alone, so that the order of cuts does not matter.
fn projected_area(map: CosineMap, polygon: Polygon, place: vec3f, back: f32) -> f32 {
    let distance = length(place);
    if !(distance > 0.0) {
        return 0.0;
    }
    let z = place / distance;
    let near = PAL_NEAR * (distance + back);
    // z' of a point, and ((b - a) x a).z' of an edge.
    let form = vec3f(dot(map.c0, z), dot(map.c1, z), dot(map.c2, z) + back);
    let turn = vec3f(dot(map.normal, z), dot(map.w0, z), dot(map.w1, z));
    // Along the line of cuts.
    let line = cross(map.normal, z);
    let across = cross(line, z);
    let unit = 1.0 / max(dot(line, line) * near * near, 1e-37);
    var sum = 0.0;
    for (var i = polygon.first; i < polygon.end; i++) {
        loaded += 16u;
        var a = edges[i].xy - map.foot;
        var b = edges[i].zw - map.foot;
        var ha = form.x * a.x + form.y * a.y + form.z;
        var hb = form.x * b.x + form.y * b.y + form.z;
        let above_a = ha > near;
        let above_b = hb > near;
        if !above_a && !above_b {
            continue;
        }
        if above_a != above_b {
            let cut = a + (b - a) * clamp((near - ha) / (hb - ha), 0.0, 1.0);
            let p = map_point(map, cut);
            let closing = dot(p, line) * dot(p, across) * unit;
            if above_a {
                b = cut;
                hb = near;
                sum += closing;
            } else {
                a = cut;
                ha = near;
                sum -= closing;
            }
        }
        let u = b - a;
        sum += (turn.x * perp_dot(u, a) + turn.y * u.x + turn.z * u.y) / (ha * hb);
    }
    return 0.5 * select(sum, -sum, map.depth < 0.0);
}

// The approximate integral of the specular lobe of GGX width `alpha`, for a view at `cos_theta`; `map` is not to have D = 0.
fn pal_specular(map: CosineMap, first: u32, end: u32, alpha: f32, cos_theta: f32) -> PalIntegral {
    var sum = PalIntegral();
    let c = min(max(cos_theta, 0.0), 1.0);
    let mirror = vec3f(-sqrt(1.0 - c * c), 0.0, c);
    let fall = dot(map.normal, mirror);
    if !(fall * map.depth < 0.0) {
        return sum;
    }
    // Cramer's rule for where the ray meets the plane.
    let q = map.foot + vec2f(dot(map.w1, mirror), -dot(map.w0, mirror)) / fall;
    let distance = abs(map.depth / fall);
    let sides = sqrt(map.gram.xz);
    let scale = max(sides.x, sides.y);
    let exponent = PAL_MIRROR_EXPONENT * (1.0 - sqrt(min(max(alpha, 0.0), 1.0)));
    for (var i = first; i < end; i++) {
        let polygon = polygons[i];
        loaded += 40u;
        let radius = polygon.radius * scale;
        let offset = (q - polygon.circle) * sides / (PAL_PHI * radius);
        let rim = 1.0 - length(offset);
        if !(rim > 0.0) {
            continue;
        }
        let outside = max(distance_at(polygon, offset), 0.0);
        sum.value += exp2(-exponent * log2(1.0 + outside)) * min(radius / distance, 1.0) * rim;
        sum.visited += 1u;
    }
    return sum;
}

// The texture of a polygon at a place in -1..1, bilinear between texel centres.
fn distance_at(polygon: Polygon, place: vec2f) -> f32 {
    let last = f32(polygon.side - 1u);
    let at = clamp((place * 0.5 + 0.5) * f32(polygon.side) - 0.5, vec2f(0.0), vec2f(last));
    let low = min(floor(at), vec2f(last - 1.0));
    let part = at - low;
    let corner = polygon.texels + u32(low.y) * polygon.side + u32(low.x);
    let above = corner + polygon.side;
    let lower = mix(texel_of(corner), texel_of(corner + 1u), part.x);
    let upper = mix(texel_of(above), texel_of(above + 1u), part.x);
    return mix(lower, upper, part.y);
}

fn texel_of(i: u32) -> f32 {
    loaded += 4u;
    return edges[i >> 2u][i & 3u];
}
