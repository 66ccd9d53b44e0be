// The technique `textured`: the integral by the tree, in the colours of a picture if there is one. Twin of by_tree in
// src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> handles: array<Handles>;

fn has_mosaic(emitter: Emitter) -> bool {
    return false;
}

fn clip_emission(emitter: Emitter, map: CosineMap, lobe: Lobe) -> Clip {
    let root = emitter.first;
    loaded += 16u;
    return clip_light(map, lobe.row_z, nodes[root].center - map.foot, nodes[root].half);
}

fn near_emission(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    near: NearMap,
    clip: Clip,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let integral = near_tree_integral(near, clip, emitter, tolerance, budget);
    return painted(lit(images, integral.value, integral.visited), emitter, near.map);
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
    let integral = tree_integral(map, clip, emitter, tolerance, budget);
    return painted(lit(images, integral.value, integral.visited), emitter, map);
}
