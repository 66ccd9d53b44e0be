//! `glyphlight batch`: many drawings as lights of one template, each a picture.

mod finish;
mod limits;
mod merge;
mod plan;
mod progress;
mod work;

use super::backend::{BackendArg, Backends};
use super::display::DisplayArgs;
use super::picture::PictureArgs;
use super::scene::open_template;
use super::values::{Color, hex, positive_f64, radiance};
use super::{say, warn};
use crate::backend::Settings;
use crate::batch::BatchError;
use crate::batch::crew::{Crew, Report};
use crate::batch::errors::{Errors, ItemError};
use crate::batch::inputs::{self, Item};
use crate::batch::job::{Failure, Order, Outcome};
use crate::batch::ledger::{Entry, Ledger};
use crate::batch::numbers::Numbers;
use crate::batch::parts;
use crate::batch::worker::Plan;
use crate::digest::digest;
use crate::error::Error;
use crate::outline::svg::SvgOptions;
use crate::scene::file::Loaded;
use crate::scene::slot::Change;
use crate::scene::templates::TEMPLATES;
use limits::LimitArgs;
use progress::{Progress, Tally};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The program as manifests name it.
const TOOL: &str = concat!("glyphlight ", env!("CARGO_PKG_VERSION"));

/// Pixels × samples of an item from which on one alone fills the processors.
const LARGE: u64 = 4 << 20;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Verb {
    #[command(subcommand)]
    verb: Option<Other>,
    #[command(flatten)]
    args: Args,
}

/// What else there is to be done with a batch than to render it.
#[derive(Debug, clap::Subcommand)]
enum Other {
    /// Write the job by which a render farm does the same batch in parts, to standard output
    Plan(Box<plan::PlanArgs>),
}

#[derive(Debug, clap::Args)]
#[command(mut_arg("width", |arg| arg.default_value("512")), mut_arg("height", |arg| arg.default_value("512")))]
pub struct Args {
    /// SVG files, folders of them, patterns such as 'icons/*.svg', lists (.toml, .csv)
    #[arg(value_name = "INPUT", required_unless_present = "list")]
    inputs: Vec<PathBuf>,
    /// Folder to write: pictures/, manifest.jsonl, errors.jsonl, contact.png, index.html. One that an earlier run has left is gone on with
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Scene file whose light has slot = true, or template:NAME for a bundled one
    #[arg(long, value_name = "FILE", default_value = "template:floor")]
    scene: PathBuf,
    /// Print the bundled templates
    #[arg(long)]
    list: bool,
    /// Render these items only, by number, as 1-4,7,20-; their numbers are those of --dry-run
    #[arg(long, value_name = "NUMBERS")]
    items: Option<Numbers>,
    /// Render the items of --items into a folder of their own, DIR/parts/NUMBERS, what is done in DIR left out, for --merge to gather. Items that fail
    /// are no failure of the part
    #[arg(long, requires = "items", conflicts_with = "dry_run")]
    part: bool,
    /// Render nothing: gather what is in this folder, or in folders in it, check it by its digests, and write contact sheet and gallery. May be
    /// given several times. DIR/parts is removed once nothing is missing
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["part", "dry_run", "fail_fast"])]
    merge: Vec<PathBuf>,
    /// Say what would be done, and do nothing
    #[arg(long)]
    dry_run: bool,
    /// Stop at the first item that fails
    #[arg(long)]
    fail_fast: bool,
    /// Say what happens as lines of JSON on standard output
    #[arg(long, conflicts_with = "openjd")]
    json: bool,
    /// Say how far it is as Open Job Description has it, on standard output
    #[arg(long)]
    openjd: bool,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    display: DisplayArgs,
    /// Write every picture as .exr as well (linear, layers)
    #[arg(long)]
    exr: bool,
    /// Render every item by the masked rectangle (quad:512) as well, and show both
    #[arg(long)]
    compare: bool,
    /// Most that a drawing may measure in the slot, along both sides, metres, in place of the template's
    #[arg(long, value_name = "METRES", value_parser = positive_f64)]
    size: Option<f64>,
    /// Radiance of white parts, W/(sr·m²), in place of the template's
    #[arg(long, value_parser = radiance)]
    radiance: Option<f64>,
    /// Colour that all light is multiplied with, #rrggbb
    #[arg(long, value_parser = hex)]
    color: Option<Color>,
    /// Light every part of the drawings alike, whatever their own colours
    #[arg(long)]
    no_svg_colors: bool,
    /// Worker processes [default: one for each processor while pictures are small, else one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    limits: LimitArgs,
    /// Be a worker with that many threads
    #[arg(long, hide = true, value_name = "THREADS")]
    worker: Option<usize>,
    /// Where a worker computes
    #[arg(long, hide = true, value_enum, requires = "worker")]
    worker_backend: Option<BackendArg>,
}

/// What is to be done with an item, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Todo {
    /// There is no picture yet.
    New,
    /// The drawing is another.
    Drawing,
    /// Template, options, or what the list says of the item are others.
    Settings,
    /// Another version made the picture.
    Tool,
    /// The picture is gone or another.
    Picture,
    /// Nothing.
    Done,
}

impl Todo {
    const fn word(self) -> &'static str {
        match self {
            Self::New => "new",
            Self::Drawing => "changed drawing",
            Self::Settings => "changed settings",
            Self::Tool => "another version",
            Self::Picture => "picture gone",
            Self::Done => "done",
        }
    }
}

pub fn run(verb: &Verb) -> Result<bool, Error> {
    match &verb.verb {
        Some(Other::Plan(plan)) => plan::run(plan).map(|()| true),
        None => run_here(&verb.args),
    }
}

fn run_here(args: &Args) -> Result<bool, Error> {
    if args.list {
        return TEMPLATES.iter().try_for_each(|t| say(format!("template:{:<10} {}", t.name, t.about))).map(|()| true);
    }
    let Some(output) = &args.output else { return Err(Error::Usage("batch needs -o DIR".into())) };
    let loaded = open_template(&args.scene)?;
    let plan = plan(args, output)?;
    if let Some(threads) = args.worker {
        return work::run(args, &plan, &loaded, threads).map(|()| true);
    }
    warn(&loaded.warnings);
    let items = inputs::items(&args.inputs)?;
    if let Some(numbers) = &args.items
        && (numbers.largest() > items.len() || !items.iter().any(|item| numbers.holds(item.number)))
    {
        return Err(Error::Usage(format!("--items: there are {} items", items.len())));
    }
    let batch = Batch::new(args, &plan, &loaded, items)?;
    match () {
        () if args.dry_run => batch.describe().map(|()| true),
        () if !args.merge.is_empty() => merge::run(&batch, output),
        () => batch.run(output),
    }
}

/// How items are rendered, by the arguments.
fn plan(args: &Args, output: &Path) -> Result<Plan, Error> {
    Ok(Plan {
        folder: match &args.items {
            Some(items) if args.part => parts::folder(output, items),
            _ => output.into(),
        },
        settings: args.picture.settings()?,
        display: args.display.display(),
        exr: args.exr,
        compare: args.compare,
        svg: SvgOptions { limits: args.limits.svg(), ..SvgOptions::bundled(1.0) },
    })
}

impl Args {
    /// What all items have otherwise than the slot says.
    fn change(&self) -> Change {
        Change {
            size: self.size.map(|size| [size; 2]),
            radiance: self.radiance.map(|radiance| [radiance; 3]),
            color: self.color.map(|color| color.0),
            svg_colors: self.no_svg_colors.then_some(false),
            ..Change::default()
        }
    }

    /// The arguments of a worker.
    fn of_worker(&self, threads: usize, backend: BackendArg) -> Vec<OsString> {
        let mut args: Vec<OsString> = std::env::args_os().skip(1).collect();
        let name = if backend == BackendArg::Gpu { "gpu" } else { "cpu" };
        // Before a `--`, behind which there are inputs only.
        let at = args.iter().position(|arg| arg == "--").unwrap_or(args.len());
        let own = ["--worker".into(), threads.to_string(), "--worker-backend".into(), name.into()];
        args.splice(at..at, own.map(OsString::from));
        args
    }
}

/// A batch before it is begun.
struct Batch<'a> {
    args: &'a Args,
    plan: &'a Plan,
    items: Vec<Item>,
    /// Digest of template, options and backend.
    common: String,
    backend: BackendArg,
}

impl<'a> Batch<'a> {
    fn new(args: &'a Args, plan: &'a Plan, loaded: &Loaded, mut items: Vec<Item>) -> Result<Self, Error> {
        let change = args.change();
        for item in &mut items {
            item.change = merged(&item.change, &change);
        }
        let backend = Backends::new(args.picture.backend).kind(&plan.settings.technique)?;
        let Plan { settings, display, exr, compare, .. } = plan;
        let files = loaded.files.join(" ");
        let common = format!("{}\n{files}\n{settings:?}\n{display:?}\n{exr} {compare}\n{backend:?}", loaded.text);
        Ok(Self { args, plan, items, common: digest(common.as_bytes()), backend })
    }

    /// Digest of all that the picture of an item hangs on but the drawing.
    fn settings(&self, item: &Item) -> String {
        digest(format!("{}\n{:?}\n{:?}", self.common, item.change, item.technique).as_bytes())
    }

    /// What is to be done with an item.
    fn todo(&self, ledger: &Ledger, item: &Item) -> Todo {
        let Some(entry) = ledger.get(&item.name) else { return Todo::New };
        let limit = self.plan.svg.limits.bytes as u64;
        let same = || crate::scene::folder::read(&item.file, limit).is_ok_and(|bytes| digest(&bytes) == entry.input);
        match () {
            () if entry.tool != TOOL => Todo::Tool,
            () if entry.settings != self.settings(item) => Todo::Settings,
            () if !same() => Todo::Drawing,
            () if !ledger.is_there(entry) => Todo::Picture,
            () => Todo::Done,
        }
    }

    /// The items that are asked for.
    fn asked(&self) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(|item| self.is_asked(item))
    }

    fn is_asked(&self, item: &Item) -> bool {
        self.args.items.as_ref().is_none_or(|numbers| numbers.holds(item.number))
    }

    /// Says what would be done.
    fn describe(&self) -> Result<(), Error> {
        let ledger = Ledger::look(&self.plan.folder)?;
        let mut todo = 0;
        for item in self.asked() {
            let what = self.todo(&ledger, item);
            todo += usize::from(what != Todo::Done);
            let picture = format!("pictures/{}.png", item.name);
            if self.args.json {
                progress::say_planned(item, what.word(), &picture)?;
            } else {
                say(format!("{:>6}  {:<16}  {}  {picture}", item.number, what.word(), item.file.display()))?;
            }
        }
        if !self.args.json {
            say(format!("{todo} of {} to do", self.asked().count()))?;
        }
        Ok(())
    }

    /// Whether every item that was asked for has its picture.
    fn run(&self, output: &Path) -> Result<bool, Error> {
        let start = Instant::now();
        let whole = if self.args.part { Some(Ledger::look(output)?) } else { None };
        let mut ledger = Ledger::open(&self.plan.folder)?;
        // Not by the hundred: workers make them as well.
        let folder = self.plan.folder.join(crate::batch::worker::PICTURES);
        std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
        let mut errors = Errors::read(&self.plan.folder, &self.items, |item| !self.is_asked(item));
        let (mut orders, mut tally) = (Vec::new(), Tally::default());
        for item in self.asked() {
            let is_done = |ledger: &Ledger| self.todo(ledger, item) == Todo::Done;
            if is_done(&ledger) || whole.as_ref().is_some_and(is_done) {
                tally.kept += 1;
            } else {
                orders.push(self.order(item));
            }
        }
        let (jobs, threads) = self.crew(orders.len());
        let mut progress = Progress::begin(self.args, orders.len(), tally, jobs)?;
        let crew = Crew {
            program: own_program()?,
            args: self.args.of_worker(threads, self.backend),
            count: jobs,
            time_limit: self.args.limits.time(),
            memory_limit: self.args.limits.memory(),
            fail_fast: self.args.fail_fast,
        };
        let done = crew.run(orders, |report| {
            self.take(&report, &mut ledger, &mut errors)?;
            progress.item(&report, &self.items[report.order.number - 1]).map_err(|e| BatchError::Write(e.to_string()))
        });
        progress.pause();
        ledger.sweep()?;
        done?;
        ledger.rewrite()?;
        errors.rewrite()?;
        if self.args.part {
            let is_good = progress.end(&self.plan.folder, &errors, start.elapsed().as_secs_f64())?;
            return Ok(is_good || !self.args.fail_fast);
        }
        finish::write(self, &ledger, &errors)?;
        progress.end(&self.plan.folder.join(finish::PAGE), &errors, start.elapsed().as_secs_f64())
    }

    fn order(&self, item: &Item) -> Order {
        Order {
            number: item.number,
            file: item.file.clone(),
            name: item.name.clone(),
            change: item.change.clone(),
            technique: item.technique.map(|t| t.to_string()),
        }
    }

    /// Number of workers and threads of each.
    fn crew(&self, orders: usize) -> (usize, usize) {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let Settings { width, height, samples, .. } = self.plan.settings;
        let pixels = u64::from(width) * u64::from(height) * u64::from(samples);
        let jobs = match self.args.jobs {
            Some(jobs) => jobs.into(),
            None if pixels >= LARGE || self.backend == BackendArg::Gpu => 1,
            None => threads,
        };
        let jobs = jobs.min(orders).max(1);
        (jobs, (threads / jobs).max(1))
    }

    /// Notes what has become of an item.
    fn take(&self, report: &Report, ledger: &mut Ledger, errors: &mut Errors) -> Result<(), BatchError> {
        let item = &self.items[report.order.number - 1];
        let file = item.file.display().to_string();
        match &report.outcome {
            Outcome::Done(done) => {
                let done = (**done).clone();
                ledger.add(Entry {
                    name: item.name.clone(),
                    file,
                    input: done.input,
                    settings: self.settings(item),
                    tool: TOOL.into(),
                    pictures: done.pictures,
                    warnings: done.warnings,
                    was_black: done.was_black,
                    layers: done.layers,
                    curves: done.curves,
                    difference: done.difference,
                })
            }
            Outcome::Failed(Failure { element, reason, .. }) => {
                ledger.strike(&item.name)?;
                let (name, element, reason) = (item.name.clone(), element.clone(), reason.clone());
                errors.add(ItemError { number: item.number, name, file, element, reason })
            }
            Outcome::Unwritable { message } => Err(BatchError::Write(message.clone())),
        }
    }
}

/// What an item has otherwise, and where it says nothing, what all have.
fn merged(item: &Change, all: &Change) -> Change {
    Change {
        size: item.size.or(all.size),
        position: item.position.or(all.position),
        rotation: item.rotation.or(all.rotation),
        radiance: item.radiance.or(all.radiance),
        color: item.color.or(all.color),
        svg_colors: item.svg_colors.or(all.svg_colors),
    }
}

/// This program, also where its file has been replaced since it was started.
fn own_program() -> Result<PathBuf, Error> {
    let running = Path::new("/proc/self/exe");
    if running.exists() {
        return Ok(running.into());
    }
    std::env::current_exe().map_err(|e| Error::io(Path::new("glyphlight"), e))
}
