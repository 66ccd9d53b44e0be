// Many flat lights at once: what a cluster of them sends to shading points. Twin of src/kernel/cluster.rs, which explains it; the
// kinds of cluster and how the tolerance is spent come from there.

@group(0) @binding(13) var<storage, read> clusters: array<Cluster>;

// How a cluster stands to shading points.
struct ClusterView {
    // From the middle of the points to the cluster's centre.
    y: vec3f,
    // Half-extents of where y may lie.
    open: vec3f,
    // |y|.
    distance: f32,
    // Least and most of -y.n over all light points, for all shading points.
    least: f32,
    most: f32,
}

// Of all points of a tile, or of a single one.
fn cluster_view(i: u32, position: Loose, of_tile: bool) -> ClusterView {
    let y = clusters[i].center - position.middle;
    let square = dot(y, y);
    let distance = sqrt(square);
    let cone_cos = clusters[i].cone_cos;
    let cone_sin = clusters[i].cone_sin;
    // In the plane of y and the axis: the normals between the two sides of the cone.
    let along = -dot(clusters[i].axis, y);
    let across = sqrt(max(square - along * along, 0.0));
    let least = cone_cos * along - cone_sin * across;
    let most = select(cone_cos * along + cone_sin * across, distance, along >= cone_cos * distance);
    var slack = ROUNDING * distance;
    if of_tile {
        slack += length_of(position.half);
    }
    return ClusterView(y, position.half, distance, least - clusters[i].high - slack, most - clusters[i].low + slack);
}

// Whether no light of the cluster shines on any of the points.
fn cluster_is_away(i: u32, view: ClusterView, of_tile: bool) -> bool {
    if (clusters[i].link & (SINGLE | HALF)) == (SINGLE | HALF) {
        // Of both sides exactly one is in front of a single point.
        var back = dot(clusters[i].axis, view.y);
        if of_tile {
            back -= dot(abs(clusters[i].axis), view.open);
        }
        return back >= 0.0;
    }
    return view.most <= 0.0;
}

// How far the product of a loose vector with one open by `open` may be off; `far` holds the magnitudes of the latter.
fn loose_open(v: Loose, open: vec3f, far: vec3f) -> f32 {
    return dot(abs(v.middle), open) + dot(v.half, far);
}

// What a lobe sees of a cluster.
struct Sight {
    // Bound of the first-order expansion's error; infinite where it does not hold.
    error: f32,
    // Bound of the integral; 0 below a horizon, infinite where the cluster reaches as far as the point.
    most: f32,
    // Bound of what the plain cosine's local expansion about the middle of a tile is off by beyond that; infinite for a lobe, and where
    // the tile is as large as the cluster is far.
    shift: f32,
}

// Of all points of a tile, or of a single one. To the plain cosine of a point the world and cosine space are the same but for a
// rotation.
fn cluster_sight(f: Field, i: u32, view: ClusterView, lobe: u32, of_tile: bool) -> Sight {
    let round = lobe == PLAIN && !of_tile;
    let a = f.rows[0];
    let b = f.rows[1];
    let c = f.rows[2];
    let half = clusters[i].half;
    let p = vec3f(dot(a.middle, view.y), dot(b.middle, view.y), dot(c.middle, view.y));
    var height = p.z;
    // How far p and the height may be from that, and how far the cluster reaches over its centre.
    let noise = ROUNDING * view.distance;
    var off = vec3f();
    var reach = dot(abs(c.middle), half + noise);
    var up_reach = reach;
    if lobe != PLAIN {
        height = dot(f.up.middle, view.y);
        up_reach = dot(abs(f.up.middle), half + noise);
    }
    var nearest = view.distance;
    var radius = length_of(half);
    if !round {
        nearest = length_of(p);
        radius = field_radius(f, half);
    }
    if of_tile {
        let far = abs(view.y) + view.open;
        off = vec3f(loose_open(a, view.open, far), loose_open(b, view.open, far), loose_open(c, view.open, far));
        reach += dot(c.half, half);
        up_reach += loose_open(f.up, view.open, far + half);
        nearest -= length_of(off);
        radius += field_slack(f, half);
    }
    if p.z + off.z + reach < 0.0 || height + up_reach < 0.0 {
        return Sight(INFINITE_BOUND, 0.0, INFINITE_BOUND);
    }
    let above = p.z - off.z - reach > 0.0 && height - up_reach > 0.0;
    if !(nearest > 0.0) {
        return Sight(INFINITE_BOUND, INFINITE_BOUND, INFINITE_BOUND);
    }
    let inv = 1.0 / nearest;
    let z = clamp((p.z + off.z) * inv, 0.0, 1.0);
    let s = radius * inv;
    let gap = 1.0 - s;
    if !(gap > 0.0) {
        return Sight(INFINITE_BOUND, INFINITE_BOUND, INFINITE_BOUND);
    }
    let bright = max_element(f.weight * clusters[i].flux);
    let unit = f.scale * bright * (view.most * inv) * (inv * inv);
    let per_gap = 1.0 / gap;
    let per_gap_2 = per_gap * per_gap;
    let per_gap_4 = per_gap_2 * per_gap_2;
    // p_z/|p|^4 is at most (z + s)/(1 - s)^4, and 1/(1 - s)^3, over |p|^3.
    let most = unit * per_gap_4 * min(z + min(s, reach * inv), gap);
    if !(above && view.least > 0.0) {
        return Sight(INFINITE_BOUND, most, INFINITE_BOUND);
    }
    // Root means of |q|^2 and q_z^2, over |p|.
    let squares = clusters[i].squares;
    let products = clusters[i].products;
    let m = c.middle;
    var mean = sqrt(squares.x + squares.y + squares.z);
    if !round {
        mean = sqrt(max(dot(f.squares, squares) + 2.0 * dot(f.products, products), 0.0));
    }
    let mixed = vec3f(m.x * m.y, m.x * m.z, m.y * m.z);
    var rise = sqrt(max(dot(m * m, squares) + 2.0 * dot(mixed, products), 0.0));
    if of_tile {
        let spread = sqrt(max(squares, vec3f()));
        mean += field_slack(f, spread);
        rise += dot(c.half, spread);
    }
    mean *= inv;
    rise *= inv;
    let together = min(6.0 * z + 2.0, 6.0) + s * (10.0 - s * (15.0 - 6.0 * s)) * (per_gap_2 * per_gap);
    let t2 = 10.0 + s * (20.0 + s * 35.0 * per_gap_4);
    let t1 = 4.0 + s * t2;
    var shift = INFINITE_BOUND;
    if of_tile && lobe == PLAIN {
        let size = length_of(view.open) * inv;
        let tile_gap = 1.0 - size;
        let series = size * size / (tile_gap * tile_gap * tile_gap);
        let sum = unit * (mean * 30.0 + 6.0) + f.scale * bright * (inv * inv) * (mean * 12.0 + 3.0);
        shift = select(INFINITE_BOUND, series * sum, tile_gap > 0.0);
    }
    return Sight(unit * mean * min(mean * together, z * mean * t2 + rise * t1), most, shift);
}

// The first-order expansion at a single point, of a cluster with those moments: reflected radiance.
fn cluster_expansion(f: Field, red: mat4x4f, green: mat4x4f, blue: mat4x4f, y: vec3f, lobe: u32) -> vec3f {
    let a = f.rows[0].middle;
    let b = f.rows[1].middle;
    let c = f.rows[2].middle;
    var p = vec3f(0.0, 0.0, dot(c, y));
    var square = dot(y, y);
    if lobe != PLAIN {
        p = vec3f(dot(a, y), dot(b, y), p.z);
        square = dot(p, p);
    }
    let inv2 = 1.0 / square;
    let inv = sqrt(inv2);
    let height = p.z * inv;
    // The image of the direction to the centre, and back.
    var back = y * inv;
    if lobe != PLAIN {
        back = (a * p.x + b * p.y + c * p.z) * inv;
    }
    // h and its gradient in the world.
    let kernel = vec4f((c - back * (4.0 * height)) * inv, height);
    let place = vec4f(y, 1.0);
    let sums = -vec3f(dot(red * place, kernel), dot(green * place, kernel), dot(blue * place, kernel));
    return max(sums, vec3f()) * f.weight * (f.scale * inv * inv2);
}

// What clusters may still be off by at a shading point: the sum of the accepted bounds, in tolerances.
struct ClusterBudget {
    spent: f32,
}

// Whether a bound is small enough; if so it is spent. The first may be `share` tolerances.
fn cluster_accept(budget: ptr<function, ClusterBudget>, bound: f32, tolerance: f32, share: f32) -> bool {
    let left = CLUSTER_SLACK / ((*budget).spent + CLUSTER_SLACK);
    let accepted = bound <= tolerance * (left * left * share);
    if accepted {
        (*budget).spent += bound / tolerance;
    }
    return accepted;
}

// What becomes of a cluster for a lobe: it adds nothing, or nothing that counts; the expansion stands for it; its parts must be
// looked at; the local expansion of the tile stands for it.
const CLUSTER_NOTHING: u32 = 0u;
const CLUSTER_WHOLE: u32 = 1u;
const CLUSTER_REFINE: u32 = 2u;
const CLUSTER_LOCAL: u32 = 3u;

fn cluster_fate(
    f: Field,
    i: u32,
    view: ClusterView,
    lobe: u32,
    of_tile: bool,
    tolerance: f32,
    budget: ptr<function, ClusterBudget>,
) -> u32 {
    let sight = cluster_sight(f, i, view, lobe, of_tile);
    let expands = sight.error < sight.most;
    if of_tile && lobe == PLAIN && expands && cluster_accept(budget, sight.error + sight.shift, tolerance, LOCAL_SHARE) {
        return CLUSTER_LOCAL;
    }
    if !cluster_accept(budget, select(sight.most * LEFT_OUT, sight.error, expands), tolerance, FIRST_SHARE) {
        return CLUSTER_REFINE;
    }
    return select(CLUSTER_NOTHING, CLUSTER_WHOLE, expands);
}

// Where the walk goes on past a cluster.
fn cluster_end(i: u32) -> u32 {
    return select(clusters[i].link, i + 1u, (clusters[i].link & SINGLE) != 0u);
}
