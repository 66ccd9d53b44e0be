//! What is measured: lights × floors × backends × techniques × values of their knobs.

use crate::backend::technique::{ReferenceLobe, Sampling};
use crate::backend::{Settings, Technique};
use crate::cli::technique::why_not;
use crate::cli::values::positive;
use crate::report::LeftOut;
use crate::report::bench::BenchRow;
use crate::scene::trial::{FINISHES, Finish, Trial};
use core::fmt;
use core::str::FromStr;

/// A technique at one value of its knob.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    pub technique: Technique,
    /// Without its knob.
    pub name: &'static str,
    pub knob: Option<String>,
    /// Of the techniques that heed one.
    pub tolerance: f32,
}

/// The tolerance of the rectangle that all times are held against. Its four edges are exact at any.
pub const UNIT_TOLERANCE: f32 = 1e-3;

/// The other unit of time.
pub const UNIFORM_UNIT: Technique = Technique::Uniform { segments: 30 };

/// The knobs that are measured unless told otherwise, by technique.
const KNOBS: [(&str, &[&str]); 8] = [
    ("tree", &["1e-2", "1e-3", "1e-4", "1e-5"]),
    ("textured", &["1e-2", "1e-3", "1e-4"]),
    ("kuge", &["", "1e-3", "1e-5", "1e-7"]),
    ("uniform", &["3", "6", "18", "30"]),
    ("quad", &["64", "512"]),
    ("pal", &[""]),
    ("representative", &[""]),
    ("reference", &["16", "256"]),
];

/// Those of `--quick`.
const QUICK: [(&str, &[&str]); 6] = [
    ("tree", &["1e-3", "1e-4"]),
    ("textured", &["1e-3"]),
    ("kuge", &[""]),
    ("uniform", &["6", "30"]),
    ("quad", &["256"]),
    ("representative", &[""]),
];

impl Point {
    /// `tree:1e-3`, `kuge`, `kuge:1e-4`, `uniform:30` …
    fn new(name: &str, knob: &str) -> Result<Self, String> {
        let knob = (!knob.is_empty()).then(|| knob.to_owned());
        if let Ok(technique @ (Technique::Tree | Technique::Textured)) = name.parse() {
            let tolerance = positive(knob.as_deref().unwrap_or("1e-4"))?;
            return Ok(Self { technique, name: technique.name(), knob: Some(format!("{tolerance:e}")), tolerance });
        }
        let spelled = knob.as_ref().map_or_else(|| name.to_owned(), |knob| format!("{name}:{knob}"));
        let technique = match spelled.parse()? {
            // Among the integrals of a cosine it is one as well.
            Technique::Reference(s) => Technique::Reference(Sampling { lobe: ReferenceLobe::Ltc, ..s }),
            other => other,
        };
        // The knob as the technique writes it, so that 1e-4 and 0.0001 are one.
        let knob = technique.to_string().split_once(':').map(|(_, knob)| knob.to_owned());
        Ok(Self { technique, name: technique.name(), knob, tolerance: UNIT_TOLERANCE })
    }

    /// As tables call it.
    pub fn label(&self) -> String {
        self.knob.as_ref().map_or_else(|| self.name.to_owned(), |knob| format!("{}:{knob}", self.name))
    }

    /// For windows of `side` pixels.
    pub fn settings(&self, side: u32) -> Settings {
        Settings {
            width: side,
            height: side,
            samples: 1,
            tolerance: self.tolerance,
            technique: self.technique,
            ..Settings::default()
        }
    }

    fn measures(&self, row: &BenchRow) -> bool {
        row.technique == self.name && row.knob == self.knob
    }
}

/// One technique, or all of its knobs, as `--technique` names it.
#[derive(Clone, Debug)]
pub struct Wanted(Vec<Point>);

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some((name, knob)) = text.split_once(':') {
            return Ok(Self(vec![Point::new(name, knob)?]));
        }
        let knobs = KNOBS.iter().find(|(name, _)| *name == text).map_or(&[""][..], |(_, knobs)| knobs);
        knobs.iter().map(|knob| Point::new(text, knob)).collect::<Result<_, _>>().map(Self)
    }
}

/// Where a row is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum On {
    Cpu,
    Gpu,
}

impl fmt::Display for On {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        })
    }
}

/// All that is to be measured on one light over one floor: it goes round together.
#[derive(Clone, Debug)]
pub struct Cell {
    pub trial: Trial,
    pub finish: Finish,
    pub points: Vec<(On, Point)>,
}

/// Takes what has nothing to show on a light out of the cells, and says why: once for a technique on a light.
pub fn leave_out(cells: &mut [Cell]) -> Vec<LeftOut> {
    let mut left_out: Vec<LeftOut> = Vec::new();
    for Cell { trial, points, .. } in cells {
        points.retain(|(_, point)| {
            let Some(reason) = why_not(&point.technique, trial.has_picture()) else { return true };
            let left = LeftOut { technique: format!("{trial}, {}", point.name), reason: reason.into() };
            if !left_out.contains(&left) {
                left_out.push(left);
            }
            false
        });
    }
    left_out
}

/// Which part of everything.
#[derive(Debug)]
pub struct Filter<'a> {
    pub techniques: &'a [Wanted],
    pub shapes: &'a [Trial],
    pub finishes: &'a [Finish],
    pub backends: &'a [On],
    pub quick: bool,
}

impl Filter<'_> {
    /// The cells, shape by shape.
    ///
    /// # Errors
    /// None: the knobs above are all read back by a test.
    pub fn cells(&self) -> Result<Vec<Cell>, String> {
        let default: Vec<Point> = {
            let table: &[(&str, &[&str])] = if self.quick { &QUICK } else { &KNOBS };
            let all = table.iter().flat_map(|(name, knobs)| knobs.iter().map(move |knob| Point::new(name, knob)));
            all.collect::<Result<_, _>>()?
        };
        let mut points: Vec<Point> = Vec::new();
        let asked = self.techniques.iter().flat_map(|wanted| wanted.0.clone());
        for point in if self.techniques.is_empty() { default } else { asked.collect() } {
            if !points.contains(&point) {
                points.push(point);
            }
        }
        let trials = match self.shapes {
            [] if self.quick => &[Trial::Rectangle, Trial::Cavity, Trial::Picture, Trial::Line][..],
            [] => &Trial::ALL[..],
            asked => asked,
        };
        let finishes = match self.finishes {
            [] if self.quick => &[Finish::Gloss(0.1), Finish::Diffuse][..],
            [] => &FINISHES[..],
            asked => asked,
        };
        let backends = if self.backends.is_empty() { &[On::Cpu, On::Gpu] } else { self.backends };
        let mut everywhere = Vec::new();
        for &on in backends {
            let runs = |point: &&Point| on == On::Cpu || !point.technique.is_cpu_only();
            everywhere.extend(points.iter().filter(runs).map(|point| (on, point.clone())));
        }
        let mut cells = Vec::new();
        for &trial in trials {
            cells.extend(finishes.iter().map(|&finish| Cell { trial, finish, points: everywhere.clone() }));
        }
        Ok(cells)
    }

    /// The cells that a baseline has rows of, as far as they pass.
    ///
    /// # Errors
    /// A row of the baseline that this program cannot make.
    pub fn of_baseline(&self, rows: &[BenchRow]) -> Result<Vec<Cell>, String> {
        let mut cells: Vec<Cell> = Vec::new();
        for row in rows {
            let (trial, finish) = (row.shape.parse()?, row.finish.parse()?);
            let on = match row.backend.as_str() {
                "cpu" => On::Cpu,
                "gpu" => On::Gpu,
                other => return Err(format!("backend `{other}` is neither cpu nor gpu")),
            };
            let point = Point::new(&row.technique, row.knob.as_deref().unwrap_or_default())?;
            let named = |wanted: &Wanted| wanted.0.iter().any(|p| p.measures(row));
            let passes = (self.techniques.is_empty() || self.techniques.iter().any(named))
                && (self.shapes.is_empty() || self.shapes.contains(&trial))
                && (self.finishes.is_empty() || self.finishes.contains(&finish))
                && (self.backends.is_empty() || self.backends.contains(&on));
            if !passes {
                continue;
            }
            match cells.iter_mut().find(|cell| cell.trial == trial && cell.finish == finish) {
                Some(cell) => cell.points.push((on, point)),
                None => cells.push(Cell { trial, finish, points: vec![(on, point)] }),
            }
        }
        Ok(cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_knob_is_read_and_named() {
        for (name, knobs) in KNOBS.iter().chain(&QUICK) {
            for knob in *knobs {
                let point = Point::new(name, knob).unwrap();
                let label = point.label();
                let Wanted(again) = label.parse().unwrap();
                assert!(again.contains(&point), "{label}");
            }
        }
        assert_eq!("tree".parse::<Wanted>().unwrap().0.len(), 4);
        assert_eq!("tree:0.001".parse::<Wanted>().unwrap().0[0].label(), "tree:1e-3");
        assert_eq!("uniform:30".parse::<Wanted>().unwrap().0[0].technique, UNIFORM_UNIT);
        assert_eq!("textured".parse::<Wanted>().unwrap().0.len(), 3);
        assert_eq!("textured:0.01".parse::<Wanted>().unwrap().0[0].label(), "textured:1e-2");
        for wrong in ["tree:0", "tree:x", "textured:0", "trees", "uniform:0", "pal:skew", "exact:1"] {
            assert!(wrong.parse::<Wanted>().is_err(), "{wrong}");
        }
    }
}
