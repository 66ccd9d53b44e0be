// The technique `uniform`: the integral of one emission at one shading point. Twin of by_edges in src/backend/gather.rs.

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
    let sum = uniform_integral(map, clip, emitter.first, emitter.end, frame.choice);
    return painted(lit(images, sum.value, sum.edges), emitter, map);
}
