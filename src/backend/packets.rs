//! The integral of one emission at a packet of shading points, from the set-up in f64 on: what [`super::gather`] does at one, to
//! the bit.

use super::emitter::{Emitter, Geometry, Skip};
use super::gather::View;
use crate::brdf::ltc::{InverseMatrix, Lobe};
use crate::kernel::frame::ShadingFrame;
use crate::kernel::lanes::{Lanes, Mask, Real, Triple, Vector};
use crate::kernel::packet::{DoublePacket, MAX_LANES, Packet, PacketMask, Processor, Simd, Task};
use crate::kernel::tree::{Budget, tree_integral};
use crate::light::simple::Facing;
use crate::light::tree::Tree;
use glam::DVec3;

/// Shading points, a lane each.
#[derive(Clone, Debug)]
pub struct PointPacket {
    /// How many there are.
    count: usize,
    /// Relative to the camera.
    position: [[f64; MAX_LANES]; 3],
    /// The axes of the shading frames.
    frame: [[[f64; MAX_LANES]; 3]; 3],
    /// The entries of M⁻¹ of their specular lobes, as [`InverseMatrix`] has them.
    m_inv: [[f64; MAX_LANES]; 5],
    /// The third rows of M.
    row_z: [[f32; MAX_LANES]; 3],
    /// What their tolerances still allow.
    left: [f32; MAX_LANES],
}

/// What is asked of an emission at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// The emission; see [`tree_of`].
    pub emitter: &'a Emitter,
    /// Its tree.
    pub tree: &'a Tree,
    /// Whether of the specular lobe; else of the plain cosine.
    pub specular: bool,
    /// Bits of the lanes that ask.
    pub asking: u32,
    /// Error allowed for each lane, in integrals.
    pub tolerance: [f32; MAX_LANES],
    /// Whether a horizon may cut the light.
    pub may_be_cut: bool,
}

/// What became of it.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// The integrals of the lanes that have one.
    pub value: [f32; MAX_LANES],
    /// Nodes visited for them.
    pub visited: [u32; MAX_LANES],
    /// Bits of the lanes with an integral.
    pub integrated: u32,
    /// Bits of the lanes that are behind the light, whether they ask or not.
    pub behind: u32,
    /// Bits of the lanes where the light is below a horizon.
    pub below: u32,
    /// Bits of the lanes that must ask alone: the light is too close for f32.
    pub alone: u32,
}

/// The tree of an emission that packets can ask; others are asked point by point.
pub fn tree_of(emitter: &Emitter) -> Option<&Tree> {
    match &emitter.geometry {
        Geometry::Tree(tree) if emitter.facing == Facing::Fixed && emitter.colors.is_none() => Some(tree),
        _ => None,
    }
}

impl Default for PointPacket {
    fn default() -> Self {
        Self {
            count: 0,
            position: [[0.0; MAX_LANES]; 3],
            frame: [[[0.0; MAX_LANES]; 3]; 3],
            m_inv: [[0.0; MAX_LANES]; 5],
            row_z: [[0.0; MAX_LANES]; 3],
            left: [1.0; MAX_LANES],
        }
    }
}

impl PointPacket {
    /// How many points there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Leaves no point.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a point with a fresh budget. There must be room: [`Processor::lanes`].
    pub fn push(&mut self, position: DVec3, frame: &ShadingFrame, lobe: &Lobe) {
        let lane = self.count;
        self.count += 1;
        let axes = [frame.x, frame.y, frame.z];
        for axis in 0..3 {
            self.position[axis][lane] = position[axis];
            self.row_z[axis][lane] = lobe.m_row_z[axis];
            for (row, vector) in self.frame.iter_mut().zip(axes) {
                row[axis][lane] = vector[axis];
            }
        }
        let InverseMatrix { xx, xz, yy, zx, zz } = lobe.m_inv.widen();
        for (entry, value) in self.m_inv.iter_mut().zip([xx, xz, yy, zx, zz]) {
            entry[lane] = value;
        }
        self.set_budget(lane, Budget::default());
    }

    /// What the tolerance of a lane still allows.
    pub fn budget(&self, lane: usize) -> Budget {
        Budget { left: self.left[lane] }
    }

    /// What it allows from now on.
    pub fn set_budget(&mut self, lane: usize, Budget { left }: Budget) {
        self.left[lane] = left;
    }

    /// Asks.
    pub fn ask(&mut self, processor: Processor, question: &Question<'_>) -> Answer {
        processor.run(Asking { points: self, question })
    }
}

struct Asking<'a> {
    points: &'a mut PointPacket,
    question: &'a Question<'a>,
}

impl Task for Asking<'_> {
    type Output = Answer;

    #[inline(always)]
    fn run<S: Simd>(self, like: Packet<S>) -> Answer {
        let Self { points, question: &Question { emitter, tree, specular, asking, ref tolerance, may_be_cut } } = self;
        let everywhere = |v: DVec3| -> Triple<DoublePacket<S>> {
            Vector::of(DoublePacket::all(like, v.x), DoublePacket::all(like, v.y), DoublePacket::all(like, v.z))
        };
        let load = |[x, y, z]: &[[f64; MAX_LANES]; 3]| -> Triple<DoublePacket<S>> {
            Vector::of(DoublePacket::load(like, x), DoublePacket::load(like, y), DoublePacket::load(like, z))
        };
        let placement = &emitter.placement;
        let to_light = everywhere(placement.origin) - load(&points.position);
        let front = -everywhere(placement.x.cross(placement.y)).dot(to_light);
        let back = (-front).is_positive();
        let faces = if emitter.two_sided { front.is_positive() | back } else { front.is_positive() };
        let present = PacketMask::load(like, (1_u32 << points.count) - 1);
        let asking = PacketMask::load(like, asking) & present & faces;
        let mut answer = Answer {
            value: [0.0; MAX_LANES],
            visited: [0; MAX_LANES],
            integrated: 0,
            behind: (present & !faces).bits(),
            below: 0,
            alone: 0,
        };
        if !asking.any() {
            return answer;
        }
        let [x, y, z] = &points.frame;
        let frame = ShadingFrame { x: load(x), y: load(y), z: load(z), cos_theta: front };
        let (x, y) = (frame.to_local(everywhere(placement.x)), frame.to_local(everywhere(placement.y)));
        let images = [x, y, frame.to_local(to_light)];
        let lobe = if specular {
            let [xx, xz, yy, zx, zz] = &points.m_inv;
            let entry = |values: &[f64; MAX_LANES]| DoublePacket::load(like, values);
            let [x, y, z] = &points.row_z;
            let m_inv = InverseMatrix { xx: entry(xx), xz: entry(xz), yy: entry(yy), zx: entry(zx), zz: entry(zz) };
            Some((m_inv, Vector::of(like.load(x), like.load(y), like.load(z))))
        } else {
            None
        };
        let root = &tree.nodes[0];
        let bounds = [root.center, root.half];
        let view = View::new::<DoublePacket<S>>(images, emitter.square, lobe, bounds, may_be_cut);
        // The side that the map is on, whose sign is exact: the images have been rounded since the side was asked first.
        let back = (-view.map.depth).is_positive();
        let turned = asking & back & like.mask(!emitter.two_sided);
        answer.behind |= (turned | (asking & !view.is_map)).bits();
        let asking = asking & !turned;
        let seen = asking & view.is_map & !view.clipped.below;
        let close = view.map.is_close();
        let far = seen & !close;
        answer.below = (asking & view.is_map & view.clipped.below).bits();
        answer.alone = (seen & close).bits();
        answer.integrated = far.bits();
        if far.any() {
            let tolerance = like.load(tolerance);
            let mut budget = Budget { left: like.load(&points.left) };
            let clip = &view.clipped.clip;
            let integral = tree_integral(&view.map, clip, tree.view(), tolerance, &mut budget, far);
            let value = Packet::select(back, -integral.value, integral.value);
            value.between(0.0, 1.0).store(&mut answer.value);
            integral.visited.store(&mut answer.visited);
            budget.left.store(&mut points.left);
        }
        answer
    }
}

impl Answer {
    /// What became of one lane that asked.
    pub fn lane(&self, lane: usize) -> Outcome {
        let is = |bits: u32| bits >> lane & 1 == 1;
        match () {
            () if is(self.integrated) => Outcome::Integral(self.value[lane], self.visited[lane]),
            () if is(self.below) => Outcome::Skipped(Skip::BelowHorizon),
            () if is(self.alone) => Outcome::Alone,
            () => Outcome::Skipped(Skip::Behind),
        }
    }
}

/// What became of a question at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// The integral, and the nodes visited for it.
    Integral(f32, u32),
    /// It is nothing.
    Skipped(Skip),
    /// The point must ask alone.
    Alone,
}
