// The technique `tree`: the integral of one emission at one shading point. Twin of by_tree and by_mosaic in
// src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> handles: array<Handles>;

// The clamped-cosine integral over an emission, of a lobe clipped at its horizons.
fn gather(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let map = cosine_map(images, lobe);
    if map.depth == 0.0 {
        return skipped_for(SKIP_BEHIND);
    }
    let has_picture = PICTURES && emitter.picture != NO_PICTURE;
    var center = nodes[emitter.first].center;
    var half = nodes[emitter.first].half;
    if has_picture {
        center = tiles[emitter.picture].center;
        half = tiles[emitter.picture].half;
    }
    let clip = clip_light(map, lobe.row_z, center - map.foot, half);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    if has_picture {
        let colored = mosaic_integral(map, clip, emitter, tolerance, budget);
        let value = select(colored.value, -colored.value, images.front < 0.0);
        return Gathered(max(value, vec3f()), colored.visited, SKIP_NONE);
    }
    let integral = tree_integral(map, clip, emitter, tolerance, budget);
    return lit(images, integral.value, integral.visited);
}
