//! Input that cannot be lit: one clear error, exit code 2, no file left behind, at once. Every case is paired with its
//! mended twin, which must succeed: what is refused is the fault and nothing else.

use super::{Workdir, repository};
use std::time::{Duration, Instant};

/// Longest that a refusal may take.
const AT_ONCE: Duration = Duration::from_secs(5);

/// Runs `args` and checks that they are refused with a message that holds all of `words`.
fn refuse(here: &Workdir, args: &[&str], words: &[&str]) {
    let before = here.files();
    let start = Instant::now();
    let output = here.run(args);
    let elapsed = start.elapsed();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{args:?} prints {}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(stderr.lines().filter(|line| line.starts_with("error:")).count(), 1, "{args:?}: {stderr}");
    // Messages about the arguments themselves end with a hint; all others are one line.
    assert!(stderr.trim_end().lines().count() == 1 || stderr.contains("'--help'"), "{args:?}: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{args:?}: `{word}` is not in: {stderr}");
    }
    assert_eq!(here.files(), before, "{args:?} leaves files behind");
    assert!(elapsed < AT_ONCE, "{args:?} took {elapsed:?}");
}

/// Runs `args` and checks that they write `out/a.png`, which is then removed.
fn accept(here: &Workdir, args: &[&str]) {
    let output = here.run(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::remove_file(here.path("out/a.png")).unwrap();
}

/// Arguments of a small picture.
fn small<'a>(args: &[&'a str]) -> Vec<&'a str> {
    let size = ["--width", "16", "--height", "9", "--samples", "1", "--backend", "cpu", "-o", "out/a.png"];
    [&["render"], args, &size].concat()
}

fn render_pair(here: &Workdir, broken: &[&str], mended: &[&str], words: &[&str]) {
    refuse(here, &small(broken), words);
    accept(here, &small(mended));
}

#[test]
fn fonts_and_texts() {
    let here = Workdir::new();
    let font = std::fs::read(repository("fonts/SourceSans3-Regular.otf")).unwrap();
    here.write("whole.otf", &font);
    here.write("half.otf", &font[..font.len() / 2]);
    here.write("noise.otf", b"\x00\x01\x00\x00noise\xff\xfe, not a font");
    let whole = ["--text", "A", "--font", "whole.otf"];
    let plain = ["--text", "A"];
    let cases: &[(&[&str], &[&str], &[&str])] = &[
        (&["--text", "A", "--font", "half.otf"], &whole, &["half.otf", "truncated", "table"]),
        (&["--text", "A", "--font", "noise.otf"], &whole, &["noise.otf"]),
        (&["--text", "A", "--font", "missing.otf"], &whole, &["missing.otf", "No such file"]),
        (&["--text", "A", "--font", "out"], &whole, &["\"out\"", "\"Inter\""]),
        (&["--text", "A", "--font", "Comic"], &["--text", "A", "--font", "Amiri"], &["\"Comic\"", "\"Amiri\""]),
        (&["--text", ""], &plain, &["--text \"\"", "empty"]),
        (&["--text", " \n\t "], &plain, &["--text", "empty"]),
        (&["--text", "A\u{13000}"], &plain, &["U+13000", "Inter"]),
        (
            &["--text", "A", "--axis", "opsz=3"],
            &["--text", "A", "--axis", "wght=300"],
            &["'opsz'", "'wght'", "100 to 900"],
        ),
        (
            &["--text", "A", "--axis", "wght=901"],
            &["--text", "A", "--axis", "wght=900"],
            &["901", "'wght'", "100 to 900"],
        ),
        (&["--text", "A", "--axis", "wght"], &plain, &["--axis", "'wght'", "TAG=VALUE"]),
        (&["--text", "A", "--axis", "wght=nan"], &plain, &["--axis", "`nan`", "not a finite number"]),
        (&["--text", "A", "--axis", "weight=300"], &plain, &["--axis", "\"weight\"", "four"]),
        (&["--text", "A", "--size", "0"], &plain, &["--size", "0"]),
        (&["--text", "A", "--size", "1e300"], &["--text", "A", "--size", "1e9"], &["--size", "1e300", "1e9 m"]),
        (
            &["--text", "A", "--letter-spacing", "-1e300"],
            &["--text", "A", "--letter-spacing", "-0.1"],
            &["letter_spacing", "-1e300", "100 em"],
        ),
        (&["--text", "A", "--line-height", "0"], &["--text", "A", "--line-height", "2"], &["line_height", "0"]),
    ];
    for (broken, mended, words) in cases {
        render_pair(&here, broken, mended, words);
    }
}

#[test]
fn paths_and_arguments() {
    let here = Workdir::new();
    here.write("scene.toml", "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n");
    let square = ["--path", "M0 0H1V1H0Z"];
    let with = |args: &[&'static str]| [&square[..], args].concat();
    let cases: &[(&[&str], &[&str], &[&str])] = &[
        (&["--path", "M0 0H1V1H0ZL NaN 1"], &square, &["--path", "M0 0H1V1H0ZL NaN 1", "position 14"]),
        (&["--path", "M0 0H1V1e400Z"], &square, &["--path", "position 8"]),
        (&["--path", "M0 0H2e30V1Z"], &square, &["--path", "2e30", "1e30"]),
        (&["--path", ""], &square, &["--path \"\"", "draws nothing"]),
        (&["--path", "M0 0H1Z"], &square, &["--path \"M0 0H1Z\"", "no area"]),
        (&["--path", "M0 0H1e20V1e20Z"], &square, &["1e20", "1e12 m"]),
        (&[], &square, &["--text", "--svg", "--path", "scene file"]),
        (&["--path", "M0 0H1V1Z", "--text", "A"], &square, &["--path", "--text"]),
        (&["scene.toml", "--text", "A"], &["scene.toml"], &["--text", "SCENE"]),
        (&["scene.toml", "--alpha", "0.5"], &["scene.toml"], &["--alpha", "SCENE"]),
        (&["scene.toml", "--size", "2"], &["scene.toml"], &["--size", "no effect", "scene file"]),
        (&with(&["--font", "Inter"]), &square, &["--font", "--text", "no effect on --path"]),
        (&with(&["--alpha", "1.5"]), &with(&["--alpha", "0.5"]), &["--alpha", "`1.5`", "between 0 and 1"]),
        (&with(&["--alpha", "0.5", "--roughness", "0.5"]), &with(&["--roughness", "0.5"]), &["--alpha", "--roughness"]),
        (&with(&["--radiance", "1e300"]), &with(&["--radiance", "1e12"]), &["--radiance", "1e300", "1e12"]),
        (&with(&["--radiance", "-1"]), &square, &["-1"]),
        (&with(&["--color", "red"]), &with(&["--color", "#ff0000"]), &["--color", "`red`", "#rrggbb"]),
        (&with(&["--tolerance", "0"]), &with(&["--tolerance", "0.1"]), &["--tolerance", "0"]),
        (&with(&["--exposure", "inf"]), &with(&["--exposure", "-3"]), &["--exposure", "`inf`"]),
        (&with(&["--technique", "guess"]), &with(&["--technique", "tree"]), &["--technique", "guess", "exact"]),
        (&with(&["--spp", "8"]), &with(&["--spp", "8", "--technique", "reference"]), &["--spp", "reference", "tree"]),
        (&with(&["--seed", "8"]), &with(&["--seed", "8", "--technique", "reference:8"]), &["--seed", "reference"]),
        (&with(&["--lobe", "ltc"]), &with(&["--lobe", "ltc", "--technique", "reference:8"]), &["--lobe", "reference"]),
        (
            &with(&["--technique", "exact", "--max-error", "0.1"]),
            &with(&["--technique", "reference", "--max-error", "0.1"]),
            &["--max-error", "reference", "exact"],
        ),
        (&with(&["--technique", "reference", "--spp", "0"]), &with(&["--technique", "reference:1"]), &["--spp", "0"]),
        (&with(&["--json"]), &square, &["--stats"]),
        (&with(&["--colour", "red"]), &square, &["--colour"]),
    ];
    for (broken, mended, words) in cases {
        render_pair(&here, broken, mended, words);
    }
    for size in ["--width=0", "--height=0", "--samples=0", "--width=16385", "--samples=4097"] {
        let args = [&["render"], &square[..], &["--backend", "cpu", "-o", "out/a.png", size]].concat();
        let number = size.split('=').next_back().unwrap();
        refuse(&here, &args, &["picture of", number, "1 to 16384", "1 to 4096"]);
    }
    refuse(&here, &["frame"], &["'frame'"]);
}

#[test]
fn places_that_cannot_be_written() {
    let here = Workdir::new();
    here.write("file", "");
    std::fs::create_dir(here.path("out/folder.png")).unwrap();
    let cases: &[(&str, &[&str])] = &[
        ("out/a.jpg", &["out/a.jpg", ".png or .exr"]),
        ("out/a", &["out/a:", ".png or .exr"]),
        ("missing/a.png", &["missing/a.png", "folder missing", "no such folder"]),
        ("file/a.exr", &["file/a.exr", "not a folder"]),
        ("out/folder.png", &["out/folder.png", "is a directory"]),
    ];
    let square = ["--path", "M0 0H1V1H0Z"];
    for (output, words) in cases {
        refuse(&here, &[&["render"], &square[..], &["-o", output]].concat(), words);
        // All of several pictures or none.
        refuse(&here, &[&["render"], &square[..], &["-o", "out/a.png", "-o", output]].concat(), words);
        refuse(&here, &["inspect", "--path", "M0 0H1V1H0Z", "--png", output], &[output]);
        if !output.starts_with("out/a") {
            refuse(&here, &["fit", "-o", output], &[output]);
        }
    }
    accept(&here, &small(&square));
}

#[test]
fn svg_files() {
    let here = Workdir::new();
    let svg = |body: &str| format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\">{body}</svg>");
    let square = "<rect id=\"r\" width=\"5\" height=\"5\" fill=\"#fc8\"/>";
    // A million elements, ten thousand deep.
    let nested = format!("{}{square}{}", "<g>".repeat(10_000), "</g>".repeat(10_000));
    here.write("mended.svg", svg(square));
    let cases: &[(&str, Vec<u8>, &[&str])] = &[
        ("deep.svg", svg(&nested.repeat(100)).into(), &["nested", "10002", "256"]),
        ("wide.svg", svg(&square.repeat(1_000_000)).into(), &["1000001 elements", "250000"]),
        (
            "outside.svg",
            svg("<image id=\"photo\" href=\"/etc/hostname\" width=\"9\" height=\"9\"/>").into(),
            &["image \"photo\"", "/etc/hostname"],
        ),
        (
            "beside.svg",
            svg("<image id=\"photo\" href=\"mended.png\" width=\"9\" height=\"9\"/>").into(),
            &["image \"photo\"", "mended.png"],
        ),
        ("nan.svg", svg("<path id=\"p\" d=\"M0 0L5 NaN 5 5Z\"/>").into(), &["path \"p\"", "position 8"]),
        ("attribute.svg", svg("<rect id=\"r\" width=\"NaN\" height=\"5\"/>").into(), &["rect \"r\"", "width", "NaN"]),
        ("flat.svg", svg("<rect id=\"r\" width=\"0\" height=\"5\"/>").into(), &["nothing is visible"]),
        ("blank.svg", svg("").into(), &["nothing is visible"]),
        ("empty.svg", Vec::new(), &["not an SVG"]),
        ("noise.svg", b"\x89\xff\x00noise".into(), &["UTF-8", "byte 0"]),
        ("open.svg", b"<svg xmlns=\"http://www.w3.org/2000/svg\"><g>".into(), &["open.svg"]),
        (
            "entity.svg",
            format!("<!DOCTYPE svg [<!ENTITY f SYSTEM \"/etc/hostname\">]>{}", svg("<text>&f;</text>")).into(),
            &["entity", "f"],
        ),
    ];
    for (name, bytes, words) in cases {
        here.write(name, bytes);
        let words = [words, &[*name][..]].concat();
        render_pair(&here, &["--svg", name], &["--svg", "mended.svg"], &words);
        refuse(&here, &["inspect", name], &words);
    }
    // An icon without colours is black.
    here.write("black.svg", svg(&square.replace("fill", "class")));
    let mended = ["--svg", "black.svg", "--no-svg-colors"];
    render_pair(&here, &["--svg", "black.svg"], &mended, &["black.svg", "all of it is black", "--no-svg-colors"]);
    for verb in ["render", "inspect"] {
        refuse(&here, &[verb, "--svg", "missing.svg"], &["missing.svg", "No such file"]);
        refuse(&here, &[verb, "--svg", "out"], &["out", "directory"]);
    }
    refuse(&here, &["inspect", "file.txt"], &["file.txt", ".svg", ".toml"]);
}

const CAMERA: &str = "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n";

#[test]
fn scene_files() {
    let here = Workdir::new();
    std::fs::create_dir(here.path("scenes")).unwrap();
    here.write(
        "above.svg",
        "<svg xmlns=\"http://www.w3.org/2000/svg\"><rect width=\"5\" height=\"5\" fill=\"red\"/></svg>",
    );
    here.write(
        "scenes/mended.svg",
        "<svg xmlns=\"http://www.w3.org/2000/svg\"><rect width=\"5\" height=\"5\" fill=\"red\"/></svg>",
    );
    let light = |keys: &str| format!("{CAMERA}[[light]]\n{keys}\n");
    let surface = |keys: &str| format!("{CAMERA}[[surface]]\n{keys}\n");
    let square = light("path = \"M0 0H1V1H0Z\"");
    let cases: &[(&str, String, String, &[&str])] = &[
        ("nothing", String::new(), CAMERA.into(), &[":1: camera: missing"]),
        ("syntax", light("path = \"M0 0"), square.clone(), &[":5:"]),
        (
            "unknown key",
            light("path = \"M0 0H1V1H0Z\"\nradience = 3"),
            light("path = \"M0 0H1V1H0Z\"\nradiance = 3"),
            &[":6: light[0].radience: unknown key", "radiance"],
        ),
        (
            "NaN in a path",
            light("path = \"M0 0H1VNaNH0Z\""),
            square.clone(),
            &[":5: light[0].path", "M0 0H1VNaNH0Z", "position"],
        ),
        (
            "NaN in a number",
            light("path = \"M0 0H1V1H0Z\"\nposition = [0, nan, 0]"),
            square.clone(),
            &[":6: light[0].position[1] = nan", "±1e9"],
        ),
        (
            "a huge number",
            light("path = \"M0 0H1V1H0Z\"\nposition = [0, 1e300, 0]"),
            square.clone(),
            &[":6: light[0].position[1] = 1e300", "±1e9"],
        ),
        ("no text", light("text = \"\""), light("text = \"A\""), &[":5: light[0].text = \"\"", "empty"]),
        ("no area", light("path = \"M0 0H1V0Z\""), square.clone(), &[":5: light[0].path = \"M0 0H1V0Z\"", "no area"]),
        (
            "scaled to nothing",
            light("path = \"M0 0H1V1H0Z\"\nscale = [1, 0]"),
            light("path = \"M0 0H1V1H0Z\"\nscale = [1, -1]"),
            &[":6: light[0].scale[1] = 0"],
        ),
        (
            "two kinds",
            light("path = \"M0 0H1V1H0Z\"\ntext = \"A\""),
            square.clone(),
            &[":4: light[0]", "path and text"],
        ),
        ("no kind", light("radiance = 1"), square.clone(), &[":4: light[0]", "path, svg, text"]),
        (
            "two strengths",
            light("path = \"M0 0H1V1H0Z\"\npower = 1\nradiance = 1"),
            light("path = \"M0 0H1V1H0Z\"\npower = 1"),
            &["light[0]", "radiance and power"],
        ),
        ("a folder", light("svg = \".\""), light("svg = \"mended.svg\""), &[":5: light[0].svg = \".\"", "a folder"]),
        (
            "a missing file",
            light("svg = \"missing.svg\""),
            light("svg = \"mended.svg\""),
            &[":5: light[0].svg = \"missing.svg\"", "no file"],
        ),
        (
            "a file above",
            light("svg = \"../above.svg\""),
            light("svg = \"./mended.svg\""),
            &[":5: light[0].svg = \"../above.svg\"", "`..`"],
        ),
        (
            "an absolute file",
            light("svg = \"/etc/hostname\""),
            light("svg = \"mended.svg\""),
            &["light[0].svg = \"/etc/hostname\"", "absolute"],
        ),
        (
            "a font above",
            light("text = \"A\"\nfont = \"../a.ttf\""),
            light("text = \"A\"\nfont = \"Amiri\""),
            &[":6: light[0].font = \"../a.ttf\"", "`..`"],
        ),
        (
            "an unknown font",
            light("text = \"A\"\nfont = \"Comic\""),
            light("text = \"A\"\nfont = \"Amiri\""),
            &[":6: light[0].font = \"Comic\"", "\"Amiri\""],
        ),
        (
            "an unknown axis",
            light("text = \"A\"\naxes = { opsz = 3 }"),
            light("text = \"A\"\naxes = { wght = 300 }"),
            &["light[0].text", "'opsz'", "'wght'"],
        ),
        (
            "alpha",
            surface("kind = \"plane\"\nsize = 2\nmaterial = { alpha = 1.5 }"),
            surface("kind = \"plane\"\nsize = 2\nmaterial = { alpha = 0.5 }"),
            &[":7: surface[0].material.alpha = 1.5", "between 0 and 1"],
        ),
        (
            "alpha and roughness",
            surface("kind = \"plane\"\nsize = 2\nmaterial = { alpha = 0.5, roughness = 0.5 }"),
            surface("kind = \"plane\"\nsize = 2"),
            &["surface[0].material", "alpha = roughness²"],
        ),
        ("no size", surface("kind = \"plane\""), surface("kind = \"plane\"\nsize = 2"), &["surface[0].size: missing"]),
        (
            "a mesh above",
            surface("kind = \"mesh\"\nfile = \"../a.glb\""),
            surface("kind = \"plane\"\nsize = 2"),
            &[":6: surface[0].file = \"../a.glb\"", "`..`"],
        ),
        (
            "a mesh of noise",
            surface("kind = \"mesh\"\nfile = \"mended.svg\""),
            surface("kind = \"plane\"\nsize = 2"),
            &[":6: surface[0].file = \"mended.svg\""],
        ),
    ];
    for (what, broken, mended, words) in cases {
        println!("{what}");
        here.write("scenes/broken.toml", broken);
        here.write("scenes/right.toml", mended);
        let words = [words, &["scenes/broken.toml"][..]].concat();
        render_pair(&here, &["scenes/broken.toml"], &["scenes/right.toml"], &words);
        refuse(&here, &["inspect", "scenes/broken.toml"], &words);
    }
    here.write("noise.toml", b"\x00\xff\xfe\x80");
    refuse(&here, &small(&["noise.toml"]), &["noise.toml", "UTF-8"]);
    refuse(&here, &small(&["missing.toml"]), &["missing.toml", "no file"]);
    refuse(&here, &small(&["out"]), &["out", "a folder"]);
    refuse(&here, &small(&["above.svg"]), &["above.svg:1"]);
}

#[test]
fn probe_files() {
    let here = Workdir::new();
    let case = |curves: &str, c0: &str| {
        format!("{{\"id\":7,\"curves\":{curves},\"c0\":{c0},\"c1\":[1,0,0],\"c2\":[0,0,1]}}\n")
    };
    let triangle = "[[[0,0],[0.3,0],[0.6,0],[1,0]],[[1,0],[0.6,0.3],[0.3,0.6],[0,1]],[[0,1],[0,0.6],[0,0.3],[0,0]]]";
    let good = case(triangle, "[0,1,0]");
    let cases: &[(String, &[&str])] = &[
        (case("[]", "[0,1,0]"), &["`curves` is empty"]),
        (case(&triangle.replace("[0,0]]]", "[0,0.1]]]"), "[0,1,0]"), &["`curves`", "not closed", "(0, 0)"]),
        (case(&triangle.replace("0.3,0.6", "1e300,0.6"), "[0,1,0]"), &["`curves`", "1e300", "±1e30"]),
        (case(&triangle.replace("0.3,0.6", "1e999,0.6"), "[0,1,0]"), &["out of range", "column"]),
        (case(&triangle.replace("0.3,0.6", "NaN,0.6"), "[0,1,0]"), &["column"]),
        (case(&triangle.replace("[0,0]]]", "0]]"), "[0,1,0]"), &["column"]),
        (case(triangle, "[0,1e300,0]"), &["`c0`", "1e300", "1e-30 to 1e30"]),
        (case(triangle, "[0,1]"), &["length 2", "3"]),
        (good.replace("c2", "c3"), &["missing field `c2`"]),
        (good[..40].to_owned(), &["EOF"]),
        ("\x01\u{fffd}noise".into(), &["column 1"]),
    ];
    for technique in ["tree", "exact"] {
        let probe = |file: &'static str| ["probe", "integral", file, "--technique", technique];
        here.write("good.jsonl", good.repeat(3));
        assert_eq!(here.stdout(probe("good.jsonl")).lines().count(), 3);
        for (line, words) in cases {
            here.write("bad.jsonl", line);
            refuse(&here, &probe("bad.jsonl"), &[words, &["bad.jsonl, line 1"][..]].concat());
        }
        refuse(&here, &probe("missing.jsonl"), &["missing.jsonl", "No such file"]);
        refuse(&here, &probe("out"), &["out", "directory"]);
    }
    // The line is counted; what came before it has been printed.
    here.write("late.jsonl", format!("{good}\n{good}{}", cases[0].0));
    let output = here.run(["probe", "integral", "late.jsonl"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("error: late.jsonl, line 4: `curves` is empty"));
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 2);

    here.write("scene.toml", CAMERA);
    let good = "{\"position\":[0,0,0],\"normal\":[0,1,0],\"view\":[0,1,0],\"alpha\":0.5}\n";
    let probe = ["probe", "scene", "scene.toml", "--points", "points.jsonl"];
    here.write("points.jsonl", good);
    assert_eq!(here.stdout(probe), "{\"irradiance\":[0.0,0.0,0.0],\"specular\":[0.0,0.0,0.0]}\n");
    let cases: &[(String, &[&str])] = &[
        (good.replace("0.5}", "1.5}"), &["`alpha` = 1.5", "between 0 and 1"]),
        (good.replace("0.5}", "-0.1}"), &["`alpha` = -0.1", "between 0 and 1"]),
        (good.replace("\"normal\":[0,1,0]", "\"normal\":[0,0,0]"), &["`normal`", "[0.0, 0.0, 0.0]", "no direction"]),
        (good.replace("\"view\":[0,1,0]", "\"view\":[0,0,0]"), &["`view`", "no direction"]),
        (good.replace("\"position\":[0,0,0]", "\"position\":[0,1e300,0]"), &["`position`", "1e300"]),
        (good.replace("\"alpha\"", "\"alhpa\""), &["unknown field `alhpa`", "`alpha`"]),
        (good.replace(",\"alpha\":0.5", ""), &["missing field `alpha`"]),
    ];
    for (line, words) in cases {
        here.write("points.jsonl", line);
        refuse(&here, &probe, &[words, &["points.jsonl, line 1"][..]].concat());
    }
    here.write("points.jsonl", good);
    here.write("scene.toml", "");
    refuse(&here, &probe, &["scene.toml:1: camera: missing"]);
    refuse(&here, &["probe", "scene", "scene.toml"], &["--points"]);
}
