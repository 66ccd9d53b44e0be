// The table of linearly transformed cosines: look-up. Twin of src/brdf/ltc.rs, which explains the symbols.
//
// This file depends on the global
//     ltc_table: array<vec4f>   read-only storage, two per entry, rows of equal alpha:
//                               ux, uz, beta, tau_x | tau_z, magnitude, fresnel, 0
// and on the constants LTC_ALPHAS and LTC_THETAS (u32), its size, LTC_ALPHA_MIN, its smallest alpha, LTC_FIRST, the root of that,
// and LTC_STEPS, rows per root of alpha, which come from src/brdf/ltc.rs. A needle's axis has the digits of the mirror direction
// only if every step is rounded as there.

// Whether specular lobes are clipped at the true horizon as well.
override TRUE_HORIZON: bool = true;

// One linearly transformed cosine. Shading frame: z = normal, x = tangential part of the view direction.
struct Lobe {
    // M^-1 up to a positive factor: the entries of rows x and z in columns x and z, and the y entry.
    xx: f32,
    xz: f32,
    yy: f32,
    zx: f32,
    zz: f32,
    // Directional albedo with Fresnel = 1.
    magnitude: f32,
    // Third row of M up to a positive factor: the true surface's normal in cosine space; y is 0.
    row_z: vec3f,
    // The part of the albedo weighted by (1 - v.h)^5.
    fresnel: f32,
    // 1 - the lobe's mass below the true horizon.
    above: f32,
    // GGX width and view cosine it was looked up at.
    alpha: f32,
    cos_theta: f32,
}

// M^-1 * w: shading frame to cosine space.
fn lobe_apply(lobe: Lobe, w: vec3f) -> vec3f {
    return vec3f(lobe.xx * w.x + lobe.xz * w.z, lobe.yy * w.y, lobe.zx * w.x + lobe.zz * w.z);
}

// The cofactors of M^-1 times w: what a normal of the light's plane becomes.
fn lobe_apply_cofactors(lobe: Lobe, w: vec3f) -> vec3f {
    return vec3f(
        lobe.yy * (lobe.zz * w.x - lobe.zx * w.z),
        (lobe.xx * lobe.zz - lobe.xz * lobe.zx) * w.y,
        lobe.yy * (lobe.xx * w.z - lobe.xz * w.x),
    );
}

// det M^-1.
fn lobe_determinant(lobe: Lobe) -> f32 {
    return lobe.yy * (lobe.xx * lobe.zz - lobe.xz * lobe.zx);
}

// The cosine itself, as a lobe: M = 1. Its alpha is 0, which no lobe of the table has.
fn plain_cosine() -> Lobe {
    return Lobe(1.0, 0.0, 1.0, 0.0, 1.0, 1.0, vec3f(0.0, 0.0, 1.0), 0.0, 1.0, 0.0, 1.0);
}

// One half (0 or 1) of the entries of a column, between two rows.
fn ltc_column(index: u32, half: u32, fx: f32) -> vec4f {
    let low = ltc_table[2u * index + half];
    let high = ltc_table[2u * (index + LTC_THETAS) + half];
    return low + (high - low) * fx;
}

// The lobe at GGX width alpha (clamped to LTC_ALPHA_MIN..1) and view cosine cos_theta (clamped to 0..1).
fn ltc_lobe(alpha_any: f32, cos_theta: f32) -> Lobe {
    let alpha = min(max(alpha_any, LTC_ALPHA_MIN), 1.0);
    let c = min(max(cos_theta, 0.0), 1.0);
    let half = sqrt(1.0 - c);
    let s = half * sqrt(1.0 + c);

    let x = (sqrt(alpha) - LTC_FIRST) * LTC_STEPS;
    let y = half * f32(LTC_THETAS - 1u);
    let i = min(u32(x), LTC_ALPHAS - 2u);
    let j = min(u32(y), LTC_THETAS - 2u);
    let fx = x - f32(i);
    let fy = y - f32(j);
    let k = i * LTC_THETAS + j;
    let m0 = ltc_column(k, 0u, fx);
    let m = m0 + (ltc_column(k + 1u, 0u, fx) - m0) * fy;
    let a0 = ltc_column(k, 1u, fx);
    let a = a0 + (ltc_column(k + 1u, 1u, fx) - a0) * fy;

    let tx = alpha * m.w * c - a.x * s;
    let tz = alpha * m.w * s + a.x * c;
    // The adjugate of M over the area of its 2 x 2 block's unit, which leaves one division.
    let area = m.x * tz - m.y * tx;
    var lobe: Lobe;
    lobe.xx = tz;
    lobe.xz = -tx;
    lobe.yy = area / (m.z * m.z);
    lobe.zx = -alpha * m.y;
    lobe.zz = alpha * m.x;
    // A half-space whose normal makes the angle g with z holds (1 + cos g)/2 of the clamped cosine.
    lobe.row_z = vec3f(0.0, 0.0, 1.0);
    lobe.above = 1.0;
    if TRUE_HORIZON {
        lobe.row_z = vec3f(alpha * m.y, 0.0, tz);
        lobe.above = 0.5 + 0.5 * tz / sqrt(lobe.row_z.x * lobe.row_z.x + tz * tz);
    }
    lobe.magnitude = a.y;
    lobe.fresnel = a.z;
    lobe.alpha = alpha;
    lobe.cos_theta = c;
    return lobe;
}
