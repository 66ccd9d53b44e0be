// From a camera ray and a triangle to the point to shade. Twin of src/kernel/surface.rs.

// Whether any material has a texture.
override TEXTURES: bool = true;

// Where a ray from the camera meets a triangle.
struct Hit {
    // Distance in lengths of the ray's direction; negative where there is no hit.
    t: f32,
    // Weights of the second and the third corner.
    u: f32,
    v: f32,
}

// A point to shade.
struct SurfacePoint {
    // Relative to the camera, metres.
    position: vec3f,
    // Unit shading normal, on the viewer's side.
    normal: vec3f,
    // Unit vector towards the eye.
    view: vec3f,
    // Linear Rec.709.
    base_color: vec3f,
    metallic: f32,
    // GGX width.
    alpha: f32,
    // Weight of the dielectric lobe.
    specular: f32,
}

// The direction (not unit) of the camera ray through a pixel; `offset` 0..1 from its upper left corner.
fn ray_direction(pixel: vec2u, offset: vec2f) -> vec3f {
    let at = (vec2f(pixel) + offset) * frame.steps;
    return frame.rays.forward.xyz + frame.rays.right.xyz * (at.x - 1.0) + frame.rays.up.xyz * (1.0 - at.y);
}

// Products whose sums are taken as Rust takes them: the built-in ones may take another order, and round otherwise.
fn dot_in_order(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn cross_in_order(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
}

// The ray from the origin along `direction` against a triangle grown by SEAM, both sides (Moeller, Trumbore 1997).
fn intersect(index: u32, direction: vec3f) -> Hit {
    let e1 = triangles[index].e1.xyz;
    let e2 = triangles[index].e2.xyz;
    let p = cross_in_order(direction, e2);
    let det = dot_in_order(e1, p);
    if det == 0.0 {
        return Hit(-1.0, 0.0, 0.0);
    }
    let start = -triangles[index].p0.xyz;
    let q = cross_in_order(start, e1);
    // Inside or not is decided before any division, whose rounding differs between processors.
    let u = dot_in_order(start, p) * sign(det);
    let v = dot_in_order(direction, q) * sign(det);
    let t = dot_in_order(e2, q) * sign(det);
    let size = abs(det);
    let seam = SEAM * size;
    let inside = u >= -seam && v >= -seam && u + v <= size + seam && t > 0.0;
    return Hit(select(-1.0, t / size, inside), u / size, v / size);
}

// The point where `direction` meets a triangle, with its material and textures looked up.
fn surface_point(index: u32, direction: vec3f, hit: Hit) -> SurfacePoint {
    let triangle = triangles[index];
    let e1 = triangle.e1.xyz;
    let e2 = triangle.e2.xyz;
    let material = materials[triangle.material];
    let w = 1.0 - hit.u - hit.v;
    var point: SurfacePoint;
    point.position = triangle.p0.xyz + e1 * hit.u + e2 * hit.v;
    point.view = -normalize(direction);
    point.base_color = material.base_color.xyz;
    point.metallic = material.base_color.w;
    point.alpha = material.alpha;
    point.specular = material.specular;
    let geometric = normalize(cross(e1, e2));
    let facing = select(1.0, -1.0, dot(geometric, point.view) < 0.0);
    var normal = normalize(triangle.n0.xyz * w + triangle.n1.xyz * hit.u + triangle.n2.xyz * hit.v) * facing;
    if TEXTURES {
        let uv = vec2f(triangle.e1.w, triangle.e2.w) * w
            + vec2f(triangle.n0.w, triangle.n1.w) * hit.u
            + vec2f(triangle.n2.w, triangle.t1.w) * hit.v;
        // Width of the sample's footprint in texture coordinates, the mean of its two axes.
        let slant = max(abs(dot(geometric, point.view)), 0.01);
        let footprint = triangle.p0.w * frame.rays.forward.w * length(point.position) / sqrt(slant);
        if material.base_color_texture != NO_TEXTURE {
            point.base_color *= sample(material.base_color_texture, uv, footprint, true);
        }
        if material.metallic_roughness_texture != NO_TEXTURE {
            let texel = sample(material.metallic_roughness_texture, uv, footprint, false);
            // Perceptual roughness is multiplied: alpha is its square.
            point.alpha *= texel.y * texel.y;
            point.metallic *= texel.z;
        }
        if material.normal_texture != NO_TEXTURE {
            let texel = sample(material.normal_texture, uv, footprint, false) * 2.0 - 1.0;
            let blend = triangle.t0.xyz * w + triangle.t1.xyz * hit.u + triangle.t2 * hit.v;
            let tangent = normalize_or_zero(blend - normal * dot(normal, blend));
            let bitangent = cross(normal, tangent) * (triangle.t0.w * facing);
            let scale = material.normal_scale;
            normal = normalize(
                tangent * (texel.x * scale) + bitangent * (texel.y * scale) + normal * max(texel.z, 0.01),
            );
        }
    }
    // A normal that looks away from the eye, by interpolation or by a normal map, is turned until it doesn't.
    let away = dot(normal, point.view);
    if away < 1e-3 {
        normal = normalize(normal + point.view * (1e-3 - away));
    }
    point.normal = normal;
    return point;
}

// Trilinear look-up, repeating in both directions; `footprint` is the sample's width in texture coordinates.
fn sample(index: u32, uv: vec2f, footprint: f32, srgb: bool) -> vec3f {
    let texture = textures[index];
    let width = footprint * f32(max(texture.width, texture.height));
    let level = min(log2_exactly(max(width, 1.0)), f32(texture.levels - 1u));
    let fine = floor(level);
    let a = bilinear(texture, u32(fine), uv, srgb);
    if level == fine {
        return a;
    }
    return mix(a, bilinear(texture, u32(fine) + 1u, uv, srgb), level - fine);
}

fn bilinear(texture: SurfaceTexture, level: u32, uv: vec2f, srgb: bool) -> vec3f {
    var offset = texture.offset;
    var size = vec2u(texture.width, texture.height);
    for (var i = 0u; i < level; i++) {
        offset += size.x * size.y;
        size = max(size / 2u, vec2u(1u));
    }
    let at = (uv - floor(uv)) * vec2f(size) - 0.5;
    let corner = floor(at);
    let f = at - corner;
    let n = vec2i(size);
    let low = (vec2i(corner) + n) % n;
    let high = (vec2i(corner) + 1 + n) % n;
    let row0 = offset + u32(low.y) * size.x;
    let row1 = offset + u32(high.y) * size.x;
    let top = mix(unpack(row0 + u32(low.x), srgb), unpack(row0 + u32(high.x), srgb), f.x);
    let bottom = mix(unpack(row1 + u32(low.x), srgb), unpack(row1 + u32(high.x), srgb), f.x);
    return mix(top, bottom, f.y);
}

fn unpack(at: u32, srgb: bool) -> vec3f {
    let texel = texels[at];
    let c = vec3f(vec3u(texel, texel >> 8u, texel >> 16u) & vec3u(255u)) / 255.0;
    if srgb {
        return vec3f(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z));
    }
    return c;
}

// IEC 61966-2-1. The power 2.4 as x^2 times the fifth root of x^2, which a Newton step rids of the error that pow may have.
fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 {
        return c / 12.92;
    }
    let x = (c + 0.055) / 1.055;
    let x2 = x * x;
    let root = exp2(0.2 * log2(x2));
    let root2 = root * root;
    return x2 * (0.8 * root + 0.2 * x2 / (root2 * root2));
}

// log2 of a positive number by the series of atanh, right to 1e-7: WGSL's own may be off by more than shows.
fn log2_exactly(x: f32) -> f32 {
    let bits = bitcast<u32>(x * 0.70710678);
    let exponent = i32(bits >> 23u) - 126;
    let m = x * bitcast<f32>(u32(127 - exponent) << 23u);
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0 + s2 / 9.0)));
    return f32(exponent) + 2.8853900817779268 * s * series;
}
