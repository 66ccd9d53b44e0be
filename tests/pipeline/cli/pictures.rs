//! Pictures by the command: the scene files of the repository, the same bytes for the same question, and the counters.

use super::{Workdir, repository};
use crate::film::read_exr;
use crate::scene::PUBLISHED;
use serde_json::Value;
use std::path::Path;

/// Size and backend of the pictures here.
const SMALL: [&str; 8] = ["--width", "96", "--height", "54", "--samples", "2", "--backend", "cpu"];

/// Channels of an EXR by name.
fn channel(path: &Path, name: &str) -> Vec<f32> {
    let image = read_exr(path);
    let channel = image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap();
    channel.sample_data.values_as_f32().collect()
}

fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

/// Greatest difference of the beauty of two EXRs.
fn difference(a: &Path, b: &Path) -> f32 {
    let pair = |name| channel(a, name).into_iter().zip(channel(b, name)).map(|(x, y)| (x - y).abs());
    ["R", "G", "B"].into_iter().flat_map(pair).fold(0.0, f32::max)
}

#[test]
fn the_published_scene_renders_to_png_and_exr() {
    let here = Workdir::new();
    here.write("scene.toml", PUBLISHED);
    let outputs = ["-o", "out/a.png", "-o", "out/a.exr"];
    let said = here.stdout([&["render", "scene.toml"], &SMALL[..], &outputs].concat());
    assert_eq!(said, "", "nothing is printed unless it is asked for");
    let exr = here.path("out/a.exr");
    let layers = ["R", "diffuse.G", "specular.B", "emission.R"].map(|name| largest(&channel(&exr, name)));
    assert!(layers.iter().all(|v| *v > 0.02 && *v <= 1.5), "{layers:?}");
    // The light itself has the radiance that the file says.
    assert!((layers[3] - 1.0).abs() < 1e-6, "{layers:?}");
    let png = image::open(here.path("out/a.png")).unwrap().into_rgb8();
    assert_eq!(png.dimensions(), (96, 54));
    assert!(png.pixels().any(|p| p.0[0] > 200) && png.pixels().any(|p| p.0[0] < 20));

    here.write("scene.toml", PUBLISHED.replace("radiance = [1.0, 1.0, 1.0]", "radiance = [0.0, 0.0, 0.0]"));
    let output = here.run([&["render", "scene.toml"], &SMALL[..], &["-o", "out/dark.exr"]].concat());
    assert_eq!(output.status.code(), Some(0));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.starts_with("warning: scene.toml:13: light[0].path") && stderr.contains("black"), "{stderr}");
    assert_eq!(largest(&channel(&here.path("out/dark.exr"), "R")), 0.0);
}

#[test]
fn every_scene_file_of_the_repository_renders() {
    let here = Workdir::new();
    let scenes = std::fs::read_dir(repository("tests/data/scenes")).unwrap().map(|e| e.unwrap().path());
    let scenes: Vec<_> = scenes.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    assert!(scenes.len() >= 3, "{scenes:?}");
    for scene in scenes {
        let output = here.run([&["render", scene.to_str().unwrap(), "-o", "out/a.exr"], &SMALL[..]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""), "{}", scene.display());
        for layer in ["diffuse.R", "specular.R", "emission.R"] {
            let values = channel(&here.path("out/a.exr"), layer);
            assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{}: {layer}", scene.display());
            assert!(largest(&values) > 1e-3, "{}: {layer} is dark", scene.display());
        }
    }
}

#[test]
fn the_same_question_has_the_same_answer() {
    let here = Workdir::new();
    let render = |name: &str, more: &[&str]| {
        let outputs = ["out/a.png", "out/a.exr"].map(|f| f.replace('a', name));
        let text = ["render", "--text", "OPEN\nnow", "--font", "DejaVu Sans", "-o", &outputs[0], "-o", &outputs[1]];
        here.stdout([&text, &SMALL[..], more].concat());
        outputs.map(|f| std::fs::read(here.path(&f)).unwrap())
    };
    let first = render("1", &[]);
    assert!(first == render("2", &[]), "two runs differ");
    for change in [["--alpha", "0.081"], ["--color", "#fffffe"], ["--letter-spacing", "0.001"], ["--align", "right"]] {
        let changed = render("3", &change);
        assert!(changed[1] != first[1], "{change:?} changes nothing");
    }
    // Exposure, tone and dither are the display's: radiance stays.
    for change in [&["--exposure", "0.5"][..], &["--tone-map", "linear"], &["--dither"]] {
        let changed = render("4", change);
        assert!(changed[0] != first[0] && changed[1] == first[1], "{change:?}");
    }
}

#[test]
fn tolerance_bounds_what_it_changes() {
    let here = Workdir::new();
    let scene = repository("tests/data/scenes/neon.toml");
    let render = |name: &str, args: &[&str]| {
        let path = format!("out/{name}.exr");
        let size = ["--width", "48", "--height", "27", "--samples", "1", "--backend", "cpu", "-o", &path];
        here.stdout([&["render", scene.to_str().unwrap()], args, &size].concat());
        here.path(&path)
    };
    let exact = render("exact", &["--technique", "exact"]);
    // Three lights, of which one has two colours; two lobes each.
    let lobes = 2.0 * 4.0;
    let mut last = 0.0;
    for tolerance in [1e-5_f32, 1e-3, 1e-2] {
        let tree = render(&tolerance.to_string(), &["--tolerance", &tolerance.to_string()]);
        let error = difference(&exact, &tree);
        assert!(error <= lobes * (tolerance + 2e-5), "{error:e} at {tolerance}");
        assert!(error > last, "{error:e} at {tolerance}, after {last:e}");
        last = error;
    }
    // The comparison sees a thousandth of the light.
    let brighter = here.path("brighter.toml");
    let text = std::fs::read_to_string(&scene).unwrap().replace("1200.0", "1201.2");
    here.write("brighter.toml", &text);
    std::fs::copy(repository("tests/data/scenes/moon.svg"), here.path("moon.svg")).unwrap();
    let args = ["render", brighter.to_str().unwrap(), "--technique", "exact", "--width", "48", "--height", "27"];
    here.stdout([&args[..], &["--samples", "1", "--backend", "cpu", "-o", "out/brighter.exr"]].concat());
    assert!(difference(&exact, &here.path("out/brighter.exr")) > 1e-4);
}

#[test]
fn counters_add_up() {
    let here = Workdir::new();
    let scene = repository("tests/data/scenes/neon.toml");
    let stats = |args: &[&str]| -> Value {
        let all = [&["render", scene.to_str().unwrap(), "-o", "out/a.png", "--stats", "--json"], args, &SMALL[..]];
        serde_json::from_str(&here.stdout(all.concat())).unwrap()
    };
    let start = std::time::Instant::now();
    let coarse = stats(&["--tolerance", "1e-2"]);
    let elapsed = start.elapsed().as_secs_f64();
    let fine = stats(&["--tolerance", "1e-5"]);
    let number = |v: &Value, key: &str| v[key].as_u64().unwrap();
    for stats in [&coarse, &fine] {
        assert_eq!(stats["backend"], "cpu");
        let lights = stats["lights"].as_array().unwrap();
        let sum = |key: &str| lights.iter().map(|l| number(l, key)).sum::<u64>();
        // Two texts of one emission and a drawing of two, two lobes each, at every shaded sample.
        assert_eq!(lights.len(), 3);
        let shaded = number(stats, "shaded");
        assert!(shaded > 0 && shaded <= 96 * 54 * 2);
        assert_eq!(lights.iter().map(|l| number(l, "candidates")).collect::<Vec<_>>(), [2, 2, 4].map(|k| k * shaded));
        let skipped = sum("behind") + sum("below_horizon") + sum("no_lobe") + sum("under_tolerance");
        assert_eq!(number(stats, "integrals") + skipped, sum("candidates"));
        assert!(number(stats, "nodes") >= number(stats, "integrals"));
    }
    assert!(number(&fine, "nodes") > number(&coarse, "nodes"), "a finer tolerance costs nodes");
    assert!(number(&fine, "integrals") >= number(&coarse, "integrals"), "and the integrals of weak lights");
    let stages = coarse["stages"].as_array().unwrap();
    let names: Vec<_> = stages.iter().map(|s| s[0].as_str().unwrap()).collect();
    assert!(["load", "shading", "write"].iter().all(|n| names.contains(n)), "{names:?}");
    let seconds: f64 = stages.iter().map(|s| s[1].as_f64().unwrap()).sum();
    assert!(seconds > 0.0 && seconds <= elapsed, "{seconds} of {elapsed}");

    let table = here.stdout([&["render", scene.to_str().unwrap(), "-o", "out/a.png", "--stats"], &SMALL[..]].concat());
    for word in ["backend", "time, shading", "nodes per sample", "skipped, OPEN", "skipped, moon.svg", "مساءً"] {
        assert!(table.contains(word), "{word} is not in\n{table}");
    }
}

/// All that is skipped is printed with the reason.
#[test]
fn statistics_name_what_was_skipped() {
    let here = Workdir::new();
    let sign = |i: u32| {
        let (x, z) = (f64::from(i % 8) - 4.0, -f64::from(i / 8));
        format!("[[light]]\npath = \"M0 0H0.5V0.3H0Z\"\nposition = [{x:.1}, 0.1, {z:.1}]\n")
    };
    let scene = "[camera]\nposition = [0.0, 2.0, 6.0]\nlook_at = [0.0, 0.0, -1.0]\n[[surface]]\nkind = \"plane\"\n\
                 size = 30.0\nmaterial = { specular = 0.0 }\n";
    here.write("signs.toml", format!("{scene}{}", (0..48).map(sign).collect::<String>()));
    let table = |args: &[&str]| {
        let all = [&["render", "signs.toml", "-o", "out/a.png", "--stats", "--tolerance", "1e-2"], args, &SMALL[..]];
        here.stdout(all.concat())
    };
    let all = table(&[]);
    let row = |table: &str, name: &str| table.lines().find(|l| l.trim().starts_with(name)).map(str::to_owned);
    assert!(row(&all, "left out for all samples").is_some_and(|r| r.contains("specular, textures, horizons")), "{all}");
    let light = row(&all, "skipped, light 48").or_else(|| row(&all, "skipped, ")).unwrap();
    for reason in
        ["behind ", "by tile)", "below the horizon ", "no such lobe 50.0 %", "under the tolerance ", "in a cluster "]
    {
        assert!(light.contains(reason), "{reason} is not in {light}");
    }
    assert!(
        row(&all, "clusters of lights visited")
            .is_some_and(|r| r.contains("by tiles,") && r.contains("at all points; per sample")),
        "{all}"
    );
    let one_by_one = table(&["--without-skip", "clusters", "--without-skip", "lobes"]);
    assert!(row(&one_by_one, "clusters of lights visited").is_none(), "{one_by_one}");
    assert!(row(&one_by_one, "left out for all samples").is_some_and(|r| !r.contains("specular")), "{one_by_one}");
}

/// The blocks of the README in one language.
fn readme(language: &str) -> Vec<String> {
    let text = std::fs::read_to_string(repository("README.md")).unwrap();
    let fence = format!("```{language}\n");
    text.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// Every command of the README does what it says, in small.
#[cfg(unix)]
#[test]
fn the_readme_works() {
    let here = Workdir::new();
    for folder in ["fonts", "svg", "tests"] {
        std::os::unix::fs::symlink(repository(folder), here.path(folder)).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_glyphlight")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let blocks = readme("sh").concat().replace("cargo run --release -- ", "glyphlight ");
    let (mut renders, mut others) = (0, 0);
    let is_run = |line: &&str| ["glyphlight ", "echo ", "printf "].iter().any(|word| line.starts_with(word));
    for line in blocks.lines().filter(is_run) {
        let mut line =
            line.replace("--backend gpu", "--backend cpu").replace("--size 8", "").replace("fit", "fit --size 4");
        if ["render", "compare", "batch"].iter().any(|verb| line.starts_with(&format!("glyphlight {verb}"))) {
            renders += 1;
            for (option, value) in [("--width", "48"), ("--height", "27"), ("--samples", "1"), ("--backend", "cpu")] {
                let words: Vec<_> = line.split(' ').collect();
                match words.iter().position(|w| *w == option) {
                    Some(i) => line = [&words[..i], &[option, value], &words[i + 2..]].concat().join(" "),
                    None => line = format!("{line} {option} {value}"),
                }
            }
        } else {
            others += 1;
        }
        // What takes minutes is only parsed: an option that there is not is an error before the help.
        if ["bench", "stress"].iter().any(|verb| line.starts_with(&format!("glyphlight {verb}"))) {
            line += " --help";
        }
        let before = here.files().len();
        let output = std::process::Command::new("sh")
            .args(["-c", &line])
            .current_dir(here.path(""))
            .env("PATH", &path)
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""), "{line}");
        let wrote = here.files().len() > before;
        assert!(wrote || !output.stdout.is_empty() || line.contains("first.png"), "{line} does nothing");
    }
    assert!(renders >= 10 && others >= 5, "{renders} {others}");

    let scenes = readme("toml");
    assert_eq!(scenes.len(), 1);
    here.write("scene.toml", &scenes[0]);
    here.stdout([&["render", "scene.toml", "-o", "out/a.exr"], &SMALL[..]].concat());
    assert!(largest(&channel(&here.path("out/a.exr"), "diffuse.R")) > 0.1);
    here.write("scene.toml", scenes[0].replace("align", "aline"));
    assert_eq!(here.run(["render", "scene.toml", "-o", "out/b.exr"]).status.code(), Some(2));
}

/// The paper's Figure 5: how many edges each pixel took, by a smaller eps more.
#[test]
fn edges_are_counted_in_a_heat_map() {
    let here = Workdir::new();
    let text = ["render", "--text", "S", "--alpha", "0.1", "-o", "out/a.png", "--count-edges", "out/heat.png"];
    let run = |more: &[&str]| here.stdout([&text[..], &SMALL[..], more].concat());
    let heat_map = |more: &[&str]| -> Value {
        let said = run(&[&["--stats", "--json"], more].concat());
        serde_json::from_str::<Value>(&said).unwrap()["heat_map"].clone()
    };
    let said = run(&["--technique", "kuge"]);
    assert!(said.starts_with("edges per sample: min ") && said.lines().count() == 1, "{said}");
    let map = image::open(here.path("out/heat.png")).unwrap().into_rgb8();
    assert_eq!(map.dimensions(), (96, 54));
    // The lightest colour where most edges are, black where none are.
    let colors: Vec<_> = map.pixels().map(|p| p.0).collect();
    assert!(colors.contains(&[253, 231, 37]) && colors.contains(&[0; 3]));
    let [coarse, fine] = ["kuge:1e-1", "kuge:1e-6"].map(|name| heat_map(&["--technique", name]));
    for key in ["min", "max", "mean"] {
        assert!(fine[key].as_f64() >= coarse[key].as_f64() && coarse[key].as_f64() > Some(0.0), "{coarse} {fine}");
    }
    assert!(fine["mean"].as_f64().unwrap() > 1.2 * coarse["mean"].as_f64().unwrap(), "{coarse} {fine}");
    assert!(run(&["--technique", "tree"]).starts_with("nodes per sample"));
    let without = here.stdout([&text[..7], &SMALL[..], &["--stats", "--json"]].concat());
    assert_eq!(serde_json::from_str::<Value>(&without).unwrap()["heat_map"], Value::Null);

    let refused = |more: &[&str]| {
        let output = here.run([&["render", "--text", "S", "-o", "out/b.png"], &SMALL[..], more].concat());
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(refused(&["--count-edges", "out/heat.exr"]).contains("is a .png"));
    assert!(refused(&["--count-edges", "out/b.png"]).contains("the picture's file"));
    assert!(refused(&["--count-edges", "out/c.png", "--technique", "exact"]).contains("counts nothing"));
    assert!(!here.path("out/b.png").exists());
}
