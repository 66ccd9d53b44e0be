//! The report of a comparison, and the command that writes it.

use crate::cli::Workdir;
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::technique::{ReferenceLobe, Sampling};
use glyphlight::backend::{Backend, Horizons, Settings, Technique};
use glyphlight::metrics::{Figures, figures, less_noise};
use glyphlight::report::page::PagePicture;
use glyphlight::report::scale::ErrorScale;
use glyphlight::report::{
    Block, Comparison, FORMAT, LeftOut, Machine, PictureSettings, RectangleTime, Row, SceneSource,
};
use glyphlight::scene::figures::{FIGURES, load};
use glyphlight::scene::{self, Scene};
use serde_json::Value;
use std::path::Path;

/// Text that is markup everywhere.
pub const NASTY: &str = "a <b>&\"quoted\"</script> | *x*, `y`\nend";

pub fn row(technique: &str, rmse: f64, yardstick: Option<&str>) -> Row {
    let errors = Figures {
        mae: rmse / 2.0,
        rmse,
        rmse_of_peak: Some(rmse / 4.0),
        max: rmse * 10.0,
        p999: rmse * 5.0,
        energy_ratio: Some(1.0 + rmse),
    };
    let stem = technique.replace(':', "-");
    Row {
        technique: technique.into(),
        backend: "cpu".into(),
        device: "2 threads, \"fast\"".into(),
        runs: 3,
        seconds: 0.25,
        prepare_seconds: 2e-3,
        ms_per_megapixel: 1929.0,
        rectangles: Some(12.5),
        yardstick: yardstick.map(Into::into),
        errors: yardstick.map(|_| errors),
        flip: yardstick.map(|_| 0.01),
        noise: None,
        yardstick_noise: None,
        rmse_less_noise: None,
        picture: format!("pictures/{stem}.png"),
        error_map: yardstick.map(|_| format!("errors/{stem}.png")),
    }
}

/// A comparison of three techniques and their yardstick.
pub fn comparison() -> Comparison {
    let rows = vec![
        row("tree", 1e-6, Some("exact")),
        row("uniform:30", 2e-5, Some("exact")),
        row("quad:512", 0.03, Some("exact")),
        row("exact", 0.0, None),
    ];
    Comparison {
        format: FORMAT,
        program: "glyphlight 0.1.0".into(),
        date: "2026-01-31T12:00:00Z".into(),
        machine: Machine { processor: "a | processor".into(), threads: 2, system: "linux x86_64".into() },
        scene: SceneSource { name: "night.toml".into(), source: format!("# {NASTY}\n[camera]\n") },
        settings: PictureSettings {
            width: 64,
            height: 36,
            samples: 1,
            tolerance: 1e-4,
            exposure: 0.0,
            tone_map: "neutral".into(),
            repeat: 3,
        },
        rectangles: vec![RectangleTime { backend: "cpu".into(), seconds: 0.02, ms_per_megapixel: 154.0 }],
        error_scale: Some(ErrorScale::new(0.3)),
        blocks: vec![Block { name: "integral".into(), about: "Against exact.".into(), rows }],
        left_out: vec![LeftOut { technique: "textured".into(), reason: NASTY.into() }],
    }
}

/// The pictures that rows name: each of one colour, all different.
pub fn pictures(comparison: &Comparison) -> Vec<PagePicture> {
    let rows = comparison.blocks.iter().flat_map(|b| &b.rows);
    let files = rows.flat_map(|r| [Some(r.picture.clone()), r.error_map.clone()]).flatten();
    let (width, height) = (comparison.settings.width, comparison.settings.height);
    let paint = |(i, file): (usize, String)| {
        let color = [(40 + 25 * i) as u8, (230 - 25 * i) as u8, (i * 90 % 256) as u8];
        let mut png = Vec::new();
        let rgb = image::RgbImage::from_pixel(width, height, image::Rgb(color));
        rgb.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        PagePicture { file, png }
    };
    files.enumerate().map(paint).collect()
}

#[test]
fn the_colour_scale_holds_every_error() {
    let mut last = 0.0;
    for exponent in -40..40 {
        let largest = 10_f64.powf(f64::from(exponent) / 8.0);
        let scale = ErrorScale::new(largest);
        assert!(scale.end >= largest * (1.0 - 1e-9) && scale.end <= largest * 2.5 + 1e-6, "{largest:e}: {scale:?}");
        assert!(scale.end >= last, "a larger error has a shorter scale: {largest:e}");
        last = scale.end;
    }
    let scale = ErrorScale::new(0.3);
    assert_eq!((scale.end, scale.linear), (0.5, 0.5e-4));
    let ticks = scale.ticks();
    assert_eq!(ticks.len(), 9);
    assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]) && ticks[4] == 0.0, "{ticks:?}");
    // The ends, no error, and the same distance on both sides; beyond the end nothing changes.
    assert_eq!((scale.place(0.5), scale.place(-0.5), scale.place(0.0)), (1.0, -1.0, 0.0));
    assert_eq!((scale.place(7.0), scale.place(1e-3)), (1.0, -scale.place(-1e-3)));
    // Linear about zero, a decade of error the same step of colour beyond.
    let near = scale.place(1e-6) / scale.place(0.5e-6);
    assert!((near - 2.0).abs() < 0.02, "{near}");
    let steps = [0.5, 0.05, 0.005].map(|e| scale.place(e));
    assert!(((steps[0] - steps[1]) - (steps[1] - steps[2])).abs() < 2e-3, "{steps:?}");
    // No error is dark; too dark is blue, too bright is orange.
    let [none, dark, bright] = [0.0, -0.05, 0.05].map(|e| scale.color(e));
    assert!(none.iter().all(|c| *c < 32) && dark[2] > 100 && dark[2] > dark[0] && bright[0] > bright[2], "{dark:?}");
    assert_eq!(scale.paint(&[0.0, -0.05]), [none, dark].concat());
    let bar = ErrorScale::bar(101, 2);
    assert_eq!((bar.len(), &bar[..3], &bar[150..153]), (606, &scale.color(-1.0)[..], &none[..]));
    // A pixel that is wrong by a ten-thousandth of the end is not the colour of one that is right.
    assert_ne!(scale.color(0.5e-4), none);
}

#[test]
fn json_and_csv_hold_the_same_numbers() {
    let comparison = comparison();
    let json: Value = serde_json::from_str(&comparison.json().unwrap()).unwrap();
    assert_eq!(json["format"], FORMAT);
    let rows = json["blocks"][0]["rows"].as_array().unwrap();
    let csv = comparison.csv();
    let lines: Vec<&str> = csv.trim_end().split("\r\n").collect();
    assert_eq!(lines.len(), 1 + rows.len());
    let names: Vec<&str> = lines[0].split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap();
    for (line, row) in lines[1..].iter().zip(rows) {
        // The one field with a comma is quoted, with its quotes doubled.
        assert!(line.contains("\"2 threads, \"\"fast\"\"\""), "{line}");
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), names.len() + 1);
        let field = |name: &str| fields[at(name) + usize::from(at(name) > at("device"))];
        assert_eq!(field("technique"), row["technique"].as_str().unwrap());
        let errors = ["mae", "rmse", "rmse_of_peak", "p999", "max", "energy_ratio"].map(|n| (n, &row["errors"][n]));
        let others = ["seconds", "ms_per_megapixel", "rectangles", "flip"].map(|n| (n, &row[n]));
        for (name, value) in errors.into_iter().chain(others) {
            // The reader of JSON here is right to one unit in the last place only.
            let near = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * a.abs();
            match (field(name).parse::<f64>(), value.as_f64()) {
                (Ok(a), Some(b)) => assert!(near(a, b) && !near(a, 1.001 * b + 1e-300), "{name}: {a} {b}"),
                (Err(_), None) => assert_eq!(field(name), ""),
                other => panic!("{name}: {other:?}"),
            }
        }
    }
}

#[test]
fn markdown_is_a_table_whatever_the_names_are() {
    let text = comparison().markdown();
    let rows: Vec<&str> = text.lines().filter(|l| l.starts_with('|')).collect();
    assert_eq!(rows.len(), 2 + 4, "{text}");
    let cells = |line: &str| line.matches('|').count() - line.matches("\\|").count();
    assert!(rows.iter().all(|line| cells(line) == cells(rows[0])), "{text}");
    assert!(rows[4].starts_with("| quad:512 | cpu | 250 ms | 2 ms | 1929 | 12.5 | 0.0150 | 0.0300 |"), "{}", rows[4]);
    assert!(rows[5].contains("| – | – |"), "{}", rows[5]);
    assert!(text.contains("- textured: a \\<b>&\"quoted\"\\</script> \\| \\*x\\*, \\`y\\` end"), "{text}");
    for word in ["64 × 36", "154 ms/Mpixel", "−0.5", "2 threads", "2026-01-31"] {
        assert!(text.contains(word), "{word} is not in\n{text}");
    }
}

#[test]
fn the_page_needs_nothing_else() {
    let comparison = comparison();
    let page = comparison.page(&pictures(&comparison));
    for outside in ["http://", "https://", "src=\"/", "url(", "@import", "<link rel=\"stylesheet\""] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(!page.contains("<b>") && page.matches("</script>").count() == 1, "a name is markup");
    assert_eq!(page.matches("data:image/png;base64,").count(), 7, "each picture once");
    assert!(page.contains("# a &lt;b&gt;&amp;&quot;quoted&quot;&lt;/script&gt; | *x*, `y`\nend\n[camera]"));
    // It begins with the picture that is most wrong, beside its yardstick.
    let [left, right] = ["left", "right"].map(|side| {
        let choice = page.split(&format!("<select id=\"{side}-choice\">")).nth(1).unwrap().split("</select>").next();
        let chosen = choice.unwrap().split(" selected").next().unwrap();
        chosen.rsplit('"').nth(1).unwrap().to_owned()
    });
    assert_eq!((left.as_str(), right.as_str()), ("pictures/exact.png", "pictures/quad-512.png"));
}

#[test]
fn figures_load_and_say_what_to_compare() {
    for figure in FIGURES {
        let loaded = load(figure.name).unwrap();
        assert!(!loaded.techniques.is_empty() && !loaded.scene.lights.is_empty(), "{}", figure.name);
        assert_eq!(loaded.text, figure.text);
        for wanted in &loaded.techniques {
            let technique: Technique = wanted.name.parse().unwrap();
            assert!(technique.to_string().starts_with(&wanted.name), "{}", wanted.name);
        }
    }
    let unknown = load("hole ").unwrap_err().to_string();
    assert!(unknown.contains("figure:hole ") && unknown.contains("alpha-0.01, alpha-0.1"), "{unknown}");
}

/// The RMSE of the default technique over that of the masked rectangle, without the noise of a yardstick that has some.
/// The default technique sees the lights `brighter` than they are.
fn rmse_over_quad(scene: &Scene, brighter: f64) -> f64 {
    let mut lit = scene.clone();
    lit.lights.iter_mut().flat_map(|l| &mut l.layers).for_each(|layer| layer.radiance *= brighter);
    let picture = scene.lights.iter().any(|l| l.layers.iter().any(|layer| layer.picture.is_some()));
    let sampling = Sampling { spp: 512, lobe: ReferenceLobe::Ltc, ..Sampling::default() };
    let yardstick = if picture { Technique::Reference(sampling) } else { Technique::Exact };
    let render = |scene: &Scene, technique: Technique, horizons: Horizons| {
        let settings =
            Settings { width: 32, height: 18, samples: 1, tolerance: 1e-4, technique, horizons, ..Settings::default() };
        CpuBackend.render(scene, &settings).unwrap().film
    };
    let ours = (&lit, Technique::Tree, Horizons::Both);
    let theirs = (scene, Technique::Quad { mask: 512 }, Horizons::Cosine);
    let [tree, quad] = [ours, theirs].map(|(seen, technique, horizons)| {
        let truth = render(scene, yardstick, horizons);
        let [seen, shown] =
            [render(seen, technique, horizons), truth.clone()].map(|f| f.reflected().collect::<Vec<_>>());
        let variance = truth.variance.iter().flatten().flatten().map(|&v| f64::from(v)).sum::<f64>();
        assert_eq!(variance > 0.0, picture, "noise where there is sampling, and only there");
        less_noise(figures(&seen, &shown).unwrap().rmse, (variance / (3 * shown.len()) as f64).sqrt())
    });
    println!("tree {tree:.2e}, quad {quad:.2e}");
    tree / quad
}

/// The default technique has at most a tenth of the masked rectangle's error, in every scene that is bundled.
#[test]
fn the_tree_beats_the_masked_rectangle_tenfold() {
    let mut scenes: Vec<_> = FIGURES.iter().map(|f| (f.name.to_owned(), load(f.name).unwrap().scene)).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            scenes.push((path.display().to_string(), scene::file::load(&path).unwrap().scene));
        }
    }
    assert!(scenes.len() >= FIGURES.len() + 3);
    for (name, scene) in &scenes {
        println!("{name}:");
        let ratio = rmse_over_quad(scene, 1.0);
        assert!(ratio <= 0.1, "{name}: {ratio}");
    }
    // A light that is a twentieth too bright is noticed.
    assert!(rmse_over_quad(&load("mask").unwrap().scene, 1.05) > 0.1);
}

/// The smallest comparison there is.
const SMALL: [&str; 8] = ["--width", "32", "--height", "18", "--repeat", "1", "--backend", "cpu"];

fn compare(here: &Workdir, args: &[&str]) -> std::process::Output {
    here.run([&["compare"], args, &SMALL[..]].concat())
}

#[test]
fn compare_writes_all_that_it_says() {
    let here = Workdir::new();
    let said = compare(&here, &["figure:hole", "--techniques", "tree,uniform:6,textured", "--exr", "-o", "out/cmp"]);
    let stderr = String::from_utf8(said.stderr).unwrap();
    assert_eq!(said.status.code(), Some(0), "{stderr}");
    assert_eq!(stderr, "warning: left out: textured: no light has a picture; it would be the tree\n");
    let stdout = String::from_utf8(said.stdout).unwrap();
    assert!(stdout.contains("uniform:6") && stdout.contains("exact, cosine horizon"), "{stdout}");
    let json: Value = serde_json::from_slice(&std::fs::read(here.path("out/cmp/table.json")).unwrap()).unwrap();
    let rows = json["blocks"][0]["rows"].as_array().unwrap();
    let yardsticks: Vec<_> = rows.iter().map(|r| [&r["technique"], &r["yardstick"]].map(|v| v.as_str())).collect();
    let expected = [
        [Some("tree"), Some("exact")],
        [Some("uniform:6"), Some("exact, cosine horizon")],
        [Some("exact"), None],
        [Some("exact, cosine horizon"), None],
    ];
    assert_eq!(yardsticks, expected);
    assert_eq!(json["left_out"][0]["technique"], "textured");
    assert_eq!(json["scene"]["name"], "figure:hole");
    assert!(json["rectangles"][0]["seconds"].as_f64().unwrap() > 0.0);
    let end = json["error_scale"]["end"].as_f64().unwrap();
    let folder = here.path("out/cmp");
    for row in rows {
        assert!(row["seconds"].as_f64().unwrap() > 0.0 && row["rectangles"].as_f64().unwrap() > 0.0, "{row}");
        let picture = folder.join(row["picture"].as_str().unwrap());
        assert!(picture.exists() && picture.with_extension("exr").exists(), "{row}");
        if let Some(map) = row["error_map"].as_str() {
            assert_eq!(image::open(folder.join(map)).unwrap().into_rgb8().dimensions(), (32, 18));
            let max = row["errors"]["max"].as_f64().unwrap();
            assert!(max <= end, "{max} is beyond the scale {end}");
        }
    }
    // The tree keeps its tolerance (two lobes, and the floor of single precision).
    assert!(rows[0]["errors"]["max"].as_f64().unwrap() <= 2.0 * (1e-4 + 2e-5), "{}", rows[0]);
    let names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 7, "{names:?}");
    assert_eq!(here.files().iter().filter(|f| f.to_string_lossy().contains(".glyphlight-")).count(), 0);
}

#[test]
fn nothing_of_the_users_is_overwritten() {
    let here = Workdir::new();
    let tree = ["figure:hole", "--techniques", "tree", "-o"];
    let refused = |args: &[&str], message: &str| {
        let before = here.files();
        let output = compare(&here, args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(message) && stderr.lines().count() == 1, "{stderr}");
        assert_eq!(here.files(), before, "{args:?} leaves something behind");
    };
    here.write("file", "mine");
    refused(&[&tree[..], &["file"]].concat(), "file: there is a file of that name");
    refused(&[&tree[..], &["no/such/folder"]].concat(), "there is no such folder");
    here.write("out/letter.txt", "mine");
    refused(&[&tree[..], &["out"]].concat(), "out: the folder is not empty");
    refused(&[&tree[..], &["out", "--force"]].concat(), "\"letter.txt\", which is no part of a comparison");
    // What cannot show anything ends before it begins.
    let textured = ["figure:hole", "--techniques", "textured", "-o", "new"];
    refused(&textured, "nothing to compare: textured: no light has a picture");
    refused(
        &["figure:picture", "--techniques", "exact", "-o", "new"],
        "nothing to compare: exact: a light has a picture",
    );
    refused(&[&tree[..], &["new", "--spp", "16"]].concat(), "--spp has no effect here");
    // An error in the middle leaves nothing either.
    refused(&["figure:none", "-o", "new"], "figure:none: there is no such figure");
    refused(&[&tree[..], &["new", "--samples", "0"]].concat(), "with 0 samples per pixel");

    // Into an empty folder without a word; over an earlier comparison with --force only, and then wholly.
    std::fs::create_dir(here.path("empty")).unwrap();
    assert_eq!(compare(&here, &[&tree[..], &["empty"]].concat()).status.code(), Some(0));
    assert!(here.path("empty/pictures/tree.png").exists());
    let uniform = ["figure:hole", "--techniques", "uniform:6", "-o", "empty"];
    refused(&uniform, "empty: the folder is not empty; --force replaces an earlier comparison");
    assert_eq!(compare(&here, &[&uniform[..], &["--force"]].concat()).status.code(), Some(0));
    assert!(here.path("empty/pictures/uniform-6.png").exists() && !here.path("empty/pictures/tree.png").exists());
    assert_eq!(std::fs::read_to_string(here.path("out/letter.txt")).unwrap(), "mine");

    // Nor is it where a folder has the names of a comparison, but not all that is in it is one's.
    for folder in ["album/pictures", "empty/errors/more"] {
        std::fs::create_dir_all(here.path(folder)).unwrap();
    }
    here.write("album/pictures/cat.png", "mine");
    refused(&[&tree[..], &["album", "--force"]].concat(), "album: the folder has no table.json of a comparison");
    here.write("album/table.json", "{ \"format\": 1, \"program\": \"another 1.0\" }");
    refused(&[&tree[..], &["album", "--force"]].concat(), "album: the folder has no table.json of a comparison");
    for foreign in ["errors/more/cat.png", "pictures/cat.jpg"] {
        here.write(&format!("empty/{foreign}"), "mine");
        let named = foreign.strip_suffix("/cat.png").unwrap_or(foreign);
        let message = format!("empty: the folder holds \"{named}\", which is no part of a comparison");
        refused(&[&uniform[..], &["--force"]].concat(), &message);
        std::fs::remove_file(here.path(&format!("empty/{foreign}"))).unwrap();
        let _ = std::fs::remove_dir(here.path("empty/errors/more"));
    }
    assert_eq!(compare(&here, &[&tree[..], &["empty", "--force"]].concat()).status.code(), Some(0));
}

#[test]
fn the_noise_of_a_yardstick_is_told_from_the_error() {
    let here = Workdir::new();
    let rows = |folder: &str, args: &[&str]| -> Vec<Value> {
        let output = compare(&here, &[args, &["-o", folder]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read(here.path(folder).join("table.json")).unwrap();
        let json: Value = serde_json::from_slice(&text).unwrap();
        json["blocks"][0]["rows"].as_array().unwrap().clone()
    };
    let number = |value: &Value| value.as_f64().unwrap();
    // With a sixteenth of the samples the noise grows fourfold, or more as the points are well spread; what is left without it is still the technique's own.
    let of = |folder: &str, spp: &str| {
        let rows = rows(folder, &["figure:picture", "--techniques", "tree,quad", "--spp", spp]);
        assert_eq!(rows[2]["technique"], format!("reference:{spp} LTC"));
        let noise = number(&rows[2]["noise"]);
        assert_eq!(number(&rows[0]["yardstick_noise"]), noise);
        assert!(number(&rows[1]["yardstick_noise"]) > 0.0 && rows[2]["yardstick_noise"].is_null());
        let [tree, quad] = [&rows[0], &rows[1]].map(|r| [number(&r["errors"]["rmse"]), number(&r["rmse_less_noise"])]);
        // What the tree differs by is the noise; what the rectangle differs by is not.
        assert!((0.5..2.0).contains(&(tree[0] / noise)) && tree[1] < tree[0], "{tree:?}, noise {noise}");
        assert!((tree[1].powi(2) - (tree[0].powi(2) - noise * noise).max(0.0)).abs() < 1e-12, "{tree:?}");
        assert!((quad[1] / quad[0] - 1.0).abs() < 0.05 && quad[1] < quad[0], "{quad:?}");
        noise
    };
    let [coarse, fine] = [of("coarse", "64"), of("fine", "1024")];
    assert!((2.5..14.0).contains(&(coarse / fine)), "{coarse} {fine}");
    // `reference` in the list is one that --spp goes with; a yardstick without noise leaves the columns empty.
    let listed = rows("listed", &["figure:hole", "--techniques", "reference", "--spp", "16"]);
    assert_eq!(listed[0]["technique"], "reference:16 LTC");
    assert!(listed[0]["yardstick_noise"].is_null() && listed[0]["rmse_less_noise"].is_null(), "{}", listed[0]);
}

#[test]
fn a_scene_says_what_to_compare_with_it() {
    let here = Workdir::new();
    let scene = load("hole").unwrap().text.replace("\"kuge\"", "\"uniform:4\"");
    here.write("scene.toml", &scene);
    let techniques = |folder: &str, more: &[&str]| -> Vec<String> {
        let output = compare(&here, &[&["scene.toml", "-o", folder], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let json: Value =
            serde_json::from_slice(&std::fs::read(here.path(folder).join("table.json")).unwrap()).unwrap();
        assert_eq!(json["scene"]["source"].as_str(), Some(scene.as_str()));
        let rows = json["blocks"][0]["rows"].as_array().unwrap();
        rows.iter().map(|r| r["technique"].as_str().unwrap().to_owned()).collect()
    };
    let yardsticks = ["exact", "exact, cosine horizon"];
    assert_eq!(techniques("a", &[]), [&["tree", "uniform:4", "uniform:30", "quad:512"], &yardsticks[..]].concat());
    assert_eq!(techniques("b", &["--techniques", "uniform:5"]), ["uniform:5", "exact, cosine horizon"]);
    let wrong = [
        ("\"uniform:4\"", "\"unifrom\"", "scene.toml:22: compare.techniques[1] = \"unifrom\": `unifrom` is none of"),
        ("\"uniform:4\"", "4", "scene.toml:22: compare.techniques[1] = 4: must be a string"),
        ("techniques = ", "technique = ", "scene.toml:22: compare.technique: unknown key; known here: techniques"),
    ];
    for (from, to, message) in wrong {
        here.write("wrong.toml", scene.replace(from, to));
        // It is checked by every verb that reads scenes.
        for verb in ["compare", "render"] {
            let output = here.run([verb, "wrong.toml", "-o", "out/x.png"]);
            let stderr = String::from_utf8(output.stderr).unwrap().replace("wrong.toml", "scene.toml");
            assert_eq!(output.status.code(), Some(2), "{stderr}");
            assert!(stderr.starts_with(&format!("error: {message}")), "{stderr}");
        }
    }
}
