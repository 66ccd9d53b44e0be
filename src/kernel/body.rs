//! Bodies as a point sees them: the planes and frames in which their silhouettes are drawn. Twin: `shaders/body.wgsl`.
//!
//! Only directions count, so a silhouette may be drawn in any plane that cuts its cone. Every frame here is the images of
//! the x axis, the y axis and the origin of some fixed shape, relative to the point, in the axes and units of the input.

use glam::DVec3;

/// The facing disc of a sphere whose centre is at `center`: images of the unit disc. `None` inside the sphere and on it.
///
/// Its cone has the tangent r/√(d² − r²): a disc of radius r at the distance √(d² − r²).
pub fn facing_disc(center: DVec3, radius: f64) -> Option<[DVec3; 3]> {
    let distance = center.length();
    if distance.partial_cmp(&radius) != Some(core::cmp::Ordering::Greater) {
        return None;
    }
    let normal = -center / distance;
    // Which of the perpendicular directions makes no difference to a disc.
    let x = normal.any_orthonormal_vector();
    let nearer = ((distance - radius) * (distance + radius)).sqrt();
    Some([x * radius, normal.cross(x) * radius, normal * -nearer])
}

/// A tube as a point sees it from outside its infinite cylinder.
#[derive(Clone, Copy, Debug)]
pub struct FacingTube {
    /// Unit, along the tube.
    pub axis: DVec3,
    /// Unit, from the axis to the point.
    pub normal: DVec3,
    /// How far along the axis the point is from the tube's middle.
    pub along: f64,
    /// Half the silhouette's width: r·√(1 − r²/ρ²), ρ the distance of the point from the axis.
    pub width: f64,
    /// Distance of the plane of both tangents' feet from the point: ρ − r²/ρ.
    pub distance: f64,
    /// r/ρ: the cosine of half the angle by which the tangents' feet are apart.
    pub cosine: f64,
}

impl FacingTube {
    /// For a tube whose middle is at `center`. `None` for a point inside the infinite cylinder or on it: its side
    /// doesn't reach there.
    pub fn new(center: DVec3, axis: DVec3, radius: f64) -> Option<Self> {
        let along = -center.dot(axis);
        let across = -center - axis * along;
        let rho = across.length();
        if rho.partial_cmp(&radius) != Some(core::cmp::Ordering::Greater) {
            return None;
        }
        let seen = (rho - radius) * (rho + radius);
        Some(Self {
            axis,
            normal: across / rho,
            along,
            width: radius / rho * seen.sqrt(),
            distance: seen / rho,
            cosine: radius / rho,
        })
    }

    /// The rectangle between the feet of the tangents: images of x along the tube, of y over half its width.
    pub fn side(&self) -> [DVec3; 3] {
        let Self { axis, normal, along, width, distance, .. } = *self;
        [axis, normal.cross(axis) * width, axis * -along - normal * distance]
    }

    /// The region between the rectangle's end at `at` and the rim there: images of the upper half of the unit disc.
    ///
    /// It is seen from the front where the rim is beyond the rectangle's end, which it then adds to, and from the back where
    /// it hides a part of the rectangle. The near arc of the rim is the conic (1−t)²·A + 2t(1−t)·cos α·P + t²·B in homogeneous
    /// coordinates, A and B the tangents' feet, α half the arc's angle, and P where the tangents of the rim meet: the point's own
    /// projection to the plane of the rim. With A + B and B − A as middle and axis that is a half-ellipse, whose other
    /// axis is cos α·P.
    pub fn end(&self, at: f64) -> [DVec3; 3] {
        let Self { axis, normal, along, width, distance, cosine } = *self;
        let outward = at.signum();
        let beyond = axis * (at - along);
        [axis.cross(normal) * (outward * width), beyond * cosine, beyond - normal * distance]
    }
}
