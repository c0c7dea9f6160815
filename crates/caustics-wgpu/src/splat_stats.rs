use bytemuck::{Pod, Zeroable};

/// Mirror of the struct of the same name in `shaders/splat_place.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SplatCounts {
    pub(crate) splatted: u32,
    pub(crate) outside: u32,
    pub(crate) hidden: u32,
    pub(crate) turned_away: u32,
    pub(crate) invalid: u32,
    pub(crate) pairs: u32,
    pub(crate) dropped_pairs: u32,
    pub(crate) footprints: u32,
    pub(crate) caught: u32,
    pub(crate) pad: u32,
    pub(crate) by_level: [u32; 8],
    pub(crate) level_cursor: [u32; 8],
}

/// What became of the footprints of one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SplatStats {
    /// Footprints that overlap the picture.
    pub splatted: u32,
    /// Footprints that lie outside the picture or behind the camera.
    pub outside: u32,
    /// Footprints that lie behind something else in the picture.
    pub hidden: u32,
    /// Footprints on a receiver that shows the camera its other side.
    pub turned_away: u32,
    /// Footprints that are not finite numbers.
    pub invalid: u32,
    /// Pairs of a footprint and a tile that it touches.
    pub pairs: u32,
    /// Of these, pairs for which there was no room: light that is missing. See
    /// [`SplatOptions::pairs_per_footprint`](crate::SplatOptions::pairs_per_footprint).
    pub dropped_pairs: u32,
}

impl SplatStats {
    /// Bytes of the counts in a buffer.
    pub const BYTES: u64 = size_of::<SplatCounts>() as u64;

    /// From the bytes that the GPU wrote; `None` if there are fewer than [`BYTES`](Self::BYTES).
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let counts: SplatCounts =
            bytemuck::try_pod_read_unaligned(bytes.get(..Self::BYTES as usize)?).ok()?;
        Some(Self {
            splatted: counts.splatted,
            outside: counts.outside,
            hidden: counts.hidden,
            turned_away: counts.turned_away,
            invalid: counts.invalid,
            pairs: counts.pairs,
            dropped_pairs: counts.dropped_pairs,
        })
    }
}
