// The technique `representative`: the integral of one emission at one shading point. Twin of by_representative in
// src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> solids: array<Solid>;

// By one direction that stands for the light.
fn gather(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let solid = solids[emitter.first];
    loaded += 24u;
    let body = body_of(solid, images.center, images.x, images.y);
    var value: f32;
    if lobe.alpha > 0.0 {
        value = body_specular(body, lobe.alpha, lobe.cos_theta, lobe.magnitude);
    } else {
        value = body_diffuse(body);
    }
    let gathered = Gathered(vec3f(value * solid.coverage), 1u, SKIP_NONE);
    if PICTURES && emitter.picture != NO_PICTURE {
        return painted(gathered, emitter, cosine_map(images, lobe));
    }
    return gathered;
}
