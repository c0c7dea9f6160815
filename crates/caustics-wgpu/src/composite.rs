use bytemuck::{Pod, Zeroable};

use crate::buffers::filled_buffer;
use crate::pass_layout::{PassLayout, Slot};
use crate::renderer_error::RendererError;
use crate::shader::{Shader, shader_piece};

const SHADER: Shader = Shader {
    label: "composite",
    pieces: &[shader_piece!("composite")],
};

/// What caustics are drawn into: the color target of a pass of the host's, and what else the pass
/// has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CompositeTarget {
    /// Format of the first color target; others are left alone.
    pub format: wgpu::TextureFormat,
    /// Samples a pixel.
    pub sample_count: u32,
    /// Format of the pass's depth, which is neither tested nor written.
    pub depth_format: Option<wgpu::TextureFormat>,
}

impl CompositeTarget {
    /// A target with one sample a pixel, without depth.
    #[must_use]
    pub const fn new(format: wgpu::TextureFormat) -> Self {
        Self {
            format,
            sample_count: 1,
            depth_format: None,
        }
    }
}

/// Mirror of the struct of the same name in `shaders/composite.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Composite {
    pub(crate) origin: [i32; 2],
    pub(crate) has_albedo: u32,
    pub(crate) exposure: f32,
}

/// Adds radiance to a target of the host's.
#[derive(Clone, Debug)]
pub(crate) struct CompositePass {
    layout: PassLayout,
    pipelines: Vec<(CompositeTarget, wgpu::RenderPipeline)>,
}

impl CompositePass {
    pub(crate) fn new(
        device: &wgpu::Device,
        targets: &[CompositeTarget],
    ) -> Result<Self, RendererError> {
        let slots = [Slot::Uniform, Slot::Texture, Slot::Texture];
        let layout = PassLayout::new(device, "composite", wgpu::ShaderStages::FRAGMENT, &slots);
        let module = SHADER.module(device);
        let pipelines = targets
            .iter()
            .map(|target| {
                let features = target.format.guaranteed_format_features(device.features());
                let is_blendable = features
                    .flags
                    .contains(wgpu::TextureFormatFeatureFlags::BLENDABLE);
                if !is_blendable {
                    return Err(RendererError::UnknownTarget {
                        format: format!("{:?}", target.format),
                    });
                }
                Ok((*target, pipeline(device, &layout, &module, target)))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { layout, pipelines })
    }

    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
        composite: &Composite,
        irradiance: &wgpu::TextureView,
        albedo: Option<&wgpu::TextureView>,
    ) -> Result<wgpu::BindGroup, RendererError> {
        let uniform = filled_buffer(
            device,
            "composite",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(composite),
        )?;
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(irradiance),
            wgpu::BindingResource::TextureView(albedo.unwrap_or(irradiance)),
        ];
        Ok(self.layout.bind(device, &resources))
    }

    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        group: &wgpu::BindGroup,
        target: &CompositeTarget,
    ) -> Result<(), RendererError> {
        let found = self.pipelines.iter().find(|(one, _)| one == target);
        let Some((_, pipeline)) = found else {
            return Err(RendererError::UnknownTarget {
                format: format!("{:?}", target.format),
            });
        };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
        Ok(())
    }
}

fn pipeline(
    device: &wgpu::Device,
    layout: &PassLayout,
    module: &wgpu::ShaderModule,
    target: &CompositeTarget,
) -> wgpu::RenderPipeline {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("composite"),
        layout: Some(&layout.pipeline_layout(device)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("composite_corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: target.depth_format.map(|format| wgpu::DepthStencilState {
            format,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: target.sample_count,
            ..wgpu::MultisampleState::default()
        },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("composite_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: target.format,
                blend: Some(wgpu::BlendState {
                    color: add,
                    alpha: add,
                }),
                write_mask: wgpu::ColorWrites::COLOR,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};

    #[test]
    fn the_shader_is_valid_and_its_uniform_is_laid_out_as_in_rust() {
        let (module, _) = reflection::validated(&SHADER).unwrap();
        assert_layout!(
            &module,
            Composite {
                origin,
                has_albedo,
                exposure
            }
        );
    }
}
