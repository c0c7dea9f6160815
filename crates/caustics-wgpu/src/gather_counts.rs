/// What became of the footprints that a [`Gather`](crate::Gather) was built from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatherCounts {
    /// Footprints that can be found.
    pub stored: u32,
    /// Of these, footprints that were widened to the least extent.
    pub widened: u32,
    /// Of these, footprints that were shortened to the largest extent.
    pub shortened: u32,
    /// Footprints left out because their numbers are not finite.
    pub invalid: u32,
    /// Pairs of a footprint and a list.
    pub entries: u32,
    /// Of these, pairs for which there was no room: light that is missing.
    pub dropped_entries: u32,
}

impl GatherCounts {
    /// Bytes of the counts in a buffer.
    pub const BYTES: u64 = 32;

    /// From the bytes that the GPU wrote; `None` if there are fewer than [`BYTES`](Self::BYTES).
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words: [u32; 8] =
            bytemuck::try_pod_read_unaligned(bytes.get(..Self::BYTES as usize)?).ok()?;
        let [
            stored,
            widened,
            shortened,
            invalid,
            entries,
            dropped_entries,
            ..,
        ] = words;
        Some(Self {
            stored,
            widened,
            shortened,
            invalid,
            entries,
            dropped_entries,
        })
    }
}
