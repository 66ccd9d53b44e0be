// Clipping at a half-space through the origin of cosine space. Twin of src/kernel/horizon.rs.
//
// All crossings of a planar light with such a plane lie on one line, so the closing edges need no order and no
// pairing: each crossing adds a function of its own place on the line, with the sign of its direction. Two
// planes are in use: z = 0 of cosine space, where the clamped cosine ends, and the true horizon of the
// surface, which a tilted lobe dips below.

// Whether any light may be cut by the horizon of a surface or of a lobe.
override HORIZONS: bool = true;

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
    // What a crossing adds that is below the other plane: that of the corner, where the lines of both planes meet.
    corner: f32,
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
    // `along` x `across` is `axis`.
    plane.slope = -sign(map.depth) * axis.z;
    return plane;
}

// Gives both planes of a clip the corner in which their lines meet. It lies on the line common to both planes, through the origin:
// one point for both, so that what one line loses there the other gains, however nearly the planes coincide.
fn join(clip: ptr<function, Clip>, map: CosineMap, axis: vec3f) {
    let ridge = vec3f(-axis.y, axis.x, 0.0);
    // Where the lines are parallel the corner is at infinity, on whichever side leaves the right part of each.
    let rate_any = dot(map.normal, ridge);
    let rate = select(rate_any, select(1e-30, -1e-30, rate_any < 0.0), abs(rate_any) <= 1e-30);
    let corner = ridge * clamp(-map.depth / rate, -1e30, 1e30);
    (*clip).first.corner = plane_crossing((*clip).first, corner);
    (*clip).second.corner = plane_crossing((*clip).second, corner);
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
            clip.second = plane;
            join(&clip, map, axis);
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
    return plane.slope * angle_on_line(dot(p, plane.along), plane.distance);
}

// Where an edge meets a horizon: whether it starts and ends above, and its parameter where it crosses, without meaning
// where it doesn't.
struct Meeting {
    start: bool,
    end: bool,
    at: f32,
}

fn meeting(plane: Horizon, a: vec2f, b: vec2f) -> Meeting {
    let ha = height_at(plane.height, a);
    let hb = height_at(plane.height, b);
    return Meeting(ha > 0.0, hb > 0.0, ha / (ha - hb));
}

// Whether the edge is above where it crosses the other horizon, which it crosses before this one or after.
fn is_above(meeting: Meeting, before: bool) -> bool {
    return (meeting.start && meeting.end) || (meeting.start && before) || (meeting.end && !before);
}

// Where the part above begins and where it ends; it is empty where that is before.
fn part_above(meeting: Meeting) -> vec2f {
    if meeting.start {
        return vec2f(0.0, select(meeting.at, 1.0, meeting.end));
    }
    return select(vec2f(), vec2f(meeting.at, 1.0), meeting.end);
}

// The point at t of the edge from a to b: b itself where that is the end, which a crossing a hair before it rounds to. What closes
// the edge must begin where the edge's own part ends.
fn along(a: vec2f, b: vec2f, t: f32) -> vec2f {
    return select(b, a + (b - a) * t, t < 1.0);
}

// What an edge's crossing of a horizon adds; `inside` says whether it is above the other horizon. That is asked of the edge, not of
// the place on the line: where the planes nearly coincide the two would differ by rounding, and the edge's own part must agree.
fn closing(map: CosineMap, plane: Horizon, meeting: Meeting, inside: bool, a: vec2f, b: vec2f) -> f32 {
    if meeting.start == meeting.end {
        return 0.0;
    }
    var up = plane.corner;
    if inside {
        up = plane_crossing(plane, map_point(map, along(a, b, meeting.at)));
    }
    return select(-up, up, meeting.end);
}

// 2 pi times the integral along the part of the edge from a to b (relative to the map's foot) that is above all planes, with
// what its crossings add. Unless it `may_cross` it is known to be above them.
fn cut_edge(map: CosineMap, clip: Clip, may_cross: bool, a: vec2f, b: vec2f) -> f32 {
    if !may_cross {
        return edge_integral(map, a, b);
    }
    let first = meeting(clip.first, a, b);
    var second = Meeting(true, true, 0.0);
    var sum = 0.0;
    if clip.planes == 2u {
        second = meeting(clip.second, a, b);
        sum = closing(map, clip.second, second, is_above(first, first.at > second.at), a, b);
    }
    // Of two crossings at one place, in one direction, this one is inside and that one is not.
    sum += closing(map, clip.first, first, is_above(second, !(first.at > second.at)), a, b);
    let of_first = part_above(first);
    let of_second = part_above(second);
    let start = max(of_first.x, of_second.x);
    let end = min(of_first.y, of_second.y);
    if start < end {
        sum += edge_integral(map, along(a, b, start), along(a, b, end));
    }
    return sum;
}
