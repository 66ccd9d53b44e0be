// The technique `textured`: the integral by the tree of one emission at one shading point, in the colours of its picture if
// it has one. Twin of by_tree in src/backend/gather.rs.

@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> handles: array<Handles>;

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
    let root = emitter.first;
    let clip = clip_light(map, lobe.row_z, nodes[root].center - map.foot, nodes[root].half);
    if clip.below {
        return skipped_for(SKIP_BELOW_HORIZON);
    }
    let integral = tree_integral(map, clip, emitter, tolerance, budget);
    return painted(lit(images, integral.value, integral.visited), emitter, map);
}
