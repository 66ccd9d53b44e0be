// The technique `tree`. Twin of by_tree and by_mosaic in src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> handles: array<Handles>;

fn has_mosaic(emitter: Emitter) -> bool {
    return PICTURES && emitter.picture != NO_PICTURE;
}

fn clip_emission(emitter: Emitter, map: CosineMap, lobe: Lobe) -> Clip {
    var center = nodes[emitter.first].center;
    var half = nodes[emitter.first].half;
    if has_mosaic(emitter) {
        center = tiles[emitter.picture].center;
        half = tiles[emitter.picture].half;
    }
    loaded += 16u;
    return clip_light(map, lobe.row_z, center - map.foot, half);
}

// Pictures are walked in f32; on the CPU in f64 where they are close.
fn near_emission(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    near: NearMap,
    clip: Clip,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    if has_mosaic(emitter) {
        return integrate_emission(emitter, images, lobe, near.map, clip, tolerance, budget);
    }
    let integral = near_tree_integral(near, clip, emitter, tolerance, budget);
    return lit(images, integral.value, integral.visited);
}

fn integrate_emission(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    map: CosineMap,
    clip: Clip,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    if has_mosaic(emitter) {
        let colored = mosaic_integral(map, clip, emitter, tolerance, budget);
        let value = select(colored.value, -colored.value, images.front < 0.0);
        return Gathered(max(value, vec3f()), colored.visited, SKIP_NONE);
    }
    let integral = tree_integral(map, clip, emitter, tolerance, budget);
    return lit(images, integral.value, integral.visited);
}
