//! `--merge`: parts that others have rendered become one whole, the same to the byte as if it had been rendered here.
//!
//! # `--json`
//! ```text
//! { "event": "missing", "number", "name", "file", "reason" }
//! { "event": "failed", "number", "file", "reason" }
//! { "event": "end", "parts", "merged", "kept", "failed", "missing", "seconds" }
//! ```

use super::{Batch, Ledger, TOOL, Todo, finish};
use crate::batch::errors::Errors;
use crate::batch::inputs::Item;
use crate::batch::ledger::Entry;
use crate::batch::parts::{self, Found, Parts};
use crate::cli::say;
use crate::digest::digest;
use crate::error::Error;
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Items from one line about progress to the next.
const EVERY: usize = 50;

#[derive(Clone, Copy, Debug, Default)]
struct Count {
    merged: usize,
    kept: usize,
    failed: usize,
    missing: usize,
}

/// Whether every item that was asked for has its picture.
pub fn run(batch: &Batch<'_>, output: &Path) -> Result<bool, Error> {
    let start = Instant::now();
    let items = &batch.items;
    let parts = Parts::open(&batch.args.merge, output, items)?;
    let mut ledger = Ledger::open(output)?;
    let mut errors = Errors::read(output, items, |_| true);
    let mut count = Count::default();
    let asked = batch.asked().count();
    for (index, item) in batch.asked().enumerate() {
        merge(batch, &parts, item, &mut ledger, &mut errors, &mut count)?;
        if batch.args.openjd && (index % EVERY == 0 || index + 1 == asked) {
            say(format!("openjd_progress: {:.1}", 100.0 * (index + 1) as f64 / asked as f64))?;
        }
    }
    ledger.rewrite()?;
    errors.rewrite()?;
    finish::write(batch, &ledger, &errors)?;
    let Count { merged, kept, failed, missing } = count;
    // What is missing may be in them after all.
    if missing == 0 && batch.args.merge.contains(&output.join(parts::PARTS)) {
        parts::remove(output)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    if batch.args.json {
        say(json!({
            "event": "end", "parts": parts.count(), "merged": merged, "kept": kept, "failed": failed, "missing": missing,
            "seconds": seconds,
        }))?;
    } else {
        let page = output.join(finish::PAGE);
        let of = parts.count();
        say(format!(
            "{merged} merged from {of} parts, {kept} kept, {failed} failed, {missing} missing; {seconds:.1} s: {}",
            page.display()
        ))?;
    }
    Ok(failed + missing == 0)
}

fn merge(
    batch: &Batch<'_>,
    parts: &Parts,
    item: &Item,
    ledger: &mut Ledger,
    errors: &mut Errors,
    count: &mut Count,
) -> Result<(), Error> {
    if batch.todo(ledger, item) == Todo::Done {
        errors.remove(item.number);
        count.kept += 1;
        return Ok(());
    }
    let limit = batch.plan.svg.limits.bytes as u64;
    let drawing = crate::scene::folder::read(&item.file, limit).map(|bytes| digest(&bytes));
    let settings = batch.settings(item);
    let files = batch.plan.files(&item.name, item.technique);
    let fits = |entry: &Entry| {
        let same = entry.pictures.iter().map(|picture| &picture.path).eq(&files);
        same && entry.tool == TOOL && entry.settings == settings && drawing.as_ref().is_ok_and(|d| *d == entry.input)
    };
    let found = parts.find(item, fits);
    let reason = match &found {
        Some(Found::Done(part, entry)) if parts::take_over(ledger, part, entry, item)? => {
            errors.remove(item.number);
            count.merged += 1;
            return Ok(());
        }
        Some(Found::Done(part, _)) => {
            format!("its picture in {} is not what was written there", part.folder().display())
        }
        Some(Found::Failed(error)) => {
            ledger.strike(&item.name)?;
            errors.add((*error).clone())?;
            count.failed += 1;
            return say_failed(batch, error.number, &item.file, &error.reason);
        }
        None if errors.of(item.number).is_some() => {
            count.failed += 1;
            return Ok(());
        }
        None if parts.names(item) => {
            "its part was made from another drawing, template or options, or by another version".into()
        }
        None => "no part has it".into(),
    };
    count.missing += 1;
    if batch.args.json {
        let file = item.file.display().to_string();
        return say(
            json!({ "event": "missing", "number": item.number, "name": item.name, "file": file, "reason": reason }),
        );
    }
    eprintln!("missing: {} {}: {reason}", item.number, item.file.display());
    Ok(())
}

fn say_failed(batch: &Batch<'_>, number: usize, file: &Path, reason: &str) -> Result<(), Error> {
    if batch.args.json {
        let file = file.display().to_string();
        return say(json!({ "event": "failed", "number": number, "file": file, "reason": reason }));
    }
    eprintln!("failed: {}: {reason}", file.display());
    Ok(())
}
