//! Text layout: lines, alignment, letter spacing, and one shape for the whole text.

use super::font::{Font, FontError, Instance, Tag};
use super::overlap::{self, OverlapError};
pub use super::shaping::Direction;
use super::shaping::{FontShaper, LineShaper, ShapedGlyph};
use super::{FillRule, Warning, bez_path};
use crate::shape::{Bounds, Shape};
use glam::{DAffine2, DVec2};
use kurbo::BezPath;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use std::collections::{BTreeSet, HashMap};

/// Most characters of one text.
pub const MAX_CHARACTERS: usize = 1 << 16;

/// Missing characters that an error message lists; [`TextError::MissingGlyphs`] holds them all.
const LISTED_CHARACTERS: usize = 32;

/// Which edge of the lines lies on x = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Align {
    /// The left edge.
    #[default]
    Left,
    /// The middle.
    Center,
    /// The right edge.
    Right,
}

/// How a text is set.
#[derive(Clone, Debug, PartialEq)]
pub struct TextStyle {
    /// Height of the em in metres; > 0.
    pub size: f64,
    /// Which edge of the lines lies on x = 0.
    pub align: Align,
    /// Extra space after each cluster but a line's last, em; may be negative.
    pub letter_spacing: f64,
    /// Distance between baselines, em; > 0. `None` takes the greatest that the fonts in use ask for.
    pub line_height: Option<f64>,
    /// Place on the axes of variable fonts. Each axis must exist in one of the fonts at least.
    pub axes: Vec<(Tag, f32)>,
    /// Direction of the lines.
    pub direction: Direction,
}

impl Default for TextStyle {
    /// 1 m, left, no letter spacing, the fonts' line height and axes.
    fn default() -> Self {
        Self {
            size: 1.0,
            align: Align::Left,
            letter_spacing: 0.0,
            line_height: None,
            axes: Vec::new(),
            direction: Direction::Auto,
        }
    }
}

/// Why a text cannot be set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextError {
    /// No visible character.
    #[error("the text is empty: it has no visible character")]
    Empty,
    /// More than [`MAX_CHARACTERS`].
    #[error("the text has {count} characters, more than the limit of {MAX_CHARACTERS}")]
    TooLong {
        /// Number of characters.
        count: usize,
    },
    /// No font was given.
    #[error("no font was given to set the text in")]
    NoFont,
    /// A value of the style is out of range.
    #[error("text {key} = {value:?} is not {allowed}")]
    Style {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        allowed: &'static str,
    },
    /// Characters that no font has a glyph for.
    #[error("no glyph in {fonts} for {}", listed(characters))]
    MissingGlyphs {
        /// Names of the fonts, quoted.
        fonts: String,
        /// The characters, each once, in order of appearance.
        characters: Vec<char>,
    },
    /// A font or one of its glyphs cannot be used.
    #[error(transparent)]
    Font(#[from] FontError),
    /// Neighbouring glyphs overlap and could not be united.
    #[error("overlapping glyphs of the text could not be united: {0}")]
    Overlap(#[from] OverlapError),
}

/// The characters as `U+0041 'A'`, so that what cannot be seen can be read.
fn listed(characters: &[char]) -> String {
    let shown: Vec<_> = characters.iter().take(LISTED_CHARACTERS).map(|&c| code_point(c)).collect();
    let more = characters.len() - shown.len();
    shown.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

fn code_point(c: char) -> String {
    if c.is_control() || c.is_whitespace() || is_invisible(c) {
        format!("U+{:04X}", c as u32)
    } else {
        format!("U+{:04X} '{c}'", c as u32)
    }
}

/// A glyph in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedGlyph {
    /// Index into the fonts given.
    pub font: usize,
    /// Glyph index in that font.
    pub glyph: u16,
    /// Byte offset in the text of the first character that the glyph stands for.
    pub cluster: usize,
    /// Origin of the glyph in metres.
    pub origin: DVec2,
}

/// Where a line lies, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineExtent {
    /// Where the pen starts.
    pub left: f64,
    /// Where the pen ends.
    pub right: f64,
    /// y of the baseline.
    pub baseline: f64,
}

/// A text set in lines.
#[derive(Clone, Debug)]
pub struct TextLayout {
    /// All glyphs as one shape, metres; the first baseline is y = 0.
    pub shape: Shape,
    /// The glyphs, line by line, left to right within a line; blank ones too.
    pub glyphs: Vec<PlacedGlyph>,
    /// The lines from top to bottom.
    pub lines: Vec<LineExtent>,
    /// Bounds of the shape's control points, metres.
    pub bounds: Bounds,
    /// What was left out.
    pub warnings: Vec<Warning>,
}

/// Sets `text` in the first of `fonts` that has each cluster.
///
/// Lines end at `\n`, `\r\n`, `\r`, vertical tab, form feed, U+0085, U+2028 and U+2029; space at their ends is
/// dropped. A tab is as wide as four spaces; other control characters are left out with a warning.
/// The shape's winding number is 0 or 1 everywhere: glyphs that touch each other are united.
///
/// ```
/// use glyphlight::outline::font::Font;
/// use glyphlight::outline::text::{TextStyle, layout};
///
/// let fonts = [Font::bundled("Inter")?];
/// let style = TextStyle { size: 0.5, axes: vec![("wght".parse()?, 800.0)], ..TextStyle::default() };
/// let text = layout("OPEN\nuntil late", &fonts, &style)?;
/// assert_eq!(text.lines.len(), 2);
/// assert!(text.shape.area() > 0.0 && text.warnings.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If nothing would be seen, the text is too long, the style is out of range, a character has no glyph in any font,
/// or a glyph cannot be outlined.
pub fn layout(text: &str, fonts: &[Font], style: &TextStyle) -> Result<TextLayout, TextError> {
    style.check()?;
    let count = text.chars().count();
    if count > MAX_CHARACTERS {
        return Err(TextError::TooLong { count });
    }
    if text.chars().all(|c| c.is_whitespace() || c.is_control()) {
        return Err(TextError::Empty);
    }
    let mut warnings = dropped_controls(text);
    let instances = instances(fonts, &style.axes)?;
    let shapers: Vec<_> = instances
        .iter()
        .map(|i| {
            let font = || i.font().name().to_owned();
            FontShaper::new(i).map_err(|reason| FontError::Malformed { font: font(), reason })
        })
        .collect::<Result<_, _>>()?;
    let spaced = style.letter_spacing != 0.0;
    let shaper = LineShaper::new(&shapers, style.direction, spaced);

    let mut shaped = Vec::new();
    let (mut missing, mut unspaced) = (Vec::new(), BTreeSet::new());
    for (start, line) in lines(text) {
        let result = shaper.shape(line);
        missing.extend(result.missing.iter().flat_map(|r| missing_characters(&line[r.clone()], &instances)));
        unspaced.extend(result.unspaced);
        shaped.push((start, line, result.glyphs));
    }
    if !missing.is_empty() {
        let mut seen = BTreeSet::new();
        missing.retain(|&c| seen.insert(c));
        let fonts: Vec<_> = fonts.iter().map(|f| format!("font \"{}\"", f.name())).collect();
        return Err(TextError::MissingGlyphs { fonts: fonts.join(" or "), characters: missing });
    }
    warnings.extend(unspaced.into_iter().map(|script| Warning {
        element: format!("{script} letters"),
        message: "they join, so letter spacing is not applied to them".to_owned(),
    }));
    let used: BTreeSet<usize> = shaped.iter().flat_map(|(_, _, glyphs)| glyphs.iter().map(|g| g.font)).collect();
    warnings.extend(axes_without_effect(&instances, &used, &style.axes));

    let default_height = || used.iter().map(|&f| instances[f].metrics().line_height()).fold(0.0, f64::max);
    let line_height = style.line_height.unwrap_or_else(default_height);
    let shapes = glyph_shapes(shaped.iter().flat_map(|(_, _, glyphs)| glyphs), &instances)?;
    let (mut glyphs, mut extents, mut blank) = (Vec::new(), Vec::new(), BTreeSet::new());
    for (row, (start, line, shaped)) in shaped.iter().enumerate() {
        let (pens, width) = pens(shaped, style.letter_spacing);
        let left = match style.align {
            Align::Left => 0.0,
            Align::Center => -0.5 * width,
            Align::Right => -width,
        };
        let baseline = -(row as f64) * line_height;
        extents.push(LineExtent {
            left: left * style.size,
            right: (left + width) * style.size,
            baseline: baseline * style.size,
        });
        for (g, pen) in shaped.iter().zip(pens) {
            let origin = DVec2::new(left + pen, baseline) + g.offset;
            glyphs.push(PlacedGlyph { font: g.font, glyph: g.glyph, cluster: start + g.cluster, origin });
        }
        for cluster in shaped.chunk_by(|a, b| a.cluster == b.cluster) {
            let c = line[cluster[0].cluster..].chars().next().unwrap_or(' ');
            let visible = !c.is_whitespace() && !is_invisible(c);
            let draws = cluster.iter().any(|g| !shapes[&(g.font, g.glyph)].is_empty());
            if visible && !draws {
                blank.insert((c, cluster[0].font));
            }
        }
    }
    warnings.extend(blank.into_iter().map(|(c, font)| Warning {
        element: code_point(c),
        message: format!("its glyph in font \"{}\" has no outline, so nothing is drawn", fonts[font].name()),
    }));

    let shape = assemble(&glyphs, &shapes)?.transformed(DAffine2::from_scale(DVec2::splat(style.size)));
    if shape.is_empty() {
        return Err(TextError::Empty);
    }
    for g in &mut glyphs {
        g.origin *= style.size;
    }
    Ok(TextLayout { bounds: shape.bounds(), shape, glyphs, lines: extents, warnings })
}

impl TextStyle {
    fn check(&self) -> Result<(), TextError> {
        let check = |key, value: f64, ok: bool, allowed| {
            if ok { Ok(()) } else { Err(TextError::Style { key, value, allowed }) }
        };
        let positive = |v: f64| v.is_finite() && v > 0.0;
        check("size", self.size, positive(self.size), "a length above 0 m")?;
        check("letter_spacing", self.letter_spacing, self.letter_spacing.abs() <= 100.0, "within -100 to 100 em")?;
        let height = self.line_height.unwrap_or(1.0);
        check("line_height", height, positive(height) && height <= 1000.0, "above 0 and at most 1000 em")
    }
}

/// Each font at its place on the axes it has.
fn instances<'a>(fonts: &'a [Font], axes: &[(Tag, f32)]) -> Result<Vec<Instance<'a>>, TextError> {
    let first = fonts.first().ok_or(TextError::NoFont)?;
    let has = |font: &Font, tag| font.axes().iter().any(|a| a.tag == tag);
    if let Some(unknown) = axes.iter().find(|(tag, _)| !fonts.iter().any(|f| has(f, *tag))) {
        first.instance(&[*unknown])?;
    }
    fonts
        .iter()
        .map(|font| {
            let own: Vec<_> = axes.iter().copied().filter(|(tag, _)| has(font, *tag)).collect();
            Ok(font.instance(&own)?)
        })
        .collect()
}

fn axes_without_effect(instances: &[Instance<'_>], used: &BTreeSet<usize>, axes: &[(Tag, f32)]) -> Vec<Warning> {
    let lacking = |font: usize| axes.iter().filter(move |a| !instances[font].location().contains(a));
    used.iter()
        .flat_map(|&font| {
            lacking(font).map(move |(tag, _)| Warning {
                element: format!("font \"{}\"", instances[font].font().name()),
                message: format!("it has no axis '{tag}', so its glyphs are drawn without"),
            })
        })
        .collect()
}

/// The lines of a text with their byte offsets, without line breaks and without the space before these.
fn lines(text: &str) -> Vec<(usize, &str)> {
    let is_break = |c| matches!(c, '\n' | '\r' | '\u{b}' | '\u{c}' | '\u{85}' | '\u{2028}' | '\u{2029}');
    let mut lines = Vec::new();
    let mut start = 0;
    let mut rest = text.char_indices().peekable();
    while let Some((i, c)) = rest.next() {
        if is_break(c) {
            lines.push((start, text[start..i].trim_end()));
            start = i + c.len_utf8();
            if c == '\r' && rest.next_if(|n| n.1 == '\n').is_some() {
                start += 1;
            }
        }
    }
    if start < text.len() {
        lines.push((start, text[start..].trim_end()));
    }
    lines
}

fn dropped_controls(text: &str) -> Vec<Warning> {
    let dropped: BTreeSet<char> = text.chars().filter(|c| c.is_control() && *c != '\t' && !c.is_whitespace()).collect();
    let warn = |c| Warning { element: code_point(c), message: "a control character; it is left out".to_owned() };
    dropped.into_iter().map(warn).collect()
}

/// The characters of a cluster that no font maps; all of them where each alone is known.
fn missing_characters(cluster: &str, fonts: &[Instance<'_>]) -> Vec<char> {
    let unmapped = |c: &char| !is_invisible(*c) && fonts.iter().all(|f| f.glyph_index(*c).is_none());
    let missing: Vec<char> = cluster.chars().filter(unmapped).collect();
    if missing.is_empty() { cluster.chars().collect() } else { missing }
}

/// Characters that have no ink by definition: joiners, marks of direction, fillers.
const fn is_invisible(c: char) -> bool {
    matches!(c as u32, 0xad | 0x34f | 0x61c | 0x115f..=0x1160 | 0x17b4..=0x17b5 | 0x180b..=0x180f | 0x200b..=0x200f
        | 0x202a..=0x202e | 0x2060..=0x206f | 0x2800 | 0x3164 | 0xfe00..=0xfe0f | 0xfeff | 0xffa0 | 0xe0000..=0xe0fff)
}

/// Where the pen stands at each glyph, and how wide the line is, in em. The spacing goes between clusters, never into
/// one, and not where letters join or a cluster takes no room.
fn pens(glyphs: &[ShapedGlyph], spacing: f64) -> (Vec<f64>, f64) {
    let mut pens = Vec::with_capacity(glyphs.len());
    let (mut pen, mut gap) = (0.0, 0.0);
    for cluster in glyphs.chunk_by(|a, b| (a.font, a.cluster) == (b.font, b.cluster)) {
        let advance: f64 = cluster.iter().map(|g| g.advance).sum();
        if advance != 0.0 {
            pen += gap;
            gap = if cluster[0].may_space { spacing } else { 0.0 };
        }
        for g in cluster {
            pens.push(pen);
            pen += g.advance;
        }
    }
    (pens, pen)
}

/// Shapes in em by font and glyph.
type GlyphShapes = HashMap<(usize, u16), Shape>;

/// The shape of each glyph that occurs, made once.
fn glyph_shapes<'g>(
    glyphs: impl Iterator<Item = &'g ShapedGlyph>,
    instances: &[Instance<'_>],
) -> Result<GlyphShapes, FontError> {
    let distinct: BTreeSet<_> = glyphs.map(|g| (g.font, g.glyph)).collect();
    let shape = |key @ (font, glyph): (usize, u16)| Ok((key, instances[font].glyph(glyph)?));
    distinct.into_par_iter().map(shape).collect()
}

/// All glyphs as one shape in em. Those whose bounds meet are united; the rest are only moved.
fn assemble(glyphs: &[PlacedGlyph], shapes: &GlyphShapes) -> Result<Shape, OverlapError> {
    let mut placed = Vec::new();
    for g in glyphs {
        let shape = &shapes[&(g.font, g.glyph)];
        if !shape.is_empty() {
            let b = shape.bounds();
            placed.push((g.origin, Bounds { min: b.min + g.origin, max: b.max + g.origin }, shape));
        }
    }
    let bounds: Vec<_> = placed.iter().map(|p| p.1).collect();
    let moved = |i: usize, from: DVec2| placed[i].2.transformed(DAffine2::from_translation(placed[i].0 - from));
    let united = |group: &Vec<usize>| {
        if let [alone] = group[..] {
            return Ok(moved(alone, DVec2::ZERO));
        }
        // About the group's own origin, so that what lies far out in a long line loses no digits.
        let home = placed[group[0]].0;
        let mut path = BezPath::new();
        for &i in group {
            path.extend(bez_path(&moved(i, home)));
        }
        Ok(overlap::resolve(&path, FillRule::NonZero)?.transformed(DAffine2::from_translation(home)))
    };
    let parts: Vec<Shape> = groups_that_meet(&bounds).par_iter().map(united).collect::<Result<_, OverlapError>>()?;
    let mut whole = Shape::default();
    for part in parts {
        whole.append(part);
    }
    Ok(whole)
}

/// Sets of boxes connected by overlap, in order of their first box.
fn groups_that_meet(bounds: &[Bounds]) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..bounds.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let mut order: Vec<usize> = (0..bounds.len()).collect();
    order.sort_by(|&a, &b| bounds[a].min.x.total_cmp(&bounds[b].min.x));
    let mut open: Vec<usize> = Vec::new();
    for i in order {
        open.retain(|&j| bounds[j].max.x >= bounds[i].min.x);
        for &j in &open {
            if bounds[i].overlaps(bounds[j]) {
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        }
        open.push(i);
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); bounds.len()];
    for i in 0..bounds.len() {
        groups[root(&mut parent, i)].push(i);
    }
    groups.retain(|g| !g.is_empty());
    groups
}
