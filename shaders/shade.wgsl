// What a surface point reflects, and the light that reaches it. Twin of src/kernel/shade.rs and src/backend/gather.rs.

// Whether any material has a specular lobe.
override SPECULAR: bool = true;

// Reflected radiance per unit of radiance and of integral: radiance = weight * L * E.
struct Reflectance {
    // Weight of the plain cosine.
    diffuse: vec3f,
    // Weight of the lobe, clipped at both horizons.
    specular: vec3f,
    // The specular lobe.
    lobe: Lobe,
}

fn max_element(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// The weights for a view at cos_theta.
//
// Specular: directional albedo F0*(magnitude - fresnel) + F90*fresnel (split sum, Schlick's Fresnel), over the
// lobe's mass above the true horizon. Diffuse: Lambert, less what the specular lobe takes.
fn reflectance(point: SurfacePoint, cos_theta: f32) -> Reflectance {
    var r: Reflectance;
    var taken = 0.0;
    if SPECULAR {
        r.lobe = ltc_lobe(point.alpha, cos_theta);
        let f0 = mix(vec3f(0.04 * point.specular), point.base_color, point.metallic);
        let f90 = point.specular + (1.0 - point.specular) * point.metallic;
        let albedo = f0 * (r.lobe.magnitude - r.lobe.fresnel) + f90 * r.lobe.fresnel;
        r.specular = albedo / r.lobe.above;
        taken = max_element(albedo);
    }
    r.diffuse = point.base_color * (max(1.0 - taken, 0.0) * (1.0 - point.metallic));
    return r;
}

// Why an integral is zero without having been evaluated.
const SKIP_NONE: u32 = 0u;
const SKIP_BEHIND: u32 = 1u;
const SKIP_BELOW_HORIZON: u32 = 2u;

// An integral, or why it was skipped.
struct Gathered {
    value: f32,
    visited: u32,
    skip: u32,
}

// Whether an emission reaches the point: not from behind, and not in its own plane.
fn is_behind(emitter: Emitter, images: Images) -> bool {
    return images.front == 0.0 || (images.front < 0.0 && emitter.two_sided == 0u);
}

// The clamped-cosine integral over an emission, of a lobe clipped at both horizons.
fn gather(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let map = cosine_map(images, lobe);
    if map.depth == 0.0 {
        return Gathered(0.0, 0u, SKIP_BEHIND);
    }
    let root = emitter.first_node;
    let clip = clip_light(map, lobe.row_z, nodes[root].center - map.foot, nodes[root].half);
    if clip.below {
        return Gathered(0.0, 0u, SKIP_BELOW_HORIZON);
    }
    let integral = tree_integral(map, clip, emitter, tolerance, budget);
    return Gathered(max(select(integral.value, -integral.value, images.front < 0.0), 0.0), integral.visited, SKIP_NONE);
}
