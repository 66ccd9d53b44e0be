//! Lists of items with what each has otherwise: TOML and CSV.

use super::{batch, end, events, square};
use crate::cli::Workdir;
use glyphlight::scene::file::items::{Listed, parse};
use std::path::Path;

const TOML: &str = r##"
[[item]]
file = "a.svg"

[[item]]
file = "a.svg"
name = "red/a"
color = "#ff0000"
rotation = [0, 15, 0]
size = 0.5
svg_colors = false
technique = "uniform:6"
radiance = [1, 2, 3]
"##;

const CSV: &str = "file,name,color,rotation,size,svg_colors,technique,radiance
a.svg,,,,,,,

a.svg,red/a,#ff0000,0 15 0,0.5,false,uniform:6,1 2 3
";

/// Without the places, which differ.
fn read(text: &str, name: &str) -> Result<Vec<Listed>, String> {
    let list = parse(text.into(), Path::new(name)).map_err(|e| e.to_string())?;
    Ok(list
        .into_iter()
        .map(|mut listed| {
            listed.place.clear();
            if let Some(wanted) = &mut listed.technique {
                wanted.place.line = 0;
                wanted.place.file = "list".into();
            }
            listed
        })
        .collect())
}

#[test]
fn both_kinds_say_the_same() {
    let [toml, csv] = [read(TOML, "l.toml").unwrap(), read(CSV, "l.csv").unwrap()];
    assert_eq!(toml, csv);
    assert_eq!(toml.len(), 2);
    assert_eq!((toml[0].name.as_deref(), toml[1].name.as_deref()), (None, Some("red/a")));
    assert_eq!(toml[1].change.size, Some([0.5; 2]));
    assert_eq!(toml[1].change.radiance, Some([1.0, 2.0, 3.0]));
    assert_eq!(toml[1].change.color, Some([1.0, 0.0, 0.0]));
    assert_ne!(read(&CSV.replace("0.5", "0.6"), "l.csv").unwrap(), toml);
    // Quotes, and what is none.
    let odd = read("file,name\n\"a \"\"b\"\".svg\",\"x,y\"\n", "l.csv").unwrap();
    assert_eq!((odd[0].file.as_str(), odd[0].name.as_deref()), ("a \"b\".svg", Some("x,y")));
}

#[test]
fn faults_name_the_line_and_the_key() {
    for (text, name, words) in [
        ("file,size\na.svg,1\nb.svg,-1\n", "l.csv", "l.csv:3: item[1].size = -1"),
        ("file,size\na.svg,big\n", "l.csv", "item[0].size = \"big\""),
        ("file,sise\na.svg,1\n", "l.csv", "item[0].sise: unknown key"),
        ("file,size\na.svg\n", "l.csv", "l.csv:2"),
        ("size\n1\n", "l.csv", "item[0].file: missing"),
        ("file,rotation\na.svg,1 2\n", "l.csv", "item[0].rotation = [1.0, 2.0]: must be an array of 3"),
        ("file,svg_colors\na.svg,yes\n", "l.csv", "must be true or false"),
        ("[[item]]\nfile = \"a.svg\"\ncolor = \"red\"\n", "l.toml", "l.toml:3: item[0].color"),
        ("[[items]]\nfile = \"a.svg\"\n", "l.toml", "unknown key"),
        ("", "l.toml", "a list has [[item]]s"),
    ] {
        let fault = read(text, name).unwrap_err();
        assert!(fault.contains(words), "{text}: {fault}");
    }
}

#[test]
fn items_have_their_own_ways() {
    let here = Workdir::new();
    std::fs::create_dir(here.path("list")).unwrap();
    here.write("list/a.svg", square("#fff", 10));
    here.write("list/l.toml", TOML);
    let said = events(&here, &["list/l.toml", "-o", "made"], 0);
    assert_eq!(end(&said)["done"], 2);
    let picture = |name: &str| image::open(here.path(name)).unwrap().into_rgb8();
    let [plain, red] = [picture("made/pictures/a.png"), picture("made/pictures/red/a.png")];
    let shines = |p: &image::RgbImage| p.pixels().filter(|p| p.0[0] > 150).count();
    assert!(shines(&plain) > 2 * shines(&red) && shines(&red) > 10, "{} {}", shines(&plain), shines(&red));
    assert!(red.pixels().all(|p| p.0[2] < 120) && plain.pixels().any(|p| p.0[2] > 200));
    for (name, words) in [
        ("../up", "must not have a `..`"),
        ("/abs", "must not be absolute"),
        ("a\\\\b", "must not hold"),
        ("nul", "no name that every file system takes"),
    ] {
        here.write("list/bad.toml", format!("[[item]]\nfile = \"a.svg\"\nname = \"{name}\"\n"));
        let (code, _, err) = batch(&here, &["list/bad.toml", "-o", "bad"]);
        assert!(code == 2 && err.contains(words) && err.contains("bad.toml:1"), "{name}: {err}");
    }
    here.write("list/bad.toml", "[[item]]\nfile = \"a.svg\"\ntechnique = \"magic\"\n");
    let (code, _, err) = batch(&here, &["list/bad.toml", "-o", "bad"]);
    assert!(code == 2 && err.contains("bad.toml:3: item[0].technique"), "{err}");
    assert!(!here.path("bad").exists());
}
