//! Pipelines and the layouts of their bindings.

use super::buffers::SceneBuffers;
use super::device::Device;
use super::source::{self, Source};
use crate::backend::features::Features;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, BufferBindingType, ComputePipeline, ComputePipelineDescriptor, PipelineLayout,
    PipelineLayoutDescriptor, RenderPipeline, ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureFormat,
};

/// What the G-buffer holds: a triangle's index plus one.
pub const VISIBILITY_FORMAT: TextureFormat = TextureFormat::R32Uint;
/// Of the G-buffer's depth.
pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// Number of scene arrays: bindings 1 to this of group 0.
pub const ARRAYS: usize = 13;

/// Layouts that all scenes share.
#[derive(Debug)]
pub struct Layouts {
    scene: BindGroupLayout,
    tile: BindGroupLayout,
    meter: BindGroupLayout,
}

/// The passes of a picture, for scenes of the same features.
#[derive(Clone, Debug)]
pub struct Pipelines {
    /// Rasterises triangles.
    pub gbuffer: RenderPipeline,
    /// Shades.
    pub light: ComputePipeline,
}

impl Layouts {
    /// Makes the layouts.
    pub fn new(device: &Device) -> Self {
        let both = ShaderStages::VERTEX | ShaderStages::COMPUTE;
        let uniform = buffer(0, both, BufferBindingType::Uniform);
        let arrays = (1..=ARRAYS as u32).map(|i| {
            let stages = if i == 1 { both } else { ShaderStages::COMPUTE };
            buffer(i, stages, BufferBindingType::Storage { read_only: true })
        });
        let visibility = BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let written = |i| buffer(i, ShaderStages::COMPUTE, BufferBindingType::Storage { read_only: false });
        let points = buffer(3, ShaderStages::COMPUTE, BufferBindingType::Storage { read_only: true });
        let scene: Vec<_> = core::iter::once(uniform).chain(arrays).collect();
        let make = |label, entries: &[_]| {
            device.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        Self {
            scene: make("scene", &scene),
            tile: make("tile", &[visibility, written(1), written(2)]),
            meter: make("meter", &[points, written(4)]),
        }
    }

    /// Binds a scene.
    pub fn bind_scene(&self, device: &Device, buffers: &SceneBuffers) -> BindGroup {
        let all = core::iter::once(&buffers.frame).chain(&buffers.arrays);
        let entries: Vec<_> = all.enumerate().map(|(i, b)| entry(i as u32, b.as_entire_binding())).collect();
        bind(device, "scene", &self.scene, &entries)
    }

    /// Binds what shading reads and writes beside the scene.
    pub fn bind_tile(
        &self,
        device: &Device,
        visibility: &wgpu::TextureView,
        pixels: &wgpu::Buffer,
        skips: &wgpu::Buffer,
    ) -> BindGroup {
        let entries = [
            entry(0, BindingResource::TextureView(visibility)),
            entry(1, pixels.as_entire_binding()),
            entry(2, skips.as_entire_binding()),
        ];
        bind(device, "tile", &self.tile, &entries)
    }

    /// Binds what the light meter reads and writes beside the scene.
    pub fn bind_meter(&self, device: &Device, points: &wgpu::Buffer, readings: &wgpu::Buffer) -> BindGroup {
        let entries = [entry(3, points.as_entire_binding()), entry(4, readings.as_entire_binding())];
        bind(device, "meter", &self.meter, &entries)
    }

    /// The light meter's pipeline.
    pub fn meter_pipeline(&self, device: &Device, features: Features) -> ComputePipeline {
        let layout = pipeline_layout(device, &[&self.scene, &self.meter]);
        let constants = [
            ("PICTURES", flag(features.pictures)),
            ("BODIES", flag(features.bodies)),
            ("TRUE_HORIZON", flag(features.true_horizon)),
            ("WINDOWS", flag(features.windows)),
        ];
        compute(device, &source::meter(features.technique), Some(&layout), "read_meter", &constants)
    }

    /// The passes of a picture.
    pub fn pipelines(&self, device: &Device, features: Features) -> Pipelines {
        let layout = pipeline_layout(device, &[&self.scene, &self.tile]);
        let mut constants = vec![
            ("DIFFUSE", flag(features.diffuse)),
            ("SPECULAR", flag(features.specular)),
            ("SKIP_LOBES", flag(features.skips.lobes)),
            ("SKIP_BEHIND_TILES", flag(features.skips.behind)),
            ("SKIP_BELOW_TILES", flag(features.skips.below_horizon)),
            ("SKIP_UNDER_TOLERANCE", flag(features.skips.under_tolerance)),
            ("TILES", flag(features.skips.by_tile() || features.skips.clusters)),
            ("CLUSTERS", flag(features.skips.clusters)),
            ("TEXTURES", flag(features.textures)),
            ("NEAR", flag(features.near)),
            ("PICTURES", flag(features.pictures)),
            ("BODIES", flag(features.bodies)),
            ("TRUE_HORIZON", flag(features.true_horizon)),
            ("HORIZONS", flag(features.horizons)),
            ("WINDOWS", flag(features.windows)),
        ];
        if source::has_tops(features.technique) {
            constants.push(("TOPS", flag(features.tops && !features.windows)));
        }
        Pipelines {
            gbuffer: self.gbuffer_pipeline(device),
            light: compute(device, &source::light(features.technique), Some(&layout), "light_pixels", &constants),
        }
    }

    fn gbuffer_pipeline(&self, device: &Device) -> RenderPipeline {
        let module = module(device, &source::gbuffer());
        device.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("gbuffer"),
            layout: Some(&pipeline_layout(device, &[&self.scene])),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("draw_triangle"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("store_triangle"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(VISIBILITY_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A WGSL override constant of type bool.
fn flag(b: bool) -> f64 {
    f64::from(u8::from(b))
}

fn buffer(binding: u32, visibility: ShaderStages, ty: BufferBindingType) -> BindGroupLayoutEntry {
    let ty = BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn entry(binding: u32, resource: BindingResource<'_>) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource }
}

fn bind(device: &Device, label: &str, layout: &BindGroupLayout, entries: &[BindGroupEntry<'_>]) -> BindGroup {
    device.device.create_bind_group(&BindGroupDescriptor { label: Some(label), layout, entries })
}

fn module(device: &Device, source: &Source) -> ShaderModule {
    device.device.create_shader_module(ShaderModuleDescriptor {
        label: Some(source.name),
        source: ShaderSource::Wgsl(source.code.as_str().into()),
    })
}

fn pipeline_layout(device: &Device, groups: &[&BindGroupLayout]) -> PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|g| Some(*g)).collect();
    device.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// A compute pipeline; without a layout, with that of its source.
pub fn compute(
    device: &Device,
    source: &Source,
    layout: Option<&PipelineLayout>,
    entry: &str,
    constants: &[(&str, f64)],
) -> ComputePipeline {
    device.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(source.name),
        layout,
        module: &module(device, source),
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}
