//! Plots of time against error, as SVG and as PNG of that SVG. The only file that names plotters and resvg.
//!
//! One figure for a light on a backend, one panel for a floor, one colour and marker for a technique, one point for a value of its
//! knob. Both axes are logarithmic and the same in all panels: down and to the left is better.

use super::ReportError;
use super::bench::{BenchRow, Benchmark};
use crate::film::png_of;
use crate::outline::bundled;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use resvg::{tiny_skia, usvg};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// A figure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plot {
    /// The stem of its files.
    pub name: String,
    /// As vectors; its text needs a font of the viewer's.
    pub svg: String,
    /// The same in pixels, its text in a bundled font.
    pub png: Vec<u8>,
}

/// Size of a panel, pixels.
const PANEL: [u32; 2] = [400, 330];
/// Height of the title, pixels.
const TITLE: u32 = 40;
/// Most panels in a row.
const COLUMNS: usize = 4;
/// Errors below this are drawn at it: they are those of rounding, or none.
const LEAST_ERROR: f64 = 1e-8;
/// The font that PNGs are drawn with.
const FONT: &str = "DejaVu Sans";
/// What text is measured against: plotters divides sizes by this.
const SIZE: f64 = 1.24;

/// How each technique is drawn: Okabe, Ito 2008, "Color universal design", and a marker, so that colour is not needed.
const STYLES: [(&str, RGBColor, Marker); 9] = [
    ("tree", RGBColor(213, 94, 0), Marker::Disc),
    ("kuge", RGBColor(0, 114, 178), Marker::Triangle),
    ("uniform", RGBColor(0, 158, 115), Marker::Square),
    ("quad", RGBColor(204, 121, 167), Marker::Ring),
    ("pal", RGBColor(230, 159, 0), Marker::Cross),
    ("representative", RGBColor(86, 180, 233), Marker::Plus),
    ("reference", RGBColor(120, 120, 120), Marker::Ring),
    ("exact", RGBColor(0, 0, 0), Marker::Cross),
    ("textured", RGBColor(160, 120, 0), Marker::Square),
];

#[derive(Clone, Copy, Debug)]
enum Marker {
    Disc,
    Ring,
    Square,
    Triangle,
    Cross,
    Plus,
}

/// The curves of one technique in one panel.
struct Series<'b> {
    technique: &'b str,
    /// Time (ns), error, knob.
    points: Vec<(f64, f64, &'b str)>,
}

/// A floor.
struct Panel<'b> {
    title: String,
    series: Vec<Series<'b>>,
    /// What the rectangle takes, ns.
    rectangle: Option<f64>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// All figures of a benchmark.
///
/// # Errors
/// [`ReportError::Plot`].
pub fn plots(bench: &Benchmark) -> Result<Vec<Plot>, ReportError> {
    let mut figures: Vec<(&str, &str)> = Vec::new();
    for row in &bench.rows {
        if !figures.contains(&(&row.shape, &row.backend)) {
            figures.push((&row.shape, &row.backend));
        }
    }
    figures.into_iter().map(|(shape, backend)| figure(bench, shape, backend)).collect()
}

fn figure(bench: &Benchmark, shape: &str, backend: &str) -> Result<Plot, ReportError> {
    let name = format!("{shape}-{backend}");
    let rows: Vec<_> = bench.rows.iter().filter(|r| r.shape == shape && r.backend == backend).collect();
    let fault = |message: String| ReportError::Plot { plot: name.clone(), message };
    let svg = draw(&title(bench, &rows), &panels(&rows)).map_err(fault)?;
    let png = rasterize(&svg).map_err(fault)?;
    Ok(Plot { name, svg, png })
}

fn title(bench: &Benchmark, rows: &[&BenchRow]) -> String {
    let Some(row) = rows.first() else { return String::new() };
    let machine = &bench.machine;
    let device = match (row.backend.as_str(), &machine.adapter) {
        ("gpu", Some(adapter)) => adapter.clone(),
        _ if machine.threads == 1 => format!("{}, 1 thread, {}", machine.processor, machine.simd),
        _ => format!("{}, {} threads, {}", machine.processor, machine.threads, machine.simd),
    };
    let day = bench.date.split('T').next().unwrap_or_default();
    format!("{}, {} curves; {device}; {}, {day}", row.shape, row.curves, bench.program)
}

fn panels<'b>(rows: &[&'b BenchRow]) -> Vec<Panel<'b>> {
    let mut panels: Vec<(&str, Panel<'b>)> = Vec::new();
    for row in rows {
        let at = panels.iter().position(|(finish, _)| *finish == row.finish).unwrap_or_else(|| {
            let gloss = format!("alpha {}", row.finish);
            let title = if row.finish == "diffuse" { row.finish.clone() } else { gloss };
            panels.push((&row.finish, Panel { title, series: Vec::new(), rectangle: None }));
            panels.len() - 1
        });
        let panel = &mut panels[at].1;
        panel.rectangle = panel.rectangle.or(row.rectangles.map(|r| row.nanoseconds / r.value));
        let own = if row.technique == "kuge" { "paper" } else { "" };
        let point = (row.nanoseconds, row.errors.rmse.max(LEAST_ERROR), row.knob.as_deref().unwrap_or(own));
        match panel.series.iter_mut().find(|s| s.technique == row.technique) {
            Some(series) => series.points.push(point),
            None => panel.series.push(Series { technique: &row.technique, points: vec![point] }),
        }
    }
    panels.into_iter().map(|(_, panel)| panel).collect()
}

/// From a power of ten to a power of ten, about all values and a little more.
fn decades(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (least, most) = values.fold((f64::INFINITY, 0.0_f64), |(least, most), v| (least.min(v), most.max(v)));
    if !(least > 0.0 && most.is_finite() && least <= most) {
        return 1.0..10.0;
    }
    10_f64.powf((least * 0.8).log10().floor())..10_f64.powf((most * 1.25).log10().ceil())
}

fn draw(title: &str, panels: &[Panel<'_>]) -> Result<String, String> {
    let points = || panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points);
    let times = points().map(|p| p.0).chain(panels.iter().filter_map(|p| p.rectangle));
    let (x, y) = (decades(times), decades(points().map(|p| p.1)));
    // One place more than panels: the legend's.
    let columns = (panels.len() + 1).min(COLUMNS);
    let rows = (panels.len() + 1).div_ceil(columns);
    let size = (PANEL[0] * columns as u32, PANEL[1] * rows as u32 + TITLE);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let (head, body) = root.split_vertically(TITLE);
        words(&head, title, (size.0 as i32 / 2, 14), &font(15.0, &BLACK).pos(Pos::new(HPos::Center, VPos::Top)))?;
        let cells = body.split_evenly((rows, columns));
        for (panel, cell) in panels.iter().zip(&cells) {
            draw_panel(panel, cell, &x, &y)?;
        }
        if let Some(cell) = cells.get(panels.len()) {
            legend(panels, cell)?;
        }
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(svg)
}

fn draw_panel(panel: &Panel<'_>, cell: &Area<'_>, x: &Range<f64>, y: &Range<f64>) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<_>| e.to_string();
    let mut builder = ChartBuilder::on(cell);
    builder.margin(8).margin_right(18).x_label_area_size(44).y_label_area_size(62);
    builder.caption(&panel.title, font(14.0, &BLACK));
    let mut chart = builder.build_cartesian_2d(x.clone().log_scale(), y.clone().log_scale()).map_err(text)?;
    let label = font(11.0, &BLACK);
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .x_labels(12)
        .y_labels(12)
        .x_label_formatter(&|ns| duration(*ns))
        .y_label_formatter(&|error| format!("{error:.0e}"))
        .x_label_style(label.clone())
        .y_label_style(label)
        .axis_desc_style(font(12.0, &BLACK))
        .x_desc("time per pixel")
        .y_desc("RMSE, W/(sr·m²)")
        .draw()
        .map_err(text)?;
    if let Some(time) = panel.rectangle {
        let line = DashedLineSeries::new([(time, y.start), (time, y.end)], 4, 4, BLACK.mix(0.6).stroke_width(1));
        chart.draw_series(line).map_err(text)?;
    }
    let mut labels = Labels::default();
    let mut waiting = Vec::new();
    for series in &panel.series {
        let (color, marker) = style(series.technique);
        let line = LineSeries::new(series.points.iter().map(|p| (p.0, p.1)), color.stroke_width(2));
        chart.draw_series(line).map_err(text)?;
        let places = series.points.iter().map(|p| (chart.backend_coord(&(p.0, p.1)), p.2));
        let places: Vec<_> = places.collect();
        places.iter().try_for_each(|(at, _)| mark(cell, *at, marker, color))?;
        labels.taken.extend(places.iter().map(|&((x, y), _)| [x - 5, y - 5, x + 5, y + 5]));
        waiting.extend(together(&places).into_iter().map(|(at, knob)| (at, knob, color)));
    }
    waiting.into_iter().try_for_each(|(at, knob, color)| labels.write(cell, at, &knob, color))
}

/// Knobs of points that lie on each other as one label: that of the first and that of the last, at the last.
fn together(places: &[((i32, i32), &str)]) -> Vec<((i32, i32), String)> {
    /// Pixels between points that can have a label each.
    const APART: i32 = 12;
    let mut groups: Vec<((i32, i32), Vec<&str>)> = Vec::new();
    for &(at, knob) in places {
        match groups.last_mut() {
            Some((last, knobs)) if (at.0 - last.0).abs() < APART && (at.1 - last.1).abs() < APART => {
                *last = at;
                knobs.push(knob);
            }
            _ => groups.push((at, vec![knob])),
        }
    }
    let label = |knobs: Vec<&str>| match (knobs.first(), knobs.last()) {
        (Some(first), Some(last)) if knobs.len() > 1 => format!("{first}–{last}"),
        (Some(only), _) => (*only).to_owned(),
        _ => String::new(),
    };
    groups.into_iter().map(|(at, knobs)| (at, label(knobs))).collect()
}

/// Labels that keep out of each other's way.
#[derive(Default)]
struct Labels {
    /// Left, top, right, bottom, pixels of the figure.
    taken: Vec<[i32; 4]>,
}

impl Labels {
    /// Writes a label beside a point, on the first of its sides that is free; where none is, it is left out.
    fn write(&mut self, cell: &Area<'_>, (x, y): (i32, i32), text: &str, color: RGBColor) -> Result<(), String> {
        /// Size of a letter, and distance from the point.
        const LETTER: [i32; 2] = [6, 10];
        const GAP: i32 = 6;
        if text.is_empty() {
            return Ok(());
        }
        let width = LETTER[0] * text.chars().count() as i32;
        for (side, up) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let left = if side > 0 { x + GAP } else { x - GAP - width };
            let bottom = if up > 0 { y - 2 } else { y + 3 + LETTER[1] };
            let place = [left, bottom - LETTER[1], left + width, bottom];
            let apart = |other: &[i32; 4]| {
                place[2] <= other[0] || other[2] <= place[0] || place[3] <= other[1] || other[3] <= place[1]
            };
            if self.taken.iter().all(apart) {
                self.taken.push(place);
                let (x0, y0) = cell.get_base_pixel();
                let style = font(9.5, &color).pos(Pos::new(HPos::Left, VPos::Bottom));
                return words(cell, text, (left - x0, bottom - y0), &style);
            }
        }
        Ok(())
    }
}

/// What colours, markers and the dashed line mean.
fn legend(panels: &[Panel<'_>], cell: &Area<'_>) -> Result<(), String> {
    let beside = |color| font(12.0, color).pos(Pos::new(HPos::Left, VPos::Center));
    let (left, top) = cell.get_base_pixel();
    let mut y = 36;
    let shown = |name: &str| panels.iter().flat_map(|p| &p.series).any(|s| s.technique == name);
    for (name, color, marker) in STYLES.iter().filter(|(name, ..)| shown(name)) {
        let line = PathElement::new([(62, y), (94, y)], color.stroke_width(2));
        cell.draw(&line).map_err(|e| e.to_string())?;
        mark(cell, (left + 78, top + y), *marker, *color)?;
        let knob = match *name {
            "tree" | "textured" => ": tolerance, W/(sr·m²)",
            "kuge" => ": eps (paper: the paper's own)",
            "uniform" => ": edges per curve",
            "quad" => ": texels of the mask",
            "reference" => ": Monte Carlo, samples",
            _ => "",
        };
        words(cell, &format!("{name}{knob}"), (104, y), &beside(color))?;
        y += 24;
    }
    if panels.iter().any(|p| p.rectangle.is_some()) {
        for x in [62, 71, 80, 89] {
            let dash = PathElement::new([(x, y), (x + 5, y)], BLACK.mix(0.6).stroke_width(1));
            cell.draw(&dash).map_err(|e| e.to_string())?;
        }
        words(cell, "time of the rectangle light", (104, y), &beside(&BLACK))?;
        y += 24;
    }
    words(cell, "Down and left is better.", (62, y), &beside(&BLACK))
}

/// A marker about a pixel of the whole figure.
fn mark(cell: &Area<'_>, (x, y): (i32, i32), marker: Marker, color: RGBColor) -> Result<(), String> {
    const HALF: i32 = 4;
    let (left, top) = cell.get_base_pixel();
    let (x, y) = (x - left, y - top);
    let stroke = color.stroke_width(2);
    let line = |a: (i32, i32), b: (i32, i32)| cell.draw(&PathElement::new([a, b], stroke));
    match marker {
        Marker::Disc => cell.draw(&Circle::new((x, y), HALF, color.filled())),
        Marker::Ring => cell
            .draw(&Circle::new((x, y), HALF, WHITE.filled()))
            .and_then(|()| cell.draw(&Circle::new((x, y), HALF, stroke))),
        Marker::Square => cell.draw(&Rectangle::new([(x - HALF, y - HALF), (x + HALF, y + HALF)], color.filled())),
        Marker::Triangle => cell.draw(&TriangleMarker::new((x, y), HALF + 1, color.filled())),
        Marker::Cross => line((x - HALF, y - HALF), (x + HALF, y + HALF))
            .and_then(|()| line((x - HALF, y + HALF), (x + HALF, y - HALF))),
        Marker::Plus => {
            line((x - HALF - 1, y), (x + HALF + 1, y)).and_then(|()| line((x, y - HALF - 1), (x, y + HALF + 1)))
        }
    }
    .map_err(|e| e.to_string())
}

fn style(technique: &str) -> (RGBColor, Marker) {
    let found = STYLES.iter().find(|(name, ..)| *name == technique);
    found.map_or((BLACK, Marker::Ring), |(_, color, marker)| (*color, *marker))
}

fn words(area: &Area<'_>, text: &str, at: (i32, i32), style: &TextStyle<'_>) -> Result<(), String> {
    area.draw_text(text, style, at).map_err(|e| e.to_string())
}

/// Text of a size in pixels.
fn font<'a>(pixels: f64, color: &'a RGBColor) -> TextStyle<'a> {
    TextStyle::from(("sans-serif", pixels * SIZE).into_font()).color(color)
}

/// Nanoseconds for people.
fn duration(ns: f64) -> String {
    match ns {
        _ if ns < 1e3 => format!("{ns:.0} ns"),
        _ if ns < 1e6 => format!("{:.0} µs", ns * 1e-3),
        _ => format!("{:.0} ms", ns * 1e-6),
    }
}

/// The PNG of an SVG.
fn rasterize(svg: &str) -> Result<Vec<u8>, String> {
    let font = bundled::find(FONT).ok_or("the font of plots is not bundled")?;
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_source(usvg::fontdb::Source::Binary(Arc::new(font.bytes)));
    fonts.set_sans_serif_family(font.family);
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| e.to_string())?;
    let size = tree.size().to_int_size();
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height()).ok_or("the plot has no pixels")?;
    resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
    // The plot's background is opaque.
    let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    png_of(&rgb, size.width(), size.height(), Path::new("plot.png")).map_err(|e| e.to_string())
}
