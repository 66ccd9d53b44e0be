//! Where a curve's height passes through zero. Twin: `shaders/roots.wgsl`.
//!
//! The height of a cubic Bézier curve over a plane is a cubic in t with the heights of the control points as Bernstein
//! coefficients. Kuge et al. 2022 (§3.3) take its roots from the closed form. In f32 that fails where the leading coefficient
//! is rounding noise, as in every quadratic raised to a cubic. Here the degree is judged relative to the heights, and the
//! turning points, by the stable quadratic, part \[0, 1\] into stretches that cross zero at most once each; within one,
//! Newton steps from the closed form of the lower degrees, kept inside the bracket, cannot lose the root.

/// Leading coefficients below this, relative to the largest height, are rounding noise of the differences.
pub const ROOT_NOISE: f32 = 1e-6;
/// Newton or bisection steps within a bracket at most. At a triple root, where Newton's step is a third short, they leave
/// (2/3)²⁴ of the distance and 2e-13 of the height.
pub const ROOT_STEPS: u32 = 24;
/// Step in t that ends the search: half the spacing of t below 1.
const LAST_STEP: f32 = 3e-8;

/// The zeros in \[0, 1\] at which a height changes its sign, ascending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossings {
    /// The parameters.
    pub t: [f32; 3],
    /// How many there are.
    pub count: usize,
}

/// A height over t by its control heights' ends and differences.
#[derive(Clone, Copy, Debug)]
struct HeightCubic {
    start: f32,
    end: f32,
    /// First differences.
    d: [f32; 3],
    /// Second differences.
    e: [f32; 2],
}

impl HeightCubic {
    fn new(h: [f32; 4]) -> Self {
        let d = [h[1] - h[0], h[2] - h[1], h[3] - h[2]];
        Self { start: h[0], end: h[3], d, e: [d[1] - d[0], d[2] - d[1]] }
    }

    /// The height at t, as a difference from the nearer end, which keeps the ends' digits.
    fn at(&self, t: f32) -> f32 {
        let s = 1.0 - t;
        let third = self.e[1] - self.e[0];
        if t < s {
            self.start + (self.d[0] * 3.0 + (self.e[0] * 3.0 + third * t) * t) * t
        } else {
            self.end - (self.d[2] * 3.0 - (self.e[1] * 3.0 - third * s) * s) * s
        }
    }

    /// Its derivative by t.
    fn slope(&self, t: f32) -> f32 {
        let s = 1.0 - t;
        3.0 * (self.d[0] * (s * s) + self.d[1] * (2.0 * s * t) + self.d[2] * (t * t))
    }
}

/// Where the height with the Bernstein coefficients `h` changes between above (> 0) and not above.
///
/// The states alternate from that of `h[0]` to that of `h[3]`, judged by these very numbers: whatever rounding does in
/// between, an even number of crossings joins equal states, so that the curves of a closed contour cross in pairs.
/// Heights at the crossings are within 2e-6 of zero, relative to the largest of `h` (test `planted_roots_are_found`).
pub fn crossings(h: [f32; 4]) -> Crossings {
    let cubic = HeightCubic::new(h);
    let noise = ROOT_NOISE * h[0].abs().max(h[1].abs()).max(h[2].abs().max(h[3].abs()));
    // The derivative is 3·(a·t² + 2·b·t + c).
    let (a, b, c) = (cubic.e[1] - cubic.e[0], cubic.e[0], cubic.d[0]);
    // Turning points, ascending, and the closed-form zeros; 2 where there is none inside.
    let mut turns = [2.0, 2.0];
    let mut guesses = [2.0, 2.0];
    if a.abs() > noise {
        turns = quadratic_roots(a, b, c);
    } else if b.abs() > noise {
        turns[0] = -0.5 * c / b;
        guesses = quadratic_roots(3.0 * b, 1.5 * c, h[0]);
    } else if c.abs() > noise {
        guesses[0] = h[0] / (-3.0 * c);
    }
    let mut found = Crossings { t: [1.0; 3], count: 0 };
    let (mut from, mut above) = (0.0, h[0] > 0.0);
    for stop in [turns[0], turns[1], 1.0] {
        let last = stop == 1.0;
        let inside = stop > from && stop < 1.0;
        if !(last || inside) {
            continue;
        }
        let next = if last { h[3] > 0.0 } else { cubic.at(stop) > 0.0 };
        if next != above {
            found.t[found.count] = zero_between(&cubic, from, stop, above, guesses);
            found.count += 1;
        }
        (from, above) = (stop, next);
    }
    found
}

/// The zero of a height that is monotone from `from` to `to` and on either side of zero there. Any of the two
/// guesses that lies between is the start.
fn zero_between(cubic: &HeightCubic, from: f32, to: f32, above: bool, guesses: [f32; 2]) -> f32 {
    let (mut low, mut high) = (from, to);
    let mut t = 0.5 * (low + high);
    for guess in guesses {
        if guess >= low && guess <= high {
            t = guess;
        }
    }
    for _ in 0..ROOT_STEPS {
        let height = cubic.at(t);
        if (height > 0.0) == above {
            low = t;
        } else {
            high = t;
        }
        let newton = t - height / cubic.slope(t);
        let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
        let step = (next - t).abs();
        t = next;
        if step <= LAST_STEP {
            break;
        }
    }
    t
}

/// Roots of a·t² + 2·b·t + c, ascending, without cancellation; 2 twice where there are none.
fn quadratic_roots(a: f32, b: f32, c: f32) -> [f32; 2] {
    let discriminant = b * b - a * c;
    if discriminant > 0.0 {
        let q = -(b + discriminant.sqrt().copysign(b));
        let (r, s) = (q / a, c / q);
        return [r.min(s), r.max(s)];
    }
    [2.0, 2.0]
}
