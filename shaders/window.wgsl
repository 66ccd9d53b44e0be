// What stands it that drivers end loops early. Mesa's llvmpipe lets the invocations that run side by side go 65535 rounds, those of
// all loops of the shader together; from then on every loop ends with the round that it is in. The pass says so (loops_are_cut), and
// src/backend/gpu/window.rs has the same work done in windows: each dispatch integrates over some of the elements of each light's
// region, and adds to what the ones before it have found.
//
// A place among the elements is counted in cells, CELLS to an element; those of a cubic leaf are steps of its parameter.

// Whether a dispatch has a window, frame.window, and not all of the work.
override WINDOWS: bool = false;

const CELLS_LOG: u32 = 8u;
const CELLS: u32 = 256u;
const ALL_CELLS: vec2u = vec2u(0u, 0xffffffffu);
// First cell of the window and past its last one, for the region that is being walked.
var<private> window: vec2u = ALL_CELLS;

const WINDOW_HAS: u32 = 0u;
const WINDOW_CUTS: u32 = 1u;
const WINDOW_LACKS: u32 = 2u;

// Whether some loop of this shader has been ended by the driver: if so, one of two rounds ends after its first. Compilers don't
// know how many it has.
fn loops_are_cut() -> bool {
    var rounds = 0u;
    while rounds < frame.zero + 2u {
        rounds += 1u;
    }
    return rounds < 2u;
}

// Whether this dispatch begins the work, and whether it ends it.
fn is_first_window() -> bool {
    return !WINDOWS || frame.window.x == 0u;
}

fn is_last_window() -> bool {
    return !WINDOWS || frame.window.x + 1u == frame.window.y;
}

// The window's cells of a region with the elements from `first` to `end`.
fn window_of(first: u32, end: u32) -> vec2u {
    let cells = (end - first) << CELLS_LOG;
    let width = (cells + frame.window.y - 1u) / frame.window.y;
    let begin = min(frame.window.x * width, cells);
    return (first << CELLS_LOG) + vec2u(begin, min(begin + width, cells));
}

// Of the elements from `first` to `end` those that begin in the window.
fn elements_in_window(first: u32, end: u32) -> vec2u {
    if WINDOWS {
        return (window_of(first, end) + (CELLS - 1u)) >> vec2u(CELLS_LOG);
    }
    return vec2u(first, end);
}

// Where an element begins, or piece `index` of the 2^level of a leaf, 2^24 at most; of level 0 the index has no meaning.
fn cell_of(element: u32, level: u32, index: u32) -> u32 {
    return (element << CELLS_LOG) + select((index << CELLS_LOG) >> level, 0u, level == 0u);
}

// Whether a walk has come to the end of its region or of the window.
fn is_past(element: u32, end: u32, level: u32, index: u32) -> bool {
    return element >= end || (WINDOWS && cell_of(element, level, index) >= window.y);
}

// Whether the window has what is between two cells. What can be refined and is cut by the window must be.
fn window_part(begin: u32, end: u32, is_divisible: bool) -> u32 {
    if end <= window.x || (begin < window.x && !is_divisible) {
        return WINDOW_LACKS;
    }
    return select(WINDOW_HAS, WINDOW_CUTS, is_divisible && (begin < window.x || end > window.y));
}
