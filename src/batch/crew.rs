//! [`Crew`]: worker processes, each of which does one item after the other, and is killed and replaced if one takes too long.

use super::BatchError;
use super::job::{Failure, Order, Outcome};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a worker says once it is ready for orders.
pub const READY: &str = "ready";
/// Bytes kept of what a worker says on standard error.
const KEPT: usize = 4096;

/// Workers that do items.
#[derive(Debug)]
pub struct Crew {
    /// The program that they run.
    pub program: PathBuf,
    /// Its arguments.
    pub args: Vec<OsString>,
    /// How many there are.
    pub count: usize,
    /// The longest that an item may take.
    pub time_limit: Duration,
    /// What memory an item may take, for messages, MiB.
    pub memory_limit: u64,
    /// Whether no item is begun any more once one has failed.
    pub fail_fast: bool,
}

/// What has become of an item, and how long that took.
pub struct Report {
    /// The item.
    pub order: Order,
    /// What has become of it.
    pub outcome: Outcome,
    /// From the order to the answer, seconds.
    pub seconds: f64,
}

impl Crew {
    /// Has all items done; `report` hears of each as it is finished, in no certain order.
    ///
    /// # Errors
    /// What `report` says, or that no worker can be started; workers are stopped then, whatever they do.
    pub fn run(
        &self,
        orders: Vec<Order>,
        mut report: impl FnMut(Report) -> Result<(), BatchError>,
    ) -> Result<(), BatchError> {
        let count = self.count.min(orders.len());
        let queue = Mutex::new(VecDeque::from(orders));
        let stop = AtomicBool::new(false);
        let abandon = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let (sender, reports) = mpsc::channel();
            for _ in 0..count {
                let (sender, queue, stop, abandon) = (sender.clone(), &queue, &stop, &abandon);
                scope.spawn(move || {
                    let mut hand = None;
                    while !stop.load(Ordering::Relaxed) {
                        let next = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
                        let Some(order) = next else { break };
                        let start = Instant::now();
                        let outcome = self.order(&mut hand, &order, abandon);
                        if self.fail_fast && matches!(outcome, Ok(Outcome::Failed(_))) {
                            stop.store(true, Ordering::Relaxed);
                        }
                        let seconds = start.elapsed().as_secs_f64();
                        let told = outcome.map(|outcome| Report { order, outcome, seconds });
                        if sender.send(told).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(sender);
            let mut result = Ok(());
            for told in reports {
                if result.is_ok() {
                    result = told.and_then(&mut report);
                }
                if result.is_err() {
                    stop.store(true, Ordering::Relaxed);
                    abandon.store(true, Ordering::Relaxed);
                }
            }
            result
        })
    }

    /// Has one item done by the worker at hand, or a new one.
    fn order(&self, hand: &mut Option<Hand>, order: &Order, abandon: &AtomicBool) -> Result<Outcome, BatchError> {
        let mut worker = match hand.take() {
            Some(worker) => worker,
            None => self.hire(abandon)?,
        };
        let line = serde_json::to_string(order).map_err(|e| BatchError::Worker(e.to_string()))?;
        if worker.input.write_all(format!("{line}\n").as_bytes()).and_then(|()| worker.input.flush()).is_err() {
            return Ok(self.lost(worker));
        }
        match worker.answer(self.time_limit, abandon) {
            Answer::Line(line) => match serde_json::from_str(&line) {
                Ok(outcome) => {
                    let spent = matches!(&outcome, Outcome::Failed(failure) if failure.spent);
                    if !spent {
                        *hand = Some(worker);
                    }
                    Ok(outcome)
                }
                Err(e) => Ok(failed(format!("its worker gave no answer: {e}"))),
            },
            Answer::Late => {
                let limit = self.time_limit.as_secs_f64();
                Ok(failed(format!("it takes longer than the limit of {limit} s (--time-limit)")))
            }
            Answer::Gone => Ok(self.lost(worker)),
            Answer::Abandoned => Ok(failed("it was given up".into())),
        }
    }

    /// Starts a worker and waits until it is ready.
    fn hire(&self, abandon: &AtomicBool) -> Result<Hand, BatchError> {
        let mut child = Command::new(&self.program)
            .args(&self.args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| BatchError::Worker(e.to_string()))?;
        let (Some(input), Some(output), Some(errors)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(BatchError::Worker("it has no pipes".into()));
        };
        let (sender, lines) = mpsc::channel();
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let errors = std::thread::spawn(move || last_words(errors));
        let mut hand = Hand { child, input, lines, errors: Some(errors) };
        match hand.answer(Duration::MAX, abandon) {
            Answer::Line(line) if line == READY => Ok(hand),
            Answer::Line(line) => Err(BatchError::Worker(line)),
            _ => {
                let (_, words) = hand.end();
                Err(BatchError::Worker(if words.is_empty() { "it ended at once".into() } else { words }))
            }
        }
    }

    /// What to say of an item whose worker has died.
    fn lost(&self, worker: Hand) -> Outcome {
        let (status, words) = worker.end();
        let memory = ["memory allocation of", "out of memory", "failed to allocate", "Cannot allocate memory"];
        if memory.iter().any(|sign| words.contains(sign)) {
            return failed(format!(
                "it takes more memory than the limit of {} MiB (--memory-limit)",
                self.memory_limit
            ));
        }
        let last = words.lines().last().map_or_else(String::new, |line| format!(": {line}"));
        failed(match status {
            Some(status) => format!("its worker died ({status}){last}"),
            None => format!("its worker died{last}"),
        })
    }
}

fn failed(reason: String) -> Outcome {
    Outcome::Failed(Failure { reason, ..Failure::default() })
}

/// The end of what a worker says on standard error.
fn last_words(mut errors: impl Read) -> String {
    let mut kept: Vec<u8> = Vec::new();
    let mut piece = [0; KEPT];
    while let Ok(count @ 1..) = errors.read(&mut piece) {
        kept.extend(&piece[..count]);
        let excess = kept.len().saturating_sub(KEPT);
        kept.drain(..excess);
    }
    String::from_utf8_lossy(&kept).trim().to_owned()
}

/// A worker. It is killed when it is dropped.
struct Hand {
    child: Child,
    input: ChildStdin,
    lines: Receiver<String>,
    errors: Option<JoinHandle<String>>,
}

/// What a worker says.
enum Answer {
    Line(String),
    Late,
    Gone,
    Abandoned,
}

impl Hand {
    /// Waits for the next line.
    fn answer(&mut self, limit: Duration, abandon: &AtomicBool) -> Answer {
        /// How often it is asked whether anybody still waits for the answer.
        const LOOK: Duration = Duration::from_millis(200);
        let start = Instant::now();
        loop {
            let left = limit.saturating_sub(start.elapsed());
            match self.lines.recv_timeout(left.min(LOOK)) {
                Ok(line) => return Answer::Line(line),
                Err(RecvTimeoutError::Disconnected) => return Answer::Gone,
                Err(RecvTimeoutError::Timeout) if abandon.load(Ordering::Relaxed) => return Answer::Abandoned,
                Err(RecvTimeoutError::Timeout) if start.elapsed() >= limit => return Answer::Late,
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Ends it; how it ended, and the last it said on standard error.
    fn end(mut self) -> (Option<ExitStatus>, String) {
        // It has closed its output: it is dead or about to die.
        let deadline = Instant::now() + Duration::from_secs(2);
        let mut status = None;
        while status.is_none() && Instant::now() < deadline {
            status = self.child.try_wait().ok().flatten();
            if status.is_none() {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        // Where it is dead already that does nothing.
        let _ = self.child.kill();
        let words = self.errors.take().and_then(|errors| errors.join().ok()).unwrap_or_default();
        (status, words)
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        // It may be dead already; waiting leaves no zombie.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
