// The clamped-cosine integral of a rectangle: four clipped edges. Twin of src/kernel/quad.rs.

// Edges of a rectangle.
const QUAD_EDGES: u32 = 4u;

// The integral over the rectangle about the middle of tree space inside the half-spaces of `clip`, signed: positive in front
// of the light, negative behind; 1 for a full hemisphere.
fn quad_integral(map: CosineMap, clip: Clip, half: vec2f) -> f32 {
    var corners = array<vec2f, 4>(
        vec2f(-half.x, -half.y) - map.foot,
        vec2f(half.x, -half.y) - map.foot,
        half - map.foot,
        vec2f(-half.x, half.y) - map.foot,
    );
    var sum = 0.0;
    for (var i = 0u; i < QUAD_EDGES; i++) {
        sum += cut_edge(map, clip, clip.planes > 0u, corners[i], corners[(i + 1u) % QUAD_EDGES]);
    }
    return sum / TAU;
}
