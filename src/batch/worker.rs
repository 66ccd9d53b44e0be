//! [`Studio`]: what a worker has made ready once and renders every item with.

use super::job::{Difference, Done, Failure, Order, Outcome, Seconds, Written};
use crate::backend::{BackendError, Rendering, Session, Settings, Technique};
use crate::digest::digest;
use crate::film::{Display, Film, FilmError, Pending};
use crate::light::AreaLight;
use crate::metrics::figures;
use crate::outline::layers::LayerError;
use crate::outline::overlap::OverlapError;
use crate::outline::path::PathError;
use crate::outline::svg::{self, SvgError, SvgOptions};
use crate::scene::folder::{FolderError, read};
use crate::scene::slot::Slot;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Folder of the pictures, below that of the batch.
pub const PICTURES: &str = "pictures";
/// Folder of what they are compared with.
pub const COMPARED: &str = "quad";
/// The masked rectangle that pictures are compared with.
pub const MASK: Technique = Technique::Quad { mask: 512 };
/// Most techniques for which surfaces and what the camera sees of them are kept.
const SESSIONS: usize = 4;

/// How all items are rendered and written.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The folder of the batch.
    pub folder: PathBuf,
    /// How they are rendered, unless an item says otherwise.
    pub settings: Settings,
    /// How PNGs are shown.
    pub display: Display,
    /// Whether EXRs are written as well.
    pub exr: bool,
    /// Whether the masked rectangle is rendered as well.
    pub compare: bool,
    /// How drawings are read, 1 metre along their longer side.
    pub svg: SvgOptions,
}

impl Plan {
    /// The settings of an item.
    pub fn settings(&self, technique: Option<Technique>) -> Settings {
        Settings { technique: technique.unwrap_or(self.settings.technique), ..self.settings }
    }

    /// Whether an item is compared with the masked rectangle.
    pub fn compares(&self, technique: Option<Technique>) -> bool {
        self.compare && self.settings(technique).technique != MASK
    }

    /// The files of an item, below the folder: its pictures, then what they are compared with.
    pub fn files(&self, name: &str, technique: Option<Technique>) -> Vec<String> {
        let mut files = vec![format!("{PICTURES}/{name}.png")];
        if self.exr {
            files.push(format!("{PICTURES}/{name}.exr"));
        }
        if self.compares(technique) {
            files.push(format!("{COMPARED}/{name}.png"));
        }
        files
    }
}

/// What begins a sequence of pictures of the template.
pub type Begin<'a> = dyn Fn(&Settings) -> Result<Box<dyn Session + 'a>, BackendError> + 'a;

/// A template with what has been made of it, which items take turns in.
pub struct Studio<'a> {
    plan: &'a Plan,
    slot: &'a Slot,
    begin: &'a Begin<'a>,
    sessions: Vec<(Settings, Box<dyn Session + 'a>)>,
}

/// Why an item gave no picture.
enum Fault {
    Item(Failure),
    Output(String),
}

impl Fault {
    fn item(reason: impl ToString) -> Self {
        Self::Item(Failure { reason: reason.to_string(), ..Failure::default() })
    }
}

impl From<FilmError> for Fault {
    fn from(error: FilmError) -> Self {
        match error {
            FilmError::NotFinite { .. } | FilmError::Size { .. } | FilmError::Encode { .. } => Self::item(error),
            _ => Self::Output(error.to_string()),
        }
    }
}

impl From<SvgError> for Fault {
    fn from(error: SvgError) -> Self {
        let late = |e: &OverlapError| matches!(e, OverlapError::TimedOut { .. });
        let spent = match &error {
            SvgError::TimedOut { .. } => true,
            SvgError::Layer(LayerError::Overlap { source, .. }) => late(source),
            SvgError::Path { source: PathError::Overlap(source), .. } => late(source),
            _ => false,
        };
        Self::Item(Failure { element: error.element().map(Into::into), reason: error.to_string(), spent })
    }
}

impl<'a> Studio<'a> {
    /// Nothing is made yet.
    pub fn new(plan: &'a Plan, slot: &'a Slot, begin: &'a Begin<'a>) -> Self {
        Self { plan, slot, begin, sessions: Vec::new() }
    }

    /// Renders the template with nothing in its slot: what the surfaces are made into, and what the camera sees of them, is there from
    /// then on.
    ///
    /// # Errors
    /// What is wrong with the template.
    pub fn warm_up(&mut self) -> Result<(), BackendError> {
        let (slot, settings) = (self.slot, self.plan.settings);
        let session = self.session(&settings)?;
        session.fill(slot.light, slot.empty());
        session.frame(0.0).map(drop)
    }

    /// Renders an item and writes its pictures.
    pub fn render(&mut self, order: &Order) -> Outcome {
        let start = Instant::now();
        match self.picture(order) {
            Ok(mut done) => {
                done.seconds.total = start.elapsed().as_secs_f64();
                Outcome::Done(Box::new(done))
            }
            Err(Fault::Item(failure)) => Outcome::Failed(failure),
            Err(Fault::Output(message)) => Outcome::Unwritable { message },
        }
    }

    fn picture(&mut self, order: &Order) -> Result<Done, Fault> {
        let mut seconds = Seconds::default();
        let mut since = Instant::now();
        let mut lap = || {
            let now = Instant::now();
            let lap = now.duration_since(since).as_secs_f64();
            since = now;
            lap
        };
        let bytes = read(&order.file, self.plan.svg.limits.bytes as u64).map_err(|e| match e {
            // As the drawing itself would have it.
            FolderError::TooLarge { bytes, limit, .. } => {
                let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
                Fault::from(SvgError::TooLarge { bytes: size(bytes), limit: size(limit) })
            }
            e => Fault::item(e),
        })?;
        let parsed = svg::parse(&bytes, &self.plan.svg)?;
        seconds.parse = lap();
        let art = parsed.draw()?;
        let warnings = art.warnings.iter().map(|w| (w.element.clone(), w.message.clone())).collect();
        let layers = art.layers.len();
        let curves = art.layers.iter().map(|layer| layer.shape.curves().count()).sum();
        let filled = self.slot.changed(&order.change).fill(&order.name, art).map_err(Fault::item)?;
        seconds.settle = lap();
        let technique = order.technique();
        let (settings, was_black) = (self.plan.settings(technique), filled.was_black);
        let Rendering { film, stats, .. } = self.frame(&settings, filled.light.clone())?;
        let all = lap();
        let shading = ["surfaces", "shading", "sampling", "lights in view"];
        seconds.shade = stats.stages.iter().filter(|s| shading.contains(&s.0.as_str())).map(|s| s.1).sum();
        seconds.tree = (all - seconds.shade).max(0.0);
        let (compared, difference) = if self.plan.compares(technique) {
            let film_of_mask = self.frame(&self.plan.settings(Some(MASK)), filled.light)?.film;
            let [ours, masks]: [Vec<_>; 2] = [&film, &film_of_mask].map(|film| film.reflected().collect());
            let figures = figures(&masks, &ours).map_err(Fault::item)?;
            (Some(film_of_mask), Some(Difference { rmse: figures.rmse, max: figures.max }))
        } else {
            (None, None)
        };
        seconds.compare = lap();
        let pictures = self.write(&self.plan.files(&order.name, technique), &film, compared.as_ref())?;
        seconds.write = lap();
        Ok(Done { input: digest(&bytes), pictures, warnings, was_black, layers, curves, difference, seconds })
    }

    /// The template with `light` in its slot. Everything else is as the pictures before have left it.
    fn frame(&mut self, settings: &Settings, light: AreaLight) -> Result<Rendering, Fault> {
        let slot = self.slot.light;
        let session = self.session(settings).map_err(Fault::item)?;
        session.fill(slot, light);
        session.frame(0.0).map_err(Fault::item)
    }

    /// The sequence of pictures with those settings.
    fn session(&mut self, settings: &Settings) -> Result<&mut (dyn Session + 'a), BackendError> {
        let at = match self.sessions.iter().position(|(known, _)| known == settings) {
            Some(at) => at,
            None => {
                let session = (self.begin)(settings)?;
                if self.sessions.len() == SESSIONS {
                    self.sessions.remove(0);
                }
                self.sessions.push((*settings, session));
                self.sessions.len() - 1
            }
        };
        Ok(&mut *self.sessions[at].1)
    }

    /// Writes all files of an item or none.
    fn write(&self, files: &[String], film: &Film, compared: Option<&Film>) -> Result<Vec<Written>, Fault> {
        let mut pending = Vec::new();
        for file in files {
            let path = self.plan.folder.join(file);
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(|source| FilmError::Io { path: folder.into(), source })?;
            }
            let film = if file.starts_with(COMPARED) { compared.unwrap_or(film) } else { film };
            pending.push(film.encode(&path, &self.plan.display)?);
        }
        pending.into_iter().try_for_each(Pending::keep)?;
        files.iter().map(|file| Ok(Written { path: file.clone(), digest: self.digest_of(Path::new(file))? })).collect()
    }

    fn digest_of(&self, file: &Path) -> Result<String, FilmError> {
        let path = self.plan.folder.join(file);
        let bytes = std::fs::read(&path).map_err(|source| FilmError::Io { path, source })?;
        Ok(digest(&bytes))
    }
}
