//! Text layout: shaping, order, spacing, alignment, fallback, errors.

use crate::fonts::disagreement;
use glyphlight::outline::font::{Font, FontError, Tag};
use glyphlight::outline::text::{Align, Direction, MAX_CHARACTERS, TextError, TextLayout, TextStyle, layout};
use glyphlight::outline::{FillRule, bundled};
use kurbo::{Affine, BezPath};
use proptest::prelude::*;

fn font(name: &str) -> Font {
    Font::bundled(name).expect("a bundled font")
}

/// `text` at 1 m in one bundled font, otherwise in the default style.
fn set(text: &str, name: &str) -> TextLayout {
    styled(text, name, &TextStyle::default())
}

fn styled(text: &str, name: &str, style: &TextStyle) -> TextLayout {
    layout(text, &[font(name)], style).expect("the text can be set")
}

fn spaced(letter_spacing: f64) -> TextStyle {
    TextStyle { letter_spacing, ..TextStyle::default() }
}

fn width(text: &TextLayout) -> f64 {
    text.lines[0].right - text.lines[0].left
}

/// The first characters of the glyphs' clusters, from left to right.
fn order(text: &str, set: &TextLayout) -> String {
    set.glyphs.iter().map(|g| text[g.cluster..].chars().next().expect("a cluster begins with a character")).collect()
}

/// What is wrong with the shape as the union of the glyphs in their places, by tiny-skia.
fn wrong_with(set: &TextLayout, fonts: &[Font], style: &TextStyle) -> Option<String> {
    let mut path = BezPath::new();
    for g in &set.glyphs {
        let instance = fonts[g.font].instance(&style.axes).expect("in range");
        let place =
            Affine::translate((g.origin.x, g.origin.y)) * Affine::scale(style.size / instance.font().units_per_em());
        path.extend(place * instance.outline(g.glyph).expect("a path"));
    }
    disagreement(&set.shape, &path, 1.0)
}

#[test]
fn kerning_pulls_a_and_v_together() {
    for name in ["Inter", "DejaVu Sans", "Source Sans 3", "SourceSans3VF"] {
        let apart = |a: &str, b: &str| width(&set(a, name)) + width(&set(b, name));
        let kerned = apart("A", "V") - width(&set("AV", name));
        assert!(kerned > 0.01, "{name}: {kerned}");
        assert!((width(&set("HH", name)) - apart("H", "H")).abs() < 1e-9, "{name}");
    }
}

#[test]
fn f_and_i_become_a_ligature_unless_spaced() {
    let joined = set("fi", "DejaVu Sans");
    assert_eq!(joined.glyphs.len(), 1);
    assert_eq!(styled("fi", "DejaVu Sans", &spaced(0.1)).glyphs.len(), 2);
    assert_eq!(set("fj", "Inter").glyphs.len(), 2);
}

#[test]
fn letter_spacing_goes_between_clusters_only() {
    let plain = set("HOH", "Inter");
    let wide = styled("HOH", "Inter", &spaced(0.25));
    assert!((width(&wide) - width(&plain) - 2.0 * 0.25).abs() < 1e-9, "no space after the last");
    // x with an acute is two glyphs in one cluster: the accent stays where it is.
    let accent = |s: &TextLayout| s.glyphs[1].origin - s.glyphs[0].origin;
    let (plain, wide) = (set("x\u{301}x", "DejaVu Sans"), styled("x\u{301}x", "DejaVu Sans", &spaced(0.25)));
    assert_eq!(plain.glyphs.len(), 3);
    assert!((accent(&plain) - accent(&wide)).length() < 1e-9);
    assert!((width(&wide) - width(&plain) - 0.25).abs() < 1e-9);
}

#[test]
fn arabic_joins_and_runs_from_right_to_left() {
    let word = "سلام";
    let joined = set(word, "Amiri");
    let alone: Vec<_> = word.chars().map(|c| set(&c.to_string(), "Amiri").glyphs[0].glyph).collect();
    assert!(joined.glyphs.iter().all(|g| !alone.contains(&g.glyph) || word[g.cluster..].starts_with('م')));
    assert!(
        joined.glyphs.windows(2).all(|w| w[0].cluster >= w[1].cluster),
        "first letter rightmost: {:?}",
        joined.glyphs
    );
    // seen-lam-alef is one piece of ink, meem another; seen alone would be a third.
    let pieces = |s: &TextLayout| s.shape.contours().iter().filter(|c| !c.is_hole()).count();
    assert_eq!(pieces(&joined), 2);
    assert_eq!(pieces(&set("س ل ا م", "Amiri")), 4);
    assert_eq!(wrong_with(&joined, &[font("Amiri")], &TextStyle::default()), None);

    let wide = styled(word, "Amiri", &spaced(0.5));
    assert_eq!(width(&wide), width(&joined), "letters that join are not torn apart");
    assert_eq!(wide.warnings.len(), 1);
    assert_eq!(wide.warnings[0].element, "Arabic letters");
}

#[test]
fn a_mixed_line_is_put_in_visual_order() {
    let text = "abc אבג 12 def";
    let by = |direction| order(text, &styled(text, "DejaVu Sans", &TextStyle { direction, ..TextStyle::default() }));
    assert_eq!(by(Direction::Auto), "abc 12 גבא def");
    assert_eq!(by(Direction::Ltr), "abc 12 גבא def");
    assert_eq!(by(Direction::Rtl), "def 12 גבא abc");
    assert_eq!(order("אב x", &set("אב x", "DejaVu Sans")), "x בא", "a line begins in its first letter's direction");
    // A bracket in a right-to-left line opens to the left: it is mirrored.
    let glyph = |text: &str| set(text, "DejaVu Sans").glyphs.last().expect("a glyph").glyph;
    assert_eq!(glyph("(א"), glyph("x)"));
    assert_ne!(glyph("(א"), glyph("x("));
}

#[test]
fn a_combining_mark_sits_on_its_base() {
    for name in ["DejaVu Sans", "Inter", "Source Sans 3"] {
        let font = font(name);
        let (base, marked) = (set("x", name), set("x\u{302}", name));
        let [x, mark] = &marked.glyphs[..] else { panic!("{name}: {:?}", marked.glyphs) };
        assert_eq!((x.cluster, mark.cluster), (0, 0));
        let ink = font.instance(&[]).expect("default").glyph(mark.glyph).expect("a shape").bounds();
        let (low, middle) = (ink.min.y + mark.origin.y, ink.center().x + mark.origin.x);
        assert!(low > base.bounds.max.y, "{name}: mark from {low}, base to {}", base.bounds.max.y);
        let off = middle - base.bounds.center().x;
        assert!(off.abs() < 0.03, "{name}: mark {off} em beside the middle");
        assert_eq!(width(&base), width(&marked), "{name}");
    }
}

#[test]
fn lines_are_aligned_at_x_zero_and_stacked_downwards() {
    let text = "one\r\nfour\u{2028}\u{2029}seventeen  \n";
    for (align, at) in [(Align::Left, 0.0), (Align::Center, 0.5), (Align::Right, 1.0)] {
        let style = TextStyle { align, size: 0.5, line_height: Some(1.25), ..TextStyle::default() };
        let set = styled(text, "Inter", &style);
        assert_eq!(set.lines.len(), 4);
        for (i, line) in set.lines.iter().enumerate() {
            assert_eq!(line.baseline, -0.625 * i as f64);
            assert!((line.left + at * (line.right - line.left)).abs() < 1e-12, "{align:?} {line:?}");
        }
        let [one, four, empty, seventeen] = &set.lines[..] else { unreachable!() };
        assert_eq!(empty.left, empty.right);
        assert!(seventeen.right - seventeen.left > four.right - four.left && four.right > one.left);
    }
    let trimmed = |text| width(&set(text, "Inter"));
    assert_eq!(trimmed("one \t"), trimmed("one"), "space at the end of a line takes none");
    assert!(trimmed(" one") > trimmed("one"));
}

#[test]
fn line_height_is_the_fonts_own() {
    let set = set("a\nb", "DejaVu Sans");
    let metrics = font("DejaVu Sans").instance(&[]).expect("default").metrics();
    assert_eq!((metrics.ascender, metrics.descender, metrics.line_gap), (1901.0 / 2048.0, -483.0 / 2048.0, 0.0));
    assert_eq!(set.lines[1].baseline, -(1901.0 + 483.0) / 2048.0);
}

#[test]
fn size_scales_everything() {
    let (one, two) = (set("Ag", "Inter"), styled("Ag", "Inter", &TextStyle { size: 2e-3, ..TextStyle::default() }));
    assert!((two.bounds.max - one.bounds.max * 2e-3).length() < 1e-12);
    assert!((two.shape.area() / one.shape.area() - 4e-6).abs() < 1e-15);
    assert!((two.glyphs[1].origin - one.glyphs[1].origin * 2e-3).length() < 1e-12);
}

#[test]
fn weight_adds_ink() {
    let at = |value| TextStyle { axes: vec![(Tag(*b"wght"), value)], ..TextStyle::default() };
    for name in ["Inter", "SourceSans3VF"] {
        let [light, heavy] = [200.0, 900.0].map(|value| styled("OPEN", name, &at(value)));
        assert!(heavy.shape.area() > 2.0 * light.shape.area(), "{name}");
        assert!(width(&heavy) > width(&light), "{name}: the shaper's advances follow the axis too");
        assert_eq!(wrong_with(&heavy, &[font(name)], &at(900.0)), None);
        assert!(wrong_with(&heavy, &[font(name)], &at(800.0)).is_some(), "{name}: a wrong weight is noticed");
    }
}

#[test]
fn glyphs_that_overlap_are_united() {
    let fonts = [font("Inter")];
    for (text, style) in [
        ("OOO", spaced(-0.4)),
        ("xxxx", spaced(-0.15)),
        ("Ågj\nÅÉ", TextStyle { line_height: Some(0.6), ..TextStyle::default() }),
        ("(V)", TextStyle { size: 1e-4, letter_spacing: -0.2, ..TextStyle::default() }),
    ] {
        let set = layout(text, &fonts, &style).expect("it can be set");
        assert_eq!(wrong_with(&set, &fonts, &style), None, "{text}");
        let instance = fonts[0].instance(&[]).expect("default");
        let areas = set.glyphs.iter().map(|g| instance.glyph(g.glyph).expect("a shape").area() * style.size.powi(2));
        assert!(set.shape.area() < 0.995 * areas.sum::<f64>(), "{text}: the glyphs do overlap");
    }
    // Where nothing touches, the glyphs' own contours are only moved.
    let set = set("IO", "Inter");
    let o = fonts[0].instance(&[]).expect("default").glyph(set.glyphs[1].glyph).expect("a shape");
    let moved = o.transformed(glam::DAffine2::from_translation(set.glyphs[1].origin));
    assert_eq!(set.shape.contours()[1..], *moved.contours());
}

#[test]
fn every_script_at_hand_covers_what_its_outlines_fill() {
    let samples = [
        ("DejaVu Sans", "Żółć שלום Ελλάδα Съешь ﬁ"),
        ("Amiri", "بِسْمِ ٱللَّهِ ٱلرَّحْمَٰنِ\nالْعَرَبِيَّةُ 2026"),
        ("Droid Sans Fallback", "東京の夜、光と影"),
        ("SourceSans3VF", "Hamburgefonstiv"),
    ];
    for (name, text) in samples {
        let set = set(text, name);
        assert_eq!(wrong_with(&set, &[font(name)], &TextStyle::default()), None, "{name}");
        assert!(set.warnings.is_empty(), "{:?}", set.warnings);
    }
}

#[test]
fn each_cluster_takes_the_first_font_that_has_it() {
    let fonts = [font("Inter"), font("Amiri"), font("Droid Sans Fallback")];
    let text = "Go 光の سلام!";
    let set = layout(text, &fonts, &TextStyle::default()).expect("between them they have all of it");
    for g in &set.glyphs {
        let c = text[g.cluster..].chars().next().expect("a character");
        let expected = match c {
            '\0'..='\x7f' => 0,
            '\u{600}'..='\u{6ff}' => 1,
            _ => 2,
        };
        assert_eq!(g.font, expected, "{c}");
    }
    let alone = layout("سلام", &fonts[1..2], &TextStyle::default()).expect("Amiri has it");
    let ids = |s: &TextLayout, font| s.glyphs.iter().filter(|g| g.font == font).map(|g| g.glyph).collect::<Vec<_>>();
    assert_eq!(ids(&set, 1), ids(&alone, 0), "the word is shaped as a whole in its font");
    let reversed: Vec<_> = fonts.iter().rev().cloned().collect();
    assert_eq!(layout("A", &reversed, &TextStyle::default()).expect("Amiri has it").glyphs[0].font, 1);
}

#[test]
fn missing_glyphs_are_named_by_code_point() {
    let error =
        |text: &str, fonts: &[Font]| layout(text, fonts, &TextStyle::default()).expect_err("it has none").to_string();
    assert_eq!(error("A漢B字漢", &[font("Inter")]), "no glyph in font \"Inter.var.ttf\" for U+6F22 '漢', U+5B57 '字'");
    assert_eq!(
        error("x\u{1f600}\u{fe0f}", &[font("Inter"), font("Amiri")]),
        "no glyph in font \"Inter.var.ttf\" or font \"Amiri-Regular.ttf\" for U+1F600 '😀'"
    );
    let many: String = ('\u{4e00}'..'\u{4e40}').collect();
    assert!(error(&many, &[font("Inter")]).ends_with(" and 32 more"));
    assert!(layout("A日", &[font("Inter"), font("Droid Sans Fallback")], &TextStyle::default()).is_ok());
}

#[test]
fn empty_long_and_odd_texts_are_errors() {
    let fonts = [font("Inter")];
    let set = |text: &str| layout(text, &fonts, &TextStyle::default());
    for text in ["", " ", "\n\t \u{3000}\u{2028}", "\u{0}\u{7}", "\u{200d}\u{ad}"] {
        assert_eq!(set(text).expect_err("nothing to see"), TextError::Empty, "{text:?}");
    }
    let long = "x".repeat(MAX_CHARACTERS + 1);
    assert_eq!(set(&long).expect_err("too long"), TextError::TooLong { count: MAX_CHARACTERS + 1 });
    assert_eq!(layout("x", &[], &TextStyle::default()).expect_err("no font"), TextError::NoFont);
    let bad = [
        TextStyle { size: 0.0, ..TextStyle::default() },
        TextStyle { size: f64::NAN, ..TextStyle::default() },
        TextStyle { line_height: Some(-1.0), ..TextStyle::default() },
        spaced(f64::INFINITY),
    ];
    for style in bad {
        assert!(matches!(layout("x", &fonts, &style), Err(TextError::Style { .. })), "{style:?}");
    }
}

#[test]
fn control_characters_are_left_out_with_a_warning() {
    let set = set("a\u{0}b\u{1d}c\u{7f}", "Inter");
    assert_eq!(set.shape, self::set("abc", "Inter").shape);
    let elements: Vec<_> = set.warnings.iter().map(|w| w.element.as_str()).collect();
    assert_eq!(elements, ["U+0000", "U+001D", "U+007F"]);
    let (tab, spaces) = (self::set("a\tb", "Inter"), self::set("a    b", "Inter"));
    assert!((width(&tab) - width(&spaces)).abs() < 0.02, "a tab is four spaces wide");
    assert!(tab.warnings.is_empty());
}

#[test]
fn axes_are_checked_by_name_and_range() {
    let error = |name: &str, axes: &[(&[u8; 4], f32)]| {
        let axes = axes.iter().map(|(tag, v)| (Tag(**tag), *v)).collect();
        let style = TextStyle { axes, ..TextStyle::default() };
        layout("x", &[font(name)], &style).expect_err("refused").to_string()
    };
    assert_eq!(
        error("Inter", &[(b"wdth", 90.0)]),
        "font \"Inter.var.ttf\" has no axis 'wdth'; it has 'wght' (100 to 900), 'slnt' (-10 to 0)"
    );
    assert_eq!(error("Amiri", &[(b"wght", 400.0)]), "font \"Amiri-Regular.ttf\" has no axis 'wght'; it has none");
    assert_eq!(
        error("Inter", &[(b"wght", 901.0)]),
        "font \"Inter.var.ttf\": 901 is outside the range of axis 'wght', 100 to 900"
    );
    assert!(error("Inter", &[(b"wght", f32::NAN)]).contains("NaN is outside"));
    assert!(error("Inter", &[(b"wght", 400.0), (b"wght", 500.0)]).contains("given twice"));
    assert_eq!("wght".parse(), Ok(Tag(*b"wght")));
    assert!("weight".parse::<Tag>().is_err() && "".parse::<Tag>().is_err() && "w\u{e9}".parse::<Tag>().is_err());

    let style = TextStyle { axes: vec![(Tag(*b"wght"), 900.0)], ..TextStyle::default() };
    let warnings = |text| {
        let set = layout(text, &[font("Inter"), font("Droid Sans Fallback")], &style).expect("it can be set");
        set.warnings.into_iter().map(|w| format!("{}: {}", w.element, w.message)).collect::<Vec<_>>()
    };
    assert!(warnings("A").is_empty());
    let expected = "font \"DroidSansFallback-Subset.ttf\": it has no axis 'wght', so its glyphs are drawn without";
    assert_eq!(warnings("A日"), [expected]);
}

#[test]
fn bundled_fonts_are_found_by_any_of_their_names() {
    for name in ["inter", "Inter.var.ttf", "INTER.VAR", bundled::DEFAULT_FAMILY] {
        assert_eq!(font(name).name(), "Inter.var.ttf");
    }
    assert_eq!(font("source sans 3").name(), "SourceSans3-Regular.otf");
    assert_eq!(font("amiri-regular").name(), "Amiri-Regular.ttf");
    for b in bundled::bundled() {
        assert_eq!(font(b.name).family(), Some(b.family));
    }
    let error = Font::bundled("Comic").expect_err("not ours").to_string();
    assert!(error.starts_with("no bundled font is called \"Comic\"; there are \"Inter\", \"DejaVu Sans\""), "{error}");
}

#[test]
fn a_truncated_font_is_refused_at_every_length() {
    for b in bundled::bundled() {
        let lengths = (0..64).chain((0..512).map(|k| k * b.bytes.len() / 512)).chain([b.bytes.len() - 4]);
        for length in lengths {
            let error = Font::from_bytes("cut.ttf", &b.bytes[..length], 0).expect_err("it is cut").to_string();
            assert!(error.starts_with("font \"cut.ttf\""), "{error}");
        }
        assert!(Font::from_bytes("whole.ttf", b.bytes, 0).is_ok());
    }
    let error = |bytes: &'static [u8], index| Font::from_bytes("f", bytes, index).expect_err("no font").to_string();
    assert_eq!(error(b"", 0), "font \"f\": is not a TrueType or OpenType font");
    assert_eq!(error(b"<svg/>", 0), "font \"f\": is not a TrueType or OpenType font");
    assert!(error(b"wOF2\0\0\0\0", 0).contains("WOFF"));
    assert_eq!(error(bundled::bundled()[0].bytes, 1), "font \"f\": there is no font 1 in this file, which holds 1");
    let cut = &bundled::bundled()[1].bytes[..400_000];
    assert!(matches!(Font::from_bytes("f", cut, 0), Err(FontError::Truncated { length: 400_000, .. })));
}

#[test]
fn a_font_without_outlines_is_refused() {
    let whole = bundled::find("Droid Sans Fallback").expect("bundled").bytes;
    let without = |tag: &[u8; 4]| {
        let mut bytes = whole.to_vec();
        let at = bytes.windows(4).position(|w| w == tag).expect("it has the table");
        bytes[at..at + 4].copy_from_slice(b"zzzz");
        // The directory must stay sorted to be searched.
        let tables = usize::from(u16::from_be_bytes([bytes[4], bytes[5]]));
        let mut records: Vec<[u8; 16]> =
            bytes[12..12 + 16 * tables].chunks(16).map(|r| r.try_into().expect("16 bytes")).collect();
        records.sort();
        bytes[12..12 + 16 * tables].copy_from_slice(&records.concat());
        Font::from_bytes("f", bytes, 0).expect_err("it lacks a table").to_string()
    };
    assert_eq!(without(b"glyf"), "font \"f\" has no outlines (no usable glyf, CFF or CFF2 table)");
    assert!(without(b"cmap").contains("character map"));
    assert!(without(b"hmtx").contains("advance widths"));
    assert!(without(b"head").contains("the head table"));
}

#[test]
fn a_glyph_that_does_not_exist_is_an_error() {
    let font = font("Amiri");
    let error = font.instance(&[]).expect("default").outline(60_000).expect_err("there is none").to_string();
    assert_eq!(error, "font \"Amiri-Regular.ttf\", glyph 60000 does not exist: there are 6624");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes overwritten anywhere give an error or a text, never a panic or an endless loop.
    #[test]
    fn damaged_fonts_do_no_harm(
        which in 0..6_usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..40),
        head in any::<bool>(),
    ) {
        let mut bytes = bundled::bundled()[which].bytes.to_vec();
        // Half of the cases aim at the directory and the first tables, where every byte matters.
        let reach = if head { 2000 } else { bytes.len() };
        for (at, value) in damage {
            bytes[at.index(reach)] = value;
        }
        if let Ok(font) = Font::from_bytes("damaged", bytes, 0) {
            let text = if which == 5 { "東京の光" } else { "Âfi سلام" };
            if let Ok(set) = layout(text, &[font], &TextStyle::default()) {
                prop_assert!(set.shape.curves().all(|c| c.points().iter().all(|p| p.is_finite())));
            }
        }
    }

    /// Any text is set or refused with a reason.
    #[test]
    fn any_text_is_set_or_refused(text in "\\PC{0,12}|[a-zא-ת\u{600}-\u{660}\u{300}-\u{310} \\n\\t()0-9]{0,24}", spacing in -1.0..1.0_f64) {
        let fonts = [font("Inter"), font("DejaVu Sans"), font("Amiri"), font("Droid Sans Fallback")];
        match layout(&text, &fonts, &spaced(spacing)) {
            Ok(set) => {
                prop_assert!(!set.shape.is_empty() && set.glyphs.iter().all(|g| text.is_char_boundary(g.cluster)));
                prop_assert!(set.glyphs.iter().all(|g| g.origin.is_finite()));
            }
            Err(TextError::Empty | TextError::MissingGlyphs { .. }) => {}
            Err(e) => prop_assert!(false, "{text:?}: {e}"),
        }
    }
}

#[test]
fn a_path_of_a_shape_fills_the_same_by_either_rule() {
    let set = set("B8&@", "Inter");
    let path = glyphlight::outline::bez_path(&set.shape);
    for rule in [FillRule::NonZero, FillRule::EvenOdd] {
        let again = glyphlight::outline::overlap::resolve(&path, rule).expect("it resolves");
        assert!((again.area() - set.shape.area()).abs() < 1e-9);
    }
}
