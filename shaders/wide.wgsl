// Numbers of twice the digits, where f32 would show: a number is the sum of two f32, `hi` the rounded sum. The twins of
// src/kernel/wide.rs compute in f64.
//
// Sums and products as in Dekker 1971 and Knuth 1969. They rest on each f32 operation being rounded on its own, and WGSL lets
// compilers reassociate and contract. `keep` hides a value from them: an exclusive or with a zero that only the caller of the
// shader knows. Products are split by masking bits, which nothing contracts; where a product and a sum are fused the result has
// more digits, not fewer.

// Whether any surface comes so close to a light, or has so narrow a lobe, that f32 may show.
override NEAR: bool = true;

struct Wide {
    hi: f32,
    lo: f32,
}

struct Wide2 {
    hi: vec2f,
    lo: vec2f,
}

struct Wide3 {
    hi: vec3f,
    lo: vec3f,
}

// The upper half of a significand.
const UPPER: u32 = 0xfffff000u;

fn keep(v: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(v) ^ frame.zero);
}

fn keep2(v: vec2f) -> vec2f {
    return bitcast<vec2f>(bitcast<vec2u>(v) ^ vec2u(frame.zero));
}

fn keep3(v: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(v) ^ vec3u(frame.zero));
}

// a + b where |a| >= |b|.
fn wide_quick(a: f32, b: f32) -> Wide {
    let s = keep(a + b);
    return Wide(s, b - keep(s - a));
}

fn wide_quick2(a: vec2f, b: vec2f) -> Wide2 {
    let s = keep2(a + b);
    return Wide2(s, b - keep2(s - a));
}

fn wide_quick3(a: vec3f, b: vec3f) -> Wide3 {
    let s = keep3(a + b);
    return Wide3(s, b - keep3(s - a));
}

// a + b, exactly.
fn wide_sum(a: f32, b: f32) -> Wide {
    let s = keep(a + b);
    let t = keep(s - a);
    return Wide(s, keep(a - keep(s - t)) + keep(b - t));
}

fn wide_sum2(a: vec2f, b: vec2f) -> Wide2 {
    let s = keep2(a + b);
    let t = keep2(s - a);
    return Wide2(s, keep2(a - keep2(s - t)) + keep2(b - t));
}

fn wide_sum3(a: vec3f, b: vec3f) -> Wide3 {
    let s = keep3(a + b);
    let t = keep3(s - a);
    return Wide3(s, keep3(a - keep3(s - t)) + keep3(b - t));
}

// a*b, exactly.
fn wide_product(a: f32, b: f32) -> Wide {
    let p = keep(a * b);
    let ah = bitcast<f32>(bitcast<u32>(a) & UPPER);
    let bh = bitcast<f32>(bitcast<u32>(b) & UPPER);
    let al = keep(a - ah);
    let bl = keep(b - bh);
    return Wide(p, keep(keep(keep(ah * bh - p) + ah * bl) + al * bh) + al * bl);
}

fn wide_product2(a: vec2f, b: vec2f) -> Wide2 {
    let p = keep2(a * b);
    let ah = bitcast<vec2f>(bitcast<vec2u>(a) & vec2u(UPPER));
    let bh = bitcast<vec2f>(bitcast<vec2u>(b) & vec2u(UPPER));
    let al = keep2(a - ah);
    let bl = keep2(b - bh);
    return Wide2(p, keep2(keep2(keep2(ah * bh - p) + ah * bl) + al * bh) + al * bl);
}

fn wide_product3(a: vec3f, b: vec3f) -> Wide3 {
    let p = keep3(a * b);
    let ah = bitcast<vec3f>(bitcast<vec3u>(a) & vec3u(UPPER));
    let bh = bitcast<vec3f>(bitcast<vec3u>(b) & vec3u(UPPER));
    let al = keep3(a - ah);
    let bl = keep3(b - bh);
    return Wide3(p, keep3(keep3(keep3(ah * bh - p) + ah * bl) + al * bh) + al * bl);
}

fn wide_add(a: Wide, b: Wide) -> Wide {
    let s = wide_sum(a.hi, b.hi);
    return wide_quick(s.hi, s.lo + (a.lo + b.lo));
}

fn wide_add2(a: Wide2, b: Wide2) -> Wide2 {
    let s = wide_sum2(a.hi, b.hi);
    return wide_quick2(s.hi, s.lo + (a.lo + b.lo));
}

fn wide_add3(a: Wide3, b: Wide3) -> Wide3 {
    let s = wide_sum3(a.hi, b.hi);
    return wide_quick3(s.hi, s.lo + (a.lo + b.lo));
}

fn wide_negate(a: Wide) -> Wide {
    return Wide(-a.hi, -a.lo);
}

fn wide_negate2(a: Wide2) -> Wide2 {
    return Wide2(-a.hi, -a.lo);
}

fn wide_negate3(a: Wide3) -> Wide3 {
    return Wide3(-a.hi, -a.lo);
}

fn wide_times(a: Wide, b: Wide) -> Wide {
    let p = wide_product(a.hi, b.hi);
    return wide_quick(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

fn wide_times2(a: Wide2, b: Wide2) -> Wide2 {
    let p = wide_product2(a.hi, b.hi);
    return wide_quick2(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

fn wide_times3(a: Wide3, b: Wide3) -> Wide3 {
    let p = wide_product3(a.hi, b.hi);
    return wide_quick3(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

fn wide_scale2(a: Wide2, factor: Wide) -> Wide2 {
    return wide_times2(a, Wide2(vec2f(factor.hi), vec2f(factor.lo)));
}

fn wide_scale3(a: Wide3, factor: Wide) -> Wide3 {
    return wide_times3(a, Wide3(vec3f(factor.hi), vec3f(factor.lo)));
}

// a/b.
fn wide_over(a: Wide, b: Wide) -> Wide {
    let q = a.hi / b.hi;
    let rest = wide_add(a, wide_negate(wide_times(b, Wide(q, 0.0))));
    return wide_quick(q, rest.hi / b.hi);
}

fn wide_dot(a: Wide3, b: Wide3) -> Wide {
    let p = wide_times3(a, b);
    return wide_add(wide_add(Wide(p.hi.x, p.lo.x), Wide(p.hi.y, p.lo.y)), Wide(p.hi.z, p.lo.z));
}

fn wide_cross(a: Wide3, b: Wide3) -> Wide3 {
    let p = wide_times3(Wide3(a.hi.yzx, a.lo.yzx), Wide3(b.hi.zxy, b.lo.zxy));
    let q = wide_times3(Wide3(a.hi.zxy, a.lo.zxy), Wide3(b.hi.yzx, b.lo.yzx));
    return wide_add3(p, wide_negate3(q));
}

// a.x*b.y - a.y*b.x.
fn wide_perp_dot(a: Wide2, b: Wide2) -> Wide {
    let p = wide_times2(a, Wide2(b.hi.yx, b.lo.yx));
    return wide_add(Wide(p.hi.x, p.lo.x), Wide(-p.hi.y, -p.lo.y));
}

fn widened2(v: vec2f) -> Wide2 {
    return Wide2(v, vec2f());
}

fn widened3(v: vec3f) -> Wide3 {
    return Wide3(v, vec3f());
}

// v over its length, of which f32 has the first digits to some extent.
fn wide_normalize(v: Wide3) -> Wide3 {
    let square = wide_dot(v, v);
    let first = inverseSqrt(square.hi);
    // One step of Newton's.
    let error = wide_add(Wide(1.0, 0.0), wide_negate(wide_times(square, wide_product(first, first))));
    return wide_scale3(v, wide_quick(first, 0.5 * first * error.hi));
}
