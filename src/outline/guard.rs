//! Runs a library on untrusted input in a thread of its own: a panic, an endless loop or deep recursion there
//! becomes an error here.

use std::sync::{Once, mpsc};
use std::time::Duration;

/// Why guarded work gave nothing.
#[derive(Debug)]
pub(super) enum GuardError {
    /// The deadline passed. The thread cannot be stopped and works on, unheard, until the process ends.
    TimedOut,
    /// It panicked, or the thread could not be started; with the reason.
    Failed(String),
}

/// Prefix of the names of guarded threads; their panics are reported, not printed.
const PREFIX: &str = "glyphlight-";

/// What `work` returns, computed in a thread called `glyphlight-<name>` with `stack` bytes of stack.
pub(super) fn guarded<T: Send + 'static>(
    name: &str,
    stack: usize,
    deadline: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, GuardError> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let print = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !std::thread::current().name().is_some_and(|n| n.starts_with(PREFIX)) {
                print(info);
            }
        }));
    });
    let (sender, receiver) = mpsc::channel();
    let run = move || {
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).map_err(|panic| {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            GuardError::Failed(text.unwrap_or("it panicked").to_owned())
        });
        // Nobody listens any more once the deadline has passed.
        drop(sender.send(result));
    };
    let thread = std::thread::Builder::new().name(format!("{PREFIX}{name}")).stack_size(stack);
    if let Err(e) = thread.spawn(run) {
        return Err(GuardError::Failed(e.to_string()));
    }
    receiver.recv_timeout(deadline).unwrap_or(Err(GuardError::TimedOut))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_panics_and_delays_come_back() {
        let second = Duration::from_secs(5);
        assert_eq!(guarded("test", 1 << 20, second, || 7).unwrap(), 7);
        let failed = guarded("test", 1 << 20, second, || panic!("seven {}", 7));
        assert!(matches!(failed, Err::<(), _>(GuardError::Failed(text)) if text == "seven 7"));
        let nap = || std::thread::sleep(Duration::from_millis(200));
        assert!(matches!(guarded("test", 1 << 20, Duration::from_millis(1), nap), Err(GuardError::TimedOut)));
    }
}
