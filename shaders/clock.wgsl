// Work whose time both clocks can tell: steps of xorshift (Marsaglia 2003), each of which waits for the one before.

@group(0) @binding(0) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(64)
fn spin(@builtin(global_invocation_id) id: vec3u) {
    let steps = words[0];
    var x = id.x + 1u;
    for (var i = 0u; i < steps; i++) {
        x ^= x << 13u;
        x ^= x >> 17u;
        x ^= x << 5u;
    }
    words[id.x + 1u] = x;
}
