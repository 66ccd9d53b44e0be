//! Killed at any moment, a batch is finished by the next run, and nothing shows it.

use super::{SMALL, assert_same, contents, end, events, some};
use crate::cli::Workdir;
use std::time::{Duration, Instant};

/// Lines of the manifest.
fn lines(here: &Workdir) -> usize {
    std::fs::read_to_string(here.path("killed/manifest.jsonl")).map_or(0, |text| text.lines().count())
}

#[test]
fn a_killed_batch_is_gone_on_with() {
    let here = Workdir::new();
    some(&here, 18);
    let args = ["in", "-o", "whole", "--compare", "--exr"];
    events(&here, &args, 1);
    let args = ["in", "-o", "killed", "--compare", "--exr"];
    let mut seen = Vec::new();
    // At random moments after some items have been done.
    for (k, wait) in [0, 7, 23, 3, 41, 13, 29, 1, 17, 5].into_iter().enumerate() {
        let before = lines(&here);
        let mut child = here.command([&["batch"], &args[..], &SMALL].concat());
        let mut child = child.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
        let start = Instant::now();
        let wanted = before + k % 3;
        while lines(&here) < wanted && start.elapsed() < Duration::from_secs(10) && child.try_wait().unwrap().is_none()
        {
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis(wait));
        child.kill().unwrap();
        child.wait().unwrap();
        seen.push(lines(&here));
    }
    assert!(seen.last() > seen.first() && seen.iter().any(|&n| (1..18).contains(&n)), "{seen:?}");
    // A line that was cut off, and a picture that was being written.
    let manifest = here.path("killed/manifest.jsonl");
    let mut text = std::fs::read(&manifest).unwrap();
    text.extend(b"{\"name\":\"0");
    std::fs::write(&manifest, text).unwrap();
    std::fs::create_dir_all(here.path("killed/pictures/deep")).unwrap();
    std::fs::write(here.path("killed/pictures/deep/.glyphlight-x1"), "half").unwrap();
    assert!(contents(&here.path("killed")) != contents(&here.path("whole")));
    let said = events(&here, &args, 1);
    assert!(end(&said)["kept"].as_u64().unwrap() > 0);
    assert_same(&here.path("whole"), &here.path("killed"));
}
