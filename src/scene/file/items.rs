//! Lists of drawings for a template, with what each has otherwise than the slot: TOML or CSV.
//!
//! ```toml
//! [[item]]
//! file = "icons/sun.svg"     # looked up beside the list
//! name = "sun-red"           # of the picture; the file's own without it
//! color = "#ff4020"          # multiplies its light
//! ```
//!
//! The other keys are those of [`Change`], and `technique`. A CSV file has the keys in its first line; an empty cell says nothing, numbers
//! of one cell are separated by spaces. The only file that names csv.

use super::error::SceneError;
use super::table::{Document, Table, Value};
use super::{COORDINATE, DEGREES, LENGTH, RADIANCE, Wanted};
use crate::scene::slot::Change;
use std::fmt::Write;
use std::path::Path;

/// Most items of a list.
pub const MAX_ITEMS: usize = 1_000_000;

/// The keys of an item; those that hold words.
const KEYS: [&str; 9] =
    ["file", "name", "size", "position", "rotation", "radiance", "color", "svg_colors", "technique"];
const WORDS: [&str; 4] = ["file", "name", "color", "technique"];

/// A drawing of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// The file, as written.
    pub file: String,
    /// The name of its picture, as written.
    pub name: Option<String>,
    /// What it has otherwise.
    pub change: Change,
    /// How it is rendered, if otherwise than the others.
    pub technique: Option<Wanted>,
    /// Where it stands in the list, for messages.
    pub place: String,
}

/// The drawings of a list, the text of the file `path`. It is CSV if that is how the file's name ends, else TOML.
///
/// # Errors
/// The first thing that is wrong, with file, line, key and value.
pub fn parse(text: String, path: &Path) -> Result<Vec<Listed>, SceneError> {
    let is_csv = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let document = Document { file: path.into(), text };
    let document = if is_csv { Document { text: toml_of(&document)?, ..document } } else { document };
    document.parse(|root| {
        root.only(&["item"])?;
        let tables = match root.get("item") {
            Some(_) => root.tables("item")?,
            None => return Err(root.error("a list has [[item]]s")),
        };
        if tables.len() > MAX_ITEMS {
            return Err(root.error(format!("{} items; at most {MAX_ITEMS}", tables.len())));
        }
        tables.iter().map(listed).collect()
    })
}

fn listed(table: &Table<'_>) -> Result<Listed, SceneError> {
    table.only(&KEYS)?;
    let change = Change {
        size: table.read("size", |v| v.one_or(&LENGTH))?,
        position: table.read("position", |v| v.numbers(&COORDINATE))?,
        rotation: table.read("rotation", |v| v.numbers(&DEGREES))?,
        radiance: table.read("radiance", |v| v.one_or(&RADIANCE))?,
        color: table.read("color", |v| v.color(&RADIANCE))?,
        svg_colors: table.read("svg_colors", Value::boolean)?,
    };
    let technique = table.read("technique", |v| Ok(Wanted { name: v.string()?.into(), place: v.place() }))?;
    Ok(Listed {
        file: table.require("file", "an SVG file")?.string()?.into(),
        name: table.read("name", |v| v.string().map(Into::into))?,
        change,
        technique,
        place: table.place().to_string(),
    })
}

/// A table as an array of inline tables, each on the line of its record.
fn toml_of(document: &Document) -> Result<String, SceneError> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(false).trim(csv::Trim::All).from_reader(document.text.as_bytes());
    let fault = |e: &csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        document.fault(line as usize, e.to_string())
    };
    let keys = reader.headers().map_err(|e| fault(&e))?.clone();
    let mut text = String::from("item = [");
    let mut line = 1;
    for record in reader.records() {
        let record = record.map_err(|e| fault(&e))?;
        let own = record.position().map_or(line, csv::Position::line);
        while line < own {
            text.push('\n');
            line += 1;
        }
        let cells = keys.iter().zip(&record).filter(|(_, cell)| !cell.is_empty());
        let entries: Vec<_> = cells.map(|(key, cell)| format!("{} = {}", quoted(key), value(key, cell))).collect();
        // Writing to a string cannot fail.
        let _ = write!(text, "{{ {} }}, ", entries.join(", "));
    }
    text.push(']');
    Ok(text)
}

/// A cell as TOML has it. What is neither word, number nor truth value is quoted, for the error to show.
fn value(key: &str, cell: &str) -> String {
    let numbers: Vec<&str> = cell.split_whitespace().collect();
    let is_number = |word: &&str| word.parse::<f64>().is_ok_and(f64::is_finite);
    let number = |word: &&str| word.parse::<f64>().map_or_else(|_| quoted(word), |n| format!("{n:?}"));
    match &numbers[..] {
        _ if WORDS.contains(&key) && !(key == "color" && numbers.iter().all(is_number)) => quoted(cell),
        ["true"] | ["false"] => cell.into(),
        [one] if is_number(one) => number(one),
        [..] if numbers.iter().all(is_number) => {
            format!("[{}]", numbers.iter().map(number).collect::<Vec<_>>().join(", "))
        }
        _ => quoted(cell),
    }
}

/// A string of TOML.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
