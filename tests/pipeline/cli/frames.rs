//! Sequences by the command: numbered files, each what it is alone.

use super::{Workdir, repository};
use serde_json::Value;

const SMALL: [&str; 8] = ["--width", "48", "--height", "27", "--samples", "1", "--backend", "cpu"];

#[test]
fn frames_are_numbered_and_are_what_they_are_alone() {
    let here = Workdir::new();
    let scene = repository("tests/data/scenes/swing.toml");
    let render = |args: &[&str]| here.stdout([&["render", scene.to_str().unwrap()], args, &SMALL[..]].concat());
    let said = render(&["--frames", "5", "-o", "out/a.png", "-o", "out/f##x.exr", "--stats", "--json"]);
    let mut names: Vec<_> = here.files().iter().map(|f| f.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    names.retain(|name| name != "out");
    let wanted: Vec<_> = (1..6).map(|i| format!("a.000{i}.png")).chain((1..6).map(|i| format!("f0{i}x.exr"))).collect();
    assert_eq!(names, wanted);
    let stats: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(stats["frames"], 5);
    let trees = stats["reused"].as_array().unwrap().iter().find(|r| r["what"] == "trees").unwrap();
    assert_eq!((&trees["reused"], &trees["made"]), (&Value::from(8), &Value::from(2)));

    // The fourth of five from 0 to 4 s is at 3 s.
    render(&["--time", "3", "-o", "out/alone.exr"]);
    let file = |name: &str| std::fs::read(here.path(&format!("out/{name}"))).unwrap();
    assert!(file("alone.exr") == file("f04x.exr"), "a frame differs from the picture at its time");
    assert!(file("alone.exr") != file("f03x.exr"), "nothing moves");
    render(&["--frames", "2", "--time", "2..3", "-o", "out/part.exr"]);
    assert!(file("part.0001.exr") == file("f03x.exr") && file("part.0002.exr") == file("f04x.exr"));
    let table = render(&["--frames", "2", "--stats", "-o", "out/b.png"]);
    assert!(table.contains("trees reused") && table.contains("2 of 4"), "{table}");
}

#[test]
fn what_has_no_frames_is_refused() {
    let here = Workdir::new();
    let moving = repository("tests/data/scenes/swing.toml");
    let still = repository("tests/data/scenes/first.toml");
    let cases: [(&std::path::Path, &[&str], &str); 6] = [
        (&still, &["--frames", "2"], "no keyframes"),
        (&still, &["--time", "1"], "no keyframes"),
        (&moving, &["--time", "1..2"], "goes with --frames"),
        (&moving, &["--frames", "2", "--time", "1"], "need A..B"),
        (&moving, &["--frames", "0"], "--frames"),
        (&moving, &["--frames", "2", "--time", "1..x"], "not a time"),
    ];
    for (scene, args, wanted) in cases {
        let output = here.run([&["render", scene.to_str().unwrap(), "-o", "out/a.png"], args, &SMALL[..]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr.contains(wanted), "{args:?}: {stderr}");
    }
    assert_eq!(here.files().len(), 1, "nothing is left behind");
}
