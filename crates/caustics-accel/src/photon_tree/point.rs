//! Points while they are sorted into a tree.

use caustics_geometry::glam::Vec3A;

#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) position: [f32; 3],
    pub(super) index: u32,
}

impl Point {
    #[inline(always)]
    pub(super) fn along(&self, axis: usize) -> f32 {
        self.position[axis]
    }
}

/// The least and the greatest coordinates of at least one point.
pub(super) fn bounds(points: &[Point]) -> (Vec3A, Vec3A) {
    // Two of each, so that one need not wait for the other.
    let mut low = [Vec3A::INFINITY; 2];
    let mut high = [Vec3A::NEG_INFINITY; 2];
    let mut pairs = points.chunks_exact(2);
    for pair in &mut pairs {
        for side in 0..2 {
            let position = Vec3A::from_array(pair[side].position);
            low[side] = low[side].min(position);
            high[side] = high[side].max(position);
        }
    }
    for point in pairs.remainder() {
        low[0] = low[0].min(Vec3A::from_array(point.position));
        high[0] = high[0].max(Vec3A::from_array(point.position));
    }
    (low[0].min(low[1]), high[0].max(high[1]))
}

/// The longest side of a box.
pub(super) fn widest_axis(extent: Vec3A) -> usize {
    let extent = extent.to_array();
    let widest = usize::from(extent[1] > extent[0]);
    if extent[2] > extent[widest] {
        2
    } else {
        widest
    }
}
