//! The oracle of SVG tests: usvg's tree painted in order, in linear light on black, with coverage by tiny-skia.
//! It knows fills, strokes, groups, opacity, clip paths, text, patterns, and gradients to 8 bits; no images, filters, masks.

use tiny_skia::{
    FillRule, GradientStop, LinearGradient, Mask, Paint, Pixmap, Point, RadialGradient, Rect, Shader, SpreadMode,
    Transform,
};
use usvg::{BaseGradient, ClipPath, Group, Node, PaintOrder, Tree};

/// Pixels of a pattern's tile for one of the picture.
const TILE_PIXELS: f32 = 8.0;

/// A picture in linear light, premultiplied, row 0 at the top.
#[derive(Clone)]
pub struct Picture {
    pub pixels: Vec<[f64; 4]>,
    pub width: usize,
    pub height: usize,
    /// Pixels per unit of the SVG.
    pub scale: f64,
}

impl Picture {
    /// Paints the tree with `scale` pixels per unit, moved by a part of a pixel; one pixel wider and higher than needed.
    pub fn paint(tree: &Tree, scale: f64, shift: (f64, f64)) -> Self {
        let size = [tree.size().width(), tree.size().height()].map(|v| (f64::from(v) * scale).ceil() as usize + 1);
        let mut picture = Self { pixels: vec![[0.0; 4]; size[0] * size[1]], width: size[0], height: size[1], scale };
        let at = Transform::from_row(scale as f32, 0.0, 0.0, scale as f32, shift.0 as f32, shift.1 as f32);
        picture.group(tree.root(), at);
        picture
    }

    fn blank(&self) -> Self {
        Self { pixels: vec![[0.0; 4]; self.pixels.len()], ..*self }
    }

    /// Lays `color` (premultiplied) over pixel `i`.
    fn over(&mut self, i: usize, color: [f64; 4]) {
        let rest = 1.0 - color[3];
        self.pixels[i] = std::array::from_fn(|k| color[k] + self.pixels[i][k] * rest);
    }

    fn group(&mut self, group: &Group, at: Transform) {
        let at = at.pre_concat(group.transform());
        let mut own = self.blank();
        for node in group.children() {
            match node {
                Node::Group(g) => own.group(g, at),
                Node::Text(t) => own.group(t.flattened(), at),
                Node::Path(p) => own.path(p, at),
                Node::Image(_) => panic!("the painter knows no images"),
            }
        }
        let clip = group.clip_path().map(|clip| self.clip(clip, at));
        for i in 0..self.pixels.len() {
            let part = f64::from(group.opacity().get()) * clip.as_ref().map_or(1.0, |c| c[i]);
            self.over(i, own.pixels[i].map(|v| v * part));
        }
    }

    fn path(&mut self, path: &usvg::Path, at: Transform) {
        let order = [path.paint_order() == PaintOrder::FillAndStroke, path.paint_order() == PaintOrder::StrokeAndFill];
        for fills in order {
            let (coverage, paint, opacity) = match (path.is_visible(), fills, path.fill(), path.stroke()) {
                (true, true, Some(fill), _) => (self.fill(path, at), fill.paint(), fill.opacity()),
                (true, false, _, Some(stroke)) => (self.stroke(path, at), stroke.paint(), stroke.opacity()),
                _ => continue,
            };
            let colors = self.colors(paint, at);
            for (i, c) in coverage.into_iter().enumerate() {
                self.over(i, colors(i).map(|v| v * c * f64::from(opacity.get())));
            }
        }
    }

    /// The colour of a paint at each pixel, linear and premultiplied.
    fn colors(&self, paint: &usvg::Paint, at: Transform) -> Box<dyn Fn(usize) -> [f64; 4]> {
        let point = |x: f32, y: f32| Point::from_xy(x, y);
        match paint {
            usvg::Paint::Color(color) => {
                let color = linear([color.red, color.green, color.blue], 255);
                Box::new(move |_| color)
            }
            usvg::Paint::LinearGradient(g) => {
                let place = at.pre_concat(g.transform());
                self.shaded(LinearGradient::new(
                    point(g.x1(), g.y1()),
                    point(g.x2(), g.y2()),
                    stops(g),
                    spread(g),
                    place,
                ))
            }
            usvg::Paint::RadialGradient(g) => {
                let (focus, center, place) =
                    (point(g.fx(), g.fy()), point(g.cx(), g.cy()), at.pre_concat(g.transform()));
                self.shaded(RadialGradient::new(focus, g.fr().get(), center, g.r().get(), stops(g), spread(g), place))
            }
            usvg::Paint::Pattern(p) => {
                let (rect, place) = (p.rect(), at.pre_concat(p.transform()));
                let scale = TILE_PIXELS * place.get_scale().0.max(place.get_scale().1);
                let [width, height] = [rect.width(), rect.height()].map(|v| (v * scale).ceil() as usize);
                let mut tile = Self { pixels: vec![[0.0; 4]; width * height], width, height, scale: f64::from(scale) };
                tile.group(p.root(), Transform::from_scale(scale, scale));
                let (back, across) = (place.invert().expect("an inverse"), self.width);
                Box::new(move |i| {
                    let mut p = Point::from_xy((i % across) as f32 + 0.5, (i / across) as f32 + 0.5);
                    back.map_point(&mut p);
                    let [x, y] =
                        [(p.x - rect.x()).rem_euclid(rect.width()), (p.y - rect.y()).rem_euclid(rect.height())];
                    let [x, y] = [((x * scale) as usize).min(width - 1), ((y * scale) as usize).min(height - 1)];
                    tile.pixels[y * width + x]
                })
            }
        }
    }

    fn shaded(&self, shader: Option<Shader<'static>>) -> Box<dyn Fn(usize) -> [f64; 4]> {
        let mut map = Pixmap::new(self.width as u32, self.height as u32).expect("a picture has pixels");
        let paint = Paint { shader: shader.expect("a gradient"), ..Paint::default() };
        let all = Rect::from_xywh(0.0, 0.0, self.width as f32, self.height as f32).expect("a rectangle");
        map.fill_rect(all, &paint, Transform::identity(), None);
        Box::new(move |i| {
            let c = map.pixels()[i].demultiply();
            linear([c.red(), c.green(), c.blue()], c.alpha())
        })
    }

    fn fill(&self, path: &usvg::Path, at: Transform) -> Vec<f64> {
        let rule = match path.fill().map(usvg::Fill::rule) {
            Some(usvg::FillRule::EvenOdd) => FillRule::EvenOdd,
            _ => FillRule::Winding,
        };
        let mut mask = Mask::new(self.width as u32, self.height as u32).expect("a mask has pixels");
        mask.fill_path(path.data(), rule, true, at);
        mask.data().iter().map(|&v| f64::from(v) / 255.0).collect()
    }

    fn stroke(&self, path: &usvg::Path, at: Transform) -> Vec<f64> {
        let mut map = Pixmap::new(self.width as u32, self.height as u32).expect("a picture has pixels");
        let stroke = path.stroke().expect("a stroked path").to_tiny_skia();
        map.stroke_path(path.data(), &Paint::default(), &stroke, at, None);
        map.pixels().iter().map(|p| f64::from(p.alpha()) / 255.0).collect()
    }

    fn clip(&self, clip: &ClipPath, at: Transform) -> Vec<f64> {
        let mut own = self.blank();
        own.group(clip.root(), at.pre_concat(clip.transform()));
        let outer = clip.clip_path().map(|outer| self.clip(outer, at));
        let covered = own.pixels.iter().map(|p| p[3]).enumerate();
        covered.map(|(i, a)| a * outer.as_ref().map_or(1.0, |o| o[i])).collect()
    }

    /// Whether the 3×3 neighbourhood of a pixel is of one colour, within `tolerance`.
    pub fn is_flat(&self, x: usize, y: usize, tolerance: f64) -> bool {
        let here = self.pixels[y * self.width + x];
        (0..9).all(|k| {
            let there = self.pixels[(y + k / 3 - 1) * self.width + x + k % 3 - 1];
            here.iter().zip(there).all(|(a, b)| (a - b).abs() < tolerance)
        })
    }
}

fn stops(gradient: &BaseGradient) -> Vec<GradientStop> {
    let stop = |s: &usvg::Stop| {
        let [r, g, b] = [s.color().red, s.color().green, s.color().blue];
        let alpha = (s.opacity().get() * 255.0).round() as u8;
        GradientStop::new(s.offset().get(), tiny_skia::Color::from_rgba8(r, g, b, alpha))
    };
    gradient.stops().iter().map(stop).collect()
}

fn spread(gradient: &BaseGradient) -> SpreadMode {
    match gradient.spread_method() {
        usvg::SpreadMethod::Pad => SpreadMode::Pad,
        usvg::SpreadMethod::Reflect => SpreadMode::Reflect,
        usvg::SpreadMethod::Repeat => SpreadMode::Repeat,
    }
}

/// The linear, premultiplied colour of 8-bit sRGB (IEC 61966-2-1).
fn linear(srgb: [u8; 3], alpha: u8) -> [f64; 4] {
    let alpha = f64::from(alpha) / 255.0;
    let [r, g, b] = srgb.map(|v| {
        let v = f64::from(v) / 255.0;
        alpha * if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    [r, g, b, alpha]
}
