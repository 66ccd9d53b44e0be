//! Colour at the edges: the sRGB transfer, `#rrggbb`, luminance. Everything between the edges is linear Rec.709.

/// Luminance Y of linear Rec.709 per unit of R, G and B (ITU-R BT.709-6, item 3.2); they sum to 1.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Linear light (0 to 1) of an sRGB-encoded component (0 to 1). IEC 61966-2-1:1999, eq. 5 and 6.
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// sRGB-encoded component (0 to 1) of linear light (0 to 1). IEC 61966-2-1:1999, eq. 9 and 10.
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Luminance of a linear Rec.709 colour, in the unit of its components.
pub fn luminance(color: [f64; 3]) -> f64 {
    color.iter().zip(LUMINANCE).map(|(c, y)| c * y).sum()
}

/// Linear Rec.709 of `#rrggbb` (sRGB, hexadecimal), or nothing where `text` isn't of that form.
pub fn parse_hex(text: &str) -> Option<[f64; 3]> {
    let digits = text.strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let bits = u32::from_str_radix(digits, 16).ok()?;
    Some([bits >> 16, bits >> 8, bits].map(|b| srgb_decode(f64::from(b & 0xff) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_branches_of_the_transfer_meet() {
        // The standard's rounded constants leave a step of at most 1e-7 where the branches meet.
        assert!((12.92 * 0.003_130_8 - (1.055 * 0.003_130_8_f64.powf(1.0 / 2.4) - 0.055)).abs() < 1e-7);
        assert!((0.04045 / 12.92 - ((0.04045_f64 + 0.055) / 1.055).powf(2.4)).abs() < 1e-7);
        assert_eq!((srgb_encode(0.0), srgb_decode(0.0), srgb_decode(1.0)), (0.0, 0.0, 1.0));
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_transfer_has_its_published_values() {
        // Mid grey: sRGB 128/255 is 0.2158605 of linear light; 18 % grey encodes to 0.4613561.
        assert!((srgb_decode(128.0 / 255.0) - 0.215_860_5).abs() < 1e-7);
        assert!((srgb_encode(0.18) - 0.461_356_1).abs() < 1e-7);
        // A pure power 2.2 is near but not the same: the test tells them apart.
        assert!((0.18_f64.powf(1.0 / 2.2) - 0.461_356_1).abs() > 1e-3);
    }

    #[test]
    fn every_byte_round_trips() {
        for byte in 0..=255u8 {
            let there = srgb_encode(srgb_decode(f64::from(byte) / 255.0)) * 255.0;
            assert_eq!(there.round(), f64::from(byte));
        }
    }

    #[test]
    fn hex_colours_are_srgb() {
        assert_eq!(parse_hex("#ff0000"), Some([1.0, 0.0, 0.0]));
        assert_eq!(parse_hex("#0000FF"), Some([0.0, 0.0, 1.0]));
        assert!((parse_hex("#808080").unwrap()[1] - 0.215_860_5).abs() < 1e-7);
        for bad in ["", "#", "#fff", "ff0000", "#ff00000", "#gg0000", "#+f0000", "#ffé00"] {
            assert_eq!(parse_hex(bad), None, "{bad}");
        }
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-15);
        assert!(luminance([0.0, 1.0, 0.0]) > luminance([1.0, 0.0, 1.0]));
    }
}
