// The technique `pal`: the integral of one emission at one shading point. Twin of by_polygons in src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(7) var<storage, read> edges: array<vec4f>;

// By projected areas, or the distance from where the mirror ray goes.
fn gather(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let map = cosine_map(images, plain_cosine());
    // What a tube's rim hides of its side is no light to be taken away from an approximate one.
    if map.depth == 0.0 || images.sign < 0.0 {
        return skipped_for(SKIP_BEHIND);
    }
    var integral: PalIntegral;
    if lobe.alpha > 0.0 {
        integral = pal_specular(map, emitter.first, emitter.end, lobe.alpha, lobe.cos_theta);
    } else {
        integral = pal_diffuse(map, emitter.first, emitter.end, frame.choice);
    }
    let gathered = Gathered(vec3f(integral.value), integral.visited, SKIP_NONE);
    if PICTURES && emitter.picture != NO_PICTURE {
        return painted(gathered, emitter, cosine_map(images, lobe));
    }
    return gathered;
}
