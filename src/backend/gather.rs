//! The integral of one emission at one shading point, in f64 up to the map: what the CPU backend and the light
//! meter share.

use super::emitter::{Emitter, Geometry, Skip};
use super::exact::{ExactMap, exact_integral};
use super::reference;
use super::reference::lights::Light;
use crate::brdf::ltc::{InverseMatrix, Lobe};
use crate::kernel::body::{FacingTube, facing_disc};
use crate::kernel::curve::EdgeSum;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::horizon::{Clip, Clipped, Height, Horizon, TrueHorizon};
use crate::kernel::lanes::{Doubles, Lanes, Vector};
use crate::kernel::map::{CosineMap, PlanePoint};
use crate::kernel::mosaic::mosaic_integral;
use crate::kernel::pal::{pal_diffuse, pal_specular};
use crate::kernel::picture::{Footprint, fetch};
use crate::kernel::polygon::uniform_integral;
use crate::kernel::quad::{QUAD_EDGES, Quad, quad_integral};
use crate::kernel::representative::{Body, Solid};
use crate::kernel::subdivide::{default_eps, kuge_integral};
use crate::kernel::tree::{Budget, tree_integral, wide_integral};
use crate::kernel::wide::{Wide, Wide3};
use crate::light::Square;
use crate::light::distance::Polygons;
use crate::light::mosaic::Mosaic;
use crate::light::simple::Facing;
use crate::light::tree::Tree;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// An integral and what it cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// Normalised: 1 for a full hemisphere of the emitter's radiance. One value per channel where the emitter has colours
    /// of its own.
    pub value: DVec3,
    /// Tree nodes, edges or samples it is made of, as the technique has it.
    pub visited: u32,
}

impl Gathered {
    /// In the colours that the point sees of the emitter.
    fn painted(self, emitter: &Emitter, map: &CosineMap) -> Self {
        let Some(colors) = &emitter.colors else { return self };
        let color = fetch(&colors.levels, &colors.texels, &Footprint::new(map));
        Self { value: self.value * color.as_dvec3(), ..self }
    }

    /// The same, by a technique without a map of its own to cosine space, where the light's images are `c`.
    fn painted_through(self, emitter: &Emitter, c: [DVec3; 3]) -> Self {
        if emitter.colors.is_none() {
            return self;
        }
        let map = CosineMap::new(c, emitter.square.center, emitter.square.half);
        map.map_or(self, |map| self.painted(emitter, &map))
    }
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
    /// Whether a horizon may cut the light.
    may_be_cut: bool,
}

impl Images {
    /// For a point relative to the camera. An emission that does not reach the point is skipped.
    pub fn new(emitter: &Emitter, frame: &ShadingFrame, position: DVec3) -> Result<Self, Skip> {
        let c = facing_images(emitter, position).ok_or(Skip::Behind)?;
        let front = -c[0].cross(c[1]).dot(c[2]);
        let whole = emitter.facing == Facing::Whole;
        if !whole && (front == 0.0 || (front < 0.0 && !emitter.two_sided)) {
            return Err(Skip::Behind);
        }
        let back = front < 0.0 && !whole;
        let hides = back && matches!(emitter.facing, Facing::End { .. });
        Ok(Self { c: c.map(|v| frame.to_local(v)), back, sign: if hides { -1.0 } else { 1.0 }, may_be_cut: true })
    }

    /// The images given, of an emitter whose front the point sees.
    pub const fn in_cosine_space(c: [DVec3; 3]) -> Self {
        Self { c, back: false, sign: 1.0, may_be_cut: true }
    }

    /// The images of a light that is known to be above every horizon.
    #[must_use]
    pub const fn uncut(self) -> Self {
        Self { may_be_cut: false, ..self }
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
        let c = || self.in_lobe(lobe);
        let gathered = match &emitter.geometry {
            Geometry::Tree(tree) => self.by_tree(emitter, tree, lobe, tolerance, budget)?,
            Geometry::Quad(quad) => self.by_quad(c(), emitter, quad)?,
            Geometry::Mosaic(mosaic) => self.by_mosaic(mosaic, emitter, lobe, tolerance, budget)?,
            Geometry::Shape => self.exactly(c(), emitter, lobe),
            Geometry::Polygons(polygons, basis) => self.by_polygons(c(), emitter, polygons, *basis, lobe)?,
            Geometry::Solid(solid) => self.by_representative(c(), emitter, solid, lobe),
            Geometry::Kuge { curves, eps } => {
                let eps = eps.unwrap_or_else(|| default_eps(lobe.map(|lobe| lobe.alpha)));
                self.by_edges(c(), emitter, |map, horizon| kuge_integral(map, horizon, curves, eps))?
            }
            Geometry::Uniform { curves, segments } => {
                self.by_edges(c(), emitter, |map, horizon| uniform_integral(map, horizon, curves, *segments))?
            }
            Geometry::Sampled { sampling, .. } => {
                let (value, visited) =
                    reference::integral(&Light::new(emitter).with_radiance(DVec3::ONE), sampling, self.c, lobe)?;
                Gathered { value, visited }
            }
        };
        Ok(Gathered { value: gathered.value * self.sign, ..gathered })
    }

    /// By projected areas, or the distance from where the mirror ray goes.
    fn by_polygons(
        &self,
        c: [DVec3; 3],
        emitter: &Emitter,
        polygons: &Polygons,
        basis: u32,
        lobe: Option<&Lobe>,
    ) -> Result<Gathered, Skip> {
        // What a tube's rim hides of its side is no light to be taken away from an approximate one.
        if self.sign < 0.0 {
            return Err(Skip::Behind);
        }
        let Square { center, half } = emitter.square;
        let map = CosineMap::new(self.c, center, half).ok_or(Skip::Behind)?;
        let integral = match lobe {
            Some(lobe) => pal_specular(&map, polygons.view(), lobe.alpha, lobe.cos_theta),
            None => pal_diffuse(&map, polygons.view(), basis),
        };
        let gathered = Gathered { value: DVec3::splat(f64::from(integral.value)), visited: integral.visited };
        Ok(gathered.painted_through(emitter, c))
    }

    /// By one direction that stands for the light.
    fn by_representative(&self, c: [DVec3; 3], emitter: &Emitter, solid: &Solid, lobe: Option<&Lobe>) -> Gathered {
        let Square { center, half } = emitter.square;
        let [x, y, origin] = self.c;
        let middle = origin + x * center.x + y * center.y;
        let (x, y) = (x * half, y * half);
        let unit = 1.0 / middle.abs().max(x.abs()).max(y.abs()).max_element();
        let body = Body::new(solid, (middle * unit).as_vec3(), (x * unit).as_vec3(), (y * unit).as_vec3());
        let value = match lobe {
            Some(lobe) => body.specular(lobe.alpha, lobe.cos_theta, lobe.magnitude),
            None => body.diffuse(),
        };
        let gathered = Gathered { value: DVec3::splat(f64::from(value * solid.coverage)), visited: 1 };
        gathered.painted_through(emitter, c)
    }

    /// The images in the cosine space of a lobe.
    fn in_lobe(&self, lobe: Option<&Lobe>) -> [DVec3; 3] {
        lobe.map_or(self.c, |lobe| self.c.map(|v| lobe.m_inv.widen().apply(v)))
    }

    fn by_tree(
        &self,
        emitter: &Emitter,
        tree: &Tree,
        lobe: Option<&Lobe>,
        tolerance: f32,
        budget: &mut Budget,
    ) -> Result<Gathered, Skip> {
        let root = &tree.nodes[0];
        let (map, clip) = self.clipped(emitter.square, lobe, [root.center, root.half])?;
        let seen = self.from_side(emitter, map.depth)?;
        let integral = if map.is_close() {
            let view = self.wide(emitter.square, lobe, [root.center, root.half]);
            if view.clipped.below {
                return Err(Skip::BelowHorizon);
            }
            wide_integral(&view.map, &view.clipped.clip, tree.view(), tolerance, budget)
        } else {
            tree_integral(&map, &clip, tree.view(), tolerance, budget)
        };
        Ok(seen.lit(integral.value, integral.visited).painted(emitter, &map))
    }

    /// The same from the side that the map is on, whose sign is exact: the images have been rounded since the side was asked first.
    fn from_side(&self, emitter: &Emitter, depth: f32) -> Result<Self, Skip> {
        let back = depth < 0.0;
        match () {
            () if back == self.back || emitter.facing == Facing::Whole => Ok(*self),
            () if emitter.two_sided => Ok(Self { back, ..*self }),
            () => Err(Skip::Behind),
        }
    }

    /// Clipped at z = 0 of cosine space only, as published.
    fn by_quad(&self, c: [DVec3; 3], emitter: &Emitter, quad: &Quad) -> Result<Gathered, Skip> {
        let map = CosineMap::new(c, emitter.square.center, emitter.square.half).ok_or(Skip::Behind)?;
        let clip = self.clip(&map, -map.foot, quad.half)?;
        Ok(self.lit(quad_integral(&map, &clip, quad), QUAD_EDGES).painted(emitter, &map))
    }

    /// By a technique that knows z = 0 only. The light is taken for its whole square where it is asked what clips it.
    fn by_edges(
        &self,
        c: [DVec3; 3],
        emitter: &Emitter,
        integrate: impl FnOnce(&CosineMap, Option<&Horizon>) -> EdgeSum,
    ) -> Result<Gathered, Skip> {
        let map = CosineMap::new(c, emitter.square.center, emitter.square.half).ok_or(Skip::Behind)?;
        let clip = self.clip(&map, -map.foot, Vec2::ONE)?;
        let sum = integrate(&map, clip.planes().first());
        Ok(self.lit(sum.value, sum.edges).painted(emitter, &map))
    }

    fn by_mosaic(
        &self,
        mosaic: &Mosaic,
        emitter: &Emitter,
        lobe: Option<&Lobe>,
        tolerance: f32,
        budget: &mut Budget,
    ) -> Result<Gathered, Skip> {
        let root = &mosaic.tiles[0];
        let (map, clip) = self.clipped(emitter.square, lobe, [root.center, root.half])?;
        let back = self.from_side(emitter, map.depth)?.back;
        let integral = mosaic_integral(&map, &clip, mosaic.view(), tolerance, budget);
        let value = if back { -integral.value } else { integral.value };
        Ok(Gathered { value: value.max(Vec3::ZERO).as_dvec3(), visited: integral.visited })
    }

    /// [`View::new`] at one point.
    fn clipped(&self, square: Square, lobe: Option<&Lobe>, bounds: [Vec2; 2]) -> Result<(CosineMap, Clip), Skip> {
        let lobe = lobe.map(|lobe| (lobe.m_inv.widen(), lobe.m_row_z));
        let view = View::new::<f64>(self.c, square, lobe, bounds, self.may_be_cut);
        if !view.is_map {
            return Err(Skip::Behind);
        }
        if view.clipped.below { Err(Skip::BelowHorizon) } else { Ok((view.map, view.clipped.clip)) }
    }

    /// [`View::new`] at one point, in f64 to the end.
    fn wide(&self, square: Square, lobe: Option<&Lobe>, bounds: [Vec2; 2]) -> View<Wide> {
        let vector = |v: DVec3| -> Wide3 { Vector::of(Wide(v.x), Wide(v.y), Wide(v.z)) };
        let lobe = lobe.map(|lobe| {
            let InverseMatrix { xx, xz, yy, zx, zz } = lobe.m_inv.widen();
            let m_inv = InverseMatrix { xx: Wide(xx), xz: Wide(xz), yy: Wide(yy), zx: Wide(zx), zz: Wide(zz) };
            (m_inv, vector(lobe.m_row_z.as_dvec3()))
        });
        View::new::<Wide>(self.c.map(vector), square, lobe, bounds, self.may_be_cut)
    }

    /// What clips the box with that centre relative to the foot and those half-extents at z = 0 of cosine space.
    fn clip(&self, map: &CosineMap, center: Vec2, half: Vec2) -> Result<Clip, Skip> {
        if self.may_be_cut { Clip::new(map, None, center, half).ok_or(Skip::BelowHorizon) } else { Ok(Clip::none(map)) }
    }

    /// A signed integral from the side the point is on.
    fn lit(&self, value: f32, visited: u32) -> Gathered {
        let value = if self.back { -value } else { value };
        // Whatever rounding makes of a point on the outline, a light fills a hemisphere once.
        Gathered { value: DVec3::splat(f64::from(value.clamp(0.0, 1.0))), visited }
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
        Gathered { value: DVec3::splat(value.clamp(0.0, 1.0)), visited: 0 }
    }
}

/// A light's square in the cosine space of a lobe, and what clips the light there.
#[derive(Clone, Copy, Debug)]
pub struct View<L: Lanes> {
    /// The map.
    pub map: CosineMap<L>,
    /// Where there is one: elsewhere the light is seen as a line.
    pub is_map: L::Mask,
    /// What clips it.
    pub clipped: Clipped<L>,
}

impl<L: Lanes> View<L> {
    /// From the images of the light-space axes and origin in the shading frame; the lobe by its inverse matrix and the third row
    /// of the matrix; the box is the light's, by its centre and half-extents in tree space; whether a horizon may cut it.
    #[inline(always)]
    pub fn new<D: Doubles<Narrow = L, Mask = L::Mask>>(
        c: [D::Vec3; 3],
        Square { center, half }: Square,
        lobe: Option<(InverseMatrix<D>, L::Vec3)>,
        [box_center, box_half]: [Vec2; 2],
        may_be_cut: bool,
    ) -> Self {
        let [x, y, origin] = c;
        let images = match &lobe {
            Some((m_inv, _)) => [m_inv.apply(x), m_inv.apply(y), m_inv.apply(origin)],
            None => c,
        };
        let (map, is_map) = CosineMap::of::<D>(images, center, half);
        if !may_be_cut {
            let clipped = Clipped { clip: Clip::none(&map), below: map.depth.mask(false) };
            return Self { map, is_map, clipped };
        }
        let truth = match lobe {
            Some((_, axis)) => {
                let form = map.height_form::<D>([x.z(), y.z(), origin.z()], center, half);
                Some(TrueHorizon { axis, height: Height::new(&map, form) })
            }
            None => None,
        };
        let at = L::Vec2::from_foot(box_center, Vec2::ZERO, map.foot);
        Self { map, is_map, clipped: Clip::of(&map, truth.as_ref(), at, at.fixed(box_half)) }
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
        Facing::Fixed | Facing::Whole => Some([p.x, p.y, to_light]),
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
