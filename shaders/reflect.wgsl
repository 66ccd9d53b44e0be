// What a surface point reflects. Twin of src/kernel/reflect.rs.

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
