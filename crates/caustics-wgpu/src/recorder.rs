/// The most passes of a frame that are timed.
pub(crate) const MAX_TIMED_PASSES: u32 = 512;

/// Records passes into the host's encoder, and notes what it records.
pub(crate) struct Recorder<'a> {
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    queries: Option<&'a wgpu::QuerySet>,
    labels: Vec<&'static str>,
    work: RecordedWork,
}

/// How much a frame asks of the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordedWork {
    /// Compute and render passes.
    pub passes: u32,
    /// Dispatches in them.
    pub dispatches: u32,
    /// Draws in them.
    pub draws: u32,
}

impl<'a> Recorder<'a> {
    /// With queries, each pass writes its two timestamps.
    pub(crate) fn new(
        encoder: &'a mut wgpu::CommandEncoder,
        queries: Option<&'a wgpu::QuerySet>,
    ) -> Self {
        Self {
            encoder,
            queries,
            labels: Vec::new(),
            work: RecordedWork::default(),
        }
    }

    /// Begins a compute pass that holds so many dispatches.
    pub(crate) fn compute(
        &mut self,
        label: &'static str,
        dispatches: u32,
    ) -> wgpu::ComputePass<'_> {
        self.work.passes += 1;
        self.work.dispatches += dispatches;
        let timestamp_writes =
            self.next_queries(label)
                .map(|(query_set, first)| wgpu::ComputePassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(first),
                    end_of_pass_write_index: Some(first + 1),
                });
        self.encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(label),
                timestamp_writes,
            })
    }

    /// Begins a render pass of these color targets that holds so many draws.
    pub(crate) fn render(
        &mut self,
        label: &'static str,
        targets: &[wgpu::TextureView],
        load: wgpu::LoadOp<wgpu::Color>,
        draws: u32,
    ) -> wgpu::RenderPass<'_> {
        self.work.passes += 1;
        self.work.draws += draws;
        let timestamp_writes =
            self.next_queries(label)
                .map(|(query_set, first)| wgpu::RenderPassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(first),
                    end_of_pass_write_index: Some(first + 1),
                });
        let attachment = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load,
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        let color_attachments: Vec<_> = targets.iter().map(attachment).collect();
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &color_attachments,
            timestamp_writes,
            ..wgpu::RenderPassDescriptor::default()
        })
    }

    fn next_queries(&mut self, label: &'static str) -> Option<(&'a wgpu::QuerySet, u32)> {
        let first = self.labels.len() as u32;
        let queries = self.queries.filter(|_| first < MAX_TIMED_PASSES)?;
        self.labels.push(label);
        Some((queries, 2 * first))
    }

    /// The labels of the timed passes, in order, and the work of all.
    pub(crate) fn finish(self) -> (Vec<&'static str>, RecordedWork) {
        (self.labels, self.work)
    }
}
