//! From what is given to items: files, folders, patterns and lists. The only file that names glob.

use super::{BatchError, names};
use crate::backend::Technique;
use crate::scene::file::{SceneError, items};
use crate::scene::folder::read;
use crate::scene::slot::Change;
use std::path::{Path, PathBuf};

/// Largest list, bytes.
const MAX_LIST: u64 = 64 << 20;
/// Deepest folder that is looked into.
const DEEPEST: usize = 64;

/// A drawing that is to be rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// From 1, in the order of the inputs.
    pub number: usize,
    /// The SVG file.
    pub file: PathBuf,
    /// The name of its picture: a path without ending, its parts separated by `/`.
    pub name: String,
    /// What it has otherwise than the template's slot says.
    pub change: Change,
    /// How it is rendered, if otherwise than the others.
    pub technique: Option<Technique>,
}

/// An item before it has a name of its own.
struct Found {
    file: PathBuf,
    name: String,
    change: Change,
    technique: Option<Technique>,
}

/// The items that the inputs stand for: in the order of the inputs, those of a folder or pattern sorted by path, those of a list as
/// they stand there.
///
/// A folder stands for all files below it whose names end in `.svg` or `.svgz`; symbolic links to folders are not followed. What is no file
/// and holds `*`, `?` or `[` is a pattern. Files that end in `.toml` or `.csv` are lists.
///
/// # Errors
/// An input that is nothing or holds nothing, or a list that is wrong.
pub fn items(inputs: &[PathBuf]) -> Result<Vec<Item>, BatchError> {
    let mut all = Vec::new();
    for input in inputs {
        let before = all.len();
        if input.is_dir() {
            folder(input, Path::new(""), 0, &mut all)?;
        } else if input.exists() {
            match ending(input).as_str() {
                "toml" | "csv" => list(input, &mut all)?,
                _ => all.push(lone(input.clone())),
            }
        } else {
            pattern(input, &mut all)?;
        }
        if all.len() == before {
            return Err(fault(input, "there is no SVG in it"));
        }
    }
    let mut names: Vec<String> = all.iter().map(|found| found.name.clone()).collect();
    let files: Vec<&Path> = all.iter().map(|found| found.file.as_path()).collect();
    names::told_apart(&mut names, &files);
    let item = |(index, (found, name)): (usize, (Found, String))| {
        let Found { file, change, technique, .. } = found;
        Item { number: index + 1, file, name, change, technique }
    };
    Ok(all.into_iter().zip(names).enumerate().map(item).collect())
}

fn fault(path: &Path, message: impl Into<String>) -> BatchError {
    BatchError::Input { path: path.into(), message: message.into() }
}

fn ending(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

fn is_svg(path: &Path) -> bool {
    matches!(ending(path).as_str(), "svg" | "svgz")
}

fn lone(file: PathBuf) -> Found {
    let name = names::of_file(Path::new(file.file_name().unwrap_or_default()));
    Found { file, name, change: Change::default(), technique: None }
}

/// All drawings in a folder and below, by path.
fn folder(root: &Path, below: &Path, depth: usize, all: &mut Vec<Found>) -> Result<(), BatchError> {
    let path = root.join(below);
    if depth > DEEPEST {
        return Err(fault(&path, format!("folders nested more than {DEEPEST} deep")));
    }
    let io = |e: std::io::Error| fault(&path, e.to_string());
    let mut entries = std::fs::read_dir(&path).map_err(io)?.collect::<Result<Vec<_>, _>>().map_err(io)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let below = below.join(entry.file_name());
        let kind = entry.file_type().map_err(|e| fault(&entry.path(), e.to_string()))?;
        if kind.is_dir() {
            folder(root, &below, depth + 1, all)?;
        } else if is_svg(&below) && !entry.path().is_dir() {
            let name = names::of_file(&below);
            all.push(Found { file: root.join(below), name, change: Change::default(), technique: None });
        }
    }
    Ok(())
}

/// The files that a pattern stands for, by path.
fn pattern(input: &Path, all: &mut Vec<Found>) -> Result<(), BatchError> {
    let text = input.to_str().filter(|text| text.contains(['*', '?', '[']));
    let Some(text) = text else { return Err(fault(input, "there is no such file or folder")) };
    let options = glob::MatchOptions { require_literal_separator: true, ..glob::MatchOptions::default() };
    let paths = glob::glob_with(text, options).map_err(|e| fault(input, format!("it is no pattern: {e}")))?;
    let mut files = Vec::new();
    for path in paths {
        let path = path.map_err(|e| fault(e.path(), e.error().to_string()))?;
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(fault(input, "no file is named so"));
    }
    // Names begin below the folders that the pattern spells out.
    let first = text.find(['*', '?', '[']).unwrap_or_default();
    let root = Path::new(&text[..text[..first].rfind('/').map_or(0, |at| at + 1)]);
    for file in files {
        let name = names::of_file(file.strip_prefix(root).unwrap_or(&file));
        all.push(Found { file, name, change: Change::default(), technique: None });
    }
    Ok(())
}

/// The items of a list.
fn list(path: &Path, all: &mut Vec<Found>) -> Result<(), BatchError> {
    let bytes = read(path, MAX_LIST).map_err(|e| fault(path, e.to_string()))?;
    let text = String::from_utf8(bytes)
        .map_err(|e| fault(path, format!("not UTF-8 text from byte {} on", e.utf8_error().valid_up_to())))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for listed in items::parse(text, path)? {
        let items::Listed { file, name, change, technique, place } = listed;
        let name = match name {
            None => names::of_file(Path::new(Path::new(&file).file_name().unwrap_or_default())),
            Some(name) => names::given(&name).map_err(|reason| BatchError::Name { place, name, reason })?,
        };
        let technique = technique
            .map(|wanted| {
                let wrong = |limit| SceneError::Value {
                    place: wanted.place.clone(),
                    value: format!("{:?}", wanted.name),
                    limit,
                };
                wanted.name.parse().map_err(wrong)
            })
            .transpose()?;
        all.push(Found { file: folder.join(file), name, change, technique });
    }
    Ok(())
}
