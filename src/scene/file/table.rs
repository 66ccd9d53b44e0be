//! TOML tables read key by key. Every value knows its key's full path and its line. The only file that names toml.

use super::error::{Place, ResourceError, SceneError};
use crate::color::parse_hex;
use core::ops::Range;
use glam::{DVec2, DVec3};
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest piece of a value that a message quotes, characters.
const QUOTED: usize = 60;

/// A scene file as text.
pub(super) struct Document {
    pub(super) file: PathBuf,
    pub(super) text: String,
}

impl Document {
    /// Parses the text and hands the top-level table to `read`.
    pub(super) fn parse<T>(&self, read: impl FnOnce(Table<'_>) -> Result<T, SceneError>) -> Result<T, SceneError> {
        let root = DeTable::parse(&self.text).map_err(|e| {
            let at = e.span().map_or(self.text.len(), |s| s.start);
            let before = &self.text.as_bytes()[..at.min(self.text.len())];
            let line_start = before.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
            let column = String::from_utf8_lossy(&before[line_start..]).chars().count() + 1;
            SceneError::Syntax {
                place: self.place(at, String::new()),
                column,
                message: e.message().replace('\n', ", "),
            }
        })?;
        read(Table { document: self, path: String::new(), span: 0..0, entries: root.get_ref() })
    }

    /// Something is wrong with a line.
    pub(super) fn fault(&self, line: usize, message: String) -> SceneError {
        SceneError::Table { place: Place { file: self.file.clone(), line, key: String::new() }, message }
    }

    fn place(&self, at: usize, key: String) -> Place {
        let line = 1 + self.text.as_bytes()[..at.min(self.text.len())].iter().filter(|b| **b == b'\n').count();
        Place { file: self.file.clone(), line, key }
    }

    /// The text of a value, shortened, on one line.
    fn quote(&self, span: Range<usize>) -> String {
        let text = self.text.get(span).unwrap_or_default();
        let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if line.chars().count() <= QUOTED { line } else { line.chars().take(QUOTED).chain(['…']).collect() }
    }
}

/// What a number may be.
pub(super) struct Limit {
    holds: fn(f64) -> bool,
    text: &'static str,
}

impl Limit {
    /// `holds` is false for NaN.
    pub(super) const fn new(holds: fn(f64) -> bool, text: &'static str) -> Self {
        Self { holds, text }
    }
}

/// A table of the file, at a path such as `light[0]`.
pub(super) struct Table<'d> {
    document: &'d Document,
    path: String,
    span: Range<usize>,
    entries: &'d DeTable<'d>,
}

impl<'d> Table<'d> {
    /// Refuses keys other than `known`.
    pub(super) fn only(&self, known: &[&'static str]) -> Result<(), SceneError> {
        let unknown =
            self.entries.keys().filter(|k| !known.contains(&k.get_ref().as_ref())).min_by_key(|k| k.span().start);
        match unknown {
            None => Ok(()),
            Some(key) => {
                let place = self.document.place(key.span().start, self.key(key.get_ref()));
                Err(SceneError::UnknownKey { place, known: known.to_vec() })
            }
        }
    }

    /// The value of a key, if it is there.
    pub(super) fn get(&self, key: &str) -> Option<Value<'d>> {
        let (key, value) = self.entries.iter().find(|(k, _)| k.get_ref() == key)?;
        let path = self.key(key.get_ref());
        Some(Value { document: self.document, path, at: key.span().start, value })
    }

    /// The value of a key; `wanted` says what it should hold where it is missing.
    pub(super) fn require(&self, key: &str, wanted: &'static str) -> Result<Value<'d>, SceneError> {
        let place = || self.document.place(self.span.start, self.key(key));
        self.get(key).ok_or_else(|| SceneError::Missing { place: place(), wanted })
    }

    /// What `read` makes of a key, if it is there.
    pub(super) fn read<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Value<'d>) -> Result<T, SceneError>,
    ) -> Result<Option<T>, SceneError> {
        self.get(key).as_ref().map(read).transpose()
    }

    /// The tables of an array `[[key]]`; none where the key is missing.
    pub(super) fn tables(&self, key: &str) -> Result<Vec<Self>, SceneError> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let DeValue::Array(entries) = value.value.get_ref() else {
            return Err(value.error(format!("must be an array of tables, each headed [[{key}]]")));
        };
        (0..entries.len()).map(|i| value.element(i, entries)).map(|v| v.table()).collect()
    }

    /// The file, line and key of this table.
    pub(super) fn place(&self) -> Place {
        self.document.place(self.span.start, self.path.clone())
    }

    /// An error about the table as a whole.
    pub(super) fn error(&self, message: impl Into<String>) -> SceneError {
        SceneError::Table { place: self.place(), message: message.into() }
    }

    fn key(&self, key: &str) -> String {
        if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) }
    }
}

/// A value of the file.
pub(super) struct Value<'d> {
    document: &'d Document,
    path: String,
    /// Where its line is: the key's start, or the element's.
    at: usize,
    value: &'d Spanned<DeValue<'d>>,
}

impl<'d> Value<'d> {
    /// The file, line and key.
    pub(super) fn place(&self) -> Place {
        self.document.place(self.at, self.path.clone())
    }

    /// The value is not what it may be.
    pub(super) fn error(&self, limit: impl Into<String>) -> SceneError {
        let value = self.document.quote(self.value.span());
        SceneError::Value { place: self.place(), value, limit: limit.into() }
    }

    /// What the value names cannot be used.
    pub(super) fn resource(&self, source: impl Into<ResourceError>) -> SceneError {
        let value = self.document.quote(self.value.span());
        SceneError::Resource { place: self.place(), value, source: Box::new(source.into()) }
    }

    /// A number within `limit`; integers count.
    pub(super) fn number(&self, limit: &Limit) -> Result<f64, SceneError> {
        let number: Option<f64> = match self.value.get_ref() {
            DeValue::Float(f) => f.as_str().parse().ok(),
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            _ => return Err(self.error(format!("must be a number {}", limit.text))),
        };
        match number {
            Some(n) if (limit.holds)(n) => Ok(n),
            _ => Err(self.error(format!("must be {}", limit.text))),
        }
    }

    /// An array of exactly `N` numbers within `limit`.
    pub(super) fn numbers<const N: usize>(&self, limit: &Limit) -> Result<[f64; N], SceneError> {
        let entries = match self.value.get_ref() {
            DeValue::Array(entries) if entries.len() == N => entries,
            _ => return Err(self.error(format!("must be an array of {N} numbers, each {}", limit.text))),
        };
        let mut numbers = [0.0; N];
        for (i, number) in numbers.iter_mut().enumerate() {
            *number = self.element(i, entries).number(limit)?;
        }
        Ok(numbers)
    }

    /// One number for all of `N`, or an array of `N`.
    pub(super) fn one_or<const N: usize>(&self, limit: &Limit) -> Result<[f64; N], SceneError> {
        if matches!(self.value.get_ref(), DeValue::Array(_)) {
            self.numbers(limit)
        } else {
            Ok([self.number(limit)?; N])
        }
    }

    /// A vector.
    pub(super) fn vec3(&self, limit: &Limit) -> Result<DVec3, SceneError> {
        self.numbers(limit).map(DVec3::from_array)
    }

    /// A pair.
    pub(super) fn vec2(&self, limit: &Limit) -> Result<DVec2, SceneError> {
        self.one_or(limit).map(DVec2::from_array)
    }

    /// A direction: a vector of any length but 0.
    pub(super) fn direction(&self, limit: &Limit) -> Result<DVec3, SceneError> {
        let vector = self.vec3(limit)?;
        vector.try_normalize().ok_or_else(|| self.error("must be a direction, of a length other than 0"))
    }

    /// A colour: linear numbers within `limit`, or `#rrggbb` in sRGB.
    pub(super) fn color(&self, limit: &Limit) -> Result<[f64; 3], SceneError> {
        match self.value.get_ref() {
            DeValue::String(text) => parse_hex(text)
                .ok_or_else(|| self.error("must be a colour: \"#rrggbb\" (sRGB), or an array of 3 linear numbers")),
            _ => self.numbers(limit),
        }
    }

    /// A string.
    pub(super) fn string(&self) -> Result<&'d str, SceneError> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text),
            _ => Err(self.error("must be a string")),
        }
    }

    /// A string, or an array of them, at least one.
    pub(super) fn strings(&self) -> Result<Vec<Self>, SceneError> {
        match self.value.get_ref() {
            DeValue::String(_) => {
                Ok(vec![Self { document: self.document, path: self.path.clone(), at: self.at, value: self.value }])
            }
            DeValue::Array(entries) if !entries.is_empty() => {
                Ok((0..entries.len()).map(|i| self.element(i, entries)).collect())
            }
            _ => Err(self.error("must be a string, or an array of strings")),
        }
    }

    /// `true` or `false`.
    pub(super) fn boolean(&self) -> Result<bool, SceneError> {
        match self.value.get_ref() {
            DeValue::Boolean(b) => Ok(*b),
            _ => Err(self.error("must be true or false")),
        }
    }

    /// One of several names.
    pub(super) fn choice<T: Copy>(&self, choices: &[(&'static str, T)]) -> Result<T, SceneError> {
        let found = match self.value.get_ref() {
            DeValue::String(text) => choices.iter().find(|(name, _)| name == text),
            _ => None,
        };
        let names = || choices.iter().map(|(name, _)| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        found.map(|(_, choice)| *choice).ok_or_else(|| self.error(format!("must be one of {}", names())))
    }

    /// A table.
    pub(super) fn table(&self) -> Result<Table<'d>, SceneError> {
        match self.value.get_ref() {
            DeValue::Table(entries) => {
                let span = self.at..self.value.span().end;
                Ok(Table { document: self.document, path: self.path.clone(), span, entries })
            }
            _ => Err(self.error("must be a table")),
        }
    }

    /// Every key of a table with its value, in the order of the keys.
    pub(super) fn entries(&self) -> Result<Vec<(&'d str, Self)>, SceneError> {
        let table = self.table()?;
        let keys = table.entries.keys().map(|k| k.get_ref().as_ref());
        Ok(keys.filter_map(|k| table.get(k).map(|v| (k, v))).collect())
    }

    fn element(&self, i: usize, entries: &'d [Spanned<DeValue<'d>>]) -> Self {
        let value = &entries[i];
        Self { document: self.document, path: format!("{}[{i}]", self.path), at: value.span().start, value }
    }
}
