//! Scene files: what they mean, and what each mistake says.

use glam::{DVec2, DVec3, Vec2, Vec3};
use glyphlight::light::AreaLight;
use glyphlight::scene::file::{Loaded, SceneError, load};
use std::f64::consts::PI;
use std::path::Path;

/// The scene file of the README: it works as it stands.
pub const PUBLISHED: &str = r#"
[camera]
position = [1.5, 3.0, 6.5]
look_at = [0.0, 0.2, 0.8]          # up = [0, 1, 0]
fov_y = 50.0                       # degrees
[[surface]]
kind = "plane"                     # or kind = "mesh", file = "shelf.glb"
position = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
size = [20.0, 20.0]
material = { base_color = [1.0, 1.0, 1.0], metallic = 0.0, alpha = 0.25 }   # or roughness; textures by file name
[[light]]
path = "M-1 0 C-1 0.55 -0.55 1 0 1 C0.55 1 1 0.55 1 0 C1 -0.55 0.55 -1 0 -1 C-0.55 -1 -1 -0.55 -1 0 Z"
fill_rule = "nonzero"
position = [0.0, 1.3, 0.0]
rotation = [0.0, 0.0, 0.0]         # degrees; world = T·Rz·Ry·Rx·S
scale = [1.0, 1.0]
radiance = [1.0, 1.0, 1.0]         # or power = 60.0 with color, or luminance (nits) with color
two_sided = false
"#;

const CAMERA: &str = "[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n";

/// A square of 1 m², and the start of its table on line 4.
const SQUARE: &str = "[[light]]\npath = \"M0 0H1V1H0Z\"\n";

/// A folder with a texture, a mesh, an SVG and a font in it, and a file above it.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let inner = dir.path().join("scene");
    std::fs::create_dir_all(inner.join("textures")).unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::fs::copy(data.join("tests/data/scenes/shelf.glb"), inner.join("shelf.glb")).unwrap();
    std::fs::copy(data.join("fonts/DejaVuSans.ttf"), inner.join("own.ttf")).unwrap();
    let mut picture = image::RgbaImage::new(2, 1);
    picture.put_pixel(0, 0, image::Rgba([255, 128, 0, 255]));
    picture.save(inner.join("textures/dots.png")).unwrap();
    picture.save(dir.path().join("above.png")).unwrap();
    let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 4">
        <rect width="2" height="4" fill="#ff0000"/><rect x="2" width="2" height="4" fill="#808080" fill-opacity="0.5"/></svg>"##;
    std::fs::write(inner.join("logo.svg"), svg).unwrap();
    let red =
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 4"><rect width="2" height="4" fill="red"/></svg>"#;
    std::fs::write(inner.join("red.svg"), red).unwrap();
    dir
}

fn load_in(dir: &tempfile::TempDir, text: &str) -> Result<Loaded, SceneError> {
    let path = dir.path().join("scene/scene.toml");
    std::fs::write(&path, text).unwrap();
    load(&path)
}

fn scene(text: &str) -> Loaded {
    load_in(&folder(), text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn light(keys: &str) -> AreaLight {
    scene(&format!("{CAMERA}{SQUARE}{keys}")).scene.lights.remove(0)
}

#[test]
fn the_published_scene_works_as_it_stands() {
    let Loaded { scene, warnings, .. } = scene(PUBLISHED);
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!((scene.camera.position, scene.camera.fov_y), (DVec3::new(1.5, 3.0, 6.5), 50.0));
    assert_eq!((scene.camera.look_at, scene.camera.up), (DVec3::new(0.0, 0.2, 0.8), DVec3::Y));
    assert_eq!((scene.triangles.len(), scene.materials.len(), scene.background), (2, 1, [0.0; 3]));
    let floor = scene.materials[0];
    assert_eq!((floor.base_color, floor.metallic, floor.alpha), ([1.0; 3], 0.0, 0.25));
    for corner in scene.triangles.iter().flat_map(|t| t.vertices) {
        assert_eq!((corner.position.x.abs(), corner.position.y, corner.position.z.abs()), (10.0, 0.0, 10.0));
        assert_eq!(corner.normal, Vec3::Y);
    }
    let light = &scene.lights[0];
    assert_eq!((light.name.as_str(), light.two_sided, light.layers.len()), ("light[0]", false, 1));
    assert_eq!((light.layers[0].radiance, light.layers[0].opacity), (DVec3::ONE, 1.0));
    // The path is a circle to 0.03 %, here drawn clockwise; the shape runs counter-clockwise.
    assert!((light.layers[0].shape.area() - PI).abs() < 0.02);
    assert_eq!(light.placement.point(DVec2::new(0.0, 1.0)), DVec3::new(0.0, 2.3, 0.0));
    assert_eq!(light.placement.normal(), DVec3::Z);
}

#[test]
fn rotation_is_z_after_y_after_x_and_scale_comes_first() {
    let place = |keys: &str| light(keys).placement;
    let turned = place("position = [1, 2, 3]\nrotation = [90, 0, 0]\nscale = [2, 3]");
    // Rx(90°) takes y to z: the sign lies on its back and shines down.
    assert!((turned.point(DVec2::new(1.0, 1.0)) - DVec3::new(3.0, 2.0, 6.0)).length() < 1e-12);
    assert!((turned.normal() - DVec3::NEG_Y * 6.0).length() < 1e-12);
    // Rz(90)·Ry(90)·Rx(90): x → −z → −z → −z; y → z → x → y.
    let all = place("rotation = [90, 90, 90]");
    assert!((all.x - DVec3::NEG_Z).length() < 1e-12 && (all.y - DVec3::Y).length() < 1e-12, "{all:?}");
    let other = place("rotation = [90, 0, 90]");
    assert!((other.x - all.x).length() > 1.0, "another order or angle is told apart");
}

#[test]
fn a_negative_scale_mirrors_the_shape_and_not_the_lit_side() {
    let plain = light("scale = 2");
    let mirrored = light("scale = [-2, 2]");
    assert_eq!(plain.placement, mirrored.placement);
    assert!(mirrored.placement.normal().z > 0.0);
    let bounds = mirrored.layers[0].shape.bounds();
    assert_eq!((bounds.min, bounds.max), (DVec2::new(-1.0, 0.0), DVec2::new(0.0, 1.0)));
    assert!(mirrored.layers[0].shape.area() > 0.0);
}

/// Flux of a diffuse emitter per channel, W.
fn flux(light: &AreaLight) -> DVec3 {
    let sides = if light.two_sided { 2.0 } else { 1.0 };
    let area = |l: &glyphlight::light::Layer| l.shape.area() * light.placement.normal().length();
    light.layers.iter().map(|l| l.radiance * (PI * sides * area(l))).sum()
}

#[test]
fn emission_is_radiance_power_or_luminance() {
    let radiance = |keys: &str| light(keys).layers[0].radiance;
    assert_eq!(radiance(""), DVec3::ONE);
    assert_eq!(radiance("radiance = [1, 2.5, 0]"), DVec3::new(1.0, 2.5, 0.0));
    assert_eq!(radiance("radiance = 3"), DVec3::splat(3.0));
    // 60 W from 6 m² of one side: L = Φ/(π·A).
    let sixty = light("power = 60\nscale = [2, 3]");
    assert!((sixty.layers[0].radiance - DVec3::splat(60.0 / (PI * 6.0))).length() < 1e-12);
    let both = light("power = 60\nscale = [2, 3]\ntwo_sided = true");
    assert!((both.layers[0].radiance * 2.0 - sixty.layers[0].radiance).length() < 1e-12);
    let tinted = light("power = 60\ncolor = [4, 2, 0]\nscale = [-2, 0.1]\ntwo_sided = true");
    assert!((flux(&tinted).element_sum() / 3.0 - 60.0).abs() < 1e-9);
    assert!((flux(&tinted) - DVec3::new(120.0, 60.0, 0.0)).length() < 1e-9, "power keeps the colour");
    // 683 nits of white are radiance 1; 683 nits of green are 1/0.7152.
    assert!((radiance("luminance = 683") - DVec3::ONE).length() < 1e-12);
    assert!((radiance("luminance = 683\ncolor = \"#00ff00\"") - DVec3::Y / 0.7152).length() < 1e-12);
    let warm = radiance("luminance = 500\ncolor = \"#ffcc88\"");
    assert!((warm.dot(DVec3::new(0.2126, 0.7152, 0.0722)) * 683.0 - 500.0).abs() < 1e-9);
    // The strength of a colour does not count, only its ratios.
    assert!(
        (radiance("luminance = 9\ncolor = [1, 2, 3]") - radiance("luminance = 9\ncolor = [2, 4, 6]")).length() < 1e-12
    );
}

#[test]
fn svg_lights_have_their_colours() {
    let logo = |keys: &str| {
        let text = format!("{CAMERA}[[light]]\nsvg = \"logo.svg\"\nsize = 2.0\n{keys}");
        scene(&text).scene.lights.remove(0)
    };
    let plain = logo("radiance = [10, 10, 10]");
    assert_eq!((plain.name.as_str(), plain.layers.len()), ("logo.svg", 2));
    assert!((plain.layers.iter().map(|l| l.shape.area()).sum::<f64>() - 4.0).abs() < 1e-6);
    assert!((plain.layers[0].radiance - DVec3::new(10.0, 0.0, 0.0)).length() < 1e-6);
    // sRGB 128 is 0.2158605 of linear light; half of it at half opacity.
    assert!((plain.layers[1].radiance - DVec3::splat(10.0 * 0.215_860_5 * 0.5)).length() < 1e-4);
    assert_eq!((plain.layers[0].opacity, plain.layers[1].opacity), (1.0, 0.5));
    let power = logo("power = 30");
    assert!((flux(&power).element_sum() / 3.0 - 30.0).abs() < 1e-9);
    assert!(power.layers[1].radiance.x < power.layers[0].radiance.x, "the colours keep their ratio");
    let white = logo("svg_colors = false");
    assert_eq!((white.layers[0].radiance, white.layers[1].radiance), (DVec3::ONE, DVec3::splat(0.5)));

    let off = scene(&format!("{CAMERA}[[light]]\nsvg = \"red.svg\"\nradiance = [0, 1, 1]\n"));
    assert!(off.warnings[0].contains("black and does not shine; svg_colors = false"), "{:?}", off.warnings);
    let lit = scene(&format!("{CAMERA}[[light]]\nsvg = \"red.svg\"\nradiance = [0, 1, 1]\nsvg_colors = false\n"));
    assert_eq!((lit.warnings.len(), lit.scene.lights[0].layers[0].radiance), (0, DVec3::new(0.0, 1.0, 1.0)));
}

#[test]
fn text_lights_take_every_key() {
    let text = |keys: &str| {
        let text = format!("{CAMERA}[[light]]\ntext = \"OPEN\\nlate\"\n{keys}");
        scene(&text).scene.lights.remove(0)
    };
    let bounds = |l: &AreaLight| l.layers[0].shape.bounds();
    let plain = text("font = \"Inter\"");
    assert_eq!(plain.name, "OPEN\nlate");
    let differs = |keys: &str| {
        let other = text(&format!("font = \"Inter\"\n{keys}"));
        assert!(other.layers[0].shape != plain.layers[0].shape, "{keys} has no effect");
        other
    };
    let double = differs("size = 2.0");
    assert!((bounds(&double).size() - bounds(&plain).size() * 2.0).length() < 1e-6);
    let right = differs("align = \"right\"");
    assert!(bounds(&right).max.x < 0.1 && bounds(&differs("align = \"center\"")).center().x.abs() < 0.1);
    assert!(bounds(&differs("letter_spacing = 0.5")).size().x > bounds(&plain).size().x + 1.0);
    assert!(bounds(&differs("line_height = 3.0")).min.y < bounds(&plain).min.y - 1.0);
    assert!(differs("axes = { wght = 900 }").layers[0].shape.area() > plain.layers[0].shape.area() * 1.2);
    let other = text("font = [\"own.ttf\", \"Inter\"]\ndirection = \"rtl\"");
    assert!(other.layers[0].shape != plain.layers[0].shape);
    assert_eq!(text("").layers[0].shape, plain.layers[0].shape, "Inter is the default font");
    assert_eq!(
        scene(&format!("{CAMERA}[[light]]\ntext = \"نور\"\n")).scene.lights.len(),
        1,
        "other scripts need no font key"
    );
    let left = scene(&format!("{CAMERA}[[light]]\ntext = \"O\"\nfill_rule = \"nonzero\"\n"));
    assert!(left.warnings[0].contains("fill_rule: has no effect on text"), "{:?}", left.warnings);
}

#[test]
fn materials_read_every_key() {
    let material = |keys: &str| {
        let text = format!("{CAMERA}[[surface]]\nkind = \"plane\"\nsize = 2\n[surface.material]\n{keys}");
        let loaded = scene(&text).scene;
        (loaded.materials[0], loaded.textures)
    };
    let (plain, _) = material("");
    assert_eq!(plain, glyphlight::scene::Material::default());
    assert_eq!(material("roughness = 0.5").0.alpha, 0.25);
    assert_eq!(material("alpha = 0.5").0.alpha, 0.5);
    assert_eq!(material("specular = 0").0.specular, 0.0);
    let grey = material("base_color = \"#808080\"").0.base_color[0];
    assert!((grey - 0.215_860_5).abs() < 1e-6, "a colour in quotes is sRGB: {grey}");
    assert_eq!(material("base_color = [0.5, 0, 1]").0.base_color, [0.5, 0.0, 1.0]);
    let (textured, textures) = material(
        "base_color_texture = \"textures/dots.png\"\nmetallic_roughness_texture = \"textures/dots.png\"\n\
         normal_texture = \"textures/dots.png\"\nnormal_scale = 0.3",
    );
    assert_eq!(textured.base_color_texture, Some(0));
    assert_eq!(
        (textured.metallic_roughness_texture, textured.normal_texture, textured.normal_scale),
        (Some(1), Some(1), 0.3)
    );
    assert_eq!(textures.iter().map(|t| t.srgb).collect::<Vec<_>>(), [true, false], "read once for each use");
    assert_eq!((textures[0].width, textures[0].texels[0]), (2, 0xff00_80ff));
    assert_eq!(
        (textured.base_color, textured.metallic, textured.alpha),
        ([1.0; 3], 1.0, 1.0),
        "factors of textures are 1"
    );
}

#[test]
fn planes_and_meshes_stand_where_they_are_put() {
    let wall = scene(&format!(
        "{CAMERA}[[surface]]\nkind = \"plane\"\nposition = [0, 1, -2]\nnormal = [0, 0, 3]\nsize = [4, 2]\ntexture_scale = 0.5\n"
    ));
    let corners = wall.scene.triangles.iter().flat_map(|t| t.vertices);
    for corner in corners {
        assert_eq!((corner.position.x.abs(), corner.position.z, corner.normal), (2.0, -2.0, Vec3::Z));
        assert_eq!((corner.position.y - 1.0).abs(), 1.0);
        assert_eq!(corner.uv.abs(), Vec2::new(4.0, 2.0));
    }
    let mesh = |keys: &str| {
        let text = format!(
            "{CAMERA}[[surface]]\nkind = \"plane\"\nsize = 2\n[[surface]]\nkind = \"mesh\"\nfile = \"shelf.glb\"\n{keys}"
        );
        scene(&text).scene
    };
    let plain = mesh("");
    assert_eq!((plain.triangles.len(), plain.materials.len(), plain.textures.len()), (2 + 352, 1 + 3, 3));
    assert_eq!(plain.triangles[2].material, 1, "materials of the mesh come after those before it");
    assert_eq!(plain.materials[1].normal_texture, Some(2));
    let moved = mesh("position = [0, 0, 7]\nrotation = [0, 90, 0]\nscale = [1, -2, 1]");
    let turned = |p: DVec3| DVec3::new(p.z, -2.0 * p.y, 7.0 - p.x);
    for (a, b) in plain.triangles.iter().zip(&moved.triangles).skip(2) {
        for (v, w) in a.vertices.iter().zip(b.vertices) {
            assert!((turned(v.position) - w.position).length() < 1e-9);
        }
    }
    let painted = mesh("material = { base_color = \"#ff0000\" }");
    assert_eq!(
        (painted.materials.len(), painted.textures.len()),
        (2, 0),
        "an own material leaves those of the file unread"
    );
    assert!(painted.triangles[2..].iter().all(|t| t.material == 1));
    assert!(
        (mesh("scale = 2").triangles[5].vertices[0].position - plain.triangles[5].vertices[0].position * 2.0).length()
            < 1e-9
    );
}

#[test]
fn mistakes_name_file_line_key_value_and_limit() {
    let dir = folder();
    let with = |text: &str| match load_in(&dir, text) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("loads:\n{text}"),
    };
    let camera = |line: &str| with(&format!("[camera]\nposition = [0, 1, 5]\nlook_at = [0, 0, 0]\n{line}\n"));
    let light = |line: &str| with(&format!("{CAMERA}{SQUARE}{line}\n"));
    let lamp = |lines: &str| with(&format!("{CAMERA}[[light]]\n{lines}\n"));
    let surface = |lines: &str| with(&format!("{CAMERA}[[surface]]\n{lines}\n"));
    let plane = |lines: &str| surface(&format!("kind = \"plane\"\nsize = 2\n{lines}"));
    let material = |line: &str| plane(&format!("[surface.material]\n{line}"));
    let cases = [
        (with(""), "scene.toml:1: camera: missing; it holds a table: [camera]"),
        (with("[camera]\nlook_at = [0, 0, 0]\n"), "scene.toml:1: camera.position: missing; it holds the eye point"),
        (with("[camera]\nposition = [0, 1, 5\n"), "scene.toml:2:"),
        (
            with(&format!("{CAMERA}colour = 3\n")),
            "scene.toml:4: camera.colour: unknown key; known here: position, look_at, up, fov_y",
        ),
        (
            with(&format!("{CAMERA}[[lights]]\n")),
            "scene.toml:4: lights: unknown key; known here: camera, surface, light, background",
        ),
        (with(&format!("{CAMERA}[light]\npath = \"\"\n")), "scene.toml:4: light = "),
        (
            with(&format!("background = [0, -1, 0]\n{CAMERA}")),
            "scene.toml:1: background[1] = -1: must be between 0 and 1e12",
        ),
        (camera("fov_y = 180"), "scene.toml:4: camera.fov_y = 180: must be more than 0 and less than 180 degrees"),
        (camera("fov_y = nan"), "camera.fov_y = nan: must be more than 0"),
        (camera("fov_y = \"wide\""), "camera.fov_y = \"wide\": must be a number more than 0"),
        (camera("up = [0, 0, 0]"), "scene.toml:4: camera.up = [0, 0, 0]: must be a direction"),
        (camera("up = [0, inf, 0]"), "camera.up[1] = inf: must be within ±1e9"),
        (camera("up = [0, 1]"), "camera.up = [0, 1]: must be an array of 3 numbers"),
        (
            with("[camera]\nposition = [0, 1, 5]\nlook_at = [0, 1, 5.0]\n"),
            "scene.toml:3: camera.look_at = [0, 1, 5.0]: must not be the camera's position",
        ),
        (light("radiance = [1, -0.5, 1]"), "scene.toml:6: light[0].radiance[1] = -0.5: must be between 0 and 1e12"),
        (light("radiance = [1,\n  2,\n  nan]"), "scene.toml:8: light[0].radiance[2] = nan"),
        (light("radiance = [1, 1]"), "light[0].radiance = [1, 1]: must be an array of 3 numbers"),
        (
            light("power = 3\nluminance = 4"),
            "scene.toml:4: light[0]: give one of radiance, power, luminance, not power and luminance",
        ),
        (light("color = \"#ffffff\""), "light[0]: color goes with power or luminance"),
        (light("power = 3\ncolor = \"#fff\""), "light[0].color = \"#fff\": must be a colour: \"#rrggbb\""),
        (light("power = 3\ncolor = [0, 0, 0]"), "light[0].color = [0, 0, 0]: must not be black"),
        (light("scale = [1, 0]"), "scene.toml:6: light[0].scale[1] = 0: must be a scale of ±1e-9 to ±1e9, not 0"),
        (light("rotation = [0, 0, 1e300]"), "light[0].rotation[2] = 1e300: must be within ±1e6 degrees"),
        (light("two_sided = 1"), "light[0].two_sided = 1: must be true or false"),
        (light("fill_rule = \"winding\""), "light[0].fill_rule = \"winding\": must be one of \"nonzero\", \"evenodd\""),
        (light("size = 2"), "scene.toml:6: light[0].size: unknown key; known here: path, position"),
        (
            light("svg = \"logo.svg\""),
            "scene.toml:4: light[0]: a light has exactly one of path, svg, text, shape; path and svg are given",
        ),
        (lamp("radiance = 1"), "light[0]: a light has exactly one of path, svg, text, shape; none is given"),
        (lamp("path = \"M0 0L1 1Z\""), "scene.toml:5: light[0].path = \"M0 0L1 1Z\": the path encloses no area"),
        (lamp("path = \"\""), "scene.toml:5: light[0].path = \"\""),
        (lamp("path = \"M0 0 L1 nan Z\""), "scene.toml:5: light[0].path = "),
        (
            lamp("svg = \"red.svg\"\npower = 3\ncolor = \"#00ffff\""),
            "light[0].power = 3: no radiance gives this power, since the light is black",
        ),
        (lamp("svg = \"none.svg\""), "scene.toml:5: light[0].svg = \"none.svg\": there is no file"),
        (lamp("svg = \"textures\""), "light[0].svg = \"textures\": "),
        (lamp("svg = \"own.ttf\""), "light[0].svg = \"own.ttf\": "),
        (lamp("text = \"\""), "light[0].text = \"\": the text is empty"),
        (lamp("text = \"A\\u6C38\"\nfont = \"Inter\""), "U+6C38"),
        (lamp("text = \"A\"\nfont = \"Comic Sans\""), "light[0].font = \"Comic Sans\": "),
        (lamp("text = \"A\"\nfont = [\"Inter\", \"none.ttf\"]"), "light[0].font[1] = \"none.ttf\": there is no file"),
        (lamp("text = \"A\"\nfont = \"shelf.glb\""), "light[0].font = \"shelf.glb\": "),
        (lamp("text = \"A\"\naxes = { weight = 700 }"), "light[0].axes.weight = 700: \"weight\" is not a tag"),
        (lamp("text = \"A\"\naxes = { wght = 9000 }"), "wght"),
        (lamp("text = \"A\"\nsize = 0"), "light[0].size = 0: must be a length"),
        (
            lamp("text = \"A\"\nalign = \"middle\""),
            "light[0].align = \"middle\": must be one of \"left\", \"center\", \"right\"",
        ),
        (surface("size = 2"), "scene.toml:4: surface[0].kind: missing; it holds \"plane\" or \"mesh\""),
        (
            surface("kind = \"sphere\""),
            "scene.toml:5: surface[0].kind = \"sphere\": must be one of \"plane\", \"mesh\"",
        ),
        (surface("kind = \"plane\""), "surface[0].size: missing"),
        (surface("kind = \"plane\"\nsize = [1, -1]"), "surface[0].size[1] = -1: must be a length of 1e-9 to 1e9 m"),
        (plane("normal = [0, 0, 0]"), "surface[0].normal = [0, 0, 0]: must be a direction"),
        (
            plane("file = \"shelf.glb\""),
            "scene.toml:7: surface[0].file: unknown key; known here: kind, position, normal, size",
        ),
        (
            surface("kind = \"mesh\"\nfile = \"none.glb\""),
            "scene.toml:6: surface[0].file = \"none.glb\": none.glb: file: there is no file",
        ),
        (surface("kind = \"mesh\"\nfile = \"own.ttf\""), "own.ttf: JSON: not glTF"),
        (surface("kind = \"mesh\"\nfile = \"textures\""), "is a folder, not a file"),
        (material("metallic = 1.5"), "scene.toml:8: surface[0].material.metallic = 1.5: must be between 0 and 1"),
        (material("alpha = -0.1"), "surface[0].material.alpha = -0.1: must be between 0 and 1"),
        (
            material("alpha = 0.1\nroughness = 0.1"),
            "scene.toml:7: surface[0].material: alpha and roughness are the same thing",
        ),
        (material("base_color = [2, 0, 0]"), "surface[0].material.base_color[0] = 2: must be between 0 and 1"),
        (material("base_color = 7"), "surface[0].material.base_color = 7: must be an array of 3 numbers"),
        (
            material("color = \"#ff0000\""),
            "scene.toml:8: surface[0].material.color: unknown key; known here: base_color",
        ),
        (
            material("normal_texture = \"own.ttf\""),
            "surface[0].material.normal_texture = \"own.ttf\": not a PNG or JPEG picture",
        ),
        (material("normal_texture = \"../above.png\""), "has a `..`"),
        (material("normal_texture = \"/etc/passwd\""), "\"/etc/passwd\": \"/etc/passwd\" is an absolute path"),
        (material("normal_texture = 4"), "surface[0].material.normal_texture = 4: must be a string"),
        (plane("material = \"wood\""), "surface[0].material = \"wood\": must be a table"),
    ];
    let wrong: Vec<_> = cases.iter().filter(|(message, wanted)| !message.contains(wanted)).collect();
    assert!(wrong.is_empty(), "message and what it should contain: {wrong:#?}");
    for (message, _) in cases {
        assert!(message.contains("scene.toml:") && !message.contains('\n'), "one line with its place: {message:?}");
    }
}

#[test]
fn what_is_no_scene_file_is_said_so() {
    let dir = folder();
    let error = |path: &Path| load(path).unwrap_err().to_string();
    let missing = error(&dir.path().join("none.toml"));
    assert!(missing.contains("there is no file") && missing.contains("none.toml"), "{missing}");
    let folder = error(dir.path());
    assert!(folder.contains("is a folder, not a file"), "{folder}");
    let path = dir.path().join("bytes.toml");
    std::fs::write(&path, b"[camera]\n\xff\xfe").unwrap();
    assert!(error(&path).contains("bytes.toml: not UTF-8 text at byte 9"), "{}", error(&path));
    std::fs::write(&path, "a = ".to_owned() + &"[".repeat(100_000)).unwrap();
    assert!(matches!(load(&path), Err(SceneError::Syntax { .. })));
    std::fs::File::create(&path).unwrap().set_len(glyphlight::scene::file::MAX_BYTES + 1).unwrap();
    assert!(error(&path).contains("at most 16777216 are read"), "{}", error(&path));
}

#[cfg(unix)]
#[test]
fn links_may_stay_inside_and_not_lead_out() {
    let dir = folder();
    let inner = dir.path().join("scene");
    std::os::unix::fs::symlink("../above.png", inner.join("out.png")).unwrap();
    std::os::unix::fs::symlink("textures/dots.png", inner.join("in.png")).unwrap();
    std::os::unix::fs::symlink("..", inner.join("up")).unwrap();
    let with = |name: &str| {
        let text =
            format!("{CAMERA}[[surface]]\nkind = \"plane\"\nsize = 2\nmaterial = {{ normal_texture = \"{name}\" }}\n");
        load_in(&dir, &text)
    };
    assert_eq!(with("in.png").unwrap().scene.textures.len(), 1);
    for name in ["out.png", "up/above.png"] {
        let error = with(name).unwrap_err().to_string();
        assert!(error.contains("out of the folder") && error.contains("normal_texture"), "{error}");
    }
    // A scene that is itself reached by a link reads beside the link's name.
    let path = dir.path().join("scene/scene.toml");
    std::fs::write(&path, PUBLISHED).unwrap();
    std::os::unix::fs::symlink(&path, dir.path().join("linked.toml")).unwrap();
    assert!(load(&dir.path().join("linked.toml")).is_ok());
}

#[test]
fn a_picture_too_large_is_refused_before_it_is_decoded() {
    let dir = folder();
    // The header of a PNG of 8193 × 1 texels; its data never come.
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x20\x01\0\0\0\x01\x08\x02\0\0\0".to_vec();
    let crc = bytes[12..29].iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    });
    bytes.extend((!crc).to_be_bytes());
    bytes.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    std::fs::write(dir.path().join("scene/large.png"), bytes).unwrap();
    let text =
        format!("{CAMERA}[[surface]]\nkind = \"plane\"\nsize = 2\nmaterial = {{ normal_texture = \"large.png\" }}\n");
    let error = load_in(&dir, &text).unwrap_err().to_string();
    assert!(error.contains("8193 × 1 texels; each side must be 1 to 8192"), "{error}");
}
