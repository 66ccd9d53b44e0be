//! The representative point: a simple light seen as one direction of its own, chosen by the mirror ray. Twin:
//! `shaders/representative.wgsl`.
//!
//! Shading frame: z is the normal, the view direction v = (sin θ, 0, cos θ), the mirror direction r = (−sin θ, 0, cos θ).
//! Only ratios of lengths count.
//!
//! Diffuse (Lagarde, de Rousiers, *Moving Frostbite to PBR*, SIGGRAPH course 2014, §4.7): the sphere exactly, with the
//! horizon; the disc as if it faced the point, times the cosine at its own side; the rectangle as its solid angle times the
//! mean clamped cosine towards its corners and its middle; the tube as the rectangle that faces the point, and the caps that
//! are seen as discs. (The course ends tubes in half-spheres; ours are flat.)
//!
//! Specular (Karis, *Real Shading in Unreal Engine 4*, SIGGRAPH course 2013; for discs and rectangles the Wicked Engine's
//! article *Area lights*, 2017): f·cos at the representative direction l, times the light's solid angle Ω, times what
//! Karis widens the lobe by. His α' = α + r/(2d) is written here with the half-vector h = (v + l)/|v + l| as
//!
//! ```text
//! α'² = α² + (α·s + s²/4)/(v·h),   s = √(Ω/π),   E = f(l)·cos(l)·Ω·(α/α')² / magnitude
//! ```
//!
//! which far from a sphere and at normal view is his formula: s = r/d, v·h = 1. Ω instead of the radius serves every shape,
//! and makes a mirror at normal view exact however near the light: as α → 0, f·cos → 1/(4πα²·v·h), and E → 1 where the mirror
//! ray meets the light, 0 elsewhere. The division by v·h, which his engine has since got as well, keeps that limit at any
//! view; without it a mirror would shine brighter than the light by 1/cos θ. A tube is widened less across than along (Karis:
//! (α/α')² for the radius, then α'/α'' for the length): α' by s = r/d, α'' by s + l, with l from Ω = π·s·(s + l), so that the
//! same limit holds.
//!
//! Where it is wrong: a light is as bright as its one direction, so what is below the horizon is all or nothing, long lights
//! at grazing view come out too bright or too dark, and E may exceed 1.

use crate::brdf::ltc::ALPHA_MIN;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// Half-sides `x` and `y`.
pub const RECTANGLE: u32 = 1;
/// Half-axes `x` and `y`.
pub const DISC: u32 = 2;
/// Radius |`x`|.
pub const SPHERE: u32 = 3;
/// Half its axis `x`, radius |`y`|.
pub const TUBE: u32 = 4;

/// A light by its own axes, in its square.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Solid {
    /// Its middle, in the square.
    pub center: Vec2,
    /// Half its extent along x and y, of a tube half its length and its radius, in halves of the square's side.
    pub half: Vec2,
    /// [`RECTANGLE`], [`DISC`], [`SPHERE`] or [`TUBE`].
    pub kind: u32,
    /// How much of it shines, 0..1: the part of its rectangle that a shape fills, by area.
    pub coverage: f32,
}

/// A light as a shading point sees it, in the shading frame; units are immaterial.
///
/// Rectangles and discs shine to the side that the point is on: whether they do is the caller's question.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// [`RECTANGLE`], [`DISC`], [`SPHERE`] or [`TUBE`].
    pub kind: u32,
    /// Its middle, from the point.
    pub center: Vec3,
    /// As its kind says.
    pub x: Vec3,
    /// As its kind says; at right angles to `x`. Of a sphere, anything.
    pub y: Vec3,
}

/// One direction that stands for a light.
#[derive(Clone, Copy, Debug)]
struct Representative {
    /// Towards it, any length.
    direction: Vec3,
    /// Ω of the light, sr.
    solid_angle: f32,
    /// √(Ω/π) of what the lobe is widened by on all sides; the rest of Ω widens it along one line.
    spread: f32,
}

impl Body {
    /// From the images of the square's middle and axes.
    pub fn new(solid: &Solid, middle: Vec3, x: Vec3, y: Vec3) -> Self {
        let center = middle + x * solid.center.x + y * solid.center.y;
        Self { kind: solid.kind, center, x: x * solid.half.x, y: y * solid.half.y }
    }

    /// The integral of the plain cosine: irradiance over π·radiance, 1 for a full hemisphere, where the approximations
    /// end. 0 inside a body.
    ///
    /// Total: any finite body gives 0 to 1.
    pub fn diffuse(&self) -> f32 {
        self.irradiance().min(1.0)
    }

    fn irradiance(&self) -> f32 {
        match self.kind {
            RECTANGLE => rectangle_irradiance(self.center, self.x, self.y),
            DISC => disc_irradiance(self.center, self.x, self.y),
            SPHERE => {
                let d2 = self.center.length_squared();
                let r2 = self.x.length_squared();
                if r2 >= d2 { 0.0 } else { cap_irradiance(self.center.z / d2.sqrt(), r2 / d2) }
            }
            _ => {
                if self.is_inside_tube() {
                    return 0.0;
                }
                let (across, along) = self.tube_caps();
                let mut sum = rectangle_irradiance(self.center, self.x, self.facing());
                for end in [self.x, -self.x] {
                    if end.dot(self.center + end) < 0.0 {
                        sum += disc_irradiance(self.center + end, across, along);
                    }
                }
                sum
            }
        }
    }

    /// The integral of the specular lobe: ∫ f cos without Fresnel over the light, over `magnitude`, which is ∫ f cos over
    /// all directions. For a mirror 1 where the light is seen. 0 inside a body.
    ///
    /// `alpha` is clamped to [`ALPHA_MIN`]..1, `cos_theta` to 0..1. Total: any finite body gives a finite value, at least 0.
    #[expect(clippy::manual_clamp, reason = "clamp would hand NaN on")]
    pub fn specular(&self, alpha: f32, cos_theta: f32, magnitude: f32) -> f32 {
        let alpha = alpha.max(ALPHA_MIN).min(1.0);
        let c = cos_theta.max(0.0).min(1.0);
        let view = Vec3::new((1.0 - c * c).sqrt(), 0.0, c);
        let point = self.representative(Vec3::new(-view.x, 0.0, c));
        let length = point.direction.length();
        if length.is_nan() || length <= 0.0 || point.solid_angle <= 0.0 {
            return 0.0;
        }
        let light = point.direction / length;
        let half = (view + light).normalize_or_zero();
        // 0 only between two opposite grazing directions, where f cos is 0 as well.
        let facing = view.dot(half).max(1e-6);
        let round = widened(alpha, point.spread, facing);
        // Ω = π·s·(s + long): 0 but for a tube.
        let long = (point.solid_angle / (PI * point.spread) - point.spread).max(0.0);
        let line = widened(alpha, point.spread + long, facing);
        let energy = alpha * alpha / (round * line);
        brdf_cos(alpha, view, light, half) * point.solid_angle * energy / magnitude
    }

    /// The direction nearest to the mirror ray, by the rule of each shape.
    fn representative(&self, mirror: Vec3) -> Representative {
        let nothing = Representative { direction: Vec3::ZERO, solid_angle: 0.0, spread: 0.0 };
        let alike = |direction: Vec3, solid_angle: f32| {
            let spread = (solid_angle / PI).sqrt();
            Representative { direction, solid_angle, spread }
        };
        match self.kind {
            RECTANGLE => {
                let q = self.on_plane(mirror).clamp(Vec2::NEG_ONE, Vec2::ONE);
                alike(self.center + self.x * q.x + self.y * q.y, rectangle_solid_angle(self.center, self.x, self.y))
            }
            DISC => {
                let q = self.on_plane(mirror);
                let q = q / q.length().max(1.0);
                alike(self.center + self.x * q.x + self.y * q.y, disc_solid_angle(self.center, self.x, self.y))
            }
            SPHERE => {
                let d2 = self.center.length_squared();
                let r2 = self.x.length_squared();
                if r2 >= d2 {
                    nothing
                } else {
                    alike(towards(self.center, r2.sqrt(), mirror), cap_solid_angle(r2 / d2))
                }
            }
            _ => {
                if self.is_inside_tube() {
                    return nothing;
                }
                // Karis 2013: the point of the axis with the least distance to the ray.
                let axis2 = self.x.length_squared();
                let along = mirror.dot(self.x);
                let slant = axis2 - along * along;
                let offset = mirror.dot(self.center) * along - self.center.dot(self.x);
                let t = if slant > 1e-6 * axis2 { (offset / slant).clamp(-1.0, 1.0) } else { 0.0 };
                let radius = self.y.length();
                let direction = towards(self.center + self.x * t, radius, mirror);
                let (across, up) = self.tube_caps();
                let mut solid_angle = rectangle_solid_angle(self.center, self.x, self.facing());
                for end in [self.x, -self.x] {
                    if end.dot(self.center + end) < 0.0 {
                        solid_angle += disc_solid_angle(self.center + end, across, up);
                    }
                }
                // The radius as seen from the nearest point of the axis.
                let s = (-self.center.dot(self.x) / axis2).clamp(-1.0, 1.0);
                let nearest = (self.center + self.x * s).length();
                let spread = (radius / nearest.max(radius)).min((solid_angle / PI).sqrt());
                Representative { direction, solid_angle, spread }
            }
        }
    }

    /// Where the ray from the point along `direction` meets the plane, in half-sides from the middle; where it does not, far
    /// off on the side that it goes to.
    fn on_plane(&self, direction: Vec3) -> Vec2 {
        let normal = self.x.cross(self.y);
        let depth = normal.dot(self.center);
        let fall = normal.dot(direction) * depth.signum();
        let far = 1e4 * (self.center.length() + self.x.length() + self.y.length());
        let t = if fall > 0.0 { (depth.abs() / fall).min(far) } else { far };
        let offset = direction * t - self.center;
        Vec2::new(offset.dot(self.x) / self.x.length_squared(), offset.dot(self.y) / self.y.length_squared())
    }

    fn is_inside_tube(&self) -> bool {
        let axis2 = self.x.length_squared();
        let s = -self.center.dot(self.x) / axis2;
        let away = self.center + self.x * s;
        s.abs() <= 1.0 && away.length_squared() <= self.y.length_squared()
    }

    /// The radius of a tube, square to its axis and to the direction to its middle; 0 for a point on the axis.
    fn facing(&self) -> Vec3 {
        self.x.cross(self.center).normalize_or_zero() * self.y.length()
    }

    /// Half-axes of a tube's caps.
    fn tube_caps(&self) -> (Vec3, Vec3) {
        (self.y, self.x.cross(self.y) / self.x.length())
    }
}

/// α' of a lobe widened by a light of spread s: α'² = α² + (α·s + s²/4)/(v·h), at most 1. At v·h = 1 that is Karis'
/// α' = α + s/2.
fn widened(alpha: f32, spread: f32, facing: f32) -> f32 {
    (alpha * alpha + (alpha * spread + 0.25 * spread * spread) / facing).min(1.0).sqrt()
}

/// The point of a sphere nearest to the mirror ray (Karis 2013, eq. 11).
fn towards(center: Vec3, radius: f32, mirror: Vec3) -> Vec3 {
    let to_ray = mirror * center.dot(mirror).max(0.0) - center;
    let distance = to_ray.length();
    center + to_ray * if distance > radius { radius / distance } else { 1.0 }
}

/// f(v, l)·cos θ_l of GGX with height-correlated Smith masking-shadowing and Fresnel = 1, 1/sr, as in [`crate::brdf::ggx`].
/// `half` is the unit vector between `view` and `light`. 0 where `light` is below the horizon.
fn brdf_cos(alpha: f32, view: Vec3, light: Vec3, half: Vec3) -> f32 {
    if light.z <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let spread = half.x * half.x + half.y * half.y + a2 * half.z * half.z;
    let density = a2 / (PI * spread * spread);
    let smith = |cos: f32| (cos * cos + a2 * (1.0 - cos * cos).max(0.0)).sqrt();
    density * light.z / (2.0 * (light.z * smith(view.z) + view.z * smith(light.z)))
}

/// Solid angle of a spherical cap by sin² of its half-angle, which is below 90°.
fn cap_solid_angle(sin2: f32) -> f32 {
    2.0 * PI * sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

/// Irradiance over π·radiance of a spherical cap about a direction at `cos` from the normal, by sin² of its half-angle:
/// exact, with the horizon (Lagarde 2014, listing 7).
fn cap_irradiance(cos: f32, sin2: f32) -> f32 {
    if cos * cos >= sin2 {
        return sin2 * cos.max(0.0);
    }
    let sin = (1.0 - cos * cos).max(1e-12).sqrt();
    let x = (1.0 / sin2 - 1.0).max(0.0).sqrt();
    let y = (-x * cos / sin).clamp(-1.0, 1.0);
    let root = (1.0 - y * y).sqrt();
    let angle = root.atan2(y);
    let cut = sin2 * (cos * angle - x * sin * root) + (sin * root).atan2(x);
    (cut / PI).max(0.0)
}

/// sin² of the half-angle of a disc that faces the point, and the cosine at the disc's own side.
fn right_disc(center: Vec3, x: Vec3, y: Vec3) -> (f32, f32) {
    let d2 = center.length_squared();
    let normal = x.cross(y);
    let r2 = normal.length();
    if !(d2 > 0.0 && r2 > 0.0) {
        return (0.0, 0.0);
    }
    (r2 / (r2 + d2), (normal.dot(center).abs() / (r2 * d2.sqrt())).min(1.0))
}

fn disc_solid_angle(center: Vec3, x: Vec3, y: Vec3) -> f32 {
    let (sin2, cos) = right_disc(center, x, y);
    cap_solid_angle(sin2) * cos
}

fn disc_irradiance(center: Vec3, x: Vec3, y: Vec3) -> f32 {
    let (sin2, cos) = right_disc(center, x, y);
    if cos > 0.0 { cap_irradiance(center.z / center.length(), sin2) * cos } else { 0.0 }
}

/// Corners in turn.
fn corners(center: Vec3, x: Vec3, y: Vec3) -> [Vec3; 4] {
    [center - x - y, center + x - y, center + x + y, center - x + y]
}

/// Solid angle of a rectangle: two triangles (van Oosterom, Strackee 1983), exact. The triple product is depth times area, so
/// that a far light keeps its digits.
fn rectangle_solid_angle(center: Vec3, x: Vec3, y: Vec3) -> f32 {
    let volume = 4.0 * x.cross(y).dot(center).abs();
    if volume.is_nan() || volume <= 0.0 {
        return 0.0;
    }
    let [a, b, c, d] = corners(center, x, y);
    triangle_angle(volume, a, b, c) + triangle_angle(volume, a, c, d)
}

fn triangle_angle(volume: f32, a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

fn rectangle_irradiance(center: Vec3, x: Vec3, y: Vec3) -> f32 {
    let cos = |p: Vec3| (p.z / p.length().max(f32::MIN_POSITIVE)).max(0.0);
    let [a, b, c, d] = corners(center, x, y);
    let mean = 0.2 * (cos(a) + cos(b) + cos(c) + cos(d) + cos(center));
    rectangle_solid_angle(center, x, y) * mean / PI
}
