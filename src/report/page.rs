//! The page of a [`Comparison`]: one file that needs no other and no network.

use super::scale::ErrorScale;
use super::table::{COLUMNS, Value, brief, digits, shown, values};
use super::{Block, Comparison, Row};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// A picture of the page.
#[derive(Clone, Debug)]
pub struct PagePicture {
    /// The file that rows know it by.
    pub file: String,
    /// Its bytes.
    pub png: Vec<u8>,
}

/// Everything comes from the page itself: nothing else may be loaded, and nothing is sent.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Steps of the slider.
const STEPS: u32 = 1000;

impl Comparison {
    /// `index.html`: a slider between any two pictures, the tables, the error maps, the scene. `pictures` are those that the
    /// rows name.
    pub fn page(&self, pictures: &[PagePicture]) -> String {
        let title = escape(&self.scene.name);
        let mut out = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <title>{title} – glyphlight compare</title>\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>\n{}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<p>{}</p>\n</header>\n<main>\n",
            include_str!("page.css"),
            escape(&self.about()),
        );
        self.slider(&mut out);
        self.blocks.iter().for_each(|block| table(&mut out, block));
        self.left_out(&mut out);
        self.gallery(&mut out, pictures);
        let _ = write!(
            out,
            "<section aria-labelledby=\"scene\">\n<h2 id=\"scene\">Scene</h2>\n<pre tabindex=\"0\">{}</pre>\n</section>\n\
             </main>\n<footer>{}</footer>\n<script>\n{}</script>\n</body>\n</html>\n",
            escape(&self.scene.source),
            escape(&self.footer()),
            include_str!("page.js"),
        );
        out
    }

    /// The two pictures and what chooses them. It begins with the picture that is most wrong beside its yardstick.
    fn slider(&self, out: &mut String) {
        let all: Vec<&Row> = self.blocks.iter().flat_map(|b| &b.rows).collect();
        let error = |r: &Row| r.errors.map_or(-1.0, |e| e.rmse);
        let worst = all.iter().max_by(|a, b| error(a).total_cmp(&error(b)));
        let right = worst.map_or("", |r| r.picture.as_str());
        let named = |name: &str| all.iter().find(|r| r.technique == name).map(|r| r.picture.as_str());
        let left = worst.and_then(|r| r.yardstick.as_deref()).and_then(named).unwrap_or_default();
        let (width, height) = (self.settings.width, self.settings.height);
        out.push_str("<section aria-label=\"Two pictures\">\n<div class=\"controls\">\n");
        self.choice(out, "left", "Left", left);
        out.push_str("<button id=\"swap\" type=\"button\" aria-label=\"Swap left and right\">⇄</button>\n");
        self.choice(out, "right", "Right", right);
        out.push_str("<fieldset class=\"zoom\"><legend>Zoom</legend>");
        for (value, label) in [("fit", "Fit"), ("1", "1×"), ("2", "2×"), ("4", "4×"), ("8", "8×")] {
            let checked = if value == "fit" { " checked" } else { "" };
            let _ = write!(
                out,
                "<label><input type=\"radio\" name=\"zoom\" value=\"{value}\"{checked}><span>{label}</span></label>"
            );
        }
        let _ = write!(
            out,
            "</fieldset>\n</div>\n<div class=\"frame\" id=\"frame\">\n\
             <div class=\"scroll\" id=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"The two pictures\">\
             <div class=\"canvas\" id=\"canvas\" data-width=\"{width}\" data-height=\"{height}\">\
             <img id=\"right\" alt=\"\" draggable=\"false\"><img id=\"left\" alt=\"\" draggable=\"false\"></div></div>\n\
             <span class=\"name at-left\" id=\"left-name\"></span><span class=\"name at-right\" id=\"right-name\"></span>\n\
             <div class=\"divider\" id=\"divider\"><div class=\"grip\" id=\"grip\" aria-hidden=\"true\">⇔</div></div>\n</div>\n\
             <input type=\"range\" id=\"place\" min=\"0\" max=\"{STEPS}\" value=\"{}\" \
             aria-label=\"Where the left picture ends and the right one begins\">\n\
             <noscript><p>The slider needs JavaScript; tables and pictures below do not.</p></noscript>\n</section>\n",
            STEPS / 2
        );
    }

    fn choice(&self, out: &mut String, side: &str, label: &str, chosen: &str) {
        let _ = write!(out, "<label class=\"side\">{label}<select id=\"{side}-choice\">");
        let _ = write!(out, "<optgroup label=\"Picture\">");
        let mut seen = Vec::new();
        for row in self.blocks.iter().flat_map(|b| &b.rows) {
            if !seen.contains(&&row.picture) {
                option(out, &row.picture, &row.technique, chosen);
                seen.push(&row.picture);
            }
        }
        out.push_str("</optgroup>");
        for block in &self.blocks {
            let _ = write!(out, "<optgroup label=\"{}\">", escape(&block.title()));
            for row in &block.rows {
                if let Some(map) = &row.error_map {
                    option(out, map, &row.technique, chosen);
                }
            }
            out.push_str("</optgroup>");
        }
        out.push_str("</select></label>\n");
    }

    fn left_out(&self, out: &mut String) {
        if self.left_out.is_empty() {
            return;
        }
        out.push_str("<section aria-labelledby=\"left-out\">\n<h2 id=\"left-out\">Left out</h2>\n<ul>\n");
        for left in &self.left_out {
            let _ = writeln!(out, "<li><strong>{}</strong>: {}</li>", escape(&left.technique), escape(&left.reason));
        }
        out.push_str("</ul>\n</section>\n");
    }

    fn gallery(&self, out: &mut String, pictures: &[PagePicture]) {
        out.push_str("<section aria-labelledby=\"maps\">\n<h2 id=\"maps\">Pictures and error maps</h2>\n");
        if let Some(scale) = &self.error_scale {
            key(out, scale);
        }
        let mut shown = Vec::new();
        for block in &self.blocks {
            let _ = write!(out, "<h3>{}</h3>\n<div class=\"gallery\">\n", escape(&block.title()));
            for row in &block.rows {
                out.push_str("<figure><div class=\"pair\">");
                let label = escape(&row.technique);
                if !shown.contains(&&row.picture) {
                    shown.push(&row.picture);
                    picture(out, pictures, &row.picture, &format!("Picture by {label}"));
                }
                if let Some(map) = &row.error_map {
                    picture(out, pictures, map, &format!("{} of {label}", escape(&block.title())));
                }
                let _ =
                    writeln!(out, "</div><figcaption><strong>{label}</strong> {}</figcaption></figure>", caption(row));
            }
            out.push_str("</div>\n");
        }
        out.push_str("</section>\n");
    }
}

fn option(out: &mut String, file: &str, label: &str, chosen: &str) {
    let selected = if file == chosen { " selected" } else { "" };
    let _ = write!(out, "<option value=\"{}\"{selected}>{}</option>", escape(file), escape(label));
}

fn caption(row: &Row) -> String {
    let noise = row.noise.map_or_else(String::new, |noise| format!(", noise {}", digits(noise)));
    let Some(errors) = row.errors else { return format!("is a yardstick{noise}") };
    let yardstick = row.yardstick.as_deref().unwrap_or_default();
    let less = row.rmse_less_noise.map_or_else(String::new, |e| format!(" ({} less noise)", digits(e)));
    let [rmse, max] = [errors.rmse, errors.max].map(digits);
    format!("RMSE {rmse}{less}, at most {max}, against {}{noise}", escape(yardstick))
}

fn picture(out: &mut String, pictures: &[PagePicture], file: &str, alt: &str) {
    if let Some(found) = pictures.iter().find(|p| p.file == file) {
        let data = STANDARD.encode(&found.png);
        let _ = write!(out, "<img id=\"{}\" alt=\"{alt}\" src=\"data:image/png;base64,{data}\">", escape(file));
    }
}

/// The colour bar of the error maps, with its labels.
fn key(out: &mut String, scale: &ErrorScale) {
    const STOPS: u32 = 32;
    let stops: Vec<String> = ErrorScale::bar(STOPS + 1, 1)
        .chunks_exact(3)
        .enumerate()
        .map(|(i, c)| format!("rgb({},{},{}) {}%", c[0], c[1], c[2], 100.0 * i as f64 / f64::from(STOPS)))
        .collect();
    let _ = write!(
        out,
        "<div class=\"key\" role=\"img\" aria-label=\"Colours of the error maps: blue is too dark, orange too bright, up to {0} \
         on either side\">\n<div class=\"bar\" style=\"background:linear-gradient(90deg,{1})\"></div>\n<div class=\"ticks\">",
        brief(scale.end),
        stops.join(",")
    );
    let ticks = scale.ticks();
    for (i, &tick) in ticks.iter().enumerate() {
        let minor = if i % 2 == 1 { " class=\"minor\"" } else { "" };
        let sign = if tick > 0.0 {
            "+"
        } else if tick < 0.0 {
            "−"
        } else {
            ""
        };
        let label = format!("{sign}{}", brief(tick.abs()));
        let _ = write!(out, "<span{minor} style=\"left:{:.2}%\">{label}</span>", 50.0 * (scale.place(tick) + 1.0));
    }
    out.push_str("</div>\n<p>Signed error of the worst channel, radiance in W·sr⁻¹·m⁻².</p>\n</div>\n");
}

fn table(out: &mut String, block: &Block) {
    let id = escape(&block.name);
    let _ = write!(
        out,
        "<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{}</h2>\n<p>{}</p>\n\
         <div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{0}, table\"><table>\n<thead><tr>",
        escape(&block.title()),
        escape(&block.about)
    );
    let columns = shown(block);
    let word = |i: usize| ["technique", "backend", "yardstick"].contains(&COLUMNS[i].0);
    for &i in &columns {
        let (kind, class) = if word(i) { ("text", " class=\"word\"") } else { ("number", "") };
        let _ = write!(
            out,
            "<th scope=\"col\" data-kind=\"{kind}\"{class}><button type=\"button\">{}</button></th>",
            COLUMNS[i].1
        );
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &block.rows {
        out.push_str("<tr>");
        let values = values(row);
        for &i in &columns {
            let (open, close) = if i == 0 { ("th scope=\"row\"", "th") } else { ("td", "td") };
            let class = if word(i) { " class=\"word\"" } else { "" };
            let key = match values[i] {
                Value::Text(text) => escape(text),
                Value::Number(v) | Value::Seconds(v) | Value::Ratio(v) => v.to_string(),
                Value::None => String::new(),
            };
            let shown = escape(&values[i].short());
            let _ = write!(out, "<{open}{class} data-value=\"{key}\">{shown}</{close}>");
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n</section>\n");
}

/// Text as HTML, also inside a quoted attribute.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}
