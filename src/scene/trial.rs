//! Trials: the scenes that benchmarks time. One light stands over a floor of one lobe and is seen through small windows of one
//! large picture, so that neighbouring pixels are as near each other as they are in pictures that people render.

pub mod colors;

use super::surface::plane;
use super::{Camera, Material, Scene};
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::outline::font::Font;
use crate::outline::path;
use crate::outline::svg::{SvgOptions, svg};
use crate::outline::text::{Align, TextStyle, layout};
use crate::outline::{FillRule, OutlineError};
use crate::shape::{Bounds, Shape};
use core::fmt;
use core::str::FromStr;
use glam::{DAffine2, DVec2, DVec3};
use std::fmt::Write;

/// A light to be timed, of radiance 1 where it is brightest, some 1.4 m high or 4 m wide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Trial {
    /// A rectangle: the unit of all times.
    Rectangle,
    /// A blob with a hole, seven curves.
    Cavity,
    /// One glyph, "&".
    Glyph,
    /// The same glyph in colours that change across it.
    Picture,
    /// A line of text.
    Line,
    /// Five lines of text.
    Paragraph,
    /// An SVG of [`PETALS`] paths in three colours.
    Drawing,
}

impl Trial {
    /// All of them, by the number of their curves.
    pub const ALL: [Self; 7] =
        [Self::Rectangle, Self::Cavity, Self::Glyph, Self::Picture, Self::Line, Self::Paragraph, Self::Drawing];

    /// What the command line and tables call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rectangle => "rectangle",
            Self::Cavity => "cavity",
            Self::Glyph => "glyph",
            Self::Picture => "picture",
            Self::Line => "line",
            Self::Paragraph => "paragraph",
            Self::Drawing => "drawing",
        }
    }

    /// Its layers, which stand on the line y = 0.15 m, their middle at x = 0.
    ///
    /// # Errors
    /// None but for a fault of the fonts or the parsers: what they read is built in.
    pub fn layers(self) -> Result<Vec<Layer>, OutlineError> {
        let layers = match self {
            Self::Rectangle => vec![white(Shape::rectangle(DVec2::ZERO, DVec2::splat(1.4)))],
            Self::Cavity => vec![white(path::shape(CAVITY, FillRule::EvenOdd)?)],
            Self::Glyph | Self::Picture => vec![white(text("&", 1.9)?)],
            Self::Line => vec![white(text(LINE, 0.38)?)],
            Self::Paragraph => vec![white(text(PARAGRAPH, 0.36)?)],
            Self::Drawing => {
                let art = svg(flower().as_bytes(), "flower.svg", &SvgOptions { size: 1.4, ..SvgOptions::default() })?;
                art.layers.into_iter().map(|layer| Layer::of_art(layer, true)).collect()
            }
        };
        let layers = stand(layers);
        Ok(if self.has_picture() { layers.into_iter().map(colors::colored).collect() } else { layers })
    }

    /// Whether its colours change from place to place.
    pub const fn has_picture(self) -> bool {
        matches!(self, Self::Picture)
    }

    /// The same light of layers that have one colour each, so that contour integrals can be its yardstick.
    ///
    /// # Errors
    /// As [`Trial::layers`].
    pub fn flat_layers(self) -> Result<Vec<Layer>, OutlineError> {
        let flat: Result<Vec<_>, _> = self.layers()?.iter().map(|layer| colors::bands(layer, colors::BANDS)).collect();
        Ok(flat?.concat())
    }
}

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Trial {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|trial| trial.name() == text);
        found.ok_or_else(|| format!("`{text}` is none of {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// The one lobe of the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finish {
    /// Diffuse, albedo 1.
    Diffuse,
    /// A white metal of this GGX width.
    Gloss(f32),
}

/// Floors that are timed unless told otherwise.
pub const FINISHES: [Finish; 7] = [
    Finish::Gloss(0.01),
    Finish::Gloss(0.05),
    Finish::Gloss(0.1),
    Finish::Gloss(0.25),
    Finish::Gloss(0.5),
    Finish::Gloss(0.8),
    Finish::Diffuse,
];

/// `diffuse`, or alpha.
impl fmt::Display for Finish {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diffuse => f.write_str("diffuse"),
            Self::Gloss(alpha) => write!(f, "{alpha}"),
        }
    }
}

impl FromStr for Finish {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "diffuse" {
            return Ok(Self::Diffuse);
        }
        let alpha = text.parse().ok().filter(|alpha| (0.0..=1.0).contains(alpha));
        alpha.map(Self::Gloss).ok_or_else(|| format!("`{text}` is neither `diffuse` nor an alpha from 0 to 1"))
    }
}

/// The scene: `layers` in the plane z = 0, facing +z, over a floor at y = 0, 40 m wide.
pub fn scene(layers: Vec<Layer>, finish: Finish) -> Scene {
    let floor = match finish {
        Finish::Diffuse => Material { base_color: [1.0; 3], specular: 0.0, ..Material::default() },
        Finish::Gloss(alpha) => Material { base_color: [1.0; 3], metallic: 1.0, alpha, ..Material::default() },
    };
    let light = AreaLight {
        name: "light".into(),
        layers,
        form: Form::Outline,
        placement: Placement::new(DVec3::ZERO, DVec3::ZERO, DVec2::ONE),
        two_sided: false,
    };
    Scene {
        camera: Camera { position: EYE, look_at: DVec3::new(0.0, 0.2, 0.8), up: DVec3::Y, fov_y: FOV_Y },
        triangles: plane(DVec3::ZERO, DVec3::Y, [40.0; 2], 1.0, 0).to_vec(),
        materials: vec![floor],
        textures: Vec::new(),
        lights: vec![light],
        background: [0.0; 3],
    }
}

/// How many [`windows`] there are.
pub const WINDOWS: usize = SPOTS.len();

/// Pixels down the whole picture: a window's pixels are as fine as those in the middle of it.
pub const PICTURE: u32 = 1024;

/// Cameras at one place, each for a square of `side` × `side` pixels of the floor: where the light stands, where it is mirrored
/// (twice), and off to the side. No pixel sees anything but the floor while `side` is at most [`PICTURE`] / 4.
pub fn windows(side: u32) -> [Camera; WINDOWS] {
    let slope = (0.5 * FOV_Y.to_radians()).tan() * f64::from(side) / f64::from(PICTURE);
    let fov_y = 2.0 * slope.atan().to_degrees();
    SPOTS.map(|[x, z]| Camera { position: EYE, look_at: DVec3::new(x, 0.0, z), up: DVec3::Y, fov_y })
}

/// Where the camera is, and how much it sees.
const EYE: DVec3 = DVec3::new(1.5, 3.0, 6.5);
const FOV_Y: f64 = 50.0;

/// Middles of the windows on the floor, x and z.
const SPOTS: [[f64; 2]; 4] = [[0.1, 0.35], [-0.4, 1.1], [0.5, 2.1], [-2.2, 3.4]];

/// Height of the lights over the floor, metres.
const GAP: f64 = 0.15;

const CAVITY: &str = "M0 0.7C0.5 0.78 0.86 0.46 0.72 0C0.62 -0.34 0.3 -0.74 -0.1 -0.7C-0.52 -0.66 -0.8 -0.4 -0.74 0C-0.68 0.42 \
                      -0.44 0.63 0 0.7ZM0.05 0.36C-0.3 0.4 -0.46 0.1 -0.34 -0.14C-0.24 -0.36 0.2 -0.4 0.32 -0.1C0.42 0.14 0.3 \
                      0.33 0.05 0.36Z";

const LINE: &str = "Light from letters all";

const PARAGRAPH: &str = "Light in the shape of\nletters falls on every\nfloor that it can see,\nand the farther it is,\nthe softer it becomes.";

/// Paths of [`Trial::Drawing`].
pub const PETALS: usize = 540;

/// A sunflower as an SVG: petal n at √n steps from the middle, the golden angle from the one before (Vogel 1979, "A better way
/// to construct the sunflower head").
fn flower() -> String {
    const GOLDEN_ANGLE: f64 = 137.507_764;
    const COLORS: [&str; 3] = ["#ffffff", "#ffd080", "#ff9060"];
    let mut text = String::from("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-500 -500 1000 1000\">\n");
    for n in 1..=PETALS {
        let (angle, radius) = (GOLDEN_ANGLE * n as f64, 20.0 * (n as f64).sqrt());
        let color = COLORS[n * COLORS.len() / (PETALS + 1)];
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<path transform=\"rotate({angle:.3}) translate({radius:.3})\" fill=\"{color}\" \
             d=\"M-14 0C-14 -7 -8 -10 0 -10C8 -10 12 -5 15 0C12 5 8 10 0 10C-8 10 -14 7 -14 0Z\"/>"
        );
    }
    text.push_str("</svg>\n");
    text
}

fn white(shape: Shape) -> Layer {
    Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None }
}

fn text(text: &str, size: f64) -> Result<Shape, OutlineError> {
    let style = TextStyle { size, align: Align::Center, ..TextStyle::default() };
    Ok(layout(text, &[Font::bundled("DejaVu Sans")?], &style)?.shape)
}

/// Moves layers together to stand [`GAP`] above the floor.
fn stand(mut layers: Vec<Layer>) -> Vec<Layer> {
    let bounds = layers.iter().map(|l| l.shape.bounds()).fold(Bounds::EMPTY, Bounds::union);
    let place = DAffine2::from_translation(DVec2::new(-bounds.center().x, GAP - bounds.min.y));
    layers.iter_mut().for_each(|layer| layer.shape = layer.shape.transformed(place));
    layers
}
