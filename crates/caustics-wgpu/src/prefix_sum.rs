use bytemuck::{Pod, Zeroable};

use crate::buffers::{filled_buffer, storage_buffer};
use crate::pass_layout::{PassLayout, Slot};
use crate::renderer_error::RendererError;
use crate::shader::{Shader, shader_piece};

const SHADER: Shader = Shader {
    label: "prefix_sum",
    pieces: &[shader_piece!("prefix_sum")],
};

/// Values that one workgroup sums.
const BLOCK: u32 = 2048;

/// Mirror of the struct of the same name in `shaders/prefix_sum.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct PrefixSum {
    count: u32,
    blocks: u32,
    pad_a: u32,
    pad_b: u32,
}

/// Turns counts into the places where lists start.
#[derive(Clone, Debug)]
pub(crate) struct PrefixSumPass {
    layout: PassLayout,
    blocks: wgpu::ComputePipeline,
    of_blocks: wgpu::ComputePipeline,
    add: wgpu::ComputePipeline,
}

/// A prefix sum over two given buffers.
#[derive(Clone, Debug)]
pub(crate) struct PreparedPrefixSum {
    group: wgpu::BindGroup,
    blocks: u32,
}

impl PrefixSumPass {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let slots = [Slot::Uniform, Slot::Write, Slot::Write, Slot::Write];
        let layout = PassLayout::new(device, "prefix_sum", wgpu::ShaderStages::COMPUTE, &slots);
        let pipeline = |entry| layout.compute(device, &SHADER, entry, &[]);
        Self {
            blocks: pipeline("prefix_sum_blocks"),
            of_blocks: pipeline("prefix_sum_of_blocks"),
            add: pipeline("prefix_sum_add"),
            layout,
        }
    }

    /// For `count` values; `starts` has room for one more.
    pub(crate) fn prepare(
        &self,
        device: &wgpu::Device,
        values: &wgpu::Buffer,
        starts: &wgpu::Buffer,
        count: u32,
    ) -> Result<PreparedPrefixSum, RendererError> {
        let blocks = count.div_ceil(BLOCK).max(1);
        let size = PrefixSum {
            count,
            blocks,
            pad_a: 0,
            pad_b: 0,
        };
        let uniform = filled_buffer(
            device,
            "prefix_sum",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&size),
        )?;
        let sums = storage_buffer(
            device,
            "prefix_sum blocks",
            4 * u64::from(blocks),
            wgpu::BufferUsages::empty(),
        );
        let resources = [
            uniform.as_entire_binding(),
            values.as_entire_binding(),
            starts.as_entire_binding(),
            sums.as_entire_binding(),
        ];
        Ok(PreparedPrefixSum {
            group: self.layout.bind(device, &resources),
            blocks,
        })
    }

    /// Dispatches it; afterwards the values are zero.
    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass<'_>, sum: &PreparedPrefixSum) {
        pass.set_bind_group(0, &sum.group, &[]);
        for (pipeline, groups) in [
            (&self.blocks, sum.blocks),
            (&self.of_blocks, 1),
            (&self.add, sum.blocks),
        ] {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(groups, 1, 1);
        }
    }
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
            PrefixSum {
                count,
                blocks,
                pad_a,
                pad_b
            }
        );
    }
}
