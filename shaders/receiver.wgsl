// What receives the light of clusters: a shading point, or all points of a tile at once, known by boxes that hold what theirs are.
// Twin of src/kernel/receiver.rs, where the lobes' numbers PLAIN and SPECULAR_LOBE come from.

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
    // Products of the map's columns, by the middles of its rows: xx, yy, zz.
    squares: vec3f,
    // The same: xy, xz, yz.
    products: vec3f,
    // det M^-1/pi.
    scale: f32,
    // Reflected radiance over radiance and integral.
    weight: vec3f,
}

// The shading points of a tile, or one of them, as seen by clusters. Lengths are in the tree's unit.
struct Receiver {
    position: Loose,
    plain: Field,
    lobe: Field,
    // Whether each of them reflects anything.
    shines: vec2<bool>,
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
    let shines = vec2(max_element(plain.weight) > 0.0, max_element(lobe.weight) > 0.0);
    return Receiver(place, plain, lobe, vec2(DIFFUSE && shines.x, SPECULAR && shines.y));
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
