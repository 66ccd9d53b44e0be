//! What a `glyf` entry holds, looked up before it is outlined.
//!
//! The outline reader follows component references without a budget (32 levels of two components each would never
//! end), places point-matched and scaled-offset components wrongly, returns the same nothing for a blank glyph
//! as for a malformed one, and leaves out the shift that puts a glyph's left edge on its side bearing.
//! OpenType specification, "glyf" and "loca" tables.

/// Most components, nested ones counted, that one glyph may have.
const MAX_COMPONENTS: usize = 256;

const ARGS_ARE_WORDS: u16 = 0x0001;
const ARGS_ARE_XY: u16 = 0x0002;
const HAS_SCALE: u16 = 0x0008;
const MORE_COMPONENTS: u16 = 0x0020;
const HAS_XY_SCALE: u16 = 0x0040;
const HAS_TWO_BY_TWO: u16 = 0x0080;
const USE_MY_METRICS: u16 = 0x0200;
const SCALED_OFFSET: u16 = 0x0800;

/// What the walk over a glyph and its components finds.
#[derive(Debug, PartialEq)]
pub(super) struct Entry {
    /// Whether there is any contour.
    pub draws: bool,
    /// The glyph whose metrics hold: a component may lend its own.
    pub metrics_glyph: u16,
    /// Left edge of that glyph, font units.
    pub x_min: i16,
}

/// The raw tables.
pub(super) struct Glyf<'a> {
    glyf: &'a [u8],
    loca: &'a [u8],
    /// Whether `loca` holds 32-bit offsets.
    long_offsets: bool,
}

impl<'a> Glyf<'a> {
    pub fn new(head: &[u8], loca: &'a [u8], glyf: &'a [u8]) -> Self {
        Self { glyf, loca, long_offsets: u16_at(head, 50) == Ok(1) }
    }

    /// Walks over `glyph` and its components, or says what is wrong with one of them.
    pub fn entry(&self, glyph: u16) -> Result<Entry, String> {
        let mut draws = false;
        let mut pending = vec![glyph];
        let mut visited = 0;
        while let Some(glyph) = pending.pop() {
            visited += 1;
            if visited > MAX_COMPONENTS {
                return Err(format!("has more than {MAX_COMPONENTS} components"));
            }
            let Some(data) = self.data(glyph)? else { continue };
            match i16_at(data, 0)? {
                contours if contours < 0 => drop(components(data, &mut pending)?),
                0 => {}
                contours => draws |= u16_at(data, 10 + 2 * (contours as usize - 1))? > 0,
            }
        }
        // The walk has ended, so no glyph lies inside itself.
        let mut entry = Entry { draws, metrics_glyph: glyph, x_min: 0 };
        while let Some(data) = self.data(entry.metrics_glyph)? {
            entry.x_min = i16_at(data, 2)?;
            let lender = if i16_at(data, 0)? < 0 { components(data, &mut Vec::new())? } else { None };
            let Some(lender) = lender else { break };
            entry.metrics_glyph = lender;
        }
        Ok(entry)
    }

    /// The glyph's entry; `None` if it is empty.
    fn data(&self, glyph: u16) -> Result<Option<&'a [u8]>, &'static str> {
        let offset = |i: usize| {
            Ok::<_, &str>(if self.long_offsets {
                (usize::from(u16_at(self.loca, 4 * i)?) << 16) + usize::from(u16_at(self.loca, 4 * i + 2)?)
            } else {
                2 * usize::from(u16_at(self.loca, 2 * i)?)
            })
        };
        let (start, end) = (offset(glyph.into())?, offset(usize::from(glyph) + 1)?);
        if start == end {
            return Ok(None);
        }
        self.glyf.get(start..end).map(Some).ok_or("lies outside the glyf table")
    }
}

/// Pushes the glyphs that a composite entry refers to; the last that lends its metrics is returned.
fn components(data: &[u8], pending: &mut Vec<u16>) -> Result<Option<u16>, String> {
    let mut lender = None;
    let mut at = 10;
    for _ in 0..=MAX_COMPONENTS {
        let flags = u16_at(data, at)?;
        let glyph = u16_at(data, at + 2)?;
        pending.push(glyph);
        if flags & USE_MY_METRICS != 0 {
            lender = Some(glyph);
        }
        if flags & ARGS_ARE_XY == 0 {
            return Err("places a component by matching points, which is not supported".into());
        }
        let transform = match flags & (HAS_SCALE | HAS_XY_SCALE | HAS_TWO_BY_TWO) {
            0 => 0,
            HAS_SCALE => 2,
            HAS_XY_SCALE => 4,
            _ => 8,
        };
        if flags & SCALED_OFFSET != 0 && transform != 0 {
            return Err("has a component with a scaled offset, which is not supported".into());
        }
        if flags & MORE_COMPONENTS == 0 {
            return Ok(lender);
        }
        at += 4 + if flags & ARGS_ARE_WORDS != 0 { 4 } else { 2 } + transform;
    }
    Err(format!("has more than {MAX_COMPONENTS} components"))
}

fn u16_at(data: &[u8], at: usize) -> Result<u16, &'static str> {
    let b = data.get(at..at + 2).ok_or("is cut short")?;
    Ok(u16::from_be_bytes([b[0], b[1]]))
}

fn i16_at(data: &[u8], at: usize) -> Result<i16, &'static str> {
    u16_at(data, at).map(|v| v as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A font of three glyphs: 0 empty, 1 a triangle with its left edge at 7, 2 a composite of `component` at 40.
    fn entry(flags: u16, component: u16, glyph: u16) -> Result<Entry, String> {
        let mut glyf = vec![0, 1, 0, 7, 0, 0, 0, 0, 0, 0, 0, 2];
        let triangle = glyf.len();
        glyf.extend([0xff, 0xff, 0, 40, 0, 0, 0, 0, 0, 0]);
        glyf.extend(flags.to_be_bytes());
        glyf.extend(component.to_be_bytes());
        glyf.extend([0, 0]);
        let loca: Vec<u8> = [0, 0, triangle, glyf.len()].iter().flat_map(|&o| (o as u32).to_be_bytes()).collect();
        Glyf { glyf: &glyf, loca: &loca, long_offsets: true }.entry(glyph)
    }

    #[test]
    fn tells_blank_from_drawn() {
        assert_eq!(entry(ARGS_ARE_XY, 1, 0), Ok(Entry { draws: false, metrics_glyph: 0, x_min: 0 }));
        assert_eq!(entry(ARGS_ARE_XY, 1, 1), Ok(Entry { draws: true, metrics_glyph: 1, x_min: 7 }));
        assert_eq!(entry(ARGS_ARE_XY, 1, 2), Ok(Entry { draws: true, metrics_glyph: 2, x_min: 40 }));
        assert_eq!(entry(ARGS_ARE_XY, 0, 2), Ok(Entry { draws: false, metrics_glyph: 2, x_min: 40 }));
    }

    #[test]
    fn a_component_lends_its_metrics() {
        let lent = entry(ARGS_ARE_XY | USE_MY_METRICS, 1, 2);
        assert_eq!(lent, Ok(Entry { draws: true, metrics_glyph: 1, x_min: 7 }));
    }

    #[test]
    fn refuses_what_would_hang_or_be_misplaced() {
        assert!(entry(ARGS_ARE_XY, 2, 2).unwrap_err().contains("256 components"), "a glyph inside itself");
        assert!(entry(0, 1, 2).unwrap_err().contains("matching points"));
        assert!(entry(ARGS_ARE_XY | SCALED_OFFSET | HAS_SCALE, 1, 2).unwrap_err().contains("scaled offset"));
        assert!(entry(ARGS_ARE_XY | MORE_COMPONENTS, 1, 2).unwrap_err().contains("cut short"));
        assert!(entry(ARGS_ARE_XY, 7, 2).unwrap_err().contains("cut short"), "a component that does not exist");
    }
}
