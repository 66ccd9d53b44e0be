//! Which pictures of a scene in motion are wanted.

use crate::error::Error;
use crate::scene::Motion;
use std::str::FromStr;

/// Most frames of one run.
const MAX_FRAMES: u32 = 1_000_000;

/// When to look.
#[derive(Debug, clap::Args)]
pub struct FrameArgs {
    /// Render that many frames of a scene with keyframes, from the first to the last; each to a file of its own: the number takes
    /// the place of #### in the name, or stands before the ending
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FRAMES)))]
    frames: Option<u32>,
    /// Times of the first and last frame, seconds, as 0..2.5; without --frames the time of one picture [default: the scene's
    /// first and last keyframe]
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    time: Option<Span>,
}

/// A time, or one and another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    from: f64,
    to: Option<f64>,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let time = |text: &str| match text.trim().parse::<f64>() {
            Ok(time) if time.abs() <= 1e9 => Ok(time),
            _ => Err(format!("{text:?} is not a time within ±1e9 s")),
        };
        match text.split_once("..") {
            Some((from, to)) => Ok(Self { from: time(from)?, to: Some(time(to)?) }),
            None => Ok(Self { from: time(text)?, to: None }),
        }
    }
}

/// Which pictures.
#[derive(Debug, PartialEq)]
pub enum Times {
    /// One, of the scene as it is loaded.
    Loaded,
    /// One at a time, seconds.
    One(f64),
    /// A sequence.
    Frames(Vec<f64>),
}

impl FrameArgs {
    /// Whether files are numbered.
    pub const fn numbers(&self) -> bool {
        self.frames.is_some()
    }

    /// The times of the pictures of a scene that moves so.
    pub fn times(&self, motion: &Motion) -> Result<Times, Error> {
        let still = motion.is_still() && (self.frames.is_some() || self.time.is_some());
        if still {
            return Err(Error::Usage("--frames and --time: the scene has no keyframes".into()));
        }
        let [first, last] = motion.span;
        let (from, to) = match (self.frames, self.time) {
            (None, None) => return Ok(Times::Loaded),
            (None, Some(Span { from, to: None })) => return Ok(Times::One(from)),
            (None, Some(_)) => return Err(Error::Usage("--time A..B: goes with --frames".into())),
            (Some(2..), Some(Span { to: None, .. })) => {
                return Err(Error::Usage("--time: several frames need A..B".into()));
            }
            (Some(_), None) => (first, last),
            (Some(_), Some(Span { from, to })) => (from, to.unwrap_or(from)),
        };
        let count = self.frames.unwrap_or(1);
        let at = |frame: u32| match frame {
            0 => from,
            // Both ends are met to the bit.
            _ if frame == count - 1 => to,
            _ => from + (to - from) * (f64::from(frame) / f64::from(count - 1)),
        };
        Ok(Times::Frames((0..count).map(at).collect()))
    }
}
