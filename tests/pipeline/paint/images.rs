//! Embedded images and patterns: the right colour at the right place.

use super::{base64, drawing, linear, off, png, read, shown};
use crate::cases::Rng;
use crate::svg::options;
use glam::{DAffine2, DVec2, DVec4};
use glyphlight::outline::svg::svg;

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const WHITE: [u8; 4] = [255, 255, 255, 255];

fn color(pixel: [u8; 4]) -> DVec4 {
    linear(DVec4::from_array(pixel.map(|v| f64::from(v) / 255.0)))
}

/// Red and green above, blue and white below.
fn corners(side: u32) -> String {
    let half = side / 2;
    png(side, side, move |x, y| match (x < half, y < half) {
        (true, true) => RED,
        (false, true) => GREEN,
        (true, false) => BLUE,
        (false, false) => WHITE,
    })
}

#[test]
fn corners_land_where_the_transform_puts_them() {
    let data = corners(8);
    // From the image's 40 × 40 box at (30, 30).
    let transforms = [
        ("", DAffine2::IDENTITY),
        ("rotate(90 50 50)", about(DAffine2::from_angle(90_f64.to_radians()))),
        ("rotate(30 50 50)", about(DAffine2::from_angle(30_f64.to_radians()))),
        (
            "translate(100 0) scale(-1 1)",
            DAffine2::from_translation(DVec2::X * 100.0) * DAffine2::from_scale(DVec2::new(-1.0, 1.0)),
        ),
        (
            "translate(0 100) scale(1 -1)",
            DAffine2::from_translation(DVec2::Y * 100.0) * DAffine2::from_scale(DVec2::new(1.0, -1.0)),
        ),
        (
            "translate(-20 0) skewX(20)",
            DAffine2::from_cols(DVec2::X, DVec2::new(20_f64.to_radians().tan(), 1.0), DVec2::X * -20.0),
        ),
        ("scale(.5)", DAffine2::from_scale(DVec2::splat(0.5))),
    ];
    for (text, transform) in transforms {
        let art = read(&format!("<image x='30' y='30' width='40' height='40' transform='{text}' href='{data}'/>"));
        assert_eq!((art.layers.len(), art.warnings.len()), (1, 0), "{text}");
        let area = 0.16 * transform.matrix2.determinant().abs();
        assert!((art.layers[0].shape.area() - area).abs() < 1e-6, "{text}");
        for (x, y, pixel) in [(35.0, 35.0, RED), (65.0, 35.0, GREEN), (35.0, 65.0, BLUE), (65.0, 65.0, WHITE)] {
            let p = transform.transform_point2(DVec2::new(x, y));
            assert!(off(shown(&art, p), color(pixel)) < 1e-5, "{text}: {p} shines {}", shown(&art, p));
        }
        // Upside down it would be another picture.
        let flipped = transform.transform_point2(DVec2::new(35.0, 65.0));
        assert!(off(shown(&art, flipped), color(RED)) > 0.5);
    }
}

fn about(turn: DAffine2) -> DAffine2 {
    DAffine2::from_translation(DVec2::splat(50.0)) * turn * DAffine2::from_translation(DVec2::splat(-50.0))
}

#[test]
fn an_upright_image_keeps_its_own_texels() {
    let pixel = |x: u32, y: u32| [(x * 31 % 256) as u8, (y * 57 % 256) as u8, ((x ^ y) * 11 % 256) as u8, 255];
    let art = read(&format!("<image x='10' y='20' width='80' height='60' href='{}'/>", png(16, 12, pixel)));
    let picture = art.layers[0].picture.as_ref().unwrap();
    assert_eq!((picture.width, picture.height), (16, 12));
    for (i, texel) in picture.texels.iter().enumerate() {
        let expected = color(pixel(i as u32 % 16, i as u32 / 16));
        assert!(off(texel.as_dvec4(), expected) < 1e-6, "{i}");
        assert!(off(texel.as_dvec4(), color(pixel(i as u32 % 16 + 1, i as u32 / 16))) > 1e-3);
    }
    // Cut to its lower right quarter, it keeps those texels only.
    let clip = "<clipPath id='c'><rect x='50' y='50' width='99' height='99'/></clipPath>";
    let image =
        format!("<image clip-path='url(#c)' x='10' y='20' width='80' height='60' href='{}'/>", png(16, 12, pixel));
    let cut = read(&format!("{clip}{image}"));
    let picture = cut.layers[0].picture.as_ref().unwrap();
    assert_eq!((picture.width, picture.height), (8, 6));
    assert!(off(picture.texels[0].as_dvec4(), color(pixel(8, 6))) < 1e-6);
}

/// Pixels much smaller than what is kept of them are averaged, in linear light.
#[test]
fn small_pixels_are_averaged() {
    let checks = png(2560, 2560, |x, y| if (x + y) % 2 == 0 { WHITE } else { [0, 0, 0, 255] });
    for transform in ["", "rotate(37 50 50)"] {
        let art =
            read(&format!("<image x='30' y='30' width='40' height='40' transform='{transform}' href='{checks}'/>"));
        let mean = art.layers[0].color;
        assert!(mean.iter().all(|v| (v - 0.5).abs() < 1e-3), "{mean:?}");
        let mut rng = Rng(5);
        let worst = (0..500).map(|_| {
            let p = DVec2::new(rng.within(40.0, 60.0), rng.within(40.0, 60.0));
            off(shown(&art, p), DVec4::new(0.5, 0.5, 0.5, 1.0))
        });
        // 2560 texels into 2048: the checks beat, but no texel is black or white.
        assert!(worst.fold(0.0, f64::max) < 0.4);
    }
}

#[test]
fn alpha_and_clips_cut_images() {
    let half = png(64, 64, |x, _| if x < 32 { [255, 0, 0, 128] } else { [0, 255, 0, 0] });
    let body = format!(
        "<clipPath id='c'><circle cx='50' cy='50' r='30'/></clipPath><rect width='100' height='100' fill='#00f'/>
         <image clip-path='url(#c)' opacity='.5' width='100' height='100' href='{half}'/>"
    );
    let art = read(&body);
    let blue = color(BLUE);
    let faded = color([255, 0, 0, 128]) * 0.5;
    let cases = [
        (DVec2::new(30.0, 50.0), faded + blue * (1.0 - faded.w)),
        (DVec2::new(70.0, 50.0), blue),
        (DVec2::new(10.0, 10.0), blue),
    ];
    for (p, expected) in cases {
        assert!(off(shown(&art, p), expected) < 1e-6, "{p}: {}", shown(&art, p));
    }
    let disc: f64 = art.layers.iter().filter(|l| l.picture.is_some()).map(|l| l.shape.area()).sum();
    assert!((disc - 0.09 * std::f64::consts::PI).abs() < 1e-4, "{disc}");
    let total: f64 = art.layers.iter().map(|l| l.color[2] * l.shape.area()).sum();
    assert!((total - (1.0 - 0.5 * 0.09 * std::f64::consts::PI * faded.w)).abs() < 1e-3, "{total}");
}

/// `preserveAspectRatio`: cut to the box, or inside it.
#[test]
fn aspect_ratios_are_kept() {
    let wide = png(20, 10, |x, _| if x < 10 { RED } else { GREEN });
    let image = |aspect: &str| {
        read(&format!("<image x='20' y='20' width='40' height='40' preserveAspectRatio='{aspect}' href='{wide}'/>"))
    };
    for (aspect, area) in [("none", 0.16), ("xMidYMid", 0.08), ("xMidYMid slice", 0.16)] {
        let art = image(aspect);
        assert!((art.layers[0].shape.area() - area).abs() < 1e-6, "{aspect}");
        assert!(off(shown(&art, DVec2::new(25.0, 40.0)), color(RED)) < 1e-6, "{aspect}");
        assert!(off(shown(&art, DVec2::new(55.0, 40.0)), color(GREEN)) < 1e-6, "{aspect}");
    }
}

#[test]
fn images_that_mean_harm() {
    let red = png(1, 1, |_, _| RED);
    // Of one colour: no picture is needed.
    let one = read(&format!("<image width='50' height='50' href='{red}'/>"));
    assert!(one.layers[0].picture.is_none() && off(DVec4::from((one.layers[0].color.into(), 1.0)), color(RED)) < 1e-6);
    for body in ["transform='scale(0)'", "transform='scale(1 0)'", "width='0'", "transform='translate(1e30)'"] {
        let art = read(&format!("<rect width='9' height='9' fill='#fff'/><image height='50' {body} href='{red}'/>"));
        assert_eq!(art.layers.len(), 1, "{body}");
    }
    // A PNG that says it is 60000 × 60000.
    let mut huge = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\x06\0\0\0".to_vec();
    huge.extend(crc32(&huge[12..]).to_be_bytes());
    let data = format!("data:image/png;base64,{}", base64(&huge));
    let huge =
        format!("<rect width='9' height='9' fill='#fff'/><image id='i' width='9' height='9' x='50' href='{data}'/>");
    let fault = svg(drawing(&huge).as_bytes(), "t", &options(1.0)).unwrap_err().to_string();
    assert!(fault.contains("60000 pixels along a side") && fault.contains("limit of 16384"), "{fault}");
    // One that is cut off.
    let data = format!("data:image/png;base64,{}", base64(&png(4, 4, |_, _| RED).as_bytes()[..9]));
    let art = read(&format!("<rect width='9' height='9' fill='#fff'/><image width='9' height='9' href='{data}'/>"));
    assert_eq!(art.layers.len(), 1);
    assert!(art.warnings.iter().any(|w| w.message.contains("cannot be decoded")), "{:?}", art.warnings);
    // Nine that keep four million texels each.
    let many: String = (0..9)
        .map(|k| format!("<image width='9' height='9' href='{}'/>", png(2048, 2048, |_, _| [k, 0, 0, 255])))
        .collect();
    let fault = svg(drawing(&many).as_bytes(), "t", &options(1.0)).unwrap_err().to_string();
    assert!(fault.contains("texels of embedded images, more than the limit of 33554432"), "{fault}");
    let smooth =
        read(&format!("<image id='i' image-rendering='optimizeSpeed' width='9' height='9' href='{}'/>", corners(2)));
    assert!(
        smooth.warnings.iter().any(|w| w.element == "image \"i\"" && w.message.contains("smooth")),
        "{:?}",
        smooth.warnings
    );
}

/// The checksum of PNG chunks (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    })
}

#[test]
fn patterns_become_tiles() {
    let content = "<rect width='10' height='10' fill='#204080'/><rect x='2' y='1' width='5' height='3' fill='#f00' fill-opacity='.5'/>";
    let tile = |p: DVec2| {
        let base = color([0x20, 0x40, 0x80, 255]);
        let inside = p.x > 2.0 && p.x < 7.0 && p.y > 1.0 && p.y < 4.0;
        if inside { color(RED) * 0.5 + base * 0.5 } else { base }
    };
    let turn = DAffine2::from_angle(25_f64.to_radians()) * DAffine2::from_scale(DVec2::new(1.5, 0.8));
    let [a, b, c, d, ..] = turn.to_cols_array();
    for (attribute, transform) in
        [(String::new(), DAffine2::IDENTITY), (format!("patternTransform='matrix({a} {b} {c} {d} 0 0)'"), turn)]
    {
        let art = read(&format!(
            "<pattern id='p' x='3' y='4' width='10' height='10' patternUnits='userSpaceOnUse' {attribute}>{content}</pattern>
             <circle cx='50' cy='50' r='40' fill='url(#p)' fill-opacity='.5'/>"
        ));
        assert_eq!((art.layers.len(), art.warnings.len()), (2, 0), "one layer per colour");
        let mut rng = Rng(9);
        let mut red = 0;
        for _ in 0..1000 {
            let p = DVec2::new(rng.within(20.0, 80.0), rng.within(20.0, 80.0));
            let own = (transform.inverse().transform_point2(p) - DVec2::new(3.0, 4.0)).rem_euclid(DVec2::splat(10.0));
            let clear = |v: f64, edges: [f64; 4]| edges.iter().all(|e| (v - e).abs() > 1e-3);
            if p.distance(DVec2::splat(50.0)) < 39.0
                && clear(own.x, [0.0, 2.0, 7.0, 10.0])
                && clear(own.y, [0.0, 1.0, 4.0, 10.0])
            {
                let expected = tile(own) * 0.5;
                red += i32::from(expected.x > 0.1);
                assert!(off(shown(&art, p), expected) < 1e-6, "{p}: {}", shown(&art, p));
            }
        }
        assert!(red > 50);
        let area: f64 = art.layers.iter().map(|l| l.shape.area()).sum();
        assert!((area - 0.16 * std::f64::consts::PI).abs() < 1e-3, "{area}");
    }
}

#[test]
fn patterns_of_gradients_and_of_too_many_tiles() {
    let fade = "<linearGradient id='g' gradientUnits='userSpaceOnUse' x2='20'><stop stop-color='#000'/><stop offset='1' stop-color='#fff'/></linearGradient>";
    let pattern = |side: f64, content: &str| {
        format!(
            "{fade}<pattern id='p' width='{side}' height='{side}' patternUnits='userSpaceOnUse'>{content}</pattern><rect id='r' width='100' height='100' fill='url(#p)'/>"
        )
    };
    let art = read(&pattern(20.0, "<rect width='20' height='20' fill='url(#g)'/>"));
    assert_eq!((art.layers.len(), art.warnings.len()), (25, 0));
    for x in [3.0, 27.0, 45.0, 99.0] {
        let t = (x / 20.0_f64).fract();
        assert!(off(shown(&art, DVec2::new(x, 33.0)), linear(DVec4::new(t, t, t, 1.0))) < 2e-3, "{x}");
    }
    let checks = "<path d='M0 0h.2v.2h-.2zM.2 .2h.2v.2h-.2z' fill='#fff'/>";
    let fine = read(&pattern(0.4, checks));
    assert_eq!(fine.layers.len(), 1);
    assert!(fine.layers[0].color.iter().all(|c| (c - 0.5).abs() < 1e-5) && (fine.layers[0].opacity - 0.5).abs() < 1e-5);
    let said = |w: &glyphlight::outline::Warning| {
        w.element == "rect \"r\"" && w.message.contains("pattern \"p\" is repeated 62500 times")
    };
    assert!(fine.warnings.iter().any(said), "{:?}", fine.warnings);
    let faded = read(&pattern(5.0, "<rect width='5' height='5' fill='url(#g)'/>"));
    let mean = (0..1000)
        .map(|i| linear(DVec4::splat((f64::from(i) + 0.5) / 4000.0)).with_w(1.0).x / ((f64::from(i) + 0.5) / 4000.0))
        .sum::<f64>()
        / 1000.0;
    assert!((faded.layers[0].color[0] - mean).abs() < 1e-3, "{:?} {mean}", faded.layers[0].color);
    assert!(
        faded.warnings[0].message.contains("with gradients or pictures is repeated 400 times"),
        "{:?}",
        faded.warnings
    );
    let flat = read(&format!(
        "{}<rect width='9' height='9' fill='#fff'/>",
        pattern(5.0, checks).replace("<pattern", "<pattern patternTransform='scale(0)'")
    ));
    assert!(
        flat.warnings.iter().any(|w| w.element == "pattern \"p\"" && w.message.contains("scale(0) flattens it")),
        "{:?}",
        flat.warnings
    );
}
