//! Rounds of renderings of one cell: everything once a round, so that what slows the machine slows all of it.

use super::plan::{Cell, On, Point, UNIFORM_UNIT, UNIT_TOLERANCE};
use super::waiting::timed;
use crate::backend::cpu::CpuBackend;
use crate::backend::technique::Sampling;
use crate::backend::{Backend, BackendError, Horizons, Rendering, Settings, Technique};
use crate::cli::backend::{BackendArg, Backends};
use crate::cli::progress::Line;
use crate::cli::stages::times;
use crate::error::Error;
use crate::light::Layer;
use crate::metrics::figures;
use crate::report::LeftOut;
use crate::report::bench::{BenchRow, Ratio};
use crate::report::statistics::{median, spread};
use crate::scene::Scene;
use crate::scene::motion::Motion;
use crate::scene::trial::{Finish, Trial, scene, windows};
use rayon::ThreadPool;
use std::time::Instant;

/// A row whose first run, preparation included, takes longer is not run again, seconds.
const SLOW: f64 = 1.0;
/// A rendering shorter than this is repeated where it had to wait for the processor, seconds,
const SHORT: f64 = 0.02;
/// … so many times at most.
const RETRIES: usize = 4;

/// What runs everything.
pub struct Bencher {
    pool: ThreadPool,
    gpu: Backends,
    side: u32,
    repeats: u32,
    /// Light samples per pixel of the GGX reference.
    reference: Option<u32>,
    line: Line,
}

/// The pixels of all windows, one after the other, and what they took.
struct Windows {
    /// Nanoseconds of shading a pixel.
    nanoseconds: f64,
    /// Seconds before, mean over the windows.
    preparing: f64,
    parts: f64,
    reflected: Vec<[f32; 3]>,
    /// Standard error, root mean square; of sampled pictures only.
    noise: Option<f64>,
    device: String,
    clock: String,
}

/// Something that goes round.
struct Runner<'s> {
    on: On,
    /// What is to be a row; nothing for a unit that nobody asked for.
    point: Option<&'s Point>,
    settings: Settings,
    scenes: &'s [Scene],
    first: Windows,
    nanoseconds: Vec<f64>,
    preparing: Vec<f64>,
    slow: bool,
}

/// What one cell came to.
#[derive(Default)]
pub struct Measured {
    pub rows: Vec<BenchRow>,
    pub left_out: Vec<LeftOut>,
    /// Of GPU rows.
    pub adapter: Option<String>,
    /// What those were timed by.
    pub clock: Option<String>,
}

impl Bencher {
    pub fn new(side: u32, repeats: u32, threads: usize, reference: Option<u32>) -> Result<Self, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| Error::Usage(format!("--threads {threads}: {e}")))?;
        Ok(Self { pool, gpu: Backends::new(BackendArg::Gpu), side, repeats, reference, line: Line::default() })
    }

    /// Why there is no GPU to run on.
    pub fn gpu(&self) -> Result<(), BackendError> {
        self.gpu.of(&Technique::Tree).map(|_| ())
    }

    /// Shows what goes on.
    pub fn say(&self, what: impl std::fmt::Display) {
        self.line.say(what);
    }

    fn scenes(&self, layers: &[Layer], finish: Finish) -> Vec<Scene> {
        let all = scene(layers.to_vec(), finish);
        windows(self.side).map(|camera| Scene { camera, ..all.clone() }).into()
    }

    /// A rendering, and the part of its shading that it ran and did not wait for the processor.
    pub fn render(&self, on: On, scene: &Scene, settings: &Settings) -> Result<(Rendering, f64), BackendError> {
        if on == On::Gpu {
            return Ok((self.gpu.of(&settings.technique)?.render(scene, settings)?, 1.0));
        }
        if self.pool.current_num_threads() > 1 {
            return Ok((self.pool.install(|| CpuBackend.render(scene, settings))?, 1.0));
        }
        for _ in 0..RETRIES {
            let since = Instant::now();
            let (rendering, waited) = self.pool.install(|| timed(|| CpuBackend.render(scene, settings)));
            let (rendering, seconds) = (rendering?, since.elapsed().as_secs_f64());
            if waited <= 0.0 {
                return Ok((rendering, 1.0));
            }
            let (shading, _) = times(&rendering.stats);
            if shading > 0.5 * seconds && seconds > SHORT {
                return Ok((rendering, (1.0 - waited / seconds).max(0.0)));
            }
            // Which of its stages waited isn't known.
            if seconds > SHORT {
                return Ok((rendering, 1.0));
            }
        }
        Ok((self.pool.install(|| CpuBackend.render(scene, settings))?, 1.0))
    }

    /// The pictures of a sequence at these times, and the seconds from nothing at all to the last of them.
    pub fn sequence(
        &self,
        on: On,
        (scene, motion): (&Scene, &Motion),
        settings: &Settings,
        times: &[f64],
    ) -> Result<(Vec<Rendering>, f64), BackendError> {
        let run = |backend: &dyn Backend| {
            let since = Instant::now();
            let mut session = backend.begin(scene, motion, settings)?;
            let renderings = times.iter().map(|&time| session.frame(time)).collect::<Result<_, _>>()?;
            Ok((renderings, since.elapsed().as_secs_f64()))
        };
        match on {
            On::Cpu => self.pool.install(|| run(&CpuBackend)),
            On::Gpu => run(self.gpu.of(&settings.technique)?),
        }
    }

    fn all_windows(
        scenes: &[Scene],
        render: impl Fn(&Scene) -> Result<(Rendering, f64), BackendError>,
    ) -> Result<Windows, BackendError> {
        let (mut shading, mut preparing, mut shaded, mut nodes) = (0.0, 0.0, 0, 0);
        let mut reflected = Vec::new();
        let mut variances = Vec::new();
        let (mut device, mut clock) = (String::new(), String::new());
        for scene in scenes {
            let (Rendering { film, stats, .. }, ran) = render(scene)?;
            let (seconds, before) = times(&stats);
            shading += seconds * ran;
            preparing += before;
            shaded += stats.shaded;
            nodes += stats.nodes;
            reflected.extend(film.reflected());
            variances.extend(film.variance.iter().flatten().flatten().map(|&v| f64::from(v)));
            (device, clock) = (stats.device, stats.clock);
        }
        let pixels = shaded.max(1) as f64;
        let noise = (!variances.is_empty()).then(|| (variances.iter().sum::<f64>() / variances.len() as f64).sqrt());
        let (nanoseconds, preparing) = (shading * 1e9 / pixels, preparing / scenes.len().max(1) as f64);
        Ok(Windows { nanoseconds, preparing, parts: nodes as f64 / pixels, reflected, noise, device, clock })
    }

    /// Starts something; its first run warms caches and pipelines up.
    fn start<'s>(
        &self,
        on: On,
        point: Option<&'s Point>,
        settings: Settings,
        scenes: &'s [Scene],
    ) -> Result<Runner<'s>, BackendError> {
        let run = || Self::all_windows(scenes, |scene| self.render(on, scene, &settings));
        if on == On::Gpu {
            // Compiles, for a window that needs what others don't as well: that says nothing of how long a run takes.
            run()?;
        }
        let since = Instant::now();
        let first = run()?;
        let slow = since.elapsed().as_secs_f64() > SLOW;
        let (nanoseconds, preparing) =
            if slow { (vec![first.nanoseconds], vec![first.preparing]) } else { (vec![], vec![]) };
        Ok(Runner { on, point, settings, scenes, first, nanoseconds, preparing, slow })
    }

    fn again(&self, runner: &mut Runner<'_>) -> Result<(), BackendError> {
        if !runner.slow {
            let run = Self::all_windows(runner.scenes, |scene| self.render(runner.on, scene, &runner.settings))?;
            runner.nanoseconds.push(run.nanoseconds);
            runner.preparing.push(run.preparing);
        }
        Ok(())
    }

    /// Measures a cell. `rectangle` are the layers of the unit.
    ///
    /// # Errors
    /// A light or a yardstick that fails. A technique that fails is left out.
    pub fn cell(&self, cell: &Cell, rectangle: &[Layer]) -> Result<Measured, Error> {
        let here = format!("{}, {}", cell.trial, cell.finish);
        let layers = cell.trial.layers()?;
        let scenes = self.scenes(&layers, cell.finish);
        let flat = self.scenes(rectangle, cell.finish);
        let mut measured = Measured::default();
        let mut runners: Vec<Runner<'_>> = Vec::new();
        let mut backends: Vec<On> = Vec::new();
        for (on, point) in &cell.points {
            self.line.say(format_args!("{here}: {on} {}", point.label()));
            match self.start(*on, Some(point), point.settings(self.side), &scenes) {
                Ok(runner) => {
                    if !backends.contains(on) {
                        backends.push(*on);
                    }
                    runners.push(runner);
                }
                Err(error) => {
                    let technique = format!("{here}, {on}, {}", point.label());
                    measured.left_out.push(LeftOut { technique, reason: error.to_string() });
                }
            }
        }
        let unit = |technique| {
            let (width, height) = (self.side, self.side);
            Settings { width, height, samples: 1, tolerance: UNIT_TOLERANCE, technique, ..Settings::default() }
        };
        for on in backends.iter().copied() {
            runners.push(self.start(on, None, unit(Technique::Tree), &flat)?);
            if !runners.iter().any(|r| r.on == on && r.settings.technique == UNIFORM_UNIT) {
                runners.push(self.start(on, None, unit(UNIFORM_UNIT), &scenes)?);
            }
        }
        for round in 1..=self.repeats {
            self.line.say(format_args!("{here}: round {round} of {}", self.repeats));
            runners.iter_mut().try_for_each(|runner| self.again(runner))?;
        }
        self.line.say(format_args!("{here}: yardsticks"));
        let judge = Judge::new(self, cell, &scenes, &runners)?;
        for on in backends {
            let of = |r: &&Runner<'_>| r.on == on;
            let rectangle = runners.iter().filter(of).find(|r| std::ptr::eq(r.scenes, &*flat));
            let uniform = runners.iter().filter(of).find(|r| r.settings.technique == UNIFORM_UNIT);
            for runner in runners.iter().filter(of) {
                if let Some(point) = runner.point {
                    let units = [rectangle, uniform].map(|unit| Ratio::of(&runner.nanoseconds, &unit?.nanoseconds));
                    measured.rows.push(judge.row(cell.trial, &layers, runner, point, units)?);
                }
            }
        }
        let on_gpu = runners.iter().find(|r| r.on == On::Gpu);
        measured.adapter = on_gpu.map(|r| r.first.device.clone());
        measured.clock = on_gpu.map(|r| r.first.clock.clone());
        self.line.end();
        Ok(measured)
    }
}

/// What is right.
struct Judge {
    finish: Finish,
    /// The same lobe, integrated exactly and clipped at a horizon; pictures as flat bands.
    exact: Vec<(Horizons, Windows)>,
    truth: Option<Windows>,
}

impl Judge {
    fn new(bencher: &Bencher, cell: &Cell, scenes: &[Scene], runners: &[Runner<'_>]) -> Result<Self, Error> {
        let (side, finish) = (bencher.side, cell.finish);
        let on_all_threads = |scenes: &[Scene], settings: Settings| {
            Bencher::all_windows(scenes, move |scene| Ok((CpuBackend.render(scene, &settings)?, 1.0)))
        };
        let flat = bencher.scenes(&cell.trial.flat_layers()?, finish);
        let default = Settings { width: side, height: side, samples: 1, ..Settings::default() };
        let mut exact: Vec<(Horizons, Windows)> = Vec::new();
        for runner in runners {
            let horizons = Self::horizons(finish, &runner.settings);
            if !exact.iter().any(|(known, _)| *known == horizons) {
                let settings = Settings { technique: Technique::Exact, horizons, ..default };
                exact.push((horizons, on_all_threads(&flat, settings)?));
            }
        }
        let ggx = |spp| Technique::Reference(Sampling { spp, ..Sampling::default() });
        let truth = bencher.reference.map(|spp| on_all_threads(scenes, Settings { technique: ggx(spp), ..default }));
        Ok(Self { finish, exact, truth: truth.transpose()? })
    }

    /// Diffuse light has one horizon: its cosine's is the surface's.
    fn horizons(finish: Finish, settings: &Settings) -> Horizons {
        if finish == Finish::Diffuse { Horizons::Both } else { settings.horizons() }
    }

    fn row(
        &self,
        trial: Trial,
        layers: &[Layer],
        runner: &Runner<'_>,
        point: &Point,
        [rectangles, uniforms]: [Option<Ratio>; 2],
    ) -> Result<BenchRow, Error> {
        let horizons = Self::horizons(self.finish, &runner.settings);
        let exact = self.exact.iter().find(|(known, _)| *known == horizons);
        let Some((_, exact)) = exact else { return Err(Error::Usage(format!("{}: no yardstick", point.label()))) };
        let against = |yardstick: &Windows| figures(&runner.first.reflected, &yardstick.reflected);
        Ok(BenchRow {
            shape: trial.to_string(),
            curves: layers.iter().map(|l| l.shape.curves().count()).sum(),
            finish: self.finish.to_string(),
            backend: runner.on.to_string(),
            technique: point.name.to_owned(),
            knob: point.knob.clone(),
            runs: runner.nanoseconds.len(),
            nanoseconds: median(&runner.nanoseconds),
            spread: spread(&runner.nanoseconds),
            prepare_seconds: median(&runner.preparing),
            parts: runner.first.parts,
            rectangles,
            uniforms,
            errors: against(exact)?,
            total: self.truth.as_ref().map(against).transpose()?,
            total_noise: self.truth.as_ref().and_then(|t| t.noise),
        })
    }
}
