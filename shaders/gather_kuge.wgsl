// The technique `kuge`. Twin of by_edges in src/backend/gather.rs.

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
    var eps = frame.eps;
    if eps == 0.0 {
        eps = select(SPECULAR_EPS * lobe.alpha, DIFFUSE_EPS, lobe.alpha == 0.0);
    }
    let curves = elements_in_window(emitter.first, emitter.end);
    let sum = kuge_integral(map, clip, curves.x, curves.y, eps);
    return painted(lit(images, sum.value, sum.edges), emitter, map);
}
