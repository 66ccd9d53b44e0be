//! What a batch says while it runs: a bar on a terminal, plain lines elsewhere, or lines of JSON.
//!
//! # `--json`
//! One object on each line of standard output, told apart by `event`:
//!
//! ```text
//! { "event": "begin", "todo", "kept", "workers" }
//! { "event": "item", "number", "name", "file", "outcome": "done", "pictures": [ path ], "warnings": [ [ element, message ] ],
//!   "was_black", "layers", "curves", "difference": { "rmse", "max" } or null,
//!   "seconds": { "parse", "settle", "tree", "shade", "write", "compare", "total", "wall" }, "finished", "todo" }
//! { "event": "item", "number", "name", "file", "outcome": "failed", "element" (or null), "reason", "seconds": { "wall" }, "finished", "todo" }
//! { "event": "end", "done", "kept", "failed", "left", "seconds", "items_per_second", "sum": the seconds of all items by phase, "overhead": the part of
//!   their time that was not shading }
//! { "event": "plan", "number", "name", "file", "picture", "what" }   with --dry-run
//! ```

use super::Args;
use crate::batch::crew::Report;
use crate::batch::errors::Errors;
use crate::batch::inputs::Item;
use crate::batch::job::{Failure, Outcome, Seconds};
use crate::cli::say;
use crate::error::Error;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::Path;
use std::time::{Duration, Instant};

/// How often a plain line says how far it is.
const EVERY: Duration = Duration::from_secs(5);
/// Most failures that are listed at the end.
const LISTED: usize = 20;

/// How many items there were.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub done: usize,
    /// Those that an earlier run has done.
    pub kept: usize,
    pub failed: usize,
}

/// Where it is said.
enum Voice {
    Bar(ProgressBar),
    Lines { last: Instant },
    Json,
    OpenJd,
}

/// What is said.
pub struct Progress {
    voice: Voice,
    tally: Tally,
    todo: usize,
    begun: Instant,
    sum: Seconds,
}

/// Says what would be done with an item.
pub fn say_planned(item: &Item, what: &str, picture: &str) -> Result<(), Error> {
    let Item { number, name, file, .. } = item;
    say(json!({
        "event": "plan", "number": number, "name": name, "file": file.display().to_string(), "picture": picture, "what": what,
    }))
}

impl Progress {
    pub fn begin(args: &Args, todo: usize, tally: Tally, workers: usize) -> Result<Self, Error> {
        let voice = match () {
            () if args.json => Voice::Json,
            () if args.openjd => Voice::OpenJd,
            () if std::io::stderr().is_terminal() => {
                let bar = ProgressBar::with_draw_target(Some(todo as u64), ProgressDrawTarget::stderr());
                bar.set_style(style());
                bar.set_message("0 failed");
                bar.enable_steady_tick(Duration::from_millis(500));
                Voice::Bar(bar)
            }
            () => Voice::Lines { last: Instant::now() },
        };
        if matches!(voice, Voice::Json) {
            say(json!({ "event": "begin", "todo": todo, "kept": tally.kept, "workers": workers }))?;
        }
        Ok(Self { voice, tally, todo, begun: Instant::now(), sum: Seconds::default() })
    }

    /// An item is finished.
    pub fn item(&mut self, report: &Report, item: &Item) -> Result<(), Error> {
        match &report.outcome {
            Outcome::Done(done) => {
                self.tally.done += 1;
                self.sum.add(&done.seconds);
            }
            _ => self.tally.failed += 1,
        }
        let finished = self.tally.done + self.tally.failed;
        let failure = match &report.outcome {
            Outcome::Failed(failure) => Some(format!("failed: {}: {}", item.file.display(), failure.reason)),
            _ => None,
        };
        match &mut self.voice {
            Voice::Bar(bar) => {
                if let Some(failure) = failure {
                    bar.suspend(|| eprintln!("{failure}"));
                }
                bar.set_message(format!("{} failed", self.tally.failed));
                bar.set_position(finished as u64);
            }
            Voice::Lines { last } => {
                if let Some(failure) = failure {
                    eprintln!("{failure}");
                }
                if last.elapsed() >= EVERY {
                    *last = Instant::now();
                    let rate = finished as f64 / self.begun.elapsed().as_secs_f64();
                    let left = (self.todo - finished) as f64 / rate;
                    eprintln!(
                        "{finished} of {}, {rate:.1}/s, {left:.0} s left, {} failed",
                        self.todo, self.tally.failed
                    );
                }
            }
            Voice::Json => say(event(report, item, finished, self.todo))?,
            Voice::OpenJd => {
                if let Some(failure) = failure {
                    say(failure)?;
                }
                say(format!("openjd_progress: {:.1}", 100.0 * finished as f64 / self.todo.max(1) as f64))?;
                say(format!("openjd_status: {finished} of {}, {} failed", self.todo, self.tally.failed))?;
            }
        }
        Ok(())
    }

    /// Takes the bar away.
    pub fn pause(&self) {
        if let Voice::Bar(bar) = &self.voice {
            bar.finish_and_clear();
        }
    }

    /// Says how it went; whether nothing failed.
    pub fn end(self, made: &Path, errors: &Errors, seconds: f64) -> Result<bool, Error> {
        let Tally { done, kept, failed } = self.tally;
        let left = self.todo - done - failed;
        let rate = done as f64 / seconds.max(1e-9);
        if matches!(self.voice, Voice::Json) {
            say(json!({
                "event": "end", "done": done, "kept": kept, "failed": failed, "left": left, "seconds": seconds,
                "items_per_second": rate, "sum": self.sum, "overhead": overhead(&self.sum),
            }))?;
            return Ok(failed == 0);
        }
        if errors.iter().count() > LISTED {
            eprintln!("{failed} failed; all of them with their reasons are in {}", errors.path().display());
        }
        let mut line = format!("{done} done");
        for (count, what) in [(kept, "kept"), (failed, "failed"), (left, "not begun")] {
            if count > 0 {
                line += &format!(", {count} {what}");
            }
        }
        say(format!("{line}; {seconds:.1} s, {rate:.1}/s: {}", made.display()))?;
        Ok(failed == 0)
    }
}

/// The part of the items' time that was neither shading nor comparing.
fn overhead(sum: &Seconds) -> f64 {
    let of = sum.total - sum.compare;
    if of > 0.0 { (of - sum.shade) / of } else { 0.0 }
}

fn event(report: &Report, item: &Item, finished: usize, todo: usize) -> Value {
    let mut event = json!({
        "event": "item", "number": item.number, "name": item.name, "file": item.file.display().to_string(),
        "finished": finished, "todo": todo, "seconds": { "wall": report.seconds },
    });
    match &report.outcome {
        Outcome::Done(done) => {
            let Seconds { parse, settle, tree, shade, write, compare, total } = done.seconds;
            event["outcome"] = json!("done");
            event["pictures"] = done.pictures.iter().map(|p| p.path.as_str()).collect();
            event["warnings"] = json!(done.warnings);
            event["was_black"] = json!(done.was_black);
            event["layers"] = json!(done.layers);
            event["curves"] = json!(done.curves);
            event["difference"] = json!(done.difference);
            event["seconds"] = json!({
                "parse": parse, "settle": settle, "tree": tree, "shade": shade, "write": write, "compare": compare,
                "total": total, "wall": report.seconds,
            });
        }
        Outcome::Failed(Failure { element, reason, .. }) => {
            event["outcome"] = json!("failed");
            event["element"] = json!(element);
            event["reason"] = json!(reason);
        }
        Outcome::Unwritable { message } => {
            event["outcome"] = json!("unwritable");
            event["reason"] = json!(message);
        }
    }
    event
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{wide_bar} {pos} of {len}, {rate}, {eta} left, {msg}")
        .expect("the template is checked by a test")
        .with_key("rate", |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            // To a buffer that takes all there is.
            let _ = write!(out, "{:.1}/s", state.per_sec());
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_one_and_overhead_is_what_is_not_shading() {
        let _ = style();
        let sum = Seconds { parse: 1.0, shade: 6.0, write: 1.0, compare: 2.0, total: 10.0, ..Seconds::default() };
        assert!((overhead(&sum) - 0.25).abs() < 1e-12);
        assert!(overhead(&Seconds::default()).abs() < 1e-12);
    }
}
