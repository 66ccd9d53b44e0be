//! Curves as polygons of equal parameter steps. Twin: `shaders/polygon.wgsl`.

use super::curve::{Corner, Curve, EdgeSum, LocalCurve, clipped_edge};
use super::horizon::Horizon;
use super::map::CosineMap;
use core::f32::consts::TAU;

/// The clamped-cosine integral over the light's polygon of `segments` edges per curve, lines being one edge, each edge clipped
/// at z = 0 (`horizon`; `None` where the light is wholly above) and integrated on its own (Heitz, Dupuy, Hill, Neubelt,
/// *Real-Time Polygonal-Light Shading with Linearly Transformed Cosines*, SIGGRAPH 2016, §4). The closing edges are the
/// order-free sum of [`super::horizon`]. Signed: negative behind the light.
///
/// The error falls with `segments`⁻² down to the rounding of f32, about 1e-6.
pub fn uniform_integral(map: &CosineMap, horizon: Option<&Horizon>, curves: &[Curve], segments: u32) -> EdgeSum {
    let (mut value, mut edges) = (0.0, 0);
    let mut a = Corner::new(map, -map.foot);
    for curve in curves {
        let local = LocalCurve::new(curve, map.foot);
        let mut horizon = horizon;
        if let Some(plane) = horizon {
            let heights = local.heights(plane);
            if !heights.iter().any(|&h| h > 0.0) {
                continue;
            }
            horizon = horizon.filter(|_| !heights.iter().all(|&h| h > 0.0));
        }
        if a.q != local.p0 {
            a = Corner::new(map, local.p0);
        }
        let steps = if local.is_line() { 1 } else { segments };
        let width = 1.0 / steps as f32;
        // Summed by curve first: of many edges with one running total each would lose its last digits.
        let mut sum = 0.0;
        for i in 1..=steps {
            let q = if i == steps { local.p3 } else { local.point(i as f32 * width) };
            let b = Corner::new(map, q);
            let edge = clipped_edge(map, horizon, &a, &b);
            sum += edge.value;
            edges += edge.edges;
            a = b;
        }
        value += sum;
    }
    EdgeSum { value: value / TAU, edges }
}
