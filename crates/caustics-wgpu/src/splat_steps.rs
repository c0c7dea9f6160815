//! The uniforms that say which level and which round a dispatch is of.

use crate::buffers::filled_buffer;
use crate::pass_layout::part_of;
use crate::renderer_error::RendererError;
use crate::splat_view::{LEVELS, ROUNDS, SplatStep};

/// Bytes from one step's uniform to the next.
const STEP_STRIDE: u64 = 256;

/// The uniforms of all levels.
#[derive(Clone, Debug)]
pub(crate) struct SplatSteps(wgpu::Buffer);

impl SplatSteps {
    pub(crate) fn new(device: &wgpu::Device, layers: u32) -> Result<Self, RendererError> {
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
