//! What a view sees, from the host's depth and normals: receivers, halved to coarser levels, and the
//! pyramid of what tiles show.

use crate::pass_layout::{PassLayout, Slot};
use crate::recorder::Recorder;
use crate::shader::{Shader, shader_piece};
use crate::splat_steps::SplatSteps;
use crate::splat_targets::SplatTargets;
use crate::splat_view::{LEVELS, SURROUNDING_TILE};

const TEXELS: Shader = Shader {
    label: "splat_texels",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("splat_texels"),
    ],
};

const COARSEN: Shader = Shader {
    label: "splat_coarsen",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("screen"),
        shader_piece!("splat_coarsen"),
    ],
};

const SURROUNDINGS: Shader = Shader {
    label: "splat_surroundings",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("surroundings"),
        shader_piece!("splat_surroundings"),
    ],
};

/// The views of the host's that show what a view sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receivers<'a> {
    pub(crate) surface: &'a wgpu::TextureView,
    pub(crate) normals: &'a wgpu::TextureView,
    pub(crate) objects: Option<&'a wgpu::TextureView>,
}

/// The passes that do not depend on footprints.
#[derive(Clone, Debug)]
pub(crate) struct ReceiverPasses {
    texels: (PassLayout, wgpu::ComputePipeline),
    coarsen: (PassLayout, wgpu::ComputePipeline),
    surroundings: (PassLayout, [wgpu::ComputePipeline; 2]),
    nothing: wgpu::TextureView,
}

impl ReceiverPasses {
    /// `kernel` is what pieces that all passes share want to know.
    pub(crate) fn new(device: &wgpu::Device, kernel: &[(&str, f64)]) -> Self {
        let stages = wgpu::ShaderStages::COMPUTE;
        let receivers = [
            Slot::Store(wgpu::TextureFormat::Rgba32Uint),
            Slot::Store(wgpu::TextureFormat::R32Uint),
        ];
        let make = |shader: &Shader, slots: &[Slot]| {
            let layout = PassLayout::new(device, shader.label, stages, slots);
            let pipeline = layout.compute(device, shader, shader.label, kernel);
            (layout, pipeline)
        };
        let texels = [
            Slot::Uniform,
            Slot::Texture,
            Slot::Texture,
            Slot::UintTexture,
            receivers[0],
            receivers[1],
        ];
        let coarsen = [
            Slot::Uniform,
            Slot::Uniform,
            Slot::UintTexture,
            Slot::UintTexture,
            receivers[0],
            receivers[1],
        ];
        let surroundings = [
            Slot::Uniform,
            Slot::UintTexture,
            Slot::UintTexture,
            Slot::Write,
        ];
        let surroundings = PassLayout::new(device, SURROUNDINGS.label, stages, &surroundings);
        let nothing = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("caustics nothing"),
            size: wgpu::Extent3d::default(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self {
            texels: make(&TEXELS, &texels),
            coarsen: make(&COARSEN, &coarsen),
            surroundings: {
                let make = |entry| surroundings.compute(device, &SURROUNDINGS, entry, kernel);
                let both = ["splat_surroundings", "splat_surroundings_coarser"].map(make);
                (surroundings, both)
            },
            nothing: nothing.create_view(&wgpu::TextureViewDescriptor::default()),
        }
    }

    /// Records everything from the host's textures to the pyramid of what tiles show.
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        steps: &SplatSteps,
        receivers: &Receivers<'_>,
        targets: &SplatTargets,
    ) {
        let (layout, pipeline) = &self.texels;
        let group = layout.bind(
            device,
            &[
                view.as_entire_binding(),
                wgpu::BindingResource::TextureView(receivers.surface),
                wgpu::BindingResource::TextureView(receivers.normals),
                wgpu::BindingResource::TextureView(receivers.objects.unwrap_or(&self.nothing)),
                wgpu::BindingResource::TextureView(&targets.texels[0]),
                wgpu::BindingResource::TextureView(&targets.objects[0]),
            ],
        );
        let mut pass = recorder.compute("splat_texels", LEVELS as u32);
        let [width, height] = [targets.levels[0][0], targets.levels[0][1]];
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(16), height.div_ceil(16), 1);
        let (layout, pipeline) = &self.coarsen;
        pass.set_pipeline(pipeline);
        for level in 1..LEVELS {
            let group = layout.bind(
                device,
                &[
                    view.as_entire_binding(),
                    steps.at(level, true),
                    wgpu::BindingResource::TextureView(&targets.texels[level - 1]),
                    wgpu::BindingResource::TextureView(&targets.objects[level - 1]),
                    wgpu::BindingResource::TextureView(&targets.texels[level]),
                    wgpu::BindingResource::TextureView(&targets.objects[level]),
                ],
            );
            let [width, height] = [targets.levels[level][0], targets.levels[level][1]];
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        }
        drop(pass);
        let (layout, [finest, coarser]) = &self.surroundings;
        let group = layout.bind(
            device,
            &[
                view.as_entire_binding(),
                wgpu::BindingResource::TextureView(&targets.texels[0]),
                wgpu::BindingResource::TextureView(&targets.objects[0]),
                targets.surroundings.as_entire_binding(),
            ],
        );
        let mut pass = recorder.compute("splat_surroundings", 2);
        let [width, height] = [targets.levels[0][0], targets.levels[0][1]];
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(finest);
        pass.dispatch_workgroups(
            width.div_ceil(SURROUNDING_TILE),
            height.div_ceil(SURROUNDING_TILE),
            1,
        );
        pass.set_pipeline(coarser);
        pass.dispatch_workgroups(1, 1, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::reflection;

    #[test]
    fn the_shaders_are_valid() {
        for shader in [&TEXELS, &COARSEN, &SURROUNDINGS] {
            let valid = reflection::validated(shader);
            assert!(valid.is_ok(), "{}", valid.unwrap_err());
        }
    }
}
