// Curves as polygons of equal parameter steps. Twin of src/kernel/polygon.rs.

// The clamped-cosine integral over the polygon of `segments` edges per curve, lines being one edge, each edge clipped at z = 0
// and integrated on its own (Heitz, Dupuy, Hill, Neubelt, SIGGRAPH 2016). Signed: negative behind the light.
fn uniform_integral(map: CosineMap, clip: Clip, first_curve: u32, end_curve: u32, segments: u32) -> EdgeSum {
    var value = 0.0;
    var edges = 0u;
    var a = corner_at(map, -map.foot);
    for (var k = first_curve; k < end_curve; k++) {
        let curve = local_curve(curves[k], map.foot);
        loaded += 32u;
        var cut = false;
        if clip.planes != 0u {
            let heights = control_heights(curve, clip.first);
            if !any(heights > vec4f()) {
                continue;
            }
            cut = !all(heights > vec4f());
        }
        if any(a.q != curve.p0) {
            a = corner_at(map, curve.p0);
        }
        let steps = select(segments, 1u, is_line(curve));
        let width = 1.0 / f32(steps);
        // Summed by curve first: of many edges with one running total each would lose its last digits.
        var sum = 0.0;
        for (var i = 1u; i <= steps; i++) {
            var q = curve.p3;
            if i != steps {
                q = cubic_point(curve, f32(i) * width);
            }
            let b = corner_at(map, q);
            let edge = clipped_edge(map, clip, cut, a, b);
            sum += edge.value;
            edges += edge.edges;
            a = b;
        }
        value += sum;
    }
    return EdgeSum(value / TAU, edges);
}
