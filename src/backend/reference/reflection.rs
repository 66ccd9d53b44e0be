//! [`Reflection`]: one lobe at one shading point with the lights that reach it, and the samples that estimate what it sends back.

use super::lights::{Light, Source};
use super::lobes::Lobe;
use super::region::{chance, choose};
use super::sampler::{Key, Sequence};
use crate::backend::emitter::Skip;
use glam::DVec3;

/// A lobe with the lights that reach it.
#[derive(Debug)]
pub struct Reflection<'a> {
    lobe: Lobe,
    sources: Vec<Source<'a>>,
    /// Sums of the chances of the sources up to each, the last 1.
    chances: Vec<f64>,
}

impl<'a> Reflection<'a> {
    /// `see` gives each light from the point, with its weight, or why it does not reach it ([`Light::seen_from`]).
    pub fn new(
        lights: &'a [Light<'a>],
        lobe: Lobe,
        mut see: impl FnMut(&'a Light<'a>, &Lobe) -> Result<(Source<'a>, f64), Skip>,
    ) -> Self {
        let (mut sources, mut chances) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        for (source, weight) in lights.iter().filter_map(|light| see(light, &lobe).ok()) {
            sum += weight;
            sources.push(source);
            chances.push(sum);
        }
        chances.iter_mut().for_each(|chance| *chance /= sum);
        Self { lobe, sources, chances }
    }

    /// Radiance towards the eye by `n` samples: each a direction to a light and one by the lobe, joined by the balance heuristic.
    pub fn sample(&self, key: Key, n: u32) -> DVec3 {
        let mut sum = DVec3::ZERO;
        if self.sources.is_empty() {
            return sum;
        }
        let [over_lights, over_lobe] = [0, 1].map(|kind| Sequence::new(key.part(kind)));
        for i in 0..n {
            sum += self.by_light(over_lights.point(i)) + self.by_lobe(over_lobe.point(i));
        }
        sum / f64::from(n)
    }

    fn by_light(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (chosen, v) = choose(&self.chances, v);
        let Some(light) = self.sources[chosen].sample([u, v]) else { return DVec3::ZERO };
        let value = self.lobe.value(light.direction);
        if value == DVec3::ZERO {
            return value;
        }
        value * light.radiance / (light.density * chance(&self.chances, chosen) + self.lobe.density(light.direction))
    }

    fn by_lobe(&self, uv: [f64; 2]) -> DVec3 {
        let direction = self.lobe.sample(uv);
        let value = self.lobe.value(direction);
        if value == DVec3::ZERO {
            return value;
        }
        let density = self.lobe.density(direction);
        let mut arriving = DVec3::ZERO;
        let mut start = 0.0;
        for (source, &end) in self.sources.iter().zip(&self.chances) {
            if let Some(light) = source.meet(direction) {
                arriving += light.radiance / (density + light.density * (end - start));
            }
            start = end;
        }
        value * arriving
    }
}
