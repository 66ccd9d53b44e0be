//! Sets as they are published: our own drawings, and icons from the npm registry, fetched when the test runs.

use super::{batch, drawing, end, events, square};
use crate::cli::{Workdir, repository};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The set, of a version that stays.
const SET: &str = "bootstrap-icons@1.11.3";
/// How many of them.
const COUNT: usize = 100;

/// The folder of the icons, or why they can't be had. Once fetched, they are kept beside what cargo builds.
fn icons() -> Result<PathBuf, String> {
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(SET.replace('@', "-"));
    let icons = kept.join("package/icons");
    if icons.is_dir() {
        return Ok(icons);
    }
    let fresh = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).map_err(|e| e.to_string())?;
    let run = |program: &str, args: &[&str]| {
        let output = Command::new(program).args(args).current_dir(fresh.path()).stdin(Stdio::null()).output();
        let output = output.map_err(|e| format!("{program}: {e}"))?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() { Ok(output.stdout) } else { Err(format!("{program} {}: {said}", args.join(" "))) }
    };
    let name = run("npm", &["pack", "--silent", "--fetch-retries=1", "--fetch-timeout=20000", SET])?;
    run("tar", &["xzf", String::from_utf8_lossy(&name).trim()])?;
    // Of two tests at once one is first.
    match std::fs::rename(fresh.path(), &kept) {
        Err(e) if !icons.is_dir() => Err(e.to_string()),
        _ => Ok(icons),
    }
}

/// Renders a folder at 64² and gives how bright each picture is at most, 0 to 255, by its name.
fn brightest(here: &Workdir, folder: &str, count: u64) -> Vec<(String, u8)> {
    let args = [folder, "-o", "night", "--json"];
    let output =
        here.run([&["batch"], &args[..], &["--width=64", "--height=64", "--samples=1", "--backend=cpu"]].concat());
    let said = crate::cli::json_lines(&String::from_utf8(output.stdout).unwrap());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(end(&said)["done"], count);
    let items = said.iter().filter(|event| event["event"] == "item");
    let of = |event: &serde_json::Value| {
        let name = event["pictures"][0].as_str().unwrap();
        let picture = image::open(here.path("night").join(name)).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (64, 64));
        (name.to_owned(), picture.as_raw().iter().copied().max().unwrap())
    };
    items.map(of).collect()
}

#[test]
fn our_own_drawings_all_shine() {
    let here = Workdir::new();
    let svg = repository("svg");
    let count = std::fs::read_dir(&svg)
        .unwrap()
        .filter(|e| e.as_ref().unwrap().path().extension().is_some_and(|e| e == "svg"))
        .count();
    let dark: Vec<_> =
        brightest(&here, svg.to_str().unwrap(), count as u64).into_iter().filter(|(_, most)| *most < 200).collect();
    assert!(dark.is_empty() && count > 10, "{dark:?}");
}

#[test]
fn public_icons_all_shine() {
    let icons = match icons() {
        Ok(icons) => icons,
        Err(reason) => {
            assert!(std::env::var_os("CI").is_none(), "a set of icons is required here: {reason}");
            let line = format!("SKIPPED: {SET} was NOT rendered: {}\n", reason.lines().next().unwrap_or_default());
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            return;
        }
    };
    let mut files: Vec<PathBuf> = std::fs::read_dir(icons).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "svg"));
    files.sort();
    let here = Workdir::new();
    std::fs::create_dir(here.path("in")).unwrap();
    for file in files.iter().step_by(files.len() / COUNT).take(COUNT) {
        std::fs::copy(file, here.path("in").join(file.file_name().unwrap())).unwrap();
    }
    let all = brightest(&here, "in", COUNT as u64);
    let dark: Vec<_> = all.iter().filter(|(_, most)| *most < 200).collect();
    assert!(dark.is_empty(), "{dark:?}");
}

#[test]
fn a_drawing_that_would_be_dark_is_no_picture() {
    let here = Workdir::new();
    std::fs::create_dir(here.path("in")).unwrap();
    here.write("in/a.svg", drawing("<rect width='0' height='9'/>"));
    here.write("in/b.svg", drawing(""));
    let said = events(&here, &["in", "-o", "night"], 1);
    assert_eq!(end(&said)["failed"], 2);
    assert_eq!(batch(&here, &["in/a.svg", "-o", "other"]).0, 1);
    assert!(!here.path("night/pictures/a.png").exists());
}

/// Found in librsvg's tests (786372): an icon in #010101 left the picture black to the last pixel, and nobody said so.
#[test]
fn ink_that_is_nearly_black_is_lit_in_white() {
    let here = Workdir::new();
    std::fs::create_dir(here.path("in")).unwrap();
    for ink in ["010101", "181818", "202020"] {
        here.write(&format!("in/{ink}.svg"), square(&format!("#{ink}"), 20));
    }
    let said = events(&here, &["in", "-o", "night"], 0);
    let lit: Vec<_> = said.iter().filter_map(|event| event["was_black"].as_bool()).collect();
    let names: Vec<_> = said.iter().filter_map(|event| event["name"].as_str()).collect();
    let of = |name: &str| lit[names.iter().position(|n| *n == name).unwrap()];
    assert!(of("010101") && of("181818") && !of("202020"), "{names:?} {lit:?}");
    let most = |name: &str| {
        let picture = image::open(here.path(&format!("night/pictures/{name}.png"))).unwrap().into_rgb8();
        picture.as_raw().iter().copied().max().unwrap()
    };
    assert!(most("010101") > 200 && most("010101") == most("181818") && most("202020") < most("010101"));
}
