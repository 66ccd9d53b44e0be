//! The boundary of a set of curves, by linesweeper. The only file that names it.
//!
//! linesweeper 0.5 finds the topology: which part of which curve bounds the region. It is not asked where: beside an
//! extremum it is off by the square root of its closeness, and on bent cubics by more. So every end of a part is
//! found anew, by Newton on the two curves that meet there, and the parts are cut from the curves as given. What
//! nothing cuts comes out bit for bit.

use super::point;
use crate::shape::CubicBez;
use glam::DVec2;
use kurbo::BezPath;
use linesweeper::topology::{BinaryWindingNumber, OneOfTwo, Topology};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// How to ask linesweeper.
#[derive(Clone, Copy)]
pub(super) struct Attempt {
    /// Curves closer than this count as touching.
    pub(super) closeness: f64,
    /// The plane is turned by this, radians. Turned by an angle that no drawing prefers, there are no horizontals and
    /// no extrema of equal height, which trip a sweep line.
    pub(super) angle: f64,
    /// Cubics are cut until they are this close to quadratics. Far from that linesweeper 0.5 loses crossings: of 2000
    /// random pairs of cubics it got 131 wrong, and none once they were cut to within 1.
    pub(super) flatness: f64,
}

/// Two sets of closed loops of curves.
pub(super) type Sets = [Vec<Vec<CubicBez>>; 2];

/// Parts shorter than this, 4e-9 of the extent, are welded away.
const SPECK: f64 = 4e-6;
/// Farthest that a crossing may lie from where linesweeper puts it.
const ASTRAY: f64 = 2.0;
/// Two curves meet where they come this close: 1e-12 of the extent.
const MEETING: f64 = 1e-9;

/// The loops that bound the region where `inside` holds for the winding numbers of the two sets, region to the left.
///
/// Coordinates are to be within about ±1000.
pub(super) fn boundary(
    sets: &Sets,
    &Attempt { closeness, angle, flatness }: &Attempt,
    inside: impl Fn(i32, i32) -> bool,
) -> Result<Vec<Vec<CubicBez>>, String> {
    let input = Input::new(sets, angle, flatness);
    let [a, b] = &input.paths;
    let topology = Topology::<BinaryWindingNumber>::from_paths([(a, OneOfTwo::A), (b, OneOfTwo::B)], closeness)
        .map_err(|e| format!("{e:?}"))?;
    let mut piece = 0;
    let mut piece_of = HashMap::new();
    for segment in topology.segments.indices() {
        let end = input.pieces.get(piece).ok_or("it has more segments than were given")?.end;
        piece_of.insert(segment, piece);
        if topology.segments.oriented_end(segment).to_kurbo() == end {
            piece += 1;
        }
    }
    if piece < input.pieces.len() {
        return Err("it has fewer segments than were given".to_owned());
    }
    let mut edges = Vec::new();
    for segment in topology.segment_indices() {
        let (first, second) = (segment.first_half(), segment.second_half());
        let holds = |w: &BinaryWindingNumber| inside(w.shape_a, w.shape_b);
        let (left, right) =
            (holds(topology.winding_clockwise(first)), holds(topology.winding_counter_clockwise(first)));
        if left == right {
            continue;
        }
        let (from, to) = if left { (first, second) } else { (second, first) };
        let ends = [from, to].map(|half| topology.point(half).to_kurbo()).map(|p| DVec2::new(p.x, p.y));
        let piece = *piece_of.get(&topology.orig_seg[segment]).ok_or("it has segments that were not given")?;
        edges.push(input.edge(piece, ends));
    }
    let loops = stitch(&edges)?;
    Ok(loops.into_iter().filter_map(|parts| input.curves(parts)).collect())
}

/// A stretch of a source, monotone in the turned y, as linesweeper gets it.
struct Piece {
    source: usize,
    range: [f64; 2],
    /// Its last point, turned.
    end: kurbo::Point,
}

/// The curves as given, and as linesweeper gets them.
struct Input {
    sources: Vec<CubicBez>,
    straight: Vec<bool>,
    /// The sources, turned.
    turned: Vec<CubicBez>,
    pieces: Vec<Piece>,
    paths: [BezPath; 2],
    back: DVec2,
}

/// A part of a source that bounds the region, from parameter `range[0]` to `range[1]`, up or down.
#[derive(Clone, Copy)]
struct Part {
    source: usize,
    range: [f64; 2],
    /// Its ends as linesweeper has them, turned; equal bits where parts meet.
    ends: [DVec2; 2],
}

impl Part {
    const fn forward(&self) -> bool {
        self.range[0] <= self.range[1]
    }
}

impl Input {
    fn new(sets: &Sets, angle: f64, flatness: f64) -> Self {
        let turn = DVec2::from_angle(angle);
        let mut input = Self {
            sources: Vec::new(),
            straight: Vec::new(),
            turned: Vec::new(),
            pieces: Vec::new(),
            paths: [BezPath::new(), BezPath::new()],
            back: DVec2::from_angle(-angle),
        };
        for (k, curves) in sets.iter().enumerate().flat_map(|(k, set)| set.iter().map(move |curves| (k, curves))) {
            input.paths[k].move_to(point(turn.rotate(curves[0].p0)));
            for c in curves {
                let [p0, p1, p2, p3] = c.points().map(|p| turn.rotate(p));
                input.add(*c, CubicBez::new(p0, p1, p2, p3), k, flatness);
            }
            input.paths[k].close_path();
        }
        input
    }

    fn add(&mut self, source: CubicBez, turned: CubicBez, set: usize, flatness: f64) {
        let straight = source == CubicBez::line(source.p0, source.p3);
        let index = self.sources.len();
        let mut stops = vec![0.0];
        if !straight {
            stops.extend(turned.turns());
        }
        stops.push(1.0);
        // Uniform parts of what is monotone: their distance from quadratics falls with the cube of their number.
        let parts = |range: &[f64]| {
            let n = (turned.off_quadratic() * (range[1] - range[0]).powi(3) / flatness).cbrt().ceil().max(1.0);
            let range = [range[0], range[1]];
            (0..n as u32).map(move |k| range[0] + (range[1] - range[0]) * f64::from(k) / n)
        };
        let stops: Vec<f64> = stops.windows(2).flat_map(parts).chain([1.0]).collect();
        let mut start = turned.p0;
        for range in stops.windows(2) {
            let mut part = turned.subsegment(range[0], range[1]);
            part.p0 = start;
            if part.p3 == start {
                // linesweeper skips what has no length.
                continue;
            }
            let (low, high) = (part.p0.y.min(part.p3.y), part.p0.y.max(part.p3.y));
            if straight {
                self.paths[set].line_to(point(part.p3));
            } else {
                let [a, b] = [part.p1, part.p2].map(|p| DVec2::new(p.x, p.y.clamp(low, high)));
                self.paths[set].curve_to(point(a), point(b), point(part.p3));
            }
            self.pieces.push(Piece { source: index, range: [range[0], range[1]], end: point(part.p3) });
            start = part.p3;
        }
        self.sources.push(source);
        self.straight.push(straight);
        self.turned.push(turned);
    }

    /// The part of a piece between two points on it.
    fn edge(&self, piece: usize, ends: [DVec2; 2]) -> Part {
        let Piece { source, range, .. } = self.pieces[piece];
        let curve = &self.turned[source];
        let locate = |p: DVec2| {
            let known = range.into_iter().find(|&t| curve.eval_exact(t) == p);
            known.unwrap_or_else(|| nearest(curve, p, range))
        };
        Part { source, range: ends.map(locate), ends }
    }

    /// The curves of a loop of parts; `None` if nothing of it is longer than a speck.
    fn curves(&self, mut parts: Vec<Part>) -> Option<Vec<CubicBez>> {
        parts.retain(|part| {
            let [a, b] = part.range;
            let cut = self.turned[part.source].subsegment(a.min(b), a.max(b));
            cut.points().iter().any(|p| p.distance(cut.p0) > SPECK)
        });
        let mut parts = self.merged(parts);
        let n = parts.len();
        if n == 0 {
            return None;
        }
        let forward: Vec<bool> = parts.iter().map(Part::forward).collect();
        let corners: Vec<DVec2> = (0..n).map(|i| self.corner(&mut parts, (i + n - 1) % n, i)).collect();
        let curve = |i: usize| {
            let (start, end) = (corners[i], corners[(i + 1) % n]);
            let Part { source, range: [a, b], .. } = parts[i];
            // A part that its corners turned round is shorter than they are sharp.
            if self.straight[source] || parts[i].forward() != forward[i] {
                return CubicBez::line(start, end);
            }
            let cut = self.sources[source].subsegment(a.min(b), a.max(b));
            (if a <= b { cut } else { cut.reversed() }).with_ends(start, end)
        };
        Some((0..n).map(curve).collect())
    }

    /// Joins parts that follow each other on one source.
    fn merged(&self, mut parts: Vec<Part>) -> Vec<Part> {
        let follows = |a: &Part, b: &Part| {
            let curve = &self.turned[a.source];
            a.source == b.source
                && a.forward() == b.forward()
                && (a.range[1] - b.range[0]).abs() < 0.01
                && curve.eval(a.range[1]).distance(curve.eval(b.range[0])) <= 4.0 * SPECK
        };
        if let Some(first) =
            (0..parts.len()).find(|&i| !follows(&parts[(i + parts.len() - 1) % parts.len()], &parts[i]))
        {
            parts.rotate_left(first);
        }
        let mut merged: Vec<Part> = Vec::with_capacity(parts.len());
        for part in parts {
            match merged.last_mut() {
                Some(last) if follows(last, &part) => {
                    last.range[1] = part.range[1];
                    last.ends[1] = part.ends[1];
                }
                _ => merged.push(part),
            }
        }
        merged
    }

    /// Where part `a` goes over into part `b`; their ranges are set to end and begin there.
    fn corner(&self, parts: &mut [Part], a: usize, b: usize) -> DVec2 {
        let [s, t] = [parts[a].source, parts[b].source].map(|k| &self.sources[k]);
        let (u, v) = (parts[a].range[1], parts[b].range[0]);
        let at_end = |t: f64| t == 0.0 || t == 1.0;
        if at_end(u) && at_end(v) && s.eval_exact(u) == t.eval_exact(v) {
            return s.eval_exact(u);
        }
        let given = self.back.rotate(parts[b].ends[0]);
        if let Some((u, v)) = meeting(s, t, u, v) {
            let p = s.eval_exact(u);
            if p.distance(given) <= ASTRAY {
                (parts[a].range[1], parts[b].range[0]) = (u, v);
                return if at_end(v) { t.eval_exact(v) } else { p };
            }
        }
        // No crossing: they run along each other, or all but.
        let p = if at_end(u) {
            s.eval_exact(u)
        } else if at_end(v) {
            t.eval_exact(v)
        } else {
            given
        };
        if !at_end(u) {
            parts[a].range[1] = nearest(s, p, [(u - 0.01).max(0.0), (u + 0.01).min(1.0)]);
        }
        if !at_end(v) {
            parts[b].range[0] = nearest(t, p, [(v - 0.01).max(0.0), (v + 0.01).min(1.0)]);
        }
        p
    }
}

/// Parameters at which `a` and `b` meet, by Newton from `u` and `v`.
fn meeting(a: &CubicBez, b: &CubicBez, mut u: f64, mut v: f64) -> Option<(f64, f64)> {
    for _ in 0..40 {
        let gap = b.eval_exact(v) - a.eval_exact(u);
        if gap.length() <= MEETING * 1e-3 {
            break;
        }
        let (da, db) = (a.tangent(u), b.tangent(v));
        let cross = da.perp_dot(db);
        if cross.abs() <= 1e-9 * da.length() * db.length() {
            return None;
        }
        let (next_u, next_v) = (u + gap.perp_dot(db) / cross, v + gap.perp_dot(da) / cross);
        let (next_u, next_v) = (next_u.clamp(0.0, 1.0), next_v.clamp(0.0, 1.0));
        if next_u == u && next_v == v {
            break;
        }
        (u, v) = (next_u, next_v);
    }
    (a.eval_exact(u).distance(b.eval_exact(v)) <= MEETING).then_some((u, v))
}

/// The parameter in `range` at which the curve comes nearest to `p`: the best of nine, then Gauss–Newton.
fn nearest(curve: &CubicBez, p: DVec2, [low, high]: [f64; 2]) -> f64 {
    let distance = |t: f64| curve.eval(t).distance_squared(p);
    let samples = (0..=8).map(|k| low + (high - low) * f64::from(k) / 8.0);
    let mut best = samples.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(low);
    for _ in 0..30 {
        let tangent = curve.tangent(best);
        let step = (p - curve.eval(best)).dot(tangent) / tangent.length_squared();
        let mut next = (best + step).clamp(low, high);
        while distance(next) > distance(best) && (next - best).abs() > 1e-15 {
            next = 0.5 * (next + best);
        }
        if next.is_nan() || (next - best).abs() <= 1e-15 {
            break;
        }
        best = next;
    }
    best
}

/// Closed loops of the edges. Where several leave a point, the sharpest turn to the left is taken, and a loop that
/// comes back to a point it has been through is cut off there.
fn stitch(edges: &[Part]) -> Result<Vec<Vec<Part>>, String> {
    let key = |p: DVec2| [p.x.to_bits(), p.y.to_bits()];
    let mut leaving: HashMap<[u64; 2], Vec<usize>> = HashMap::new();
    for (i, edge) in edges.iter().enumerate() {
        leaving.entry(key(edge.ends[0])).or_default().push(i);
    }
    let mut used = vec![false; edges.len()];
    let mut loops = Vec::new();
    for first in 0..edges.len() {
        if used[first] {
            continue;
        }
        let (mut walk, mut seen) = (Vec::new(), HashMap::from([(key(edges[first].ends[0]), 0)]));
        let mut edge = first;
        loop {
            used[edge] = true;
            walk.push(edge);
            let [start, at] = edges[edge].ends;
            if let Some(&since) = seen.get(&key(at)) {
                let closed: Vec<Part> = walk.drain(since..).map(|e| edges[e]).collect();
                closed.iter().for_each(|e| _ = seen.remove(&key(e.ends[0])));
                loops.push(closed);
                if walk.is_empty() {
                    break;
                }
            }
            seen.insert(key(at), walk.len());
            let back = start - at;
            // Clockwise from where it came, the first to leave bounds the same patch.
            let turn = |i: &usize| back.angle_to(edges[*i].ends[1] - at).rem_euclid(TAU);
            let choices = leaving.get(&key(at)).into_iter().flatten().copied().filter(|&i| !used[i]);
            edge = choices.max_by(|a, b| turn(a).total_cmp(&turn(b))).ok_or("its boundary is not closed")?;
        }
    }
    Ok(loops)
}
