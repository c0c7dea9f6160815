use crate::pass_layout::{PassLayout, Slot};
use crate::prefix_sum::PrefixSumPass;
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{Shader, shader_piece};
use crate::splat_options::SplatOptions;
use crate::splat_scratch::{FootprintBatch, GROUP, SPLATS_PER_FOOTPRINT, SplatScratch};
use crate::splat_steps::SplatSteps;
use crate::splat_targets::SplatTargets;
use crate::splat_view::{LEVELS, ROUNDS, TILE};

const BIN: Shader = Shader {
    label: "splat_bin",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("pixel_integral"),
        shader_piece!("surroundings"),
        shader_piece!("splat_place"),
        shader_piece!("splat_bin"),
    ],
};

const TILES: Shader = Shader {
    label: "splat_tiles",
    pieces: &[
        shader_piece!("gate"),
        shader_piece!("density"),
        shader_piece!("splat_view"),
        shader_piece!("pixel_integral"),
        shader_piece!("surroundings"),
        shader_piece!("splat_place"),
        shader_piece!("screen"),
        shader_piece!("splat_integral"),
        shader_piece!("splat_tiles"),
    ],
};

/// Sorts footprints into tiles by counting, and sums each tile in workgroup memory.
#[derive(Clone, Debug)]
pub(crate) struct SplatTiles {
    prefix_sum: PrefixSumPass,
    bin: PassLayout,
    count: wgpu::ComputePipeline,
    scatter: wgpu::ComputePipeline,
    tiles: PassLayout,
    sum: wgpu::ComputePipeline,
    nothing: wgpu::TextureView,
}

impl SplatTiles {
    pub(crate) fn new(
        device: &wgpu::Device,
        options: &SplatOptions,
    ) -> Result<Self, RendererError> {
        let stages = wgpu::ShaderStages::COMPUTE;
        let kernel = [options.kernel.constant()];
        let bin = [
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Write,
            Slot::Write,
            Slot::Write,
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
        ];
        let bin = PassLayout::new(device, "splat_bin", stages, &bin);
        let tiles = [
            Slot::Uniform,
            Slot::Uniform,
            Slot::Read,
            Slot::Read,
            Slot::Read,
            Slot::Read,
            Slot::UintTexture,
            Slot::Layers,
            Slot::Store(wgpu::TextureFormat::Rgba32Float),
            Slot::UintTexture,
            Slot::Read,
        ];
        let tiles = PassLayout::new(device, "splat_tiles", stages, &tiles);
        let nothing = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("caustics nothing"),
            size: wgpu::Extent3d::default(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Ok(Self {
            prefix_sum: PrefixSumPass::new(device),
            count: bin.compute(device, &BIN, "splat_count", &kernel),
            scatter: bin.compute(device, &BIN, "splat_scatter", &kernel),
            sum: tiles.compute(device, &TILES, "splat_tiles", &kernel),
            bin,
            tiles,
            nothing: nothing.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            }),
        })
    }

    /// Adds a batch of prepared footprints to sums number `into.0`; `into.1` says whether it is the
    /// first.
    #[expect(clippy::too_many_arguments, reason = "one batch's worth")]
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        view: &wgpu::Buffer,
        targets: &SplatTargets,
        scratch: &SplatScratch,
        steps: &SplatSteps,
        batch: &FootprintBatch<'_>,
        into: (usize, bool),
    ) -> Result<(), RendererError> {
        recorder.encoder.clear_buffer(&scratch.tile_counts, 0, None);
        let (sums, is_first) = into;
        let bind = |round| {
            self.bin.bind(
                device,
                &[
                    view.as_entire_binding(),
                    scratch.places.as_entire_binding(),
                    scratch.tile_starts.as_entire_binding(),
                    scratch.tile_counts.as_entire_binding(),
                    scratch.pairs.as_entire_binding(),
                    targets.counts.as_entire_binding(),
                    steps.in_round(0, is_first, round),
                    scratch.densities.as_entire_binding(),
                    targets.surroundings.as_entire_binding(),
                ],
            )
        };
        let prefix_sum = self.prefix_sum.prepare(
            device,
            &scratch.tile_counts,
            &scratch.tile_starts,
            targets.tiles,
        )?;
        let splats = batch.capacity() * SPLATS_PER_FOOTPRINT;
        let groups = splats.div_ceil(GROUP).max(1);
        {
            let mut pass = recorder.compute("splat_bin", 4);
            pass.set_pipeline(&self.count);
            pass.set_bind_group(0, &bind(0), &[]);
            pass.dispatch_workgroups(groups, 1, 1);
            self.prefix_sum.record(&mut pass, &prefix_sum);
        }
        for round in 0..ROUNDS {
            {
                let mut pass = recorder.compute("splat_bin", 1);
                pass.set_pipeline(&self.scatter);
                pass.set_bind_group(0, &bind(round), &[]);
                pass.dispatch_workgroups(groups, 1, 1);
            }
            let mut pass = recorder.compute("splat_tiles", LEVELS as u32);
            pass.set_pipeline(&self.sum);
            for level in 0..LEVELS {
                let before = if is_first {
                    &self.nothing
                } else {
                    &targets.sums[1 - sums].layers[level]
                };
                let group = self.tiles.bind(
                    device,
                    &[
                        view.as_entire_binding(),
                        steps.in_round(level, is_first, round),
                        scratch.densities.as_entire_binding(),
                        scratch.places.as_entire_binding(),
                        scratch.tile_starts.as_entire_binding(),
                        scratch.pairs.as_entire_binding(),
                        wgpu::BindingResource::TextureView(&targets.texels[level]),
                        wgpu::BindingResource::TextureView(before),
                        wgpu::BindingResource::TextureView(&targets.sums[sums].single[level][0]),
                        wgpu::BindingResource::TextureView(&targets.objects[level]),
                        targets.surroundings.as_entire_binding(),
                    ],
                );
                let [_, height, across, _] = targets.levels[level];
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(across, height.div_ceil(TILE), 1);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::reflection;

    #[test]
    fn the_shaders_are_valid_and_fit_the_default_workgroup_memory() {
        for shader in [&BIN, &TILES] {
            let valid = reflection::validated(shader);
            assert!(valid.is_ok(), "{}", valid.unwrap_err());
        }
        let (module, _) = reflection::validated(&TILES).unwrap();
        assert_eq!(reflection::constant(&module, "ROUNDS"), ROUNDS as u32);
        let workgroup = naga::AddressSpace::WorkGroup;
        let bytes: u32 = module
            .global_variables
            .iter()
            .filter(|(_, it)| it.space == workgroup)
            .map(|(_, it)| module.types[it.ty].inner.size(module.to_ctx()))
            .sum();
        let limit = wgpu::Limits::default().max_compute_workgroup_storage_size;
        assert!(bytes > 8192 && bytes <= limit, "{bytes}");
    }
}
