// Many flat lights at once: the walk over a tree of clusters of lights. Twin of src/kernel/cluster.rs, which explains it; the kinds
// of cluster come from there.

@group(0) @binding(13) var<storage, read> clusters: array<Cluster>;

// A vector known up to a box.
struct Loose {
    middle: vec3f,
    half: vec3f,
}

// A lobe of shading points, and what it reflects.
struct Field {
    // Rows of the map from the world to cosine space.
    rows: array<Loose, 3>,
    // Normal of the surface's true horizon, or of the lobe's own where only that one clips; world space, any length.
    up: Loose,
    // Products of the map's columns: xx, yy, zz, and xy, xz, yz.
    squares: vec3f,
    products: vec3f,
    // det M^-1/pi.
    scale: f32,
    // Reflected radiance over radiance and integral.
    weight: vec3f,
}

// The shading points of a tile, or one of them, as seen by clusters. Lengths are in the tree's unit.
struct Receiver {
    position: Loose,
    fields: array<Field, 2>,
    // Whether each lobe reflects anything.
    shines: array<bool, 2>,
}

fn known(middle: vec3f) -> Loose {
    return Loose(middle, vec3f());
}

fn loose(extent: Extent) -> Loose {
    return Loose((extent.low + extent.high) * 0.5, (extent.high - extent.low) * 0.5);
}

fn field(rows: array<Loose, 3>, up: Loose, determinant: f32, weight: vec3f) -> Field {
    let a = rows[0].middle;
    let b = rows[1].middle;
    let c = rows[2].middle;
    let mixed = a * a.yzx + b * b.yzx + c * c.yzx;
    return Field(rows, up, a * a + b * b + c * c, mixed.xzy, determinant / PI, weight);
}

fn receiver(position: Loose, plain: Field, lobe: Field) -> Receiver {
    let place = Loose(position.middle * frame.per_metre, position.half * frame.per_metre);
    let shines = array(max_element(plain.weight) > 0.0, max_element(lobe.weight) > 0.0);
    return Receiver(place, array(plain, lobe), shines);
}

// The points within the bounds.
fn receiver_of_tile(tile: TileBounds) -> Receiver {
    let normal = loose(tile.normal);
    // The plain cosine is round about the normal. Tangents turn by as much as normals do, which are up to twice their box's
    // half-diagonal from the unit vector through its middle.
    let size = length_of(normal.middle);
    let z = select(vec3f(0.0, 0.0, 1.0), normal.middle / size, size > 0.0);
    let x = any_orthonormal_vector(z);
    let turn = vec3f(2.0 * length_of(normal.half));
    let rows = array(loose(tile.rows[0]), loose(tile.rows[1]), loose(tile.rows[2]));
    let plain = field(array(Loose(x, turn), Loose(cross(z, x), turn), normal), normal, 1.0, tile.weights[0]);
    var up = rows[2];
    if TRUE_HORIZON {
        up = normal;
    }
    return receiver(loose(tile.position), plain, field(rows, up, tile.determinant, tile.weights[1]));
}

// One point.
fn receiver_of_point(position: vec3f, shading: ShadingFrame, weights: Reflectance) -> Receiver {
    let m = weights.lobe;
    let z = known(shading.z);
    let rows = array(
        known(shading.x * m.xx + shading.z * m.xz),
        known(shading.y * m.yy),
        known(shading.x * m.zx + shading.z * m.zz),
    );
    var up = rows[2];
    if TRUE_HORIZON {
        up = z;
    }
    let plain = field(array(known(shading.x), known(shading.y), z), z, 1.0, weights.diffuse);
    return receiver(known(position), plain, field(rows, up, lobe_determinant(m), weights.specular));
}

// The middle of the tile.
fn at_middle(tile: Receiver) -> Receiver {
    var point = tile;
    point.position.half = vec3f();
    for (var k = 0u; k < 2u; k++) {
        point.fields[k].up.half = vec3f();
        for (var i = 0u; i < 3u; i++) {
            point.fields[k].rows[i].half = vec3f();
        }
    }
    return point;
}

fn length_of(v: vec3f) -> f32 {
    return sqrt(dot(v, v));
}

// Largest length in cosine space of a vector in a box with these half-extents, by the middles of the rows.
fn field_radius(f: Field, half: vec3f) -> f32 {
    let mixed = vec3f(half.x * half.y, half.x * half.z, half.y * half.z);
    return sqrt(dot(f.squares, half * half) + 2.0 * dot(abs(f.products), mixed));
}

// Largest length by which the boxes of the rows leave the image of a vector in a box open.
fn field_slack(f: Field, half: vec3f) -> f32 {
    return length_of(vec3f(dot(f.rows[0].half, half), dot(f.rows[1].half, half), dot(f.rows[2].half, half)));
}

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

fn cluster_view(i: u32, position: Loose) -> ClusterView {
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
    let slack = ROUNDING * distance + length_of(position.half);
    return ClusterView(y, position.half, distance, least - clusters[i].high - slack, most - clusters[i].low + slack);
}

// Whether no light of the cluster shines on any of the points.
fn cluster_is_away(i: u32, view: ClusterView) -> bool {
    if (clusters[i].link & (SINGLE | HALF)) == (SINGLE | HALF) {
        // Of both sides exactly one is in front of a single point.
        return dot(clusters[i].axis, view.y) - dot(abs(clusters[i].axis), view.open) >= 0.0;
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
}

fn cluster_sight(f: Field, i: u32, view: ClusterView) -> Sight {
    let a = f.rows[0];
    let b = f.rows[1];
    let c = f.rows[2];
    let half = clusters[i].half;
    let p = vec3f(dot(a.middle, view.y), dot(b.middle, view.y), dot(c.middle, view.y));
    let height = dot(f.up.middle, view.y);
    // How far p and the height may be from that, and how far the cluster reaches over its centre.
    let noise = ROUNDING * view.distance;
    let far = abs(view.y) + view.open;
    let off = vec3f(loose_open(a, view.open, far), loose_open(b, view.open, far), loose_open(c, view.open, far));
    let reach = dot(abs(c.middle), half + noise) + dot(c.half, half);
    let up_reach = dot(abs(f.up.middle), half + noise) + loose_open(f.up, view.open, far + half);
    if p.z + off.z + reach < 0.0 || height + up_reach < 0.0 {
        return Sight(INFINITE_BOUND, 0.0);
    }
    let above = p.z - off.z - reach > 0.0 && height - up_reach > 0.0;
    let nearest = length_of(p) - length_of(off);
    if !(nearest > 0.0) {
        return Sight(INFINITE_BOUND, INFINITE_BOUND);
    }
    let inv = 1.0 / nearest;
    let z = clamp((p.z + off.z) * inv, 0.0, 1.0);
    let s = (field_radius(f, half) + field_slack(f, half)) * inv;
    let gap = 1.0 - s;
    if !(gap > 0.0) {
        return Sight(INFINITE_BOUND, INFINITE_BOUND);
    }
    let bright = max_element(f.weight * clusters[i].flux);
    let unit = f.scale * bright * (view.most * inv) * (inv * inv);
    let per_gap = 1.0 / gap;
    let per_gap_2 = per_gap * per_gap;
    let per_gap_4 = per_gap_2 * per_gap_2;
    // p_z/|p|^4 is at most (z + s)/(1 - s)^4, and 1/(1 - s)^3, over |p|^3.
    let most = unit * per_gap_4 * min(z + min(s, reach * inv), gap);
    if !(above && view.least > 0.0) {
        return Sight(INFINITE_BOUND, most);
    }
    // Root means of |q|^2 and q_z^2, over |p|.
    let squares = clusters[i].squares;
    let products = clusters[i].products;
    let spread = sqrt(max(squares, vec3f()));
    let mixed = vec3f(c.middle.x * c.middle.y, c.middle.x * c.middle.z, c.middle.y * c.middle.z);
    let middle_mean = sqrt(max(dot(f.squares, squares) + 2.0 * dot(f.products, products), 0.0));
    let middle_rise = sqrt(max(dot(c.middle * c.middle, squares) + 2.0 * dot(mixed, products), 0.0));
    let mean = (middle_mean + field_slack(f, spread)) * inv;
    let rise = (middle_rise + dot(c.half, spread)) * inv;
    let together = min(6.0 * z + 2.0, 6.0) + s * (10.0 - s * (15.0 - 6.0 * s)) * (per_gap_2 * per_gap);
    let t2 = 10.0 + s * (20.0 + s * 35.0 * per_gap_4);
    let t1 = 4.0 + s * t2;
    return Sight(unit * mean * min(mean * together, z * mean * t2 + rise * t1), most);
}

// The first-order expansion at a single point: reflected radiance.
fn cluster_expansion(f: Field, i: u32, y: vec3f) -> vec3f {
    let a = f.rows[0].middle;
    let b = f.rows[1].middle;
    let c = f.rows[2].middle;
    let p = vec3f(dot(a, y), dot(b, y), dot(c, y));
    let inv2 = 1.0 / dot(p, p);
    let inv = sqrt(inv2);
    let d = p * inv;
    // h and its gradient in the world.
    let gradient = (c - (a * d.x + b * d.y + c * d.z) * (4.0 * d.z)) * inv;
    let kernel = vec4f(gradient, d.z);
    let place = vec4f(y, 1.0);
    let sums = -vec3f(
        dot(clusters[i].moments[0] * place, kernel),
        dot(clusters[i].moments[1] * place, kernel),
        dot(clusters[i].moments[2] * place, kernel),
    );
    return max(sums, vec3f()) * f.weight * (f.scale * inv * inv2);
}

// What becomes of a cluster for a lobe: it adds nothing, or nothing that counts; the expansion stands for it; its parts must be
// looked at.
const CLUSTER_NOTHING: u32 = 0u;
const CLUSTER_WHOLE: u32 = 1u;
const CLUSTER_REFINE: u32 = 2u;

fn cluster_fate(f: Field, i: u32, view: ClusterView, tolerance: f32, budget: ptr<function, Budget>) -> u32 {
    let sight = cluster_sight(f, i, view);
    if sight.error < sight.most && budget_accept(budget, sight.error, tolerance) {
        return CLUSTER_WHOLE;
    }
    return select(CLUSTER_REFINE, CLUSTER_NOTHING, budget_accept(budget, sight.most, tolerance));
}

// Where the walk goes on past a cluster.
fn cluster_end(i: u32) -> u32 {
    return select(clusters[i].link, i + 1u, (clusters[i].link & SINGLE) != 0u);
}
