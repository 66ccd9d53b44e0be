//! Polygons as lights: projected areas and distances for integrals. Twin: `shaders/pal.wgsl`.
//!
//! Petryaev, *Polygons as lights: algebraic approximation of polygonal area lights*, 2016, with the code published beside it
//! (PAL, 2016–2017) where that says more. Shading frame: the map is that of the plain cosine.
//!
//! Diffuse: the polygon is projected from the shading point to the plane z' = 1 of a basis whose z' points to some place on
//! the polygon; the area of the projection stands for the irradiance, times the local occlusion, which is how much of the
//! diameter of the circumscribed circle is above the surface, (height of its middle + R)/(2R) within 0..1. The place is
//!
//! | basis | |
//! |---|---|
//! | [`CENTRED`] | the polygon's centroid |
//! | [`WEIGHTED`] | the mean of its corners, each by 1/distance |
//! | [`BIASED`] | the centroid; the projection is from a point [`BIAS`]·R farther back |
//!
//! Specular: the mirror ray meets the light's plane at I. With the distance d from I to the polygon over R, read from a baked
//! texture, k = 100·(1 − √α) and the point p,
//!
//! ```text
//! E = (1 + d)^−k · min(R/|I − p|, 1) · (1 − |I − c|/(φ·R)),   0 where |I − c| ≥ φ·R about the circle's middle c
//! ```
//!
//! What is ours. The method has an intensity for the artist; here it is L/π for the area and L for the mirror, so that a
//! small light straight above the surface gives its irradiance, and a mirror next to the middle of a light gives L. There is
//! **no cosine** at the surface: a light at the angle θ from the normal comes out as 1/cos θ times what it should. Each outer
//! contour with its holes is one polygon, as the method has none with holes. The centroid is the area's, where the published
//! code has the mean of the corners, and corners are weighted by the edges that meet there: how finely a curve is cut does
//! not matter then. What comes nearer than [`NEAR`] of the place's distance in z', where the projection runs to infinity, is
//! clipped, and one polygon's integral ends at 1. φ is the golden ratio by its name in the code, and the bias, an artist's
//! number from 0 to 2 there, is 1.

use super::map::CosineMap;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::{Vec2, Vec3, Vec4};

/// The basis that points to the centroid.
pub const CENTRED: u32 = 0;
/// The basis that points to the weighted mean of the corners.
pub const WEIGHTED: u32 = 1;
/// The centred basis with a projection from farther back.
pub const BIASED: u32 = 2;
/// How much farther back, in radii of the circumscribed circle.
pub const BIAS: f32 = 1.0;
/// Least z' of what is projected, as a part of the place's.
pub const NEAR: f32 = 1e-3;
/// Half the side of a polygon's texture, in radii of its circumscribed circle.
pub const PHI: f32 = 1.618_034;
/// Exponent of a mirror's reflection.
pub const MIRROR_EXPONENT: f32 = 100.0;

/// An outer contour with its holes. Places are in the square of its light, \[−1, 1\]²; lengths are in halves of the longer of
/// the square's sides as placed in the world.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Polygon {
    /// Middle of the circumscribed circle: of the bounding box.
    pub circle: Vec2,
    /// Centroid of the area.
    pub centroid: Vec2,
    /// Radius of the circle.
    pub radius: f32,
    /// First edge; those of the outer contour come first.
    pub first: u32,
    /// Past the last edge of the outer contour.
    pub outer: u32,
    /// Past the last edge of the holes.
    pub end: u32,
    /// First texel: signed distances to the edge over R, negative inside, rows from low to high y.
    pub texels: u32,
    /// Texels along a side, at least 2.
    pub side: u32,
}

/// The polygons of one emission.
#[derive(Clone, Copy, Debug)]
pub struct PolygonsView<'a> {
    /// The polygons.
    pub polygons: &'a [Polygon],
    /// Edges: xy from, zw to, in the square.
    pub edges: &'a [Vec4],
    /// Distances.
    pub texels: &'a [f32],
}

/// An integral and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PalIntegral {
    /// 1 for a full hemisphere; at least 0, from either side.
    pub value: f32,
    /// Edges visited, or texels read.
    pub visited: u32,
}

/// The approximate integral of the plain cosine; `map` is not to have D = 0.
pub fn pal_diffuse(map: &CosineMap, view: PolygonsView<'_>, basis: u32) -> PalIntegral {
    let scale = map.gram[0].max(map.gram[2]).sqrt();
    let mut sum = PalIntegral { value: 0.0, visited: 0 };
    for polygon in view.polygons {
        let radius = polygon.radius * scale;
        let height = map.point(polygon.circle - map.foot).z;
        let occlusion = ((height + radius) / (2.0 * radius)).clamp(0.0, 1.0);
        if occlusion.is_nan() || occlusion <= 0.0 {
            continue;
        }
        let mut place = map.point(polygon.centroid - map.foot);
        if basis == WEIGHTED {
            place = weighted_place(map, polygon, view.edges, place);
            sum.visited += polygon.outer - polygon.first;
        }
        let back = if basis == BIASED { BIAS * radius } else { 0.0 };
        let area = projected_area(map, polygon, view.edges, place, back);
        sum.visited += polygon.end - polygon.first;
        if area > 0.0 {
            sum.value += (area / PI).min(1.0) * occlusion;
        }
    }
    sum
}

/// The mean of the outer contour's corners, each weighted by the mean length of its two edges over its distance.
fn weighted_place(map: &CosineMap, polygon: &Polygon, edges: &[Vec4], otherwise: Vec3) -> Vec3 {
    let mut place = Vec3::ZERO;
    let mut weights = 0.0;
    for edge in &edges[polygon.first as usize..polygon.outer as usize] {
        let a = map.point(edge.truncate().truncate() - map.foot);
        let b = map.point(Vec2::new(edge.z, edge.w) - map.foot);
        let span = (b - a).length();
        let (wa, wb) = (span / a.length(), span / b.length());
        place += a * wa + b * wb;
        weights += wa + wb;
    }
    if weights > 0.0 && weights < f32::INFINITY { place / weights } else { otherwise }
}

/// Area of the projection to the plane z' = 1, z' towards `place`, from a point `back` behind the origin. Positive for outer
/// contours, from either side; 0 where `place` is the origin.
///
/// An edge adds half of (a × b)·z'/(a_z'·b_z'). Edges are cut at z' = near; all such cuts lie on one line, where an edge from
/// one to the other adds the difference of a function of its ends alone, so that the order of cuts does not matter.
fn projected_area(map: &CosineMap, polygon: &Polygon, edges: &[Vec4], place: Vec3, back: f32) -> f32 {
    let distance = place.length();
    if distance.is_nan() || distance <= 0.0 {
        return 0.0;
    }
    let z = place / distance;
    let near = NEAR * (distance + back);
    // z' of a point, and ((b − a) × a)·z' of an edge.
    let form = Vec3::new(map.c0.dot(z), map.c1.dot(z), map.c2.dot(z) + back);
    let height = |q: Vec2| form.x * q.x + form.y * q.y + form.z;
    let turn = Vec3::new(map.normal.dot(z), map.w0.dot(z), map.w1.dot(z));
    let cross = |a: Vec2, u: Vec2| turn.x * u.perp_dot(a) + turn.y * u.x + turn.z * u.y;
    // Along the line of cuts.
    let line = map.normal.cross(z);
    let across = line.cross(z);
    let unit = 1.0 / (line.length_squared() * near * near).max(f32::MIN_POSITIVE);
    let mut sum = 0.0;
    for edge in &edges[polygon.first as usize..polygon.end as usize] {
        let mut a = edge.truncate().truncate() - map.foot;
        let mut b = Vec2::new(edge.z, edge.w) - map.foot;
        let (mut ha, mut hb) = (height(a), height(b));
        let (above_a, above_b) = (ha > near, hb > near);
        if !above_a && !above_b {
            continue;
        }
        if above_a != above_b {
            let cut = a + (b - a) * ((near - ha) / (hb - ha)).clamp(0.0, 1.0);
            let p = map.point(cut);
            let closing = p.dot(line) * p.dot(across) * unit;
            if above_a {
                (b, hb) = (cut, near);
                sum += closing;
            } else {
                (a, ha) = (cut, near);
                sum -= closing;
            }
        }
        sum += cross(a, b - a) / (ha * hb);
    }
    0.5 * sum * map.depth.signum()
}

/// The approximate integral of the specular lobe of GGX width `alpha`, for a view at `cos_theta`; `map` is not to have D = 0.
#[expect(clippy::manual_clamp, reason = "clamp would hand NaN on")]
pub fn pal_specular(map: &CosineMap, view: PolygonsView<'_>, alpha: f32, cos_theta: f32) -> PalIntegral {
    let mut sum = PalIntegral { value: 0.0, visited: 0 };
    let c = cos_theta.max(0.0).min(1.0);
    let mirror = Vec3::new(-(1.0 - c * c).sqrt(), 0.0, c);
    let fall = map.normal.dot(mirror);
    if (fall * map.depth).is_nan() || fall * map.depth >= 0.0 {
        return sum;
    }
    // Cramer's rule for where the ray meets the plane.
    let q = map.foot + Vec2::new(map.w1.dot(mirror), -map.w0.dot(mirror)) / fall;
    let distance = (map.depth / fall).abs();
    let sides = Vec2::new(map.gram[0].sqrt(), map.gram[2].sqrt());
    let scale = sides.max_element();
    let exponent = MIRROR_EXPONENT * (1.0 - alpha.max(0.0).min(1.0).sqrt());
    for polygon in view.polygons {
        let radius = polygon.radius * scale;
        let offset = (q - polygon.circle) * sides / (PHI * radius);
        let rim = 1.0 - offset.length();
        if rim.is_nan() || rim <= 0.0 {
            continue;
        }
        let outside = distance_at(polygon, view.texels, offset).max(0.0);
        sum.value += (-exponent * (1.0 + outside).log2()).exp2() * (radius / distance).min(1.0) * rim;
        sum.visited += 1;
    }
    sum
}

/// The texture of a polygon at a place in −1..1, bilinear between texel centres.
fn distance_at(polygon: &Polygon, texels: &[f32], place: Vec2) -> f32 {
    let last = (polygon.side - 1) as f32;
    let at = ((place * 0.5 + 0.5) * polygon.side as f32 - 0.5).clamp(Vec2::ZERO, Vec2::splat(last));
    let low = at.floor().min(Vec2::splat(last - 1.0));
    let part = at - low;
    let first = (polygon.texels + low.y as u32 * polygon.side + low.x as u32) as usize;
    let above = first + polygon.side as usize;
    let lower = texels[first] + (texels[first + 1] - texels[first]) * part.x;
    let upper = texels[above] + (texels[above + 1] - texels[above]) * part.x;
    lower + (upper - lower) * part.y
}
