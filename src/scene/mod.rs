//! The scene: camera, surfaces, lights.

pub mod bundled;
pub mod camera;
pub mod figures;
pub mod file;
pub mod folder;
pub mod material;
pub mod mesh;
pub mod motion;
pub mod preset;
pub mod signs;
pub mod slot;
pub mod strength;
pub mod surface;
pub mod templates;
pub mod texture;
pub mod trial;

use crate::light::AreaLight;
pub use camera::Camera;
pub use material::{Material, Texture};
pub use motion::Motion;
pub use surface::{Triangle, Vertex};

/// All that is rendered. Build one in code.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The eye.
    pub camera: Camera,
    /// Triangles of all surfaces, world space.
    pub triangles: Vec<Triangle>,
    /// Materials, indexed by [`Triangle::material`].
    pub materials: Vec<Material>,
    /// Textures, indexed by the materials.
    pub textures: Vec<Texture>,
    /// The lights.
    pub lights: Vec<AreaLight>,
    /// Radiance where a camera ray meets nothing, linear Rec.709.
    pub background: [f32; 3],
}
