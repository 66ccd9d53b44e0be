//! [`Point`]: one shading point, its lights and lobes, and the samples that estimate what it reflects.

use super::lights::{Light, Source};
use super::lobes::{Reflector, cosine, sample_cosine};
use super::region::choose;
use super::sampler::{Key, Sequence};
use crate::backend::gather::Skip;
use glam::DVec3;

/// A shading point with the lights that reach it.
#[derive(Debug)]
pub struct Point<'a> {
    reflector: Reflector,
    sources: Vec<Source<'a>>,
    /// Sums of the chances of the sources up to each, the last 1.
    chances: Vec<f64>,
}

impl<'a> Point<'a> {
    /// `see` gives each light from the point, with its weight, or why it does not reach it ([`Light::seen_from`]).
    pub fn new(
        lights: &'a [Light<'a>],
        reflector: Reflector,
        mut see: impl FnMut(&'a Light<'a>) -> Result<(Source<'a>, f64), Skip>,
    ) -> Self {
        let (mut sources, mut chances) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        for (source, weight) in lights.iter().filter(|light| !light.is_dark()).filter_map(|light| see(light).ok()) {
            sum += weight;
            sources.push(source);
            chances.push(sum);
        }
        chances.iter_mut().for_each(|chance| *chance /= sum);
        Self { reflector, sources, chances }
    }

    /// Diffuse and specular radiance towards the eye by `n` samples: each a direction to a light and one by each lobe.
    pub fn sample(&self, key: Key, n: u32) -> [DVec3; 2] {
        let [mut diffuse, mut specular] = [DVec3::ZERO; 2];
        if self.sources.is_empty() {
            return [diffuse, specular];
        }
        let [over_lights, over_lobe, over_cosine] = [0, 1, 2].map(|kind| Sequence::new(key.part(kind)));
        for i in 0..n {
            self.light_sample(over_lights.point(i), &mut diffuse, &mut specular);
            if let Some(gloss) = &self.reflector.specular {
                let direction = gloss.sample(over_lobe.point(i));
                let value = gloss.value(direction);
                if value != DVec3::ZERO {
                    specular += value * self.arriving(direction, gloss.density(direction));
                }
            }
            if let Some(weight) = self.reflector.diffuse {
                let direction = sample_cosine(over_cosine.point(i));
                let density = cosine(direction);
                diffuse += weight * density * self.arriving(direction, density);
            }
        }
        [diffuse / f64::from(n), specular / f64::from(n)]
    }

    /// One direction to a light, for both reflections.
    fn light_sample(&self, [u, v]: [f64; 2], diffuse: &mut DVec3, specular: &mut DVec3) {
        let (chosen, v) = choose(&self.chances, v);
        let chance = self.chances[chosen] - if chosen == 0 { 0.0 } else { self.chances[chosen - 1] };
        let Some(light) = self.sources[chosen].sample([u, v]) else { return };
        let l = light.direction;
        let density = light.density * chance;
        if let Some(weight) = self.reflector.diffuse {
            let cos = cosine(l);
            *diffuse += weight * light.radiance * (cos / (density + cos));
        }
        if let Some(gloss) = &self.reflector.specular {
            let value = gloss.value(l);
            if value != DVec3::ZERO {
                *specular += value * light.radiance / (density + gloss.density(l));
            }
        }
    }

    /// Radiance from a direction found with `density` by a lobe, each light weighted against being found by its area.
    fn arriving(&self, direction: DVec3, density: f64) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let mut start = 0.0;
        for (source, &end) in self.sources.iter().zip(&self.chances) {
            if let Some(light) = source.meet(direction) {
                sum += light.radiance / (density + light.density * (end - start));
            }
            start = end;
        }
        sum
    }
}
