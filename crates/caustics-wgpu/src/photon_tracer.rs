use std::ops::Range;

use crate::GpuError;
use crate::buffers::filled_buffer;
use crate::buffers::fits;
use crate::pass_layout::PassLayout;
use crate::photon_buffers::PhotonBuffers;
use crate::photon_order::{PhotonOrder, dispatch};
use crate::recorder::{RecordedWork, Recorder};
use crate::renderer_error::RendererError;
use crate::scene_buffers::SceneBuffers;
use crate::trace_counters::TraceCounters;
use crate::trace_dispatch::{Dispatch, dispatches_of, params};
use crate::trace_params::TraceParams;
use crate::trace_plan::TracePlan;
use crate::tracer_shaders::{
    BINARY, DIVIDERS, EDGE_WORKGROUP_SIZE, Hierarchy, MARK, SLOTS, WIDE, WORKGROUP_SIZE,
};

/// Photons that one dispatch traces, with the uniform that tells it which, what it binds, and whether
/// they are the batch's own.
type Traced = (Dispatch, wgpu::Buffer, wgpu::BindGroup, bool);

/// Traces photons on the GPU: emission, flight and landing in one dispatch, one photon to an
/// invocation; then those at the edges of sheets of light are divided, all records are put in order, and
/// their footprints checked.
///
/// It binds eight storage buffers, as many as WebGPU's default limits allow.
#[derive(Clone, Debug)]
pub struct PhotonTracer {
    layout: PassLayout,
    /// For rays of 2 and of 4 parameters.
    pipelines: [wgpu::ComputePipeline; 2],
    mark: wgpu::ComputePipeline,
    divide: wgpu::ComputePipeline,
    hierarchy: Hierarchy,
    order: PhotonOrder,
}

impl PhotonTracer {
    /// Compiles the shaders. What the device has against them it tells its error scopes.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_hierarchy(device, Hierarchy::default())
    }

    /// Likewise, with a choice.
    #[must_use]
    pub fn with_hierarchy(device: &wgpu::Device, hierarchy: Hierarchy) -> Self {
        let layout = PassLayout::new(device, "photon tracer", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let [binary, wide] = DIVIDERS;
        let (shaders, divider) = match hierarchy {
            Hierarchy::Binary => (BINARY, binary),
            Hierarchy::Wide => (WIDE, wide),
        };
        Self {
            pipelines: shaders.map(|shader| layout.compute(device, &shader, "trace_photons", &[])),
            mark: layout.compute(device, &MARK, "mark_edges", &[]),
            divide: layout.compute(device, &divider, "divide_photons", &[]),
            layout,
            hierarchy,
            order: PhotonOrder::new(device),
        }
    }

    /// Records the tracing of a range of the plan's photons, whose records fill the buffers.
    ///
    /// Before the first batch of a frame call [`PhotonBuffers::clear`]; before every other,
    /// [`PhotonBuffers::forget_records`]. With
    /// [`TraceOptions::check_footprints`](caustics_trace::TraceOptions::check_footprints), photons
    /// beside the range are traced again with it, so that batches have the footprints of one run.
    ///
    /// # Errors
    /// [`GpuError::PhotonRange`], [`GpuError::SceneChanged`] where the plan is of another environment,
    /// as [`RendererError::Gpu`]; [`RendererError::DeviceLost`].
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
        let scratch = &into.scratch;
        let wider = plan.with_neighbours(&photons);
        let slots = wider.len() as u32;
        if slots > scratch.slots {
            return Err(RendererError::Gpu(GpuError::PhotonRange {
                first: wider.start,
                end: wider.end,
                photons: plan.photons(),
                batch: scratch.slots,
            }));
        }
        // A photon that no dispatch is for has no records.
        let slots_bytes = 4 * u64::from(scratch.slots);
        recorder
            .encoder
            .clear_buffer(&scratch.links, 0, Some(slots_bytes));
        fits(device, "lists of emitters", 4 * plan.lists.len() as u64)?;
        let lists = filled_buffer(
            device,
            "lists of emitters",
            wgpu::BufferUsages::STORAGE,
            bytemuck::cast_slice(&plan.lists),
        )?;
        // The batch's own photons first: if there is no room for all, neighbours go without.
        let ranges = [
            photons.clone(),
            wider.start..photons.start,
            photons.end..wider.end,
        ];
        let mut dispatches = Vec::new();
        for (number, range) in ranges.iter().enumerate() {
            for part in dispatches_of(&plan.emitters, range) {
                let mut params = params(scene, plan, &part, into)?;
                params.batch_first = photons.start;
                params.slots = slots;
                if number > 0 {
                    params.flags |= TraceParams::NEIGHBOURS_ONLY;
                }
                let uniform = filled_buffer(
                    device,
                    "trace params",
                    wgpu::BufferUsages::UNIFORM,
                    bytemuck::bytes_of(&params),
                )?;
                let resources = [
                    &uniform,
                    match self.hierarchy {
                        Hierarchy::Binary => &scene.nodes,
                        Hierarchy::Wide => &scene.wide_nodes,
                    },
                    &scene.vertices,
                    &scene.triangles,
                    &scene.bodies,
                    &lists,
                    &scratch.appended,
                    &into.counters,
                    &scratch.links,
                ]
                .map(wgpu::Buffer::as_entire_binding);
                let group = self.layout.bind(device, &resources);
                dispatches.push((part, uniform, group, number == 0));
            }
        }
        let mut pass = recorder.compute("trace", dispatches.len() as u32);
        for (part, _, group, _) in &dispatches {
            pass.set_pipeline(&self.pipelines[usize::from(part.dimensions > 2)]);
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, part.photons.len() as u32, WORKGROUP_SIZE);
        }
        drop(pass);
        self.divide(device, recorder, plan, &dispatches, into)?;
        let own = dispatches.iter().filter(|(.., is_own)| *is_own);
        let parts: Vec<_> = own
            .map(|(part, uniform, ..)| (uniform, part.photons.len() as u32))
            .collect();
        let count = photons.len() as u32;
        self.order
            .record(device, recorder, count, &parts, &lists, into)
    }

    /// Divides those of the batch's own photons that stand at edges of sheets of light, where the plan
    /// asks for it.
    fn divide(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        plan: &TracePlan,
        dispatches: &[Traced],
        into: &PhotonBuffers,
    ) -> Result<(), RendererError> {
        let divided: Vec<_> = dispatches
            .iter()
            .filter(|(part, .., is_own)| *is_own && plan.divides_edges(part.dimensions))
            .collect();
        if divided.is_empty() {
            return Ok(());
        }
        let counter = |number: usize| 4 * number as u64;
        let edges = counter(TraceCounters::EDGES);
        recorder
            .encoder
            .clear_buffer(&into.counters, edges, Some(8));
        let mut pass = recorder.compute("edges", divided.len() as u32);
        pass.set_pipeline(&self.mark);
        for (part, _, group, _) in &divided {
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, part.photons.len() as u32, EDGE_WORKGROUP_SIZE);
        }
        drop(pass);
        // As many workgroups as there are edges for.
        let groups = filled_buffer(
            device,
            "workgroups of edges",
            wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST,
            bytemuck::cast_slice(&[0u32, 1, 1]),
        )?;
        let found = counter(TraceCounters::EDGE_GROUPS);
        recorder
            .encoder
            .copy_buffer_to_buffer(&into.counters, found, &groups, 0, 4);
        let mut pass = recorder.compute("division", divided.len() as u32);
        pass.set_pipeline(&self.divide);
        for (_, _, group, _) in &divided {
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups_indirect(&groups, 0);
        }
        Ok(())
    }
}
