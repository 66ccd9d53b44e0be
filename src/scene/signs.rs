//! The scene of many texts or logos: signs that stand about on a floor and light it.

use super::surface::plane;
use super::{Camera, Material, Scene};
use crate::light::{AreaLight, Form, Layer, Placement};
use crate::shape::Shape;
use glam::{DAffine2, DVec2, DVec3};

/// How many signs stand how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignsOptions {
    /// Number of signs.
    pub count: u32,
    /// Distance of neighbours in the grid that they stand in, before jitter, over a sign's width.
    pub spacing: f64,
    /// Width of a sign, metres.
    pub width: f64,
    /// Height of a sign's lower edge over the floor, at least and at most, over its width.
    pub heights: [f64; 2],
    /// Of the places, turns, words and colours.
    pub seed: u64,
    /// The floor's.
    pub material: Material,
}

impl Default for SignsOptions {
    fn default() -> Self {
        Self { count: 1, spacing: 2.0, width: 1.0, heights: [0.2, 0.65], seed: 1, material: Material::default() }
    }
}

/// Radiance of the signs, linear Rec.709: tubes of neon, argon and phosphors.
const COLORS: [[f64; 3]; 6] =
    [[2.6, 0.5, 0.2], [0.3, 0.9, 2.4], [1.6, 1.5, 1.2], [2.2, 0.3, 1.4], [0.4, 2.0, 0.6], [2.2, 1.6, 0.3]];

/// How far a sign looks down, degrees.
const DOWN: f64 = 20.0;
/// Shift of a sign along either axis, in spacings.
const JITTER: f64 = 0.3;
/// Vertical field of view of the camera, degrees.
const FOV_Y: f64 = 40.0;

/// Signs with the outlines `words` over a floor, in a square grid with jitter, turned all ways about the vertical. The camera
/// looks down at 45° on the middle of the grid, from as far as shows most of it, and sees nothing but floor.
pub fn signs(words: &[Shape], options: &SignsOptions) -> Scene {
    let mut random = Random(options.seed);
    let SignsOptions { count, spacing, width, heights, material, .. } = *options;
    let columns = f64::from(count.max(1)).sqrt().round();
    let rows = (f64::from(count) / columns).ceil();
    let step = spacing * width;
    let light = |i: u32| {
        let cell = DVec2::new(f64::from(i % columns as u32), f64::from(i / columns as u32));
        let mut jitter = || random.within(-JITTER, JITTER);
        let at = (cell + 0.5 - DVec2::new(columns, rows) * 0.5 + DVec2::new(jitter(), jitter())) * step;
        let turn = DVec3::new(random.within(0.0, DOWN), random.within(-180.0, 180.0), 0.0);
        let word = &words[random.below(words.len())];
        let color = DVec3::from(COLORS[random.below(COLORS.len())]);
        let bounds = word.bounds();
        let size = bounds.size() * (width / bounds.size().x);
        let height = random.within(heights[0], heights[1]) * width + 0.5 * size.y;
        let position = DVec3::new(at.x, height, at.y);
        let scale = DAffine2::from_scale(size / bounds.size());
        let shape = word.transformed(scale * DAffine2::from_translation(-bounds.center()));
        AreaLight {
            name: format!("sign {}", i + 1),
            layers: vec![Layer { shape, radiance: color, opacity: 1.0, picture: None }],
            form: Form::Outline,
            placement: Placement::new(position, turn, DVec2::ONE),
            two_sided: false,
        }
    };
    let lights = if words.is_empty() { Vec::new() } else { (0..count).map(light).collect() };
    let extent = columns * step;
    let floor = 40.0 * extent;
    let eye = DVec3::new(0.0, 1.0, 1.0) * extent * 0.8;
    Scene {
        camera: Camera { position: eye, look_at: DVec3::ZERO, up: DVec3::Y, fov_y: FOV_Y },
        triangles: plane(DVec3::ZERO, DVec3::Y, [floor, floor], width, 0).into(),
        materials: vec![material],
        textures: Vec::new(),
        lights,
        background: [0.0; 3],
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }
}
