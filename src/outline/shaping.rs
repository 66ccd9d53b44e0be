//! Shaping one line: bidirectional order, script runs, font fallback, glyphs with positions.
//! The only file that names `harfrust`, `unicode_bidi` and `unicode_script`.

use super::font::Instance;
use glam::DVec2;
use harfrust::{BufferFlags, Feature, FontRef, ShapeOptions, ShaperData, ShaperInstance, UnicodeBuffer, Variation};
use std::ops::Range;
use unicode_bidi::{Level, ParagraphBidiInfo};
use unicode_script::{Script, ScriptExtension, UnicodeScript};

/// The direction of a line as a whole; runs inside it keep their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// That of the line's first letter; left to right if there is none.
    #[default]
    Auto,
    /// Left to right.
    Ltr,
    /// Right to left.
    Rtl,
}

/// Shaper positions are integers; this many of them make a font unit.
const FRACTIONS: i32 = 64;

/// A tab is as wide as this many spaces.
const TAB_SPACES: f64 = 4.0;

/// What letter spacing turns off: ligatures that only please the eye.
const OPTIONAL_LIGATURES: [&[u8; 4]; 4] = [b"liga", b"clig", b"dlig", b"hlig"];

/// Whether the shaper takes the file, with the reason if not.
pub(super) fn check(bytes: &[u8], index: u32) -> Result<(), String> {
    FontRef::from_index(bytes, index).map(|_| ()).map_err(|e| e.to_string())
}

/// A font ready to shape with.
pub(super) struct FontShaper<'a> {
    font: FontRef<'a>,
    data: ShaperData,
    instance: ShaperInstance,
    units_per_em: f64,
}

impl<'a> FontShaper<'a> {
    pub fn new(instance: &Instance<'a>) -> Result<Self, String> {
        let (bytes, index) = instance.font().data();
        let font = FontRef::from_index(bytes, index).map_err(|e| e.to_string())?;
        let variations =
            instance.location().iter().map(|&(tag, value)| Variation { tag: harfrust::Tag::new(&tag.0), value });
        Ok(Self {
            data: ShaperData::new(&font),
            instance: ShaperInstance::from_variations(&font, variations),
            units_per_em: instance.font().units_per_em(),
            font,
        })
    }
}

/// A glyph of a line; the line's glyphs are in visual order, left to right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ShapedGlyph {
    /// Index into the fonts.
    pub font: usize,
    /// Glyph index in that font.
    pub glyph: u16,
    /// Byte offset in the line of the first character that the glyph stands for.
    pub cluster: usize,
    /// How far the pen moves to the right, em.
    pub advance: f64,
    /// From the pen to the glyph's origin, em.
    pub offset: DVec2,
    /// Whether space may follow the cluster: not where the script joins its letters.
    pub may_space: bool,
}

/// A line after shaping.
#[derive(Default)]
pub(super) struct ShapedLine {
    pub glyphs: Vec<ShapedGlyph>,
    /// Parts of the line, in bytes, for which no font has glyphs.
    pub missing: Vec<Range<usize>>,
    /// Scripts, by name, whose letters join and were therefore not spaced out.
    pub unspaced: Vec<&'static str>,
}

/// Shapes lines with fonts in order of preference: a cluster takes the first font that has all of it.
pub(super) struct LineShaper<'a> {
    shapers: Vec<(harfrust::Shaper<'a>, f64)>,
    features: Vec<Feature>,
    spaced: bool,
    direction: Direction,
}

/// A piece of a line of one direction and one script.
struct Run<'t> {
    line: &'t str,
    range: Range<usize>,
    rtl: bool,
    script: Script,
}

impl<'a> LineShaper<'a> {
    /// `spaced`: letter spacing will be added, so no optional ligatures.
    pub fn new(fonts: &'a [FontShaper<'a>], direction: Direction, spaced: bool) -> Self {
        let build = |f: &'a FontShaper<'a>| {
            (f.data.shaper(&f.font).instance(Some(&f.instance)).build(), f.units_per_em * f64::from(FRACTIONS))
        };
        let off = |tag: &&[u8; 4]| Feature::new(harfrust::Tag::new(tag), 0, ..);
        let features = if spaced { OPTIONAL_LIGATURES.iter().map(off).collect() } else { Vec::new() };
        Self { shapers: fonts.iter().map(build).collect(), features, spaced, direction }
    }

    /// `line` without line breaks. Tabs are as wide as four spaces, other control characters are left out.
    pub fn shape(&self, line: &str) -> ShapedLine {
        let level = match self.direction {
            Direction::Auto => None,
            Direction::Ltr => Some(Level::ltr()),
            Direction::Rtl => Some(Level::rtl()),
        };
        if line.is_empty() {
            return ShapedLine::default();
        }
        let bidi = ParagraphBidiInfo::new(line, level);
        let (levels, visual) = bidi.visual_runs(0..line.len());
        let scripts = script_runs(line);
        let mut shaped = ShapedLine::default();
        for part in visual {
            let rtl = levels[part.start].is_rtl();
            let first = scripts.partition_point(|(r, _)| r.end <= part.start);
            let mut runs: Vec<_> = scripts[first..]
                .iter()
                .take_while(|(r, _)| r.start < part.end)
                .map(|(r, script)| (r.start.max(part.start)..r.end.min(part.end), *script))
                .collect();
            if rtl {
                runs.reverse();
            }
            for (range, script) in runs {
                if self.spaced && joins_letters(script) && !shaped.unspaced.contains(&script.full_name()) {
                    shaped.unspaced.push(script.full_name());
                }
                self.shape_run(&Run { line, range, rtl, script }, 0, &mut shaped);
            }
        }
        shaped
    }

    /// Shapes `run` with the fonts from `font` on.
    fn shape_run(&self, run: &Run<'_>, font: usize, shaped: &mut ShapedLine) {
        let Some((shaper, units_per_em)) = self.shapers.get(font) else {
            shaped.missing.push(run.range.clone());
            return;
        };
        let Some(buffer) = buffer(run) else { return };
        let scale = shaper.units_per_em() * FRACTIONS;
        let output = shaper.shape(buffer, ShapeOptions::new().scale(Some(scale)).features(&self.features));
        let (infos, positions) = (output.glyph_infos(), output.glyph_positions());
        let mut starts: Vec<_> = infos.iter().map(|i| i.cluster as usize).collect();
        starts.sort_unstable();
        starts.dedup();
        let end_of = |cluster: usize| {
            let next = starts.partition_point(|&s| s <= cluster);
            starts.get(next).copied().unwrap_or(run.range.end)
        };
        let same_cluster = |a: &harfrust::GlyphInfo, b: &harfrust::GlyphInfo| a.cluster == b.cluster;
        let mut at = 0;
        // Neighbouring clusters that this font lacks, to be shaped together with the next one.
        let mut lacking: Option<Range<usize>> = None;
        for glyphs in infos.chunk_by(same_cluster) {
            let cluster = glyphs[0].cluster as usize;
            if glyphs.iter().any(|g| g.glyph_id == 0) {
                let range = lacking.get_or_insert(cluster..cluster);
                *range = range.start.min(cluster)..range.end.max(end_of(cluster));
            } else {
                if let Some(range) = lacking.take() {
                    self.shape_run(&Run { range, ..*run }, font + 1, shaped);
                }
                let tab = run.line[cluster..].starts_with('\t');
                let may_space = !joins_letters(run.script);
                for (info, position) in glyphs.iter().zip(&positions[at..]) {
                    let em = |v: i32| f64::from(v) / units_per_em;
                    shaped.glyphs.push(ShapedGlyph {
                        font,
                        // Glyph indices beyond 16 bits don't exist in the fonts that the outline reader takes.
                        glyph: info.glyph_id as u16,
                        cluster,
                        advance: em(position.x_advance) * if tab { TAB_SPACES } else { 1.0 },
                        offset: DVec2::new(em(position.x_offset), em(position.y_offset)),
                        may_space,
                    });
                }
            }
            at += glyphs.len();
        }
        if let Some(range) = lacking {
            self.shape_run(&Run { range, ..*run }, font + 1, shaped);
        }
    }
}

/// The run's characters for the shaper, clusters numbered by byte offset in the line; `None` if nothing is left of it.
fn buffer(run: &Run<'_>) -> Option<UnicodeBuffer> {
    let mut buffer = UnicodeBuffer::new();
    for (i, c) in run.line[run.range.clone()].char_indices() {
        let c = if c == '\t' { ' ' } else { c };
        if !c.is_control() {
            buffer.add(c, (run.range.start + i) as u32);
        }
    }
    if buffer.is_empty() {
        return None;
    }
    let mut flags = BufferFlags::empty();
    flags.set(BufferFlags::BEGINNING_OF_TEXT, run.range.start == 0);
    flags.set(BufferFlags::END_OF_TEXT, run.range.end == run.line.len());
    buffer.set_flags(flags);
    // Letters join across runs (a word in two fonts), so the shaper sees what stands around.
    buffer.set_pre_context(&run.line[..run.range.start]);
    buffer.set_post_context(&run.line[run.range.end..]);
    buffer.set_direction(if run.rtl { harfrust::Direction::RightToLeft } else { harfrust::Direction::LeftToRight });
    let tag = harfrust::Tag::from_be_bytes(run.script.as_iso15924_tag().to_be_bytes());
    buffer.set_script(harfrust::Script::from_iso15924_tag(tag).unwrap_or(harfrust::script::UNKNOWN));
    Some(buffer)
}

/// Splits a line into runs of one script; characters common to many scripts go with what stands before them,
/// at the start with what follows. Unicode Standard Annex #24, section 5.
fn script_runs(line: &str) -> Vec<(Range<usize>, Script)> {
    let script_of =
        |ext: ScriptExtension| ext.iter().next().filter(|s| *s != Script::Inherited).unwrap_or(Script::Common);
    let mut runs = Vec::new();
    let (mut start, mut ext) = (0, ScriptExtension::default());
    for (i, c) in line.char_indices() {
        let of_char = c.script_extension();
        if of_char.is_empty() {
            continue;
        }
        let shared = ext.intersection(of_char);
        if shared.is_empty() {
            runs.push((start..i, script_of(ext)));
            (start, ext) = (i, of_char);
        } else {
            ext = shared;
        }
    }
    runs.push((start..line.len(), script_of(ext)));
    runs
}

/// Whether the letters of a script join, so that space between them would tear words apart.
/// CSS Text Module Level 3, section 8.2.1 and appendix D, plus the scripts with a headline.
const fn joins_letters(script: Script) -> bool {
    matches!(
        script,
        Script::Arabic
            | Script::Hanifi_Rohingya
            | Script::Mandaic
            | Script::Manichaean
            | Script::Mongolian
            | Script::Nko
            | Script::Phags_Pa
            | Script::Psalter_Pahlavi
            | Script::Sogdian
            | Script::Syriac
            | Script::Bengali
            | Script::Devanagari
            | Script::Gurmukhi
            | Script::Modi
            | Script::Sharada
            | Script::Syloti_Nagri
            | Script::Tirhuta
            | Script::Ogham
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_split_and_common_characters_follow() {
        let names = |line| -> Vec<_> { script_runs(line).into_iter().map(|(r, s)| (r, s.full_name())).collect() };
        assert_eq!(names("(abc) 12"), [(0..8, "Latin")]);
        assert_eq!(names("ab дж"), [(0..3, "Latin"), (3..7, "Cyrillic")]);
        assert_eq!(names("12"), [(0..2, "Common")]);
        // The combining acute is inherited: it stays with its Greek letter.
        assert_eq!(names("aα\u{301}"), [(0..1, "Latin"), (1..5, "Greek")]);
    }
}
