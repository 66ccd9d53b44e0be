//! Rounds of renderings: every technique once a round, so that what slows the machine slows all of them.

use crate::backend::cpu::CpuBackend;
use crate::backend::technique::ReferenceLobe;
use crate::backend::{Backend, Horizons, Rendering, Settings, Stats, Technique};
use crate::cli::backend::{BackendArg, Backends};
use crate::cli::progress::Line;
use crate::cli::stages::times;
use crate::error::Error;
use crate::film::Film;
use crate::light::{AreaLight, Form, Layer};
use crate::report::statistics::median;
use crate::report::{LeftOut, RectangleTime};
use crate::scene::Scene;
use crate::shape::{Bounds, CubicBez, Shape};
use glam::{DVec2, DVec3};

/// What takes longer is run once, seconds.
const SLOW: f64 = 5.0;

/// What a picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// To be judged.
    Technique,
    /// To judge integrals by.
    Yardstick,
    /// To judge integral and fit by.
    Truth,
}

/// A picture to be made.
#[derive(Clone, Debug)]
pub struct Entry {
    pub settings: Settings,
    pub role: Role,
}

impl Entry {
    pub fn technique(settings: Settings) -> Self {
        Self { settings, role: Role::Technique }
    }

    pub fn yardstick(settings: Settings) -> Self {
        Self { settings, role: Role::Yardstick }
    }

    pub fn truth(settings: Settings) -> Self {
        Self { settings, role: Role::Truth }
    }

    /// What tables call it.
    pub fn label(&self) -> String {
        let name = self.settings.technique.to_string();
        match (self.role, self.settings.technique) {
            (Role::Truth, _) => format!("{name} GGX"),
            (_, Technique::Reference(s)) if s.lobe == ReferenceLobe::Ltc => match self.clips_at_cosine() {
                true => format!("{name} LTC, cosine horizon"),
                false => format!("{name} LTC"),
            },
            (Role::Yardstick, _) if self.clips_at_cosine() => format!("{name}, cosine horizon"),
            _ => name,
        }
    }

    fn clips_at_cosine(&self) -> bool {
        self.role == Role::Yardstick && self.settings.horizons() == Horizons::Cosine
    }
}

/// A picture with what it took.
pub struct Measured {
    pub entry: Entry,
    pub film: Film,
    pub backend: String,
    pub device: String,
    shading: Vec<f64>,
    preparing: Vec<f64>,
}

impl Measured {
    fn new(entry: Entry, film: Film, stats: Stats) -> Self {
        let (shading, preparing) = times(&stats);
        let Stats { backend, device, .. } = stats;
        Self { entry, film, backend, device, shading: vec![shading], preparing: vec![preparing] }
    }

    pub fn runs(&self) -> usize {
        self.shading.len()
    }

    pub fn seconds(&self) -> f64 {
        median(&self.shading)
    }

    pub fn prepare_seconds(&self) -> f64 {
        median(&self.preparing)
    }

    /// The standard error of the picture by its own account, root mean square over pixels and channels; only sampling has one.
    pub fn noise(&self) -> Option<f64> {
        let variance = self.film.variance.as_ref()?.as_flattened();
        Some((variance.iter().map(|&v| f64::from(v)).sum::<f64>() / variance.len() as f64).sqrt())
    }

    /// The file of its picture.
    pub fn file(&self, ending: &str) -> String {
        format!("pictures/{}.{ending}", stem(&self.entry.label()))
    }
}

/// The name of a file from that of a technique.
pub fn stem(label: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-.".contains(c) { c.to_ascii_lowercase() } else { '-' };
    let text: String = label.replace(", ", "-").chars().map(plain).collect();
    text.trim_matches('-').into()
}

/// All pictures, and the times of rectangles in place of the lights.
pub struct All {
    pub entries: Vec<Measured>,
    pub failed: Vec<LeftOut>,
    rectangles: Vec<(String, Vec<f64>)>,
}

impl All {
    fn time_rectangle(&mut self, stats: Stats) {
        let (seconds, _) = times(&stats);
        match self.rectangles.iter_mut().find(|(backend, _)| *backend == stats.backend) {
            Some((_, times)) => times.push(seconds),
            None => self.rectangles.push((stats.backend, vec![seconds])),
        }
    }

    /// The median time of rectangles on a backend.
    pub fn rectangle(&self, backend: &str) -> Option<f64> {
        self.rectangles.iter().find(|(name, _)| name == backend).map(|(_, times)| median(times))
    }

    pub fn rectangle_times(&self, settings: &Settings) -> Vec<RectangleTime> {
        let time = |(backend, times): &(String, Vec<f64>)| {
            let seconds = median(times);
            RectangleTime { backend: backend.clone(), seconds, ms_per_megapixel: per_megapixel(seconds, settings) }
        };
        self.rectangles.iter().map(time).collect()
    }
}

/// Milliseconds per million pixels.
pub fn per_megapixel(seconds: f64, settings: &Settings) -> f64 {
    seconds * 1e3 / (f64::from(settings.width) * f64::from(settings.height) * 1e-6)
}

/// Renders all entries in rounds, `repeat` times at most. A technique that fails is left out; a yardstick that fails is an
/// error.
pub fn all(scene: &Scene, entries: Vec<Entry>, backends: &Backends, repeat: u32) -> Result<All, Error> {
    let render = |settings: &Settings| match settings.technique {
        Technique::Reference(_) => Backends::new(BackendArg::Cpu).render(scene, settings),
        technique if technique.is_cpu_only() => CpuBackend.render(scene, settings),
        _ => backends.render(scene, settings),
    };
    let line = Line::default();
    let say = |round: u32, what: &str| line.say(format_args!("round {round} of {repeat}: {what}"));
    let flat = with_rectangles(scene)?;
    // Every entry has the same size and tolerance.
    let rectangle =
        entries.first().map(|e| Settings { technique: Technique::Tree, horizons: Horizons::Both, ..e.settings });
    let on_cpu = entries.iter().any(|e| e.settings.technique.is_cpu_only());
    let mut all = All { entries: Vec::new(), failed: Vec::new(), rectangles: Vec::new() };
    let mut waiting = entries;
    for round in 1..=repeat {
        if let Some(settings) = &rectangle {
            say(round, "rectangles");
            all.time_rectangle(backends.render(&flat, settings)?.stats);
            if on_cpu && all.rectangles.iter().any(|(backend, _)| backend != "cpu") {
                all.time_rectangle(CpuBackend.render(&flat, settings)?.stats);
            }
        }
        for measured in all.entries.iter_mut().filter(|m| m.shading[0] + m.preparing[0] <= SLOW) {
            let settings = &measured.entry.settings;
            say(round, &measured.entry.label());
            let (shading, preparing) = times(&render(settings)?.stats);
            measured.shading.push(shading);
            measured.preparing.push(preparing);
        }
        // In the first round only.
        for entry in waiting.drain(..) {
            say(round, &entry.label());
            match render(&entry.settings) {
                Ok(Rendering { film, stats, .. }) => all.entries.push(Measured::new(entry, film, stats)),
                Err(error) if entry.role == Role::Technique => {
                    all.failed.push(LeftOut { technique: entry.label(), reason: error.to_string() });
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
    line.end();
    Ok(all)
}

/// The scene with one rectangle for each light: the bounds of its layers, of the same power.
fn with_rectangles(scene: &Scene) -> Result<Scene, Error> {
    let flatten = |light: &AreaLight| {
        let bounds = light.layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
        let corners =
            [bounds.min, DVec2::new(bounds.max.x, bounds.min.y), bounds.max, DVec2::new(bounds.min.x, bounds.max.y)];
        let sides = (0..4).map(|i| CubicBez::line(corners[i], corners[(i + 1) % 4])).collect();
        let shape = Shape::from_contours(vec![sides]).map_err(|e| Error::Usage(format!("{}: {e}", light.name)))?;
        let power: DVec3 = light.layers.iter().map(|l| l.radiance * l.shape.area()).sum();
        let radiance = power / shape.area();
        let layer = Layer { shape, radiance, opacity: 1.0, picture: None };
        Ok(AreaLight { layers: vec![layer], form: Form::Outline, ..light.clone() })
    };
    Ok(Scene { lights: scene.lights.iter().map(flatten).collect::<Result<_, Error>>()?, ..scene.clone() })
}
