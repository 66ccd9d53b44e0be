// Shades one sample of every pixel of a tile.

// Whether any material has a diffuse part.
override DIFFUSE: bool = true;

@compute @workgroup_size(8, 8)
fn light_pixels(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let rows = (frame.tile_size.y + 7u) / 8u;
    let id = vec2u(invocation.x, group.y * frame.row_step % rows * 8u + local / 8u);
    var there = all(id < frame.tile_size);
    var position: vec3f;
    var shading: ShadingFrame;
    var weights: Reflectance;
    if there {
        let direction = ray_direction(frame.tile_origin + id, frame.offset);
        let nearest = nearest_at(id, direction);
        there = nearest.hit.t >= 0.0;
        if there {
            let point = surface_point(nearest.index, direction, nearest.hit);
            position = point.position;
            shading = shading_frame(point.normal, point.view);
            weights = reflectance(point, shading.cos_theta);
        }
    }
    let row = (group.x + 7u * group.y) % SKIP_ROWS;
    var tile: TileBounds;
    var skipped = FirstSkipped(BUCKETS, 0.0);
    if TILES {
        add_to_tile(local, there, position, shading, weights);
        sum_up_tile(local);
        if workgroupUniformLoad(&tile_summary[SLOT_COUNTS]) == 0.0 {
            return;
        }
        tile = tile_bounds();
        if SKIP_UNDER_TOLERANCE {
            skipped = sort_lights(local, tile);
        }
    }
    var sums = Sums();
    // One budget for all lights that are integrated, and all lobes: it is the picture that is within the tolerance.
    let pixel = id.y * frame.tile_size.x + id.x;
    var budget = Budget(1.0);
    if there && !is_first_window() {
        budget.left = pixels[pixel].budget;
    }
    var tolerance = frame.tolerance * (1.0 - skipped.spent * SKIP_SHARE);
    let cluster_tolerance = tolerance * CLUSTER_PART;
    if CLUSTERS {
        tolerance -= cluster_tolerance;
    }
    prepare_gather(local, there, position, shading, weights, tolerance);
    for (var first = 0u; first < frame.emitters; first += CHUNK) {
        if TILES {
            list_lights(local, row, first, tile, skipped);
        }
        if there {
            add_lights(first, position, shading, weights, row, tolerance, &budget, &sums);
        }
    }
    if CLUSTERS {
        let receiver = receiver_of_tile(tile);
        begin_listing(local, receiver);
        // What the point has spent itself.
        var own = 0.0;
        var local_sum = Local();
        var found = Listing();
        for (var waiting = true; waiting;) {
            found = list_clusters(local, receiver, cluster_tolerance, &local_sum);
            var spent = ClusterBudget(found.spent + own);
            add_clusters(local, there, found, position, shading, weights, row, cluster_tolerance, tolerance, &spent, &budget, &sums);
            own = spent.spent - found.spent;
            clear_listing(local);
            waiting = found.waiting > 0u;
        }
        if local == 0u {
            count_clustered(row, found);
        }
        if DIFFUSE && found.local > 0u && is_first_window() {
            sum_up_local(local, local_sum);
            if there {
                let away = position * frame.per_metre - receiver.position.middle;
                sums.reflected[0] += local_at(shading.z, away) * weights.diffuse / PI;
            }
        }
    }
    if there {
        add_to_pixel(pixel, sums, budget);
    }
    // Of a point without a surface as well: it may have listed lights for the others.
    let cut = loops_are_cut();
    if all(id < frame.tile_size) {
        pixels[pixel].cut += u32(cut);
    }
}

// What a point reflects towards the eye, and what that took.
struct Sums {
    reflected: array<vec3f, 2>,
    visited: u32,
}

// Adds what a point reflects of the listed lights of a chunk.
fn add_lights(
    first: u32,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    row: u32,
    tolerance: f32,
    budget: ptr<function, Budget>,
    sums: ptr<function, Sums>,
) {
    var reasons = array<u32, SKIP_REASONS>();
    var light = NO_LIGHT;
    for (var word = 0u; word < CHUNK_WORDS && first + word * 32u < frame.emitters; word++) {
        let lobes = array(listed_word(0u, word, first), listed_word(1u, word, first));
        for (var left = lobes[0] | lobes[1]; left != 0u; left &= left - 1u) {
            let bit = firstTrailingBit(left);
            let emitter = emitters[first + word * 32u + bit];
            if emitter.light != light {
                count_skips(row, light, reasons);
                reasons = array<u32, SKIP_REASONS>();
                light = emitter.light;
            }
            let wanted = ((lobes[0] >> bit) & 1u) | (((lobes[1] >> bit) & 1u) << 1u);
            add_light(emitter, first + word * 32u + bit, wanted, position, shading, weights, tolerance, budget, sums, &reasons);
        }
    }
    count_skips(row, light, reasons);
}

// Adds what a point reflects of one light, that of an index, by the lobes that are wanted, a bit for each.
fn add_light(
    emitter: Emitter,
    index: u32,
    wanted: u32,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    tolerance: f32,
    budget: ptr<function, Budget>,
    sums: ptr<function, Sums>,
    reasons: ptr<function, array<u32, SKIP_REASONS>>,
) {
    let images = light_images(shading, emitter, position);
    if is_behind(emitter, images) {
        (*reasons)[0] += countOneBits(wanted);
        return;
    }
    (*reasons)[2] += u32(!DIFFUSE) * (wanted & 1u) + u32(!SPECULAR) * (wanted >> 1u);
    for (var k = select(1u, 0u, DIFFUSE); k < select(1u, 2u, SPECULAR); k++) {
        if ((wanted >> k) & 1u) == 0u {
            continue;
        }
        var lobe = plain_cosine();
        var weight = weights.diffuse;
        if k == 1u {
            lobe = weights.lobe;
            weight = weights.specular;
        }
        weight *= emitter.radiance;
        let brightest = max_element(weight);
        if SKIP_LOBES && brightest <= 0.0 {
            (*reasons)[2] += 1u;
            continue;
        }
        begin_gather(index, k);
        let gathered = gather(emitter, images, lobe, tolerance / select(1.0, brightest, brightest > 0.0), budget);
        (*sums).reflected[k] += weight * gathered.value * images.sign;
        (*sums).visited += gathered.visited;
        (*reasons)[0] += u32(gathered.skip == SKIP_BEHIND);
        (*reasons)[1] += u32(gathered.skip == SKIP_BELOW_HORIZON);
    }
}

fn add_to_pixel(pixel: u32, sums: Sums, budget: Budget) {
    pixels[pixel].diffuse += sums.reflected[0];
    pixels[pixel].specular += sums.reflected[1];
    if WINDOWS && is_last_window() {
        // Sums over windows, whose parts are not clamped.
        pixels[pixel].diffuse = max(pixels[pixel].diffuse, vec3f());
        pixels[pixel].specular = max(pixels[pixel].specular, vec3f());
    }
    pixels[pixel].budget = budget.left;
    // The carry of the visited nodes goes to the upper half of the samples.
    let nodes_before = pixels[pixel].nodes;
    pixels[pixel].nodes = nodes_before + sums.visited;
    let carry = select(0u, 0x10000u, nodes_before + sums.visited < nodes_before);
    pixels[pixel].samples += u32(is_first_window()) + carry;
    let bytes_before = pixels[pixel].bytes.x;
    pixels[pixel].bytes += vec2u(loaded, u32(bytes_before + loaded < bytes_before));
}
