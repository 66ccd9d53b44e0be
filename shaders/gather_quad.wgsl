// The technique `quad`: the integral of one light's rectangle, in the colours of its picture. Twin of by_quad in
// src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> quads: array<Quad>;

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
    let half = quads[emitter.first].half;
    let clip = clip_light(map, lobe.row_z, -map.foot, half);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    return painted(lit(images, quad_integral(map, clip, half), QUAD_EDGES), emitter, map);
}
