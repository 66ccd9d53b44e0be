//! The page of a batch: every item with its picture, or why there is none. It needs the pictures beside it, and no network.

use super::page::escape;
use super::table::brief;
use std::fmt::Write;

/// A batch as its page shows it.
#[derive(Clone, Debug)]
pub struct Gallery {
    /// The template.
    pub template: String,
    /// How its pictures were made, one line.
    pub about: String,
    /// Width and height of the pictures, pixels.
    pub size: [u32; 2],
    /// By number.
    pub cards: Vec<Card>,
}

/// An item.
#[derive(Clone, Debug)]
pub struct Card {
    /// From 1.
    pub number: usize,
    /// The name of its picture.
    pub name: String,
    /// The SVG file.
    pub file: String,
    /// How it is rendered.
    pub technique: String,
    /// What has become of it.
    pub state: State,
}

/// What has become of an item.
#[derive(Clone, Debug)]
pub enum State {
    /// There is a picture.
    Done {
        /// The picture, below the folder of the page.
        picture: String,
        /// The picture by the masked rectangle, and how far it is off: root mean square and largest, radiance.
        compared: Option<(String, [f64; 2])>,
        /// Curves of its outlines.
        curves: usize,
        /// The drawing is black, and lit in white.
        was_black: bool,
        /// What was left out or simplified.
        warnings: Vec<String>,
    },
    /// There is none, and why.
    Failed(String),
    /// There is none yet.
    Missing,
}

/// Pictures come from beside the page; nothing else is loaded, and nothing is sent. `file:` is what `'self'` is not where the page is opened
/// from a disk.
const POLICY: &str =
    "default-src 'none'; img-src 'self' file: data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

impl Gallery {
    /// `index.html`. The same batch gives the same bytes.
    pub fn page(&self) -> String {
        let title = format!("{} drawings", self.cards.len());
        let counted = |wanted: fn(&State) -> bool| self.cards.iter().filter(|card| wanted(&card.state)).count();
        let failed = counted(|s| matches!(s, State::Failed(_)));
        let missing = counted(|s| matches!(s, State::Missing));
        let warned = counted(|s| matches!(s, State::Done { warnings, .. } if !warnings.is_empty()));
        let compares = counted(|s| matches!(s, State::Done { compared: Some(_), .. })) > 0;
        let mut out = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <title>{title} – glyphlight batch</title>\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>\n{}{}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<p>{}</p>\n</header>\n<main>\n\
             <div class=\"tools controls\" role=\"search\">\n<fieldset class=\"zoom\"><legend>Show</legend>",
            include_str!("page.css"),
            include_str!("gallery.css"),
            escape(&self.about),
        );
        let done = self.cards.len() - failed - missing;
        for (value, label, count) in [
            ("all", "All", self.cards.len()),
            ("done", "Done", done),
            ("failed", "Failed", failed),
            ("warned", "With warnings", warned),
            ("missing", "Not rendered", missing),
        ] {
            if count > 0 || value == "all" {
                let checked = if value == "all" { " checked" } else { "" };
                let _ = write!(
                    out,
                    "<label><input type=\"radio\" name=\"which\" value=\"{value}\"{checked}><span>{label} {count}</span></label>"
                );
            }
        }
        out.push_str(
            "</fieldset>\n<label>Find<input type=\"search\" id=\"search\" autocomplete=\"off\"></label>\n\
             <label>Order<select id=\"order\"><option value=\"number\">Number</option><option value=\"name\">Name</option>",
        );
        if compares {
            out.push_str("<option value=\"difference\">Difference</option>");
        }
        out.push_str(
            "<option value=\"curves\">Curves</option></select></label>\n\
             <p class=\"count\" id=\"count\" role=\"status\"></p>\n</div>\n",
        );
        let _ = writeln!(out, "<ol class=\"cards{}\" id=\"cards\">", if compares { " compared" } else { "" });
        self.cards.iter().for_each(|card| self.card(card, &mut out));
        let _ = write!(
            out,
            "</ol>\n</main>\n<footer>{} – template {}. All pictures at a glance: <a href=\"contact.png\">contact.png</a>. What failed: \
             <a href=\"errors.jsonl\">errors.jsonl</a>.</footer>\n<script>\n{}</script>\n</body>\n</html>\n",
            concat!("glyphlight ", env!("CARGO_PKG_VERSION")),
            escape(&self.template),
            include_str!("gallery.js"),
        );
        out
    }

    fn card(&self, card: &Card, out: &mut String) {
        let Card { number, name, file, technique, state } = card;
        let (is, more) = match state {
            State::Done { compared, curves, warnings, .. } => {
                let is = if warnings.is_empty() { "done" } else { "done warned" };
                let difference =
                    compared.as_ref().map_or_else(String::new, |(_, [rmse, _])| format!(" data-difference=\"{rmse}\""));
                (is, format!(" data-curves=\"{curves}\"{difference}"))
            }
            State::Failed(_) => ("failed", String::new()),
            State::Missing => ("missing", String::new()),
        };
        let text = format!("{number} {name} {file}").to_lowercase();
        let _ = write!(
            out,
            "<li class=\"{is}\" data-is=\"{is}\" data-number=\"{number}\" data-name=\"{}\" data-text=\"{}\"{more}>",
            escape(name),
            escape(&text)
        );
        match state {
            State::Done { picture, compared: None, .. } => {
                let _ = write!(out, "<div class=\"one\">{}</div>", self.picture(picture, name));
            }
            State::Done { picture, compared: Some((other, _)), .. } => {
                let ours = self.picture(picture, &format!("{name} by {technique}"));
                let masks = self.picture(other, &format!("{name} by a masked rectangle"));
                let label = |a: &str, text: &str| a.replace("</a>", &format!("<span>{}</span></a>", escape(text)));
                let (masks, ours) = (label(&masks, "masked rectangle"), label(&ours, technique));
                let _ = write!(out, "<div class=\"pair\">{masks}{ours}</div>");
            }
            State::Failed(reason) => {
                let _ = write!(out, "<div class=\"none\" role=\"note\">{}</div>", escape(reason));
            }
            State::Missing => out.push_str("<div class=\"none\" role=\"note\">not rendered</div>"),
        }
        let _ = write!(
            out,
            "<p class=\"title\"><span class=\"number\">{number}</span> {}</p><p>{}</p>",
            escape(name),
            escape(file)
        );
        if let State::Done { compared, warnings, was_black, .. } = state {
            if *was_black {
                out.push_str("<p>black, lit in white</p>");
            }
            if let Some((_, [rmse, max])) = compared {
                let _ = write!(out, "<p>masked rectangle: RMSE {}, at most {}</p>", brief(*rmse), brief(*max));
            }
            if !warnings.is_empty() {
                let plural = if warnings.len() == 1 { "" } else { "s" };
                let _ = write!(out, "<details><summary>{} warning{plural}</summary><ul>", warnings.len());
                warnings.iter().for_each(|w| {
                    let _ = write!(out, "<li>{}</li>", escape(w));
                });
                out.push_str("</ul></details>");
            }
        }
        out.push_str("</li>\n");
    }

    fn picture(&self, file: &str, alt: &str) -> String {
        let [width, height] = self.size;
        let (href, alt) = (escape(&address(file)), escape(alt));
        format!(
            "<a href=\"{href}\"><img src=\"{href}\" alt=\"{alt}\" width=\"{width}\" height=\"{height}\" loading=\"lazy\"></a>"
        )
    }
}

/// A relative path as an address.
fn address(path: &str) -> String {
    let mut out = String::new();
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._/~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            let _ = write!(out, "%{byte:02X}");
        }
    }
    out
}
