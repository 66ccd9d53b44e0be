//! The lights as a shading point sees them: directions sampled over their areas, and what a given direction meets.
//!
//! All in the shading frame with the point as origin, f64. Densities are per steradian.

use super::lobes::Lobe;
use super::region::{Region, Tile};
use crate::backend::emitter::Skip;
use crate::backend::emitter::{Emitter, Geometry};
use crate::kernel::frame::ShadingFrame;
use crate::light::Form;
use core::f64::consts::{PI, TAU};
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::sync::Arc;

/// Half the size of a light over its distance from which its tiles are told apart.
const NEAR: f64 = 0.1;
/// Part of the samples that go evenly to the tiles.
const EVEN: f64 = 0.125;

/// One emission with what sampling it takes.
#[derive(Clone, Debug)]
pub struct Light<'a> {
    emitter: &'a Emitter,
    /// Linear Rec.709, to be multiplied by the picture.
    radiance: DVec3,
    body: Body,
    /// Brightest component of the mean radiance.
    strength: f64,
}

#[derive(Clone, Debug)]
enum Body {
    Flat(Arc<Region>),
    /// World units.
    Sphere {
        radius: f64,
    },
    /// World units.
    Tube {
        radius: f64,
        half_length: f64,
    },
}

/// A light from one shading point.
#[derive(Clone, Debug)]
pub struct Source<'a> {
    light: &'a Light<'a>,
    /// Images of the light-space x axis, y axis and origin.
    c: [DVec3; 3],
    place: Place<'a>,
}

#[derive(Clone, Debug)]
enum Place<'a> {
    Flat {
        region: &'a Region,
        /// c0 × c1, c1 × c2, c2 × c0.
        cross: [DVec3; 3],
        /// c0 × c1 · c2: negative in front.
        volume: f64,
        /// Of the region's tiles.
        chances: Cow<'a, [f64]>,
    },
    Sphere {
        radius: f64,
        inside: bool,
    },
    Tube {
        axis: DVec3,
        radius: f64,
        half_length: f64,
        inside: bool,
    },
}

/// How a light stands to a shading point.
struct View<'a> {
    place: Place<'a>,
    /// Roughly what comes back of radiance 1, more than 0.
    worth: f64,
}

/// Light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence {
    /// Unit vector towards the light.
    pub direction: DVec3,
    /// Linear Rec.709.
    pub radiance: DVec3,
    /// With which [`Source::sample`] finds the direction.
    pub density: f64,
}

impl<'a> Light<'a> {
    /// The region is made here if the emitter was prepared for another technique.
    pub fn new(emitter: &'a Emitter) -> Self {
        let [x, y] = [emitter.placement.x.length(), emitter.placement.y.length()];
        let body = match emitter.form {
            Form::Outline | Form::Rectangle | Form::Disc => Body::Flat(match &emitter.geometry {
                Geometry::Sampled { region, .. } => Arc::clone(region),
                _ => Arc::new(Region::new(&emitter.shape)),
            }),
            Form::Sphere { radius } => Body::Sphere { radius: radius * (x * y).sqrt() },
            Form::Tube { radius, length } => Body::Tube { radius: radius * y, half_length: 0.5 * length * x },
        };
        Self { emitter, radiance: DVec3::ONE, body, strength: 1.0 }.with_radiance(emitter.radiance.as_dvec3())
    }

    /// The same light with another radiance.
    #[must_use]
    pub fn with_radiance(self, radiance: DVec3) -> Self {
        let mean = self.emitter.picture.as_ref().map_or(DVec3::ONE, |picture| {
            let sum = picture.texels.iter().fold(DVec3::ZERO, |sum, t| sum + t.truncate().as_dvec3());
            sum / picture.texels.len() as f64
        });
        Self { radiance, strength: (radiance * mean).max_element(), ..self }
    }

    /// The emission.
    pub const fn emitter(&self) -> &'a Emitter {
        self.emitter
    }

    /// Whether it emits nothing.
    pub fn is_dark(&self) -> bool {
        self.strength <= 0.0
    }

    /// The light from a point relative to the camera whose `lobe` it meets, and roughly how much it sends back: what it
    /// deserves of the samples, more than 0.
    pub fn seen_from(&'a self, frame: &ShadingFrame, position: DVec3, lobe: &Lobe) -> Result<(Source<'a>, f64), Skip> {
        let p = &self.emitter.placement;
        let c = [p.x, p.y, p.origin - position].map(|v| frame.to_local(v));
        self.source(c, lobe)
    }

    /// As [`Light::seen_from`], by the images in the shading frame of the light-space x axis, y axis and origin.
    pub fn source(&'a self, c: [DVec3; 3], lobe: &Lobe) -> Result<(Source<'a>, f64), Skip> {
        let View { place, worth } = match &self.body {
            Body::Flat(region) => self.flat(region, c, lobe)?,
            Body::Sphere { radius } => self.sphere(*radius, c[2], lobe)?,
            Body::Tube { radius, half_length } => self.tube(*radius, *half_length, c, lobe)?,
        };
        Ok((Source { light: self, c, place }, self.strength * worth))
    }

    fn flat(&self, region: &'a Region, c: [DVec3; 3], lobe: &Lobe) -> Result<View<'a>, Skip> {
        let cross = [c[0].cross(c[1]), c[1].cross(c[2]), c[2].cross(c[0])];
        let volume = cross[0].dot(c[2]);
        if volume == 0.0 || (volume > 0.0 && !self.emitter.two_sided) {
            return Err(Skip::Behind);
        }
        // Of so much of the shape in a box, at the distance of its middle.
        let worth = |area: f64, center: DVec2, half: DVec2| {
            let center = c[0] * center.x + c[1] * center.y + c[2];
            let reach = (c[0] * half.x).length() + (c[1] * half.y).length();
            let rise = c[0].z.abs() * half.x + c[1].z.abs() * half.y;
            let distance = (center.length_squared() + reach * reach).sqrt();
            let solid_angle = volume.abs() * area / distance.powi(3);
            Some(solid_angle * seen(lobe, center, rise, reach)?)
        };
        let bounds = region.bounds();
        let half = bounds.size() * 0.5;
        let whole = worth(region.area(), bounds.center(), half).ok_or(Skip::BelowHorizon)?;
        let center = c[0] * bounds.center().x + c[1] * bounds.center().y + c[2];
        let (chances, worth) = if (c[0] * half.x).length().hypot((c[1] * half.y).length()) > NEAR * center.length() {
            let weight = |tile: &Tile| worth(tile.area, tile.center, tile.half).unwrap_or(0.0);
            tile_chances(region, weight).ok_or(Skip::BelowHorizon)?
        } else {
            (Cow::Borrowed(region.even()), whole)
        };
        Ok(View { place: Place::Flat { region, cross, volume, chances }, worth })
    }

    fn sphere(&self, radius: f64, center: DVec3, lobe: &Lobe) -> Result<View<'a>, Skip> {
        let inside = center.length() < radius;
        if inside && !self.emitter.two_sided {
            return Err(Skip::Behind);
        }
        let sine = (radius / center.length()).min(1.0);
        let worth = PI * sine * sine * seen(lobe, center, radius, radius).ok_or(Skip::BelowHorizon)?;
        Ok(View { place: Place::Sphere { radius, inside }, worth })
    }

    fn tube(&self, radius: f64, half_length: f64, [x, _, center]: [DVec3; 3], lobe: &Lobe) -> Result<View<'a>, Skip> {
        let axis = x.normalize();
        let along = axis.dot(center);
        let inside = (center - axis * along).length() < radius && along.abs() < half_length;
        if inside && !self.emitter.two_sided {
            return Err(Skip::Behind);
        }
        let rise = axis.z.abs() * half_length + radius * (1.0 - axis.z * axis.z).max(0.0).sqrt();
        let solid_angle = radius * (4.0 * half_length + PI * radius) / (center.length_squared() + radius * radius);
        let reach = half_length.hypot(radius);
        let worth = solid_angle * seen(lobe, center, rise, reach).ok_or(Skip::BelowHorizon)?;
        Ok(View { place: Place::Tube { axis, radius, half_length, inside }, worth })
    }

    /// Radiance at a light-space point of the emission.
    fn radiance(&self, p: DVec2) -> DVec3 {
        self.emitter
            .picture
            .as_ref()
            .map_or(self.radiance, |picture| self.radiance * picture.sample(p).truncate().as_dvec3())
    }
}

/// [`Lobe::worth`] of a patch about `center` that reaches so far from it and rises so far over it. `None` where none of it can
/// be reflected.
fn seen(lobe: &Lobe, center: DVec3, rise: f64, reach: f64) -> Option<f64> {
    let distance = (center.length_squared() + reach * reach).sqrt();
    let highest = if lobe.dips() { 1.0 } else { (center.z + rise) / distance };
    let worth = |highest: f64| lobe.worth(center.normalize_or(DVec3::Z), highest.min(1.0), reach / distance);
    (highest > 0.0).then(|| worth(highest))
}

/// Chances of a region's tiles by their weight, an eighth of them by their area where there is weight at all; and the sum of
/// the weights. `None` if there is none.
fn tile_chances<'a>(region: &Region, weight: impl Fn(&Tile) -> f64) -> Option<(Cow<'a, [f64]>, f64)> {
    let weights: Vec<f64> = region.tiles().iter().map(weight).collect();
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        return None;
    }
    let lit = |(tile, weight): (&Tile, &f64)| if *weight > 0.0 { tile.area } else { 0.0 };
    let area: f64 = region.tiles().iter().zip(&weights).map(lit).sum();
    let mut total = 0.0;
    let chance = |pair: (&Tile, &f64)| {
        total += (1.0 - EVEN) * pair.1 / sum + EVEN * lit(pair) / area;
        total
    };
    let mut chances: Vec<f64> = region.tiles().iter().zip(&weights).map(chance).collect();
    chances.iter_mut().for_each(|chance| *chance /= total);
    Some((Cow::Owned(chances), sum))
}

impl Source<'_> {
    /// A direction to the light for a point of the unit square, or none where that meets the dark side.
    ///
    /// Flat lights and tubes evenly by area, spheres evenly by solid angle.
    pub fn sample(&self, uv: [f64; 2]) -> Option<Incidence> {
        match &self.place {
            Place::Flat { region, volume, chances, .. } => {
                let (p, density) = region.sample(chances, uv)?;
                let [x, y, origin] = self.c;
                let to_light = x * p.x + y * p.y + origin;
                let distance = to_light.length();
                Some(Incidence {
                    direction: to_light / distance,
                    radiance: self.light.radiance(p),
                    density: distance.powi(3) * density / volume.abs(),
                })
            }
            Place::Sphere { radius, inside } => self.sample_sphere(*radius, *inside, uv),
            Place::Tube { axis, radius, half_length, inside } => {
                let (normal, offset) = tube_point(*axis, *radius, *half_length, uv);
                let to_light = self.c[2] + offset;
                let distance = to_light.length();
                let direction = to_light / distance;
                let cos = if *inside { normal.dot(direction) } else { -normal.dot(direction) };
                (cos > 0.0).then(|| Incidence {
                    direction,
                    radiance: self.body_radiance(offset),
                    density: distance * distance / (cos * tube_area(*radius, *half_length)),
                })
            }
        }
    }

    /// What the light sends from a direction, where that meets it.
    pub fn meet(&self, direction: DVec3) -> Option<Incidence> {
        match &self.place {
            Place::Flat { region, cross, volume, chances } => {
                let slope = cross[0].dot(direction);
                let distance = volume / slope;
                // A direction in the plane meets it nowhere.
                if !(distance > 0.0 && distance.is_finite()) {
                    return None;
                }
                let p = DVec2::new(cross[1].dot(direction), cross[2].dot(direction)) / slope;
                (region.winding(p) > 0).then(|| Incidence {
                    direction,
                    radiance: self.light.radiance(p),
                    density: distance * distance * region.density(chances, p) / slope.abs(),
                })
            }
            Place::Sphere { radius, inside } => {
                let center = self.c[2];
                let along = center.dot(direction);
                let off = center.cross(direction).length_squared();
                let half_chord = (radius * radius - off).sqrt();
                if !(*inside || along > 0.0 && half_chord >= 0.0) {
                    return None;
                }
                let distance = if *inside { along + half_chord } else { along - half_chord };
                let radiance = self.body_radiance(direction * distance - center);
                Some(Incidence { direction, radiance, density: sphere_density(*radius, center.length(), *inside) })
            }
            Place::Tube { axis, radius, half_length, inside } => {
                let (distance, normal) = meet_tube(self.c[2], *axis, *radius, *half_length, *inside, direction)?;
                let cos = normal.dot(direction).abs();
                Some(Incidence {
                    direction,
                    radiance: self.body_radiance(direction * distance - self.c[2]),
                    density: distance * distance / (cos * tube_area(*radius, *half_length)),
                })
            }
        }
    }

    fn sample_sphere(&self, radius: f64, inside: bool, [u, v]: [f64; 2]) -> Option<Incidence> {
        let center = self.c[2];
        let span = if inside { 2.0 } else { cap_height(radius, center.length()) };
        // Height of the direction below the pole of the cap.
        let fall = v * span;
        let (across, up) = center.normalize_or(DVec3::Z).any_orthonormal_pair();
        let pole = across.cross(up);
        let [cos, sin] = DVec2::from_angle(TAU * u).to_array();
        let direction = (across * cos + up * sin) * (fall * (2.0 - fall)).max(0.0).sqrt() + pole * (1.0 - fall);
        self.meet(direction)
    }

    /// Radiance of a body at a point relative to its centre: its picture is seen along the light's normal.
    fn body_radiance(&self, offset: DVec3) -> DVec3 {
        let [x, y, _] = self.c;
        self.light.radiance(DVec2::new(offset.dot(x) / x.length_squared(), offset.dot(y) / y.length_squared()))
    }
}

/// 1 − cos of the half-angle under which a sphere is seen.
fn cap_height(radius: f64, distance: f64) -> f64 {
    let sine = (radius / distance).min(1.0);
    let squared = sine * sine;
    squared / (1.0 + (1.0 - squared).sqrt())
}

fn sphere_density(radius: f64, distance: f64, inside: bool) -> f64 {
    let span = if inside { 2.0 } else { cap_height(radius, distance) };
    1.0 / (TAU * span)
}

/// Area of a tube with both caps.
fn tube_area(radius: f64, half_length: f64) -> f64 {
    TAU * radius * (2.0 * half_length + radius)
}

/// Outer normal and place relative to the centre of a point of a tube, even over its area: side first, then the caps.
fn tube_point(axis: DVec3, radius: f64, half_length: f64, [u, v]: [f64; 2]) -> (DVec3, DVec3) {
    let (a, b) = axis.any_orthonormal_pair();
    let [cos, sin] = DVec2::from_angle(TAU * u).to_array();
    let radial = a * cos + b * sin;
    let place = v * (2.0 * half_length + radius);
    if place < 2.0 * half_length {
        return (radial, radial * radius + axis * (place - half_length));
    }
    let cap = 2.0 * (place - 2.0 * half_length) / radius;
    let (sign, share) = if cap < 1.0 { (1.0, cap) } else { (-1.0, cap - 1.0) };
    (axis * sign, radial * (radius * share.clamp(0.0, 1.0).sqrt()) + axis * (half_length * sign))
}

/// Distance and outer normal where a ray from the origin enters a tube, or leaves it when it starts inside.
fn meet_tube(
    center: DVec3,
    axis: DVec3,
    radius: f64,
    half_length: f64,
    inside: bool,
    direction: DVec3,
) -> Option<(f64, DVec3)> {
    let along = [-center.dot(axis), direction.dot(axis)];
    let (from, across) = (-center - axis * along[0], direction - axis * along[1]);
    let steep = across.length_squared();
    // Squared half chord: from the cross product, which far away keeps the digits that b² − ac loses.
    let chord = steep * radius * radius - from.cross(across).length_squared();
    let (enter_side, leave_side) = if steep > 0.0 {
        let (middle, half) = (-from.dot(across) / steep, chord.max(0.0).sqrt() / steep);
        (middle - half, middle + half)
    } else {
        (f64::NEG_INFINITY, f64::INFINITY)
    };
    let missed = if steep > 0.0 { chord <= 0.0 } else { from.length() >= radius };
    let (enter_caps, leave_caps) = if along[1] == 0.0 {
        if along[0].abs() >= half_length {
            return None;
        }
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        let (a, b) = ((-half_length - along[0]) / along[1], (half_length - along[0]) / along[1]);
        (a.min(b), a.max(b))
    };
    let (enter, leave) = (enter_side.max(enter_caps), leave_side.min(leave_caps));
    if missed || enter >= leave || leave <= 0.0 || (enter <= 0.0 && !inside) {
        return None;
    }
    let (distance, on_side) = if inside { (leave, leave_side < leave_caps) } else { (enter, enter_side > enter_caps) };
    let normal = if on_side {
        (from + across * distance) / radius
    } else {
        let forward = if inside { 1.0 } else { -1.0 };
        axis * (forward * along[1].signum())
    };
    Some((distance, normal))
}
