// The technique `uniform`. Twin of by_edges in src/backend/gather.rs.

fn clip_emission(emitter: Emitter, map: CosineMap, lobe: Lobe) -> Clip {
    return clip_square(map);
}

// Clipped at z = 0.
fn integrate_emission(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    map: CosineMap,
    clip: Clip,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    let curves = elements_in_window(emitter.first, emitter.end);
    let sum = uniform_integral(map, clip, curves.x, curves.y, frame.choice);
    return painted(lit(images, sum.value, sum.edges), emitter, map);
}
