//! Scene files: TOML, checked key by key.
//!
//! Lengths are metres, angles degrees, colours linear Rec.709 (`"#rrggbb"` is sRGB). Files that a scene names are looked up
//! beside it and nowhere above it. An unknown key is an error.
//!
//! ```toml
//! background = [0.0, 0.0, 0.0]       # radiance where nothing is
//!
//! [camera]
//! position = [1.5, 3.0, 6.5]
//! look_at = [0.0, 0.2, 0.8]
//! up = [0.0, 1.0, 0.0]
//! fov_y = 50.0
//!
//! [[surface]]
//! kind = "plane"
//! position = [0.0, 0.0, 0.0]         # its middle
//! normal = [0.0, 1.0, 0.0]
//! size = [20.0, 20.0]
//! texture_scale = 1.0                # metres per repeat
//! material = { base_color = "#ffffff", metallic = 0.0, alpha = 0.25 }
//!
//! [[surface]]
//! kind = "mesh"
//! file = "shelf.glb"
//! position = [0.0, 0.0, 0.0]
//! rotation = [0.0, 0.0, 0.0]         # world = T·Rz·Ry·Rx·S
//! scale = 1.0                        # or one per axis
//!
//! [[light]]
//! text = "OPEN"
//! font = "Inter"
//! size = 0.5
//! position = [0.0, 1.3, 0.0]
//! rotation = [0.0, 0.0, 0.0]
//! scale = [1.0, 1.0]                 # negative: mirrored, lit side unchanged
//! power = 60.0
//! color = "#ffcc88"
//! two_sided = false
//! ```
//!
//! A material holds `base_color`, `metallic`, `alpha` (GGX width) or `roughness` (alpha = roughness²), `specular`,
//! `base_color_texture`, `metallic_roughness_texture` (green × roughness, blue × metallic), `normal_texture` and
//! `normal_scale`; see [`Material`] for what they mean and their defaults. Textures are PNG or JPEG. Where there is a
//! texture, the factors that multiply it default to 1. A mesh without `material` has those of its file.
//!
//! A light shines in the shape of exactly one of
//! - `path`: SVG path data in metres, y up, with `fill_rule` = `"nonzero"` or `"evenodd"`;
//! - `svg`: a file, `size` metres along its longer side (1), centred. Its colours multiply the radiance, unless `svg_colors`
//!   is false: then all its parts shine alike;
//! - `text`: with `font` (a bundled family, a font file by its ending, or a list of them: each character takes the
//!   first that has it), `size` (height of the em, metres, 1), `align` = `"left"`, `"center"` or `"right"` (which edge of the
//!   lines is at x = 0), `letter_spacing` and `line_height` (em), `axes` = `{ wght = 700 }`, `direction` = `"auto"`, `"ltr"` or `"rtl"`.
//!   The first baseline is y = 0;
//! - `shape`, about the light's origin: `"disc"` or `"sphere"` with `radius`, `"ellipse"` or `"rectangle"` with `size` = `[width,
//!   height]` (or one number for both), `"tube"` with `radius` and `length` (along the light's x axis; its flat caps shine as well).
//!   Spheres and tubes shine all round: `scale` must not stretch them, `two_sided` has no effect on them, `power` is that of
//!   their whole surface.
//!
//! Any of them may have a `picture`, a PNG or JPEG, whose colours (sRGB, with alpha) multiply the radiance from place to place. It
//! is stretched over the smallest box around the light's parts. An SVG may have one if `svg_colors` is false.
//!
//! A light shines as strongly as one of
//! - `radiance`, W·sr⁻¹·m⁻², one number or one per channel (1);
//! - `power`, W, with `color` (white): the flux of the whole light, both sides together if it is two-sided. Each channel's flux is
//!   π · area · radiance, summed over the parts of the light (for gradients and pictures the mean over the part); `power` is the mean of the three;
//! - `luminance`, nits, with `color`: of the light where it is white. Luminance is 683 lm/W times Y of the radiance, so that
//!   radiance 1 in white is 683 nits.
//!
//! Of `color` only the ratios count.
//!
//! Lights and the camera may move: `[[light.keyframe]]` and `[[camera.keyframe]]` hold a `time` in seconds, growing from one to the
//! next, and what the light or the camera has then: a light's `position`, `rotation`, `scale` and `emission` (a factor of its
//! radiance, one number or one per channel); a camera's `position`, `look_at` or `rotation` (it looks along −z of its own frame, up is
//! y) and `fov_y`. What a keyframe leaves out runs on between those that give it; what none gives is the light's or the camera's own. Before the first keyframe and after the last nothing
//! moves. `interpolation` of the light or the camera is `"linear"`, or `"smooth"`: the same way, from rest to rest, by the ease 3u² − 2u³. Rotations
//! turn about one axis, the shorter way.
//!
//! A light with `slot = true` makes the file a template, which `glyphlight batch` fills with drawings: [`Slot`] says what its keys mean.
//!
//! A table `[compare]` may hold `techniques`, a list of what `glyphlight compare` shows of the scene unless it is told otherwise:
//! `techniques = ["tree", "kuge:1e-6", "uniform:30", "quad"]`.

mod body;
mod error;
pub mod items;
mod light;
mod material;
mod motion;
mod slot;
mod table;

use super::camera::Camera;
use super::folder::{Folder, read};
use super::mesh::Mesh;
use super::motion::CameraMotion;
use super::slot::Slot;
use super::surface::plane;
use super::{Material, Motion, Scene};
pub use error::{Place, ResourceError, SceneError};
use glam::{DAffine3, DMat3, DVec3};
use material::Textures;
use motion::Moving;
use std::path::Path;
use table::{Document, Limit, Table, Value};

/// Largest scene file, bytes.
pub const MAX_BYTES: u64 = 16 << 20;

const COORDINATE: Limit = Limit::new(|v| v.abs() <= 1e9, "within ±1e9");
const DEGREES: Limit = Limit::new(|v| v.abs() <= 1e6, "within ±1e6 degrees");
const FIELD_OF_VIEW: Limit = Limit::new(|v| v > 0.0 && v < 180.0, "more than 0 and less than 180 degrees");
const LENGTH: Limit = Limit::new(|v| (1e-9..=1e9).contains(&v), "a length of 1e-9 to 1e9 m");
const SCALE: Limit = Limit::new(|v| (1e-9..=1e9).contains(&v.abs()), "a scale of ±1e-9 to ±1e9, not 0");
const RADIANCE: Limit = Limit::new(|v| (0.0..=1e12).contains(&v), "between 0 and 1e12");

/// A scene, and what its file asks for and the picture misses.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene, at the time of its first keyframe.
    pub scene: Scene,
    /// How it moves, by its keyframes.
    pub motion: Motion,
    /// One line each; every line names the file, line and key it is about.
    pub warnings: Vec<String>,
    /// The techniques of `[compare]`.
    pub techniques: Vec<Wanted>,
    /// The text of the file.
    pub text: String,
    /// The light to be filled, of a template.
    pub slot: Option<Slot>,
    /// The digests of the files it names.
    pub files: Vec<String>,
}

/// A technique that a scene file asks for. What techniques there are is known elsewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// As written.
    pub name: String,
    /// Where.
    pub place: Place,
}

/// Loads a scene file, and the files it names.
///
/// # Errors
/// The first thing that is wrong, with file, line, key, value and what the value may be.
pub fn load(path: &Path) -> Result<Loaded, SceneError> {
    let (text, folder) = open(path)?;
    parse(text, path, &folder)
}

/// Loads a template: a scene file one light of which is a slot.
///
/// # Errors
/// As [`load`], and where there is no slot.
pub fn load_template(path: &Path) -> Result<Loaded, SceneError> {
    let (text, folder) = open(path)?;
    parse_template(text, path, &folder)
}

fn open(path: &Path) -> Result<(String, Folder), SceneError> {
    let bytes = read(path, MAX_BYTES)?;
    let folder = Folder::of(path)?;
    let text = String::from_utf8(bytes)
        .map_err(|e| SceneError::Encoding { file: path.into(), at: e.utf8_error().valid_up_to() })?;
    Ok((text, folder))
}

/// Loads a scene from the text of its file `path`, which messages name, and the files it names from `folder`.
///
/// # Errors
/// As [`load`].
pub fn parse(text: String, path: &Path, folder: &Folder) -> Result<Loaded, SceneError> {
    let document = Document { file: path.into(), text };
    let mut loaded = document.parse(|root| {
        let loaded = scene(&root, folder)?;
        match &loaded.slot {
            Some(slot) => Err(root.tables("light")?[slot.light].error(SLOT_IS_EMPTY)),
            None => Ok(loaded),
        }
    })?;
    loaded.text = document.text;
    Ok(loaded)
}

/// As [`parse`], of a template.
///
/// # Errors
/// As [`load_template`].
pub fn parse_template(text: String, path: &Path, folder: &Folder) -> Result<Loaded, SceneError> {
    let document = Document { file: path.into(), text };
    let mut loaded = document.parse(|root| {
        let loaded = scene(&root, folder)?;
        if loaded.slot.is_some() { Ok(loaded) } else { Err(root.error("a template has a [[light]] with slot = true")) }
    })?;
    loaded.text = document.text;
    Ok(loaded)
}

/// What is wrong with a slot where a picture is to be made.
const SLOT_IS_EMPTY: &str = "it is a slot, which `glyphlight batch --scene` fills";

fn scene(root: &Table<'_>, folder: &Folder) -> Result<Loaded, SceneError> {
    root.only(&["camera", "surface", "light", "background", "compare"])?;
    let (camera, moving) = camera(&root.require("camera", "a table: [camera]")?.table()?)?;
    let mut spans: Vec<[f64; 2]> = moving.iter().map(|(_, span)| *span).collect();
    let background = root.read("background", |v| v.color(&RADIANCE))?.unwrap_or_default().map(|c| c as f32);
    let mut builder = Builder {
        folder,
        textures: Textures::default(),
        scene: Scene {
            camera,
            triangles: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            lights: Vec::new(),
            background,
        },
        motion: Motion::STILL,
        warnings: Vec::new(),
        techniques: root.read("compare", |v| techniques(&v.table()?))?.unwrap_or_default(),
        slot: None,
    };
    for table in root.tables("surface")? {
        builder.surface(&table)?;
    }
    let lights = root.tables("light")?;
    for (i, table) in lights.iter().enumerate() {
        if let Some(slot) = slot::read(table, i)? {
            builder.scene.lights.push(slot.empty());
            if builder.slot.replace(slot).is_some() {
                return Err(table.error("a template has one slot"));
            }
            continue;
        }
        let (light, moving) = light::read(table, i, folder, &mut builder.warnings)?;
        builder.scene.lights.push(light);
        if let Some((motion, span)) = moving {
            builder.motion.lights.push(motion);
            spans.push(span);
        }
    }
    builder.motion.camera = moving.map(|(motion, _)| motion);
    let joined = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    builder.motion.span = spans.into_iter().reduce(joined).unwrap_or_default();
    Ok(builder.finish())
}

fn camera(table: &Table<'_>) -> Result<(Camera, Moving<CameraMotion>), SceneError> {
    table.only(&[&["position", "look_at", "up", "fov_y"], &motion::KEYS[..]].concat())?;
    let position = table.require("position", "the eye point, [x, y, z]")?.vec3(&COORDINATE)?;
    let target = table.require("look_at", "the point in the middle of the picture, [x, y, z]")?;
    let look_at = target.vec3(&COORDINATE)?;
    if (look_at - position).try_normalize().is_none() {
        return Err(target.error("must not be the camera's position"));
    }
    let up = table.read("up", |v| v.direction(&COORDINATE))?.unwrap_or(DVec3::Y);
    let fov_y = table.read("fov_y", |v| v.number(&FIELD_OF_VIEW))?.unwrap_or(50.0);
    let camera = Camera { position, look_at, up, fov_y };
    let moving = motion::camera(table, &camera)?;
    Ok((camera, moving))
}

fn techniques(table: &Table<'_>) -> Result<Vec<Wanted>, SceneError> {
    table.only(&["techniques"])?;
    let names = table.require("techniques", "a list of techniques, such as [\"tree\", \"uniform:30\"]")?.strings()?;
    names.iter().map(|v| Ok(Wanted { name: v.string()?.into(), place: v.place() })).collect()
}

/// The scene so far.
struct Builder<'a> {
    folder: &'a Folder,
    textures: Textures,
    scene: Scene,
    motion: Motion,
    warnings: Vec<String>,
    techniques: Vec<Wanted>,
    slot: Option<Slot>,
}

impl Builder<'_> {
    fn surface(&mut self, table: &Table<'_>) -> Result<(), SceneError> {
        let kind = table.require("kind", "\"plane\" or \"mesh\"")?;
        if kind.choice(&[("plane", true), ("mesh", false)])? { self.plane(table) } else { self.mesh(table) }
    }

    fn plane(&mut self, table: &Table<'_>) -> Result<(), SceneError> {
        table.only(&["kind", "position", "normal", "size", "texture_scale", "material"])?;
        let position = table.read("position", |v| v.vec3(&COORDINATE))?.unwrap_or_default();
        let normal = table.read("normal", |v| v.direction(&COORDINATE))?.unwrap_or(DVec3::Y);
        let size = table.require("size", "width and depth in metres, [x, y]")?.one_or(&LENGTH)?;
        let texture_scale = table.read("texture_scale", |v| v.number(&LENGTH))?.unwrap_or(1.0);
        let material = self.material(table)?.unwrap_or_default();
        self.scene.materials.push(material);
        let material = self.scene.materials.len() as u32 - 1;
        self.scene.triangles.extend(plane(position, normal, size, texture_scale, material));
        Ok(())
    }

    fn mesh(&mut self, table: &Table<'_>) -> Result<(), SceneError> {
        table.only(&["kind", "file", "position", "rotation", "scale", "material"])?;
        let file = table.require("file", "a .glb or .gltf file beside the scene")?;
        let position = table.read("position", |v| v.vec3(&COORDINATE))?.unwrap_or_default();
        let rotation = table.read("rotation", |v| v.vec3(&DEGREES))?.unwrap_or_default();
        let scale = table.read("scale", |v| v.one_or::<3>(&SCALE))?.unwrap_or([1.0; 3]);
        let world_from_mesh = place(position, rotation, DVec3::from_array(scale));
        let material = self.material(table)?;
        let mesh = Mesh::load(self.folder, file.string()?).map_err(|e| file.resource(e))?;
        let found = mesh.triangles(world_from_mesh).map_err(|e| file.resource(e))?;
        let first = self.scene.materials.len() as u32;
        let mut warnings = found.warnings;
        if let Some(material) = material {
            self.scene.materials.push(material);
            self.scene.triangles.extend(found.triangles.into_iter().map(|mut t| {
                t.material = first;
                t
            }));
        } else {
            let own = mesh.materials().map_err(|e| file.resource(e))?;
            warnings.extend(own.warnings);
            let offset = self.textures.list.len() as u32;
            let moved = |index: Option<u32>| index.map(|i| i + offset);
            self.scene.materials.extend(own.materials.into_iter().map(|m| Material {
                base_color_texture: moved(m.base_color_texture),
                metallic_roughness_texture: moved(m.metallic_roughness_texture),
                normal_texture: moved(m.normal_texture),
                ..m
            }));
            self.textures.list.extend(own.textures);
            self.scene.triangles.extend(found.triangles.into_iter().map(|mut t| {
                t.material += first;
                t
            }));
        }
        let place = file.place();
        self.warnings.extend(warnings.into_iter().map(|w| format!("{place}: {w}")));
        Ok(())
    }

    fn material(&mut self, table: &Table<'_>) -> Result<Option<Material>, SceneError> {
        table.read("material", |v: &Value<'_>| material::read(&v.table()?, self.folder, &mut self.textures))
    }

    fn finish(mut self) -> Loaded {
        self.scene.textures = self.textures.list;
        self.motion.set(&mut self.scene, self.motion.span[0]);
        let Self { scene, motion, warnings, techniques, slot, .. } = self;
        Loaded { scene, motion, warnings, techniques, text: String::new(), slot, files: self.folder.digests() }
    }
}

/// `T·Rz·Ry·Rx·S`, rotation in degrees.
fn place(position: DVec3, rotation: DVec3, scale: DVec3) -> DAffine3 {
    let r = rotation.map(f64::to_radians);
    let turn = DMat3::from_rotation_z(r.z) * DMat3::from_rotation_y(r.y) * DMat3::from_rotation_x(r.x);
    DAffine3::from_mat3_translation(turn * DMat3::from_diagonal(scale), position)
}
