//! Font files: outlines, metrics, axes. The only file that names `ttf_parser`.

use super::glyf::{self, Glyf};
use super::guard::caught;
use super::overlap::{self, OverlapError};
use super::{FillRule, bundled, shaping};
use crate::shape::Shape;
use kurbo::{Affine, BezPath, PathEl, Point};
use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;
use ttf_parser::{Face, FaceParsingError, GlyphId, RawFace, name_id};

/// Most path elements that one glyph may have.
pub const MAX_GLYPH_ELEMENTS: usize = 1 << 16;

/// Why a font, or a glyph of it, cannot be used. Every message names the font.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FontError {
    /// Not a TrueType or OpenType file, or one whose tables contradict each other.
    #[error("font \"{font}\": {reason}")]
    Malformed {
        /// Name of the font.
        font: String,
        /// What is wrong.
        reason: String,
    },
    /// A table ends beyond the end of the file.
    #[error("font \"{font}\" is truncated: table '{table}' ends at byte {end}, the file has {length}")]
    Truncated {
        /// Name of the font.
        font: String,
        /// The table.
        table: Tag,
        /// Where the table would end, in bytes.
        end: u64,
        /// Length of the file in bytes.
        length: usize,
    },
    /// The index is not less than the number of fonts in the file.
    #[error("font \"{font}\": there is no font {index} in this file, which holds {count}")]
    NoSuchIndex {
        /// Name of the font.
        font: String,
        /// The index asked for.
        index: u32,
        /// Number of fonts in the file.
        count: u32,
    },
    /// The font draws by bitmaps or not at all.
    #[error("font \"{font}\" has no outlines (no usable glyf, CFF or CFF2 table)")]
    NoOutlines {
        /// Name of the font.
        font: String,
    },
    /// No bundled font has this name.
    #[error("no bundled font is called \"{font}\"; there are {known}")]
    NotBundled {
        /// The name asked for.
        font: String,
        /// The families there are.
        known: String,
    },
    /// The font has no such axis.
    #[error("font \"{font}\" has no axis '{axis}'; it has {known}")]
    UnknownAxis {
        /// Name of the font.
        font: String,
        /// The axis asked for.
        axis: Tag,
        /// The axes there are, with their ranges.
        known: String,
    },
    /// A value outside the range of its axis.
    #[error("font \"{font}\": {value} is outside the range of axis '{axis}', {min} to {max}")]
    AxisRange {
        /// Name of the font.
        font: String,
        /// The axis.
        axis: Tag,
        /// The value asked for.
        value: f32,
        /// Least value.
        min: f32,
        /// Greatest value.
        max: f32,
    },
    /// An axis with two values.
    #[error("font \"{font}\": axis '{axis}' is given twice")]
    AxisTwice {
        /// Name of the font.
        font: String,
        /// The axis.
        axis: Tag,
    },
    /// A glyph that cannot be outlined.
    #[error("font \"{font}\", glyph {glyph} {reason}")]
    Glyph {
        /// Name of the font.
        font: String,
        /// Index of the glyph.
        glyph: u16,
        /// What is wrong.
        reason: String,
    },
    /// A glyph whose overlaps could not be removed.
    #[error("font \"{font}\", glyph {glyph}: {source}")]
    Overlap {
        /// Name of the font.
        font: String,
        /// Index of the glyph.
        glyph: u16,
        /// The reason.
        source: OverlapError,
    },
}

/// A four-letter OpenType tag such as `wght`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tag(pub [u8; 4]);

/// The text is no tag.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not a tag of one to four ASCII letters or digits")]
pub struct TagError(String);

impl FromStr for Tag {
    type Err = TagError;

    fn from_str(text: &str) -> Result<Self, TagError> {
        if text.is_empty() || text.len() > 4 || !text.bytes().all(|b| b.is_ascii_alphanumeric()) {
            return Err(TagError(text.to_owned()));
        }
        let mut tag = [b' '; 4];
        tag[..text.len()].copy_from_slice(text.as_bytes());
        Ok(Self(tag))
    }
}

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(String::from_utf8_lossy(&self.0).trim_end())
    }
}

impl fmt::Debug for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{self}'")
    }
}

/// A design axis of a variable font, in the font's own (user) units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// `wght`, `wdth`, ...
    pub tag: Tag,
    /// Least value.
    pub min: f32,
    /// Value when none is given.
    pub default: f32,
    /// Greatest value.
    pub max: f32,
}

/// Vertical metrics in em, y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineMetrics {
    /// Top of the line above the baseline.
    pub ascender: f64,
    /// Bottom of the line, negative below the baseline.
    pub descender: f64,
    /// Extra space between lines.
    pub line_gap: f64,
}

impl LineMetrics {
    /// Distance between baselines in em.
    pub fn line_height(&self) -> f64 {
        self.ascender - self.descender + self.line_gap
    }
}

/// A font with outlines, checked on the way in.
#[derive(Clone)]
pub struct Font {
    name: String,
    family: Option<String>,
    bytes: Cow<'static, [u8]>,
    index: u32,
    units_per_em: u16,
    glyph_count: u16,
    axes: Vec<Axis>,
}

impl fmt::Debug for Font {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Font").field("name", &self.name).field("index", &self.index).finish_non_exhaustive()
    }
}

impl Font {
    /// Reads a TrueType or OpenType font. `name` is what errors call it (a file name); `index` picks a font of a
    /// collection and is 0 otherwise.
    ///
    /// # Errors
    /// If outline reader and shaper do not both accept the file, or a table is cut off, or outlines or the character
    /// map are missing.
    pub fn from_bytes(
        name: impl Into<String>,
        bytes: impl Into<Cow<'static, [u8]>>,
        index: u32,
    ) -> Result<Self, FontError> {
        let (name, bytes) = (name.into(), bytes.into());
        let malformed = |reason: &str| FontError::Malformed { font: name.clone(), reason: reason.to_owned() };
        let parsing = |e| match e {
            FaceParsingError::UnknownMagic => malformed(match bytes.get(..4) {
                Some(b"wOFF" | b"wOF2") => "is compressed for the web (WOFF); unpack it to .ttf or .otf first",
                _ => "is not a TrueType or OpenType font",
            }),
            FaceParsingError::FaceIndexOutOfBounds => {
                let count = ttf_parser::fonts_in_collection(&bytes).unwrap_or(1);
                FontError::NoSuchIndex { font: name.clone(), index, count }
            }
            FaceParsingError::MalformedFont => malformed("the table directory is cut short"),
            FaceParsingError::NoHeadTable => malformed("the head table is missing or malformed"),
            FaceParsingError::NoHheaTable => malformed("the hhea table is missing or malformed"),
            FaceParsingError::NoMaxpTable => malformed("the maxp table is missing or malformed"),
        };
        for record in RawFace::parse(&bytes, index).map_err(parsing)?.table_records {
            let end = u64::from(record.offset) + u64::from(record.length);
            if end > bytes.len() as u64 {
                let table = Tag(record.tag.to_bytes());
                return Err(FontError::Truncated { font: name, table, end, length: bytes.len() });
            }
        }
        let face = Face::parse(&bytes, index).map_err(parsing)?;
        let tables = face.tables();
        let read: [(&[u8; 4], bool); 9] = [
            (b"glyf", tables.glyf.is_some()),
            (b"CFF ", tables.cff.is_some()),
            (b"CFF2", tables.cff2.is_some()),
            (b"cmap", tables.cmap.is_some()),
            (b"hmtx", tables.hmtx.is_some()),
            (b"fvar", tables.fvar.is_some()),
            (b"avar", tables.avar.is_some()),
            (b"gvar", tables.gvar.is_some()),
            (b"MVAR", tables.mvar.is_some()),
        ];
        for (tag, read) in read {
            if !read && face.raw_face().table(ttf_parser::Tag::from_bytes(tag)).is_some() {
                return Err(malformed(&format!(
                    "the {} table is malformed, or of a version that is not supported",
                    Tag(*tag)
                )));
            }
        }
        if tables.glyf.is_none() && tables.cff.is_none() && tables.cff2.is_none() {
            return Err(FontError::NoOutlines { font: name });
        }
        if tables.hmtx.is_none() {
            return Err(malformed("there are no advance widths (hmtx table)"));
        }
        if !tables.cmap.is_some_and(|cmap| cmap.subtables.into_iter().any(|s| s.is_unicode())) {
            return Err(malformed("there is no Unicode character map (cmap table)"));
        }
        shaping::check(&bytes, index).map_err(|reason| malformed(&format!("the shaper refuses it: {reason}")))?;
        let axes: Vec<_> = face
            .variation_axes()
            .into_iter()
            .map(|a| Axis { tag: Tag(a.tag.to_bytes()), min: a.min_value, default: a.def_value, max: a.max_value })
            .collect();
        let (units_per_em, glyph_count) = (face.units_per_em(), face.number_of_glyphs());
        let family = family(&face);
        Ok(Self { name, family, bytes, index, units_per_em, glyph_count, axes })
    }

    /// The bundled font with this family or file name, see [`bundled::find`].
    ///
    /// # Errors
    /// If there is none; the message lists the families.
    pub fn bundled(name: &str) -> Result<Self, FontError> {
        let Some(font) = bundled::find(name) else {
            let known: Vec<_> = bundled::bundled().iter().map(|f| format!("\"{}\"", f.family)).collect();
            return Err(FontError::NotBundled { font: name.to_owned(), known: known.join(", ") });
        };
        Self::from_bytes(font.name, font.bytes, 0)
    }

    /// What errors call the font.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Family name, if the font states one in Unicode.
    pub fn family(&self) -> Option<&str> {
        self.family.as_deref()
    }

    /// The design axes; none for a static font.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Number of glyphs.
    pub const fn glyph_count(&self) -> u16 {
        self.glyph_count
    }

    /// Font units per em.
    pub fn units_per_em(&self) -> f64 {
        self.units_per_em.into()
    }

    /// The file and the index of the font in it.
    pub fn data(&self) -> (&[u8], u32) {
        (&self.bytes, self.index)
    }

    /// The font at a place on its axes; axes not given stay at their defaults.
    ///
    /// # Errors
    /// If an axis is unknown or given twice, or its value is out of range.
    pub fn instance(&self, location: &[(Tag, f32)]) -> Result<Instance<'_>, FontError> {
        let font = || self.name.clone();
        let mut face = Face::parse(&self.bytes, self.index)
            .map_err(|e| FontError::Malformed { font: font(), reason: e.to_string() })?;
        for (i, &(tag, value)) in location.iter().enumerate() {
            let Some(axis) = self.axes.iter().find(|a| a.tag == tag) else {
                return Err(FontError::UnknownAxis { font: font(), axis: tag, known: self.axes_listed() });
            };
            if location[..i].iter().any(|l| l.0 == tag) {
                return Err(FontError::AxisTwice { font: font(), axis: tag });
            }
            if !(axis.min..=axis.max).contains(&value) {
                return Err(FontError::AxisRange { font: font(), axis: tag, value, min: axis.min, max: axis.max });
            }
            if face.set_variation(ttf_parser::Tag::from_bytes(&tag.0), value).is_none() {
                let reason = format!("has {} axes, more than can be set", self.axes.len());
                return Err(FontError::Malformed { font: font(), reason });
            }
        }
        Ok(Instance { font: self, face, location: location.to_vec() })
    }

    fn axes_listed(&self) -> String {
        let list: Vec<_> = self.axes.iter().map(|a| format!("'{}' ({} to {})", a.tag, a.min, a.max)).collect();
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    }
}

/// A [`Font`] at one place on its axes.
#[derive(Clone)]
pub struct Instance<'a> {
    font: &'a Font,
    face: Face<'a>,
    location: Vec<(Tag, f32)>,
}

impl<'a> Instance<'a> {
    /// The font.
    pub const fn font(&self) -> &'a Font {
        self.font
    }

    /// The axes that were set.
    pub fn location(&self) -> &[(Tag, f32)] {
        &self.location
    }

    /// Vertical metrics in em.
    pub fn metrics(&self) -> LineMetrics {
        let em = |units: i16| f64::from(units) / self.font.units_per_em();
        LineMetrics {
            ascender: em(self.face.ascender()),
            descender: em(self.face.descender()),
            line_gap: em(self.face.line_gap()),
        }
    }

    /// The glyph that the character map gives for `c`, before any shaping.
    pub fn glyph_index(&self, c: char) -> Option<u16> {
        self.face.glyph_index(c).map(|id| id.0)
    }

    /// How far the pen moves on behind a glyph, em; 0 where the font doesn't say.
    pub fn advance(&self, glyph: u16) -> f64 {
        let units = self.face.glyph_hor_advance(GlyphId(glyph)).unwrap_or_default();
        f64::from(units) / self.font.units_per_em()
    }

    /// The outline as the font draws it: font units, y up, unhinted, overlaps and winding as they are.
    /// Empty for a blank glyph.
    ///
    /// # Errors
    /// If the glyph does not exist, is malformed, or needs what the reader does not do.
    pub fn outline(&self, glyph: u16) -> Result<BezPath, FontError> {
        let fail = |reason: String| FontError::Glyph { font: self.font.name.clone(), glyph, reason };
        if glyph >= self.font.glyph_count {
            return Err(fail(format!("does not exist: there are {}", self.font.glyph_count)));
        }
        let (id, tables) = (GlyphId(glyph), self.face.tables());
        let mut pen = Pen::default();
        // Broken charstrings pop what they have not pushed, and the reader panics.
        let broken = |reason: String| fail(format!("is malformed: {reason}"));
        if tables.glyf.is_some() {
            let table = |tag| self.face.raw_face().table(ttf_parser::Tag::from_bytes(tag)).unwrap_or_default();
            let glyf = Glyf::new(table(b"head"), table(b"loca"), table(b"glyf"));
            let entry = glyf.entry(glyph).map_err(fail)?;
            if entry.draws {
                pen.shift = self.left_edge_shift(&entry);
                let outlined = caught(|| self.face.outline_glyph(id, &mut pen)).map_err(broken)?;
                outlined.ok_or_else(|| fail("is malformed".to_owned()))?;
            }
        } else {
            let outlined = caught(|| match (&tables.cff, &tables.cff2) {
                (Some(cff), _) => Some(cff.outline(id, &mut pen)),
                (None, Some(cff2)) => Some(cff2.outline(self.face.variation_coordinates(), id, &mut pen)),
                (None, None) => None,
            });
            match outlined.map_err(broken)? {
                None => return Err(FontError::NoOutlines { font: self.font.name.clone() }),
                Some(Ok(_) | Err(ttf_parser::CFFError::ZeroBBox)) => {}
                Some(Err(e)) => return Err(broken(format!("{e:?}"))),
            }
        }
        if pen.elements > MAX_GLYPH_ELEMENTS {
            return Err(fail(format!(
                "has {} path elements, more than the limit of {MAX_GLYPH_ELEMENTS}",
                pen.elements
            )));
        }
        Ok(pen.finish())
    }

    /// How far to move an outline of `glyf` so that its left edge lies on its side bearing: the first phantom point is
    /// the origin. OpenType specification, "Instructing TrueType glyphs", phantom points.
    fn left_edge_shift(&self, entry: &glyf::Entry) -> f32 {
        let id = GlyphId(entry.metrics_glyph);
        let bearing = self.face.tables().hmtx.and_then(|hmtx| hmtx.side_bearing(id)).unwrap_or(entry.x_min);
        let varied = self.face.glyph_phantom_points(id).map_or(0.0, |phantom| phantom.left.x);
        f32::from(bearing) - f32::from(entry.x_min) - varied
    }

    /// The glyph as a shape in em (1 em = 1, y up, baseline at y = 0, pen at x = 0), free of overlap.
    /// Empty for a blank glyph.
    ///
    /// # Errors
    /// As [`Self::outline`], and if the overlaps cannot be removed.
    pub fn glyph(&self, glyph: u16) -> Result<Shape, FontError> {
        let path = Affine::scale(1.0 / self.font.units_per_em()) * self.outline(glyph)?;
        overlap::resolve(&path, FillRule::NonZero).map_err(|source| FontError::Overlap {
            font: self.font.name.clone(),
            glyph,
            source,
        })
    }
}

/// The glyph of `font` at `location` on its axes as a shape in em, free of overlap, see [`Instance::glyph`].
///
/// # Errors
/// As [`Font::instance`] and [`Instance::glyph`].
pub fn glyph(font: &Font, glyph: u16, location: &[(Tag, f32)]) -> Result<Shape, FontError> {
    font.instance(location)?.glyph(glyph)
}

fn family(face: &Face<'_>) -> Option<String> {
    let by_id = |id| face.names().into_iter().filter(|n| n.name_id == id).find_map(|n| n.to_string());
    by_id(name_id::TYPOGRAPHIC_FAMILY).or_else(|| by_id(name_id::FAMILY))
}

/// Collects a glyph's path, up to [`MAX_GLYPH_ELEMENTS`].
#[derive(Default)]
struct Pen {
    path: BezPath,
    elements: usize,
    /// Added to every x.
    shift: f32,
    /// Whether a contour is open: CFF2 leaves its last one so, and a contour of one stray point is closed unbegun.
    open: bool,
}

impl Pen {
    fn push(&mut self, element: PathEl) {
        self.elements += 1;
        if self.elements <= MAX_GLYPH_ELEMENTS {
            self.path.push(element);
        }
    }

    fn point(&self, x: f32, y: f32) -> Point {
        Point::new((x + self.shift).into(), y.into())
    }

    fn finish(mut self) -> BezPath {
        ttf_parser::OutlineBuilder::close(&mut self);
        self.path
    }
}

impl ttf_parser::OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.close();
        self.open = true;
        self.push(PathEl::MoveTo(self.point(x, y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.push(PathEl::LineTo(self.point(x, y)));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.push(PathEl::QuadTo(self.point(x1, y1), self.point(x, y)));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.push(PathEl::CurveTo(self.point(x1, y1), self.point(x2, y2), self.point(x, y)));
    }

    fn close(&mut self) {
        if self.open {
            self.push(PathEl::ClosePath);
        }
        self.open = false;
    }
}
