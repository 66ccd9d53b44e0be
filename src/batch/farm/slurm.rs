//! A shell script that submits to Slurm: a job array of the chunks, and a job that follows when all of them have ended, whatever became of them.

use super::words::{line, quoted};
use super::{FarmError, Job};

/// Most tasks of an array, as Slurm comes (`MaxArraySize` less one).
const MOST: usize = 1000;
/// What stands for the items until they are known.
const ITEMS: &str = "ITEMS";

/// The script.
pub fn script(job: &Job) -> Result<String, FarmError> {
    job.check_tasks("a Slurm array", MOST)?;
    let paths = job.words();
    let (before, after) = halves(&job.part_command(&paths, ITEMS, false))?;
    let merge = line(&job.merge_command(&paths, false))?;
    let tasks = job.chunks().count();
    let Job { chunk, items, .. } = job;
    let log = quoted(&format!("{}-%A_%a.log", job.output.replace('%', "%%")))?;
    let log_of_merge = quoted(&format!("{}-merge-%j.log", job.output.replace('%', "%%")))?;
    Ok(format!(
        "#!/bin/sh
# {items} drawings in {tasks} tasks of {chunk}, then one that gathers them. Arguments go to sbatch: sh FILE --partition=night --cpus-per-task=4
set -eu
array=$(sbatch --parsable --job-name=glyphlight --array=1-{tasks} --output={log} \"$@\" <<'END'
#!/bin/sh
first=$((($SLURM_ARRAY_TASK_ID - 1) * {chunk} + 1))
last=$(($first + {chunk} - 1))
if [ $last -gt {items} ]; then last={items}; fi
exec {before} \"$first-$last\" {after}
END
)
sbatch --parsable --job-name=glyphlight-merge --dependency=\"afterany:${{array%%;*}}\" --output={log_of_merge} \"$@\" <<'END'
#!/bin/sh
exec {merge}
END
"
    ))
}

/// What is before the items and what is behind.
fn halves(words: &[String]) -> Result<(String, String), FarmError> {
    let at = words.iter().position(|word| word == "--items").map_or(words.len(), |at| at + 1);
    Ok((line(&words[..at])?, line(words.get(at + 1..).unwrap_or_default())?))
}
