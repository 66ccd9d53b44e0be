// What the other techniques share between the points of a workgroup: nothing. Those of the tree have top.wgsl.

fn prepare_gather(
    local: u32,
    there: bool,
    position: vec3f,
    shading: ShadingFrame,
    weights: Reflectance,
    tolerance: f32,
) {
}

fn begin_gather(index: u32, k: u32) {
}
