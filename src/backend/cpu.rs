//! The CPU backend: rows of pixels over rayon, no driver needed.

use super::emitter::Skip;
use super::gather::Images;
use super::prepared::Prepared;
use super::surfaces::Surfaces;
use super::{Backend, BackendError, Counters, Rendering, Settings, Shaded, Stats, Stopwatch, Technique, reference};
use crate::brdf::ltc::Table;
use crate::kernel::cluster::Field;
use crate::kernel::frame::ShadingFrame;
use crate::kernel::surface::{SurfacePoint, surface_point};
use crate::kernel::tree::Budget;
use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;

/// Renders on the processor.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl Backend for CpuBackend {
    fn render(&self, scene: &Scene, settings: &Settings) -> Result<Rendering, BackendError> {
        if let Technique::Reference(sampling) = &settings.technique {
            return reference::render(scene, settings, sampling, &|_, _| ());
        }
        let mut watch = Stopwatch::default();
        let prepared = Prepared::new(scene, settings)?;
        watch.lap("trees");
        let surfaces = Surfaces::new(&prepared);
        watch.lap("surfaces");
        let table = Table::shipped();
        let width = settings.width as usize;
        let mut pixels = vec![Shaded::default(); width * settings.height as usize];
        let counters = pixels
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| {
                let mut counters = Counters::new(scene);
                for (x, pixel) in row.iter_mut().enumerate() {
                    for &offset in &prepared.offsets {
                        let direction = settings.direction(&prepared.rays, x as u32, y as u32, offset);
                        let Some((index, hit)) = surfaces.nearest(direction) else { continue };
                        let point = surface_point(
                            &prepared.triangles[index],
                            &prepared.materials,
                            &prepared.textures(),
                            &prepared.rays,
                            direction,
                            hit,
                        );
                        let before = counters.nodes;
                        let [diffuse, specular] = shade(&prepared, table, settings, &point, &mut counters);
                        pixel.diffuse += diffuse;
                        pixel.specular += specular;
                        pixel.coverage += 1.0;
                        pixel.parts += (counters.nodes - before) as f32;
                    }
                    pixel.scale(1.0 / settings.samples as f32);
                }
                counters
            })
            .reduce(|| Counters::new(scene), Counters::plus);
        watch.lap("shading");
        let film = super::compose(scene, &prepared, &surfaces, settings, &pixels);
        watch.lap("lights in view");
        let stats = Stats {
            backend: "cpu".into(),
            device: format!("{} threads", rayon::current_num_threads()),
            technique: settings.technique.to_string(),
            stages: watch.laps,
            shaded: counters.shaded,
            integrals: counters.integrals,
            nodes: counters.nodes,
            lights: counters.lights,
        };
        Ok(Rendering { film, parts: pixels.iter().map(Shaded::parts_per_sample).collect(), stats })
    }
}

/// Diffuse and specular radiance of a point towards the eye.
fn shade(
    prepared: &Prepared,
    table: &Table,
    settings: &Settings,
    point: &SurfacePoint,
    counters: &mut Counters,
) -> [Vec3; 2] {
    counters.shaded += 1;
    let position = point.position.as_dvec3();
    let frame = ShadingFrame::new(point.normal.as_dvec3().normalize(), point.view.as_dvec3().normalize());
    let reflectance = point.reflectance(prepared.lobe(table, point.alpha, frame.cos_theta as f32));
    let mut budget = Budget::default();
    let lobes = [(None, reflectance.diffuse), (Some(&reflectance.lobe), reflectance.specular)];
    let mut sums = [Vec3::ZERO; 2];
    let fields = lobes.map(|(lobe, weight)| {
        (weight.max_element() > 0.0).then(|| Field::new(&frame, lobe, weight))
    });
    let answer = prepared.clustered.share_out(point.position, &fields, settings.tolerance, &mut budget, |i, mask, budget| {
        let emitter = &prepared.emitters[i];
        let stats = &mut counters.lights[emitter.light];
        stats.candidates += 2;
        let images = match Images::new(emitter, &frame, position) {
            Ok(images) => images,
            Err(_) => {
                stats.behind += 2;
                return;
            }
        };
        for (k, ((lobe, weight), sum)) in lobes.into_iter().zip(&mut sums).enumerate() {
            if mask & 1 << k == 0 {
                continue;
            }
            let weight = weight * emitter.radiance;
            let brightest = weight.max_element();
            if brightest <= 0.0 {
                stats.no_lobe += 1;
                continue;
            }
            match images.integral(emitter, lobe, settings.tolerance / brightest, budget) {
                Ok(integral) => {
                    counters.integrals += 1;
                    counters.nodes += u64::from(integral.visited);
                    *sum += weight * integral.value.as_vec3();
                }
                Err(Skip::Behind) => stats.behind += 1,
                Err(Skip::BelowHorizon) => stats.below_horizon += 1,
            }
        }
    });
    counters.nodes += u64::from(answer.visited);
    let [diffuse, specular] = answer.radiance;
    [diffuse + sums[0], specular + sums[1]]
}
