// Curves subdivided by what they contribute. Twin of src/kernel/subdivide.rs, which explains it (Kuge, Yatagawa, Morishima,
// JCGT 11(1), 2022).

// The clamped-cosine integral over the light, its curves subdivided until every triangle contributes less than `eps` (2 pi times
// its normalised integral), clipped at z = 0. Lines are one edge. Signed: negative behind the light.
fn kuge_integral(map: CosineMap, clip: Clip, first_curve: u32, end_curve: u32, eps: f32) -> EdgeSum {
    var total = EdgeSum(0.0, 0u);
    for (var k = first_curve; k < end_curve; k++) {
        let curve = local_curve(curves[k], map.foot);
        loaded += 32u;
        var sum: EdgeSum;
        if is_line(curve) {
            sum = clipped_edge(map, clip, clip.planes != 0u, corner_at(map, curve.p0), corner_at(map, curve.p3));
        } else {
            sum = curve_above(map, clip, curve, eps);
        }
        total.value += sum.value;
        total.edges += sum.edges;
    }
    return EdgeSum(total.value / TAU, total.edges);
}

// A part of a curve, in its parameter, with its end points.
struct Part {
    t0: f32,
    t1: f32,
    start: vec2f,
    end: vec2f,
}

// The point after `index` steps of the width 2^-n, of which 2^n make the part.
fn part_point(curve: Cubic, part: Part, index: u32, width: f32) -> vec2f {
    let share = f32(index) * width;
    if share == 1.0 {
        return part.end;
    }
    return cubic_point(curve, part.t0 + (part.t1 - part.t0) * share);
}

// The curve's parts above the horizon, with the closing terms of its crossings (times 2 pi).
fn curve_above(map: CosineMap, clip: Clip, curve: Cubic, eps: f32) -> EdgeSum {
    var part = Part(0.0, 1.0, curve.p0, curve.p3);
    var total = EdgeSum(0.0, 0u);
    var found = Crossings(vec3f(1.0), 0u);
    var above = true;
    if clip.planes != 0u {
        let heights = control_heights(curve, clip.first);
        if !any(heights > vec4f()) {
            return total;
        }
        if !all(heights > vec4f()) {
            above = heights.x > 0.0;
            found = height_crossings(heights);
        }
    }
    for (var i = 0u; i <= found.count; i++) {
        var t = 1.0;
        var q = curve.p3;
        var closing = 0.0;
        if i < found.count {
            t = found.t[i];
            q = cubic_point(curve, t);
            closing = plane_crossing(clip.first, map_point(map, q));
        }
        if above {
            part.t1 = t;
            part.end = q;
            let sum = part_integral(map, curve, part, eps);
            total.value += sum.value - closing;
            total.edges += sum.edges;
        } else {
            total.value += closing;
        }
        part.t0 = t;
        part.start = q;
        above = !above;
    }
    return total;
}

// The integral (times 2 pi) along a part of a curve above the horizon.
//
// Step `index` of 2^`level`, as wide as twice `half`, from a to b with `chord` the integral along its chord. Slots hold the
// right halves that wait, one at most for each level. No triangle contributes more than 2 pi: with an eps above that the
// chords need not be known.
fn part_integral(map: CosineMap, curve: Cubic, part: Part, eps: f32) -> EdgeSum {
    var slots = array<vec3f, HALVINGS>();
    let adaptive = eps <= TAU;
    var level = START_LEVEL;
    var index = 0u;
    var half = 0.5 / f32(INTERVALS);
    var total = EdgeSum(0.0, 0u);
    var a = corner_at(map, part.start);
    var b = corner_at(map, part_point(curve, part, 1u, 2.0 * half));
    var chord = 0.0;
    if adaptive {
        chord = corner_edge(map, a, b);
    }
    while index < INTERVALS || level > START_LEVEL {
        let m = corner_at(map, part_point(curve, part, 2u * index + 1u, half));
        let first = corner_edge(map, a, m);
        let second = corner_edge(map, m, b);
        if adaptive && abs(first + second - chord) >= eps && level < START_LEVEL + HALVINGS {
            slots[level - START_LEVEL] = vec3f(b.q, second);
            level += 1u;
            index *= 2u;
            half *= 0.5;
            b = m;
            chord = first;
            continue;
        }
        total.value += first + second;
        total.edges += 2u;
        a = b;
        index += 1u;
        let up = min(countTrailingZeros(index), level - START_LEVEL);
        index >>= up;
        level -= up;
        half *= f32(1u << up);
        if level > START_LEVEL {
            let slot = slots[level - 1u - START_LEVEL];
            b = corner_at(map, slot.xy);
            chord = slot.z;
        } else if index < INTERVALS {
            b = corner_at(map, part_point(curve, part, index + 1u, 2.0 * half));
            if adaptive {
                chord = corner_edge(map, a, b);
            }
        }
    }
    return total;
}
