//! What receives the light of clusters: a shading point, or all points of a tile at once, known by boxes that hold what theirs are.
//! Twin: `shaders/receiver.wgsl`.

use super::lanes::{Lanes, Vector};
use super::reflect::Reflectance;
use super::tile::{Extent, TileBounds};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Lobes of a shading point: the plain cosine and the specular lobe.
pub const LOBES: usize = 2;
/// The plain cosine.
pub const PLAIN: usize = 0;
/// The specular lobe.
pub const SPECULAR: usize = 1;

/// A vector known up to a box.
#[derive(Clone, Copy, Debug)]
pub struct Loose<L: Lanes = f32> {
    /// Middle of the box.
    pub middle: L::Vec3,
    /// Its half-extents; 0 for a vector that is known.
    pub half: L::Vec3,
}

impl Loose {
    fn new(extent: &Extent) -> Self {
        Self { middle: extent.middle(), half: extent.half() }
    }

    fn known(middle: Vec3) -> Self {
        Self { middle, half: Vec3::ZERO }
    }
}

/// A lobe of shading points, and what it reflects.
#[derive(Clone, Copy, Debug)]
pub struct Field<L: Lanes = f32> {
    /// Rows of the map from the world to cosine space.
    pub rows: [Loose<L>; 3],
    /// Normal of the surface's true horizon, or of the lobe's own where only that one clips; world space, any length.
    pub up: Loose<L>,
    /// Products of the map's columns, by the middles of its rows: xx, yy, zz.
    pub squares: L::Vec3,
    /// The same: xy, xz, yz.
    pub products: L::Vec3,
    /// det M⁻¹/π.
    pub scale: L,
    /// Reflected radiance over radiance and integral.
    pub weight: L::Vec3,
}

impl Field {
    fn new(rows: [Loose; 3], up: Loose, determinant: f32, weight: Vec3) -> Self {
        let [a, b, c] = rows.map(|row| row.middle);
        let turned = |v: Vec3| Vec3::new(v.y, v.z, v.x);
        // xy, yz, zx.
        let mixed = a * turned(a) + b * turned(b) + c * turned(c);
        let products = Vec3::new(mixed.x, mixed.z, mixed.y);
        Self { rows, up, squares: a * a + b * b + c * c, products, scale: determinant * FRAC_1_PI, weight }
    }
}

impl<L: Lanes> Field<L> {
    /// Largest length in cosine space of a vector in a box with these half-extents, by the middles of the rows.
    #[inline(always)]
    pub fn radius(&self, half: Vec3) -> L {
        let mixed = Vec3::new(half.x * half.y, half.x * half.z, half.y * half.z);
        let products = magnitudes::<L>(self.products);
        (dot_fixed::<L>(self.squares, half * half) + dot_fixed::<L>(products, mixed) * 2.0).sqrt()
    }

    /// Largest length by which the boxes of the rows leave the image of a vector in a box open.
    #[inline(always)]
    pub fn slack(&self, half: Vec3) -> L {
        let [a, b, c] = &self.rows;
        length::<L>(L::Vec3::of(dot_fixed(a.half, half), dot_fixed(b.half, half), dot_fixed(c.half, half)))
    }
}

/// The shading points of a tile, or one of them, as seen by clusters; or one in each lane. Lengths are in the tree's unit.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<L: Lanes = f32> {
    /// Relative to the camera.
    pub position: Loose<L>,
    /// The plain cosine and the specular lobe.
    pub fields: [Field<L>; LOBES],
    /// Whether each of them reflects anything.
    pub shines: [L::Mask; LOBES],
}

impl Receiver {
    /// The points within `bounds`. Specular lobes are clipped at the true horizon as well where `both_horizons`.
    pub fn of_tile(bounds: &TileBounds, both_horizons: bool, per_metre: f32) -> Self {
        let normal = Loose::new(&bounds.normal);
        // The plain cosine is round about the normal. Tangents turn by as much as normals do, which are up to twice their box's
        // half-diagonal from the unit vector through its middle.
        let z = normal.middle.normalize_or(Vec3::Z);
        let x = z.any_orthonormal_vector();
        let turn = Vec3::splat(2.0 * normal.half.length());
        let tangent = |middle: Vec3| Loose { middle, half: turn };
        let rows = bounds.rows.each_ref().map(Loose::new);
        let up = if both_horizons { normal } else { rows[2] };
        let plain = Field::new([tangent(x), tangent(z.cross(x)), normal], normal, 1.0, bounds.weights[0]);
        let lobe = Field::new(rows, up, bounds.determinant, bounds.weights[1]);
        Self::new(Loose::new(&bounds.position), [plain, lobe], per_metre)
    }

    /// One point, by its position relative to the camera in metres, the axes of its shading frame and what it reflects.
    pub fn of_point(
        position: Vec3,
        [x, y, z]: [Vec3; 3],
        reflectance: &Reflectance,
        both_horizons: bool,
        per_metre: f32,
    ) -> Self {
        let m = &reflectance.lobe.m_inv;
        let rows = [x * m.xx + z * m.xz, y * m.yy, x * m.zx + z * m.zz].map(Loose::known);
        let up = if both_horizons { Loose::known(z) } else { rows[2] };
        let plain = Field::new([x, y, z].map(Loose::known), Loose::known(z), 1.0, reflectance.diffuse);
        let lobe = Field::new(rows, up, m.determinant(), reflectance.specular);
        Self::new(Loose::known(position), [plain, lobe], per_metre)
    }

    fn new(position: Loose, fields: [Field; LOBES], per_metre: f32) -> Self {
        let position = Loose { middle: position.middle * per_metre, half: position.half * per_metre };
        Self { position, fields, shines: fields.map(|field| field.weight.max_element() > 0.0) }
    }
}

/// A vector with fixed coordinates in every lane.
#[inline(always)]
pub(super) fn fixed<L: Lanes>(like: L, v: Vec3) -> L::Vec3 {
    L::Vec3::of(like.splat(v.x), like.splat(v.y), like.splat(v.z))
}

/// Inner product with a vector that is the same in every lane.
#[inline(always)]
pub(super) fn dot_fixed<L: Lanes>(v: L::Vec3, other: Vec3) -> L {
    v.x() * other.x + v.y() * other.y + v.z() * other.z
}

/// The absolute values of the coordinates.
#[inline(always)]
pub(super) fn magnitudes<L: Lanes>(v: L::Vec3) -> L::Vec3 {
    L::Vec3::of(v.x().abs(), v.y().abs(), v.z().abs())
}

#[inline(always)]
pub(super) fn length<L: Lanes>(v: L::Vec3) -> L {
    v.length_squared().sqrt()
}
