use bytemuck::{Pod, Zeroable};

use crate::buffers::filled_buffer;
use crate::pass_layout::{PassLayout, Slot, part_of};
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{Shader, shader_piece};
use crate::splat_options::SplatOptions;
use crate::splat_scratch::{FootprintBatch, GROUP, SPLATS_PER_FOOTPRINT, SplatScratch};
use crate::splat_steps::SplatSteps;
use crate::splat_targets::{SplatTargets, SumFormat};
use crate::splat_view::LEVELS;

const ORDER: Shader = Shader {
    label: "splat_order",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("pixel_integral"),
        shader_piece!("splat_place"),
        shader_piece!("splat_scale"),
        shader_piece!("splat_sample"),
        shader_piece!("splat_order"),
    ],
};

const QUADS: Shader = Shader {
    label: "splat_quads",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("pixel_integral"),
        shader_piece!("splat_place"),
        shader_piece!("screen"),
        shader_piece!("splat_integral"),
        shader_piece!("splat_scale"),
        shader_piece!("splat_sample"),
        shader_piece!("splat_rounding"),
        shader_piece!("splat_quads"),
    ],
};

const UNITS: Shader = Shader {
    label: "splat_units",
    pieces: &[
        shader_piece!("splat_view"),
        shader_piece!("splat_scale"),
        shader_piece!("splat_sample"),
        shader_piece!("splat_units"),
    ],
};

/// Bytes from one draw's uniform to the next.
const DRAW_STRIDE: u64 = 256;

/// Mirror of the struct of the same name in `shaders/splat_quads.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SplatDraw {
    level: u32,
    layer: u32,
    layers: u32,
    pad: u32,
}

/// Draws footprints as quads, which the blending unit adds.
///
/// Floats of b bits err by up to half of the last bit of what is already there at each addition, or by
/// all of it where the hardware cuts off: of n equal parts that is up to n 2^-b of their sum, all in
/// one direction. Half floats of 11 bits stop to add up after a thousand; numbers beyond 65,504 or
/// below 6e-8 do not exist in them. Against it:
///
/// - a sixteenth of the footprints is drawn first, for an estimate of each pixel's sum. Then each
///   footprint adds a multiple of a small part of that, rounded up or down so that the mean is right
///   (dithering along the golden ratio): such sums are exact;
/// - where half floats are blended, what was rounded is blended into a second target, which makes
///   them as good as floats of 20 bits;
/// - there, quads are shared among layers, each with less in it; and irradiance is scaled by the sum of
///   the peaks of all footprints, which no pixel can exceed.
#[derive(Clone, Debug)]
pub(crate) struct SplatQuads {
    order: PassLayout,
    sort: wgpu::ComputePipeline,
    draws: wgpu::ComputePipeline,
    peaks: wgpu::ComputePipeline,
    quads: PassLayout,
    draw: wgpu::RenderPipeline,
    draw_sample: wgpu::RenderPipeline,
    units: (PassLayout, wgpu::ComputePipeline),
    uniforms: wgpu::Buffer,
    format: SumFormat,
}

impl SplatQuads {
    pub(crate) fn new(
        device: &wgpu::Device,
        options: &SplatOptions,
        format: SumFormat,
    ) -> Result<Self, RendererError> {
        let kernel = [options.kernel.constant()];
        let order = [
            Slot::Uniform,
            Slot::Read,
            Slot::Write,
            Slot::Write,
            Slot::Write,
            Slot::Read,
            Slot::Write,
        ];
        let order = PassLayout::new(device, "splat_order", wgpu::ShaderStages::COMPUTE, &order);
        let quads = [
            Slot::Uniform,
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Read,
            Slot::Read,
            Slot::UintTexture,
            Slot::Read,
            Slot::UintTexture,
            Slot::UintTexture,
        ];
        let quads = PassLayout::new(
            device,
            "splat_quads",
            wgpu::ShaderStages::VERTEX_FRAGMENT,
            &quads,
        );
        let mut bytes = vec![0; LEVELS * (format.layers as usize + 1) * DRAW_STRIDE as usize];
        let samples = LEVELS as u32 * format.layers;
        for (index, place) in (0..).zip(bytes.chunks_exact_mut(DRAW_STRIDE as usize)) {
            let draw = if index < samples {
                SplatDraw {
                    level: index / format.layers,
                    layer: index % format.layers,
                    layers: format.layers,
                    pad: 0,
                }
            } else {
                SplatDraw {
                    level: index - samples,
                    layer: 0,
                    layers: 1,
                    pad: 0,
                }
            };
            place[..size_of::<SplatDraw>()].copy_from_slice(bytemuck::bytes_of(&draw));
        }
        let units = [
            Slot::Uniform,
            Slot::Uniform,
            Slot::Layers,
            Slot::Store(wgpu::TextureFormat::Rgba8Uint),
        ];
        let units = PassLayout::new(device, "splat_units", wgpu::ShaderStages::COMPUTE, &units);
        let limbs = [format.limbs_constant()];
        let pipeline = |is_sampled| {
            let sampled = if is_sampled { 1.0 } else { 0.0 };
            let constants = [kernel[0], limbs[0], ("QUADS_SAMPLED", sampled)];
            draw_pipeline(device, &quads, format, is_sampled, &constants)
        };
        let usage = wgpu::BufferUsages::UNIFORM;
        Ok(Self {
            sort: order.compute(device, &ORDER, "splat_order", &kernel),
            draws: order.compute(device, &ORDER, "splat_draws", &kernel),
            peaks: order.compute(device, &ORDER, "splat_peaks", &kernel),
            draw: pipeline(false),
            draw_sample: pipeline(true),
            units: {
                let pipeline = units.compute(device, &UNITS, "splat_units", &limbs);
                (units, pipeline)
            },
            uniforms: filled_buffer(device, "splat draws", usage, &bytes)?,
            order,
            quads,
            format,
        })
    }

    fn bind_order(
        &self,
        device: &wgpu::Device,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        steps: &SplatSteps,
        is_first: bool,
    ) -> wgpu::BindGroup {
        self.order.bind(
            device,
            &[
                steps.at(0, is_first),
                scratch.places.as_entire_binding(),
                targets.counts.as_entire_binding(),
                scratch.pairs.as_entire_binding(),
                scratch.draws.as_entire_binding(),
                scratch.peak_sums.as_entire_binding(),
                targets.scale.as_entire_binding(),
            ],
        )
    }

    /// Adds the peaks of a prepared batch to those before, and chooses the scale by all.
    pub(crate) fn record_scale(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        steps: &SplatSteps,
        is_first: bool,
    ) {
        let group = self.bind_order(device, targets, scratch, steps, is_first);
        let mut pass = recorder.compute("splat_scale", 1);
        pass.set_pipeline(&self.peaks);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }

    /// Orders a batch of prepared footprints by their levels.
    #[expect(clippy::too_many_arguments, reason = "one batch's worth")]
    pub(crate) fn record_order(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        steps: &SplatSteps,
        batch: &FootprintBatch<'_>,
        is_first: bool,
    ) {
        let order = self.bind_order(device, targets, scratch, steps, is_first);
        let mut pass = recorder.compute("splat_order", 2);
        pass.set_bind_group(0, &order, &[]);
        pass.set_pipeline(&self.sort);
        let splats = batch.capacity() * SPLATS_PER_FOOTPRINT;
        pass.dispatch_workgroups(splats.div_ceil(GROUP).max(1), 1, 1);
        pass.set_pipeline(&self.draws);
        pass.dispatch_workgroups(1, 1, 1);
    }

    /// Draws the sample of an ordered batch to where the sums will be, for the units.
    pub(crate) fn record_sample(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        is_first: bool,
    ) {
        let samples = LEVELS as u64 * u64::from(self.format.layers);
        for level in 0..LEVELS {
            let place = (level, samples + level as u64);
            let group = self.bind_quads(device, view, targets, scratch, place);
            let into = self.limbs_of(targets, level, 0);
            let mut pass = recorder.render("splat_sample", into, load(is_first), 1);
            self.draw_into(
                &mut pass,
                &self.draw_sample,
                targets,
                scratch,
                place,
                &group,
            );
        }
    }

    /// Chooses by the samples of all batches how finely each pixel is rounded.
    pub(crate) fn record_units(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        steps: &SplatSteps,
    ) {
        let (layout, pipeline) = &self.units;
        let mut pass = recorder.compute("splat_units", LEVELS as u32);
        pass.set_pipeline(pipeline);
        for (level, into) in targets.units.iter().flatten().enumerate() {
            let group = layout.bind(
                device,
                &[
                    view.as_entire_binding(),
                    steps.at(level, true),
                    wgpu::BindingResource::TextureView(&targets.sums[0].layers[level]),
                    wgpu::BindingResource::TextureView(into),
                ],
            );
            let [width, height, ..] = targets.levels[level];
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        }
    }

    /// Draws an ordered batch.
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        is_first: bool,
    ) {
        for level in 0..LEVELS {
            for layer in 0..self.format.layers {
                let index = level as u64 * u64::from(self.format.layers) + u64::from(layer);
                let place = (level, index);
                let group = self.bind_quads(device, view, targets, scratch, place);
                let into = self.limbs_of(targets, level, layer);
                let mut pass = recorder.render("splat_quads", into, load(is_first), 1);
                self.draw_into(&mut pass, &self.draw, targets, scratch, place, &group);
            }
        }
    }

    /// What a layer of a level is blended into.
    fn limbs_of<'a>(
        &self,
        targets: &'a SplatTargets,
        level: usize,
        layer: u32,
    ) -> &'a [wgpu::TextureView] {
        let limbs = self.format.limbs() as usize;
        &targets.sums[0].single[level][limbs * layer as usize..][..limbs]
    }

    /// For a level, and for the number of a draw.
    fn bind_quads(
        &self,
        device: &wgpu::Device,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        (level, index): (usize, u64),
    ) -> wgpu::BindGroup {
        let size = size_of::<SplatDraw>() as u64;
        // Sums that are blended have units; what stands for them is never read.
        let units = targets.units.as_ref().unwrap_or(&targets.objects);
        self.quads.bind(
            device,
            &[
                view.as_entire_binding(),
                part_of(&self.uniforms, DRAW_STRIDE * index, size),
                scratch.densities.as_entire_binding(),
                scratch.places.as_entire_binding(),
                scratch.pairs.as_entire_binding(),
                targets.counts.as_entire_binding(),
                wgpu::BindingResource::TextureView(&targets.texels[level]),
                targets.scale.as_entire_binding(),
                wgpu::BindingResource::TextureView(&units[level]),
                wgpu::BindingResource::TextureView(&targets.objects[level]),
            ],
        )
    }

    fn draw_into(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        (level, index): (usize, u64),
        group: &wgpu::BindGroup,
    ) {
        let [width, height, ..] = targets.levels[level];
        pass.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
        pass.set_scissor_rect(0, 0, width, height);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw_indirect(&scratch.draws, 16 * index);
    }
}

fn load(is_first: bool) -> wgpu::LoadOp<wgpu::Color> {
    if is_first {
        wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT)
    } else {
        wgpu::LoadOp::Load
    }
}

const ADD: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::One,
    operation: wgpu::BlendOperation::Add,
};

fn draw_pipeline(
    device: &wgpu::Device,
    layout: &PassLayout,
    format: SumFormat,
    is_sampled: bool,
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    let entry_point = match (format.limbs(), is_sampled) {
        (1, false) => "splat_single",
        (1, true) => "splat_single_sample",
        (_, false) => "splat_double",
        (_, true) => "splat_double_sample",
    };
    let target = wgpu::ColorTargetState {
        format: format.format,
        blend: Some(wgpu::BlendState {
            color: ADD,
            alpha: ADD,
        }),
        // A sample counts in alpha how many add to a pixel.
        write_mask: if is_sampled {
            wgpu::ColorWrites::ALL
        } else {
            wgpu::ColorWrites::COLOR
        },
    };
    let targets = vec![Some(target); format.limbs() as usize];
    let module = QUADS.module(device);
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants,
        ..wgpu::PipelineCompilationOptions::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("splat_quads"),
        layout: Some(&layout.pipeline_layout(device)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("splat_corner"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry_point),
            compilation_options,
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};
    use crate::splat_stats::SplatCounts;

    #[test]
    fn the_shaders_are_valid_and_agree_with_rust() {
        for shader in [&ORDER, &QUADS, &UNITS] {
            let valid = reflection::validated(shader);
            assert!(valid.is_ok(), "{}", valid.unwrap_err());
        }
        let (module, _) = reflection::validated(&QUADS).unwrap();
        assert_layout!(
            &module,
            SplatDraw {
                level,
                layer,
                layers,
                pad
            }
        );
        let source = QUADS.source();
        let words = std::mem::offset_of!(SplatCounts, by_level) / 4;
        assert!(source.contains(&format!("BY_LEVEL: u32 = {words}u;")));
    }
}
