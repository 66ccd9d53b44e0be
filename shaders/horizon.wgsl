// Clipping at a half-space through the origin of cosine space. Twin of src/kernel/horizon.rs.
//
// All crossings of a planar light with such a plane lie on one line, so the closing edges need no order and no
// pairing: each crossing adds a function of its own place on the line, with the sign of its direction. Two
// planes are in use: z = 0 of cosine space, where the clamped cosine ends, and the true horizon of the
// surface, which a tilted lobe dips below.

// Whether any light may be cut by the horizon of a surface or of a lobe.
override HORIZONS: bool = true;

// An end of a line that has none.
const UNBOUNDED: f32 = 3e38;

const SIDE_ABOVE: u32 = 0u;
const SIDE_CUT: u32 = 1u;
const SIDE_BELOW: u32 = 2u;

// The height over a plane through the origin of cosine space, as a function of the light's plane.
struct Height {
    // Height of the point q relative to the foot, up to a positive factor: form.x*q.x + form.y*q.y + form.z.
    form: vec3f,
    // Rounding bound anywhere on the light: a box higher than this has every point of every curve in it above.
    margin: f32,
}

// From the heights of the map's c0, c1, c2, up to a common positive factor.
fn height_over(map: CosineMap, form: vec3f) -> Height {
    let reach = 1.0 + abs(map.foot);
    return Height(form, MARGIN * (abs(form.x) * reach.x + abs(form.y) * reach.y + abs(form.z)));
}

// The height of a point relative to the foot. Above means > 0; every decision about a shared end point is this very
// expression, so that crossings pair.
fn height_at(height: Height, q: vec2f) -> f32 {
    return height.form.x * q.x + height.form.y * q.y + height.form.z;
}

// Where a box lies, given by its centre relative to the foot and its half-extents.
fn box_side(height: Height, center: vec2f, half: vec2f) -> u32 {
    let middle = height_at(height, center);
    let reach = abs(height.form.x) * half.x + abs(height.form.y) * half.y + height.margin;
    if middle - reach > 0.0 {
        return SIDE_ABOVE;
    }
    return select(SIDE_CUT, SIDE_BELOW, middle + reach < 0.0);
}

// One clipping plane that cuts the light, for one map.
struct Horizon {
    height: Height,
    // Direction of the line in which the light's plane cuts this one.
    along: vec3f,
    // Distance of that line from the origin.
    distance: f32,
    // z of the unit normal of the plane of origin and line: 1 or -1 for z = 0 itself.
    slope: f32,
    // The part of the line inside the other plane's half-space.
    low: f32,
    high: f32,
}

// What clips a light at one shading point: no plane, the first, or both; or the light is wholly below one.
struct Clip {
    planes: u32,
    below: bool,
    first: Horizon,
    second: Horizon,
}

fn normalize_or_zero(v: vec3f) -> vec3f {
    let length = length(v);
    return select(vec3f(), v / length, length > 0.0);
}

// The plane with the unit normal `axis`.
fn horizon_plane(map: CosineMap, axis: vec3f, height: Height) -> Horizon {
    let n = map.normal;
    var plane: Horizon;
    plane.height = height;
    plane.along = normalize_or_zero(cross(n, axis));
    // The line's point nearest the origin is -D*n'/|n'|^2, n' the part of n across the axis.
    let across = n - axis * dot(n, axis);
    let length = length(across);
    plane.distance = select(0.0, abs(map.depth) / length, length > 0.0);
    plane.slope = normalize_or_zero(cross(plane.along, across * -sign(map.depth))).z;
    plane.low = -UNBOUNDED;
    plane.high = UNBOUNDED;
    return plane;
}

// Ends the line at `corner`; it goes on upwards from there, or downwards.
fn ending_at(plane_any: Horizon, corner: vec3f, upwards: bool) -> Horizon {
    var plane = plane_any;
    let place = dot(corner, plane.along);
    if upwards {
        plane.low = place;
    } else {
        plane.high = place;
    }
    return plane;
}

// What clips a light whose box has that centre relative to the foot and those half-extents. `axis` is the normal of the
// surface's true horizon in cosine space, up to a positive factor: z alone where that is z = 0 itself.
fn clip_light(map: CosineMap, axis_any: vec3f, center: vec2f, half: vec2f) -> Clip {
    var clip: Clip;
    if !HORIZONS {
        return clip;
    }
    let lobe = height_over(map, vec3f(map.c0.z, map.c1.z, map.c2.z));
    let side = box_side(lobe, center, half);
    // A plane that is z = 0 must not be closed twice.
    let stands_apart = dot(axis_any.xy, axis_any.xy) > 1e-12 * axis_any.z * axis_any.z;
    let surface = height_over(map, map.surface);
    let surface_side = select(SIDE_ABOVE, box_side(surface, center, half), stands_apart);
    if side == SIDE_BELOW || surface_side == SIDE_BELOW {
        clip.below = true;
        return clip;
    }
    let z = vec3f(0.0, 0.0, 1.0);
    if side == SIDE_CUT {
        clip.first = horizon_plane(map, z, lobe);
        clip.planes = 1u;
    }
    if surface_side == SIDE_CUT {
        let axis = normalize(axis_any);
        let plane = horizon_plane(map, axis, surface);
        if clip.planes == 0u {
            clip.first = plane;
        } else {
            // The corner lies on the line common to both planes, through the origin: one point for both, so that
            // what one line loses there the other gains, however nearly the planes coincide.
            let ridge = vec3f(-axis.y, axis.x, 0.0);
            // Where the lines are parallel the corner is at infinity, on whichever side leaves the right part of each.
            let rate_any = dot(map.normal, ridge);
            let rate = select(rate_any, select(1e-30, -1e-30, rate_any < 0.0), abs(rate_any) <= 1e-30);
            let corner = ridge * clamp(-map.depth / rate, -1e30, 1e30);
            clip.first = ending_at(clip.first, corner, rate > 0.0);
            clip.second = ending_at(plane, corner, rate < 0.0);
        }
        clip.planes += 1u;
    }
    return clip;
}

// atan2(place, distance) for distance >= 0, by the polynomial of the edges: WGSL promises atan2 to 4096 units only.
fn angle_on_line(place: f32, distance: f32) -> f32 {
    let largest = max(abs(place), distance);
    if largest == 0.0 {
        return 0.0;
    }
    let p = place / largest;
    let d = distance / largest;
    let inv = 1.0 / sqrt(p * p + d * d);
    return p * inv * angle_over_sine(d * inv);
}

// What a crossing at the image point p adds (times 2 pi) where the contour comes up; where it goes down, it
// takes that away.
fn plane_crossing(plane: Horizon, p: vec3f) -> f32 {
    let place = min(max(dot(p, plane.along), plane.low), plane.high);
    return plane.slope * angle_on_line(place, plane.distance);
}

// What a crossing below the other horizon adds where the contour comes up: the line ends at the corner.
fn plane_far_crossing(plane: Horizon) -> f32 {
    let corner = select(plane.high, plane.low, plane.low > -UNBOUNDED);
    return plane.slope * angle_on_line(corner, plane.distance);
}

// The part of an edge above some planes, as a range of its parameter, and what its crossings close with.
struct Cut {
    start: f32,
    end: f32,
    closing: f32,
}

fn cut_at(map: CosineMap, plane: Horizon, cut_any: Cut, a: vec2f, b: vec2f) -> Cut {
    var cut = cut_any;
    let ha = height_at(plane.height, a);
    let hb = height_at(plane.height, b);
    if ha > 0.0 && hb > 0.0 {
        return cut;
    }
    if !(ha > 0.0) && !(hb > 0.0) {
        cut.end = 0.0;
        return cut;
    }
    let t = ha / (ha - hb);
    let closing = plane_crossing(plane, map_point(map, a + (b - a) * t));
    if ha > 0.0 {
        cut.closing -= closing;
        cut.end = min(cut.end, t);
    } else {
        cut.closing += closing;
        cut.start = max(cut.start, t);
    }
    return cut;
}

// 2 pi times the integral along the part of the edge from a to b (relative to the map's foot) that is above all planes, with
// what its crossings add. Unless it `may_cross` it is known to be above them.
fn cut_edge(map: CosineMap, clip: Clip, may_cross: bool, a: vec2f, b: vec2f) -> f32 {
    var cut = Cut(0.0, 1.0, 0.0);
    if may_cross {
        cut = cut_at(map, clip.first, cut, a, b);
        if clip.planes == 2u {
            cut = cut_at(map, clip.second, cut, a, b);
        }
        if !(cut.start < cut.end) {
            return cut.closing;
        }
    }
    let start = select(a + (b - a) * cut.start, a, cut.start == 0.0);
    let end = select(a + (b - a) * cut.end, b, cut.end == 1.0);
    return cut.closing + edge_integral(map, start, end);
}
