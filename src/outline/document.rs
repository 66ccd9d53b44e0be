//! What an SVG file asks for, looked at before usvg reads it: size and nesting within limits, no reference outside,
//! no broken numbers, and a warning for each thing that usvg would leave out without a word.
//! The only file that names roxmltree.

use super::Warning;
use super::path::{self, PathError};
use super::svg::{SvgError, SvgLimits};
use roxmltree::{Document, Node, NodeId, ParsingOptions};
use std::collections::HashMap;

/// Largest SVG file, bytes.
pub const MAX_BYTES: usize = 64 << 20;
/// Most elements, references followed.
pub const MAX_ELEMENTS: usize = 250_000;
/// Deepest nesting of elements, references followed.
pub const MAX_DEPTH: usize = 256;

/// What [`inspect`] found.
pub(super) struct Findings {
    pub(super) warnings: Vec<Warning>,
    /// Labels of the elements with text to be drawn.
    pub(super) texts: Vec<String>,
    /// Labels of the elements with an id, by id.
    pub(super) labels: HashMap<String, String>,
}

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";

/// Elements that would be painted, had we (or usvg) a way to.
const UNSUPPORTED: &[&str] = &[
    "foreignObject",
    "video",
    "audio",
    "canvas",
    "iframe",
    "embed",
    "object",
    "mesh",
    "meshgradient",
    "hatch",
    "animate",
    "animateMotion",
    "animateTransform",
    "animateColor",
    "set",
    "script",
    "tref",
    "altGlyph",
    "cursor",
    "font",
    "glyph",
    "solidcolor",
];

/// Lengths, any of which may be negative, percent, or missing.
const LENGTHS: &[&str] = &[
    "x",
    "y",
    "width",
    "height",
    "cx",
    "cy",
    "r",
    "rx",
    "ry",
    "x1",
    "y1",
    "x2",
    "y2",
    "fx",
    "fy",
    "fr",
    "dx",
    "dy",
    "stroke-width",
    "stroke-dashoffset",
    "font-size",
];
/// Other attributes made of numbers.
const NUMBERS: &[&str] = &[
    "transform",
    "gradientTransform",
    "patternTransform",
    "points",
    "viewBox",
    "stroke-dasharray",
    "stroke-miterlimit",
    "opacity",
    "fill-opacity",
    "stroke-opacity",
    "stop-opacity",
    "offset",
    "rotate",
];
/// Sizes that turn an element off, unintended, if negative.
const SIZES: &[&str] = &["width", "height", "r", "rx", "ry"];

/// Reads the bytes as text and refuses what is too large, too deep or too many, before any parser recurses into it.
pub(super) fn scan<'t>(bytes: &'t [u8], limits: &SvgLimits) -> Result<&'t str, SvgError> {
    if bytes.len() > limits.bytes {
        return Err(SvgError::TooLarge { bytes: bytes.len(), limit: limits.bytes });
    }
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return Err(SvgError::Compressed);
    }
    let text = std::str::from_utf8(bytes).map_err(|e| SvgError::NotUtf8 { position: e.valid_up_to() })?;
    let (mut depth, mut deepest, mut elements, mut longest_entity) = (0_usize, 0, 0, 0);
    let mut at = 0;
    while let Some(found) = find(bytes, at, b"<") {
        let rest = &bytes[found..];
        at = if rest.starts_with(b"<!--") {
            after(bytes, found + 4, b"-->")
        } else if rest.starts_with(b"<![CDATA[") {
            after(bytes, found, b"]]>")
        } else if rest.starts_with(b"<?") {
            after(bytes, found, b"?>")
        } else if rest.starts_with(b"<!") {
            let end = end_of_declaration(bytes, found);
            longest_entity = longest_entity.max(check_entities(&text[found..end])?);
            end
        } else {
            let end = end_of_tag(bytes, found);
            if rest.starts_with(b"</") {
                depth = depth.saturating_sub(1);
            } else {
                elements += 1;
                deepest = deepest.max(depth + 1);
                if !bytes[..end].ends_with(b"/>") {
                    depth += 1;
                }
            }
            end
        };
    }
    if deepest > limits.depth {
        return Err(SvgError::TooDeep { depth: deepest, limit: limits.depth });
    }
    if elements > limits.elements {
        return Err(SvgError::TooManyElements { count: elements, limit: limits.elements });
    }
    let expanded = longest_entity.saturating_mul(bytes.iter().filter(|&&b| b == b'&').count());
    if expanded > limits.bytes {
        return Err(SvgError::TooLarge { bytes: expanded, limit: limits.bytes });
    }
    Ok(text)
}

fn find(bytes: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    bytes.get(from..)?.windows(what.len()).position(|w| w == what).map(|i| from + i)
}

fn after(bytes: &[u8], from: usize, what: &[u8]) -> usize {
    find(bytes, from, what).map_or(bytes.len(), |i| i + what.len())
}

/// Just past the `>` of a tag; a `>` in quotes does not count.
fn end_of_tag(bytes: &[u8], from: usize) -> usize {
    let mut quote = None;
    for (i, &b) in bytes.iter().enumerate().skip(from) {
        match (quote, b) {
            (None, b'>') => return i + 1,
            (None, b'"' | b'\'') => quote = Some(b),
            (Some(q), _) if q == b => quote = None,
            _ => {}
        }
    }
    bytes.len()
}

/// Just past the `>` of a declaration such as DOCTYPE with all it holds.
fn end_of_declaration(bytes: &[u8], from: usize) -> usize {
    let (mut quote, mut open) = (None, 0_usize);
    for (i, &b) in bytes.iter().enumerate().skip(from) {
        match (quote, b) {
            (None, b'<' | b'[') => open += 1,
            (None, b'>' | b']') => {
                open = open.saturating_sub(1);
                if open == 0 {
                    return i + 1;
                }
            }
            (None, b'"' | b'\'') => quote = Some(b),
            (Some(q), _) if q == b => quote = None,
            _ => {}
        }
    }
    bytes.len()
}

/// Entities may stand for text (as Illustrator's namespaces do), not for markup, other entities or files.
/// Returns the length of the longest.
fn check_entities(declaration: &str) -> Result<usize, SvgError> {
    let mut longest = 0;
    for entity in declaration.split("<!ENTITY").skip(1) {
        let entity = entity.trim_start();
        let name: String = entity.chars().take_while(|c| !c.is_whitespace()).take(64).collect();
        let value = entity[name.len()..].trim_start();
        let mut parts = value.splitn(3, ['"', '\'']);
        let (before, value) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        if name == "%" || !before.trim().is_empty() || value.contains(['<', '&', '%']) {
            return Err(SvgError::Entity { name });
        }
        longest = longest.max(value.len());
    }
    Ok(longest)
}

/// Reads `text` as XML and looks at every element.
pub(super) fn inspect(text: &str, limits: &SvgLimits) -> Result<Findings, SvgError> {
    let nodes_limit = u32::try_from(limits.elements.saturating_mul(8)).unwrap_or(u32::MAX);
    let options = ParsingOptions { allow_dtd: true, nodes_limit, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|e| SvgError::Syntax { reason: e.to_string() })?;
    let mut ids = HashMap::new();
    for node in document.descendants() {
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
    }
    let lines = text.match_indices('\n').map(|(i, _)| i).collect();
    let findings = Findings { warnings: Vec::new(), texts: Vec::new(), labels: HashMap::new() };
    let mut inspector = Inspector { ids: &ids, lines, findings, limits, curves: 0 };
    inspector.findings.labels = ids.iter().map(|(&id, &node)| (id.to_owned(), inspector.label(node))).collect();
    for node in document.descendants().filter(is_svg) {
        inspector.check_references(node)?;
        inspector.check_attributes(node)?;
    }
    let weight = Weigher { inspector: &inspector, known: HashMap::new() }.weigh(document.root_element(), 1)?;
    if weight.elements > limits.elements {
        return Err(SvgError::TooManyElements { count: weight.elements, limit: limits.elements });
    }
    Ok(inspector.findings)
}

fn is_svg(node: &Node) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.attribute("href").or_else(|| node.attribute((XLINK, "href"))).map(str::trim)
}

/// Looks at elements one by one.
struct Inspector<'a, 'd> {
    ids: &'a HashMap<&'a str, Node<'a, 'd>>,
    /// Where each line ends, bytes.
    lines: Vec<usize>,
    findings: Findings,
    limits: &'a SvgLimits,
    /// Curves and lines of all path data so far.
    curves: usize,
}

impl Inspector<'_, '_> {
    /// What messages call an element: `path "id"`, or `path (line 7)`.
    fn label(&self, node: Node) -> String {
        let name = node.tag_name().name();
        match node.attribute("id") {
            Some(id) if !id.is_empty() => format!("{name} \"{}\"", excerpt(id)),
            _ => format!("{name} (line {})", self.lines.partition_point(|&end| end < node.range().start) + 1),
        }
    }

    fn warn(&mut self, node: Node, message: impl Into<String>) {
        let element = self.label(node);
        self.findings.warnings.push(Warning { element, message: message.into() });
    }

    fn external(&self, node: Node, href: &str) -> SvgError {
        SvgError::External { element: self.label(node), href: excerpt(href) }
    }

    fn warn_if_missing(&mut self, node: Node, what: &str, id: &str) {
        if !self.ids.contains_key(id) {
            self.warn(node, format!("{what} refers to #{}, which does not exist", excerpt(id)));
        }
    }

    fn check_references(&mut self, node: Node) -> Result<(), SvgError> {
        let tag = node.tag_name().name();
        if UNSUPPORTED.contains(&tag) {
            self.warn(node, "elements of this kind are left out");
        }
        match (tag, href(node)) {
            ("image" | "use", None) => self.warn(node, "it has no href and is left out"),
            ("image" | "feImage", Some(href)) if !is_data(href) && !href.starts_with('#') => {
                return Err(self.external(node, href));
            }
            ("image", Some(href)) if !is_picture(href) => self.warn(node, "neither PNG nor JPEG: left out"),
            ("use" | "linearGradient" | "radialGradient" | "pattern" | "textPath" | "mpath", Some(href)) => {
                let id = href.strip_prefix('#').ok_or_else(|| self.external(node, href))?;
                self.warn_if_missing(node, "it", id);
            }
            ("style", _) => {
                let css = node.text().unwrap_or_default();
                if css.contains("@import") || urls(css).any(|url| !url.starts_with('#') && !is_data(url)) {
                    self.warn(node, "fonts and style sheets in other files are not read");
                }
            }
            ("text", _)
                if node.descendants().any(|n| n.text().is_some_and(|t| n.is_text() && !t.trim().is_empty())) =>
            {
                self.findings.texts.push(self.label(node));
            }
            _ => {}
        }
        Ok(())
    }

    fn check_attributes(&mut self, node: Node) -> Result<(), SvgError> {
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            if name == "d" && node.tag_name().name() == "path" {
                let most = self.limits.curves.saturating_sub(self.curves);
                self.curves += path::check(value, most).map_err(|source| match source {
                    PathError::TooLong { .. } => {
                        let (element, limit) = (self.label(node), self.limits.curves);
                        SvgError::TooMany { element, what: "curves up to there", count: limit + 1, limit }
                    }
                    source => SvgError::Path { element: self.label(node), source },
                })?;
            }
            let numeric = LENGTHS.contains(&name) || NUMBERS.contains(&name) || name == "style";
            let valid = match name {
                "transform" | "gradientTransform" | "patternTransform" => path::is_transform(value),
                "points" => path::is_number_list(value),
                _ => true,
            };
            if !valid || (numeric && holds_no_number(value)) {
                let (element, attribute) = (self.label(node), name.to_owned());
                return Err(SvgError::Attribute { element, attribute, value: excerpt(value) });
            }
            if matches!(name, "gradientTransform" | "patternTransform") && path::is_flattening(value) {
                self.warn(node, format!("its {name} {} flattens it and is ignored", excerpt(value)));
            }
            if SIZES.contains(&name) && value.trim_start().starts_with('-') {
                self.warn(node, format!("its {name} is negative ({}) and is ignored", excerpt(value)));
            }
            for url in urls(value) {
                match url.strip_prefix('#') {
                    None if is_data(url) => {}
                    None => return Err(self.external(node, url)),
                    Some(id) => self.warn_if_missing(node, &format!("its {name}"), id),
                }
            }
        }
        Ok(())
    }
}

fn excerpt(value: &str) -> String {
    value.chars().take(60).collect()
}

fn is_data(href: &str) -> bool {
    href.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

fn is_picture(href: &str) -> bool {
    let kind = href.get(5..).unwrap_or_default().to_ascii_lowercase();
    ["image/png", "image/jpeg", "image/jpg"].iter().any(|k| kind.starts_with(k))
}

/// Whether NaN or infinity stands where a number should.
fn holds_no_number(value: &str) -> bool {
    let mut words = value.split(|c: char| !c.is_ascii_alphanumeric() && c != '-' && c != '.');
    words.any(|w| {
        let w = w.trim_start_matches('-');
        ["nan", "inf", "infinity"].iter().any(|bad| w.eq_ignore_ascii_case(bad))
    })
}

/// The targets of `url(…)` in an attribute or style sheet.
fn urls(value: &str) -> impl Iterator<Item = &str> {
    value.split("url(").skip(1).map(|rest| {
        let end = rest.find(')').unwrap_or(rest.len());
        rest[..end].trim().trim_matches(['"', '\''])
    })
}

/// Elements and depth of an element once references are followed.
#[derive(Clone, Copy)]
struct Weight {
    elements: usize,
    depth: usize,
}

/// Adds up what each element will unfold to, without unfolding it.
struct Weigher<'a, 'd> {
    inspector: &'a Inspector<'a, 'd>,
    /// `None` while an element is being weighed: a reference back to it is a loop.
    known: HashMap<NodeId, Option<Weight>>,
}

impl<'a> Weigher<'a, '_> {
    fn weigh(&mut self, node: Node<'a, '_>, depth: usize) -> Result<Weight, SvgError> {
        let known = match self.known.get(&node.id()) {
            Some(None) => return Err(SvgError::Loop { element: self.inspector.label(node) }),
            Some(&Some(known)) => known,
            None => Weight { elements: 0, depth: 0 },
        };
        let deepest = depth + known.depth.saturating_sub(1);
        let limit = self.inspector.limits.depth;
        if deepest > limit {
            return Err(SvgError::TooDeep { depth: deepest, limit });
        }
        if known.elements > 0 {
            return Ok(known);
        }
        self.known.insert(node.id(), None);
        let mut sum = Weight { elements: 1, depth: 0 };
        let mut add = |part: Weight, times: usize| {
            sum.elements = sum.elements.saturating_add(part.elements.saturating_mul(times));
            sum.depth = sum.depth.max(part.depth);
        };
        for child in node.children().filter(Node::is_element) {
            add(self.weigh(child, depth + 1)?, 1);
        }
        for attribute in node.attributes() {
            let name = attribute.name();
            // A marker may stand at every vertex, of which path data has at most one in two characters.
            let marker = name.starts_with("marker") || (name == "style" && attribute.value().contains("marker"));
            let vertices = ["d", "points"].iter().filter_map(|a| node.attribute(*a)).map(str::len).sum::<usize>() / 2;
            let times = if marker { vertices + 2 } else { 1 };
            let target = if name == "href" && node.tag_name().name() == "use" { href(node) } else { None };
            for url in urls(attribute.value()).chain(target) {
                if let Some(&target) = url.strip_prefix('#').and_then(|id| self.inspector.ids.get(id)) {
                    add(self.weigh(target, depth + 1)?, times);
                }
            }
        }
        sum.depth += 1;
        self.known.insert(node.id(), Some(sum));
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_counted_as_xml_has_them() {
        let odd = r#"<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY ns "http://x>y"><!-- <a> -->]>
            <svg a="<>'>" b='">'><!-- <g><g> --><style><![CDATA[<g><g>]]></style><g/><g></g></svg>"#;
        let scan = |text: &[u8]| scan(text, &SvgLimits::default()).map(drop);
        assert!(scan(odd.as_bytes()).is_ok());
        let nested = |n: usize| format!("<svg>{}{}</svg>", "<g>".repeat(n - 1), "</g>".repeat(n - 1));
        assert!(scan(nested(MAX_DEPTH).as_bytes()).is_ok());
        let deep = scan(nested(MAX_DEPTH + 1).as_bytes()).unwrap_err();
        assert!(matches!(deep, SvgError::TooDeep { depth, limit: MAX_DEPTH } if depth == MAX_DEPTH + 1));
    }

    #[test]
    fn numbers_that_are_none_are_seen() {
        for bad in ["NaN", "1 nan 2", "translate(-inf, 0)", "Infinity", "stroke-width:NaN"] {
            assert!(holds_no_number(bad), "{bad}");
        }
        for good in ["1e5", "translate(3)", "5info", "none", "font-family:Nanum"] {
            assert!(!holds_no_number(good), "{good}");
        }
    }
}
