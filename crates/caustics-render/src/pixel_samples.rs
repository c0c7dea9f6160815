use glam::Vec2;

/// Those of a pixel's samples that see one surface.
///
/// Samples stand in the middles of a square of cells, [`SIDE`](Self::SIDE) a side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PixelSamples(u64);

impl PixelSamples {
    /// Samples along each side of a pixel.
    pub(crate) const SIDE: usize = 8;

    /// Samples of a pixel.
    pub(crate) const COUNT: usize = Self::SIDE * Self::SIDE;

    /// All of them.
    pub(crate) const ALL: Self = Self(u64::MAX >> (64 - Self::COUNT));

    /// Where in the pixel a sample is, row by row.
    pub(crate) fn place(sample: usize) -> Vec2 {
        let [column, row] = [sample % Self::SIDE, sample / Self::SIDE];
        (Vec2::new(column as f32, row as f32) + 0.5) / Self::SIDE as f32
    }

    /// One more.
    pub(crate) fn insert(&mut self, sample: usize) {
        self.0 |= 1 << sample;
    }

    pub(crate) fn has(self, column: usize, row: usize) -> bool {
        self.0 >> (row * Self::SIDE + column) & 1 == 1
    }

    pub(crate) fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// The part of the pixel that they stand for.
    pub(crate) fn coverage(self) -> f32 {
        self.count() as f32 / Self::COUNT as f32
    }
}
