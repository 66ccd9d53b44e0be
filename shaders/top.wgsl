// The top of the trees, shared by a workgroup: nodes that one of its points, near the middle, must refine are refined for all.
// Those points lie so near each other that they would refine nearly all of them, too; where one needn't, it is the more exact.
// Each point then starts below, and neither loads these nodes nor asks about them.

// Whether the tops are shared.
override TOPS: bool = true;

// Nodes of a top, and the end of the list.
const TOP_NODES: u32 = 32u;
// For both lobes of each emitter the refined nodes in pre-order, up to NO_NODE.
var<workgroup> tops: array<u32, 512>;

// The point that decides.
struct TopPoint {
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
}

var<workgroup> top_point: TopPoint;
// The invocation whose it is: the greatest rank.
var<workgroup> top_rank: atomic<u32>;

// Ranks invocations by how near the middle they are; more than 0.
fn rank_of(local: u32) -> u32 {
    return TILE - (local ^ 27u);
}

// Finds the tops for the points of a workgroup: the tree of an emitter in the cosine space of a lobe by each of the first
// invocations.
fn share_tops(
    local: u32,
    there: bool,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    tolerance: f32,
) {
    if there {
        atomicMax(&top_rank, rank_of(local));
    }
    workgroupBarrier();
    let rank = atomicLoad(&top_rank);
    if there && rank == rank_of(local) {
        top_point = TopPoint(position, shading, weights);
    }
    workgroupBarrier();
    if local < 2u * frame.emitters && rank > 0u {
        let count = find_top(emitters[local / 2u], local, tolerance);
        tops[local * TOP_NODES + count] = NO_NODE;
    }
    workgroupBarrier();
}

// Lists the nodes to be refined for an emitter and a lobe, less than TOP_NODES of them; gives their number.
fn find_top(emitter: Emitter, slot: u32, tolerance: f32) -> u32 {
    var lobe = plain_cosine();
    var weight = top_point.weights.diffuse;
    if (slot & 1u) == 1u {
        lobe = top_point.weights.lobe;
        weight = top_point.weights.specular;
    }
    let brightest = max_element(weight * emitter.radiance);
    if has_mosaic(emitter) || brightest <= 0.0 {
        return 0u;
    }
    let images = light_images(top_point.shading, emitter, top_point.position);
    if is_behind(emitter, images) {
        return 0u;
    }
    let map = cosine_map(images, lobe);
    if map.depth == 0.0 {
        return 0u;
    }
    let clip = clip_emission(emitter, map, lobe);
    if clip.below {
        return 0u;
    }
    // No node may have more.
    let most = tolerance * SHARE / brightest;
    var count = 0u;
    var i = emitter.first;
    while i < emitter.end && count + 1u < TOP_NODES {
        let link = nodes[i].link;
        loaded += 4u;
        if (link & ~LINK_MASK) > RUN {
            i += 1u;
            continue;
        }
        loaded += 20u;
        let center = nodes[i].center - map.foot;
        let half = nodes[i].half;
        let place = box_place(clip, center, half);
        let area = nodes[i].areas;
        let e = expansion_about(map, center, half);
        let bound = region_bound(e, place, node_area(area), node_area_4(area), 4u);
        if place < PLACE_BELOW && bound.numerator > most * bound.denominator {
            tops[slot * TOP_NODES + count] = i;
            count += 1u;
            i += 1u;
        } else {
            i = emitter.first + (link & LINK_MASK);
        }
    }
    return count;
}

fn top_node(i: u32) -> u32 {
    return tops[i];
}

// Where the top of an emitter begins for a lobe.
fn top_of(index: u32, k: u32) -> u32 {
    return select(NO_TOP, (2u * index + k) * TOP_NODES, TOPS && frame.emitters <= TOPPED);
}

// Before the points of a workgroup gather.
fn prepare_gather(
    local: u32,
    there: bool,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    tolerance: f32,
) {
    if TOPS {
        share_tops(local, there, position, shading, weights, tolerance);
    }
}

// Before a point gathers from the emitter of an index by a lobe.
fn begin_gather(index: u32, k: u32) {
    top = top_of(index, k);
}
