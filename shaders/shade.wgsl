// Whether an emission reaches a point, and what a technique answers. Twin of src/backend/gather.rs; the function `gather` of
// the technique is in gather_*.wgsl.

// Whether any emission has a picture.
override PICTURES: bool = true;

// What the tolerance still allows at one shading point. Only techniques with an error bound heed it.
struct Budget {
    // SLACK over the sum of itself and the accepted bounds, in tolerances: 1 where nothing has been spent.
    left: f32,
}

const INFINITE_BOUND: f32 = 3e38;

// Whether a node with this error bound, as a fraction, need not be refined; if so, its bound is spent.
fn budget_accept(budget: ptr<function, Budget>, numerator: f32, denominator: f32, tolerance: f32) -> bool {
    let left = (*budget).left;
    let allowed = denominator * tolerance;
    if numerator <= allowed * left * left * SHARE {
        // 1/left grows by the bound over SLACK.
        (*budget).left = left * allowed / (left * numerator / SLACK + allowed);
        return true;
    }
    return false;
}

// Bytes of lights' regions (bindings 6, 7 and 10) that this invocation has loaded: whoever loads them adds them here.
var<private> loaded: u32;

// Why an integral is zero without having been evaluated.
const SKIP_NONE: u32 = 0u;
const SKIP_BEHIND: u32 = 1u;
const SKIP_BELOW_HORIZON: u32 = 2u;

// An integral, or why it was skipped.
struct Gathered {
    // Normalised: 1 for a full hemisphere of the emitter's radiance. One value per channel where the emitter has colours of
    // its own.
    value: vec3f,
    // Tree nodes, edges or samples it is made of, as the technique has it.
    visited: u32,
    skip: u32,
}

// Whether an emission reaches the point: not from behind, and not in its own plane.
fn is_behind(emitter: Emitter, images: Images) -> bool {
    return !is_whole(emitter) && (images.front == 0.0 || (images.front < 0.0 && emitter.two_sided == 0u));
}

// A signed integral from the side the point is on. That over a window may be less than 0, or more than 1.
fn lit(images: Images, value: f32, visited: u32) -> Gathered {
    let seen = select(value, -value, images.front < 0.0);
    return Gathered(vec3f(select(clamp(seen, 0.0, 1.0), seen, WINDOWS)), visited, SKIP_NONE);
}

// Nothing, for a reason.
fn skipped_for(skip: u32) -> Gathered {
    return Gathered(vec3f(), 0u, skip);
}
