//! glTF and GLB: geometry and materials as the file means them, and no way out of the folder or into a panic.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use glyphlight::scene::folder::Folder;
use glyphlight::scene::mesh::{Mesh, MeshProblem, Triangles};
use std::path::{Path, PathBuf};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scenes")
}

fn folder(path: &Path) -> Folder {
    Folder::of(&path.join("scene.toml")).unwrap()
}

/// A GLB of a JSON text and its binary chunk.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |v: usize| (v as u32).to_le_bytes();
    let total = 28 + json.len() + binary.len();
    [b"glTF", &word(2)[..], &word(total), &word(json.len()), b"JSON", &json, &word(binary.len()), b"BIN\0", &binary]
        .concat()
}

/// A quad: four vertices in the plane z = 0 with u along x and v against y, as glTF has it. Layout of the binary chunk:
/// positions 48, normals 48, tangents 64, uvs 32, indices 12, strip 8 bytes.
const QUAD: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
 "nodes":[{"mesh":0}],
 "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TANGENT":2,"TEXCOORD_0":3},"indices":4}]}],
 "accessors":[
  {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,1,0]},
  {"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"},
  {"bufferView":2,"componentType":5126,"count":4,"type":"VEC4"},
  {"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"},
  {"bufferView":4,"componentType":5123,"count":6,"type":"SCALAR"},
  {"bufferView":5,"componentType":5123,"count":4,"type":"SCALAR"}],
 "bufferViews":[
  {"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":48},
  {"buffer":0,"byteOffset":96,"byteLength":64},{"buffer":0,"byteOffset":160,"byteLength":32},
  {"buffer":0,"byteOffset":192,"byteLength":12},{"buffer":0,"byteOffset":204,"byteLength":8}],
 "buffers":[{"byteLength":212}]}"#;

fn quad_binary() -> Vec<u8> {
    let position = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0_f32]];
    let mut floats: Vec<f32> = position.concat();
    floats.extend([[0.0, 0.0, 1.0]; 4].concat());
    floats.extend([[1.0, 0.0, 0.0, 1.0]; 4].concat());
    floats.extend([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].concat());
    let mut bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    let indices = [0, 1, 2, 0, 2, 3, 0, 1, 3, 2_u16];
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

/// Loads bytes as a mesh file of its own folder.
fn load(bytes: &[u8], world: DAffine3) -> Result<Triangles, glyphlight::scene::mesh::MeshError> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("mesh.glb"), bytes).unwrap();
    let mesh = Mesh::load(&folder(dir.path()), "mesh.glb")?;
    mesh.materials()?;
    mesh.triangles(world)
}

fn quad(edits: &[(&str, &str)], world: DAffine3) -> Triangles {
    load(&glb(&edited(edits), &quad_binary()), world).unwrap()
}

fn edited(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(QUAD.to_owned(), |json, (from, to)| {
        assert!(json.contains(from), "{from} is not in the file");
        json.replacen(from, to, 1)
    })
}

#[test]
fn the_shelf_loads_whole() {
    let mesh = Mesh::load(&folder(&data()), "shelf.glb").unwrap();
    let found = mesh.triangles(DAffine3::IDENTITY).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    assert_eq!(found.triangles.len(), 8 * 44);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for triangle in &found.triangles {
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        let face = (b - a).cross(c - a).normalize();
        for v in triangle.vertices {
            (low, high) = (low.min(v.position), high.max(v.position));
            let (n, t) = (v.normal, v.tangent.truncate());
            assert!((n.length() - 1.0).abs() < 1e-5 && (t.length() - 1.0).abs() < 1e-5 && n.dot(t).abs() < 1e-5);
            assert!(n.as_dvec3().dot(face) > 0.4, "normals point out of the faces");
            assert_eq!(v.tangent.w.abs(), 1.0);
        }
    }
    assert!((low - DVec3::new(-0.6, 0.0, -0.15)).abs().max_element() < 1e-6, "{low}");
    assert!((high - DVec3::new(0.6, 1.0, 0.15)).abs().max_element() < 1e-6, "{high}");

    let own = mesh.materials().unwrap();
    assert_eq!(own.warnings, Vec::<String>::new());
    let [wood, brass, default] = own.materials[..] else { panic!("{} materials", own.materials.len()) };
    assert_eq!(
        (wood.base_color_texture, wood.metallic_roughness_texture, wood.normal_texture),
        (Some(0), Some(1), Some(2))
    );
    assert_eq!((wood.alpha, wood.metallic, wood.normal_scale), (0.8 * 0.8, 0.0, 0.7));
    assert_eq!((brass.alpha, brass.metallic, brass.base_color_texture), (0.4 * 0.4, 1.0, None));
    assert_eq!((default.base_color, default.alpha, default.metallic), ([1.0; 3], 1.0, 1.0));
    assert_eq!(own.textures.iter().map(|t| t.srgb).collect::<Vec<_>>(), [true, false, false]);
    assert!(own.textures.iter().all(|t| (t.width, t.height, t.texels.len()) == (64, 64, 4096)));
    let bumps: Vec<_> = own.textures[2].texels.iter().map(|t| t.to_le_bytes()).collect();
    assert!(bumps.iter().all(|t| t[2] > 128 && t[3] == 255), "a normal map is mostly blue: R is the lowest byte");
    let used: std::collections::BTreeSet<_> = found.triangles.iter().map(|t| t.material).collect();
    assert_eq!(used.into_iter().collect::<Vec<_>>(), [0, 1]);
}

/// The bitangent of the first vertex, and the direction of falling v over its triangle (up in the image).
fn bitangent(found: &Triangles) -> (Vec3, Vec3) {
    let [a, b, c] = found.triangles[0].vertices;
    let v = a.normal.cross(a.tangent.truncate()) * a.tangent.w;
    let (e, f) = ((b.position - a.position).as_vec3(), (c.position - a.position).as_vec3());
    let (d, g) = (b.uv - a.uv, c.uv - a.uv);
    let rising = (f * d.x - e * g.x) / d.perp_dot(g);
    (v, -rising.normalize())
}

#[test]
fn tangents_follow_the_uvs_in_every_frame() {
    let turned = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-1.1);
    let maps = [
        DMat3::IDENTITY,
        turned,
        turned * DMat3::from_diagonal(DVec3::new(1.0, -2.0, 1.0)),
        turned * DMat3::from_diagonal(DVec3::new(-3.0, 0.5, 1.0)),
    ];
    let own = [(r#""TANGENT":2,"#, "")];
    let flat = [(r#""NORMAL":1,"TANGENT":2,"#, "")];
    for (k, map) in maps.into_iter().enumerate() {
        let world = DAffine3::from_mat3_translation(map, DVec3::new(1.0, 2.0, 3.0));
        for edits in [&[][..], &own[..], &flat[..]] {
            let found = quad(edits, world);
            let first = found.triangles[0].vertices[0];
            let (bitangent, up) = bitangent(&found);
            assert!(bitangent.dot(up) > 0.999, "map {k}, {edits:?}: {bitangent} against {up}");
            let tangent = (map * DVec3::X).normalize().as_vec3();
            assert!((first.tangent.truncate() - tangent).length() < 1e-6, "map {k}, {edits:?}");
            // The normal stays on the side where the file has it.
            let normal = (map.inverse().transpose() * DVec3::Z).normalize().as_vec3();
            assert!((first.normal - normal).length() < 1e-6, "map {k}, {edits:?}");
            assert!((first.position - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
        }
    }
    // A file whose tangents have the other sign says so, and keeps it.
    let mut other = quad_binary();
    for vertex in 0..4 {
        other[96 + 16 * vertex + 12..96 + 16 * vertex + 16].copy_from_slice(&(-1.0_f32).to_le_bytes());
    }
    let found = load(&glb(QUAD, &other), DAffine3::IDENTITY).unwrap();
    let (bitangent, up) = bitangent(&found);
    assert!(bitangent.dot(up) < -0.999);
}

#[test]
fn nodes_multiply_down_the_tree() {
    let tree = r#""nodes":[{"children":[1],"translation":[10,0,0],"scale":[2,2,2]},
        {"mesh":0,"rotation":[0,0,0.70710678,0.70710678],"translation":[0,1,0]}],"#;
    let found = quad(&[(r#""nodes":[{"mesh":0}],"#, tree)], DAffine3::IDENTITY);
    let corner = found.triangles[0].vertices[1].position;
    // (2, 0, 0) turned by 90° is (0, 2, 0); moved to (0, 3, 0); scaled and moved to (10, 6, 0).
    assert!((corner - DVec3::new(10.0, 6.0, 0.0)).length() < 1e-6, "{corner}");
    let matrix = r#""nodes":[{"mesh":0,"matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,5,0,0,1]}],"#;
    let found = quad(&[(r#""nodes":[{"mesh":0}],"#, matrix)], DAffine3::IDENTITY);
    assert!((found.triangles[0].vertices[1].position - DVec3::new(5.0, 2.0, 0.0)).length() < 1e-6);
    // Without a scene the root nodes are drawn.
    let found = quad(&[(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "")], DAffine3::IDENTITY);
    assert_eq!(found.triangles.len(), 2);
}

#[test]
fn a_plane_has_the_bitangent_of_a_mesh() {
    for normal in [DVec3::Y, DVec3::Z, DVec3::new(0.3, -0.2, -0.9)] {
        let mut found = Triangles {
            triangles: glyphlight::scene::surface::plane(DVec3::ONE, normal, [2.0, 3.0], 0.5, 0).into(),
            warnings: Vec::new(),
        };
        for _ in 0..2 {
            let (bitangent, up) = bitangent(&found);
            assert!(bitangent.dot(up) > 0.999, "{normal}: {bitangent} against {up}");
            found.triangles.reverse();
        }
    }
}

/// The corner positions of every triangle.
fn corners(found: &Triangles) -> Vec<[DVec3; 3]> {
    found.triangles.iter().map(|t| t.vertices.map(|v| v.position)).collect()
}

#[test]
fn strips_fans_sparse_and_quantised_accessors_are_the_same_quad() {
    let list = corners(&quad(&[], DAffine3::IDENTITY));
    let normals = |f: &Triangles| f.triangles.iter().all(|t| t.vertices.iter().all(|v| v.normal == Vec3::Z));
    let strip = quad(&[(r#""indices":4"#, r#""indices":5,"mode":5"#)], DAffine3::IDENTITY);
    let flat =
        quad(&[(r#""NORMAL":1,"TANGENT":2,"#, ""), (r#""indices":4"#, r#""indices":5,"mode":5"#)], DAffine3::IDENTITY);
    let fan = quad(&[(r#","indices":4"#, r#","mode":6"#)], DAffine3::IDENTITY);
    assert_eq!(corners(&fan), list);
    assert_eq!(strip.triangles.len(), 2);
    assert!(normals(&strip) && normals(&flat), "both triangles of a strip have one winding");
    let area = |f: &[[DVec3; 3]]| f.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() / 2.0).sum::<f64>();
    assert!((area(&corners(&strip)) - 2.0).abs() < 1e-9);

    // Bytes 0 and 255, normalised, are 0 and 1; the accessor's stride skips the fourth byte.
    let mut binary = quad_binary();
    let bytes: Vec<u8> =
        [[0, 0, 0], [255, 0, 0], [255, 255, 0], [0, 255, 0_u8]].iter().flat_map(|v| [v[0], v[1], v[2], 9]).collect();
    binary[..16].copy_from_slice(&bytes);
    let edits = [
        (
            r#""asset""#,
            r#""extensionsRequired":["KHR_mesh_quantization"],"extensionsUsed":["KHR_mesh_quantization"],"asset""#,
        ),
        (r#""bufferView":0,"componentType":5126"#, r#""bufferView":0,"normalized":true,"componentType":5121"#),
        (r#""byteOffset":0,"byteLength":48"#, r#""byteOffset":0,"byteStride":4,"byteLength":16"#),
    ];
    let scale = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
    let quantised = load(&glb(&edited(&edits), &binary), scale).unwrap();
    assert_eq!(corners(&quantised), list);

    // A sparse accessor moves vertex 2 to where vertex 0 is: the first value of the view. Both triangles fall flat.
    let sparse = r#""count":4,"sparse":{"count":1,"indices":{"bufferView":4,"byteOffset":4,"componentType":5123},
        "values":{"bufferView":0}},"type":"VEC3","min""#;
    let moved = quad(&[(r#""count":4,"type":"VEC3","min""#, sparse)], DAffine3::IDENTITY);
    assert_eq!(moved.triangles.len(), 0);
    assert!(moved.warnings[0].contains("2 triangles without area"), "{:?}", moved.warnings);
}

#[test]
fn what_is_left_out_is_said() {
    let has = |edits: &[(&str, &str)], wanted: &str| {
        let found = quad(edits, DAffine3::IDENTITY);
        assert!(
            found.warnings.iter().any(|w| w.contains(wanted) && w.starts_with("mesh.glb: ")),
            "{wanted}: {:?}",
            found.warnings
        );
    };
    has(&[(r#""indices":4"#, r#""indices":5,"mode":1"#)], "meshes[0].primitives[0]: Lines are ignored");
    has(&[(r#""indices":4"#, r#""indices":4,"targets":[{"POSITION":0}]"#)], "morph targets are ignored");
    has(&[(r#""TEXCOORD_0":3"#, r#""TEXCOORD_0":3,"COLOR_0":2"#)], "vertex colours are ignored");
    has(&[(r#"[{"mesh":0}]"#, r#"[{"mesh":0,"skin":0}],"skins":[{"joints":[0]}]"#)], "nodes[0]: the skin is ignored");
    has(&[(r#""asset""#, r#""extensionsUsed":["KHR_lights_punctual"],"asset""#)], "KHR_lights_punctual is ignored");
    has(&[(r#"[{"mesh":0}]"#, r#"[{"mesh":0,"scale":[1,0,1]}]"#)], "2 triangles without area");
    has(&[(r#"[{"mesh":0}]"#, r#"[{}]"#)], "no triangles");
    assert_eq!(quad(&[], DAffine3::IDENTITY).warnings, Vec::<String>::new());
    let mut binary = quad_binary();
    binary[48..60].fill(0);
    let found = load(&glb(QUAD, &binary), DAffine3::IDENTITY).unwrap();
    assert!(found.warnings[0].contains("2 normals of no length"), "{:?}", found.warnings);
    assert!(found.triangles.iter().all(|t| t.vertices.iter().all(|v| v.normal == Vec3::Z)));
}

#[test]
fn broken_files_are_named_errors() {
    let fails = |edits: &[(&str, &str)], wanted: &str| {
        let error = load(&glb(&edited(edits), &quad_binary()), DAffine3::IDENTITY).unwrap_err().to_string();
        assert!(error.starts_with("mesh.glb: ") && error.contains(wanted), "wanted {wanted:?}, got {error:?}");
    };
    fails(
        &[(r#""asset""#, r#""extensionsRequired":["KHR_draco_mesh_compression"],"asset""#)],
        "KHR_draco_mesh_compression is required",
    );
    fails(&[(r#""byteLength":212"#, r#""byteLength":2120"#)], "buffers[0]: reaches byte 2120 of 212");
    fails(
        &[
            (r#""byteOffset":204,"byteLength":8"#, r#""byteOffset":204,"byteLength":9"#),
            ("\"indices\":4", "\"indices\":5"),
        ],
        "bufferViews[5]: reaches byte 213 of 212",
    );
    fails(
        &[(r#""componentType":5126,"count":4,"type":"VEC2""#, r#""componentType":5126,"count":5,"type":"VEC2""#)],
        "accessors[3]: reaches byte 40 of 32",
    );
    fails(
        &[(r#""count":4,"type":"VEC4""#, r#""count":3,"type":"VEC4""#)],
        "meshes[0].primitives[0]: 3 elements for 4 vertices",
    );
    fails(
        &[(r#""count":4,"type":"VEC4""#, r#""count":4,"type":"VEC3""#)],
        "accessors[2]: holds Vec3 of F32, where VEC4 is needed",
    );
    fails(
        &[(r#""bufferView":4,"componentType":5123"#, r#""bufferView":4,"componentType":5126"#)],
        "accessors[4]: holds Scalar of F32",
    );
    fails(
        &[
            (r#""bufferView":0,"componentType":5126,"count":4"#, r#""bufferView":0,"componentType":5126,"count":2"#),
            (r#""NORMAL":1,"TANGENT":2,"TEXCOORD_0":3"#, r#""_A":1"#),
        ],
        "index 2 with 2 vertices",
    );
    fails(
        &[(
            r#""bufferView":0,"componentType":5126,"count":4"#,
            r#""bufferView":0,"componentType":5126,"count":4000000000"#,
        )],
        "accessors[0]: 4000000000 elements; at most 50000000",
    );
    fails(&[(r#"{"mesh":0}"#, r#"{"mesh":0,"children":[0]}"#)], "nodes[0]: the node has more than one parent");
    fails(&[(r#"{"mesh":0}"#, r#"{"mesh":0,"rotation":[0,0,0,0]}"#)], "nodes[0]: the transform is not");
    fails(&[(r#"{"mesh":0}"#, r#"{"mesh":0,"translation":[1e30,0,0]}"#)], "a vertex at");
    fails(&[(r#"{"mesh":0}"#, r#"{"mesh":7}"#)], "nodes[0].mesh");
    fails(
        &[
            (r#""indices":4"#, r#""indices":4,"material":0"#),
            (r#""asset""#, r#""materials":[{"pbrMetallicRoughness":{"roughnessFactor":1.5}}],"asset""#),
        ],
        "materials[0]: roughnessFactor 1.5 is outside 0 to 1",
    );
    let textured =
        r#""materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],"#;
    let image = |image: &str| format!(r#"{textured}"images":[{image}],"asset""#);
    fails(
        &[(r#""asset""#, &image(r#"{"bufferView":3,"mimeType":"image/png"}"#))],
        "images[0]: not a PNG or JPEG picture",
    );
    fails(&[(r#""asset""#, &image(r#"{"bufferView":3}"#))], "images[0]: not a PNG or JPEG picture");
    fails(&[(r#""asset""#, &image("{}"))], "images[0]: the image has neither uri nor bufferView");
    let mut binary = quad_binary();
    binary[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = load(&glb(QUAD, &binary), DAffine3::IDENTITY).unwrap_err();
    assert!(matches!(error.problem, MeshProblem::NotFinite(0)) && error.element == "accessors[0]", "{error}");
}

/// A folder with a `.gltf` whose buffer is the URI given, a buffer beside it, one above it, and a link to that.
fn external(uri: &str) -> Result<Triangles, glyphlight::scene::mesh::MeshError> {
    let dir = tempfile::tempdir().unwrap();
    let inner = dir.path().join("scene/models");
    std::fs::create_dir_all(inner.join("deep er")).unwrap();
    let binary = quad_binary();
    for place in ["outside.bin", "scene/above.bin", "scene/models/quad.bin", "scene/models/deep er/quad.bin"] {
        std::fs::write(dir.path().join(place), &binary).unwrap();
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink("../../outside.bin", inner.join("link.bin")).unwrap();
    let uri = uri.replace("ABSOLUTE", inner.join("quad.bin").to_str().unwrap());
    let json = edited(&[(r#""byteLength":212"#, &format!(r#""byteLength":212,"uri":"{uri}""#))]);
    std::fs::write(inner.join("quad.gltf"), json).unwrap();
    Mesh::load(&folder(&dir.path().join("scene")), "models/quad.gltf")?.triangles(DAffine3::IDENTITY)
}

#[test]
fn buffers_are_read_from_beside_the_mesh_only() {
    for uri in ["quad.bin", "./quad.bin", "deep%20er/quad.bin", "deep er/quad.bin"] {
        assert_eq!(external(uri).unwrap().triangles.len(), 2, "{uri}");
    }
    for (uri, wanted) in [
        ("../above.bin", "has a `..`"),
        ("deep%20er/../quad.bin", "has a `..`"),
        ("%2e%2e/above.bin", "has a `..`"),
        ("ABSOLUTE", "is an absolute path"),
        ("//host/quad.bin", "is an absolute path"),
        ("file://ABSOLUTE", "only files beside the mesh"),
        ("http://127.0.0.1/quad.bin", "only files beside the mesh"),
        ("data:application/octet-stream;base64,@@@", "only files beside the mesh"),
        ("data:application/octet-stream;base64,AAAA", "reaches byte 212 of 4"),
        ("missing.bin", "there is no file"),
        ("deep er", "is a folder"),
        ("", "the file name is empty"),
        ("%zz.bin", "only files beside the mesh"),
        #[cfg(unix)]
        ("link.bin", "out of the folder"),
    ] {
        let error = external(uri).unwrap_err();
        assert!(error.element == "buffers[0]" && error.to_string().contains(wanted), "{uri}: {error}");
    }
}

#[test]
fn no_damage_to_a_file_panics() {
    let whole = std::fs::read(data().join("shelf.glb")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let folder = folder(dir.path());
    let (mut state, mut failed, mut loaded) = (1_u64, 0, 0);
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let json_end = 20 + u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    for round in 0..600 {
        let mut bytes = whole.clone();
        match round % 3 {
            // Digits of the JSON change: indices, counts, offsets, factors.
            0 => {
                for _ in 0..4 {
                    let digits: Vec<_> = (20..json_end).filter(|i| bytes[*i].is_ascii_digit()).collect();
                    bytes[digits[random(digits.len())]] = b'0' + random(10) as u8;
                }
            }
            1 => bytes.truncate(random(whole.len())),
            _ => {
                for _ in 0..8 {
                    let at = random(whole.len());
                    bytes[at] = random(256) as u8;
                }
            }
        }
        std::fs::write(dir.path().join("mesh.glb"), &bytes).unwrap();
        let result =
            Mesh::load(&folder, "mesh.glb").and_then(|m| Ok((m.materials()?, m.triangles(DAffine3::IDENTITY)?)));
        match result {
            Ok(_) => loaded += 1,
            Err(_) => failed += 1,
        }
    }
    assert!(failed > 200 && loaded > 20, "{failed} failed, {loaded} loaded: the damage is neither harmless nor total");
}
