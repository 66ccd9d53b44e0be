//! Builds the tree of clusters of flat lights, in f64. The walk over it is [`crate::kernel::cluster`].

use crate::kernel::cluster::{Cluster, Clusters, HALF, INDEX_MASK, ROUNDING, SINGLE};
use core::cmp::Ordering;
use glam::{DMat3, DMat4, DVec3};

/// Most lights that are sorted along every key to find where to split.
const SORTED: usize = 1 << 12;
/// Least part of the lights on either side of a split, so that depth stays logarithmic: of 2³⁰ lights below
/// [`crate::kernel::cluster_list::DEEPEST`].
const LEAST_SHARE: usize = 8;
/// What opposite normals weigh in the cost of a cluster: as a cluster of seven times the area.
const TURNED: f64 = 6.0;

/// One side of a flat light. Places are world space relative to the camera, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Which emission it is.
    pub emitter: usize,
    /// Whether the emission has another side, which is a member of its own.
    pub is_half: bool,
    /// Middle of its box, in its plane.
    pub center: DVec3,
    /// Half-extents of its box.
    pub half: DVec3,
    /// Unit normal of the side that shines.
    pub normal: DVec3,
    /// ∫L dA per channel, of the unsigned area.
    pub flux: DVec3,
    /// ∫L dA per channel.
    pub zeroth: DVec3,
    /// ∫L·(p − center) dA for each channel.
    pub first: [DVec3; 3],
    /// Mean of (p − center)(p − center)ᵀ over the area, or more.
    pub spread: DMat3,
}

/// The tree of clusters of a scene's flat lights.
#[derive(Clone, Debug, Default)]
pub struct ClusterTree {
    /// In pre-order.
    pub clusters: Vec<Cluster>,
    /// The tree's unit of length over a metre.
    pub per_metre: f32,
}

impl ClusterTree {
    /// The tree of these members.
    pub fn new(mut members: Vec<Member>) -> Self {
        let reach = members.iter().map(|m| (m.center.abs() + m.half).max_element()).fold(0.0, f64::max);
        // A power of two changes no digit.
        let per_metre = if reach > 0.0 { (-reach.log2().ceil()).exp2() } else { 1.0 };
        for m in &mut members {
            m.center *= per_metre;
            m.half *= per_metre;
            m.flux *= per_metre * per_metre;
            m.zeroth *= per_metre * per_metre;
            m.spread *= per_metre * per_metre;
            m.first = m.first.map(|v| v * per_metre.powi(3));
        }
        let mut tree = Self { per_metre: per_metre as f32, ..Self::default() };
        if !members.is_empty() {
            tree.emit(&mut members);
        }
        tree
    }

    /// What the walk reads.
    pub fn view(&self) -> Clusters<'_> {
        Clusters { clusters: &self.clusters, per_metre: self.per_metre }
    }

    /// Size of the arrays in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.clusters.as_slice())
    }

    fn emit(&mut self, members: &mut [Member]) {
        let at = self.clusters.len();
        self.clusters.push(summary(members));
        if let [member] = members {
            let half = if member.is_half { HALF } else { 0 };
            self.clusters[at].link = SINGLE | half | member.emitter as u32;
            return;
        }
        let middle = split(members);
        let (left, right) = members.split_at_mut(middle);
        self.emit(left);
        self.emit(right);
        self.clusters[at].link = self.clusters.len() as u32 & INDEX_MASK;
    }
}

/// Box, cone and moments of some members, without a link.
fn summary(members: &[Member]) -> Cluster {
    let low = members.iter().map(|m| m.center - m.half).fold(DVec3::INFINITY, DVec3::min);
    let high = members.iter().map(|m| m.center + m.half).fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = if let [member] = members { member.center } else { (low + high) * 0.5 };
    // What is taken for the centre is what f32 holds of it.
    let center = center.as_vec3().as_dvec3();
    let half = (high - center).max(center - low);
    let axis = members.iter().map(|m| m.normal * m.flux.element_sum()).sum::<DVec3>().normalize_or(members[0].normal);
    let axis = axis.as_vec3().as_dvec3();
    // Sine and cosine each by the formula that is exact for it.
    let angle = |n: DVec3| axis.cross(n).length().atan2(axis.dot(n));
    let cone =
        if members.len() == 1 { 0.0 } else { members.iter().map(|m| angle(m.normal)).fold(0.0, f64::max) + 1e-6 };
    let rounding = f64::from(ROUNDING) * (center.abs().max_element() + half.max_element());
    let heights = members.iter().map(|m| m.normal.dot(m.center - center));
    let (lowest, highest) = heights.fold((f64::INFINITY, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
    // Of normals that far apart no point is in front of all for certain.
    let wide = cone > core::f64::consts::FRAC_PI_2;
    let (cone_sin, cone_cos) = if wide { (0.0, -1.0) } else { cone.sin_cos() };
    let flux = members.iter().map(|m| m.flux).sum::<DVec3>();
    // What holds for the channel where a light is the largest part of the whole holds for all.
    let part = |m: &Member| (m.flux / flux.max(DVec3::splat(f64::MIN_POSITIVE))).max_element();
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let spread = members.iter().map(|m| (m.spread + outer(m.center - center)) * part(m)).sum::<DMat3>();
    let channel = |c: usize| {
        let mut sum = DMat4::ZERO;
        for m in members {
            let d = m.center - center;
            let height = m.normal.dot(d);
            let row = (m.first[c] + d * m.zeroth[c]).extend(m.zeroth[c]);
            let n = m.normal;
            sum += DMat4::from_cols(row * n.x, row * n.y, row * n.z, row * height);
        }
        sum.as_mat4()
    };
    Cluster {
        center: center.as_vec3(),
        link: 0,
        half: (half * (1.0 + f64::from(ROUNDING))).as_vec3(),
        low: (lowest - rounding) as f32,
        axis: axis.as_vec3(),
        high: if wide { f32::MAX } else { (highest + rounding) as f32 },
        flux: flux.as_vec3(),
        cone_cos: cone_cos as f32,
        cone_sin: cone_sin as f32,
        squares: DVec3::new(spread.x_axis.x, spread.y_axis.y, spread.z_axis.z).as_vec3(),
        products: DVec3::new(spread.x_axis.y, spread.x_axis.z, spread.y_axis.z).as_vec3(),
        pad: 0.0,
        moments: [channel(0), channel(1), channel(2)],
    }
}

/// Sorts members so that two parts are small clusters; gives where the second begins.
fn split(members: &mut [Member]) -> usize {
    let n = members.len();
    let keys: [fn(&Member) -> f64; 6] =
        [|m| m.center.x, |m| m.center.y, |m| m.center.z, |m| m.normal.x, |m| m.normal.y, |m| m.normal.z];
    let by = |key: fn(&Member) -> f64| {
        move |a: &Member, b: &Member| -> Ordering { key(a).total_cmp(&key(b)).then(a.emitter.cmp(&b.emitter)) }
    };
    if n > SORTED {
        let low = members.iter().map(|m| m.center).fold(DVec3::INFINITY, DVec3::min);
        let high = members.iter().map(|m| m.center).fold(DVec3::NEG_INFINITY, DVec3::max);
        let size = high - low;
        let axis = (0..3).max_by(|&i, &j| size[i].total_cmp(&size[j])).unwrap_or(0);
        members.select_nth_unstable_by(n / 2, by(keys[axis]));
        return n / 2;
    }
    let margin = (n / LEAST_SHARE).max(1);
    let mut best = (f64::INFINITY, 0, n / 2);
    for (k, key) in keys.into_iter().enumerate() {
        members.sort_unstable_by(by(key));
        let costs = |order: &mut dyn Iterator<Item = &Member>| -> Vec<f64> {
            order
                .scan(Extent::default(), |extent, m| {
                    extent.add(m);
                    Some(extent.cost())
                })
                .collect()
        };
        let (left, right) = (costs(&mut members.iter()), costs(&mut members.iter().rev()));
        for at in margin..=n - margin {
            let cost = left[at - 1] + right[n - at - 1];
            if cost < best.0 {
                best = (cost, k, at);
            }
        }
    }
    members.sort_unstable_by(by(keys[best.1]));
    best.2
}

/// What the cost of a cluster is made of (after Conty, Kulla 2018, *Importance Sampling of Many Lights*).
struct Extent {
    low: DVec3,
    high: DVec3,
    normals: DVec3,
    flux: f64,
}

impl Default for Extent {
    fn default() -> Self {
        Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, normals: DVec3::ZERO, flux: 0.0 }
    }
}

impl Extent {
    fn add(&mut self, m: &Member) {
        self.low = self.low.min(m.center - m.half);
        self.high = self.high.max(m.center + m.half);
        let flux = m.flux.element_sum();
        self.normals += m.normal * flux;
        self.flux += flux;
    }

    /// Flux × area of the box's sphere × how far the normals are apart.
    fn cost(&self) -> f64 {
        let apart = if self.flux > 0.0 { 1.0 - self.normals.length() / self.flux } else { 0.0 };
        self.flux * (self.high - self.low).length_squared() * (1.0 + TURNED * apart)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::cluster_list::DEEPEST;

    /// Levels below a cluster, by the tree's links.
    fn depth(clusters: &[Cluster], at: usize) -> usize {
        if clusters[at].is_single() {
            return 0;
        }
        let left = at + 1;
        let right = if clusters[left].is_single() { left + 1 } else { clusters[left].link as usize };
        1 + depth(clusters, left).max(depth(clusters, right))
    }

    /// Each light a thousand times as far as the last, and as strong: splits are as uneven as they can be.
    #[test]
    fn no_tree_is_too_deep() {
        for (count, ratio) in [(100, 1e3_f64), (5000, 1.01), (20_000, 1.001)] {
            let member = |i: usize| Member {
                emitter: i,
                is_half: false,
                center: DVec3::X * ratio.powi(i.min(100 + 20 * (i / 100)) as i32).min(1e30),
                half: DVec3::splat(1e-3),
                normal: DVec3::Z,
                flux: DVec3::splat(ratio.powi((i % 90) as i32).min(1e30)),
                zeroth: DVec3::ONE,
                first: [DVec3::ZERO; 3],
                spread: DMat3::ZERO,
            };
            let tree = ClusterTree::new((0..count).map(member).collect());
            let depth = depth(&tree.clusters, 0);
            assert!(depth < DEEPEST && depth >= count.ilog2() as usize, "{count} lights, {depth} levels");
        }
    }
}
