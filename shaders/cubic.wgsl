// A cubic by its differences. Twin of src/kernel/cubic.rs.

// A cubic from p0 to p3 by its differences of neighbouring control points.
struct Cubic {
    p0: vec2f,
    p3: vec2f,
    d0: vec2f,
    d1: vec2f,
    d2: vec2f,
}

// The point at t, as a displacement from the nearer end, which keeps the ends' digits.
fn cubic_point(c: Cubic, t: f32) -> vec2f {
    let s = 1.0 - t;
    let e0 = c.d1 - c.d0;
    let e1 = c.d2 - c.d1;
    if t < s {
        return c.p0 + (c.d0 * 3.0 + (e0 * 3.0 + (e1 - e0) * t) * t) * t;
    }
    return c.p3 - (c.d2 * 3.0 - (e1 * 3.0 - (e1 - e0) * s) * s) * s;
}
