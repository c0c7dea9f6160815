use crate::error_scope::filled_buffer;
use crate::pass_layout::{PassLayout, Slot, part_of};
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};
use crate::splat_options::{SplatMethod, SplatOptions};
use crate::splat_quads::SplatQuads;
use crate::splat_scratch::{FootprintBatch, GROUP, SplatScratch};
use crate::splat_targets::{SplatTargets, SumFormat};
use crate::splat_tiles::SplatTiles;
use crate::splat_view::{LEVELS, ROUNDS, SURROUNDING_TILE, SplatStep};

const PREPARE: Shader = Shader {
    label: "splat_prepare",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        FOOTPRINT_RECORD,
        shader_piece!("splat_view"),
        shader_piece!("screen"),
        shader_piece!("pixel_integral"),
        shader_piece!("surroundings"),
        shader_piece!("splat_reach"),
        shader_piece!("splat_place"),
        shader_piece!("splat_prepare"),
    ],
};

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

const UPSAMPLE: Shader = Shader {
    label: "splat_upsample",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("splat_scale"),
        shader_piece!("splat_upsample"),
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

/// Bytes from one step's uniform to the next.
const STEP_STRIDE: u64 = 256;

/// The passes that turn footprints into a view's irradiance.
#[derive(Clone, Debug)]
pub(crate) struct Splat {
    options: SplatOptions,
    format: SumFormat,
    texels: (PassLayout, wgpu::ComputePipeline),
    coarsen: (PassLayout, wgpu::ComputePipeline),
    surroundings: (PassLayout, [wgpu::ComputePipeline; 2]),
    prepare: (PassLayout, wgpu::ComputePipeline),
    upsample: (PassLayout, wgpu::ComputePipeline),
    way: Way,
    steps: SplatSteps,
    nothing: wgpu::TextureView,
}

#[derive(Clone, Debug)]
enum Way {
    Tiles(SplatTiles),
    Quads(SplatQuads),
}

/// The views of the host's that show what a view sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receivers<'a> {
    pub(crate) surface: &'a wgpu::TextureView,
    pub(crate) normals: &'a wgpu::TextureView,
    pub(crate) objects: Option<&'a wgpu::TextureView>,
}

/// The uniforms of all levels.
#[derive(Clone, Debug)]
pub(crate) struct SplatSteps(wgpu::Buffer);

impl SplatSteps {
    fn new(device: &wgpu::Device, layers: u32) -> Result<Self, RendererError> {
        let mut bytes = vec![0; 2 * ROUNDS * LEVELS * STEP_STRIDE as usize];
        for (index, place) in bytes.chunks_exact_mut(STEP_STRIDE as usize).enumerate() {
            let step = SplatStep {
                level: (index % LEVELS) as u32,
                is_first: u32::from((index / LEVELS).is_multiple_of(2)),
                layers,
                round: (index / (2 * LEVELS)) as u32,
            };
            place[..size_of::<SplatStep>()].copy_from_slice(bytemuck::bytes_of(&step));
        }
        let usage = wgpu::BufferUsages::UNIFORM;
        Ok(Self(filled_buffer(device, "splat steps", usage, &bytes)?))
    }

    pub(crate) fn at(&self, level: usize, is_first: bool) -> wgpu::BindingResource<'_> {
        self.in_round(level, is_first, 0)
    }

    pub(crate) fn in_round(
        &self,
        level: usize,
        is_first: bool,
        round: usize,
    ) -> wgpu::BindingResource<'_> {
        let index = level + LEVELS * (2 * round + usize::from(!is_first));
        let size = size_of::<SplatStep>() as u64;
        part_of(&self.0, STEP_STRIDE * index as u64, size)
    }
}

impl Splat {
    pub(crate) fn new(
        device: &wgpu::Device,
        options: &SplatOptions,
    ) -> Result<Self, RendererError> {
        let format = sum_format(device, options);
        let stages = wgpu::ShaderStages::COMPUTE;
        let kernel = [options.kernel.constant()];
        let receivers = [
            Slot::Store(wgpu::TextureFormat::Rgba32Uint),
            Slot::Store(wgpu::TextureFormat::R32Uint),
        ];
        let make = |shader: &Shader, slots: &[Slot]| {
            let layout = PassLayout::new(device, shader.label, stages, slots);
            let pipeline = layout.compute(device, shader, shader.label, &kernel);
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
        let prepare = [
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Write,
            Slot::Write,
            Slot::Write,
            Slot::Write,
            Slot::Read,
        ];
        let surroundings = [
            Slot::Uniform,
            Slot::UintTexture,
            Slot::UintTexture,
            Slot::Write,
        ];
        let surroundings = PassLayout::new(device, SURROUNDINGS.label, stages, &surroundings);
        let upsample = [
            Slot::Uniform,
            Slot::Uniform,
            Slot::Layers,
            Slot::UintTexture,
            Slot::UintTexture,
            Slot::Texture,
            Slot::UintTexture,
            Slot::UintTexture,
            Slot::Store(wgpu::TextureFormat::Rgba32Float),
            Slot::Read,
        ];
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
        Ok(Self {
            options: *options,
            format,
            texels: make(&TEXELS, &texels),
            coarsen: make(&COARSEN, &coarsen),
            surroundings: {
                let make = |entry| surroundings.compute(device, &SURROUNDINGS, entry, &kernel);
                let both = ["splat_surroundings", "splat_surroundings_coarser"].map(make);
                (surroundings, both)
            },
            prepare: make(&PREPARE, &prepare),
            upsample: make(&UPSAMPLE, &upsample),
            way: match options.method {
                SplatMethod::Tiles => Way::Tiles(SplatTiles::new(device, options)?),
                SplatMethod::Quads => Way::Quads(SplatQuads::new(device, options, format)?),
            },
            steps: SplatSteps::new(device, format.layers)?,
            nothing: nothing.create_view(&wgpu::TextureViewDescriptor::default()),
        })
    }

    pub(crate) fn options(&self) -> &SplatOptions {
        &self.options
    }

    pub(crate) fn format(&self) -> SumFormat {
        self.format
    }

    /// Records everything from the host's depth and normals to the irradiance of the view.
    #[expect(clippy::too_many_arguments, reason = "one frame's worth")]
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        receivers: &Receivers<'_>,
        targets: &mut SplatTargets,
        scratch: &SplatScratch,
        batches: &[FootprintBatch<'_>],
    ) -> Result<(), RendererError> {
        self.record_receivers(device, recorder, view, receivers, targets);
        recorder.encoder.clear_buffer(&targets.counts, 0, None);
        if matches!(self.way, Way::Tiles(_)) && batches.len() > 1 {
            targets.second_sum(device);
        }
        if let Way::Quads(quads) = &self.way
            && quads.is_scaled()
        {
            // The scale is that of all batches together, and so is the estimate.
            let steps = &self.steps;
            for (number, batch) in batches.iter().enumerate() {
                self.record_prepare(device, recorder, view, targets, scratch, batch);
                quads.record_scale(device, recorder, targets, scratch, steps, number == 0);
            }
            for (number, batch) in batches.iter().enumerate() {
                let is_first = number == 0;
                if batches.len() > 1 {
                    self.record_prepare(device, recorder, view, targets, scratch, batch);
                }
                quads.record_order(device, recorder, targets, scratch, steps, batch, is_first);
                quads.record_estimate(device, recorder, view, targets, scratch, is_first);
            }
            recorder.encoder.clear_buffer(&targets.counts, 0, None);
        }
        let mut sums = 0;
        for (number, batch) in batches.iter().enumerate() {
            let is_first = number == 0;
            self.record_prepare(device, recorder, view, targets, scratch, batch);
            match &self.way {
                Way::Tiles(tiles) => {
                    sums = number % 2;
                    let into = (sums, is_first);
                    let steps = &self.steps;
                    tiles.record(device, recorder, view, targets, scratch, steps, batch, into)?;
                }
                Way::Quads(quads) => {
                    let steps = &self.steps;
                    quads.record_order(device, recorder, targets, scratch, steps, batch, is_first);
                    quads.record(device, recorder, view, targets, scratch, is_first);
                }
            }
        }
        if batches.is_empty() {
            recorder
                .encoder
                .clear_texture(&targets.irradiance, &wgpu::ImageSubresourceRange::default());
        } else {
            self.record_upsample(device, recorder, view, targets, sums);
        }
        Ok(())
    }

    fn record_receivers(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
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
                    self.steps.at(level, true),
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

    fn record_prepare(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        batch: &FootprintBatch<'_>,
    ) {
        let (layout, pipeline) = &self.prepare;
        // From here on the counts are those of a batch.
        let of_batch = std::mem::offset_of!(crate::splat_stats::SplatCounts, footprints) as u64;
        recorder
            .encoder
            .clear_buffer(&targets.counts, of_batch, None);
        let group = layout.bind(
            device,
            &[
                view.as_entire_binding(),
                batch.records.as_entire_binding(),
                batch.count.as_entire_binding(),
                scratch.densities.as_entire_binding(),
                scratch.places.as_entire_binding(),
                targets.counts.as_entire_binding(),
                scratch.peak_sums.as_entire_binding(),
                targets.surroundings.as_entire_binding(),
            ],
        );
        let mut pass = recorder.compute("splat_prepare", 1);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(batch.capacity().div_ceil(GROUP).max(1), 1, 1);
    }

    fn record_upsample(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        sums: usize,
    ) {
        let (layout, pipeline) = &self.upsample;
        let mut pass = recorder.compute("splat_upsample", LEVELS as u32);
        pass.set_pipeline(pipeline);
        for level in (0..LEVELS).rev() {
            // The coarsest has no coarser one: what is bound in its place is not read. It must not
            // be what is written.
            let coarse = if level + 1 < LEVELS { level + 1 } else { 0 };
            let group = layout.bind(
                device,
                &[
                    view.as_entire_binding(),
                    self.steps.at(level, true),
                    wgpu::BindingResource::TextureView(&targets.sums[sums].layers[level]),
                    wgpu::BindingResource::TextureView(&targets.texels[level]),
                    wgpu::BindingResource::TextureView(&targets.objects[level]),
                    wgpu::BindingResource::TextureView(&targets.totals[coarse]),
                    wgpu::BindingResource::TextureView(&targets.texels[coarse]),
                    wgpu::BindingResource::TextureView(&targets.objects[coarse]),
                    wgpu::BindingResource::TextureView(&targets.totals[level]),
                    targets.scale.as_entire_binding(),
                ],
            );
            let [width, height] = [targets.levels[level][0], targets.levels[level][1]];
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        }
    }
}

/// How light is summed on this device.
fn sum_format(device: &wgpu::Device, options: &SplatOptions) -> SumFormat {
    let is_blendable = device
        .features()
        .contains(wgpu::Features::FLOAT32_BLENDABLE);
    match options.method {
        SplatMethod::Quads if options.prefer_half_floats || !is_blendable => SumFormat {
            format: wgpu::TextureFormat::Rgba16Float,
            layers: options.half_float_layers,
            is_blended: true,
        },
        method => SumFormat {
            is_blended: method == SplatMethod::Quads,
            ..SumFormat::WRITTEN
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};
    use crate::splat_scratch::{DENSITY_BYTES, PLACE_BYTES};
    use crate::splat_stats::SplatCounts;
    use crate::splat_view::{SURROUNDING_BYTES, SplatView};

    #[test]
    fn the_shaders_are_valid() {
        for shader in [&PREPARE, &TEXELS, &COARSEN, &UPSAMPLE, &SURROUNDINGS] {
            let valid = reflection::validated(shader);
            assert!(valid.is_ok(), "{}", valid.unwrap_err());
        }
    }

    #[test]
    fn structs_are_laid_out_as_in_rust() {
        let (module, _) = reflection::validated(&PREPARE).unwrap();
        assert_layout!(
            &module,
            SplatView {
                view_projection,
                inverse_view_projection,
                eye,
                size,
                normal_encoding,
                has_positions,
                background_depth,
                scale,
                max_anisotropy,
                has_objects,
                integrate_pixels,
                surrounding_levels,
                pad_a,
                pad_b,
                levels,
                surroundings,
            }
        );
        assert_layout!(
            &module,
            SplatStep {
                level,
                is_first,
                layers,
                round
            }
        );
        assert_layout!(
            &module,
            SplatCounts {
                splatted,
                outside,
                hidden,
                turned_away,
                invalid,
                pairs,
                dropped_pairs,
                footprints,
                caught,
                pad,
                by_level,
                level_cursor,
            }
        );
        let sizes = ["StoredDensity", "SplatPlace", "SurroundingTile"]
            .map(|it| u64::from(reflection::layout(&module, it).1));
        assert_eq!(sizes, [DENSITY_BYTES, PLACE_BYTES, SURROUNDING_BYTES]);
        let tile = reflection::constant(&module, "SURROUNDING_TILE");
        assert_eq!(tile, SURROUNDING_TILE);
    }
}
