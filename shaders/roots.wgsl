// Where a curve's height passes through zero. Twin of src/kernel/roots.rs, which explains it.

// Step in t that ends the search: half the spacing of t below 1.
const LAST_STEP: f32 = 3e-8;

// The zeros in [0, 1] at which a height changes its sign, ascending.
struct Crossings {
    t: vec3f,
    count: u32,
}

// A height over t by its control heights' ends and differences.
struct HeightCubic {
    start: f32,
    end: f32,
    // First differences.
    d: vec3f,
    // Second differences.
    e: vec2f,
}

fn height_cubic(h: vec4f) -> HeightCubic {
    let d = h.yzw - h.xyz;
    return HeightCubic(h.x, h.w, d, d.yz - d.xy);
}

// The height at t, as a difference from the nearer end, which keeps the ends' digits.
fn cubic_height_at(cubic: HeightCubic, t: f32) -> f32 {
    let s = 1.0 - t;
    let third = cubic.e.y - cubic.e.x;
    if t < s {
        return cubic.start + (cubic.d.x * 3.0 + (cubic.e.x * 3.0 + third * t) * t) * t;
    }
    return cubic.end - (cubic.d.z * 3.0 - (cubic.e.y * 3.0 - third * s) * s) * s;
}

// Its derivative by t.
fn cubic_height_slope(cubic: HeightCubic, t: f32) -> f32 {
    let s = 1.0 - t;
    return 3.0 * (cubic.d.x * (s * s) + cubic.d.y * (2.0 * s * t) + cubic.d.z * (t * t));
}

// Where the height with the Bernstein coefficients h changes between above (> 0) and not above.
//
// The states alternate from that of h.x to that of h.w, judged by these very numbers: whatever rounding does in between,
// an even number of crossings joins equal states, so that the curves of a closed contour cross in pairs.
fn height_crossings(h: vec4f) -> Crossings {
    let cubic = height_cubic(h);
    let noise = ROOT_NOISE * max(max(abs(h.x), abs(h.y)), max(abs(h.z), abs(h.w)));
    // The derivative is 3*(a*t^2 + 2*b*t + c).
    let a = cubic.e.y - cubic.e.x;
    let b = cubic.e.x;
    let c = cubic.d.x;
    // Turning points, ascending, and the closed-form zeros; 2 where there is none inside.
    var turns = vec2f(2.0);
    var guesses = vec2f(2.0);
    if abs(a) > noise {
        turns = quadratic_roots(a, b, c);
    } else if abs(b) > noise {
        turns.x = -0.5 * c / b;
        guesses = quadratic_roots(3.0 * b, 1.5 * c, h.x);
    } else if abs(c) > noise {
        guesses.x = h.x / (-3.0 * c);
    }
    var found = Crossings(vec3f(1.0), 0u);
    var start = 0.0;
    var above = h.x > 0.0;
    for (var i = 0u; i < 3u; i++) {
        let last = i == 2u;
        var stop = 1.0;
        var next = h.w > 0.0;
        if !last {
            stop = turns[i];
            if !(stop > start && stop < 1.0) {
                continue;
            }
            next = cubic_height_at(cubic, stop) > 0.0;
        }
        if next != above {
            found.t[found.count] = zero_between(cubic, start, stop, above, guesses);
            found.count += 1u;
        }
        start = stop;
        above = next;
    }
    return found;
}

// The zero of a height that is monotone from `start` to `stop` and on either side of zero there. Any of the two
// guesses that lies between is the start.
fn zero_between(cubic: HeightCubic, start: f32, stop: f32, above: bool, guesses: vec2f) -> f32 {
    var low = start;
    var high = stop;
    var t = 0.5 * (low + high);
    for (var i = 0u; i < 2u; i++) {
        if guesses[i] >= low && guesses[i] <= high {
            t = guesses[i];
        }
    }
    for (var i = 0u; i < ROOT_STEPS; i++) {
        let height = cubic_height_at(cubic, t);
        if (height > 0.0) == above {
            low = t;
        } else {
            high = t;
        }
        let newton = t - height / cubic_height_slope(cubic, t);
        let next = select(0.5 * (low + high), newton, newton >= low && newton <= high);
        let step = abs(next - t);
        t = next;
        if step <= LAST_STEP {
            break;
        }
    }
    return t;
}

// Roots of a*t^2 + 2*b*t + c, ascending, without cancellation; 2 twice where there are none.
fn quadratic_roots(a: f32, b: f32, c: f32) -> vec2f {
    let discriminant = b * b - a * c;
    if discriminant > 0.0 {
        let root = sqrt(discriminant);
        let q = -(b + select(root, -root, b < 0.0));
        return vec2f(min(q / a, c / q), max(q / a, c / q));
    }
    return vec2f(2.0);
}
