// What clusters of lights send to all points of a tile by the plain cosine: their local expansion about the tile's middle. Twin of
// src/kernel/local.rs, which explains it.

// A channel's sums over clusters, times pi.
struct LocalChannel {
    // For a normal along x, y and z.
    values: vec3f,
    // The slopes of each.
    slopes: mat3x3f,
}

struct Local {
    red: LocalChannel,
    green: LocalChannel,
    blue: LocalChannel,
}

// Numbers of a channel.
const LOCAL_TERMS: u32 = 12u;

// Adds a cluster; y leads from the tile's middle to its centre.
fn add_local(sum: ptr<function, Local>, i: u32, y: vec3f) {
    let inv = 1.0 / sqrt(dot(y, y));
    (*sum).red = with_cluster((*sum).red, clusters[i].moments[0], y, inv);
    (*sum).green = with_cluster((*sum).green, clusters[i].moments[1], y, inv);
    (*sum).blue = with_cluster((*sum).blue, clusters[i].moments[2], y, inv);
}

fn with_cluster(sum: LocalChannel, moments: mat4x4f, y: vec3f, inv: f32) -> LocalChannel {
    let u = y * inv;
    let sides = -(moments * vec4f(y, 1.0));
    let v = sides.xyz;
    let s = dot(u, v);
    let per_cube = inv * inv * inv;
    let values = (v - u * (s * 4.0)) * inv + u * sides.w;
    let rows = transpose(moments);
    let across = rows[0].xyz * u.x + rows[1].xyz * u.y + rows[2].xyz * u.z;
    var slopes = sum.slopes;
    slopes[0] += local_slope(vec3f(1.0, 0.0, 0.0), u.x, v.x, rows[0].xyz, u, sides, s, across, rows[3].xyz, inv) * per_cube;
    slopes[1] += local_slope(vec3f(0.0, 1.0, 0.0), u.y, v.y, rows[1].xyz, u, sides, s, across, rows[3].xyz, inv) * per_cube;
    slopes[2] += local_slope(vec3f(0.0, 0.0, 1.0), u.z, v.z, rows[2].xyz, u, sides, s, across, rows[3].xyz, inv) * per_cube;
    return LocalChannel(sum.values + values * per_cube, slopes);
}

// For a normal along an axis, on which u and V are u_n and v_n; `row` is that row of A, `last` is b.
fn local_slope(
    axis: vec3f,
    u_n: f32,
    v_n: f32,
    row: vec3f,
    u: vec3f,
    sides: vec4f,
    s: f32,
    across: vec3f,
    last: vec3f,
    inv: f32,
) -> vec3f {
    let second = (u * v_n + sides.xyz * u_n + axis * s) * 4.0 - u * (u_n * s * 24.0);
    let first = (u * (u_n * 4.0) - axis) * sides.w - across * (u_n * 4.0) + row;
    return (second * inv + first) * inv + last * u_n;
}

// Brings the sums of all invocations together, in the place of the tile's bounds. All of them call it.
fn sum_up_local(local: u32, sum: Local) {
    workgroupBarrier();
    put_channel(local, 0u, sum.red);
    put_channel(local, LOCAL_TERMS, sum.green);
    put_channel(local, 2u * LOCAL_TERMS, sum.blue);
    workgroupBarrier();
    if local < 3u * LOCAL_TERMS {
        var value = 0.0;
        for (var i = 0u; i < TILE; i++) {
            value += value_of(i, local);
        }
        tile_summary[local] = value;
    }
    workgroupBarrier();
}

fn put_channel(local: u32, slot: u32, channel: LocalChannel) {
    put(local, slot, channel.values);
    put(local, slot + 3u, channel.slopes[0]);
    put(local, slot + 6u, channel.slopes[1]);
    put(local, slot + 9u, channel.slopes[2]);
}

// The integrals of each channel, times pi, for a point with that unit normal, `away` from the tile's middle.
fn local_at(normal: vec3f, away: vec3f) -> vec3f {
    let red = local_channel_at(0u, normal, away);
    let green = local_channel_at(LOCAL_TERMS, normal, away);
    return vec3f(red, green, local_channel_at(2u * LOCAL_TERMS, normal, away));
}

fn local_channel_at(slot: u32, normal: vec3f, away: vec3f) -> f32 {
    let slopes = vec3f(dot(summary(slot + 3u), away), dot(summary(slot + 6u), away), dot(summary(slot + 9u), away));
    return max(dot(normal, summary(slot) + slopes), 0.0);
}
