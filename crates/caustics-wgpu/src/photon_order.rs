//! Records in the order of their photons, and footprints checked against where neighbours landed.

use bytemuck::{Pod, Zeroable};

use crate::buffers::filled_buffer;
use crate::pass_layout::{PassLayout, Slot};
use crate::photon_buffers::PhotonBuffers;
use crate::prefix_sum::PrefixSumPass;
use crate::recorder::Recorder;
use crate::renderer_error::RendererError;
use crate::shader::{FOOTPRINT_RECORD, Shader, shader_piece};

/// Photons of one workgroup. Mirrors `ORDER_WORKGROUP_SIZE` in `shaders/photon_order.wgsl`.
const ORDER_WORKGROUP_SIZE: u32 = 64;

/// Likewise of `COUNT_WORKGROUP_SIZE` in `shaders/photon_counts.wgsl`.
const COUNT_WORKGROUP_SIZE: u32 = 256;

const ORDER: Shader = Shader {
    label: "photon_order",
    pieces: &[
        FOOTPRINT_RECORD,
        shader_piece!("trace_params"),
        shader_piece!("vector"),
        shader_piece!("rounding"),
        shader_piece!("grid"),
        shader_piece!("lattice"),
        shader_piece!("ledger_lines"),
        shader_piece!("ledger"),
        shader_piece!("photon_links"),
        shader_piece!("sheet"),
        shader_piece!("neighbours"),
        shader_piece!("photon_beside"),
        shader_piece!("photon_order"),
    ],
};

const ORDER_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Write,
    Slot::Read,
    Slot::Write,
    Slot::Write,
];

const COUNTS: Shader = Shader {
    label: "photon_counts",
    pieces: &[
        shader_piece!("photon_links"),
        shader_piece!("photon_counts"),
    ],
};

const COUNT_SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Read, Slot::Write];

/// Mirror of the struct of the same name in `shaders/photon_counts.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct PhotonCounts {
    photons: u32,
    first_link: u32,
    unused_a: u32,
    unused_b: u32,
}

/// The passes after a batch is traced.
#[derive(Clone, Debug)]
pub(crate) struct PhotonOrder {
    count: (PassLayout, wgpu::ComputePipeline),
    prefix_sum: PrefixSumPass,
    order: (PassLayout, wgpu::ComputePipeline),
}

/// Photons of one batch that one dispatch traced: the uniform that it had, and how many they are.
pub(crate) type TracedPart<'a> = (&'a wgpu::Buffer, u32);

impl PhotonOrder {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let compute = |shader: &Shader, slots: &[Slot], entry| {
            let stage = wgpu::ShaderStages::COMPUTE;
            let layout = PassLayout::new(device, shader.label, stage, slots);
            let pipeline = layout.compute(device, shader, entry, &[]);
            (layout, pipeline)
        };
        Self {
            count: compute(&COUNTS, &COUNT_SLOTS, "count_photons"),
            prefix_sum: PrefixSumPass::new(device),
            order: compute(&ORDER, &ORDER_SLOTS, "order_photons"),
        }
    }

    /// Orders the records of the first `photons` of a batch, and makes their number the first
    /// counter.
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        photons: u32,
        parts: &[TracedPart<'_>],
        lists: &wgpu::Buffer,
        into: &PhotonBuffers,
    ) -> Result<(), RendererError> {
        let scratch = &into.scratch;
        let batch = PhotonCounts {
            photons,
            first_link: scratch.slots,
            unused_a: 0,
            unused_b: 0,
        };
        let uniform = filled_buffer(
            device,
            "photon counts",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&batch),
        )?;
        let resources = [&uniform, &scratch.links, &scratch.counts];
        let count = self
            .count
            .0
            .bind(device, &resources.map(wgpu::Buffer::as_entire_binding));
        let sum = self
            .prefix_sum
            .prepare(device, &scratch.counts, &into.starts, photons)?;
        let groups: Vec<_> = parts
            .iter()
            .map(|(params, count)| {
                let resources = [
                    *params,
                    &scratch.appended,
                    &scratch.links,
                    &into.starts,
                    &into.paths,
                    lists,
                    &into.records,
                    &into.counters,
                ];
                let resources = resources.map(wgpu::Buffer::as_entire_binding);
                (self.order.0.bind(device, &resources), *count)
            })
            .collect();
        let mut pass = recorder.compute("photon order", 4 + groups.len() as u32);
        pass.set_pipeline(&self.count.1);
        pass.set_bind_group(0, &count, &[]);
        dispatch(&mut pass, photons, COUNT_WORKGROUP_SIZE);
        self.prefix_sum.record(&mut pass, &sum);
        pass.set_pipeline(&self.order.1);
        for (group, count) in &groups {
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, *count, ORDER_WORKGROUP_SIZE);
        }
        drop(pass);
        // Without those that were traced as neighbours only.
        let total = 4 * u64::from(photons);
        recorder
            .encoder
            .copy_buffer_to_buffer(&into.starts, total, &into.counters, 0, 4);
        Ok(())
    }
}

/// Workgroups of a dispatch along its first axis.
const MAX_GROUPS: u32 = 32_768;

/// Dispatches as many workgroups as so many invocations need, in two axes.
pub(crate) fn dispatch(pass: &mut wgpu::ComputePass<'_>, invocations: u32, workgroup_size: u32) {
    let groups = invocations.div_ceil(workgroup_size);
    pass.dispatch_workgroups(groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS), 1);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{assert_layout, reflection};
    use crate::trace_counters::TraceCounters;
    use crate::trace_params::{MAX_EMITTERS, TraceParams};
    use crate::tracer_shaders::{LINK_WORDS, RECORDS_OF_DIVIDED};

    #[test]
    fn the_shaders_are_valid_and_agree_with_rust() {
        let (module, _) = reflection::validated(&ORDER).unwrap_or_else(|it| panic!("{it}"));
        let slots: Vec<(u32, Slot)> = (0..).zip(ORDER_SLOTS).collect();
        assert_eq!(reflection::buffers(&module), slots);
        let size = reflection::workgroup_size(&module, "order_photons");
        assert_eq!(size, [ORDER_WORKGROUP_SIZE, 1, 1]);
        let constant = |name| reflection::constant(&module, name);
        assert_eq!(constant("FLAG_CHECKS"), TraceParams::CHECKS);
        assert_eq!(constant("COUNTER_REPLACED"), TraceCounters::REPLACED as u32);
        assert_eq!(constant("MAX_EMITTERS"), MAX_EMITTERS as u32);
        assert_eq!(constant("LINK_PLACE"), !constant("LINK_THINNED"));
        assert_eq!(constant("LINK_WORDS"), LINK_WORDS);
        assert_eq!(constant("RECORDS_OF_DIVIDED"), RECORDS_OF_DIVIDED);

        let (module, _) = reflection::validated(&COUNTS).unwrap_or_else(|it| panic!("{it}"));
        let slots: Vec<(u32, Slot)> = (0..).zip(COUNT_SLOTS).collect();
        assert_eq!(reflection::buffers(&module), slots);
        let size = reflection::workgroup_size(&module, "count_photons");
        assert_eq!(size, [COUNT_WORKGROUP_SIZE, 1, 1]);
        assert_layout!(
            &module,
            PhotonCounts {
                photons,
                first_link,
                unused_a,
                unused_b
            }
        );
    }
}
