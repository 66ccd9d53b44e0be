//! Builds the chord–moment tree of a shape, in f64. The walk over it is [`crate::kernel::tree`].

use super::Square;
use crate::kernel::tree::{CLUSTER, CUBIC, Handles, LINK_MASK, LowEnds, Node, Nodes, RUN, SEGMENT, areas};
use crate::shape::{Bounds, CubicBez, Shape};
use glam::{DVec2, Vec2};

/// A leaf's curve turns by no more than this (cosine of the angle), so that it is a simple arc.
const TURN_COS: f64 = 0.8;
/// Halvings of one curve at build time.
const SPLITS: u32 = 6;
/// Handles nearer the chord than this (in chords, and in tree space) make a straight edge.
const STRAIGHT: [f64; 2] = [1e-14, 4e-16];

/// Ratio of the unsigned area by scan lines to |m0| above which contours overlap or cross themselves.
const SOUND: f64 = 1.1;

/// The eight Gauss–Legendre nodes, by pairs ±x, and their weights.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// The tree of one shape.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Light-space point at the middle of tree space.
    pub center: DVec2,
    /// Light-space half-width of the tree's square \[−1, 1\]², metres.
    pub half: f64,
    /// Nodes in pre-order.
    pub nodes: Vec<Node>,
    /// What f32 lost of the nodes' chord ends, one for each node.
    pub low: Vec<LowEnds>,
    /// Handles of the cubic leaves.
    pub handles: Vec<Handles>,
}

/// Why a shape has no tree.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum TreeError {
    /// The shape is empty, a point or a line.
    #[error("the shape has no area")]
    NoArea,
    /// Too many nodes for a link.
    #[error("the shape has {0} nodes; the limit is {LINK_MASK}")]
    TooManyNodes(usize),
}

impl Tree {
    /// Builds the tree of `shape`. Contours are taken as they are: oriented, each contributing its signed area.
    pub fn new(shape: &Shape) -> Result<Self, TreeError> {
        Self::within(Square::around(shape.bounds()).ok_or(TreeError::NoArea)?, shape)
    }

    /// Builds the tree of a shape inside a square larger than its own.
    pub fn within(Square { center, half }: Square, shape: &Shape) -> Result<Self, TreeError> {
        let to_tree = |p: DVec2| (p - center) / half;
        let mut contours = Vec::new();
        for contour in shape.contours() {
            let curves = contour.curves().iter().map(|c| {
                let [p0, p1, p2, p3] = c.points().map(to_tree);
                CubicBez::new(p0, p1, p2, p3)
            });
            let mut arcs = Vec::new();
            curves.for_each(|c| split_to_arcs(c, SPLITS, &mut arcs));
            if !arcs.is_empty() {
                contours.push(Run::closed(arcs));
            }
        }
        let groups = group_by_outer(contours);
        if groups.is_empty() {
            return Err(TreeError::NoArea);
        }
        let mut tree = Self { center, half, nodes: Vec::new(), low: Vec::new(), handles: Vec::new() };
        tree.emit_clusters(groups);
        if tree.nodes.len() > LINK_MASK as usize {
            return Err(TreeError::TooManyNodes(tree.nodes.len()));
        }
        Ok(tree)
    }

    /// What the walk reads.
    pub fn view(&self) -> Nodes<'_> {
        Nodes { nodes: &self.nodes, low: &self.low, handles: &self.handles }
    }

    /// Size of the arrays in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.low.as_slice()) + size_of_val(self.handles.as_slice())
    }

    /// Makes room for a node, to be filled when its children are there.
    fn reserve(&mut self) -> usize {
        self.nodes.push(bytemuck::Zeroable::zeroed());
        self.low.push(LowEnds::default());
        self.nodes.len() - 1
    }

    fn fill(&mut self, at: usize, part: &Part, [a, b]: [DVec2; 2], link: u32) {
        self.nodes[at] = node(part, [a, b], link);
        self.low[at] = LowEnds { a: lost(a), b: lost(b) };
    }

    fn emit_clusters(&mut self, mut groups: Vec<Group>) -> Part {
        if groups.len() == 1 {
            let Group { contours, .. } = groups.remove(0);
            return self.emit_group(contours);
        }
        let all = groups.iter().map(|g| g.bounds).fold(Bounds::EMPTY, Bounds::union);
        let size = all.size();
        // Halve by number along the longer side: text is a line, and its words are near each other.
        let key = |g: &Group| if size.x >= size.y { g.bounds.center().x } else { g.bounds.center().y };
        groups.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let rest = groups.split_off(groups.len() / 2);
        let at = self.reserve();
        let part = self.emit_clusters(groups).plus(self.emit_clusters(rest));
        self.close_cluster(at, part)
    }

    fn emit_group(&mut self, mut contours: Vec<Run>) -> Part {
        let arcs: Vec<CubicBez> = contours.iter().flat_map(|r| &r.arcs).copied().collect();
        let unsigned = unsigned_area(&contours, Bounds::of(arcs.iter().flat_map(CubicBez::points)));
        let at = self.reserve();
        let [left, right] = if contours.len() == 1 {
            let [first, second] = contours.remove(0).halves();
            [self.emit_run(first), self.emit_run(second)]
        } else {
            let rest = contours.split_off(contours.len() / 2);
            [self.emit_group(contours), self.emit_group(rest)]
        };
        let mut part = left.plus(right);
        // A region of winding 0 or 1 has the unsigned area |m0|, not the sum of its parts'. Where contours overlap or
        // cross themselves it is what the scan lines say.
        let m0 = part.region.m0.abs();
        part.sound = unsigned <= SOUND * m0;
        part.region.area = if part.sound { m0 } else { SOUND * unsigned };
        part.loops = vec![arcs];
        self.close_cluster(at, part)
    }

    /// Fills in a node without a chord, whose children are all there.
    fn close_cluster(&mut self, at: usize, part: Part) -> Part {
        self.fill(at, &part, [DVec2::ZERO; 2], CLUSTER | self.nodes.len() as u32);
        part
    }

    fn emit_run(&mut self, run: Run) -> Part {
        let (a, b) = run.ends();
        let at = self.reserve();
        if let [arc] = run.arcs[..] {
            let region = Region::under_arc(&arc);
            let part = Part {
                region,
                bounds: Bounds::of(arc.points()),
                loops: vec![vec![arc, CubicBez::line(arc.p3, arc.p0)]],
                sound: region.area == region.m0.abs(),
            };
            let link = if is_straight(&arc) {
                SEGMENT
            } else {
                let [p1, p2] = [arc.p1, arc.p2];
                let handles = Handles { p1: p1.as_vec2(), p2: p2.as_vec2(), low1: lost(p1), low2: lost(p2) };
                self.handles.push(handles);
                CUBIC | (self.handles.len() - 1) as u32
            };
            self.fill(at, &part, [a, b], link);
            return part;
        }
        let [first, second] = run.halves();
        let middle = first.ends().1;
        let mut part = self.emit_run(first).plus(self.emit_run(second));
        part.region = part.region.plus(Region::of_triangle(a, middle, b));
        part.loops.push(vec![CubicBez::line(a, middle), CubicBez::line(middle, b), CubicBez::line(b, a)]);
        self.fill(at, &part, [a, b], RUN | self.nodes.len() as u32);
        part
    }
}

/// What a node stands for.
struct Part {
    region: Region,
    bounds: Bounds,
    /// Closed curves round pieces of the region, each of one sign, whose sum it is.
    loops: Vec<Vec<CubicBez>>,
    /// Whether they are of one sign indeed.
    sound: bool,
}

impl Part {
    fn plus(mut self, mut other: Self) -> Self {
        self.loops.append(&mut other.loops);
        Self {
            region: self.region.plus(other.region),
            bounds: self.bounds.union(other.bounds),
            loops: self.loops,
            sound: self.sound && other.sound,
        }
    }

    /// ∫ρ⁴|dA| about the middle of a box, ρ the larger of |x| and |y| in its half-extents: 1/6 ∮ρ⁴ q × dq, since ρ⁴ is
    /// homogeneous. Never more than the area.
    fn area_4(&self, center: DVec2, half: DVec2) -> f64 {
        /// ρ⁴ is not smooth where |x| = |y|: what quadrature may lose there.
        const MARGIN: f64 = 1.02;
        if !self.sound {
            return self.region.area;
        }
        let along = |edge: &CubicBez| {
            let [p0, p1, p2, p3] = edge.points().map(|p| (p - center) / half);
            let local = CubicBez::new(p0, p1, p2, p3);
            let at = |t: f64| {
                let p = local.eval(t);
                p.abs().max_element().powi(4) * p.perp_dot(local.tangent(t))
            };
            GAUSS.iter().map(|(x, w)| 0.5 * w * (at(0.5 - 0.5 * x) + at(0.5 + 0.5 * x))).sum::<f64>()
        };
        let around = |edges: &Vec<CubicBez>| edges.iter().map(along).sum::<f64>().abs();
        let sum: f64 = self.loops.iter().map(around).sum();
        (MARGIN / 6.0 * half.element_product() * sum).min(self.region.area)
    }
}

/// Consecutive arcs of one contour.
struct Run {
    arcs: Vec<CubicBez>,
}

impl Run {
    /// A whole contour, begun at a far end so that its first two runs are its long sides.
    fn closed(mut arcs: Vec<CubicBez>) -> Self {
        let start = arcs[0].p0;
        let far = |from: DVec2| {
            let d = |c: &CubicBez| c.p0.distance_squared(from);
            (0..arcs.len()).max_by(|&i, &j| d(&arcs[i]).total_cmp(&d(&arcs[j]))).unwrap_or(0)
        };
        let first = far(start);
        arcs.rotate_left(first);
        Self { arcs }
    }

    fn ends(&self) -> (DVec2, DVec2) {
        (self.arcs[0].p0, self.arcs[self.arcs.len() - 1].p3)
    }

    /// Two runs of at least one arc. A lone arc is halved at its middle.
    fn halves(mut self) -> [Self; 2] {
        if let [arc] = self.arcs[..] {
            return halved(arc).map(|c| Self { arcs: vec![c] });
        }
        let (a, b) = self.ends();
        let n = self.arcs.len();
        // The joint farthest from the chord, as in Ramer–Douglas–Peucker, kept off the ends so that depth stays
        // logarithmic.
        let lo = (n / 4).max(1);
        let hi = (n - n / 4).min(n - 1).max(lo);
        let chord = (b - a).normalize_or_zero();
        let off = |i: usize| {
            let d = self.arcs[i].p0 - a;
            let along = d.dot(chord);
            (d - chord * along).length_squared() + (along - along.clamp(0.0, (b - a).length())).powi(2)
        };
        let at = (lo..=hi).max_by(|&i, &j| off(i).total_cmp(&off(j))).unwrap_or(n / 2);
        let rest = self.arcs.split_off(at);
        [self, Self { arcs: rest }]
    }
}

/// An outer contour with its holes.
struct Group {
    bounds: Bounds,
    contours: Vec<Run>,
}

/// Puts each hole with the smallest outer contour round it: together they are a region of winding 0 or 1.
fn group_by_outer(contours: Vec<Run>) -> Vec<Group> {
    let area = |r: &Run| r.arcs.iter().map(CubicBez::signed_area).sum::<f64>();
    let bounds = |r: &Run| Bounds::of(r.arcs.iter().flat_map(|c| c.points()));
    let (outers, holes): (Vec<_>, Vec<_>) = contours.into_iter().partition(|r| area(r) >= 0.0);
    let mut groups: Vec<_> = outers.into_iter().map(|r| Group { bounds: bounds(&r), contours: vec![r] }).collect();
    let outers = groups.len();
    for hole in holes {
        let inner = bounds(&hole);
        let point = hole.arcs[0].eval(0.5);
        let holds = |g: &Group| g.bounds.overlaps(inner) && winding(&g.contours[..1], point) != 0;
        let extent = |g: &Group| area(&g.contours[0]);
        let home = (0..outers)
            .filter(|&i| holds(&groups[i]))
            .min_by(|&i, &j| extent(&groups[i]).total_cmp(&extent(&groups[j])));
        match home {
            Some(i) => groups[i].contours.push(hole),
            None => groups.push(Group { bounds: inner, contours: vec![hole] }),
        }
    }
    groups
}

/// How often the contours wind round a point.
fn winding(contours: &[Run], point: DVec2) -> i32 {
    let mut winding = 0;
    for arc in contours.iter().flat_map(|r| &r.arcs) {
        arc.crossings(point.y, |x, direction| winding += if x > point.x { direction } else { 0 });
    }
    winding
}

/// ∫|winding number| dA by scan lines: what the region weighs where contours overlap, cross themselves or lie in
/// no outer. For sound contours it is |m0| to a few percent.
fn unsigned_area(contours: &[Run], bounds: Bounds) -> f64 {
    const LINES: u32 = 48;
    let step = bounds.size().y / f64::from(LINES);
    let mut area = 0.0;
    let mut crossings = Vec::new();
    for line in 0..LINES {
        let y = bounds.min.y + (f64::from(line) + 0.5) * step;
        crossings.clear();
        for arc in contours.iter().flat_map(|r| &r.arcs) {
            arc.crossings(y, |x, direction| crossings.push((x, direction)));
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            area += f64::from(winding.abs()) * (pair[1].0 - pair[0].0) * step;
        }
    }
    area
}

/// Whether a curve is its chord, as far as can be told of a light that may have contours of very different sizes.
fn is_straight(curve: &CubicBez) -> bool {
    let [of_chord, at_least] = STRAIGHT;
    curve.is_line(of_chord * curve.p0.distance(curve.p3) + at_least)
}

/// The two halves of a curve, sharing their joint to the bit.
fn halved(curve: CubicBez) -> [CubicBez; 2] {
    let [first, mut second] = [curve.subsegment(0.0, 0.5), curve.subsegment(0.5, 1.0)];
    second.p0 = first.p3;
    [first, second]
}

/// What rounding to f32 takes from a point.
fn lost(p: DVec2) -> DVec2 {
    p - p.as_vec2().as_dvec2()
}

/// Halves a curve until each part turns little; drops parts that are a point.
fn split_to_arcs(curve: CubicBez, depth: u32, out: &mut Vec<CubicBez>) {
    let [p0, p1, p2, p3] = curve.points();
    if p0 == p3 && p1 == p0 && p2 == p0 {
        return;
    }
    if is_straight(&curve) {
        if p0 != p3 {
            out.push(curve);
        }
        return;
    }
    let legs = [p1 - p0, p2 - p1, p3 - p2, p3 - p0];
    let simple = |a: DVec2, b: DVec2| a.dot(b) >= TURN_COS * a.length() * b.length();
    let turns = [legs[0].perp_dot(legs[1]), legs[1].perp_dot(legs[2]), legs[0].perp_dot(legs[2])];
    let one_way = turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0);
    let arc = one_way && simple(legs[0], legs[2]) && simple(legs[0], legs[1]) && simple(legs[1], legs[2]);
    if depth == 0 || arc {
        out.push(curve);
        return;
    }
    for c in halved(curve) {
        split_to_arcs(c, depth - 1, out);
    }
}

/// Signed moments of a region of tree space about the point `about`.
#[derive(Clone, Copy, Debug, Default)]
struct Region {
    about: DVec2,
    m0: f64,
    m1: DVec2,
    /// xx, xy, yy.
    m2: [f64; 3],
    /// xxx, xxy, xyy, yyy.
    m3: [f64; 4],
    area: f64,
}

impl Region {
    /// The moments about another point.
    fn about(self, point: DVec2) -> Self {
        let d = self.about - point;
        Self {
            about: point,
            m0: self.m0,
            m1: self.m1 + d * self.m0,
            m2: [
                self.m2[0] + 2.0 * d.x * self.m1.x + d.x * d.x * self.m0,
                self.m2[1] + d.x * self.m1.y + d.y * self.m1.x + d.x * d.y * self.m0,
                self.m2[2] + 2.0 * d.y * self.m1.y + d.y * d.y * self.m0,
            ],
            m3: {
                let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.m2, self.m3);
                let (m0, m1) = (self.m0, self.m1);
                [
                    xxx + 3.0 * d.x * xx + 3.0 * d.x * d.x * m1.x + d.x * d.x * d.x * m0,
                    xxy + d.y * xx + 2.0 * d.x * xy + d.x * d.x * m1.y + 2.0 * d.x * d.y * m1.x + d.x * d.x * d.y * m0,
                    xyy + d.x * yy + 2.0 * d.y * xy + d.y * d.y * m1.x + 2.0 * d.x * d.y * m1.y + d.x * d.y * d.y * m0,
                    yyy + 3.0 * d.y * yy + 3.0 * d.y * d.y * m1.y + d.y * d.y * d.y * m0,
                ]
            },
            area: self.area,
        }
    }

    fn plus(self, other: Self) -> Self {
        let o = other.about(self.about);
        Self {
            about: self.about,
            m0: self.m0 + o.m0,
            m1: self.m1 + o.m1,
            m2: core::array::from_fn(|i| self.m2[i] + o.m2[i]),
            m3: core::array::from_fn(|i| self.m3[i] + o.m3[i]),
            area: self.area + o.area,
        }
    }

    fn of_triangle(a: DVec2, b: DVec2, c: DVec2) -> Self {
        let about = (a + b + c) / 3.0;
        let m0 = 0.5 * (b - a).perp_dot(c - a);
        // Second moments of a triangle about its centroid: area/12 times the sum over the corners.
        let v = [a - about, b - about, c - about];
        let sum = |f: fn(DVec2) -> f64| v.into_iter().map(f).sum::<f64>() * m0 / 12.0;
        let m2 = [sum(|p| p.x * p.x), sum(|p| p.x * p.y), sum(|p| p.y * p.y)];
        let cubes = |f: fn(DVec2) -> f64| v.into_iter().map(f).sum::<f64>() * m0 / 30.0;
        let m3 = [
            cubes(|p| p.x * p.x * p.x),
            cubes(|p| p.x * p.x * p.y),
            cubes(|p| p.x * p.y * p.y),
            cubes(|p| p.y * p.y * p.y),
        ];
        Self { about, m0, m1: DVec2::ZERO, m2, m3, area: m0.abs() }
    }

    /// The region between an arc and its chord, by Green's theorem. The integrands are polynomials of degree at
    /// most 11 in t; eight Gauss nodes are exact to degree 15.
    fn under_arc(arc: &CubicBez) -> Self {
        let about = (arc.p0 + arc.p3) * 0.5;
        let [p0, p1, p2, p3] = arc.points().map(|p| p - about);
        let local = CubicBez::new(p0, p1, p2, p3);
        let mut region = Self { about, ..Self::default() };
        let mut add = |p: DVec2, d: DVec2, w: f64| {
            region.m0 += w * 0.5 * p.perp_dot(d);
            region.m1.x += w * 0.5 * p.x * p.x * d.y;
            region.m1.y -= w * 0.5 * p.y * p.y * d.x;
            region.m2[0] += w * p.x * p.x * p.x * d.y / 3.0;
            region.m2[1] += w * 0.25 * (p.x * p.x * p.y * d.y - p.x * p.y * p.y * d.x);
            region.m2[2] -= w * p.y * p.y * p.y * d.x / 3.0;
            let turn = w * 0.2 * p.perp_dot(d);
            let cubes = [p.x * p.x * p.x, p.x * p.x * p.y, p.x * p.y * p.y, p.y * p.y * p.y];
            for (m3, cube) in region.m3.iter_mut().zip(cubes) {
                *m3 += turn * cube;
            }
        };
        for (x, w) in GAUSS {
            for t in [0.5 - 0.5 * x, 0.5 + 0.5 * x] {
                add(local.eval(t), local.tangent(t), 0.5 * w);
                add(p3.lerp(p0, t), p0 - p3, 0.5 * w);
            }
        }
        // A simple arc lies on one side of its chord; where the splitting stopped short of one, take the hull's area.
        let legs = [p1 - p0, p2 - p1, p3 - p2];
        let turns = [legs[0].perp_dot(legs[1]), legs[1].perp_dot(legs[2]), legs[0].perp_dot(legs[2])];
        let one_way = turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0);
        let hull = Bounds::of([p0, p1, p2, p3]).size().element_product();
        region.area = if one_way { region.m0.abs() } else { hull.max(region.m0.abs()) };
        region
    }
}

fn node(part: &Part, ends: [DVec2; 2], link: u32) -> Node {
    let Part { region, bounds, .. } = part;
    // The stored box is in f32: it is grown to hold what it held in f64.
    let center = bounds.center().as_vec2();
    let reach = (bounds.max - center.as_dvec2()).max(center.as_dvec2() - bounds.min);
    let half = (reach.as_vec2() * (1.0 + 2.0 * f32::EPSILON)).max(Vec2::splat(f32::MIN_POSITIVE));
    let r = region.about(center.as_dvec2());
    let unit = f64::from(half.max_element());
    Node {
        center,
        half,
        a: ends[0].as_vec2(),
        b: ends[1].as_vec2(),
        m0: r.m0 as f32,
        m1: [r.m1.x, r.m1.y].map(|m| (m / unit) as f32),
        m2: r.m2.map(|m| (m / unit.powi(2)) as f32),
        m3: r.m3.map(|m| (m / unit.powi(3)) as f32),
        areas: areas(r.area as f32, part.area_4(center.as_dvec2(), half.as_dvec2()) as f32),
        link,
    }
}
