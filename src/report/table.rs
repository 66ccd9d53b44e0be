//! The table of a [`Comparison`] as Markdown, CSV and JSON.

use super::{Block, Comparison, Machine, RectangleTime, ReportError, Row};
use std::fmt::Write;

/// What a row holds in one column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'r> {
    /// A word.
    Text(&'r str),
    /// A number.
    Number(f64),
    /// Seconds.
    Seconds(f64),
    /// A number near 1.
    Ratio(f64),
    /// Nothing to say.
    None,
}

/// The columns: name in the CSV, and heading for people, who do not see those without.
pub(super) const COLUMNS: [(&str, &str); 21] = [
    ("technique", "technique"),
    ("backend", "on"),
    ("device", ""),
    ("runs", ""),
    ("seconds", "shade"),
    ("prepare_seconds", "prepare"),
    ("ms_per_megapixel", "ms/Mpixel"),
    ("rectangles", "× rectangle"),
    ("mae", "MAE"),
    ("rmse", "RMSE"),
    ("rmse_less_noise", "RMSE less noise"),
    ("rmse_of_peak", "RMSE/peak"),
    ("p999", "99.9 %"),
    ("max", "max"),
    ("flip", "FLIP"),
    ("energy_ratio", "energy"),
    ("noise", "noise"),
    ("yardstick", "yardstick"),
    ("yardstick_noise", "its noise"),
    ("picture", ""),
    ("error_map", ""),
];

/// What a row holds, in the order of [`COLUMNS`].
pub(super) fn values(row: &Row) -> [Value<'_>; COLUMNS.len()] {
    let number = |value: Option<f64>| value.map_or(Value::None, Value::Number);
    let errors = row.errors;
    [
        Value::Text(&row.technique),
        Value::Text(&row.backend),
        Value::Text(&row.device),
        Value::Number(row.runs as f64),
        Value::Seconds(row.seconds),
        Value::Seconds(row.prepare_seconds),
        Value::Number(row.ms_per_megapixel),
        number(row.rectangles),
        number(errors.map(|e| e.mae)),
        number(errors.map(|e| e.rmse)),
        number(row.rmse_less_noise),
        number(errors.and_then(|e| e.rmse_of_peak)),
        number(errors.map(|e| e.p999)),
        number(errors.map(|e| e.max)),
        number(row.flip),
        errors.and_then(|e| e.energy_ratio).map_or(Value::None, Value::Ratio),
        number(row.noise),
        word(&row.yardstick),
        number(row.yardstick_noise),
        Value::Text(&row.picture),
        word(&row.error_map),
    ]
}

fn word(text: &Option<String>) -> Value<'_> {
    text.as_deref().map_or(Value::None, Value::Text)
}

impl Value<'_> {
    /// In full, for programs; empty for nothing.
    fn full(self) -> String {
        match self {
            Self::Text(text) => text.into(),
            Self::Number(value) | Self::Seconds(value) | Self::Ratio(value) => value.to_string(),
            Self::None => String::new(),
        }
    }

    /// Three digits, for people.
    pub(super) fn short(self) -> String {
        match self {
            Self::Text(text) => text.into(),
            Self::Number(value) => digits(value),
            Self::Seconds(value) if value < 1.0 => format!("{} ms", digits(value * 1e3)),
            Self::Seconds(value) => format!("{} s", digits(value)),
            Self::Ratio(value) => format!("{value:.5}"),
            Self::None => "–".into(),
        }
    }
}

/// Three significant digits, with an exponent where the number is far from 1.
pub(super) fn digits(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e6).contains(&size) {
        let text = format!("{value:.2e}");
        // 1.00e-6 says no more than 1e-6.
        return text.replace(".00e", "e");
    }
    if size >= 100.0 || size.fract() == 0.0 {
        return format!("{value:.0}");
    }
    let decimals = (2.0 - size.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// As [`digits`], without zeros at the end: for numbers that are round.
pub(super) fn brief(value: f64) -> String {
    let text = digits(value);
    match text.split_once('.') {
        Some(_) if !text.contains('e') => text.trim_end_matches('0').trim_end_matches('.').into(),
        _ => text,
    }
}

impl Comparison {
    /// `table.json`; see the [schema](super).
    ///
    /// # Errors
    /// What the encoder says.
    pub fn json(&self) -> Result<String, ReportError> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(text)
    }

    /// `table.csv`; see the [schema](super).
    pub fn csv(&self) -> String {
        let mut out = String::from("block");
        COLUMNS.iter().for_each(|(name, _)| out.extend([",", name]));
        out.push_str("\r\n");
        for (block, row) in self.blocks.iter().flat_map(|b| b.rows.iter().map(move |r| (b, r))) {
            out.push_str(&field(&block.name));
            values(row).iter().for_each(|v| out.extend([",", field(&v.full()).as_str()]));
            out.push_str("\r\n");
        }
        out
    }

    /// `table.md`: what was rendered, a table for each block, and what was left out.
    pub fn markdown(&self) -> String {
        let mut out = format!("# {}\n\n{}\n", escape(&self.scene.name), escape(&self.about()));
        for block in &self.blocks {
            out.push_str(&markdown_table(block));
        }
        if !self.left_out.is_empty() {
            out.push_str("\nLeft out:\n\n");
            for left in &self.left_out {
                let _ = writeln!(out, "- {}: {}", escape(&left.technique), escape(&left.reason));
            }
        }
        let _ = write!(out, "\n{}\n", escape(&self.footer()));
        out
    }

    /// One paragraph on size, tolerance, rectangles and the colours of the error maps.
    pub(super) fn about(&self) -> String {
        let s = &self.settings;
        let mut text = format!(
            "{} × {} pixels, {} per pixel, tolerance of the tree {}. Times are medians of at most {}; errors are \
             radiance (W·sr⁻¹·m⁻²) of the light that surfaces reflect.",
            s.width,
            s.height,
            counted(s.samples, "sample"),
            brief(f64::from(s.tolerance)),
            counted(s.repeat, "run"),
        );
        let on = |r: &RectangleTime| format!("{} ms/Mpixel ({})", digits(r.ms_per_megapixel), r.backend);
        let rectangles: Vec<_> = self.rectangles.iter().map(on).collect();
        if !rectangles.is_empty() {
            let _ = write!(
                text,
                " With each light replaced by its bounding rectangle shading takes {}: that is “× rectangle” 1.",
                rectangles.join(", ")
            );
        }
        if self.blocks.iter().flat_map(|b| &b.rows).any(|r| r.yardstick_noise.is_some()) {
            text.push_str(
                " Errors against Monte Carlo hold its noise, the root mean square of its standard error, too: “RMSE less \
                 noise” is the root of the RMSE's square less the noise's, not below 0.",
            );
        }
        if let Some(scale) = self.error_scale {
            let _ = write!(
                text,
                " All error maps have one colour scale, from −{0} (blue, too dark) to {0} (orange, too bright), linear \
                 within ±{1} and logarithmic beyond; a pixel has the error of its worst channel.",
                brief(scale.end),
                brief(scale.linear)
            );
        }
        text
    }

    /// Program, machine and date.
    pub(super) fn footer(&self) -> String {
        let Machine { processor, threads, system } = &self.machine;
        format!("{}, {}; {processor}, {}, {system}.", self.program, self.date, counted(*threads as u32, "thread"))
    }
}

fn counted(count: u32, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// The columns that people see: those with a heading, and of those that can be empty all but the ones that are.
pub(super) fn shown(block: &Block) -> Vec<usize> {
    let may_be_empty = |i: usize| ["noise", "rmse_less_noise", "yardstick_noise"].contains(&COLUMNS[i].0);
    let filled = |i: usize| !may_be_empty(i) || block.rows.iter().any(|r| values(r)[i] != Value::None);
    (0..COLUMNS.len()).filter(|&i| !COLUMNS[i].1.is_empty() && filled(i)).collect()
}

fn markdown_table(block: &Block) -> String {
    let columns = shown(block);
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut out = format!("\n## {}\n\n{}\n\n", escape(&block.title()), escape(&block.about));
    out += &line(columns.iter().map(|&i| COLUMNS[i].1.into()).collect());
    let first = block.rows.first().map(values);
    let right = |i: usize| first.is_some_and(|v| !matches!(v[i], Value::Text(_)) && COLUMNS[i].0 != "yardstick");
    out += &line(columns.iter().map(|&i| if right(i) { "---:".into() } else { "---".into() }).collect());
    for row in &block.rows {
        let values = values(row);
        out += &line(columns.iter().map(|&i| escape(&values[i].short())).collect());
    }
    out
}

/// A field of a CSV line.
pub(super) fn field(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

/// Text as Markdown: nothing in it is markup, or ends a cell.
fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\n' | '\r' => out.push(' '),
            '\\' | '|' | '*' | '_' | '`' | '<' | '[' | ']' | '#' => out.extend(['\\', c]),
            _ => out.push(c),
        }
    }
    out
}
