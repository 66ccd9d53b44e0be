//! A worker: reads orders on standard input, renders, answers on standard output.

use super::Args;
use crate::backend::Settings;
use crate::batch::confine::{die_with_parent, limit_memory};
use crate::batch::crew::READY;
use crate::batch::job::Order;
use crate::batch::worker::{Plan, Studio};
use crate::cli::backend::{BackendArg, Backends};
use crate::cli::{json, say};
use crate::error::Error;
use crate::scene::Motion;
use crate::scene::file::Loaded;
use std::io::BufRead;
use std::path::Path;

/// Works until there are no more orders.
pub fn run(args: &Args, plan: &Plan, loaded: &Loaded, threads: usize) -> Result<(), Error> {
    die_with_parent();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|e| Error::Usage(format!("--worker {threads}: {e}")))?;
    let Some(slot) = &loaded.slot else { return Err(Error::Usage("the template has no slot".into())) };
    let wanted = args.worker_backend.unwrap_or(args.picture.backend);
    let backends = Backends::new(wanted);
    let still = Motion::STILL;
    let begin = |settings: &Settings| backends.begin(&loaded.scene, &still, settings);
    let mut studio = Studio::new(plan, slot, &begin);
    studio.warm_up()?;
    // Drivers take memory as they like.
    if wanted != BackendArg::Gpu {
        limit_memory(args.limits.memory() * (1 << 20) + of_picture(plan));
    }
    say(READY)?;
    for line in std::io::stdin().lock().lines() {
        let line = line.map_err(|e| Error::io(Path::new("standard input"), e))?;
        let order: Order = serde_json::from_str(&line).map_err(|e| Error::Usage(format!("an order: {e}")))?;
        say(json(&studio.render(&order))?)?;
    }
    Ok(())
}

/// Bytes that pictures of this size take, with what is kept from one to the next.
fn of_picture(plan: &Plan) -> u64 {
    const OF_PIXEL: u64 = 320;
    const OF_SAMPLE: u64 = 64;
    let Settings { width, height, samples, .. } = plan.settings;
    let techniques = if plan.compare { 2 } else { 1 };
    u64::from(width) * u64::from(height) * (OF_PIXEL + OF_SAMPLE * u64::from(samples)) * techniques
}
