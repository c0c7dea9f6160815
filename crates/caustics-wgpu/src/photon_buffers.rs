use crate::FootprintRecord;
use crate::error_scope::storage_buffer;
use crate::renderer_error::RendererError;
use crate::scene_buffers::fits;
use crate::trace_counters::TraceCounters;

/// Where a batch of photons lands: records, counters, and links between the records of one photon.
///
/// Records are appended in any order. The first word of [`counters`](Self::counters) says how many
/// there are, the second how much was lost because there was no room.
#[derive(Clone, Debug)]
pub struct PhotonBuffers {
    pub(crate) records: wgpu::Buffer,
    pub(crate) counters: wgpu::Buffer,
    pub(crate) links: wgpu::Buffer,
    capacity: u32,
    photons: u32,
}

impl PhotonBuffers {
    /// Room for `capacity` records of a batch of `photons`. A photon that is split at every surface
    /// stores two to four records in common scenes.
    ///
    /// # Errors
    /// [`BufferTooLarge`](crate::GpuError::BufferTooLarge), as [`RendererError::Gpu`]: 128 MiB hold
    /// 1.6 million records.
    pub fn new(device: &wgpu::Device, photons: u32, capacity: u32) -> Result<Self, RendererError> {
        let record_bytes = u64::from(capacity) * size_of::<FootprintRecord>() as u64;
        let link_bytes = 4 * (u64::from(photons) + 2 * u64::from(capacity));
        fits(device, "footprint records", record_bytes)?;
        fits(device, "links of records", link_bytes)?;
        let copies = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        // Not padded: the shader asks for the length to know how much room there is.
        let records = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("footprint records"),
            size: record_bytes.max(size_of::<FootprintRecord>() as u64),
            usage: copies | wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        Ok(Self {
            records,
            counters: storage_buffer(
                device,
                "trace counters",
                4 * TraceCounters::WORDS as u64,
                copies,
            ),
            links: storage_buffer(device, "links of records", link_bytes, copies),
            capacity: capacity.max(1),
            photons,
        })
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

    /// Links between records: a word for each photon of the batch, the place after its last record
    /// or 0 for none; then two words for each record, the place after the record that its photon
    /// stored before, and a hash of what the path met before it landed (the same as
    /// [`PhotonTrail::paths`](caustics_trace::PhotonTrail::paths)).
    #[must_use]
    pub fn links(&self) -> &wgpu::Buffer {
        &self.links
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

    /// Memory of the device that they occupy, in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.records.size() + self.counters.size() + self.links.size()
    }
}
