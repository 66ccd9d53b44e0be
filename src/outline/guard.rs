//! Runs a library on untrusted input: a panic there becomes an error here, and in a thread of its own so does an endless
//! loop or deep recursion.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
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

thread_local! {
    /// Whether a panic here is reported, not printed.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Turns off the printing of guarded panics.
fn quiet() {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let print = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !GUARDED.get() {
                print(info);
            }
        }));
    });
}

fn reason(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("it panicked").to_owned()
}

/// What `work` returns, or what it panicked with. On this thread: for code that is known to end.
pub(super) fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    quiet();
    let outer = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(outer);
    result.map_err(|panic| reason(&*panic))
}

/// What `work` returns, computed in a thread called `glyphlight-<name>` with `stack` bytes of stack.
pub(super) fn guarded<T: Send + 'static>(
    name: &str,
    stack: usize,
    deadline: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, GuardError> {
    let (sender, receiver) = mpsc::channel();
    // Nobody listens any more once the deadline has passed.
    let run = move || drop(sender.send(caught(work).map_err(GuardError::Failed)));
    let thread = std::thread::Builder::new().name(format!("glyphlight-{name}")).stack_size(stack);
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
        assert_eq!(caught(|| 7), Ok(7));
        assert_eq!(caught(|| -> u8 { panic!("seven {}", 7) }), Err("seven 7".to_owned()));
        assert!(!GUARDED.get());
        let nap = || std::thread::sleep(Duration::from_millis(200));
        assert!(matches!(guarded("test", 1 << 20, Duration::from_millis(1), nap), Err(GuardError::TimedOut)));
    }
}
