//! The progress of long work, on a terminal only.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;

/// One line on standard error that is written over and over, if that is a terminal; nothing elsewhere.
#[derive(Debug)]
pub struct Line {
    terminal: bool,
}

impl Default for Line {
    fn default() -> Self {
        Self { terminal: std::io::stderr().is_terminal() }
    }
}

impl Line {
    /// Shows `what` in place of what was there.
    pub fn say(&self, what: impl std::fmt::Display) {
        if self.terminal {
            eprint!("\r\x1b[K{what}");
        }
    }

    /// Clears the line.
    pub fn end(&self) {
        self.say("");
    }
}

/// Runs `work` with a bar on standard error that it moves by reporting how many of how many parts are done. Where standard error
/// is no terminal there is no bar. It vanishes when the work is done.
pub fn shown<T>(label: &'static str, work: impl FnOnce(&(dyn Fn(u64, u64) + Sync)) -> T) -> T {
    // Drawn on standard error; hidden by itself where that is no terminal.
    let bar = ProgressBar::new(0).with_style(style()).with_message(label);
    let result = work(&|done, total| {
        bar.set_length(total);
        // Threads report out of order; the bar goes forward only.
        bar.update(|state| state.set_pos(state.pos().max(done)));
    });
    bar.finish_and_clear();
    result
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %, {eta} left")
        .expect("the template is checked by a test")
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_bar_hands_the_result_on() {
        let answer = super::shown("test", |report| {
            report(1, 4);
            report(4, 4);
            report(3, 4);
            42
        });
        assert_eq!(answer, 42);
    }
}
