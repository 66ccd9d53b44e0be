//! Batches: many drawings in one template, by the command as a user runs it.

#[cfg(feature = "gpu")]
mod fill;
mod hostile;
mod icons;
mod kill;
mod lists;
mod output;
mod slot;

use crate::cli::{Workdir, json_lines};
use serde_json::Value;
use std::path::Path;

/// As small as a picture may be that still shows something.
pub const SMALL: [&str; 8] = ["--width", "40", "--height", "40", "--samples", "1", "--backend", "cpu"];

/// A drawing of a square, `inset` from the edge of its picture.
pub fn square(color: &str, inset: u32) -> String {
    let side = 100 - 2 * inset;
    drawing(&format!("<rect id='r' x='{inset}' y='{inset}' width='{side}' height='{side}' fill='{color}'/>"))
}

pub fn drawing(body: &str) -> String {
    format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 100'>{body}</svg>")
}

/// Runs a batch of small pictures with these arguments; exit code, standard output, standard error.
pub fn batch(here: &Workdir, args: &[&str]) -> (i32, String, String) {
    let output = here.run([&["batch"], args, &SMALL[..]].concat());
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The events of a batch that says them, which must end with this exit code.
pub fn events(here: &Workdir, args: &[&str], code: i32) -> Vec<Value> {
    let (got, out, err) = batch(here, &[args, &["--json"]].concat());
    assert_eq!(got, code, "{out}\n{err}");
    json_lines(&out)
}

/// The last event.
pub fn end(events: &[Value]) -> &Value {
    let end = events.last().unwrap();
    assert_eq!(end["event"], "end");
    end
}

/// The files in a folder and below, with their bytes; the lock is none of them.
pub fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    fn walk(root: &Path, folder: &Path, found: &mut Vec<(String, Vec<u8>)>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(root, &path, found);
            } else {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
                found.push((name, std::fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = Vec::new();
    walk(folder, folder, &mut found);
    found.sort();
    found.retain(|(name, _)| name != ".lock");
    found
}

/// Asserts that two folders hold the same, to the byte.
pub fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}

/// A folder `in` of some drawings, one of them broken.
pub fn some(here: &Workdir, count: u32) {
    std::fs::create_dir_all(here.path("in/deep")).unwrap();
    for i in 0..count {
        let folder = if i % 3 == 2 { "in/deep" } else { "in" };
        here.write(&format!("{folder}/{i:02}.svg"), square(&format!("#{:02x}80ff", 10 * i % 256), 5 + i % 30));
    }
    here.write("in/99 broken.svg", drawing("<path id='p' d='M0 0L1 x'/>"));
}
