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
    var reading = readings[id.x];
    if is_first_window() {
        reading = Reading();
        reading.budgets = vec2f(1.0);
    }
    if !is_behind(emitter, images) {
        for (var k = 0u; k < 2u; k++) {
            var lobe = plain_cosine();
            if k == 1u {
                lobe = ltc_lobe(point.alpha, shading.cos_theta);
            }
            var budget = Budget(reading.budgets[k]);
            gathered[k] = gather(emitter, images, lobe, point.tolerance, &budget);
            reading.budgets[k] = budget.left;
        }
    }
    reading.diffuse += gathered[0].value * images.sign;
    reading.diffuse_nodes += gathered[0].visited;
    reading.specular += gathered[1].value * images.sign;
    reading.specular_nodes += gathered[1].visited;
    if WINDOWS && is_last_window() {
        // As what is integrated at once.
        let most = vec3f(select(INFINITE_BOUND, 1.0, emitter.picture == NO_PICTURE));
        reading.diffuse = clamp(reading.diffuse * images.sign, vec3f(), most) * images.sign;
        reading.specular = clamp(reading.specular * images.sign, vec3f(), most) * images.sign;
    }
    reading.cut += u32(loops_are_cut());
    readings[id.x] = reading;
}
