// The technique `quad`: one light's rectangle, in the colours of its picture. Twin of by_quad in src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> quads: array<Quad>;

fn clip_emission(emitter: Emitter, map: CosineMap, lobe: Lobe) -> Clip {
    return clip_light(map, lobe.row_z, -map.foot, quads[emitter.first].half);
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
    loaded += 8u;
    let value = quad_integral(map, clip, quads[emitter.first].half);
    return painted(lit(images, value, QUAD_EDGES), emitter, map);
}
