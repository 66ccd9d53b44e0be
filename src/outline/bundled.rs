//! The fonts in `fonts/`, compiled in: text needs no installed font. Origins and licences: `fonts/README.md`.

/// A font that the program carries with it.
#[derive(Debug)]
pub struct BundledFont {
    /// File name in `fonts/`.
    pub name: &'static str,
    /// Family name, as the font itself states it.
    pub family: &'static str,
    /// The file.
    pub bytes: &'static [u8],
}

/// Family of the font that is used when none is named: variable, and heavy weights read well as a light.
pub const DEFAULT_FAMILY: &str = "Inter";

macro_rules! font {
    ($name:literal, $family:literal) => {
        BundledFont { name: $name, family: $family, bytes: include_bytes!(concat!("../../fonts/", $name)) }
    };
}

static FONTS: [BundledFont; 6] = [
    font!("Inter.var.ttf", "Inter"),
    font!("DejaVuSans.ttf", "DejaVu Sans"),
    font!("SourceSans3-Regular.otf", "Source Sans 3"),
    font!("SourceSans3VF-Upright.otf", "SourceSans3VF"),
    font!("Amiri-Regular.ttf", "Amiri"),
    font!("DroidSansFallback-Subset.ttf", "Droid Sans Fallback"),
];

/// All bundled fonts, the default first.
pub fn bundled() -> &'static [BundledFont] {
    &FONTS
}

/// The bundled font with this family, file name, or file name without extension; case, spaces and hyphens don't count.
pub fn find(name: &str) -> Option<&'static BundledFont> {
    let key =
        |s: &str| -> String { s.chars().filter(|c| !matches!(c, ' ' | '-')).flat_map(char::to_lowercase).collect() };
    let wanted = key(name);
    let stem = |font: &BundledFont| key(font.name.rsplit_once('.').map_or(font.name, |(stem, _)| stem));
    FONTS.iter().find(|f| key(f.family) == wanted || key(f.name) == wanted || stem(f) == wanted)
}
