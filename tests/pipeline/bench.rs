//! The benchmark: what it times, what it writes, and when it says that something got worse. No test depends on a time.

mod trials;

use crate::cli::{Workdir, repository};
use glyphlight::metrics::Figures;
use glyphlight::report::LeftOut;
use glyphlight::report::bench::{BenchMachine, BenchRow, BenchSettings, Benchmark, Build, FORMAT, Ratio};
use glyphlight::report::check::{ERROR_FLOOR, Measure, check};
use glyphlight::report::plot::plots;
use glyphlight::report::skips::SkipRow;
use serde_json::Value;

fn row(finish: &str, technique: &str, knob: Option<&str>, nanoseconds: f64, rmse: f64) -> BenchRow {
    let errors =
        Figures { mae: rmse / 2.0, rmse, rmse_of_peak: Some(rmse), max: 4.0 * rmse, p999: rmse, energy_ratio: None };
    BenchRow {
        shape: "line".into(),
        curves: 310,
        finish: finish.into(),
        backend: "cpu".into(),
        technique: technique.into(),
        knob: knob.map(Into::into),
        runs: 7,
        nanoseconds,
        spread: Some(0.02 * nanoseconds),
        prepare_seconds: 1e-3,
        parts: 12.5,
        rectangles: Some(Ratio { value: nanoseconds / 400.0, spread: Some(0.02 * nanoseconds / 400.0) }),
        uniforms: Some(Ratio { value: nanoseconds / 1e5, spread: Some(0.02 * nanoseconds / 1e5) }),
        errors,
        total: None,
        total_noise: None,
    }
}

fn benchmark() -> Benchmark {
    let rows = ["0.1", "diffuse"].map(|finish| {
        vec![
            row(finish, "tree", Some("1e-3"), 1600.0, 5e-6),
            row(finish, "tree", Some("1e-4"), 2600.0, 5e-7),
            row(finish, "kuge", None, 35_000.0, 1.4e-5),
            row(finish, "uniform", Some("30"), 100_000.0, 1e-6),
        ]
    });
    Benchmark {
        format: FORMAT,
        program: "glyphlight 0.1.0".into(),
        date: "2026-01-31T12:00:00Z".into(),
        build: Build { version: "0.1.0".into(), profile: "release".into(), revision: None },
        machine: BenchMachine {
            processor: "a \"fast\", <new> processor".into(),
            simd: "SSE2".into(),
            threads: 1,
            system: "linux x86_64".into(),
            adapter: None,
            clock: None,
        },
        settings: BenchSettings { side: 64, windows: 4, repeats: 7, reference_spp: None },
        rows: rows.concat(),
        left_out: vec![LeftOut { technique: "all on the GPU".into(), reason: "none".into() }],
    }
}

#[test]
fn a_ratio_is_of_times_of_the_same_round() {
    // The machine gets slower by the round; the ratio doesn't.
    let ratio = Ratio::of(&[3.0, 6.0, 12.0, 24.0], &[1.0, 2.0, 4.0, 8.0]).unwrap();
    assert_eq!(ratio, Ratio { value: 3.0, spread: Some(0.0) });
    let noisy = Ratio::of(&[3.0, 3.3, 2.7], &[1.0, 1.0, 1.0]).unwrap();
    assert!((noisy.value - 3.0).abs() < 1e-12 && (noisy.spread.unwrap() - 0.3 * 1.4826).abs() < 1e-9, "{noisy:?}");
    // A slow row has one run only, and no spread.
    assert_eq!(Ratio::of(&[9.0], &[1.0, 2.0, 3.0]), Some(Ratio { value: 4.5, spread: None }));
    assert_eq!(Ratio::of(&[], &[1.0]), None);
    assert_eq!(Ratio::of(&[1.0], &[0.0]), None);
}

#[test]
fn what_got_worse_is_found_and_nothing_else() {
    let baseline = benchmark();
    let honest = check(&baseline, &baseline);
    assert_eq!((honest.rows, honest.untimed, honest.missing, honest.worse.len()), (8, 0, 0, 0));
    let changed = |change: &dyn Fn(&mut BenchRow)| {
        let mut run = baseline.clone();
        change(&mut run.rows[1]);
        let worse = check(&baseline, &run).worse;
        assert!(worse.iter().all(|f| f.row == "line, alpha 0.1, cpu, tree:1e-4" && f.now > f.limit), "{worse:?}");
        worse.iter().map(|f| f.measure).collect::<Vec<_>>()
    };
    let scale = |ratio: &mut Option<Ratio>, by: f64| ratio.iter_mut().for_each(|r| r.value *= by);
    // Both spreads are 2 %, taken as 3 %: 3·√2·3 % = 12.7 % is the limit, but for the second's being of the larger ratio.
    assert_eq!(changed(&|r| scale(&mut r.rectangles, 1.12)), []);
    assert_eq!(changed(&|r| scale(&mut r.rectangles, 1.15)), [Measure::Rectangles]);
    // Over uniform:30 the rectangle's own rows are judged only: where everything is slower, nothing else shows it.
    assert_eq!(changed(&|r| scale(&mut r.uniforms, 1.15)), []);
    let mut flat = baseline.clone();
    flat.rows.iter_mut().for_each(|r| r.shape = "rectangle".into());
    let mut slower = flat.clone();
    scale(&mut slower.rows[1].uniforms, 1.15);
    assert_eq!(check(&flat, &slower).worse.iter().map(|f| f.measure).collect::<Vec<_>>(), [Measure::Uniforms]);
    // Faster is not worse; nor is slower where the times are that uncertain, or not known to be certain.
    assert_eq!(changed(&|r| scale(&mut r.rectangles, 0.1)), []);
    let uncertain = |spread: Option<f64>| {
        changed(&move |r| r.rectangles = r.rectangles.map(|old| Ratio { value: 1.5 * old.value, spread }))
    };
    assert_eq!(uncertain(Some(0.1)), [Measure::Rectangles]);
    assert_eq!(uncertain(Some(2.0)), []);
    assert_eq!(uncertain(None), []);
    // Times of another machine are no matter.
    assert_eq!(changed(&|r| r.nanoseconds *= 10.0), []);
    // Errors: a tenth more, and more than single precision leaves.
    assert_eq!(changed(&|r| r.errors.rmse += 0.9 * ERROR_FLOOR), []);
    assert_eq!(changed(&|r| r.errors.rmse += 1.1 * ERROR_FLOOR), [Measure::Rmse]);
}

#[test]
fn an_error_that_is_no_number_is_worse() {
    let baseline = benchmark();
    let mut run = baseline.clone();
    run.rows[0].errors.rmse = f64::NAN;
    let worse = check(&baseline, &run).worse;
    assert_eq!(worse.iter().map(|f| f.measure).collect::<Vec<_>>(), [Measure::Rmse]);
    // Rows that only one of the runs has are counted, not judged.
    run.rows.remove(0);
    run.rows[0].shape = "another".into();
    run.rows[1].rectangles = None;
    run.rows[1].uniforms = None;
    let checked = check(&baseline, &run);
    assert_eq!((checked.rows, checked.missing, checked.untimed), (6, 2, 1));
}

#[test]
fn files_hold_what_was_measured() {
    let bench = benchmark();
    assert_eq!(Benchmark::parse(bench.json().unwrap().as_bytes()).unwrap(), bench);
    let other = Benchmark { format: FORMAT + 1, ..bench.clone() };
    let error = Benchmark::parse(other.json().unwrap().as_bytes()).unwrap_err().to_string();
    assert!(error.contains("format 2") && error.contains("knows 1"), "{error}");
    let csv = bench.csv();
    let lines: Vec<&str> = csv.trim_end().split("\r\n").collect();
    assert_eq!(lines.len(), 1 + bench.rows.len());
    let names: Vec<&str> = lines[0].split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap();
    for (line, row) in lines[1..].iter().zip(&bench.rows) {
        assert!(line.contains("\"a \"\"fast\"\", <new> processor\""), "{line}");
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), names.len() + 1, "one field has a comma");
        assert_eq!(fields[at("technique")], row.technique);
        assert_eq!(fields[at("knob")], row.knob.as_deref().unwrap_or_default());
        for (name, value) in [
            ("nanoseconds", row.nanoseconds),
            ("rectangles", row.rectangles.unwrap().value),
            ("uniforms_spread", row.uniforms.unwrap().spread.unwrap()),
            ("rmse", row.errors.rmse),
            ("max", row.errors.max),
        ] {
            assert_eq!(fields[at(name)].parse::<f64>().unwrap(), value, "{name}");
        }
        assert_eq!([fields[at("energy_ratio")], fields[at("total_rmse")]], ["", ""]);
    }
}

/// Pixels of a colour in a PNG.
fn pixels(png: &[u8], color: [u8; 3]) -> usize {
    image::load_from_memory(png).unwrap().into_rgb8().pixels().filter(|p| p.0 == color).count()
}

#[test]
fn plots_show_every_point_where_it_belongs() {
    const ORANGE: [u8; 3] = [213, 94, 0];
    let bench = benchmark();
    let all = plots(&bench).unwrap();
    assert_eq!(all.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["line-cpu"]);
    let plot = &all[0];
    for word in
        ["alpha 0.1", "diffuse", "time per pixel", "RMSE, W/(sr·m²)", "1e-4", "310 curves", "&lt;new&gt;", "10 µs"]
    {
        assert!(plot.svg.contains(word), "{word} is not in the plot");
    }
    let image = image::load_from_memory(&plot.png).unwrap().into_rgb8();
    assert_eq!((image.width(), image.height()), (1200, 370));
    // Discs and lines of the tree in two panels, and one in the legend; text is drawn, and there is none without a font.
    assert!(pixels(&plot.png, ORANGE) > 300, "{}", pixels(&plot.png, ORANGE));
    assert!(pixels(&plot.png, [0, 0, 0]) > 500, "{}", pixels(&plot.png, [0, 0, 0]));
    // The place of the disc of a row: with ten times the error it is a decade higher, with ten times the time farther right.
    let disc = |change: &dyn Fn(&mut BenchRow)| {
        let mut bench = bench.clone();
        bench.rows.truncate(4);
        change(&mut bench.rows[0]);
        let svg = plots(&bench).unwrap().remove(0).svg;
        let circle = svg.split("<circle ").find(|c| c.contains("fill=\"#D55E00\"")).unwrap().to_owned();
        let number = |name: &str| -> f64 {
            circle
                .split(&format!(" {name}=\""))
                .chain(circle.split(&format!("{name}=\"")))
                .find_map(|t| t.split('"').next()?.parse().ok())
                .unwrap()
        };
        [number("cx"), number("cy")]
    };
    let [here, wrong, slow] = [disc(&|_| {}), disc(&|r| r.errors.rmse *= 10.0), disc(&|r| r.nanoseconds *= 10.0)];
    assert!(here[0] == wrong[0] && wrong[1] < here[1] - 20.0, "{here:?} {wrong:?}");
    assert!(here[1] == slow[1] && slow[0] > here[0] + 20.0, "{here:?} {slow:?}");
}

/// The smallest benchmark there is.
const SMALL: [&str; 10] =
    ["--shape", "cavity", "--alpha", "0.1,diffuse", "--backend", "cpu", "--size", "4", "--repeats", "3"];

fn bench(here: &Workdir, args: &[&str]) -> (Option<i32>, String, String) {
    let output = here.run([&["bench"], args].concat());
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn bench_measures_writes_and_checks() {
    let here = Workdir::new();
    let techniques = ["--technique", "tree:1e-3,uniform:6,exact", "-o", "out/b"];
    let (code, stdout, stderr) = bench(&here, &[&SMALL[..], &techniques].concat());
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{stdout}");
    assert!(stdout.contains("tree:1e-3") && stdout.contains("4 windows of 4 × 4 pixels"), "{stdout}");
    let bytes = std::fs::read(here.path("out/b/bench.json")).unwrap();
    let measured = Benchmark::parse(&bytes).unwrap();
    let labels: Vec<_> = measured.rows.iter().map(|r| format!("{} {}", r.finish, r.label())).collect();
    let expected =
        ["0.1 tree:1e-3", "0.1 uniform:6", "0.1 exact", "diffuse tree:1e-3", "diffuse uniform:6", "diffuse exact"];
    assert_eq!(labels, expected);
    for row in &measured.rows {
        assert!(row.nanoseconds > 0.0 && row.runs == 3 && row.spread.is_some() && row.curves == 7, "{row:?}");
        let [rectangles, uniforms] = [row.rectangles.unwrap(), row.uniforms.unwrap()];
        assert!(rectangles.value > 0.0 && uniforms.value > 0.0 && uniforms.spread.is_some(), "{row:?}");
        // Each within what it promises, and the yardstick is itself.
        let limit = match row.technique.as_str() {
            "tree" => 1e-3 + 2e-5,
            "uniform" => 0.2,
            _ => 0.0,
        };
        assert!(row.errors.max <= limit, "{row:?}");
        assert!(row.technique != "uniform" || row.errors.rmse > 1e-4, "polygons are not curves: {row:?}");
    }
    for file in ["bench.csv", "plots/cavity-cpu.svg", "plots/cavity-cpu.png"] {
        assert!(here.path(&format!("out/b/{file}")).exists(), "{file}");
    }

    // Against itself it is no worse. One that is slower than its baseline by more than the spreads is, or less right.
    let with_ratio = |value: f64| {
        let mut bench = measured.clone();
        bench.rows[1].rectangles = Some(Ratio { value, spread: Some(0.01) });
        bench
    };
    let checked = |baseline: &Benchmark, run: &Benchmark| {
        here.write("baseline.json", baseline.json().unwrap());
        here.write("run.json", run.json().unwrap());
        let (code, stdout, stderr) = bench(&here, &["--check", "baseline.json", "--with", "run.json"]);
        assert_eq!(stderr, "");
        (code, stdout)
    };
    let (code, stdout) = checked(&measured, &measured);
    assert_eq!(code, Some(0), "{stdout}");
    assert_eq!(stdout, "6 rows judged, 0 of them by their error only; 0 rows of the baseline were not run; 0 worse\n");
    assert_eq!(checked(&with_ratio(1.0), &with_ratio(1.1)).0, Some(0));
    let (code, stdout) = checked(&with_ratio(1.0), &with_ratio(1.2));
    assert_eq!(code, Some(1), "{stdout}");
    assert!(stdout.starts_with("slower: cavity, alpha 0.1, cpu, uniform:6: 1.20 rectangles; it was 1.00"), "{stdout}");
    let mut right = measured.clone();
    right.rows[1].errors.rmse = 1e-7;
    let (code, stdout) = checked(&right, &measured);
    assert_eq!(code, Some(1), "{stdout}");
    assert!(stdout.starts_with("less right: cavity, alpha 0.1, cpu, uniform:6: RMSE"), "{stdout}");
    here.write("honest.json", measured.json().unwrap());
    here.write("right.json", right.json().unwrap());

    // A check measures what the baseline holds. With one run nothing is known of the times: it is the errors that count.
    let again =
        |name: &str, more: &[&str]| bench(&here, &[&["--check", name, "--repeats", "1", "--json"], more].concat());
    let (code, stdout, _) = again("honest.json", &["--technique", "uniform:6"]);
    let checked: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(
        (code, &checked["rows"], &checked["untimed"], &checked["missing"]),
        (Some(0), &2.into(), &2.into(), &4.into())
    );
    let (code, stdout, _) = again("right.json", &["--alpha", "0.1"]);
    let checked: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &checked["worse"][0]["measure"]), (Some(1), &"rmse".into()), "{stdout}");
    assert_eq!(again("right.json", &["--alpha", "diffuse"]).0, Some(0));
}

#[test]
fn pictures_are_measured_by_what_can_show_them() {
    let here = Workdir::new();
    let small = ["--alpha", "0.25", "--backend", "cpu", "--size", "4", "--repeats", "1", "-o", "out"];
    let asked = ["--shape", "glyph,picture", "--technique", "tree:1e-4,textured:1e-3,exact,uniform:30,quad:64"];
    let (code, stdout, stderr) = bench(&here, &[&small[..], &asked].concat());
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let measured = Benchmark::parse(&std::fs::read(here.path("out/bench.json")).unwrap()).unwrap();
    let rows_of = |shape: &str| measured.rows.iter().filter(|r| r.shape == shape).collect::<Vec<_>>();
    let labels = |shape: &str| rows_of(shape).iter().map(|r| r.label()).collect::<Vec<_>>();
    assert_eq!(labels("glyph"), ["tree:1e-4", "exact", "uniform:30", "quad:64"]);
    assert_eq!(labels("picture"), ["tree:1e-4", "textured:1e-3", "uniform:30", "quad:64"]);
    // What is not there is said, and why.
    let left_out: Vec<_> = measured.left_out.iter().map(|l| l.technique.as_str()).collect();
    assert_eq!(left_out, ["glyph, textured", "picture, exact"]);
    for line in ["glyph, textured: no light has a picture", "picture, exact: a light has a picture"] {
        assert!(stderr.contains(line), "{stderr}");
    }
    // The tree keeps its tolerance; one look at a blurred picture is off by a percent, at the masked rectangle's edges it is more.
    let errors: Vec<_> = rows_of("picture").iter().map(|r| r.errors.rmse).collect();
    let [tree, textured, uniform, quad] = errors[..] else { panic!("{errors:?}") };
    assert!(tree < 2e-5 && textured > 1e-3 && textured < 1e-2 && uniform > 1e-3 && quad > textured, "{errors:?}");
}

#[test]
fn misuse_is_an_error_and_leaves_nothing() {
    let here = Workdir::new();
    here.write("bench.json", benchmark().json().unwrap());
    here.write("table.json", "{ \"format\": 1 }");
    here.write("out/mine.txt", "mine");
    here.write("odd.json", benchmark().json().unwrap().replace("\"line\"", "\"circle\""));
    let before = here.files();
    for (args, message) in [
        (&["--technique", "trees"][..], "`trees` is none of"),
        (&["--technique", "tree:0"], "above 0"),
        (&["--shape", "cavern"], "`cavern` is none of rectangle"),
        (&["--alpha", "1.5"], "neither `diffuse` nor an alpha"),
        (&["--size", "0"], "0 is not in 1..=256"),
        (&["--with", "bench.json"], "--check"),
        (&["--check", "bench.json", "--quick"], "--quick"),
        (&["--spp", "16"], "--reference"),
        (&["--skips", "--quick"], "--quick"),
        (&["--check", "none.json"], "none.json"),
        (&["--check", "table.json"], "table.json: not a benchmark: missing field"),
        (&["--check", "odd.json"], "`circle` is none of rectangle"),
        (&["--check", "bench.json", "--shape", "glyph"], "nothing to measure"),
        (&["--technique", "textured", "--shape", "cavity", "--size", "1", "-o", "out"], "out: the folder is not empty"),
        (&["--size", "1", "-o", "out", "--force"], "\"mine.txt\", which is no part of a benchmark"),
        (&["--technique", "reference:4", "--backend", "gpu"], "nothing to measure"),
        (&["--technique", "textured", "--shape", "cavity", "--size", "1"], "nothing to measure"),
    ] {
        let (code, stdout, stderr) = bench(&here, args);
        assert_eq!(code, Some(2), "{args:?}: {stdout}{stderr}");
        assert!(stderr.contains(message), "{args:?}: {stderr}");
        assert_eq!(here.files(), before, "{args:?} leaves something behind");
    }
}

#[test]
fn skips_leave_the_picture_as_it_is() {
    let here = Workdir::new();
    let (code, stdout, stderr) =
        bench(&here, &["--skips", "--size", "48", "--repeats", "1", "--backend", "cpu", "--json"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{stdout}");
    let report: Value = serde_json::from_str(&stdout).unwrap();
    let rows = report["rows"].as_array().unwrap();
    let names: Vec<_> = rows.iter().map(|r| r["skip"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["lobes", "lobes", "textures", "horizons", "behind", "below-horizon", "under-tolerance", "clusters", "reuse"]
    );
    for row in rows {
        assert!(row["count"].as_u64().unwrap() > 0, "{row}");
        assert!(row["max_difference"].as_f64().unwrap() <= row["tolerance"].as_f64().unwrap(), "{row}");
        assert!(row["nanoseconds"].as_f64().unwrap() > 0.0 && row["nanoseconds_off"].as_f64().unwrap() > 0.0, "{row}");
    }
    // A skip that leaves nothing out, or changes the picture, does not hold.
    let row = SkipRow {
        skip: "lobes".into(),
        scene: "a floor".into(),
        backend: "cpu".into(),
        device: "1 threads".into(),
        clock: "wall clock".into(),
        counted: "integrals".into(),
        count: 1,
        max_difference: 9e-4,
        tolerance: 1e-3,
        nanoseconds: 1.0,
        nanoseconds_off: 2.0,
        saved: None,
    };
    assert!(row.holds());
    assert!(!SkipRow { count: 0, ..row.clone() }.holds());
    assert!(!SkipRow { max_difference: 1.1e-3, ..row }.holds());
}

/// The baseline in the repository is one that this program can run and that its errors hold.
#[test]
fn the_stored_baseline_can_be_checked() {
    let path = repository("tests/data/bench.json");
    let baseline = Benchmark::parse(&std::fs::read(&path).unwrap()).unwrap();
    assert!(baseline.rows.len() >= 20 && check(&baseline, &baseline).worse.is_empty());
    assert!(baseline.rows.iter().all(|r| r.backend == "cpu"), "the GPU's ratios are those of one driver");
    let here = Workdir::new();
    let (code, stdout, stderr) = bench(
        &here,
        &[
            "--check",
            path.to_str().unwrap(),
            "--repeats",
            "1",
            "--shape",
            "rectangle,cavity",
            "--technique",
            "tree,uniform",
        ],
    );
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{stdout}");
}
