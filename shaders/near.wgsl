// Shading points so close to a light, or lobes so narrow, that f32 would show: the shading frame, the map to cosine space and
// the walk over the tree with twice the digits where differences cancel, and f32 where they don't. The twins of src/kernel and of
// clipped_wide in src/backend/gather.rs do all of it in f64.

// Distance from the light's plane over its half-width, in cosine space, below which coordinates need their low parts.
const CLOSE: f32 = 0.00390625;

// Whether the light comes so near the origin, or the lobe's footprint on it is so small, that the rounding of the light's
// coordinates to f32 would show. Of a needle it is the distance of the whole plane that counts, for in a space so stretched
// the foot, once it is kept near the light, may be far. It counts as well where a horizon may cut the light: it does so at nearly the
// same line as the other, or its line hangs by the last digits of heights that are nearly 0 all over the light.
fn is_close(map: CosineMap, lobe: Lobe) -> bool {
    let reach = max(map.gram.x, map.gram.z) * (CLOSE * CLOSE);
    let plane_is = reach * dot(map.normal, map.normal) > map.depth * map.depth;
    let lobe_form = vec3f(map.c0.z, map.c1.z, map.c2.z);
    let by_plane = is_narrow(lobe) || may_cut(map, lobe_form) || may_cut(map, map.surface);
    return (plane_is && by_plane) || (reach > dot(map.c2, map.c2) && !is_narrow(lobe));
}

// Whether a plane over which heights have this form may cut the light's square.
fn may_cut(map: CosineMap, form: vec3f) -> bool {
    return dot(abs(form.xy), 1.0 + abs(map.foot)) >= abs(form.z);
}

// Whether a lobe's axis needs more digits than the f32 frame has.
fn is_narrow(lobe: Lobe) -> bool {
    return lobe.alpha > 0.0 && lobe.alpha < NARROW;
}

// Whether the map of a lobe needs more digits than cosine_map has. What that says of its depth may be off by rounding.
fn needs_digits(emitter: Emitter, map: CosineMap, lobe: Lobe) -> bool {
    let flat = !BODIES || emitter.form < FORM_SPHERE;
    return flat && (map.depth == 0.0 || is_narrow(lobe) || is_close(map, lobe));
}

// A map and, to twice the digits, what sums cancel of: where the foot is kept near the light, a stretched space has it far from the
// point nearest the origin.
struct NearMap {
    map: CosineMap,
    foot: Wide2,
    c0: Wide3,
    c1: Wide3,
    c2: Wide3,
    normal: Wide3,
    w0: Wide3,
    w1: Wide3,
    // What f32 lost of the map's surface.
    surface_low: vec3f,
}

// The map of a flat light, the digits of all differences kept until they are formed.
fn near_map(emitter: Emitter, images: Images, lobe: Lobe) -> NearMap {
    let z = wide_normalize(widened3(images.seen.normal));
    let view = wide_normalize(widened3(images.seen.view));
    // Across the normal more than once: what rounding leaves along it is large against a short tangent.
    var tangent = view;
    for (var k = frame.zero; k < 3u; k++) {
        if k == 1u && !(dot(tangent.hi, tangent.hi) > 1e-14) {
            tangent = widened3(any_orthonormal_vector(images.seen.normal));
        }
        tangent = wide_add3(tangent, wide_negate3(wide_scale3(z, wide_dot(z, tangent))));
    }
    let x = wide_normalize(tangent);
    let y = wide_cross(z, x);
    // Rows of the inverse matrix in world axes.
    let row_x = wide_add3(wide_scale3(x, Wide(lobe.xx, 0.0)), wide_scale3(z, Wide(lobe.xz, 0.0)));
    let row_y = wide_scale3(y, Wide(lobe.yy, 0.0));
    let row_z = wide_add3(wide_scale3(x, Wide(lobe.zx, 0.0)), wide_scale3(z, Wide(lobe.zz, 0.0)));
    // A power of two changes no digit.
    let unit = images.seen.unit;
    let axis_x = widened3(emitter.x * unit);
    let axis_y = widened3(emitter.y * unit);
    let apart = wide_sum3(emitter.center, -images.seen.position);
    let center = Wide3(apart.hi * unit, apart.lo * unit);
    // A loop and not three calls, here and below: compilers unroll nothing whose end they don't know, and code as long as this takes
    // them seconds.
    var vectors = array(axis_x, axis_y, center);
    for (var k = frame.zero; k < 3u; k++) {
        let v = vectors[k];
        var p = array<Wide, 3>();
        var rows = array(row_x, row_y, row_z);
        for (var r = frame.zero; r < 3u; r++) {
            p[r] = wide_dot(rows[r], v);
        }
        vectors[k] = Wide3(vec3f(p[0].hi, p[1].hi, p[2].hi), vec3f(p[0].lo, p[1].lo, p[2].lo));
    }
    let c0 = vectors[0];
    let c1 = vectors[1];
    let middle = vectors[2];
    let normal = wide_cross(c0, c1);
    let depth = wide_times(wide_front(emitter, images.seen), Wide(lobe_determinant(lobe), 0.0));
    var near: NearMap;
    near.map.c0 = c0.hi;
    near.map.c1 = c1.hi;
    near.map.normal = normal.hi;
    near.map.gram = vec3f(dot(c0.hi, c0.hi), dot(c0.hi, c1.hi), dot(c1.hi, c1.hi));
    let gram = near.map.gram;
    let square = wide_dot(normal, normal);
    let area2 = square.hi;
    if !(area2 > 1e-36) {
        return near;
    }
    // The foot to f32, and again from what is left.
    var foot = Wide2();
    var c2 = middle;
    for (var k = frame.zero; k < 3u; k++) {
        // (h0*g11 - h1*g01) = -(c2 . (c0*g11 - c1*g01)), as a triple product: c0*g11 - c1*g01 = c1 x (c0 x c1) up to its sign.
        let along = vec2f(dot(cross(c1.hi, normal.hi), c2.hi), dot(cross(normal.hi, c0.hi), c2.hi));
        let step = -along / area2;
        foot = wide_add2(foot, widened2(step));
        c2 = wide_add3(c2, wide_add3(wide_scale3(c0, Wide(step.x, 0.0)), wide_scale3(c1, Wide(step.y, 0.0))));
    }
    let limit = vec2f(FOOT_LIMIT);
    if any(abs(foot.hi) > limit) {
        foot = widened2(clamp(foot.hi, -limit, limit));
        let step_x = wide_scale3(c0, Wide(foot.hi.x, 0.0));
        c2 = wide_add3(middle, wide_add3(step_x, wide_scale3(c1, Wide(foot.hi.y, 0.0))));
    }
    // Across the plane the foot's image is what D says: near contact the sum for it cancels, and D has all its digits.
    let off = wide_over(wide_add(depth, wide_dot(normal, c2)), square);
    c2 = wide_add3(c2, wide_negate3(wide_scale3(normal, off)));
    near.foot = foot;
    near.map.foot = foot.hi;
    near.map.c2 = c2.hi;
    near.c0 = c0;
    near.c1 = c1;
    near.c2 = c2;
    near.normal = normal;
    near.w0 = wide_cross(c0, c2);
    near.w1 = wide_cross(c1, c2);
    near.map.w0 = near.w0.hi;
    near.map.w1 = near.w1.hi;
    near.map.depth = depth.hi;
    let foot_x = wide_scale3(axis_x, Wide(foot.hi.x, foot.lo.x));
    let at_foot = wide_add3(center, wide_add3(foot_x, wide_scale3(axis_y, Wide(foot.hi.y, foot.lo.y))));
    var heights = array(axis_x, axis_y, at_foot);
    for (var k = frame.zero; k < 3u; k++) {
        let height = wide_dot(z, heights[k]);
        near.map.surface[k] = height.hi;
        near.surface_low[k] = height.lo;
    }
    return near;
}

// A point of tree space relative to the foot.
fn near_point(high: vec2f, low: vec2f, foot: Wide2) -> Wide2 {
    return wide_add2(Wide2(high, low), wide_negate2(foot));
}

// The form of a height, in full: over z = 0 or over the surface.
struct NearHeight {
    form: Wide3,
}

// Whether a height is that over z = 0.
fn is_over_zero(near: NearMap, height: Height) -> bool {
    return all(height.form == vec3f(near.c0.hi.z, near.c1.hi.z, near.c2.hi.z));
}

fn near_form(near: NearMap, height: Height) -> NearHeight {
    let low = vec3f(near.c0.lo.z, near.c1.lo.z, near.c2.lo.z);
    return NearHeight(Wide3(height.form, select(near.surface_low, low, is_over_zero(near, height))));
}

// A clip with the lines of its planes formed anew: where the light is nearly parallel to a plane, f32 has few digits of the line in
// which they meet.
fn near_clip(near: NearMap, coarse: Clip, lobe: Lobe) -> Clip {
    var planes = array(coarse.first, coarse.second);
    for (var k = frame.zero; k < coarse.planes; k++) {
        // normal x axis: along it the height stays the same. That over the surface is in the shading frame, a factor apart.
        let form = near_form(near, planes[k].height).form;
        let x = wide_scale3(near.c1, Wide(form.hi.x, form.lo.x));
        let line = wide_add3(x, wide_negate3(wide_scale3(near.c0, Wide(form.hi.y, form.lo.y)))).hi;
        let factor = select(lobe_determinant(lobe) / (lobe.yy * length(lobe.row_z)), 1.0, is_over_zero(near, planes[k].height));
        let length = length(line);
        planes[k].along = select(vec3f(), line / length, length > 0.0);
        planes[k].distance = select(0.0, abs(near.map.depth) / (length * factor), length > 0.0);
    }
    var clip = coarse;
    clip.first = planes[0];
    clip.second = planes[1];
    if clip.planes == 2u {
        join(&clip, near.map, normalize(lobe.row_z));
    }
    return clip;
}

fn near_height(height: NearHeight, q: Wide2) -> Wide {
    let p = wide_times2(Wide2(height.form.hi.xy, height.form.lo.xy), q);
    return wide_add(wide_add(Wide(p.hi.x, p.lo.x), Wide(p.hi.y, p.lo.y)), Wide(height.form.hi.z, height.form.lo.z));
}

// The image of a point relative to the foot.
fn near_image(near: NearMap, q: Wide2) -> vec3f {
    let x = wide_scale3(near.c0, Wide(q.hi.x, q.lo.x));
    return wide_add3(wide_add3(x, wide_scale3(near.c1, Wide(q.hi.y, q.lo.y))), near.c2).hi;
}

// Twin of edge_integral.
fn near_edge_integral(near: NearMap, a: Wide2, b: Wide2) -> f32 {
    let pa = near_image(near, a);
    let pb = near_image(near, b);
    let inv = 1.0 / (length(pa) * length(pb));
    let u = wide_add2(b, wide_negate2(a));
    let sides = wide_add3(wide_scale3(near.w0, Wide(u.hi.x, u.lo.x)), wide_scale3(near.w1, Wide(u.hi.y, u.lo.y)));
    let normal = wide_add3(wide_scale3(near.normal, wide_perp_dot(u, a)), sides).hi;
    // Of unit vectors: the square of the normal itself may underflow.
    return edge_angle(normal * inv, dot(pa, pb) * inv, 1.0);
}

// Twin of along.
fn near_along(a: Wide2, b: Wide2, t: Wide) -> Wide2 {
    if !is_after(Wide(1.0, 0.0), t) {
        return b;
    }
    return wide_add2(a, wide_scale2(wide_add2(b, wide_negate2(a)), t));
}

// A meeting and the digits that its place has beyond f32.
struct NearMeeting {
    coarse: Meeting,
    at: Wide,
}

// Twin of meeting.
fn near_meeting(near: NearMap, plane: Horizon, a: Wide2, b: Wide2) -> NearMeeting {
    let height = near_form(near, plane.height);
    let ha = near_height(height, a);
    let hb = near_height(height, b);
    var at = Wide(0.0, 0.0);
    if (ha.hi > 0.0) != (hb.hi > 0.0) {
        at = wide_over(ha, wide_add(ha, wide_negate(hb)));
    }
    return NearMeeting(Meeting(ha.hi > 0.0, hb.hi > 0.0, at.hi), at);
}

fn is_after(a: Wide, b: Wide) -> bool {
    return a.hi > b.hi || (a.hi == b.hi && a.lo > b.lo);
}

// Twin of closing.
fn near_closing(near: NearMap, plane: Horizon, meeting: NearMeeting, inside: bool, a: Wide2, b: Wide2) -> f32 {
    if meeting.coarse.start == meeting.coarse.end {
        return 0.0;
    }
    var up = plane.corner;
    if inside {
        up = plane_crossing(plane, near_image(near, near_along(a, b, meeting.at)));
    }
    return select(-up, up, meeting.coarse.end);
}

// Twin of edge_above and cut_edge.
fn near_edge_above(near: NearMap, clip: Clip, place: u32, a: Wide2, b: Wide2) -> f32 {
    if place >= PLACE_BELOW {
        if clip.planes < 2u {
            return 0.0;
        }
        var plane = clip.first;
        if place == PLACE_BELOW {
            plane = clip.second;
        }
        return plane.corner * near_far_sign(near_form(near, plane.height), a, b);
    }
    var span = NearSpan(Wide(0.0, 0.0), Wide(1.0, 0.0));
    var sum = 0.0;
    if place == PLACE_CUT {
        // No loop: drivers that end loops early would count its rounds for every edge.
        let first = near_meeting(near, clip.first, a, b);
        var second = NearMeeting(Meeting(true, true, 0.0), Wide(0.0, 0.0));
        if clip.planes == 2u {
            second = near_meeting(near, clip.second, a, b);
        }
        // Of two crossings at one place, in one direction, that of the first is inside and that of the second is not.
        let first_is_after = is_after(first.at, second.at);
        sum = near_closing(near, clip.first, first, is_above(second.coarse, !first_is_after), a, b);
        if clip.planes == 2u {
            sum += near_closing(near, clip.second, second, is_above(first.coarse, first_is_after), a, b);
        }
        span = near_part_above(near_part_above(span, first), second);
        if !is_after(span.end, span.start) {
            return sum;
        }
    }
    return sum + near_edge_integral(near, near_along(a, b, span.start), near_along(a, b, span.end));
}

// A part of an edge, in its parameter.
struct NearSpan {
    start: Wide,
    end: Wide,
}

// Twin of part_above: what a horizon leaves of a part. Where the edge ends above it may begin after the start, where it begins above
// it may end before the end: both ask of the pair, for of a place next to the end f32 says 1.
fn near_part_above(part: NearSpan, meeting: NearMeeting) -> NearSpan {
    var span = part;
    if !meeting.coarse.start && is_after(meeting.at, span.start) {
        span.start = meeting.at;
    }
    if !meeting.coarse.end {
        let stop = select(0.0, 1.0, meeting.coarse.start);
        let until = Wide(meeting.at.hi * stop, meeting.at.lo * stop);
        if is_after(span.end, until) {
            span.end = until;
        }
    }
    return span;
}

fn near_far_sign(height: NearHeight, a: Wide2, b: Wide2) -> f32 {
    return f32(near_height(height, b).hi > 0.0) - f32(near_height(height, a).hi > 0.0);
}

// box_place of a box relative to the foot, where nothing has been rounded that is large against its place: with the margin of heights
// anywhere on the light, contours that are small against it would lose their slivers.
fn near_box_place(clip: Clip, center: vec2f, half: vec2f) -> u32 {
    var at = clip;
    at.first.height.margin = near_margin(clip.first.height, center);
    at.second.height.margin = near_margin(clip.second.height, center);
    return box_place(at, center, half);
}

// Rounding bound of the height of a point relative to the foot.
fn near_margin(height: Height, q: vec2f) -> f32 {
    return MARGIN * (dot(abs(height.form.xy), abs(q)) + abs(height.form.z));
}

// A cubic by its differences, to twice the digits.
struct NearCubic {
    p0: Wide2,
    p3: Wide2,
    d0: Wide2,
    d1: Wide2,
    d2: Wide2,
}

// Twin of cubic_point.
fn near_cubic_point(c: NearCubic, t: f32) -> Wide2 {
    let s = 1.0 - t;
    let e0 = wide_add2(c.d1, wide_negate2(c.d0));
    let e1 = wide_add2(c.d2, wide_negate2(c.d1));
    let e = wide_add2(e1, wide_negate2(e0));
    // From the nearer end.
    var point = c.p3;
    var first = c.d2;
    var second = e1;
    var at = Wide(-s, 0.0);
    if t < s {
        point = c.p0;
        first = c.d0;
        second = e0;
        at.hi = t;
    }
    let three = Wide(3.0, 0.0);
    let quadratic = wide_add2(wide_scale2(second, three), wide_scale2(e, at));
    let linear = wide_add2(wide_scale2(first, three), wide_scale2(quadratic, at));
    return wide_add2(point, wide_scale2(linear, at));
}

// What f32 lost of the ends of a chord: two nodes share an element, before the handles.
fn low_ends(emitter: Emitter, i: u32) -> vec4f {
    let nodes_before = i - emitter.first;
    let first = emitter.first_detail - (emitter.end - emitter.first + 1u) / 2u;
    let pair = handles[first + nodes_before / 2u];
    return select(vec4f(pair.p1, pair.p2), vec4f(pair.low1, pair.low2), (nodes_before & 1u) == 1u);
}

// tree_integral, of a map that is close.
fn near_tree_integral(
    near: NearMap,
    clip: Clip,
    emitter: Emitter,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Integral {
    let map = near.map;
    var contour = 0.0;
    var region = 0.0;
    var visited = 0u;
    var i = emitter.first;
    // Inside a leaf: piece `index` of 2^level, from `a`.
    var leaf: NearCubic;
    var level = 0u;
    var index = 0u;
    var a: Wide2;
    while !is_past(i, emitter.end, level, index) {
        visited += 1u;
        let piece = level > 0u;
        var link = CUBIC;
        var b: Wide2;
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
                b = near_cubic_point(leaf, t1);
            }
            let flat = Cubic(leaf.p0.hi, leaf.p3.hi, leaf.d0.hi, leaf.d1.hi, leaf.d2.hi);
            let h0 = cubic_tangent(flat, t0) * width;
            let h1 = cubic_tangent(flat, t1) * width;
            let chord = wide_add2(b, wide_negate2(a)).hi;
            let q2 = chord - h1;
            area = (3.0 * perp_dot(h0, q2) + 3.0 * perp_dot(h0, chord) + 6.0 * perp_dot(q2, chord)) / 20.0;
            let low = min(min(a.hi, a.hi + h0), min(b.hi - h1, b.hi));
            let high = max(max(a.hi, a.hi + h0), max(b.hi - h1, b.hi));
            center = (low + high) * 0.5;
            half = (high - low) * 0.5;
            centroid = a.hi + chord * 0.5 + (h0 - h1) * (0.375 * 0.4);
        } else {
            loaded += 56u;
            link = nodes[i].link;
            let low = low_ends(emitter, i);
            a = near_point(nodes[i].a, low.xy, near.foot);
            b = near_point(nodes[i].b, low.zw, near.foot);
            center = near_point(nodes[i].center, vec2f(), near.foot).hi;
            half = nodes[i].half;
            area = node_area(nodes[i].areas);
            area_4 = node_area_4(nodes[i].areas);
        }
        let kind = link & ~LINK_MASK;
        let part = node_in_window(emitter, i, link, level, index);
        let place = near_box_place(clip, center, half);
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
                loaded += 32u;
                let p1 = near_point(ends.p1, ends.low1, near.foot);
                let p2 = near_point(ends.p2, ends.low2, near.foot);
                let d0 = wide_add2(p1, wide_negate2(a));
                let d1 = wide_add2(p2, wide_negate2(p1));
                leaf = NearCubic(a, b, d0, d1, wide_add2(b, wide_negate2(p2)));
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
            contour += near_edge_above(near, clip, place, a, b);
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
