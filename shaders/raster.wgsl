// From a triangle's corner to the rasteriser: the projection whose pixels are those of ray_direction.

// Depth of the near plane, metres.
const NEAR: f32 = 1e-6;

// A corner relative to the camera.
fn corner_position(index: u32, corner: u32) -> vec3f {
    let p0 = triangles[index].p0.xyz;
    if corner == 0u {
        return p0;
    }
    return p0 + select(triangles[index].e2.xyz, triangles[index].e1.xyz, corner == 1u);
}

// Clip coordinates in the tile: reversed depth without a far plane. A point at x*right + y*up + forward is the pixel (x, y) of
// the picture, and frame.raster takes that to the tile.
fn raster_position(p: vec3f) -> vec4f {
    let right = frame.rays.right.xyz;
    let up = frame.rays.up.xyz;
    let depth = dot(p, frame.rays.forward.xyz);
    let at = vec2f(dot(p, right) / dot(right, right), dot(p, up) / dot(up, up));
    return vec4f(at * frame.raster.xy + depth * frame.raster.zw, NEAR, depth);
}
