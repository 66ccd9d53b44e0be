//! A list of commands for OpenCue's `cuecmd`: each line is one frame.

use super::words::line;
use super::{FarmError, Job};

/// The lines.
pub fn list(job: &Job) -> Result<String, FarmError> {
    let paths = job.words();
    job.chunks()
        .map(|items| {
            let words = job.part_command(&paths, &format!("{}-{}", items.start(), items.end()), false);
            Ok(line(&words)? + "\n")
        })
        .collect()
}
