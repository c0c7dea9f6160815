use crate::FootprintRecord;
use crate::buffers::{fits, storage_buffer};
use crate::renderer_error::RendererError;
use crate::trace_counters::TraceCounters;
use crate::tracer_shaders::LINK_WORDS;

/// Room for photons of other batches that are traced as neighbours of a batch's own: up to a row of
/// the largest lattice on either side.
const NEIGHBOURS: u32 = 2 * (1 << 16) + 4;

/// Where a batch of photons lands: records and counters.
///
/// Records are in the order of their photons, those of one photon in the order in which its branches
/// landed: two runs give the same bits, as long as there is room for all. The first word of
/// [`counters`](Self::counters) says how many there are, the second how much was lost because there
/// was no room.
#[derive(Clone, Debug)]
pub struct PhotonBuffers {
    pub(crate) records: wgpu::Buffer,
    pub(crate) paths: wgpu::Buffer,
    pub(crate) starts: wgpu::Buffer,
    pub(crate) counters: wgpu::Buffer,
    pub(crate) scratch: TraceScratch,
    capacity: u32,
    photons: u32,
}

/// What is used only while a batch is traced.
#[derive(Clone, Debug)]
pub(crate) struct TraceScratch {
    /// Records in the order in which they landed.
    pub(crate) appended: wgpu::Buffer,
    /// As `shaders/photon_links.wgsl` says.
    pub(crate) links: wgpu::Buffer,
    /// Records of each photon.
    pub(crate) counts: wgpu::Buffer,
    /// Photons that have a place in the links.
    pub(crate) slots: u32,
    /// Where in the links the places of records at edges begin.
    pub(crate) first_edge: u32,
}

impl PhotonBuffers {
    /// Room for `capacity` records of a batch of `photons`. A photon that is split at every surface
    /// stores two to four records in common scenes; one that is divided at the edge of a sheet of light
    /// takes three further places, which are a few hundredths of all.
    ///
    /// # Errors
    /// [`BufferTooLarge`](crate::GpuError::BufferTooLarge), as [`RendererError::Gpu`]: 128 MiB hold
    /// 1.6 million records.
    pub fn new(device: &wgpu::Device, photons: u32, capacity: u32) -> Result<Self, RendererError> {
        let scratch = TraceScratch::new(device, photons, capacity)?;
        Ok(Self::with_scratch(device, photons, capacity, scratch))
    }

    /// Room for another batch of as many. Both may be traced in the same frame, one after the other:
    /// they share what is used while they are.
    pub(crate) fn another(&self, device: &wgpu::Device) -> Self {
        Self::with_scratch(device, self.photons, self.capacity, self.scratch.clone())
    }

    fn with_scratch(
        device: &wgpu::Device,
        photons: u32,
        capacity: u32,
        scratch: TraceScratch,
    ) -> Self {
        let copies = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let make = |label, bytes| storage_buffer(device, label, bytes, copies);
        Self {
            records: make("footprint records", record_bytes(capacity)),
            paths: make("paths of records", 4 * u64::from(capacity)),
            starts: make("starts of photons", 4 * (u64::from(photons) + 1)),
            counters: make("trace counters", 4 * TraceCounters::WORDS as u64),
            scratch,
            capacity: capacity.max(1),
            photons,
        }
    }

    /// [`FootprintRecord`]s, as many as the first counter says.
    #[must_use]
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records
    }

    /// Counts and sums of flux; [`TraceCounters`] reads them.
    #[must_use]
    pub fn counters(&self) -> &wgpu::Buffer {
        &self.counters
    }

    /// A word for each photon of the batch: the place of its first record. In one more, the number of
    /// records.
    #[must_use]
    pub fn starts(&self) -> &wgpu::Buffer {
        &self.starts
    }

    /// A word for each record: a hash of what the path met before it landed, the same as
    /// [`PhotonTrail::paths`](caustics_trace::PhotonTrail::paths).
    #[must_use]
    pub fn paths(&self) -> &wgpu::Buffer {
        &self.paths
    }

    /// Records that there is room for.
    #[must_use]
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Photons of a batch.
    #[must_use]
    pub fn photons(&self) -> u32 {
        self.photons
    }

    /// Before the first batch of a frame: no records, and all counters zero.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.counters, 0, None);
    }

    /// Between batches: no records, and the ledger goes on.
    pub fn forget_records(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.counters, 0, Some(4));
    }

    /// Memory of the device that they occupy, in bytes, with what is used only while photons are
    /// traced.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let TraceScratch {
            appended,
            links,
            counts,
            ..
        } = &self.scratch;
        let own = [&self.records, &self.paths, &self.starts, &self.counters];
        let all = own.into_iter().chain([appended, links, counts]);
        all.map(wgpu::Buffer::size).sum()
    }
}

impl TraceScratch {
    fn new(device: &wgpu::Device, photons: u32, capacity: u32) -> Result<Self, RendererError> {
        let slots = photons.saturating_add(NEIGHBOURS);
        // A record's links, and its place among those at edges.
        let words = u64::from(LINK_WORDS + 1) * u64::from(capacity);
        let link_bytes = 4 * (u64::from(slots) + words);
        fits(device, "footprint records", record_bytes(capacity))?;
        fits(device, "links of records", link_bytes)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        // Not padded: the shader asks for the length to know how much room there is.
        let appended = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("footprint records as they land"),
            size: record_bytes(capacity),
            usage,
            mapped_at_creation: false,
        });
        let none = wgpu::BufferUsages::empty();
        Ok(Self {
            appended,
            links: storage_buffer(
                device,
                "links of records",
                link_bytes,
                wgpu::BufferUsages::COPY_DST,
            ),
            counts: storage_buffer(device, "records of photons", 4 * u64::from(photons), none),
            slots,
            first_edge: slots + LINK_WORDS * capacity,
        })
    }
}

/// At least one record.
fn record_bytes(capacity: u32) -> u64 {
    u64::from(capacity.max(1)) * size_of::<FootprintRecord>() as u64
}
