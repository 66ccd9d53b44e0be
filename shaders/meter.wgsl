// The light meter: both integrals of one emission at given points.

// No point has others beside it.
fn top_node(i: u32) -> u32 {
    return 0xffffffffu;
}

@compute @workgroup_size(64)
fn read_meter(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&points) {
        return;
    }
    let point = points[id.x];
    let emitter = emitters[point.emitter];
    let shading = shading_frame(point.normal, point.view);
    let images = light_images(shading, emitter, point.position);
    var gathered = array<Gathered, 2>();
    if !is_behind(emitter, images) {
        for (var k = 0u; k < 2u; k++) {
            var lobe = plain_cosine();
            if k == 1u {
                lobe = ltc_lobe(point.alpha, shading.cos_theta);
            }
            var budget = Budget(1.0);
            gathered[k] = gather(emitter, images, lobe, point.tolerance, &budget);
        }
    }
    readings[id.x] = Reading(
        gathered[0].value * images.sign,
        gathered[0].visited,
        gathered[1].value * images.sign,
        gathered[1].visited,
    );
}
