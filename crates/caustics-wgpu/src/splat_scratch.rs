use crate::buffers::{bound_buffer, largest_binding};
use crate::renderer_error::RendererError;
use crate::splat_options::SplatOptions;
use crate::splat_view::LEVELS;
use crate::{FootprintRecord, PhotonBuffers};

/// Bytes of a `StoredDensity` of `shaders/density.wgsl`.
pub(crate) const DENSITY_BYTES: u64 = 80;

/// Bytes of a `SplatPlace` of `shaders/splat_place.wgsl`.
pub(crate) const PLACE_BYTES: u64 = 40;

/// Splats that a footprint may become: its own, and what other surfaces catch of it before its plane.
pub(crate) const SPLATS_PER_FOOTPRINT: u32 = 2;

/// Footprints that one workgroup prepares.
pub(crate) const GROUP: u32 = 256;

/// What the views of a frame use one after the other.
#[derive(Clone, Debug)]
pub(crate) struct SplatScratch {
    /// Footprints of one batch that there is room for.
    pub(crate) capacity: u32,
    pub(crate) tiles: u32,
    pub(crate) densities: wgpu::Buffer,
    pub(crate) places: wgpu::Buffer,
    pub(crate) tile_counts: wgpu::Buffer,
    pub(crate) tile_starts: wgpu::Buffer,
    /// Pairs of footprints and tiles, or the order in which quads are drawn.
    pub(crate) pairs: wgpu::Buffer,
    pub(crate) peak_sums: wgpu::Buffer,
    pub(crate) draws: wgpu::Buffer,
}

/// Bytes of the buffers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplatSizes {
    pub(crate) densities: u64,
    places: u64,
    /// Of the counts, and of the starts.
    tiles: u64,
    pairs: u64,
    peak_sums: u64,
    draws: u64,
}

impl SplatSizes {
    pub(crate) fn of(capacity: u32, tiles: u32, pairs: u64, layers: u32) -> Self {
        let splats = u64::from(capacity) * u64::from(SPLATS_PER_FOOTPRINT);
        Self {
            densities: splats * DENSITY_BYTES,
            places: splats * PLACE_BYTES,
            tiles: 4 * u64::from(tiles + 1),
            pairs: 4 * pairs,
            peak_sums: 4 * u64::from(capacity.div_ceil(GROUP)),
            draws: 16 * LEVELS as u64 * u64::from(layers + 1),
        }
    }

    /// Each of them.
    #[cfg(test)]
    pub(crate) fn all(self) -> [u64; 6] {
        let Self {
            densities,
            places,
            tiles,
            pairs,
            peak_sums,
            draws,
        } = self;
        [densities, places, tiles, pairs, peak_sums, draws]
    }
}

impl SplatScratch {
    pub(crate) fn new(
        device: &wgpu::Device,
        capacity: u32,
        tiles: u32,
        pairs: u64,
        layers: u32,
    ) -> Result<Self, RendererError> {
        let limit = largest_binding(&device.limits());
        let sizes = SplatSizes::of(capacity, tiles, pairs.min(limit / 4), layers);
        let make = |what, bytes, usage| bound_buffer(device, what, bytes, usage);
        let none = wgpu::BufferUsages::empty();
        Ok(Self {
            capacity,
            tiles,
            densities: make("prepared footprints", sizes.densities, none)?,
            places: make("places of footprints", sizes.places, none)?,
            tile_counts: make("counts of tiles", sizes.tiles, wgpu::BufferUsages::COPY_DST)?,
            tile_starts: make("starts of tiles", sizes.tiles, none)?,
            pairs: make("pairs of footprints and tiles", sizes.pairs, none)?,
            peak_sums: make("peaks of footprints", sizes.peak_sums, none)?,
            draws: make("draws of quads", sizes.draws, wgpu::BufferUsages::INDIRECT)?,
        })
    }

    /// Room for pairs: for tiles as the options say, and for quads an order.
    pub(crate) fn pairs(options: &SplatOptions, capacity: u32) -> u64 {
        match options.method {
            crate::SplatMethod::Tiles => {
                u64::from(capacity.max(4096)) * u64::from(options.pairs_per_footprint)
            }
            crate::SplatMethod::Quads => u64::from(capacity) * u64::from(SPLATS_PER_FOOTPRINT),
        }
    }
}

/// Footprints in buffers of the GPU: [`FootprintRecord`]s, and a buffer whose first word is their
/// number. More than one binding holds are given as several batches.
#[derive(Clone, Copy, Debug)]
pub struct FootprintBatch<'a> {
    /// The records; its usage includes `STORAGE`.
    pub records: &'a wgpu::Buffer,
    /// Their number; its usage includes `STORAGE`.
    pub count: &'a wgpu::Buffer,
}

impl<'a> From<&'a PhotonBuffers> for FootprintBatch<'a> {
    /// The landings of traced photons.
    fn from(photons: &'a PhotonBuffers) -> Self {
        Self {
            records: photons.records(),
            count: photons.counters(),
        }
    }
}

impl FootprintBatch<'_> {
    /// Records that there is room for.
    #[must_use]
    pub fn capacity(&self) -> u32 {
        let records = self.records.size() / size_of::<FootprintRecord>() as u64;
        u32::try_from(records).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprints_take_the_memory_that_the_documentation_says() {
        let options = SplatOptions::default();
        let capacity = 1 << 20;
        let pairs = SplatScratch::pairs(&options, capacity);
        let all: u64 = SplatSizes::of(capacity, 0, pairs, 1).all().iter().sum();
        let each = all / u64::from(capacity);
        let told = format!("; and a footprint of the largest batch {each}");
        let documentation = include_str!("lib.rs").replace("\n//!", "");
        assert!(documentation.contains(&told), "{told}");
        let batch = (128 << 20) / (DENSITY_BYTES * u64::from(SPLATS_PER_FOOTPRINT));
        let told = format!("{:.1} million in 128 MiB", 1e-6 * batch as f64);
        assert!(documentation.contains(&told), "{told}");
    }
}
