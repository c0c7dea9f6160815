use std::ops::Range;

use crate::GpuError;
use crate::error_scope::filled_buffer;
use crate::pass_layout::{PassLayout, Slot};
use crate::photon_buffers::PhotonBuffers;
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::SceneBuffers;
use crate::shader::{FOOTPRINT_RECORD, Shader, ShaderPiece, shader_piece};
use crate::trace_params::{MAX_EMITTERS, TraceParams};
use crate::trace_plan::{PlannedEmitter, TracePlan};

/// Photons of one workgroup. Mirrors `WORKGROUP_SIZE` in `shaders/tracer.wgsl`.
const WORKGROUP_SIZE: u32 = 64;

const fn pieces(parameters: ShaderPiece) -> [ShaderPiece; 27] {
    [
        parameters,
        FOOTPRINT_RECORD,
        shader_piece!("trace_params"),
        shader_piece!("scene"),
        shader_piece!("rounding"),
        shader_piece!("vector"),
        shader_piece!("double_float"),
        shader_piece!("random"),
        shader_piece!("wide_integer"),
        shader_piece!("sobol"),
        shader_piece!("halton"),
        shader_piece!("point_set"),
        shader_piece!("warp"),
        shader_piece!("ray"),
        shader_piece!("watertight"),
        shader_piece!("sphere"),
        shader_piece!("traverse"),
        shader_piece!("spawn"),
        shader_piece!("surface"),
        shader_piece!("optics"),
        shader_piece!("media"),
        shader_piece!("scatter"),
        shader_piece!("differential"),
        shader_piece!("emission"),
        shader_piece!("ledger"),
        shader_piece!("photon_store"),
        shader_piece!("tracer"),
    ]
}

/// For lights without area, whose rays have two parameters.
const SHADER_2: Shader = Shader {
    label: "tracer of 2 parameters",
    pieces: &pieces(shader_piece!("parameters_2")),
};

/// For area lights, whose rays have four.
const SHADER_4: Shader = Shader {
    label: "tracer of 4 parameters",
    pieces: &pieces(shader_piece!("parameters_4")),
};

/// What the shader binds, in the order of its bindings.
const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Write,
    Slot::Write,
    Slot::Write,
];

/// Traces photons on the GPU: emission, flight and landing in one dispatch, one photon to an
/// invocation.
///
/// It binds eight storage buffers, as many as WebGPU's default limits allow.
#[derive(Clone, Debug)]
pub struct PhotonTracer {
    layout: PassLayout,
    /// For rays of 2 and of 4 parameters.
    pipelines: [wgpu::ComputePipeline; 2],
}

impl PhotonTracer {
    /// Compiles the shaders. What the device has against them it tells its error scopes.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = PassLayout::new(device, "photon tracer", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let pipelines = [SHADER_2, SHADER_4]
            .map(|shader| layout.compute(device, &shader, "trace_photons", &[]));
        Self { layout, pipelines }
    }

    /// Records the tracing of a range of the plan's photons, whose records are appended to the
    /// buffers.
    ///
    /// Before the first batch of a frame call [`PhotonBuffers::clear`]; before every other,
    /// [`PhotonBuffers::forget_records`].
    ///
    /// # Errors
    /// [`GpuError::PhotonRange`], as [`RendererError::Gpu`]; [`RendererError::DeviceLost`].
    pub fn trace(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        scene: &SceneBuffers,
        plan: &TracePlan,
        photons: Range<u32>,
        into: &PhotonBuffers,
    ) -> Result<RecordedWork, RendererError> {
        let mut recorder = Recorder::new(encoder, None);
        self.record(device, &mut recorder, scene, plan, photons, into)?;
        Ok(recorder.finish().1)
    }

    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        scene: &SceneBuffers,
        plan: &TracePlan,
        photons: Range<u32>,
        into: &PhotonBuffers,
    ) -> Result<(), RendererError> {
        if photons.end > plan.photons() || photons.len() as u64 > u64::from(into.photons()) {
            return Err(RendererError::Gpu(GpuError::PhotonRange {
                first: photons.start,
                end: photons.end,
                photons: plan.photons(),
                batch: into.photons(),
            }));
        }
        // A photon that no dispatch is for has no records.
        recorder.encoder.clear_buffer(&into.links, 0, None);
        let mut dispatches = Vec::new();
        for dispatch in dispatches_of(plan, &photons) {
            let params = self.params(scene, plan, &photons, &dispatch, into);
            let uniform = filled_buffer(
                device,
                "trace params",
                wgpu::BufferUsages::UNIFORM,
                bytemuck::bytes_of(&params),
            )?;
            let resources = [
                &uniform,
                &scene.nodes,
                &scene.vertices,
                &scene.triangles,
                &scene.bodies,
                &scene.cumulative_areas,
                &into.records,
                &into.counters,
                &into.links,
            ]
            .map(wgpu::Buffer::as_entire_binding);
            let group = self.layout.bind(device, &resources);
            dispatches.push((usize::from(dispatch.dimensions > 2), group, params.count));
        }
        let mut pass = recorder.compute("trace", dispatches.len() as u32);
        for (pipeline, group, count) in &dispatches {
            pass.set_pipeline(&self.pipelines[*pipeline]);
            pass.set_bind_group(0, group, &[]);
            let groups = count.div_ceil(WORKGROUP_SIZE);
            pass.dispatch_workgroups(groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS), 1);
        }
        Ok(())
    }

    fn params(
        &self,
        scene: &SceneBuffers,
        plan: &TracePlan,
        batch: &Range<u32>,
        dispatch: &Dispatch,
        into: &PhotonBuffers,
    ) -> TraceParams {
        let mut params = TraceParams {
            zero: 0,
            first: dispatch.photons.start,
            count: dispatch.photons.len() as u32,
            batch_first: batch.start,
            emitter_count: dispatch.emitters.len() as u32,
            sequence: plan.sequence(),
            seed_low: plan.options.seed as u32,
            seed_high: (plan.options.seed >> 32) as u32,
            max_depth: plan.options.max_depth,
            branching: plan.branching(),
            min_weight: plan.options.min_weight,
            flux_scale: plan.flux_scale,
            first_link: into.photons(),
            root: scene.root,
            unused_a: 0,
            unused_b: 0,
            emitters: [crate::trace_params::Emitter::default(); MAX_EMITTERS],
        };
        let emitters = &plan.emitters[dispatch.emitters.clone()];
        for (slot, emitter) in params.emitters.iter_mut().zip(emitters) {
            *slot = emitter.mirror;
        }
        params
    }
}

/// Workgroups of a dispatch along its first axis.
const MAX_GROUPS: u32 = 32_768;

/// Consecutive photons of emitters that are all of one kind.
#[derive(Clone, Debug, PartialEq)]
struct Dispatch {
    photons: Range<u32>,
    emitters: Range<usize>,
    dimensions: u32,
}

/// The fewest dispatches for a range of photons.
fn dispatches_of(plan: &TracePlan, photons: &Range<u32>) -> Vec<Dispatch> {
    let mut all: Vec<Dispatch> = Vec::new();
    for (index, PlannedEmitter { mirror, dimensions }) in plan.emitters.iter().enumerate() {
        let start = mirror.first.max(photons.start);
        let end = (mirror.first + mirror.count).min(photons.end);
        if start >= end {
            continue;
        }
        match all.last_mut() {
            Some(last)
                if last.dimensions == *dimensions
                    && last.photons.end == start
                    && last.emitters.end == index
                    && last.emitters.len() < MAX_EMITTERS =>
            {
                last.photons.end = end;
                last.emitters.end = index + 1;
            }
            _ => all.push(Dispatch {
                photons: start..end,
                emitters: index..index + 1,
                dimensions: *dimensions,
            }),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::reflection;

    #[test]
    fn every_variant_is_valid() {
        for shader in [SHADER_2, SHADER_4] {
            if let Err(message) = reflection::validated(&shader) {
                panic!("{message}");
            }
        }
    }
}
