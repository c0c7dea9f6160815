use crate::simd::{Row, WIDTH};

/// Up to eight triangles of a leaf, one to a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block {
    /// By vertex, then by axis. An unused lane is NaN, which no ray meets.
    pub(crate) vertices: [[Row; 3]; 3],
    /// Indices in the caller's triangle list.
    pub(crate) primitives: [u32; WIDTH],
}

impl Block {
    pub(crate) const EMPTY: Self = Self {
        vertices: [[[f32::NAN; WIDTH]; 3]; 3],
        primitives: [u32::MAX; WIDTH],
    };

    pub(crate) fn set(&mut self, lane: usize, triangle: [[f32; 3]; 3], primitive: u32) {
        for (rows, vertex) in self.vertices.iter_mut().zip(triangle) {
            for (row, coordinate) in rows.iter_mut().zip(vertex) {
                row[lane] = coordinate;
            }
        }
        self.primitives[lane] = primitive;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_fill_whole_cache_lines() {
        assert_eq!(size_of::<Block>(), 320);
    }
}
