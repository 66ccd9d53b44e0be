// What the techniques of the tree share: the map to cosine space, with as many digits as it takes, and what clips the light there.
// Twin of src/backend/gather.rs. The technique has the functions `clip_emission` and `integrate_emission`, and `near_emission`
// for maps that are close.

// The clamped-cosine integral over an emission, of a lobe clipped at its horizons.
fn gather(
    emitter: Emitter,
    images: Images,
    lobe: Lobe,
    tolerance: f32,
    budget: ptr<function, Budget>,
) -> Gathered {
    var near: NearMap;
    near.map = cosine_map(images, lobe);
    var close = false;
    if NEAR && needs_digits(emitter, near.map, lobe) {
        near = near_map(emitter, images, lobe);
        close = is_close(near.map, lobe);
    }
    if near.map.depth == 0.0 {
        return skipped_for(SKIP_BEHIND);
    }
    let clip = clip_emission(emitter, near.map, lobe);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    if WINDOWS {
        window = window_of(emitter.first, emitter.end);
        if has_mosaic(emitter) {
            // What is accepted of a mosaic hangs by all that was before it: the first window has it as a whole.
            window = ALL_CELLS;
            if !is_first_window() {
                return skipped_for(SKIP_NONE);
            }
        }
    }
    if close {
        return near_emission(emitter, images, lobe, near, near_clip(near, clip, lobe), tolerance, budget);
    }
    return integrate_emission(emitter, images, lobe, near.map, clip, tolerance, budget);
}
