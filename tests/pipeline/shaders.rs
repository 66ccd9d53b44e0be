//! The shaders without a GPU: they parse, they validate, and their structs lie in memory as the Rust ones do.

#![cfg(feature = "gpu")]

use core::mem::offset_of;
use glyphlight::backend::gpu::layout::{Box, Emitter, Frame, Handles, MeterPoint, Pixel, Reading};
use glyphlight::backend::gpu::source::{Source, gbuffer, light, meter};
use glyphlight::backend::technique::NAMES;
use glyphlight::kernel::cluster::Cluster;
use glyphlight::kernel::curve::Curve;
use glyphlight::kernel::mosaic::Tile;
use glyphlight::kernel::pal::Polygon;
use glyphlight::kernel::picture::Level;
use glyphlight::kernel::quad::Quad;
use glyphlight::kernel::representative::Solid;
use glyphlight::kernel::surface::{Rays, SurfaceMaterial, SurfaceTexture, SurfaceTriangle};
use glyphlight::kernel::tile::LightBox;
use glyphlight::kernel::tree::Node;
use std::collections::BTreeMap;
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{AddressSpace, Module, TypeInner, front::wgsl, proc::Layouter};

fn validate(code: &str) -> Result<Module, String> {
    let module = wgsl::parse_str(code).map_err(|e| e.emit_to_string(code))?;
    Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32)
        .validate(&module)
        .map_err(|e| e.emit_to_string(code))?;
    Ok(module)
}

fn module(source: &Source) -> Module {
    validate(&source.code).unwrap_or_else(|e| panic!("{}: {e}", source.name))
}

#[test]
fn every_pass_validates_and_has_its_entry_points() {
    let mut passes = vec![(gbuffer(), vec!["draw_triangle", "store_triangle"])];
    for name in NAMES {
        passes.extend([(light(name), vec!["light_pixels"]), (meter(name), vec!["read_meter"])]);
    }
    for (source, entries) in passes {
        let found: Vec<String> = module(&source).entry_points.iter().map(|e| e.name.clone()).collect();
        assert_eq!(found, entries, "{}", source.name);
        // A member that does not exist, and a word that is none.
        assert!(validate(&source.code.replacen(".xyz", ".xyq", 1)).is_err() || !source.code.contains(".xyz"));
        assert!(validate(&source.code.replacen("return", "retrun", 1)).is_err());
    }
}

/// Bytes that a workgroup of the module shares.
fn shared(module: &Module) -> u32 {
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    let variables = module.global_variables.iter().filter(|(_, v)| v.space == AddressSpace::WorkGroup);
    variables.map(|(_, v)| layouter[v.ty].size.next_multiple_of(16)).sum()
}

/// What every device that WebGPU knows can share.
#[test]
fn workgroups_share_no_more_than_any_device_has() {
    const LEAST: u32 = 16_384;
    for name in NAMES {
        let source = light(name);
        let bytes = shared(&module(&source));
        assert!(bytes > 10_000 && bytes <= LEAST, "{name}: {bytes} bytes");
        let longer = source.code.replace("tile_values: array<vec4f, 640>", "tile_values: array<vec4f, 740>");
        assert!(shared(&validate(&longer).unwrap()) > LEAST || bytes + 1600 <= LEAST, "{name}");
    }
}

/// Size and member offsets of a struct.
type Layout = (u32, Vec<(String, u32)>);

/// The layouts of all structs of a module.
fn layouts(module: &Module) -> BTreeMap<String, Layout> {
    let layout = |(_, ty): (_, &wgpu::naga::Type)| match (&ty.name, &ty.inner) {
        (Some(name), TypeInner::Struct { members, span }) => {
            let member = |m: &wgpu::naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset);
            Some((name.clone(), (*span, members.iter().map(member).collect())))
        }
        _ => None,
    };
    module.types.iter().filter_map(layout).collect()
}

macro_rules! layout {
    ($type:ident: $($member:ident)*) => {
        (
            stringify!($type),
            (
                size_of::<$type>() as u32,
                vec![$((stringify!($member).to_string(), offset_of!($type, $member) as u32)),*],
            ),
        )
    };
}

fn rust_layouts() -> Vec<(&'static str, Layout)> {
    vec![
        layout!(Rays: forward right up),
        layout!(Frame: rays raster picture tile_origin tile_size offset steps tolerance emitters boxes lights eps
            choice clusters per_metre window zero row_step pad),
        layout!(SurfaceTriangle: p0 e1 e2 n0 n1 n2 t0 t1 t2),
        layout!(SurfaceMaterial: base_color alpha specular normal_scale base_color_texture
            metallic_roughness_texture normal_texture pad),
        layout!(SurfaceTexture: offset width height levels),
        layout!(Emitter: x first y end center first_detail normal light radiance two_sided
            form radius length picture),
        layout!(LightBox: center area x half_x y half_y z half_z radiance one_sided),
        layout!(Cluster: center link half low axis high flux cone_cos squares cone_sin products pad moments),
        layout!(Node: center half a b m0 m1 m2 m3 areas link),
        layout!(Handles: p1 p2 low1 low2),
        layout!(Curve: p0 p1 p2 p3),
        layout!(Quad: half low),
        layout!(Polygon: circle centroid radius first outer end texels side),
        layout!(Solid: center half kind coverage),
        layout!(Level: low per_unit offset size variance coarser),
        layout!(Tile: center half mean skip m1_x first_node m1_y end_node m2_xx first_handles m2_xy deviation m2_yy deviation_3),
        layout!(Box: low skip high triangles),
        layout!(Pixel: diffuse samples specular nodes bytes cut budget),
        layout!(MeterPoint: position emitter normal alpha view tolerance),
        layout!(Reading: diffuse diffuse_nodes specular specular_nodes budgets cut pad),
    ]
}

#[test]
fn structs_lie_as_in_rust() {
    let mut found = BTreeMap::new();
    for source in [gbuffer(), light("tree"), light("quad"), light("pal"), light("representative"), meter("tree")] {
        found.extend(layouts(&module(&source)));
    }
    for (name, (size, mut members)) in rust_layouts() {
        if name == "SurfaceTriangle" {
            // The last word of t2 holds the material's index, which WGSL gives a name.
            let t2 = members.last().expect("members").1;
            members.push(("material".into(), t2 + 12));
        }
        assert_eq!(found.get(name), Some(&(size, members)), "{name}");
    }
}

#[test]
fn a_moved_member_is_noticed() {
    let code = light("tree").code;
    let moved = code.replace("    first: u32,\n    y: vec3f,", "    y: vec3f,\n    first: u32,");
    assert_ne!(code, moved);
    let moved = layouts(&validate(&moved).expect("a valid module"));
    let (name, layout) = layout!(Emitter: x first y end center first_detail normal light radiance two_sided
            form radius length picture);
    assert_ne!(moved[name], layout);
}
