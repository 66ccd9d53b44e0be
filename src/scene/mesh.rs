//! glTF 2.0 and GLB meshes. This file and its folder alone name the gltf crate.
//!
//! What is read: the node tree, every triangle of every mesh in it, normals, tangents, the first uv set, and metallic-roughness
//! materials with base colour, metallic-roughness and normal textures. Not read: occlusion textures (they dim light that
//! isn't direct, and all light here is), cameras, animations. What else the picture misses is a warning.

mod buffer;
mod material;
mod triangle;

use super::folder::{Folder, FolderError};
use super::texture::TextureError;
use super::{Material, Texture, Triangle};
use buffer::Buffers;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::validation::Validate;
use std::collections::BTreeSet;

/// Largest `.gltf`, `.glb` or buffer, bytes.
pub const MAX_BYTES: u64 = 512 << 20;

/// Most triangles of one file, instances counted.
pub const MAX_TRIANGLES: usize = 4_000_000;

/// Farthest a vertex may be from the origin along an axis, metres.
pub const MAX_POSITION: f64 = 1e9;

/// The required extensions that we know. Quantised attributes are read as any others.
const EXTENSIONS: [&str; 1] = ["KHR_mesh_quantization"];

/// A mesh file, read and checked.
#[derive(Debug)]
pub struct Mesh {
    name: String,
    document: gltf::Document,
    buffers: Buffers,
}

/// Why a mesh file cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {element}: {problem}")]
pub struct MeshError {
    /// The mesh file.
    pub file: String,
    /// The element in it, by its JSON path.
    pub element: String,
    /// What is wrong with it.
    pub problem: MeshProblem,
}

/// What is wrong with an element of a mesh file.
#[derive(Debug, thiserror::Error)]
pub enum MeshProblem {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] FolderError),
    /// The GLB container is broken.
    #[error("broken GLB: {0}")]
    Container(&'static str),
    /// The JSON is broken, or isn't glTF.
    #[error("not glTF: {0}")]
    Json(String),
    /// The file needs an extension that we don't have.
    #[error("extension {0} is required and not supported; supported are {EXTENSIONS:?}")]
    Extension(String),
    /// A URI that isn't a file beside the mesh, nor base64 data.
    #[error("URI {0:?}: only files beside the mesh and base64 data are read")]
    Uri(String),
    /// A buffer, view or accessor reaches past its end.
    #[error("reaches byte {end} of {available}")]
    OutOfBounds {
        /// First byte past the element.
        end: u64,
        /// Bytes there are.
        available: u64,
    },
    /// An accessor of another type than its use asks for.
    #[error("holds {found}, where {wanted} is needed")]
    Type {
        /// Type and component type.
        found: String,
        /// What its use asks for.
        wanted: &'static str,
    },
    /// An accessor of more elements than we read.
    #[error("{count} elements; at most {limit} are read")]
    TooMany {
        /// How many.
        count: u64,
        /// The limit.
        limit: u64,
    },
    /// A number that isn't finite.
    #[error("element {0} is not finite")]
    NotFinite(usize),
    /// An index past the vertices.
    #[error("index {index} with {vertices} vertices")]
    Index {
        /// The index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An attribute whose length isn't the number of vertices.
    #[error("{found} elements for {vertices} vertices")]
    Length {
        /// Elements of the attribute.
        found: usize,
        /// Vertices.
        vertices: usize,
    },
    /// A vertex is too far away once the nodes and the scene have placed it.
    #[error("a vertex at {0}; coordinates reach ±{MAX_POSITION:e} m")]
    Position(DVec3),
    /// A node is its own ancestor, or has two parents.
    #[error("the node has more than one parent")]
    NotATree,
    /// A node's transform isn't finite, or its rotation has no length.
    #[error("the transform is not a finite matrix, or its rotation has no length")]
    Transform,
    /// A number out of its range.
    #[error("{name} {value} is outside {range}")]
    Range {
        /// The property.
        name: &'static str,
        /// Its value.
        value: f32,
        /// What it may be.
        range: &'static str,
    },
    /// An image that isn't a texture.
    #[error(transparent)]
    Image(#[from] TextureError),
    /// An image with neither file nor data.
    #[error("the image has neither uri nor bufferView")]
    NoImage,
}

impl MeshProblem {
    fn at(self, element: impl Into<String>) -> Located {
        (element.into(), self)
    }
}

/// A problem with its element; the file is added at the border.
type Located = (String, MeshProblem);

/// Materials of a mesh, and the textures that they index.
#[derive(Clone, Debug, PartialEq)]
pub struct Materials {
    /// One per material of the file, then glTF's default material.
    pub materials: Vec<Material>,
    /// The textures.
    pub textures: Vec<Texture>,
    /// What the file asks for and the picture misses.
    pub warnings: Vec<String>,
}

/// Triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// World space; their materials index [`Materials::materials`].
    pub triangles: Vec<Triangle>,
    /// What the file asks for and the picture misses.
    pub warnings: Vec<String>,
}

impl Mesh {
    /// Reads `name` in `folder`, and the buffers beside it.
    ///
    /// # Errors
    /// A file that cannot be read, broken glTF, an unknown required extension; named by the element.
    pub fn load(folder: &Folder, name: &str) -> Result<Self, MeshError> {
        let locate = |(element, problem)| MeshError { file: name.into(), element, problem };
        Self::load_located(folder, name).map_err(locate)
    }

    fn load_located(folder: &Folder, name: &str) -> Result<Self, Located> {
        let file = |e: FolderError| MeshProblem::from(e).at("file");
        let bytes = folder.read(name, MAX_BYTES).map_err(file)?;
        let beside = folder.beside(name).map_err(file)?;
        let (json, blob) = buffer::split_glb(&bytes).map_err(|e| e.at("file"))?;
        let root = gltf::json::Root::from_slice(json).map_err(|e| MeshProblem::Json(e.to_string()).at("JSON"))?;
        if let Some(unknown) = root.extensions_required.iter().find(|e| !EXTENSIONS.contains(&e.as_str())) {
            return Err(MeshProblem::Extension(unknown.clone()).at("extensionsRequired"));
        }
        let mut first = None;
        root.validate(&root, gltf::json::Path::new, &mut |path, error| {
            let path = path().to_string();
            // The crate knows fewer extensions than we do, which are checked above; and it refuses the attributes that
            // applications name themselves, which glTF allows and we don't read.
            let ours = path.starts_with("extensionsRequired") || path.contains("<invalid semantic name>");
            if first.is_none() && !ours {
                first = Some(MeshProblem::Json(error.to_string()).at(path));
            }
        });
        if let Some(error) = first {
            return Err(error);
        }
        let buffers = Buffers::load(&root, blob, beside)?;
        Ok(Self { name: name.into(), document: gltf::Document::from_json_without_validation(root), buffers })
    }

    /// The materials and textures.
    ///
    /// # Errors
    /// A texture that cannot be read, a factor out of range; named by the element.
    pub fn materials(&self) -> Result<Materials, MeshError> {
        let locate = |(element, problem)| MeshError { file: self.name.clone(), element, problem };
        let mut found = material::read(&self.document, &self.buffers).map_err(locate)?;
        self.name_in(&mut found.warnings);
        Ok(found)
    }

    /// The triangles of the default scene (or the first; or of all root nodes, where there is no scene), placed by
    /// `world_from_mesh`. Triangles without area are left out and counted in a warning.
    ///
    /// # Errors
    /// An accessor that is broken, too many triangles, coordinates too large; named by the element.
    pub fn triangles(&self, world_from_mesh: DAffine3) -> Result<Triangles, MeshError> {
        let locate = |(element, problem)| MeshError { file: self.name.clone(), element, problem };
        let mut found = self.triangles_located(world_from_mesh).map_err(locate)?;
        self.name_in(&mut found.warnings);
        Ok(found)
    }

    fn name_in(&self, warnings: &mut [String]) {
        for warning in warnings {
            warning.insert_str(0, &format!("{}: ", self.name));
        }
    }

    fn triangles_located(&self, world_from_mesh: DAffine3) -> Result<Triangles, Located> {
        let mut out = triangle::Collector::default();
        let mut seen = BTreeSet::new();
        let mut open: Vec<_> = self.roots().into_iter().rev().map(|n| (n, world_from_mesh)).collect();
        while let Some((node, world_from_parent)) = open.pop() {
            let element = format!("nodes[{}]", node.index());
            if !seen.insert(node.index()) {
                return Err(MeshProblem::NotATree.at(element));
            }
            let local = local_transform(&node).ok_or_else(|| MeshProblem::Transform.at(element.as_str()))?;
            let world_from_node = world_from_parent * local;
            if let Some(mesh) = node.mesh() {
                if node.skin().is_some() {
                    out.warnings.push(format!("{element}: the skin is ignored: the mesh stands in its bind pose"));
                }
                for primitive in mesh.primitives() {
                    let element = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
                    out.add(&self.document, &self.buffers, &primitive, &element, world_from_node)?;
                }
            }
            open.extend(node.children().collect::<Vec<_>>().into_iter().rev().map(|n| (n, world_from_node)));
        }
        for extension in self.document.extensions_used().filter(|e| !EXTENSIONS.contains(e)) {
            out.warnings.push(format!("extension {extension} is ignored"));
        }
        Ok(out.finish())
    }

    fn roots(&self) -> Vec<gltf::Node<'_>> {
        let scene = self.document.default_scene().or_else(|| self.document.scenes().next());
        if let Some(scene) = scene {
            return scene.nodes().collect();
        }
        let children: BTreeSet<_> =
            self.document.nodes().flat_map(|n| n.children().map(|c| c.index()).collect::<Vec<_>>()).collect();
        self.document.nodes().filter(|n| !children.contains(&n.index())).collect()
    }
}

/// `parent_from_node`, or nothing where it isn't finite.
fn local_transform(node: &gltf::Node<'_>) -> Option<DAffine3> {
    use gltf::scene::Transform;
    let map = match node.transform() {
        Transform::Matrix { matrix } => {
            let m = DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)));
            DAffine3::from_mat4(m)
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let q = DQuat::from_array(rotation.map(f64::from));
            if !(q.length_squared() > 0.0 && q.is_finite()) {
                return None;
            }
            let (s, t) = (DVec3::from_array(scale.map(f64::from)), DVec3::from_array(translation.map(f64::from)));
            DAffine3::from_scale_rotation_translation(s, q.normalize(), t)
        }
    };
    map.is_finite().then_some(map)
}
