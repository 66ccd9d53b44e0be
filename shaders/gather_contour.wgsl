// What the techniques that integrate over a contour share: the map to cosine space, and what clips the light there. Twin of
// src/backend/gather.rs. The technique has the functions `clip_emission` and `integrate_emission`.

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
    let clip = clip_emission(emitter, map, lobe);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    return integrate_emission(emitter, images, lobe, map, clip, tolerance, budget);
}
