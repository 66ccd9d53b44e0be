//! The light meter against certified values and closed forms, and what `inspect` counts.

use super::{Workdir, json_lines, repository, triple};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};
use std::io::{BufRead, BufReader};
use std::process::Stdio;

const CASES: &str = "tests/data/integrals.jsonl";

/// The greatest difference between what is printed and the certified `value`s.
fn worst(here: &Workdir, cases: &[Value], args: &[&str]) -> f64 {
    let printed = json_lines(&here.stdout([&["probe", "integral"], args].concat()));
    assert_eq!(printed.len(), cases.len());
    let difference = |(case, answer): (&Value, &Value)| {
        assert_eq!(case["id"], answer["id"]);
        (case["value"].as_f64().unwrap() - answer["value"].as_f64().unwrap()).abs()
    };
    cases.iter().zip(&printed).map(difference).fold(0.0, f64::max)
}

#[test]
fn integrals_are_the_certified_ones() {
    let here = Workdir::new();
    let file = repository(CASES);
    let text = std::fs::read_to_string(&file).unwrap();
    let cases = json_lines(&text);
    let file = file.to_str().unwrap();
    let exact = worst(&here, &cases, &[file, "--technique", "exact"]);
    assert!(exact <= 1e-9, "exact: {exact:e}");
    let mut last = f64::INFINITY;
    for tolerance in ["1e-3", "1e-4", "1e-5"] {
        let error = worst(&here, &cases, &[file, "--tolerance", tolerance]);
        assert!(error <= tolerance.parse::<f64>().unwrap() + 2e-5, "tree at {tolerance}: {error:e}");
        assert!(error < last, "tree at {tolerance}: {error:e}, no better than {last:e}");
        last = error;
    }
    // Lights moved by a thousandth are told from those that are not.
    let moved = |case: &Value| {
        let mut case = case.clone();
        case["c2"][0] = json!(case["c2"][0].as_f64().unwrap() * 1.001);
        case.to_string()
    };
    here.write("moved.jsonl", cases.iter().map(moved).collect::<Vec<_>>().join("\n"));
    for technique in ["exact", "tree"] {
        let error = worst(&here, &cases, &["moved.jsonl", "--technique", technique]);
        assert!(error > 1e-4, "{technique}: {error:e}");
    }
}

const CAMERA: &str = "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n";

/// Position, normal, view and alpha.
type Point = ([f64; 3], [f64; 3], [f64; 3], f64);

/// What `probe scene` reads at `points`: irradiance and specular.
fn readings(light: &str, points: &[Point], args: &[&str]) -> Vec<[[f64; 3]; 2]> {
    let here = Workdir::new();
    here.write("scene.toml", format!("{CAMERA}[[light]]\n{light}\n"));
    let point = |(position, normal, view, alpha): &Point| {
        json!({"position": position, "normal": normal, "view": view, "alpha": alpha}).to_string()
    };
    here.write("points.jsonl", points.iter().map(point).collect::<Vec<_>>().join("\n"));
    let printed = here.stdout([&["probe", "scene", "scene.toml", "--points", "points.jsonl"], args].concat());
    json_lines(&printed).iter().map(|r| [triple(&r["irradiance"]), triple(&r["specular"])]).collect()
}

/// Form factor from a small patch to a parallel rectangle with a corner above it, sides a and b, distance 1 (Howell,
/// "A catalog of radiation heat transfer configuration factors", B-3).
fn corner(a: f64, b: f64) -> f64 {
    let term = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    (term(a, b) + term(b, a)) / TAU
}

const UP: [f64; 3] = [0.0, 1.0, 0.0];

#[test]
fn irradiance_under_a_rectangle_is_the_form_factor() {
    // 3 m × 1 m, 2 m above the floor, facing down.
    let light = |height: f64| {
        format!(
            "path = \"M-1.5 -0.5H1.5V0.5H-1.5Z\"\nposition = [0, {height}, 0]\nrotation = [90, 0, 0]\nradiance = [1, 2, 0.5]"
        )
    };
    let spots = [[0.0, 0.0], [0.3, -0.2], [1.5, 0.5], [-4.0, 1.0], [0.0, 9.0]];
    let points: Vec<_> = spots.iter().map(|[x, z]| ([*x, 0.0, *z], UP, UP, 0.5)).collect();
    let far = |readings: &[[[f64; 3]; 2]]| {
        let error = |([x, z], [irradiance, _]): (&[f64; 2], &[[f64; 3]; 2])| {
            let signed = |a: f64, b: f64| a.signum() * b.signum() * corner(a.abs() / 2.0, b.abs() / 2.0);
            let factor = signed(1.5 - x, 0.5 - z)
                + signed(1.5 + x, 0.5 - z)
                + signed(1.5 - x, 0.5 + z)
                + signed(1.5 + x, 0.5 + z);
            let want = [1.0, 2.0, 0.5].map(|l| PI * l * factor);
            (0..3).map(|c| (irradiance[c] - want[c]).abs()).fold(0.0, f64::max)
        };
        spots.iter().zip(readings).map(error).fold(0.0, f64::max)
    };
    let tree = far(&readings(&light(2.0), &points, &[]));
    assert!(tree < 5e-5, "{tree:e}");
    let exact = far(&readings(&light(2.0), &points, &["--technique", "exact"]));
    assert!(exact < 1e-9, "{exact:e}");
    let lower = far(&readings(&light(1.999), &points, &["--technique", "exact"]));
    assert!(lower > 1e-4, "a light 1 mm lower makes a difference: {lower:e}");
}

#[test]
fn irradiance_of_a_small_light_falls_with_the_square_and_two_cosines() {
    // 1 cm × 1 cm at 10 m, turned by 30° from the line between.
    let light = |area: f64| {
        let h = area.sqrt() / 2.0;
        format!("path = \"M-{h} -{h}H{h}V{h}H-{h}Z\"\nposition = [0, 0, 10]\nrotation = [0, 210, 0]\nradiance = 1e6")
    };
    let tilted = [0.0, 0.8, 0.6];
    let point = [([0.0; 3], tilted, tilted, 0.5)];
    let want = 1e6 * 1e-4 * (PI / 6.0).cos() * 0.6 / 100.0;
    for args in [["--technique", "exact"], ["--technique", "tree"]] {
        let [irradiance, _] = readings(&light(1e-4), &point, &args)[0];
        assert!(irradiance.iter().all(|e| (e - want).abs() < 1e-4 * want), "{irradiance:?}, not {want}");
        let [larger, _] = readings(&light(1.001e-4), &point, &args)[0];
        assert!(larger.iter().all(|e| (e - want).abs() > 5e-4 * want), "{larger:?}");
    }
    // Nothing behind a one-sided light, nor on the other side of the surface.
    let dark = [([0.0, 0.0, 20.0], tilted, tilted, 0.5), ([0.0; 3], tilted.map(|v| -v), tilted, 0.5)];
    let dark = readings(&light(1e-4), &dark, &[]);
    assert_eq!(dark, [[[0.0; 3]; 2]; 2]);
    let lit =
        readings(&format!("{}\ntwo_sided = true", light(1e-4)), &[([0.0, 0.0, 20.0], [0.0, 0.0, -1.0], UP, 0.5)], &[]);
    assert!(lit[0][0][0] > 0.5, "{lit:?}");
}

#[test]
fn specular_light_agrees_between_techniques_and_keeps_energy() {
    let light = "text = \"&%\"\nsize = 1\nposition = [0.2, 0.3, -1]\nradiance = [3, 2, 1]";
    let mut points = Vec::new();
    for (i, alpha) in [0.02, 0.1, 0.3, 1.0].into_iter().enumerate() {
        for (j, slope) in [0.1, 0.5, 1.5].into_iter().enumerate() {
            let position = [0.2 * i as f64, 0.0, 0.15 * j as f64];
            let length = 1.0_f64.hypot(slope);
            points.push((position, UP, [0.0, slope / length, 1.0 / length], alpha));
        }
    }
    let exact = readings(light, &points, &["--technique", "exact"]);
    let brightest = exact.iter().map(|r| r[1][0]).fold(0.0, f64::max);
    assert!(brightest > 0.3, "the points see the light: {brightest}");
    let mut last = 0.0;
    for tolerance in [1e-5, 1e-3, 3e-2] {
        let tree = readings(light, &points, &["--tolerance", &tolerance.to_string()]);
        let error = |k: usize| {
            let pairs = exact.iter().zip(&tree).flat_map(|(a, b)| (0..3).map(move |c| (a[k][c] - b[k][c]).abs()));
            pairs.fold(0.0, f64::max)
        };
        assert!(
            error(0) <= PI * tolerance + 2e-4 && error(1) <= tolerance + 6e-5,
            "{tolerance}: {} {}",
            error(0),
            error(1)
        );
        assert!(error(1) >= last, "a larger tolerance is used: {} at {tolerance}, after {last}", error(1));
        last = error(1);
    }
    assert!(last > 2e-5, "{last:e}");
    // In a light that fills the half-space, a near-mirror returns nearly all of it, a rough surface less, neither more.
    let dome = "path = \"M-1e4 -1e4H1e4V1e4H-1e4Z\"\nposition = [0, 1, 0]\nrotation = [90, 0, 0]";
    let read = readings(dome, &[([0.0; 3], UP, UP, 0.02), ([0.0; 3], UP, UP, 1.0)], &[]);
    let [mirror, rough] = [read[0][1][0], read[1][1][0]];
    assert!((mirror - 1.0).abs() < 2e-3, "{mirror}");
    assert!(rough > 0.3 && rough < 0.8, "{rough}");
}

#[test]
fn inspect_counts_what_there_is() {
    let here = Workdir::new();
    // A square of 2 m with a square hole of 1 m, both drawn counter-clockwise: a hole by the even-odd rule only.
    let ring = ["--path", "M-1 -1H1V1H-1ZM-0.5 -0.5H0.5V0.5H-0.5Z"];
    let inspect = |args: &[&str]| {
        let report = here.stdout([&["inspect", "--json"], args].concat());
        serde_json::from_str::<Value>(&report).unwrap()
    };
    let report = inspect(&[&ring[..], &["--fill-rule", "evenodd", "--png", "out/ring.png"]].concat());
    let row = &report["emissions"][0];
    let count = |row: &Value, key: &str| row[key].as_u64().unwrap();
    assert_eq!(["contours", "holes", "cubics", "lines"].map(|k| count(row, k)), [2, 1, 0, 8]);
    assert!((row["area"].as_f64().unwrap() - 3.0).abs() < 1e-12, "{row}");
    assert_eq!((&row["min"], &row["max"]), (&json!([-1.0, -1.0]), &json!([1.0, 1.0])));
    assert_eq!((&row["radiance"], &row["opacity"]), (&json!([1.0, 1.0, 1.0]), &json!(1.0)));
    assert!(count(row, "nodes") >= 8 && count(row, "bytes") >= 8 * count(row, "nodes"), "{row}");
    assert_eq!(report["warnings"], json!([]));
    let drawing = image::open(here.path("out/ring.png")).unwrap().into_rgb8();
    let (w, h) = drawing.dimensions();
    let [middle, band, margin] = [(w / 2, h / 2), (w / 8, h / 2), (4, h / 2)].map(|(x, y)| drawing.get_pixel(x, y).0);
    assert_eq!((w, middle, margin), (h, [255; 3], [255; 3]));
    assert_ne!(band, [255; 3], "between the squares it is filled");

    let disc = inspect(&ring);
    let row = &disc["emissions"][0];
    assert_eq!(["contours", "holes"].map(|k| count(row, k)), [1, 0]);
    assert!((row["area"].as_f64().unwrap() - 4.0).abs() < 1e-12, "{row}");

    let file = repository("svg/ring.svg");
    let svg = inspect(&[file.to_str().unwrap(), "--size", "2"]);
    let row = &svg["emissions"][0];
    assert_eq!(["contours", "holes", "lines"].map(|k| count(row, k)), [2, 1, 0]);
    // A circle of four cubics, as SVG arcs become, is 2.8e-4 too large.
    let want = PI * (0.9 * 0.9 - 0.54 * 0.54);
    assert!((row["area"].as_f64().unwrap() - want).abs() < 3e-4 * want, "{row}, not {want}");

    let table = here.stdout(["inspect", "--text", "شكراً OPEN"]);
    assert!(table.contains("شكراً OPEN") && table.contains("contours"), "{table}");
    let warned = here.stdout(["inspect", "--text", "a\u{7}b"]);
    assert!(warned.contains("warning: U+0007"), "{warned}");
}

/// Whoever stops reading has seen enough; a disk that is full is an error.
#[test]
fn a_closed_pipe_is_no_error() {
    let here = Workdir::new();
    let cases = std::fs::read_to_string(repository(CASES)).unwrap();
    here.write("many.jsonl", cases.repeat(40));
    let probe = ["probe", "integral", "many.jsonl"];
    let mut child = here.command(probe).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.contains("\"value\""), "{first}");
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""));
    #[cfg(target_os = "linux")]
    {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = here.command(probe).stdout(full).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr.starts_with("error: standard output: No space left"), "{stderr}");
    }
}
