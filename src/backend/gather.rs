//! The integral of one emission at one shading point, in f64 up to the map: what the CPU backend and the light
//! meter share.

use super::emitter::{Emitter, Geometry};
use super::exact::{ExactMap, exact_integral};
use crate::brdf::ltc::Lobe;
use crate::kernel::body::{FacingTube, facing_disc};
use crate::kernel::frame::ShadingFrame;
use crate::kernel::horizon::{Clip, Height, TrueHorizon};
use crate::kernel::map::CosineMap;
use crate::kernel::tree::{Budget, tree_integral};
use crate::light::simple::Facing;
use crate::light::tree::Tree;
use glam::{DVec2, DVec3};

/// Why an integral is zero without having been evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skip {
    /// The point is behind a one-sided light or in its plane.
    Behind,
    /// The light is wholly below a horizon.
    BelowHorizon,
}

/// An integral and what it cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// Normalised: 1 for a full hemisphere of the emitter's radiance. One value per channel where the emitter has colours
    /// of its own.
    pub value: DVec3,
    /// Tree nodes, edges or samples it is made of, as the technique has it.
    pub visited: u32,
}

/// The light's axes and origin in the shading frame.
#[derive(Clone, Copy, Debug)]
pub struct Images {
    /// Of the light-space x axis, y axis and origin.
    c: [DVec3; 3],
    /// Whether the point sees the light's back.
    back: bool,
    /// 1, or −1 for a face that hides a part of the faces before it.
    sign: f64,
}

impl Images {
    /// For a point relative to the camera. An emission that does not reach the point is skipped.
    pub fn new(emitter: &Emitter, frame: &ShadingFrame, position: DVec3) -> Result<Self, Skip> {
        let [x, y, origin] = facing_images(emitter, position).ok_or(Skip::Behind)?;
        let front = -x.cross(y).dot(origin);
        if front == 0.0 || (front < 0.0 && !emitter.two_sided) {
            return Err(Skip::Behind);
        }
        let hides = front < 0.0 && matches!(emitter.facing, Facing::End { .. });
        let sign = if hides { -1.0 } else { 1.0 };
        Ok(Self { c: [x, y, origin].map(|v| frame.to_local(v)), back: front < 0.0, sign })
    }

    /// The images given, of an emitter whose front the point sees.
    pub const fn in_cosine_space(c: [DVec3; 3]) -> Self {
        Self { c, back: false, sign: 1.0 }
    }

    /// The clamped-cosine integral over the light: of the plain cosine, or of a lobe clipped at its horizons.
    ///
    /// `budget` is that of the shading point: pass the same to all integrals that add up there. Only techniques with an
    /// error bound heed it and the tolerance.
    pub fn integral(
        &self,
        emitter: &Emitter,
        lobe: Option<&Lobe>,
        tolerance: f32,
        budget: &mut Budget,
    ) -> Result<Gathered, Skip> {
        let c = match lobe {
            Some(lobe) => {
                let m_inv = lobe.m_inv.mat3().as_dmat3();
                self.c.map(|v| m_inv * v)
            }
            None => self.c,
        };
        let gathered = match &emitter.geometry {
            Geometry::Tree(tree) => self.by_tree(c, tree, lobe, tolerance, budget)?,
            Geometry::Shape => self.exactly(c, emitter, lobe),
        };
        Ok(Gathered { value: gathered.value * self.sign, ..gathered })
    }

    fn by_tree(
        &self,
        c: [DVec3; 3],
        tree: &Tree,
        lobe: Option<&Lobe>,
        tolerance: f32,
        budget: &mut Budget,
    ) -> Result<Gathered, Skip> {
        let map = CosineMap::new(c, tree.center, tree.half).ok_or(Skip::Behind)?;
        let truth = lobe.map(|lobe| {
            let form = map.height_form(self.c.map(|v| v.z), tree.center, tree.half);
            TrueHorizon { axis: lobe.m_row_z, height: Height::new(&map, form) }
        });
        let root = &tree.nodes[0];
        let clip = Clip::new(&map, truth.as_ref(), root.center - map.foot, root.half).ok_or(Skip::BelowHorizon)?;
        let integral = tree_integral(&map, &clip, tree.view(), tolerance, budget);
        Ok(self.lit(integral.value, integral.visited))
    }

    /// A signed integral from the side the point is on.
    fn lit(&self, value: f32, visited: u32) -> Gathered {
        let value = if self.back { -value } else { value };
        Gathered { value: DVec3::splat(f64::from(value.max(0.0))), visited }
    }

    fn exactly(&self, c: [DVec3; 3], emitter: &Emitter, lobe: Option<&Lobe>) -> Gathered {
        // A horizon that is z = 0 itself must not clip twice.
        let horizon = lobe.map(|lobe| lobe.m_row_z.as_dvec3()).filter(|axis| axis.truncate() != DVec2::ZERO);
        let value = if self.back {
            let [x, y, origin] = c;
            exact_integral(&ExactMap { c: [-x, y, origin], horizon }, &emitter.from_behind())
        } else {
            exact_integral(&ExactMap { c, horizon }, &emitter.shape)
        };
        Gathered { value: DVec3::splat(value.max(0.0)), visited: 0 }
    }
}

/// The images of an emitter's light-space axes and origin, relative to the point, in world axes. `None` where the point is
/// inside the body or, for a tube's side, inside its infinite cylinder.
fn facing_images(emitter: &Emitter, position: DVec3) -> Option<[DVec3; 3]> {
    let p = &emitter.placement;
    let to_light = p.origin - position;
    let scale = p.x.length();
    let per_unit = |[x, y, origin]: [DVec3; 3], radius: f64| [x / radius, y / radius, origin];
    match emitter.facing {
        Facing::Fixed => Some([p.x, p.y, to_light]),
        Facing::Sphere { radius } => facing_disc(to_light, radius * scale).map(|c| per_unit(c, radius)),
        Facing::Side { radius } => {
            let tube = FacingTube::new(to_light, p.x / scale, radius * scale)?;
            let [x, y, origin] = tube.side();
            Some([x * scale, y / radius, origin])
        }
        Facing::End { radius, at } => {
            let tube = FacingTube::new(to_light, p.x / scale, radius * scale)?;
            let [x, y, origin] = tube.end(at * scale);
            // The shape lies half its height below the half-disc.
            Some(per_unit([x, y, origin + y * 0.5], radius))
        }
    }
}
