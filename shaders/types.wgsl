// Structs and bindings of all passes. The structs' layouts are those of the Rust types of the same names, which a test holds
// them against: src/kernel/{cluster,picture,quad,surface,tile,tree}.rs and src/backend/gpu/layout.rs, which say what each member is.
//
// Positions are relative to the camera, in metres.

struct Rays {
    forward: vec4f,
    right: vec4f,
    up: vec4f,
}

struct Frame {
    rays: Rays,
    raster: vec4f,
    picture: vec2u,
    tile_origin: vec2u,
    tile_size: vec2u,
    offset: vec2f,
    steps: vec2f,
    tolerance: f32,
    emitters: u32,
    boxes: u32,
    lights: u32,
    // kuge: least contribution of a triangle that is subdivided; 0 for the paper's own.
    eps: f32,
    // uniform: edges per curve. pal: the basis.
    choice: u32,
    // Number of clusters of lights, and their unit of length over a metre.
    clusters: u32,
    per_metre: f32,
    // Which window of how many: see window.wgsl.
    window: vec2u,
    // 0, which compilers don't know: see wide.wgsl.
    zero: u32,
    // Rows of workgroups of the tile from one to the next of the dispatch.
    row_step: u32,
    pad: vec2u,
}

struct SurfaceTriangle {
    p0: vec4f,
    e1: vec4f,
    e2: vec4f,
    n0: vec4f,
    n1: vec4f,
    n2: vec4f,
    t0: vec4f,
    t1: vec4f,
    t2: vec3f,
    material: u32,
}

struct SurfaceMaterial {
    base_color: vec4f,
    alpha: f32,
    specular: f32,
    normal_scale: f32,
    base_color_texture: u32,
    metallic_roughness_texture: u32,
    normal_texture: u32,
    pad: vec2u,
}

struct SurfaceTexture {
    offset: u32,
    width: u32,
    height: u32,
    levels: u32,
}

struct Emitter {
    x: vec3f,
    first: u32,
    y: vec3f,
    end: u32,
    center: vec3f,
    first_detail: u32,
    normal: vec3f,
    light: u32,
    radiance: vec3f,
    two_sided: u32,
    form: u32,
    radius: f32,
    length: f32,
    picture: u32,
}

struct LightBox {
    center: vec3f,
    area: f32,
    x: vec3f,
    half_x: f32,
    y: vec3f,
    half_y: f32,
    z: vec3f,
    half_z: f32,
    radiance: vec3f,
    one_sided: u32,
}

struct Cluster {
    center: vec3f,
    link: u32,
    half: vec3f,
    low: f32,
    axis: vec3f,
    high: f32,
    flux: vec3f,
    cone_cos: f32,
    squares: vec3f,
    cone_sin: f32,
    products: vec3f,
    pad: f32,
    moments: array<mat4x4f, 3>,
}

struct Node {
    center: vec2f,
    half: vec2f,
    a: vec2f,
    b: vec2f,
    m0: f32,
    m1: array<f32, 2>,
    m2: array<f32, 3>,
    m3: array<f32, 4>,
    areas: u32,
    link: u32,
}

struct Handles {
    p1: vec2f,
    p2: vec2f,
    low1: vec2f,
    low2: vec2f,
}

struct Curve {
    p0: vec2f,
    p1: vec2f,
    p2: vec2f,
    p3: vec2f,
}

struct Quad {
    half: vec2f,
    low: vec2f,
}

struct Level {
    low: vec2f,
    per_unit: vec2f,
    offset: u32,
    size: u32,
    variance: f32,
    coarser: u32,
}

struct Box {
    low: vec3f,
    skip: u32,
    high: vec3f,
    triangles: u32,
}

struct Pixel {
    diffuse: vec3f,
    samples: u32,
    specular: vec3f,
    nodes: u32,
    bytes: vec2u,
    cut: u32,
    budget: f32,
}

struct MeterPoint {
    position: vec3f,
    emitter: u32,
    normal: vec3f,
    alpha: f32,
    view: vec3f,
    tolerance: f32,
}

struct Reading {
    diffuse: vec3f,
    diffuse_nodes: u32,
    specular: vec3f,
    specular_nodes: u32,
    budgets: vec2f,
    cut: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> triangles: array<SurfaceTriangle>;
@group(0) @binding(2) var<storage, read> materials: array<SurfaceMaterial>;
@group(0) @binding(3) var<storage, read> textures: array<SurfaceTexture>;
@group(0) @binding(4) var<storage, read> texels: array<u32>;
@group(0) @binding(5) var<storage, read> emitters: array<Emitter>;
@group(0) @binding(8) var<storage, read> ltc_table: array<vec4f>;
@group(0) @binding(9) var<storage, read> boxes: array<Box>;
// 6 and 7 are the lights' regions as the technique reads them: gather_*.wgsl. 10 and 11 are their pictures: picture.wgsl.
// 12 are their boxes: light_list.wgsl. 13 are their clusters: cluster.wgsl.

// Shading: the triangle seen at the sample, plus one (0 = none), with a border of one pixel; what it adds to.
@group(1) @binding(0) var visibility: texture_2d<u32>;
@group(1) @binding(1) var<storage, read_write> pixels: array<Pixel>;
@group(1) @binding(2) var<storage, read_write> skips: array<atomic<u32>>;

// The light meter.
@group(1) @binding(3) var<storage, read> points: array<MeterPoint>;
@group(1) @binding(4) var<storage, read_write> readings: array<Reading>;
