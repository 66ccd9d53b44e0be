// The technique `kuge`: the integral of one emission at one shading point. Twin of by_edges in src/backend/gather.rs.

// The clamped-cosine integral over an emission, of a lobe clipped at z = 0.
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
    let clip = clip_square(map);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    var eps = frame.eps;
    if eps == 0.0 {
        eps = select(SPECULAR_EPS * lobe.alpha, DIFFUSE_EPS, lobe.alpha == 0.0);
    }
    let sum = kuge_integral(map, clip, emitter.first, emitter.end, eps);
    return painted(lit(images, sum.value, sum.edges), emitter, map);
}
