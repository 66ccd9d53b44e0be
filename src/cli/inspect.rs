//! `glyphlight inspect`: what an input becomes.

use super::lights::{Art, Source, Style};
use super::{json, label, say};
use crate::error::Error;
use crate::film::{Format, check_writable, diagram};
use crate::light::tree::Tree;
use comfy_table::Table;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// SVG (.svg) or scene file (.toml)
    #[arg(conflicts_with = "art")]
    file: Option<PathBuf>,
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    style: Style,
    /// Draw the contours with their direction
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

/// What one emission is made of.
#[derive(serde::Serialize)]
struct Row {
    light: String,
    layer: usize,
    contours: usize,
    holes: usize,
    cubics: usize,
    lines: usize,
    area: f64,
    min: [f64; 2],
    max: [f64; 2],
    radiance: [f64; 3],
    opacity: f64,
    nodes: usize,
    bytes: usize,
    /// For each curve, cubic or line.
    bytes_per_curve: usize,
}

/// What an input becomes.
#[derive(serde::Serialize)]
struct Report {
    emissions: Vec<Row>,
    warnings: Vec<String>,
}

pub fn run(args: &Args) -> Result<(), Error> {
    if let Some(path) = &args.png {
        if Format::of(path)? != Format::Png {
            return Err(Error::Usage(format!("{}: a drawing ends in .png", path.display())));
        }
        check_writable(path)?;
    }
    let (arts, warnings) = arts(args)?;
    let mut emissions = Vec::new();
    for art in &arts {
        for (i, layer) in art.layers.iter().enumerate() {
            let shape = &layer.shape;
            let tree = Tree::new(shape)?;
            let bounds = shape.bounds();
            let lines = shape.curves().filter(|c| c.is_line(1e-9 * tree.half)).count();
            emissions.push(Row {
                light: art.name.clone(),
                layer: i,
                contours: shape.contours().len(),
                holes: shape.contours().iter().filter(|c| c.is_hole()).count(),
                cubics: shape.curves().count() - lines,
                lines,
                area: shape.area(),
                min: bounds.min.to_array(),
                max: bounds.max.to_array(),
                radiance: layer.radiance.to_array(),
                opacity: layer.opacity,
                nodes: tree.nodes.len(),
                bytes: tree.bytes(),
                bytes_per_curve: tree.bytes() / shape.curves().count().max(1),
            });
        }
    }
    if let Some(path) = &args.png {
        let shapes: Vec<_> = arts.iter().flat_map(|a| a.layers.iter().map(|l| &l.shape)).collect();
        diagram::write(path, &shapes)?;
    }
    let report = Report { emissions, warnings };
    if args.json {
        return say(json(&report)?);
    }
    say(table(&report.emissions))?;
    report.warnings.iter().try_for_each(|w| say(format!("warning: {w}")))
}

/// The lights of a file or of the arguments.
fn arts(args: &Args) -> Result<(Vec<Art>, Vec<String>), Error> {
    let said = |art: &Art| art.warnings.iter().map(|w| format!("{}: {}", w.element, w.message)).collect();
    let Some(path) = &args.file else {
        let art = args.source.art(&args.style)?;
        let warnings = said(&art);
        return Ok((vec![art], warnings));
    };
    let figure = path.to_str().is_some_and(|name| name.starts_with("figure:"));
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "svg" if !figure => {
            let source = Source { text: None, svg: Some(path.clone()), path: None };
            let art = source.art(&args.style)?;
            let warnings = said(&art);
            Ok((vec![art], warnings))
        }
        _ if figure || ending == "toml" => {
            args.style.check("a scene file")?;
            let (loaded, _) = super::scene::open(path)?;
            let art = |l: crate::light::AreaLight| Art { name: l.name, layers: l.layers, warnings: Vec::new() };
            Ok((loaded.scene.lights.into_iter().map(art).collect(), loaded.warnings))
        }
        _ => Err(Error::Usage(format!("{}: inspect takes .svg and .toml files, --text and --path", path.display()))),
    }
}

fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header([
        "light",
        "layer",
        "contours",
        "holes",
        "cubics",
        "lines",
        "area m²",
        "bounds m",
        "radiance",
        "opacity",
        "nodes",
        "bytes",
        "per curve",
    ]);
    for r in rows {
        table.add_row([
            label(&r.light),
            r.layer.to_string(),
            r.contours.to_string(),
            r.holes.to_string(),
            r.cubics.to_string(),
            r.lines.to_string(),
            format!("{:.6}", r.area),
            format!("{:.4} {:.4} … {:.4} {:.4}", r.min[0], r.min[1], r.max[0], r.max[1]),
            format!("{:.3} {:.3} {:.3}", r.radiance[0], r.radiance[1], r.radiance[2]),
            format!("{:.2}", r.opacity),
            r.nodes.to_string(),
            r.bytes.to_string(),
            r.bytes_per_curve.to_string(),
        ]);
    }
    table.to_string()
}
