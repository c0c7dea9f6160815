use std::num::NonZeroU64;

use crate::shader::Shader;

/// What a pass binds in one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    Uniform,
    /// A storage buffer that is read.
    Read,
    /// A storage buffer that is written.
    Write,
    /// A texture of floats that is not filtered; depth serves, too.
    Texture,
    /// Layers of such textures.
    Layers,
    UintTexture,
    /// A texture that is written.
    Store(wgpu::TextureFormat),
}

/// What a pass binds, in order, from binding 0 of one group on.
#[derive(Clone, Debug)]
pub(crate) struct PassLayout {
    label: &'static str,
    group: wgpu::BindGroupLayout,
}

impl PassLayout {
    pub(crate) fn new(
        device: &wgpu::Device,
        label: &'static str,
        visibility: wgpu::ShaderStages,
        slots: &[Slot],
    ) -> Self {
        let entries: Vec<_> = (0..)
            .zip(slots)
            .map(|(binding, slot)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility,
                ty: slot.binding_type(),
                count: None,
            })
            .collect();
        let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        Self { label, group }
    }

    pub(crate) fn pipeline_layout(&self, device: &wgpu::Device) -> wgpu::PipelineLayout {
        pipeline_layout(device, self.label, &[self])
    }

    /// A compute pipeline of the shader's entry point.
    pub(crate) fn compute(
        &self,
        device: &wgpu::Device,
        shader: &Shader,
        entry_point: &'static str,
        constants: &[(&str, f64)],
    ) -> wgpu::ComputePipeline {
        compute_pipeline(device, &[self], shader, entry_point, constants)
    }

    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
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
            label: Some(self.label),
            layout: &self.group,
            entries: &entries,
        })
    }
}

fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    groups: &[&PassLayout],
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|layout| Some(&layout.group)).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// A compute pipeline whose groups are those of the layouts, in order.
pub(crate) fn compute_pipeline(
    device: &wgpu::Device,
    groups: &[&PassLayout],
    shader: &Shader,
    entry_point: &'static str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(&pipeline_layout(device, entry_point, groups)),
        module: &shader.module(device),
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants,
            ..wgpu::PipelineCompilationOptions::default()
        },
        cache: None,
    })
}

impl Slot {
    fn binding_type(self) -> wgpu::BindingType {
        let buffer = |ty| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
            sample_type,
            view_dimension,
            multisampled: false,
        };
        let float = wgpu::TextureSampleType::Float { filterable: false };
        match self {
            Self::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Self::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Self::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Self::Texture => texture(float, wgpu::TextureViewDimension::D2),
            Self::Layers => texture(float, wgpu::TextureViewDimension::D2Array),
            Self::UintTexture => texture(
                wgpu::TextureSampleType::Uint,
                wgpu::TextureViewDimension::D2,
            ),
            Self::Store(format) => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        }
    }
}

/// A part of a buffer, as a resource to bind.
pub(crate) fn part_of(buffer: &wgpu::Buffer, offset: u64, size: u64) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer,
        offset,
        size: NonZeroU64::new(size),
    })
}
