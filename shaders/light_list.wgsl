// Which lights may reach a tile of shading points, decided for all of its points at once by the workgroup that shades them. Twin of
// src/backend/tile.rs; the bounds are those of tile.wgsl.

// Whether lights are left out for whole tiles that are behind, below the horizon, or together under a part of the tolerance.
override SKIP_BEHIND_TILES: bool = true;
override SKIP_BELOW_TILES: bool = true;
override SKIP_UNDER_TOLERANCE: bool = true;
// Any of these.
override TILES: bool = true;
// Whether a lobe of no weight is left out.
override SKIP_LOBES: bool = true;

@group(0) @binding(12) var<storage, read> light_boxes: array<LightBox>;

// Points of a tile.
const TILE: u32 = 64u;
// What is known of a tile, in this order: the greatest of -position, position, -normal, normal, of each row -row and row, of the
// determinant and of both weights; and how many points there are, and how many with each weight.
const TILE_SLOTS: u32 = 40u;
const SLOT_ROWS: u32 = 12u;
const SLOT_DETERMINANT: u32 = 30u;
const SLOT_WEIGHTS: u32 = 31u;
const SLOT_COUNTS: u32 = 37u;
// Less than any value.
const NOTHING: f32 = -3e38;

var<workgroup> tile_values: array<vec4f, 640>;
var<workgroup> tile_summary: array<f32, 40>;
var<workgroup> tile_buckets: array<atomic<u32>, 24>;

// Emitters that are decided about together.
const CHUNK: u32 = 1024u;
// For both lobes, a bit for each emitter of the chunk.
const CHUNK_WORDS: u32 = 32u;
var<workgroup> listed: array<atomic<u32>, 64>;

const LISTED: u32 = 0u;
const FATE_BEHIND: u32 = 1u;
const FATE_BELOW_HORIZON: u32 = 2u;
const FATE_UNDER_TOLERANCE: u32 = 3u;
const FATE_NO_LOBE: u32 = 4u;

fn put_value(local: u32, slot: u32, value: f32) {
    let at = slot * TILE + local;
    tile_values[at / 4u][at % 4u] = value;
}

fn value_of(local: u32, slot: u32) -> f32 {
    let at = slot * TILE + local;
    return tile_values[at / 4u][at % 4u];
}

fn put(local: u32, slot: u32, value: vec3f) {
    put_value(local, slot, value.x);
    put_value(local, slot + 1u, value.y);
    put_value(local, slot + 2u, value.z);
}

fn put_extent(local: u32, slot: u32, there: bool, value: vec3f) {
    put(local, slot, select(vec3f(NOTHING), -value, there));
    put(local, slot + 3u, select(vec3f(NOTHING), value, there));
}

// Adds the point of an invocation, if there is one.
fn add_to_tile(local: u32, there: bool, position: vec3f, shading: ShadingFrame, weights: Reflectance) {
    put_extent(local, 0u, there, position);
    put_extent(local, 6u, there, shading.z);
    let diffuse = select(vec3f(), weights.diffuse, there);
    let specular = select(vec3f(), weights.specular, there);
    put(local, SLOT_WEIGHTS, diffuse);
    put(local, SLOT_WEIGHTS + 3u, specular);
    let shines = max_element(specular) > 0.0;
    if SPECULAR {
        let m = weights.lobe;
        put_extent(local, SLOT_ROWS, shines, shading.x * m.xx + shading.z * m.xz);
        put_extent(local, SLOT_ROWS + 6u, shines, shading.y * m.yy);
        put_extent(local, SLOT_ROWS + 12u, shines, shading.x * m.zx + shading.z * m.zz);
        put_value(local, SLOT_DETERMINANT, select(0.0, lobe_determinant(m), shines));
    }
    put(local, SLOT_COUNTS, vec3f(f32(there), f32(max_element(diffuse) > 0.0), f32(shines)));
}

// Each invocation brings one of the slots together.
fn sum_up_tile(local: u32) {
    workgroupBarrier();
    if local < TILE_SLOTS {
        var value = value_of(0u, local);
        for (var i = 1u; i < TILE; i++) {
            let other = value_of(i, local);
            value = select(max(value, other), value + other, local >= SLOT_COUNTS);
        }
        tile_summary[local] = value;
    }
}

fn summary(slot: u32) -> vec3f {
    return vec3f(tile_summary[slot], tile_summary[slot + 1u], tile_summary[slot + 2u]);
}

fn summed_extent(slot: u32) -> Extent {
    return Extent(-summary(slot), summary(slot + 3u));
}

fn tile_bounds() -> TileBounds {
    var tile: TileBounds;
    tile.position = summed_extent(0u);
    tile.normal = summed_extent(6u);
    if SPECULAR {
        tile.rows[0] = summed_extent(SLOT_ROWS);
        tile.rows[1] = summed_extent(SLOT_ROWS + 6u);
        tile.rows[2] = summed_extent(SLOT_ROWS + 12u);
        tile.determinant = tile_summary[SLOT_DETERMINANT];
    }
    tile.weights[0] = summary(SLOT_WEIGHTS);
    tile.weights[1] = summary(SLOT_WEIGHTS + 3u);
    return tile;
}

// What becomes of the plain cosine and of the lobe, the tolerance aside, and bounds of what they reflect.
struct Decision {
    fates: array<u32, 2>,
    bounds: array<f32, 2>,
}

fn decide(tile: TileBounds, light: LightBox) -> Decision {
    var decision: Decision;
    let offsets = offsets_to(tile, light);
    if SKIP_BEHIND_TILES && tile_is_behind(offsets, light) {
        decision.fates = array(FATE_BEHIND, FATE_BEHIND);
        return decision;
    }
    let under_surface = SKIP_BELOW_TILES && light_is_below(offsets, light, tile.normal);
    for (var k = 0u; k < 2u; k++) {
        let brightest = max_element(tile.weights[k] * light.radiance);
        if brightest <= 0.0 {
            decision.fates[k] = select(LISTED, FATE_NO_LOBE, SKIP_LOBES);
            continue;
        }
        var below = under_surface;
        if k == 1u {
            below = (TRUE_HORIZON && under_surface) || (SKIP_BELOW_TILES && light_is_below(offsets, light, tile.rows[2]));
        }
        if below {
            decision.fates[k] = FATE_BELOW_HORIZON;
        } else if SKIP_UNDER_TOLERANCE {
            if k == 0u {
                decision.bounds[k] = diffuse_bound(offsets, tile, light) * brightest;
            } else {
                decision.bounds[k] = specular_bound(offsets, tile, light) * brightest;
            }
        }
    }
    return decision;
}

fn bucket_of(decision: Decision, k: u32) -> u32 {
    if decision.fates[k] != LISTED {
        return BUCKETS;
    }
    return bucket(decision.bounds[k] / (frame.tolerance * SKIP_SHARE));
}

// The first bucket whose bounds and all smaller ones may be skipped, and the part of SKIP_SHARE that they use up.
struct FirstSkipped {
    bucket: u32,
    spent: f32,
}

// Sorts the bounds of all lights into buckets: a share of the emitters for each invocation.
fn sort_lights(local: u32, tile: TileBounds) -> FirstSkipped {
    for (var i = local; i < frame.emitters; i += TILE) {
        let decision = decide(tile, light_boxes[i]);
        for (var k = 0u; k < 2u; k++) {
            let at = bucket_of(decision, k);
            if at < BUCKETS {
                atomicAdd(&tile_buckets[at], 1u);
            }
        }
    }
    workgroupBarrier();
    var skipped = FirstSkipped(BUCKETS, 0.0);
    for (var j = BUCKETS; j > 0u; j--) {
        let count = f32(atomicLoad(&tile_buckets[j - 1u]));
        let sum = skipped.spent + count * bitcast<f32>((128u - j) << 23u);
        if sum > 1.0 {
            break;
        }
        skipped = FirstSkipped(j - 1u, sum);
    }
    return skipped;
}

// Lists the lights of a chunk that may reach the tile, and counts the others in `row`.
fn list_lights(local: u32, row: u32, first: u32, tile: TileBounds, skipped: FirstSkipped) {
    if first > 0u {
        workgroupBarrier();
        atomicStore(&listed[local], 0u);
        workgroupBarrier();
    }
    let end = min(first + CHUNK, frame.emitters);
    for (var i = first + local; i < end; i += TILE) {
        var reasons = array<u32, SKIP_REASONS>();
        let decision = decide(tile, light_boxes[i]);
        for (var k = 0u; k < 2u; k++) {
            var fate = decision.fates[k];
            if SKIP_UNDER_TOLERANCE && fate == LISTED {
                let at = bucket_of(decision, k);
                fate = select(LISTED, FATE_UNDER_TOLERANCE, at >= skipped.bucket && at < BUCKETS);
            }
            let all = u32(tile_summary[SLOT_COUNTS]);
            let weighted = select(all, u32(tile_summary[SLOT_COUNTS + 1u + k]), SKIP_LOBES);
            switch fate {
                case FATE_BEHIND: {
                    reasons[0] += all;
                    reasons[4] += all;
                }
                case FATE_BELOW_HORIZON: {
                    reasons[1] += weighted;
                    reasons[2] += all - weighted;
                    reasons[5] += weighted;
                }
                case FATE_NO_LOBE: {
                    reasons[2] += all;
                }
                case FATE_UNDER_TOLERANCE: {
                    reasons[2] += all - weighted;
                    reasons[3] += weighted;
                }
                default: {
                    let bit = i - first;
                    atomicOr(&listed[k * CHUNK_WORDS + bit / 32u], 1u << (bit % 32u));
                }
            }
        }
        count_skips(row, emitters[i].light, reasons);
    }
    workgroupBarrier();
}

// The lights of a chunk that are listed for a lobe: a word of 32 bits.
fn listed_word(k: u32, word: u32, first: u32) -> u32 {
    if TILES {
        return atomicLoad(&listed[k * CHUNK_WORDS + word]);
    }
    let begin = first + word * 32u;
    let count = min(frame.emitters - min(begin, frame.emitters), 32u);
    return select((1u << (count % 32u)) - 1u, 0xffffffffu, count == 32u);
}
