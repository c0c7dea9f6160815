use crate::pass_layout::{PassLayout, Slot};
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};
use crate::splat_options::{SplatMethod, SplatOptions};
use crate::splat_quads::SplatQuads;
use crate::splat_receivers::{ReceiverPasses, Receivers};
use crate::splat_scratch::{FootprintBatch, GROUP, SplatScratch};
use crate::splat_steps::SplatSteps;
use crate::splat_targets::{SplatTargets, SumFormat};
use crate::splat_tiles::SplatTiles;
use crate::splat_view::LEVELS;

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

/// The passes that turn footprints into a view's irradiance.
#[derive(Clone, Debug)]
pub(crate) struct Splat {
    options: SplatOptions,
    format: SumFormat,
    receivers: ReceiverPasses,
    prepare: (PassLayout, wgpu::ComputePipeline),
    upsample: (PassLayout, wgpu::ComputePipeline),
    way: Way,
    steps: SplatSteps,
}

#[derive(Clone, Debug)]
enum Way {
    Tiles(SplatTiles),
    Quads(SplatQuads),
}

impl Splat {
    pub(crate) fn new(
        device: &wgpu::Device,
        options: &SplatOptions,
    ) -> Result<Self, RendererError> {
        let format = sum_format(device, options);
        let stages = wgpu::ShaderStages::COMPUTE;
        let kernel = [options.kernel.constant()];
        let limbs = [format.limbs_constant()];
        let make = |shader: &Shader, slots: &[Slot], constants: &[(&str, f64)]| {
            let layout = PassLayout::new(device, shader.label, stages, slots);
            let pipeline = layout.compute(device, shader, shader.label, constants);
            (layout, pipeline)
        };
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
        Ok(Self {
            options: *options,
            format,
            receivers: ReceiverPasses::new(device, &kernel),
            prepare: make(&PREPARE, &prepare, &kernel),
            upsample: make(&UPSAMPLE, &upsample, &[kernel[0], limbs[0]]),
            way: match options.method {
                SplatMethod::Tiles => Way::Tiles(SplatTiles::new(device, options)?),
                SplatMethod::Quads => Way::Quads(SplatQuads::new(device, options, format)?),
            },
            steps: SplatSteps::new(device, format.layers)?,
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
        self.receivers
            .record(device, recorder, view, &self.steps, receivers, targets);
        recorder.encoder.clear_buffer(&targets.counts, 0, None);
        if matches!(self.way, Way::Tiles(_)) && batches.len() > 1 {
            targets.second_sum(device);
        }
        if let Way::Quads(quads) = &self.way {
            self.record_quads(device, recorder, view, targets, scratch, batches, quads);
        }
        let mut sums = 0;
        if let Way::Tiles(tiles) = &self.way {
            for (number, batch) in batches.iter().enumerate() {
                self.record_prepare(device, recorder, view, targets, scratch, batch);
                sums = number % 2;
                let into = (sums, number == 0);
                let steps = &self.steps;
                tiles.record(device, recorder, view, targets, scratch, steps, batch, into)?;
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

    #[expect(clippy::too_many_arguments, reason = "one frame's worth")]
    fn record_quads(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        batches: &[FootprintBatch<'_>],
        quads: &SplatQuads,
    ) {
        let steps = &self.steps;
        // Scale and units are those of all batches together: there is room for one at a time, so that
        // each of several is prepared anew for each.
        let is_one = batches.len() == 1;
        let prepare = |recorder: &mut Recorder<'_>, batch| {
            self.record_prepare(device, recorder, view, targets, scratch, batch);
        };
        let order = |recorder: &mut Recorder<'_>, batch, is_first| {
            quads.record_order(device, recorder, targets, scratch, steps, batch, is_first);
        };
        if self.format.is_half() {
            for (number, batch) in batches.iter().enumerate() {
                prepare(recorder, batch);
                quads.record_scale(device, recorder, targets, scratch, steps, number == 0);
            }
        }
        for (number, batch) in batches.iter().enumerate() {
            let is_first = number == 0;
            if !(is_one && self.format.is_half()) {
                prepare(recorder, batch);
            }
            order(recorder, batch, is_first);
            quads.record_sample(device, recorder, view, targets, scratch, is_first);
        }
        quads.record_units(device, recorder, view, targets, steps);
        if !is_one {
            recorder.encoder.clear_buffer(&targets.counts, 0, None);
        }
        for (number, batch) in batches.iter().enumerate() {
            let is_first = number == 0;
            if !is_one {
                prepare(recorder, batch);
                order(recorder, batch, is_first);
            }
            quads.record(device, recorder, view, targets, scratch, is_first);
        }
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
    use crate::splat_view::{SURROUNDING_BYTES, SURROUNDING_TILE, SplatStep, SplatView};

    #[test]
    fn the_shaders_are_valid() {
        for shader in [&PREPARE, &UPSAMPLE] {
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
                pad,
                truncation,
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
