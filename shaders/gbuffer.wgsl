// Which triangle each sample sees: its index plus one.

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) triangle: u32,
}

@vertex
fn draw_triangle(@builtin(vertex_index) vertex: u32) -> Corner {
    let index = vertex / 3u;
    return Corner(raster_position(corner_position(index, vertex % 3u)), index + 1u);
}

@fragment
fn store_triangle(corner: Corner) -> @location(0) u32 {
    return corner.triangle;
}
