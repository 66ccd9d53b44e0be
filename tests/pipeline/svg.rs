//! SVG: every drawing in `svg/` against an independent painting of it; colours, order, clips, strokes, text.

use crate::mask::{SHIFTS, disagreement};
use crate::paint::base64;
use crate::painter::Picture;
use glam::DVec2;
use glyphlight::light::Layer;
use glyphlight::outline::FillRule::NonZero;
use glyphlight::outline::bez_path;
use glyphlight::outline::bundled::{DEFAULT_FAMILY, bundled};
use glyphlight::outline::svg::{Art, FontBytes, SvgOptions, svg};
use std::path::PathBuf;
use std::sync::Arc;

pub fn options(size: f64) -> SvgOptions {
    let fonts = bundled().iter().map(|f| Arc::new(f.bytes) as FontBytes).collect();
    SvgOptions { size, fonts, font_family: DEFAULT_FAMILY.to_owned(), ..SvgOptions::default() }
}

fn read(text: &str) -> Art {
    svg(text.as_bytes(), "test.svg", &options(1.0)).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn drawing(body: &str) -> String {
    format!(r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{body}</svg>"#)
}

fn drawings() -> Vec<(String, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("svg");
    let files = std::fs::read_dir(folder).expect("svg/ is there").map(|f| f.expect("a file").path());
    let mut drawings: Vec<_> = files
        .filter(|f| f.extension().is_some_and(|e| e == "svg"))
        .map(|f| (f.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read_to_string(&f).unwrap()))
        .collect();
    drawings.sort();
    assert!(drawings.len() >= 12, "{} drawings", drawings.len());
    drawings
}

fn tree(text: &str) -> usvg::Tree {
    let mut fonts = usvg::fontdb::Database::new();
    bundled().iter().for_each(|f| fonts.load_font_data(f.bytes.to_vec()));
    let options =
        usvg::Options { font_family: DEFAULT_FAMILY.to_owned(), fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(text, &options).expect("usvg reads it")
}

/// What differs between the light and the painting of the SVG `text`; `None` if nothing does.
///
/// In pixels of one colour the sum of the layers' colours by winding number is the painted colour within 1e-6, or within the
/// painter's 8 bits where there are gradients. Over the whole picture the colours by area add up within 0.3 % of the mean
/// colour (edges are antialiased in 8 bits).
fn difference(art: &Art, text: &str) -> Option<String> {
    let tree = tree(text);
    let gradients = tree.linear_gradients().len() + tree.radial_gradients().len() > 0;
    let tolerance = if gradients { 0.02 } else { 1e-6 };
    let longer = f64::from(tree.size().width().max(tree.size().height()));
    let pictures = SHIFTS.map(|shift| Picture::paint(&tree, 640.0 / longer, shift));
    let picture = &pictures[0];
    let metres = art.size.max_element() / (longer * picture.scale);
    let mut flat = 0;
    for y in (1..picture.height - 1).step_by(5) {
        for x in (1..picture.width - 1).step_by(5) {
            if !picture.is_flat(x, y, tolerance) {
                continue;
            }
            flat += 1;
            let centre = DVec2::new(x as f64 + 0.5 - SHIFTS[0].0, y as f64 + 0.5 - SHIFTS[0].1);
            let p = centre * DVec2::new(metres, -metres) + art.size * DVec2::new(-0.5, 0.5);
            let mut sum = [0.0; 4];
            for layer in &art.layers {
                let winding = layer.shape.winding(p);
                if winding != 0 && winding != 1 {
                    return Some(format!("{} winds {winding} times about {p}", layer.element));
                }
                let [r, g, b] = layer.color;
                let there = layer.picture.as_ref().map(|picture| picture.sample(p).as_dvec4().to_array());
                let color = there.unwrap_or([r, g, b, layer.opacity]);
                sum = std::array::from_fn(|k| sum[k] + f64::from(winding) * color[k]);
            }
            let painted = picture.pixels[y * picture.width + x];
            if sum.iter().zip(painted).any(|(a, b)| (a - b).abs() > tolerance) {
                return Some(format!("pixel {x}, {y} shines {sum:?}, painted {painted:?}"));
            }
        }
    }
    assert!(flat > 100, "{flat} pixels of one colour are too few to judge by");
    for k in 0..4 {
        let channel = |c: [f64; 3], a: f64| if k < 3 { c[k] } else { a };
        let light: f64 = art.layers.iter().map(|l| channel(l.color, l.opacity) * l.shape.area()).sum();
        let painted: f64 = pictures.iter().flat_map(|p| &p.pixels).map(|p| p[k]).sum::<f64>() * metres * metres
            / pictures.len() as f64;
        if (light - painted).abs() > 3e-3 * painted + 1e-9 {
            return Some(format!("channel {k} sums to {light}, painted {painted}"));
        }
    }
    None
}

#[test]
fn every_drawing_shines_as_it_is_painted() {
    for (name, text) in drawings() {
        let art = read(&text);
        assert_eq!(difference(&art, &text), None, "{name}");
        assert_eq!(art.warnings, [], "{name}");
    }
}

#[test]
fn every_layer_agrees_with_its_mask() {
    for (name, text) in drawings() {
        for layer in read(&text).layers {
            assert_eq!(
                disagreement(&layer.shape, &bez_path(&layer.shape), NonZero, 11),
                None,
                "{name}, {}",
                layer.element
            );
        }
    }
}

#[test]
fn the_painting_refuses_wrong_light() {
    let text = drawings().into_iter().find(|(name, _)| name == "harbour.svg").expect("harbour.svg").1;
    let art = read(&text);
    assert_eq!(difference(&art, &text), None);
    let lit_by = |changed: &str| difference(&read(changed), &text);
    let swapped = text.replace(r##"<circle id="halo" cx="228" cy="72" r="52" fill="#ffb347" opacity="0.35"/>"##, "");
    assert_ne!(swapped, text);
    assert!(lit_by(&swapped).is_some(), "an element is missing");
    assert!(lit_by(&text.replace("opacity=\"0.35\"", "opacity=\"0.36\"")).is_some(), "opacity");
    assert!(
        lit_by(&text.replace("id=\"reflections\" opacity=\"0.5\"", "fill-opacity=\"0.5\"")).is_some(),
        "group opacity"
    );
    assert!(lit_by(&text.replace("M0 120C40", "M0 110C40")).is_some(), "a point moved");
    assert!(lit_by(&text.replace("stroke-width=\"5\"", "stroke-width=\"9\"")).is_some(), "stroke width");
    let order = text.replace("<rect id=\"water\"", "<rect id=\"w\"/><rect id=\"water\"");
    assert_eq!(lit_by(&order), None, "an element that draws nothing changes nothing");
    let water = text.lines().find(|line| line.contains("id=\"water\"")).expect("water");
    let water_last = text.replace(water, "").replace("</svg>", &format!("{water}</svg>"));
    assert!(lit_by(&water_last).is_some(), "order");
    let mut upside_down = art.clone();
    for layer in &mut upside_down.layers {
        layer.shape = layer.shape.transformed(glam::DAffine2::from_scale(DVec2::new(1.0, -1.0)));
    }
    assert!(difference(&upside_down, &text).is_some(), "upside down");
}

#[test]
fn the_picture_is_centred_scaled_and_turned_over() {
    let text = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="10 20 200 100"><rect x="10" y="20" width="100" height="25" fill="#fff"/></svg>"##;
    let art = svg(text.as_bytes(), "t", &options(3.0)).unwrap();
    assert!((art.size - DVec2::new(3.0, 1.5)).length() < 1e-6, "{}", art.size);
    let bounds = art.layers[0].shape.bounds();
    assert!((bounds.min - DVec2::new(-1.5, 0.375)).length() < 1e-6, "{bounds:?}");
    assert!((bounds.max - DVec2::new(0.0, 0.75)).length() < 1e-6, "{bounds:?}");
    for size in [1e-4, 1e4] {
        let art = svg(text.as_bytes(), "t", &options(size)).unwrap();
        assert!((art.layers[0].shape.area() / (size * size) - 0.0625).abs() < 1e-7, "{size}");
    }
    assert!((art.layers[0].shape.area() - 1.5 * 0.375).abs() < 1e-6);
}

#[test]
fn colours_are_linear_and_premultiplied() {
    let art = read(&drawing(r##"<rect width="50" height="50" fill="#bc0080" fill-opacity="0.5" opacity="0.5"/>"##));
    let layer = &art.layers[0];
    // sRGB 188/255 is 0.5029 linear, 128/255 is 0.2159 (IEC 61966-2-1).
    for (value, expected) in layer.color.iter().zip([0.25 * 0.502_886, 0.0, 0.25 * 0.215_861]) {
        assert!((value - expected).abs() < 1e-6, "{:?}", layer.color);
    }
    assert!((layer.opacity - 0.25).abs() < 1e-9);
}

#[test]
fn an_opaque_cover_hides_and_equal_colours_join() {
    let art = read(&drawing(
        r##"<circle cx="50" cy="50" r="20" fill="#f00"/><rect width="30" height="9" fill="#0f0"/>
            <rect x="60" width="30" height="9" fill="#0f0"/><rect y="25" width="100" height="50" fill="#00f"/>"##,
    ));
    assert_eq!(art.layers.len(), 2, "{:?}", art.layers.iter().map(|l| &l.element).collect::<Vec<_>>());
    assert_eq!(art.layers[0].shape.contours().len(), 2);
}

#[test]
fn strokes_have_the_areas_that_caps_joins_and_dashes_give_them() {
    let pi = std::f64::consts::PI;
    let area = |attributes: &str| {
        let text = drawing(&format!("<path fill='none' stroke='#fff' stroke-width='4' {attributes}/>"));
        read(&text).layers.iter().map(|l| l.shape.area()).sum::<f64>() * 1e4
    };
    let cases = [
        ("d='M10 50H90'", 320.0),
        ("d='M10 50H90' stroke-linecap='square'", 336.0),
        ("d='M10 50H90' stroke-linecap='round'", 320.0 + 4.0 * pi),
        ("d='M10 50H90' stroke-dasharray='10 10'", 160.0),
        ("d='M10 50H90' stroke-dasharray='10 10' stroke-dashoffset='5'", 160.0),
        ("d='M10 50H90' stroke-dasharray='10 10' stroke-linecap='square'", 224.0),
        ("d='M10 50H85' stroke-dasharray='0 20' stroke-linecap='round'", 4.0 * 4.0 * pi),
        ("d='M50 50h0' stroke-linecap='round'", 4.0 * pi),
        ("d='M10 50H50V90' stroke-linejoin='miter'", 320.0 + 4.0 - 4.0),
        ("d='M10 50H50V90' stroke-linejoin='bevel'", 320.0 + 2.0 - 4.0),
        ("d='M10 50H50V90' stroke-linejoin='miter' stroke-miterlimit='1'", 320.0 + 2.0 - 4.0),
        ("d='M10 50H50V90' stroke-linejoin='round'", 320.0 + pi - 4.0),
        ("d='M20 20H80V80H20Z'", 4.0 * 60.0 * 4.0),
        ("d='M10 50H90' transform='translate(0 25) scale(1 .5)'", 160.0),
    ];
    for (attributes, expected) in cases {
        let found = area(attributes);
        assert!((found - expected).abs() < 2e-3 * expected, "{attributes}: {found}, not {expected}");
    }
    assert!((area("d='M10 50H90'") - 321.0).abs() > 0.5);
}

#[test]
fn the_painting_refuses_wrong_gradients() {
    let text = drawings().into_iter().find(|(name, _)| name == "sunset.svg").expect("sunset.svg").1;
    assert_eq!(difference(&read(&text), &text), None);
    let changes = [
        ("#ff5e62", "#ff8e62"),
        ("offset=\"0.6\"", "offset=\"0.5\""),
        ("x2=\"0\" y2=\"1\"", "x2=\"0.3\" y2=\"1\""),
        ("stop-opacity=\"0.5\"", "stop-opacity=\"0.6\""),
        ("<radialGradient id=\"glow\">", "<radialGradient id=\"glow\" fx=\"0.3\">"),
        ("width=\"14\" height=\"3\"", "width=\"14\" height=\"4\""),
        ("id=\"shimmer\" width=\"20\"", "id=\"shimmer\" x=\"5\" width=\"20\""),
    ];
    for (from, to) in changes {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        assert!(difference(&read(&changed), &text).is_some(), "{from} → {to}");
    }
}

#[test]
fn gradients_patterns_and_images_have_their_mean() {
    let body = r##"<defs><linearGradient id="g"><stop stop-color="#fff"/><stop offset="1" stop-color="#fff" stop-opacity="0"/></linearGradient>
        <pattern id="p" width="10" height="10" patternUnits="userSpaceOnUse"><rect width="5" height="10" fill="#f00"/><rect x="5" width="5" height="5" fill="#00f"/></pattern></defs>
        <rect id="a" width="30" height="30" fill="url(#g)"/><rect id="b" x="50" width="30" height="30" fill="url(#p)"/>
        <image id="c" y="50" width="40" height="20" href="data:image/png;base64,PNG"/>"##;
    let mut png = std::io::Cursor::new(Vec::new());
    let pixels =
        image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba(if x == 0 { [255, 0, 0, 255] } else { [0, 255, 0, 0] }));
    pixels.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let art = read(&drawing(&body.replace("PNG", &base64(png.get_ref()))));
    assert_eq!(art.warnings, []);
    let means: Vec<_> = art.layers.iter().map(|l| (l.color, l.opacity, l.shape.area() * 1e4)).collect();
    // The pattern is two layers of plain colours: half of nine tiles, a quarter of each.
    let red = ([1.0, 0.0, 0.0], 1.0, 450.0);
    let blue = ([0.0, 0.0, 1.0], 1.0, 225.0);
    let expected = [([0.5, 0.5, 0.5], 0.5, 900.0), red, blue, ([0.5, 0.0, 0.0], 0.5, 800.0)];
    assert_eq!(means.len(), expected.len());
    for ((color, opacity, area), (c, o, a)) in means.iter().zip(expected) {
        let off = color.iter().zip(c).map(|(x, y)| (x - y).abs()).fold((opacity - o).abs(), f64::max);
        assert!(off < 1e-3 && (area - a).abs() < 1e-3, "{means:?}");
    }
    let pictures: Vec<_> = art.layers.iter().map(|l| l.picture.is_some()).collect();
    assert_eq!(pictures, [true, false, false, true]);
    // Without its own colours, a layer shines at its mean opacity.
    let plain: Vec<_> = art.layers.into_iter().map(|l| Layer::of_art(l, false)).collect();
    assert!((plain[0].radiance - 0.5).abs().max_element() < 1e-3 && plain.iter().all(|l| l.picture.is_none()));
}

#[test]
fn what_is_left_out_is_named() {
    let cases = [
        (r##"<foreignObject id="f"/>"##, "foreignObject \"f\"", "left out"),
        (r##"<use id="u" href="#none"/>"##, "use \"u\"", "#none"),
        (r##"<rect id="r" width="-5" height="5"/>"##, "rect \"r\"", "negative"),
        (
            r##"<g id="m" mask="url(#k)"><rect width="9" height="9"/></g><mask id="k"><rect width="9" height="9" fill="#fff"/></mask>"##,
            "g \"m\"",
            "mask",
        ),
        (
            r##"<g id="b" filter="url(#k)"><rect width="9" height="9"/></g><filter id="k"><feGaussianBlur stdDeviation="2"/></filter>"##,
            "g \"b\"",
            "filter",
        ),
        (r##"<rect id="c" clip-path="url(#gone)" width="9" height="9"/>"##, "rect \"c\"", "#gone"),
        (r##"<text id="t" font-family="Nowhere" y="50">A</text>"##, "font family \"Nowhere\"", "not among"),
        ("<text id='t' y='50'>\u{0378}</text>", "text \"t\"", "U+0378"),
        (r##"<image id="i" href="data:image/gif;base64,R0lGODlh"/>"##, "image \"i\"", "left out"),
        (r##"<image id="i" href="data:image/png;base64,R0lGODlh"/>"##, "embedded image", "left out"),
        (r##"<style>@import url(x.css);</style>"##, "style (line 1)", "not read"),
        (r##"<g style="mix-blend-mode:multiply" id="d"><rect width="9" height="9"/></g>"##, "g \"d\"", "multiply"),
    ];
    for (body, element, word) in cases {
        let art = read(&drawing(&format!("<rect width='50' height='50' fill='#fff'/>{body}")));
        let found = art.warnings.iter().any(|w| w.element == element && w.message.contains(word));
        assert!(found, "{body}: {:?}", art.warnings);
    }
    let text = drawing("<rect width='50' height='50' fill='#fff'/><text id='t' y='50'>A</text>");
    let art = svg(text.as_bytes(), "t", &SvgOptions::default()).unwrap();
    assert_eq!(art.warnings.len(), 1);
    assert!(
        art.warnings[0].element == "text \"t\"" && art.warnings[0].message.contains("no font"),
        "{:?}",
        art.warnings
    );
    assert_eq!(read(&text).warnings, []);
}
