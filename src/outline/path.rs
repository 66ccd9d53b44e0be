//! SVG path data (`M0 0H1V1Z`) as a shape, and the grammar of other SVG values. The only file that names svgtypes.

use super::FillRule;
use super::overlap::{self, OverlapError};
use crate::shape::Shape;
use kurbo::{Arc, BezPath, Point, SvgArc, Vec2};
use svgtypes::{PathParser, PathSegment};

/// Why path data is not a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// The text breaks the grammar of path data (NaN and infinity do as well).
    #[error("path data after {commands} commands: {reason}, in `{excerpt}`")]
    Syntax {
        /// Commands read before the fault.
        commands: usize,
        /// The parser's words, with the position in characters.
        reason: String,
        /// The data around the fault.
        excerpt: String,
    },
    /// A coordinate is too large for SVG, which computes in f32.
    #[error("path data, command {command}: coordinate {value:?} is larger than {limit:?}")]
    TooLarge {
        /// Index of the command.
        command: usize,
        /// The coordinate.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// More curves and lines than are wanted.
    #[error("path data of more than {limit} curves and lines")]
    TooLong {
        /// The limit.
        limit: usize,
    },
    /// Nothing is drawn.
    #[error("path data draws nothing")]
    Empty,
    /// Lines or points only.
    #[error("the path encloses no area")]
    ZeroArea,
    /// Overlap removal failed.
    #[error(transparent)]
    Overlap(#[from] OverlapError),
}

/// Largest coordinate path data may hold.
pub const MAX_COORDINATE: f64 = 1e30;

/// The shape that path data encloses under `rule`; light space: metres, y up, nothing is flipped or moved.
///
/// # Errors
/// Data that breaks the grammar, holds NaN or infinity, draws nothing or encloses no area; see [`PathError`].
pub fn shape(data: &str, rule: FillRule) -> Result<Shape, PathError> {
    let path = outline(data)?;
    if path.elements().len() < 2 {
        return Err(PathError::Empty);
    }
    let shape = overlap::resolve(&path, rule)?;
    if shape.is_empty() { Err(PathError::ZeroArea) } else { Ok(shape) }
}

/// Path data as a kurbo path, as it stands. Elliptical arcs become cubics within 1e-6 of their radius.
pub(super) fn outline(data: &str) -> Result<BezPath, PathError> {
    let mut pen = Pen::default();
    walk(data, &mut pen, |_| Ok(()))?;
    Ok(pen.path)
}

/// The number of curves and lines of path data that [`outline`] takes; none of it is kept.
pub(super) fn check(data: &str, most: usize) -> Result<usize, PathError> {
    const KEPT: usize = 1024;
    let (mut pen, mut count) = (Pen::default(), 0);
    walk(data, &mut pen, |pen| {
        let drawn = pen.path.elements().len();
        if count + drawn > most {
            return Err(PathError::TooLong { limit: most });
        }
        if drawn > KEPT {
            count += drawn;
            pen.path = BezPath::new();
            pen.path.move_to(pen.at);
        }
        Ok(())
    })?;
    Ok(count + pen.path.elements().len())
}

/// Draws path data command by command; `each` is called after every command.
fn walk(data: &str, pen: &mut Pen, mut each: impl FnMut(&mut Pen) -> Result<(), PathError>) -> Result<(), PathError> {
    for (command, segment) in PathParser::from(data).enumerate() {
        let segment = segment.map_err(|e| syntax(data, command, &e))?;
        let drawn = pen.path.elements().len();
        pen.draw(segment);
        let mut coordinates = pen.path.elements()[drawn..].iter().flat_map(super::coordinates);
        if let Some(value) = coordinates.find(|v| v.is_nan() || v.abs() > MAX_COORDINATE) {
            return Err(PathError::TooLarge { command, value, limit: MAX_COORDINATE });
        }
        each(pen)?;
    }
    Ok(())
}

/// Whether `value` follows the grammar of a `transform`.
pub(super) fn is_transform(value: &str) -> bool {
    value.trim() == "none" || value.parse::<svgtypes::Transform>().is_ok()
}

/// Whether `value` is a `transform` that flattens the plane to a line or point, nearly or wholly (usvg then ignores it).
pub(super) fn is_flattening(value: &str) -> bool {
    let lengths = |t: svgtypes::Transform| t.a.hypot(t.c).min(t.b.hypot(t.d));
    value.parse().is_ok_and(|t| lengths(t) <= f64::from(f32::EPSILON))
}

/// Whether `value` is a list of numbers, as `points` is.
pub(super) fn is_number_list(value: &str) -> bool {
    svgtypes::NumberListParser::from(value).all(|number| number.is_ok())
}

fn syntax(data: &str, commands: usize, error: &svgtypes::Error) -> PathError {
    use svgtypes::Error as E;
    let position = match *error {
        E::UnexpectedData(p) | E::InvalidChar(_, p) | E::InvalidString(_, p) | E::InvalidNumber(p) => p,
        E::UnexpectedEndOfStream | E::InvalidValue | E::InvalidIdent => data.chars().count(),
    };
    let excerpt = data.chars().skip(position.saturating_sub(20)).take(40).collect();
    PathError::Syntax { commands, reason: error.to_string(), excerpt }
}

/// The handle that a smooth command mirrors.
#[derive(Clone, Copy, Default)]
enum Mirror {
    #[default]
    None,
    Cubic(Point),
    Quad(Point),
}

/// Draws path commands, keeping what relative and smooth ones refer to.
#[derive(Default)]
struct Pen {
    path: BezPath,
    start: Point,
    at: Point,
    mirror: Mirror,
    /// The subpath was closed: a drawing command now starts another where it began.
    closed: bool,
}

impl Pen {
    fn draw(&mut self, segment: PathSegment) {
        let from = self.at;
        let origin = if segment.is_abs() { Vec2::ZERO } else { from.to_vec2() };
        let p = |x: f64, y: f64| Point::new(x, y) + origin;
        let is_move = matches!(segment, PathSegment::MoveTo { .. });
        let is_close = matches!(segment, PathSegment::ClosePath { .. });
        if self.closed && !is_move && !is_close {
            self.path.move_to(self.start);
        }
        self.closed = is_close;
        let mirror = std::mem::replace(&mut self.mirror, Mirror::None);
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                self.at = p(x, y);
                self.start = self.at;
                self.path.move_to(self.at);
            }
            PathSegment::LineTo { x, y, .. } => self.line(p(x, y)),
            PathSegment::HorizontalLineTo { x, .. } => self.line(Point::new(x + origin.x, from.y)),
            PathSegment::VerticalLineTo { y, .. } => self.line(Point::new(from.x, y + origin.y)),
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => self.cubic(p(x1, y1), p(x2, y2), p(x, y)),
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
                let a = if let Mirror::Cubic(h) = mirror { from + (from - h) } else { from };
                self.cubic(a, p(x2, y2), p(x, y));
            }
            PathSegment::Quadratic { x1, y1, x, y, .. } => self.quad(p(x1, y1), p(x, y)),
            PathSegment::SmoothQuadratic { x, y, .. } => {
                let a = if let Mirror::Quad(h) = mirror { from + (from - h) } else { from };
                self.quad(a, p(x, y));
            }
            PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
                let to = p(x, y);
                let radii = Vec2::new(rx, ry);
                let arc = SvgArc { from, to, radii, x_rotation: x_axis_rotation.to_radians(), large_arc, sweep };
                self.arc(&arc);
            }
            PathSegment::ClosePath { .. } => {
                self.path.close_path();
                self.at = self.start;
            }
        }
    }

    fn line(&mut self, p: Point) {
        self.path.line_to(p);
        self.at = p;
    }

    fn quad(&mut self, a: Point, p: Point) {
        self.path.quad_to(a, p);
        self.mirror = Mirror::Quad(a);
        self.at = p;
    }

    fn cubic(&mut self, a: Point, b: Point, p: Point) {
        self.path.curve_to(a, b, p);
        self.mirror = Mirror::Cubic(b);
        self.at = p;
    }

    fn arc(&mut self, svg: &SvgArc) {
        match Arc::from_svg_arc(svg) {
            Some(arc) => {
                let mut cubics = Vec::new();
                let tolerance = 1e-6 * arc.radii.x.abs().max(arc.radii.y.abs());
                arc.to_cubic_beziers(tolerance, |a, b, p| cubics.push((a, b, p)));
                if let Some(last) = cubics.last_mut() {
                    // The arc ends where the data says, to the bit.
                    last.2 = svg.to;
                }
                cubics.into_iter().for_each(|(a, b, p)| self.path.curve_to(a, b, p));
            }
            None => self.path.line_to(svg.to),
        }
        self.at = svg.to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_agrees_with_kurbo() {
        let data = "m1 2 3 4h5v-6l-1-2c1 2 3 4 5 6s3 4 5 6q1 2 3 4t5 6t1-8zM1 1 2 2H5V6L1 2C1 2 3 4 5 6S3 4 5 6Q1 2 3 4T5 6Zl3 3 1-9z";
        assert_eq!(outline(data).unwrap(), BezPath::from_svg(data).unwrap());
    }

    #[test]
    fn arcs_are_round() {
        let circle = shape("M1 0A1 1 0 0 1-1 0A1 1 0 0 1 1 0Z", FillRule::NonZero).unwrap();
        assert!((circle.area() - std::f64::consts::PI).abs() < 1e-5, "{}", circle.area());
    }

    #[test]
    fn faults_are_named() {
        let fault = |d| shape(d, FillRule::NonZero).unwrap_err().to_string();
        assert!(fault("M0 0L1 NaN1 1Z").contains("position 8"), "{}", fault("M0 0L1 NaN1 1Z"));
        assert!(fault("M0 0L1 1e999Z").contains("position"), "{}", fault("M0 0L1 1e999Z"));
        assert!(fault("M0 0L1e31 0L1 1Z").contains("larger than"));
        assert!(fault("M0 0H1V1Z#").contains('#'));
        assert_eq!(shape("", FillRule::NonZero), Err(PathError::Empty));
        assert_eq!(shape("M0 0", FillRule::NonZero), Err(PathError::Empty));
        assert_eq!(shape("M0 0H1Z", FillRule::NonZero), Err(PathError::ZeroArea));
        assert!(shape("M0 0H1V1Z", FillRule::NonZero).is_ok());
    }
}
