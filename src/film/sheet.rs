//! A contact sheet: many pictures small, each with its label below.

use super::{FilmError, Pending, png};
use crate::color::{srgb_decode, srgb_encode};
use crate::outline::font::{Font, Instance};
use crate::shape::Shape;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Transform};

/// Largest side of the sheet, pixels.
const MOST: u32 = 8192;
/// Side of a picture's place, pixels, where there is room.
const SIDE: u32 = 192;
/// Pixels between places.
const GAP: u32 = 10;
/// Pixels of a label's line, and those of its em.
const LINE: u32 = 18;
const EM: f64 = 11.5;
/// Places smaller than this have no labels, pixels.
const UNLABELLED: u32 = 48;

const GROUND: [u8; 3] = [19, 20, 22];
const EMPTY: [u8; 3] = [38, 40, 44];
const TEXT: [u8; 3] = [163, 168, 175];
const FAULT: [u8; 3] = [224, 108, 92];

/// A place of the sheet.
#[derive(Clone, Debug)]
pub struct Place {
    /// What stands below.
    pub label: String,
    /// What it shows.
    pub view: View,
}

/// What a place shows.
#[derive(Clone, Debug)]
pub enum View {
    /// A picture: width, height, and its texels from the top, sRGB with red in the lowest byte.
    Picture(u32, u32, Vec<u32>),
    /// A cross: there is no picture.
    Failed,
    /// Nothing: there is no picture yet.
    Missing,
}

/// How the places lie.
struct Grid {
    columns: u32,
    rows: u32,
    side: u32,
    line: u32,
}

impl Grid {
    /// A grid a little wider than high, as large as [`MOST`] allows.
    fn of(count: usize) -> Self {
        let count = count.max(1) as f64;
        let columns = (count * 1.3).sqrt().ceil();
        let rows = (count / columns).ceil();
        let room = (f64::from(MOST - GAP) / columns.max(rows)) as u32;
        let side = room.saturating_sub(GAP + LINE).clamp(8, SIDE);
        let line = if side >= UNLABELLED { LINE } else { 0 };
        Self { columns: columns as u32, rows: rows as u32, side, line }
    }

    fn size(&self) -> [u32; 2] {
        [self.columns * (self.side + GAP) + GAP, self.rows * (self.side + self.line + GAP) + GAP]
    }

    fn origin(&self, index: usize) -> [u32; 2] {
        let (x, y) = (index as u32 % self.columns, index as u32 / self.columns);
        [GAP + x * (self.side + GAP), GAP + y * (self.side + self.line + GAP)]
    }
}

/// Writes the sheet of `count` places as a PNG; `place` gives each by its index, and is asked for one after the other by several threads.
///
/// # Errors
/// What the system or the encoder says.
pub fn write(path: &Path, count: usize, place: impl Fn(usize) -> Place + Sync) -> Result<(), FilmError> {
    let grid = Grid::of(count);
    let [width, height] = grid.size();
    let size_error = || FilmError::Size { path: path.into(), width, height, layers: [0; 3] };
    let mut sheet = Pixmap::new(width, height).ok_or_else(size_error)?;
    sheet.fill(color(GROUND));
    let font = Font::bundled("Inter").ok();
    let letters = Letters::new(font.as_ref());
    // A row at a time: no more pictures are in memory than a row has.
    for first in (0..count).step_by(grid.columns as usize) {
        let row = first..count.min(first + grid.columns as usize);
        let small: Vec<_> = row
            .into_par_iter()
            .map(|index| {
                let Place { label, view } = place(index);
                let fault = matches!(view, View::Failed);
                let text = if grid.line > 0 { label.as_str() } else { "" };
                (index, thumbnail(&view, grid.side), letters.label(text, f64::from(grid.side)), fault)
            })
            .collect();
        for (index, rgb, label, fault) in small {
            let [x, y] = grid.origin(index);
            for (i, pixel) in rgb.chunks_exact(3).enumerate() {
                let (px, py) = (x + i as u32 % grid.side, y + i as u32 / grid.side);
                let at = (py * width + px) as usize * 4;
                sheet.data_mut()[at..at + 3].copy_from_slice(pixel);
            }
            if fault {
                cross(&mut sheet, [x, y], grid.side);
            }
            let base = DVec2::new(f64::from(x), f64::from(y + grid.side) + 0.72 * f64::from(grid.line));
            for (pen, letter) in label {
                let base = base + DVec2::new(pen, 0.0);
                write_letter(&mut sheet, &letter.shape, base, if fault { FAULT } else { TEXT });
            }
        }
    }
    let rgb: Vec<u8> = sheet.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    Pending::new(path, |out| png::encode_rgb(&rgb, width, height, out, path))?.keep()
}

/// A picture averaged by area in linear light, fitted into a square of `side` pixels; RGB.
fn thumbnail(view: &View, side: u32) -> Vec<u8> {
    let blank = if matches!(view, View::Picture(..)) { [0; 3] } else { EMPTY };
    let mut rgb: Vec<u8> = blank.iter().copied().cycle().take((side * side * 3) as usize).collect();
    let View::Picture(width, height, texels) = view else { return rgb };
    let (width, height) = (*width, *height);
    let scale = f64::from(side) / f64::from(width.max(height));
    let fitted = [width, height].map(|s| ((f64::from(s) * scale).round() as u32).clamp(1, side));
    let offset = fitted.map(|s| (side - s) / 2);
    let linear: Vec<f64> = (0..=255).map(|v| srgb_decode(f64::from(v) / 255.0)).collect();
    // The part of the texels `from..to` that each pixel covers.
    let span = |i: u32, pixels: u32, texels: u32| {
        let at = |i: u32| f64::from(i) * f64::from(texels) / f64::from(pixels);
        let (from, to) = (at(i), at(i + 1));
        (from.floor() as u32..(to.ceil() as u32).min(texels))
            .map(move |t| (t, (to.min(f64::from(t + 1)) - from.max(f64::from(t))).max(0.0)))
    };
    for y in 0..fitted[1] {
        for x in 0..fitted[0] {
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for (ty, wy) in span(y, fitted[1], height) {
                for (tx, wx) in span(x, fitted[0], width) {
                    let [r, g, b, _] = texels[(ty * width + tx) as usize].to_le_bytes();
                    sum += DVec3::from([r, g, b].map(|v| linear[usize::from(v)])) * (wx * wy);
                    weight += wx * wy;
                }
            }
            let mean = (sum / weight).to_array().map(|v| (srgb_encode(v) * 255.0).round() as u8);
            let at = (((y + offset[1]) * side + x + offset[0]) * 3) as usize;
            rgb[at..at + 3].copy_from_slice(&mean);
        }
    }
    rgb
}

/// A letter of a label.
#[derive(Debug)]
struct Letter {
    /// Its outline, em, y up.
    shape: Shape,
    /// From its pen to the next, em.
    advance: f64,
}

/// The letters of labels, each made once: set side by side, as what nobody reads at length may be.
struct Letters<'a> {
    font: Option<Instance<'a>>,
    made: Mutex<HashMap<char, Option<Arc<Letter>>>>,
}

/// Letters with the places of their pens, pixels.
type Label = Vec<(f64, Arc<Letter>)>;

impl<'a> Letters<'a> {
    fn new(font: Option<&'a Font>) -> Self {
        Self { font: font.and_then(|font| font.instance(&[]).ok()), made: Mutex::default() }
    }

    /// A letter, or the question mark where the font has none.
    fn of(&self, letter: char) -> Option<Arc<Letter>> {
        if let Some(made) = self.made.lock().unwrap_or_else(PoisonError::into_inner).get(&letter) {
            return made.clone();
        }
        let font = self.font.as_ref()?;
        let glyph = font.glyph_index(letter).or_else(|| font.glyph_index('?'));
        let make = |glyph| Some(Arc::new(Letter { shape: font.glyph(glyph).ok()?, advance: font.advance(glyph) }));
        let made = glyph.and_then(make);
        self.made.lock().unwrap_or_else(PoisonError::into_inner).insert(letter, made.clone());
        made
    }

    /// The longest beginning of a label that fits into a width, pixels; an ellipsis says that there was more.
    fn label(&self, text: &str, width: f64) -> Label {
        let more = self.of('…');
        let room = more.as_ref().map_or(0.0, |letter| EM * letter.advance);
        let (mut label, mut pen) = (Label::new(), 0.0);
        // How much of it leaves room for the ellipsis, and where that would stand.
        let mut short = (0, 0.0);
        for letter in text.chars().filter_map(|letter| self.of(letter)) {
            let next = pen + EM * letter.advance;
            // Of a label as wide as its place nothing is cut.
            if next > width + 1e-9 {
                label.truncate(short.0);
                label.extend(more.map(|more| (short.1, more)));
                break;
            }
            label.push((pen, letter));
            pen = next;
            if pen + room <= width {
                short = (label.len(), pen);
            }
        }
        label
    }
}

fn color([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

fn paint(rgb: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(color(rgb));
    paint
}

/// Outlines in em with y up, from `base` on.
fn write_letter(sheet: &mut Pixmap, shape: &Shape, base: DVec2, rgb: [u8; 3]) {
    let mut path = PathBuilder::new();
    let at = |p: DVec2| ((base.x + EM * p.x) as f32, (base.y - EM * p.y) as f32);
    for contour in shape.contours() {
        for (i, curve) in contour.curves().iter().enumerate() {
            let ((x0, y0), (x1, y1)) = (at(curve.p0), at(curve.p1));
            let ((x2, y2), (x3, y3)) = (at(curve.p2), at(curve.p3));
            if i == 0 {
                path.move_to(x0, y0);
            }
            path.cubic_to(x1, y1, x2, y2, x3, y3);
        }
        path.close();
    }
    if let Some(path) = path.finish() {
        sheet.fill_path(&path, &paint(rgb), FillRule::Winding, Transform::identity(), None);
    }
}

/// A cross in the middle of a place.
fn cross(sheet: &mut Pixmap, [x, y]: [u32; 2], side: u32) {
    let (middle, arm) = (0.5 * side as f32, 0.16 * side as f32);
    let bar = Rect::from_xywh(-arm, -0.12 * arm, 2.0 * arm, 0.24 * arm);
    for angle in [45.0, -45.0] {
        let place = Transform::from_rotate(angle).post_translate(x as f32 + middle, y as f32 + middle);
        if let Some(bar) = bar {
            let mut paint = paint(FAULT);
            paint.anti_alias = true;
            sheet.fill_rect(bar, &paint, place, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_fit_and_say_where_they_are_cut() {
        let font = Font::bundled("Inter").unwrap();
        let letters = Letters::new(Some(&font));
        let end = |label: &Label| label.last().map_or(0.0, |(pen, letter)| pen + EM * letter.advance);
        let is_dots = |letter: &Arc<Letter>| Arc::ptr_eq(letter, &letters.of('…').unwrap());
        let whole = letters.label("12 star", 100.0);
        assert!(whole.len() == 7 && end(&whole) < 100.0 && !whole.iter().any(|(_, letter)| is_dots(letter)));
        let long = "W".repeat(10_000);
        for width in [5.0, 12.0, 40.0, 192.0] {
            let cut = letters.label(&long, width);
            assert!(is_dots(&cut.last().unwrap().1), "{width}");
            assert!(end(&cut) <= width || cut.len() == 1, "{width}: {}", end(&cut));
        }
        assert_eq!(end(&letters.label("12 star", end(&whole))), end(&whole));
        // No font of ours has it.
        assert_eq!(letters.label("\u{1f9ff}", 100.0).len(), 1);
    }
}
