use super::scene_mesh::Vertex;
use super::{ALBEDO_FORMAT, DEPTH_FORMAT, NORMAL_FORMAT, OBJECT_FORMAT, Targets};

/// The format of linear radiance.
pub const LIT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

#[derive(Debug)]
pub(super) struct Pipelines {
    globals: wgpu::BindGroupLayout,
    gbuffer_inputs: wgpu::BindGroupLayout,
    lit_input: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    pub(super) shadow: wgpu::RenderPipeline,
    pub(super) gbuffer: wgpu::RenderPipeline,
    pub(super) lighting: wgpu::RenderPipeline,
    pub(super) shining: wgpu::RenderPipeline,
    pub(super) tone_map: wgpu::RenderPipeline,
}

/// One pipeline's differences from the others.
struct Kind<'a> {
    vertex: &'a str,
    fragment: Option<&'a str>,
    inputs: Option<&'a wgpu::BindGroupLayout>,
    targets: &'a [wgpu::TextureFormat],
    blend: Option<wgpu::BlendState>,
    depth: Option<(bool, wgpu::DepthBiasState)>,
    has_vertices: bool,
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let source = include_str!("engine.wgsl");
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("engine"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let float = texture(wgpu::TextureSampleType::Float { filterable: false });
        let depth = texture(wgpu::TextureSampleType::Depth);
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let globals = layout(device, &[uniform]);
        let gbuffer_inputs = layout(device, &[depth, float, float, depth, comparison]);
        let lit_input = layout(device, &[float]);
        let make = |kind: &Kind<'_>| pipeline(device, &module, &globals, kind);
        let solid = Kind {
            vertex: "surface",
            fragment: None,
            inputs: None,
            targets: &[],
            blend: None,
            depth: Some((true, wgpu::DepthBiasState::default())),
            has_vertices: true,
        };
        let flat = Kind {
            vertex: "whole_picture",
            depth: None,
            has_vertices: false,
            ..solid
        };
        let bias = wgpu::DepthBiasState {
            constant: 2,
            slope_scale: 2.0,
            clamp: 0.0,
        };
        Self {
            shadow: make(&Kind {
                vertex: "shadow",
                depth: Some((true, bias)),
                ..solid
            }),
            gbuffer: make(&Kind {
                fragment: Some("gbuffer"),
                targets: &[NORMAL_FORMAT, ALBEDO_FORMAT, OBJECT_FORMAT],
                ..solid
            }),
            lighting: make(&Kind {
                fragment: Some("lighting"),
                inputs: Some(&gbuffer_inputs),
                targets: &[LIT_FORMAT],
                ..flat
            }),
            shining: make(&Kind {
                fragment: Some("shining"),
                targets: &[LIT_FORMAT],
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                depth: Some((false, wgpu::DepthBiasState::default())),
                ..solid
            }),
            tone_map: make(&Kind {
                fragment: Some("tone_map"),
                inputs: Some(&lit_input),
                targets: &[format],
                ..flat
            }),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                compare: Some(wgpu::CompareFunction::LessEqual),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..wgpu::SamplerDescriptor::default()
            }),
            globals,
            gbuffer_inputs,
            lit_input,
        }
    }

    pub(super) fn bind_globals(
        &self,
        device: &wgpu::Device,
        globals: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        bind(device, &self.globals, &[globals.as_entire_binding()])
    }

    pub(super) fn bind_gbuffer(
        &self,
        device: &wgpu::Device,
        targets: &Targets,
        shadow: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let resources = [
            wgpu::BindingResource::TextureView(&targets.depth),
            wgpu::BindingResource::TextureView(&targets.normals),
            wgpu::BindingResource::TextureView(&targets.albedo),
            wgpu::BindingResource::TextureView(shadow),
            wgpu::BindingResource::Sampler(&self.sampler),
        ];
        bind(device, &self.gbuffer_inputs, &resources)
    }

    pub(super) fn bind_lit(
        &self,
        device: &wgpu::Device,
        lit: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let resources = [wgpu::BindingResource::TextureView(lit)];
        bind(device, &self.lit_input, &resources)
    }
}

fn layout(device: &wgpu::Device, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("engine"),
        entries: &entries,
    })
}

fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("engine"),
        layout,
        entries: &entries,
    })
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    globals: &wgpu::BindGroupLayout,
    kind: &Kind<'_>,
) -> wgpu::RenderPipeline {
    let groups: Vec<_> = [Some(globals), kind.inputs]
        .into_iter()
        .take(if kind.inputs.is_some() { 2 } else { 1 })
        .collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("engine"),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Uint32
    ];
    let vertices = [Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    })];
    let targets: Vec<_> = kind
        .targets
        .iter()
        .map(|&format| {
            Some(wgpu::ColorTargetState {
                format,
                blend: kind.blend,
                write_mask: wgpu::ColorWrites::ALL,
            })
        })
        .collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: kind.fragment.or(Some(kind.vertex)),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(kind.vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: if kind.has_vertices { &vertices } else { &[] },
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: kind.depth.map(|(writes, bias)| wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(writes),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: wgpu::StencilState::default(),
            bias,
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: kind.fragment.map(|entry_point| wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
