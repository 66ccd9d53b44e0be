//! Masks, prefiltered pictures and the techniques that read them.

use glam::{DVec2, DVec3};
use glyphlight::backend::cpu::CpuBackend;
use glyphlight::backend::{Backend, Horizons, Settings, Technique};
use glyphlight::film::Film;
use glyphlight::light::{AreaLight, Form, Layer, Placement};
use glyphlight::outline::font::Font;
use glyphlight::outline::text::{TextStyle, layout};
use glyphlight::scene::surface::plane;
use glyphlight::scene::{Camera, Material, Scene};
use glyphlight::shape::Shape;

fn text(words: &str) -> Shape {
    let font = Font::bundled("DejaVu Sans").unwrap();
    layout(words, &[font], &TextStyle { size: 1.0, ..TextStyle::default() }).unwrap().shape
}

fn scene(shape: Shape, y: f64, tilt: f64, material: Material) -> Scene {
    let center = shape.bounds().center();
    Scene {
        camera: Camera {
            position: DVec3::new(0.0, 1.2, 3.2),
            look_at: DVec3::new(0.0, 0.2, 0.3),
            up: DVec3::Y,
            fov_y: 50.0,
        },
        triangles: plane(DVec3::ZERO, DVec3::Y, [20.0, 12.0], 1.0, 0).to_vec(),
        materials: vec![material],
        textures: Vec::new(),
        lights: vec![AreaLight {
            name: "light".into(),
            layers: vec![Layer { shape, radiance: DVec3::ONE, opacity: 1.0, picture: None }],
            form: Form::Outline,
            placement: Placement::new(DVec3::new(-center.x, y, 0.0), DVec3::new(tilt, 0.0, 0.0), DVec2::ONE),
            two_sided: false,
        }],
        background: [0.0; 3],
    }
}

fn render(scene: &Scene, technique: Technique) -> Film {
    let settings =
        Settings { width: 160, height: 100, samples: 1, tolerance: 1e-5, technique, horizons: Horizons::Cosine };
    CpuBackend.render(scene, &settings).unwrap().film
}

#[test]
fn experiment() {
    for (name, words) in [("&", "&"), ("text", "Light")] {
        for (y, tilt) in [(0.05, 0.0), (0.3, 0.0), (0.5, 60.0)] {
            for alpha in [0.01_f32, 0.02, 0.0625, 0.1, 0.25, 0.5, -1.0] {
                let material = if alpha < 0.0 {
                    Material { base_color: [0.8; 3], specular: 0.0, ..Material::default() }
                } else {
                    Material { base_color: [1.0; 3], metallic: 1.0, alpha, ..Material::default() }
                };
                let s = scene(text(words), y, tilt, material);
                let t = std::time::Instant::now();
                let a = render(&s, Technique::Tree);
                let t1 = t.elapsed();
                let b = render(&s, Technique::Quad { mask: 512 });
                let t2 = t.elapsed() - t1;
                let pick =
                    |f: &Film| -> Vec<f32> { f.diffuse.iter().zip(&f.specular).map(|(d, s)| d[0] + s[0]).collect() };
                let (a, b) = (pick(&a), pick(&b));
                let peak = a.iter().fold(0.0_f32, |m, v| m.max(*v));
                let rms = (a.iter().zip(&b).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
                    as f32;
                let worst = a.iter().zip(&b).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
                println!(
                    "{name} y {y} tilt {tilt} alpha {alpha}: peak {peak:.3} rmse {:.4} worst {:.3}  {t1:?} {t2:?}",
                    rms / peak,
                    worst / peak
                );
            }
        }
    }
}
