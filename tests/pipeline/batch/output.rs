//! What a batch writes, and what of it a second one does not do again.

use super::{assert_same, batch, contents, drawing, end, events, some, square};
use crate::browser::Browser;
use crate::cli::{Workdir, json_lines, repository};
use serde_json::Value;

#[test]
fn every_item_has_a_picture_or_a_reason() {
    let here = Workdir::new();
    some(&here, 5);
    let said = events(&here, &["in", "-o", "made"], 1);
    let end = end(&said);
    assert_eq!((&end["done"], &end["failed"], &end["kept"]), (&Value::from(5), &Value::from(1), &Value::from(0)));
    let items: Vec<_> = said.iter().filter(|e| e["event"] == "item").collect();
    assert_eq!(items.len(), 6);
    let seconds = items.iter().find(|e| e["outcome"] == "done").unwrap()["seconds"].as_object().unwrap();
    for phase in ["parse", "settle", "tree", "shade", "write", "total", "wall"] {
        assert!(seconds[phase].as_f64().unwrap() > 0.0, "{phase}");
    }
    let names: Vec<_> = contents(&here.path("made")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(
        names,
        [
            "contact.png",
            "errors.jsonl",
            "index.html",
            "manifest.jsonl",
            "pictures/00.png",
            "pictures/01.png",
            "pictures/03.png",
            "pictures/04.png",
            "pictures/deep/02.png"
        ]
    );
    let errors = json_lines(&std::fs::read_to_string(here.path("made/errors.jsonl")).unwrap());
    assert_eq!(errors.len(), 1);
    assert_eq!((&errors[0]["number"], &errors[0]["element"]), (&Value::from(5), &Value::from("path \"p\"")));
    assert_eq!(errors[0]["file"], "in/99 broken.svg");
    assert!(errors[0]["reason"].as_str().unwrap().contains("position"), "{}", errors[0]);
}

#[test]
fn what_is_done_is_not_done_again_and_what_has_changed_is() {
    let here = Workdir::new();
    some(&here, 4);
    std::fs::remove_file(here.path("in/99 broken.svg")).unwrap();
    let done = |args: &[&str]| {
        let said = events(&here, &[&["in", "-o", "made"], args].concat(), 0);
        let end = end(&said);
        [&end["done"], &end["kept"]].map(|n| n.as_u64().unwrap())
    };
    assert_eq!(done(&[]), [4, 0]);
    let first = contents(&here.path("made"));
    assert_eq!(done(&[]), [0, 4]);
    assert!(first == contents(&here.path("made")), "a second run changes something");
    // Each thing that a picture hangs on.
    here.write("in/01.svg", square("#ff0000", 7));
    assert_eq!(done(&[]), [1, 3]);
    std::fs::write(here.path("made/pictures/00.png"), "not what was written").unwrap();
    std::fs::remove_file(here.path("made/pictures/03.png")).unwrap();
    assert_eq!(done(&[]), [2, 2]);
    assert_eq!(done(&["--radiance", "2"]), [4, 0]);
    assert_eq!(done(&["--radiance", "2", "--jobs", "1"]), [0, 4]);
    assert_eq!(done(&["--radiance", "2", "--exr"]), [4, 0]);
    let manifest = here.path("made/manifest.jsonl");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replacen("glyphlight ", "glyphlight 0.0", 1)).unwrap();
    assert_eq!(done(&["--radiance", "2", "--exr"]), [1, 3]);
    // A drawing that has become broken loses its picture.
    here.write("in/01.svg", "broken");
    events(&here, &["in", "-o", "made", "--radiance", "2", "--exr"], 1);
    assert!(!here.path("made/pictures/01.png").exists() && here.path("made/pictures/00.png").exists());
    // The template's own text and the files it names count as well.
    let template = "[camera]\nposition = [0, 1, 3]\nlook_at = [0, 0.5, 0]\n[[surface]]\nkind = \"plane\"\nsize = 9\n\
        material = { base_color_texture = \"t.png\" }\n[[light]]\nslot = true\nsize = 1\nposition = [0, 0.7, 0]\n";
    here.write("t.toml", template);
    std::fs::copy(here.path("made/pictures/00.png"), here.path("t.png")).unwrap();
    here.write("in/01.svg", square("#ff0000", 7));
    let done = |code: i32| {
        let said = events(&here, &["in", "-o", "other", "--scene", "t.toml"], code);
        end(&said)["done"].as_u64().unwrap()
    };
    assert_eq!([done(0), done(0)], [4, 0]);
    std::fs::copy(here.path("made/contact.png"), here.path("t.png")).unwrap();
    assert_eq!([done(0), done(0)], [4, 0]);
    here.write("t.toml", template.replace("0.7", "0.8"));
    assert_eq!([done(0), done(0)], [4, 0]);
}

#[test]
fn parts_make_the_whole() {
    let here = Workdir::new();
    some(&here, 5);
    events(&here, &["in", "-o", "whole"], 1);
    let some_of = events(&here, &["in", "-o", "parts", "--items", "1-2,5"], 1);
    assert_eq!((&end(&some_of)["done"], &end(&some_of)["failed"]), (&Value::from(2), &Value::from(1)));
    assert_eq!(end(&events(&here, &["in", "-o", "parts", "--items", "3"], 0))["done"], 1);
    assert!(contents(&here.path("whole")) != contents(&here.path("parts")));
    assert_eq!(end(&events(&here, &["in", "-o", "parts", "--items", "4-"], 1))["done"], 2);
    assert_same(&here.path("whole"), &here.path("parts"));
    let (code, _, err) = batch(&here, &["in", "-o", "parts", "--items", "7"]);
    assert!(code == 2 && err.contains("there are 6 items"), "{err}");
}

#[test]
fn a_dry_run_tells_and_does_nothing() {
    let here = Workdir::new();
    some(&here, 3);
    let (code, out, _) = batch(&here, &["in", "-o", "made", "--dry-run"]);
    assert!(code == 0 && out.contains("4 of 4 to do") && !here.path("made").exists(), "{out}");
    events(&here, &["in", "-o", "made"], 1);
    here.write("in/01.svg", square("#fff", 1));
    let before = contents(&here.path("made"));
    let planned = events(&here, &["in", "-o", "made", "--dry-run"], 0);
    let what: Vec<_> = planned.iter().map(|e| e["what"].as_str().unwrap()).collect();
    assert_eq!(what, ["done", "changed drawing", "new", "done"]);
    assert!(before == contents(&here.path("made")));
}

#[test]
fn items_of_one_name_do_not_overwrite_each_other() {
    let here = Workdir::new();
    for folder in ["a", "b"] {
        std::fs::create_dir(here.path(folder)).unwrap();
        here.write(&format!("{folder}/logo.svg"), square(if folder == "a" { "#f00" } else { "#00f" }, 10));
    }
    let names = |args: &[&str]| -> Vec<String> {
        let said = events(&here, &[args, &["-o", "made", "--dry-run"]].concat(), 0);
        said.iter().map(|e| e["name"].as_str().unwrap().to_owned()).collect()
    };
    let both = names(&["a", "b"]);
    assert!(both[0] != both[1] && both.iter().all(|name| name.starts_with("logo-")), "{both:?}");
    assert_eq!(names(&["a", "b", "--items", "2"]), [both[1].clone()]);
    assert_eq!(names(&["b", "a"]), [both[1].clone(), both[0].clone()]);
    assert_eq!(names(&["b/logo.svg"]), ["logo"]);
    // Below the part of a pattern that is spelled out.
    assert_eq!(names(&["*/*.svg"]), ["a/logo", "b/logo"]);
    assert_eq!(names(&["a/*.svg"]), ["logo"]);
}

#[test]
fn errors_stop_nothing_unless_they_are_told_to() {
    let here = Workdir::new();
    some(&here, 8);
    here.write("in/00.svg", "broken");
    let said = events(&here, &["in", "-o", "made", "--fail-fast", "--jobs", "1"], 1);
    let end = end(&said);
    assert_eq!((&end["failed"], &end["left"]), (&Value::from(1), &Value::from(8)));
    for (args, words) in [
        (&["nowhere", "-o", "x"][..], "nowhere: there is no such file"),
        (&["*.none", "-o", "x"], "no file is named so"),
        (&["out", "-o", "x"], "there is no SVG in it"),
        (&["in"], "--output"),
        (&["in", "-o", "x", "--items", "0"], "is not a number from 1 on"),
        (&["in", "-o", "x", "--scene", "template:none"], "there are floor, wall, shelf, checker"),
        (&["in", "-o", "in"], "the folder is not empty"),
        (&["in", "-o", "x", "--eps", "1"], "--eps goes with"),
        (&["in", "-o", "x", "--technique", "magic"], "magic"),
    ] {
        let (code, out, err) = batch(&here, args);
        assert!(code == 2 && out.is_empty() && err.contains(words), "{args:?}: {err}");
        assert!(!here.path("x").exists());
    }
}

#[test]
fn two_at_once_are_refused() {
    let here = Workdir::new();
    some(&here, 2);
    events(&here, &["in", "-o", "made"], 1);
    let lock = std::fs::File::open(here.path("made/.lock")).unwrap();
    lock.lock().unwrap();
    let (code, _, err) = batch(&here, &["in", "-o", "made"]);
    assert!(code == 2 && err.contains("another batch is writing"), "{err}");
    drop(lock);
    events(&here, &["in", "-o", "made"], 1);
}

#[test]
fn a_folder_that_cannot_be_written_is_one_error() {
    let here = Workdir::new();
    some(&here, 6);
    here.write("file", "a file");
    let (code, _, err) = batch(&here, &["in", "-o", "file/out"]);
    assert!(code == 2 && err.starts_with("error: file/out: ") && err.lines().count() == 1, "{err}");
    std::fs::create_dir(here.path("made")).unwrap();
    let (code, ..) = batch(&here, &["in", "-o", "made", "--items", "1-2"]);
    assert_eq!(code, 0);
    // The disk is full: no file may grow beyond half a kilobyte.
    let mut full = std::process::Command::new("sh");
    full.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_glyphlight"), "batch", "in"]);
    full.args(["-o", "made"]).args(super::SMALL).current_dir(here.path(""));
    let output = full.output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    let errors: Vec<_> = err.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(output.status.code() == Some(2) && errors.len() == 1 && errors[0].contains("made/"), "{err}");
    assert!(!contents(&here.path("made")).iter().any(|(name, _)| name.contains(".glyphlight-")));
    // What was done stays done.
    assert_eq!(end(&events(&here, &["in", "-o", "made"], 1))["kept"], 2);
}

#[test]
fn a_comparison_has_both_pictures() {
    let here = Workdir::new();
    here.write("a.svg", square("#fff", 10));
    let said = events(&here, &["a.svg", "-o", "made", "--compare", "--exr"], 0);
    let item = said.iter().find(|e| e["event"] == "item").unwrap();
    assert_eq!(item["pictures"], serde_json::json!(["pictures/a.png", "pictures/a.exr", "quad/a.png"]));
    let [rmse, max] = ["rmse", "max"].map(|k| item["difference"][k].as_f64().unwrap());
    assert!(0.0 < rmse && rmse < max && max < 0.3, "{item}");
    let bytes = |name: &str| std::fs::read(here.path(name)).unwrap();
    assert!(bytes("made/pictures/a.png") != bytes("made/quad/a.png"));
    // By the masked rectangle itself there is nothing to compare.
    let said = events(&here, &["a.svg", "-o", "same", "--compare", "--technique", "quad:512"], 0);
    assert_eq!(said[1]["difference"], Value::Null);
    assert!(bytes("same/pictures/a.png") == bytes("made/quad/a.png"));
}

#[test]
fn every_template_shows_the_drawing() {
    let here = Workdir::new();
    let (code, out, _) = batch(&here, &["--list"]);
    assert_eq!((code, out.lines().count()), (0, 4));
    let svg = repository("svg/badge.svg");
    for line in out.lines() {
        let name = line.split_whitespace().next().unwrap();
        let folder = name.replace(':', "-");
        events(&here, &[svg.to_str().unwrap(), "-o", &folder, "--scene", name], 0);
        let bytes = std::fs::read(here.path(&folder).join("pictures/badge.png")).unwrap();
        let picture = image::load_from_memory(&bytes).unwrap().into_rgb8();
        let bright = picture.pixels().filter(|p| p.0.iter().any(|&c| c > 200)).count();
        let lit = picture.pixels().filter(|p| p.0.iter().any(|&c| c > 8)).count();
        assert!((80..600).contains(&bright), "{name}: {bright} pixels shine");
        assert!(lit > bright + 200, "{name}: {lit} pixels are lit");
    }
}

#[test]
fn the_gallery_shows_filters_and_loads_nothing_else() {
    let Some(mut browser) = Browser::start() else { return };
    let here = Workdir::new();
    some(&here, 3);
    here.write("in/<b>&'\".svg", drawing("<rect width='50' height='50'/>"));
    events(&here, &["in", "-o", "made", "--compare"], 1);
    browser.open(&here.path("made/index.html"));
    let shown = "[...document.querySelectorAll('#cards > li')].filter((c) => !c.hidden).length";
    assert_eq!(browser.eval(shown), 5);
    assert_eq!(
        browser.eval("[...document.images].every((i) => i.complete ? i.naturalWidth > 0 : i.loading === 'lazy')"),
        true
    );
    assert_eq!(browser.eval(&format!("document.querySelector('input[value=failed]').click(), {shown}")), 1);
    assert_eq!(browser.eval(&format!("document.querySelector('input[value=all]').click(), {shown}")), 5);
    assert_eq!(browser.eval(&format!("search.value = '<b>', search.dispatchEvent(new Event('input')), {shown}")), 1);
    assert_eq!(browser.eval("document.querySelectorAll('b').length"), 0);
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
    assert!(browser.requests.iter().all(|r| r.starts_with("file://")), "{:?}", browser.requests);
}
