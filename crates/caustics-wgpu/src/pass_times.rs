use crate::recorder::MAX_TIMED_PASSES;

/// How long one pass took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// The pass, by the name of its shader.
    pub pass: &'static str,
    /// From its beginning to its end, in nanoseconds.
    pub nanoseconds: f64,
}

/// The queries of a renderer.
#[derive(Clone, Debug)]
pub(crate) struct PassTimer {
    pub(crate) queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
}

/// Timestamps of a frame's passes, for the host to read when the frame is done.
#[derive(Clone, Debug)]
pub struct FrameTimestamps {
    buffer: wgpu::Buffer,
    passes: Vec<&'static str>,
    period: f32,
}

impl PassTimer {
    /// If the device can time passes.
    pub(crate) fn new(device: &wgpu::Device) -> Option<Self> {
        let is_offered = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        is_offered.then(|| Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("caustics passes"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_TIMED_PASSES,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("caustics timestamps"),
                size: 16 * u64::from(MAX_TIMED_PASSES),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
        })
    }

    pub(crate) fn resolve(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        passes: Vec<&'static str>,
        period: f32,
    ) -> FrameTimestamps {
        if !passes.is_empty() {
            let count = 2 * passes.len() as u32;
            encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        }
        FrameTimestamps {
            buffer: self.resolved.clone(),
            passes,
            period,
        }
    }
}

impl FrameTimestamps {
    /// What the host copies from, [`bytes`](Self::bytes) of it, before the next frame is prepared.
    #[must_use]
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// How many bytes there are.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        16 * self.passes.len() as u64
    }

    /// From the bytes that were copied: one for each pass, in order.
    #[must_use]
    pub fn pass_times(&self, bytes: &[u8]) -> Vec<PassTime> {
        let moment = |bytes: &[u8]| bytemuck::pod_read_unaligned::<u64>(bytes);
        self.passes
            .iter()
            .zip(bytes.chunks_exact(16))
            .map(|(pass, pair)| PassTime {
                pass,
                nanoseconds: f64::from(self.period)
                    * moment(&pair[8..]).saturating_sub(moment(&pair[..8])) as f64,
            })
            .collect()
    }
}
