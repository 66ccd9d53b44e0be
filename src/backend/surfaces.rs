//! Which surface a camera ray meets first, on the processor. This file alone names obvhs.

use crate::kernel::surface::{Hit, SEAM, SurfaceTriangle, intersect};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

/// The surfaces as a camera ray meets them.
pub struct Surfaces {
    bvh: Option<CwBvh>,
    /// The scene's enlargement in the hierarchy, a power of two: obvhs sees nothing nearer than 1e-4.
    scale: f32,
}

/// Least extent of a scene in the hierarchy.
const LEAST_EXTENT: f32 = (1 << 20) as f32;

impl Surfaces {
    /// Builds the bounding volume hierarchy.
    pub fn new(triangles: &[SurfaceTriangle]) -> Self {
        let corners = |t: &SurfaceTriangle| {
            // Grown as far as a hit may lie outside, and twice that for the rounding of the boxes.
            let seam = 2.0 * SEAM;
            let (e1, e2) = (Vec3A::from(t.e1.truncate()), Vec3A::from(t.e2.truncate()));
            let p = Vec3A::from(t.p0.truncate()) - (e1 + e2) * seam;
            let grow = 1.0 + 3.0 * seam;
            Triangle { v0: p, v1: p + e1 * grow, v2: p + e2 * grow }
        };
        let mut triangles: Vec<_> = triangles.iter().map(corners).collect();
        let corners = triangles.iter().flat_map(|t| [t.v0, t.v1, t.v2]);
        let extent = corners.map(|v| v.abs().max_element()).fold(f32::MIN_POSITIVE, f32::max);
        let scale = 2.0_f32.powi((LEAST_EXTENT / extent).log2().ceil().clamp(0.0, 100.0) as i32);
        for corner in triangles.iter_mut().flat_map(|t| [&mut t.v0, &mut t.v1, &mut t.v2]) {
            *corner *= scale;
        }
        let mut elapsed = core::time::Duration::ZERO;
        let bvh = (!triangles.is_empty())
            .then(|| build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut elapsed));
        Self { bvh, scale }
    }

    /// The nearest along `direction` from the camera of the triangles that it was built for.
    pub fn nearest(&self, triangles: &[SurfaceTriangle], direction: Vec3) -> Option<(usize, Hit)> {
        let bvh = self.bvh.as_ref()?;
        let ray = Ray::new_inf(Vec3A::ZERO, direction.into());
        let mut hit = RayHit::none();
        let triangle = |id: usize| bvh.primitive_indices[id] as usize;
        bvh.ray_traverse(ray, &mut hit, |_, id| {
            intersect(&triangles[triangle(id)], direction).map_or(f32::INFINITY, |h| h.t * self.scale)
        });
        if hit.t == f32::INFINITY {
            return None;
        }
        let index = triangle(hit.primitive_id as usize);
        intersect(&triangles[index], direction).map(|hit| (index, hit))
    }
}
