//! Time that a thread was ready to run and another had the processor: on a busy machine it would count as ours, and more so in
//! long runs than in short ones, which are over before their turn is.

/// Seconds that this thread has waited for a processor since it began. Nothing where the system does not tell: it is the second
/// number of Linux's `/proc/thread-self/schedstat` (its Documentation/scheduler/sched-stats.rst), ns.
fn waited() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_ascii_whitespace().nth(1)?.parse::<f64>().ok()? * 1e-9)
}

/// What a run took, and how long it waited meanwhile, seconds; 0 where the system does not tell.
pub fn timed<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let before = waited();
    let result = run();
    (result, before.zip(waited()).map_or(0.0, |(before, after)| after - before))
}
