// Shades one sample of every pixel of a tile.

// Whether any material has a diffuse part.
override DIFFUSE: bool = true;
// Whether a lobe of no weight is left out.
override SKIP_LOBES: bool = true;

const SKIP_REASONS: u32 = 3u;

@compute @workgroup_size(8, 8)
fn light_pixels(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) group: vec3u) {
    if any(id.xy >= frame.tile_size) {
        return;
    }
    let direction = ray_direction(frame.tile_origin + id.xy, frame.offset);
    let nearest = nearest_at(id.xy, direction);
    if nearest.hit.t < 0.0 {
        return;
    }
    let point = surface_point(nearest.index, direction, nearest.hit);
    add_light(id.y * frame.tile_size.x + id.x, point, (group.x + 7u * group.y) % SKIP_ROWS);
}

// Adds what a point reflects towards the eye to its pixel.
fn add_light(pixel: u32, point: SurfacePoint, row: u32) {
    let shading = shading_frame(point.normal, point.view);
    let weights = reflectance(point, shading.cos_theta);
    var sums = array<vec3f, 2>();
    var visited = 0u;
    // Behind, below the horizon, without such a lobe.
    var skipped = vec3u();
    // One budget for all lights and lobes: it is the picture that is within the tolerance.
    var budget = Budget(0.0, 1.0);
    for (var i = 0u; i < frame.emitters; i++) {
        let emitter = emitters[i];
        let images = light_images(shading, emitter, point.position);
        if is_behind(emitter, images) {
            skipped.x += 2u;
        } else {
            skipped.z += u32(!DIFFUSE) + u32(!SPECULAR);
            for (var k = select(1u, 0u, DIFFUSE); k < select(1u, 2u, SPECULAR); k++) {
                var lobe = plain_cosine();
                var weight = weights.diffuse;
                if k == 1u {
                    lobe = weights.lobe;
                    weight = weights.specular;
                }
                weight *= emitter.radiance;
                let brightest = max_element(weight);
                if SKIP_LOBES && brightest <= 0.0 {
                    skipped.z += 1u;
                    continue;
                }
                let gathered = gather(emitter, images, lobe, frame.tolerance / select(1.0, brightest, brightest > 0.0), &budget);
                sums[k] += weight * gathered.value * images.sign;
                visited += gathered.visited;
                skipped.x += u32(gathered.skip == SKIP_BEHIND);
                skipped.y += u32(gathered.skip == SKIP_BELOW_HORIZON);
            }
        }
        if i + 1u == frame.emitters || emitters[i + 1u].light != emitter.light {
            count_skips(row, emitter.light, skipped);
            skipped = vec3u();
        }
    }
    pixels[pixel].diffuse += sums[0];
    pixels[pixel].specular += sums[1];
    // The carry of the visited nodes goes to the upper half of the samples.
    let nodes_before = pixels[pixel].nodes;
    pixels[pixel].nodes = nodes_before + visited;
    pixels[pixel].samples += 1u + select(0u, 0x10000u, nodes_before + visited < nodes_before);
}

// Adds to the 64-bit counters of a light. Rows keep workgroups out of each other's way.
fn count_skips(row: u32, light: u32, skipped: vec3u) {
    for (var reason = 0u; reason < SKIP_REASONS; reason++) {
        if skipped[reason] > 0u {
            let at = 2u * ((row * frame.lights + light) * SKIP_REASONS + reason);
            let before = atomicAdd(&skips[at], skipped[reason]);
            if before + skipped[reason] < before {
                atomicAdd(&skips[at + 1u], 1u);
            }
        }
    }
}
