//! Drawings that mean harm: an error each, within five seconds and a gibibyte, and the others go on.

use super::{drawing, end, events, square};
use crate::cli::{Workdir, json_lines};
use std::time::{Duration, Instant};

/// A picture of 65 000 × 65 000 black pixels in seven kilobytes of PNG, were it not cut off.
const HEADER: &str = "iVBORw0KGgoAAAANSUhEUgAA/egAAP3oCAIAAAA=";

fn reasons(here: &Workdir, folder: &str) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(here.path(folder).join("errors.jsonl")).unwrap();
    let word = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_owned();
    json_lines(&text).iter().map(|e| (word(&e["name"]), word(&e["reason"]))).collect()
}

#[test]
fn drawings_that_mean_harm() {
    let here = Workdir::new();
    std::fs::create_dir(here.path("in")).unwrap();
    let laughs: String =
        (1..10).map(|i| format!("<!ENTITY a{i} \"{}\">", format!("&a{};", i - 1).repeat(10))).collect();
    let evil = [
        ("bomb", format!("<!DOCTYPE svg [<!ENTITY a0 \"ha\">{laughs}]>{}", drawing("<text>&a9;</text>")), "entity"),
        ("deep", drawing(&format!("{}{}", "<g>".repeat(100_000), "</g>".repeat(100_000))), "nested 100001 deep"),
        (
            "long",
            drawing(&format!("<path d='M0 0{}z'/>", "h1".repeat(10_000_000))),
            "bytes, more than the limit of 16777216",
        ),
        ("many", drawing(&format!("<path d='M0 0{}z'/>", "h1".repeat(1_000_000))), "more than the limit of 200000"),
        ("paths", drawing(&"<path d='M0 0h1v1z'/>".repeat(60_000)), "60001 elements"),
        (
            "huge",
            drawing(&format!("<image width='9' height='9' href='data:image/png;base64,{HEADER}'/>")),
            "65000 pixels along a side",
        ),
        ("reads", drawing("<image width='9' height='9' href='/etc/passwd'/>"), "nothing outside the file is read"),
        (
            "calls",
            drawing("<image width='9' height='9' href='http://localhost/a.png'/>"),
            "nothing outside the file is read",
        ),
        ("blank", drawing(""), "nothing is visible"),
        ("junk", "\u{0}\u{1}".into(), "not an SVG"),
    ];
    for (name, text, _) in &evil {
        here.write(&format!("in/{name}.svg"), text);
    }
    here.write("in/zipped.svgz", [0x1f, 0x8b, 8, 0]);
    here.write("in/good.svg", square("#fff", 10));
    let start = Instant::now();
    let said = events(&here, &["in", "-o", "made", "--max-elements", "50000"], 1);
    assert!(start.elapsed() < Duration::from_secs(5 * evil.len() as u64), "{:?}", start.elapsed());
    assert_eq!((&end(&said)["done"], &end(&said)["failed"]), (&1.into(), &(evil.len() + 1).into()));
    for item in said.iter().filter(|e| e["event"] == "item") {
        assert!(item["seconds"]["wall"].as_f64().unwrap() < 5.0, "{item}");
    }
    let reasons = reasons(&here, "made");
    for (name, _, words) in &evil {
        let (_, reason) = reasons.iter().find(|(found, _)| found == name).unwrap();
        assert!(reason.contains(words), "{name}: {reason}");
    }
    assert!(reasons.iter().any(|(name, reason)| name == "zipped" && reason.contains("svgz")), "{reasons:?}");
}

#[test]
fn an_item_that_takes_too_long_is_stopped() {
    let here = Workdir::new();
    // Chords whose overlaps keep the boolean library busy for long.
    let place = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / f64::from(1 << 24) * 100.0;
    let chords: String = (0..1000).map(|k| format!("L{:.2} {:.2}", place(2 * k), place(2 * k + 1))).collect();
    here.write("slow.svg", drawing(&format!("<path fill='#fff' d='M0 0{chords}Z'/>")));
    here.write("good.svg", square("#fff", 10));
    let start = Instant::now();
    let said = events(&here, &["slow.svg", "good.svg", "-o", "made", "--time-limit", "0.4", "--jobs", "1"], 1);
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert_eq!((&end(&said)["done"], &end(&said)["failed"]), (&1.into(), &1.into()));
    let reasons = reasons(&here, "made");
    assert!(reasons[0].1.contains("longer than the limit of 0.4 s"), "{reasons:?}");
    // Without the limit it is one of the others.
    assert_eq!(end(&events(&here, &["slow.svg", "good.svg", "-o", "made"], 0))["done"], 1);
}

#[cfg(target_os = "linux")]
#[test]
fn an_item_that_takes_too_much_memory_is_stopped() {
    let here = Workdir::new();
    let rows: String = (0..40_000).map(|k| format!("<g id='g{k}'><rect width='{}' height='9'/></g>", k % 90)).collect();
    here.write("large.svg", drawing(&rows));
    here.write("good.svg", square("#fff", 10));
    let run = |limit: &str| {
        let args =
            ["large.svg", "good.svg", "-o", "made", "--memory-limit", limit, "--jobs", "1", "--max-paths", "100"];
        events(&here, &args, 1);
        reasons(&here, "made")
    };
    let reason = &run("100")[0].1;
    assert!(reason.contains("more memory than the limit of 100 MiB"), "{reason}");
    let reason = &run("700")[0].1;
    assert!(reason.contains("101 paths up to there, more than the limit of 100"), "{reason}");
}
