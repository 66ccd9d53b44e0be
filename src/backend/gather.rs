//! The integral of one emission at one shading point, in f64 up to the map: what the CPU backend and the light
//! meter share.

use super::emitter::{Emitter, Geometry};
use super::exact::{ExactMap, exact_integral};
use crate::brdf::ltc::Lobe;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::horizon::{Clip, Height, TrueHorizon};
use crate::kernel::map::CosineMap;
use crate::kernel::pal::{pal_diffuse, pal_specular};
use crate::kernel::representative::{Body, Solid};
use crate::kernel::tree::{Budget, tree_integral};
use crate::light::Square;
use crate::light::distance::Polygons;
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
}

impl Images {
    /// For a point relative to the camera. An emission that does not reach the point is skipped.
    pub fn new(emitter: &Emitter, frame: &ShadingFrame, position: DVec3) -> Result<Self, Skip> {
        let p = &emitter.placement;
        let to_light = p.origin - position;
        let front = -p.normal().dot(to_light);
        if !emitter.is_round() && (front == 0.0 || (front < 0.0 && !emitter.two_sided)) {
            return Err(Skip::Behind);
        }
        Ok(Self { c: [frame.to_local(p.x), frame.to_local(p.y), frame.to_local(to_light)], back: front < 0.0 })
    }

    /// The images given, of an emitter whose front the point sees.
    pub const fn in_cosine_space(c: [DVec3; 3]) -> Self {
        Self { c, back: false }
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
        match &emitter.geometry {
            Geometry::Tree(tree) => self.by_tree(c, tree, lobe, tolerance, budget),
            Geometry::Shape => Ok(self.exactly(c, emitter, lobe)),
            Geometry::Polygons(polygons, basis) => self.by_polygons(emitter.square, polygons, *basis, lobe),
            Geometry::Solid(solid) => Ok(self.by_representative(emitter.square, solid, lobe)),
        }
    }

    /// By projected areas, or the distance from where the mirror ray goes.
    fn by_polygons(
        &self,
        square: Square,
        polygons: &Polygons,
        basis: u32,
        lobe: Option<&Lobe>,
    ) -> Result<Gathered, Skip> {
        let map = CosineMap::new(self.c, square.center, square.half).ok_or(Skip::Behind)?;
        let integral = match lobe {
            Some(lobe) => pal_specular(&map, polygons.view(), lobe.alpha, lobe.cos_theta),
            None => pal_diffuse(&map, polygons.view(), basis),
        };
        Ok(Gathered { value: DVec3::splat(f64::from(integral.value)), visited: integral.visited })
    }

    /// By one direction that stands for the light.
    fn by_representative(&self, square: Square, solid: &Solid, lobe: Option<&Lobe>) -> Gathered {
        let [x, y, origin] = self.c;
        let center = origin + x * square.center.x + y * square.center.y;
        let (x, y) = (x * square.half, y * square.half);
        let unit = 1.0 / center.abs().max(x.abs()).max(y.abs()).max_element();
        let body = Body::new(solid, (center * unit).as_vec3(), (x * unit).as_vec3(), (y * unit).as_vec3());
        let value = match lobe {
            Some(lobe) => body.specular(lobe.alpha, lobe.cos_theta, lobe.magnitude),
            None => body.diffuse(),
        };
        Gathered { value: DVec3::splat(f64::from(value * solid.coverage)), visited: 1 }
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
