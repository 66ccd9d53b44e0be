//! Primitives of a mesh file to world-space triangles.

use super::buffer::Buffers;
use super::{Located, MAX_POSITION, MAX_TRIANGLES, MeshProblem, Triangles};
use crate::scene::{Triangle, Vertex};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use gltf::mesh::{Mode, Semantic};
use std::collections::BTreeSet;

/// The triangles so far.
#[derive(Default)]
pub(super) struct Collector {
    triangles: Vec<Triangle>,
    pub(super) warnings: Vec<String>,
    degenerate: usize,
    bad_normals: usize,
}

/// The attributes of a primitive, in its node's space.
struct Attributes {
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    tangents: Option<Vec<[f32; 4]>>,
    uvs: Option<Vec<[f32; 2]>>,
}

impl Collector {
    /// Adds the triangles of a primitive under `world_from_node`.
    pub(super) fn add(
        &mut self,
        document: &gltf::Document,
        buffers: &Buffers,
        primitive: &gltf::Primitive<'_>,
        element: &str,
        world_from_node: DAffine3,
    ) -> Result<(), Located> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.warnings.push(format!("{element}: {mode:?} are ignored: only triangles are surfaces"));
            return Ok(());
        }
        if primitive.morph_targets().next().is_some() {
            self.warnings.push(format!("{element}: morph targets are ignored"));
        }
        if primitive.get(&Semantic::Colors(0)).is_some() {
            self.warnings.push(format!("{element}: vertex colours are ignored"));
        }
        let root = document.as_json();
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            self.warnings.push(format!("{element}: ignored, since it has no positions"));
            return Ok(());
        };
        let attributes = Attributes {
            positions: buffers.floats(root, &positions)?,
            normals: primitive.get(&Semantic::Normals).map(|a| buffers.floats(root, &a)).transpose()?,
            tangents: primitive.get(&Semantic::Tangents).map(|a| buffers.floats(root, &a)).transpose()?,
            uvs: primitive.get(&Semantic::TexCoords(0)).map(|a| buffers.floats(root, &a)).transpose()?,
        };
        let vertices = attributes.positions.len();
        let lengths = [
            attributes.normals.as_ref().map(Vec::len),
            attributes.tangents.as_ref().map(Vec::len),
            attributes.uvs.as_ref().map(Vec::len),
        ];
        if let Some(found) = lengths.into_iter().flatten().find(|n| *n != vertices) {
            return Err(MeshProblem::Length { found, vertices }.at(element));
        }
        let indices = match primitive.indices() {
            Some(accessor) => buffers.indices(root, &accessor)?,
            None => (0..vertices as u32).collect(),
        };
        if let Some(&index) = indices.iter().find(|i| **i as usize >= vertices) {
            return Err(MeshProblem::Index { index, vertices }.at(element));
        }
        let count = self.triangles.len() + indices.len() / if mode == Mode::Triangles { 3 } else { 1 };
        if count > MAX_TRIANGLES {
            return Err(MeshProblem::TooMany { count: count as u64, limit: MAX_TRIANGLES as u64 }.at(element));
        }
        // The default material follows those of the file.
        let material = primitive.material().index().unwrap_or(document.materials().len()) as u32;
        let frame = Frame::new(world_from_node);
        for corners in triples(&indices, mode) {
            self.triangle(&attributes, &frame, corners.map(|i| i as usize), material).map_err(|e| e.at(element))?;
        }
        Ok(())
    }

    fn triangle(
        &mut self,
        from: &Attributes,
        frame: &Frame,
        corners: [usize; 3],
        material: u32,
    ) -> Result<(), MeshProblem> {
        let world = |i: usize| frame.map.transform_point3(Vec3::from(from.positions[i]).as_dvec3());
        let p = corners.map(world);
        // A comparison per axis: NaN, which deep trees of huge scales can make, is not inside.
        let inside = |p: &DVec3| p.abs().cmple(DVec3::splat(MAX_POSITION)).all();
        if let Some(far) = p.iter().find(|p| !inside(p)) {
            return Err(MeshProblem::Position(*far));
        }
        let (edge1, edge2) = (p[1] - p[0], p[2] - p[0]);
        let cross = edge1.cross(edge2);
        let longest = edge1.length_squared().max(edge2.length_squared()).max((p[2] - p[1]).length_squared());
        // A height below 1e-10 of the longest edge is rounding.
        if cross.length() <= 1e-10 * longest {
            self.degenerate += 1;
            return Ok(());
        }
        // Turned round with the node where it mirrors, as the normals of the file are.
        let face = cross.normalize() * frame.handedness;
        let uv = corners.map(|i| from.uvs.as_ref().map_or(Vec2::ZERO, |uvs| Vec2::from(uvs[i])));
        let (along_u, image_up) = directions(edge1, edge2, uv);
        let vertex = |k: usize| {
            let i = corners[k];
            let given = from.normals.as_ref().map(|n| frame.normal(n[i]));
            let normal = given.flatten().unwrap_or(face);
            let tangent = match &from.tangents {
                Some(tangents) => frame.tangent(tangents[i], normal),
                None => None,
            };
            let tangent = tangent.unwrap_or_else(|| orthogonal(along_u, image_up, normal));
            let vertex = Vertex { position: p[k], normal: normal.as_vec3(), tangent, uv: uv[k] };
            (vertex, given == Some(None))
        };
        let found = [0, 1, 2].map(vertex);
        self.bad_normals += found.iter().filter(|(_, bad)| *bad).count();
        self.triangles.push(Triangle { vertices: found.map(|(v, _)| v), material });
        Ok(())
    }

    pub(super) fn finish(mut self) -> Triangles {
        if self.degenerate > 0 {
            self.warnings.push(format!("{} triangles without area are left out", self.degenerate));
        }
        if self.bad_normals > 0 {
            self.warnings.push(format!("{} normals of no length are replaced by the face's", self.bad_normals));
        }
        if self.triangles.is_empty() {
            self.warnings.push("no triangles".into());
        }
        // A mesh that stands in many places is warned of once.
        let mut said = BTreeSet::new();
        self.warnings.retain(|w| said.insert(w.clone()));
        Triangles { triangles: self.triangles, warnings: self.warnings }
    }
}

/// How a node places points, normals and tangents.
struct Frame {
    map: DAffine3,
    /// The cofactors of the linear part: takes normals to normals, up to length, even where a scale is 0.
    normals: DMat3,
    /// −1 where the node mirrors.
    handedness: f64,
}

impl Frame {
    fn new(map: DAffine3) -> Self {
        let m = map.matrix3;
        let normals = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        Self { map, normals, handedness: if m.determinant() < 0.0 { -1.0 } else { 1.0 } }
    }

    /// The unit world normal, or nothing where it has no length.
    fn normal(&self, normal: [f32; 3]) -> Option<DVec3> {
        (self.normals * Vec3::from(normal).as_dvec3() * self.handedness).try_normalize()
    }

    /// The world tangent beside a world normal; a mirror turns the bitangent's sign.
    fn tangent(&self, tangent: [f32; 4], normal: DVec3) -> Option<Vec4> {
        let [x, y, z, w] = tangent;
        let t = self.map.transform_vector3(Vec3::new(x, y, z).as_dvec3());
        let t = (t - normal * normal.dot(t)).try_normalize()?;
        Some(t.as_vec3().extend(if w < 0.0 { -1.0 } else { 1.0 } * self.handedness as f32))
    }
}

/// The directions of growing u and of *falling* v over a triangle (v is down, and glTF's bitangent up in the image),
/// scaled by a positive factor; zero where the uvs have no area.
fn directions(edge1: DVec3, edge2: DVec3, uv: [Vec2; 3]) -> (DVec3, DVec3) {
    let (a, b) = ((uv[1] - uv[0]).as_dvec2(), (uv[2] - uv[0]).as_dvec2());
    let turn = a.perp_dot(b);
    if turn == 0.0 {
        return (DVec3::ZERO, DVec3::ZERO);
    }
    let sign = turn.signum();
    ((edge1 * b.y - edge2 * a.y) * sign, (edge1 * b.x - edge2 * a.x) * sign)
}

/// A unit tangent at right angles to `normal`, with the sign that turns `normal × tangent` into the bitangent.
fn orthogonal(along_u: DVec3, image_up: DVec3, normal: DVec3) -> Vec4 {
    let along = along_u - normal * normal.dot(along_u);
    match along.try_normalize() {
        Some(t) => t.as_vec3().extend(if normal.cross(t).dot(image_up) < 0.0 { -1.0 } else { 1.0 }),
        None => normal.any_orthonormal_vector().as_vec3().extend(1.0),
    }
}

/// The corners of each triangle (glTF 2.0, section 3.7.2.1), all in one winding.
fn triples(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    let n = indices.len();
    let at = |i: usize| indices[i];
    match mode {
        Mode::TriangleStrip => (2..n)
            .map(|i| if i % 2 == 0 { [at(i - 2), at(i - 1), at(i)] } else { [at(i - 1), at(i - 2), at(i)] })
            .collect(),
        Mode::TriangleFan => (2..n).map(|i| [at(0), at(i - 1), at(i)]).collect(),
        _ => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
