use caustics_geometry::Aabb;
use caustics_geometry::glam::Vec3A;
use obvhs::Boundable;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::ops::Range;

use crate::AccelError;

/// A binary tree over boxes that says which of them hold a point.
#[derive(Clone)]
pub struct BoxTree {
    tree: Bvh2,
}

struct Bounds {
    bounds: Aabb,
    index: u32,
}

impl Boundable for Bounds {
    fn aabb(&self) -> obvhs::aabb::Aabb {
        let hash = self.index.wrapping_mul(0x9e37_79b9) >> 8;
        let amount = hash as f32 / (1 << 24) as f32;
        let (low, high) = (Vec3A::from(self.bounds.min), Vec3A::from(self.bounds.max));
        let size = (high - low).max_element();
        let magnitude = low.abs().max(high.abs());
        let growth = amount * (size / 256.0 + magnitude * (8.0 * f32::EPSILON));
        obvhs::aabb::Aabb::new(low - growth, high + growth)
    }
}

impl BoxTree {
    /// Builds the tree.
    ///
    /// # Errors
    /// Never yet.
    pub fn new(boxes: &[Aabb]) -> Result<Self, AccelError> {
        let boxes: Vec<Bounds> = boxes
            .iter()
            .enumerate()
            .map(|(index, &bounds)| Bounds {
                bounds,
                index: index as u32,
            })
            .collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut tree = PlocBuilder::new().build(
            PlocSearchDistance::Minimum,
            &boxes,
            indices,
            SortPrecision::U64,
            0,
        );
        collapse(&mut tree, 4, 1.0);
        Ok(Self { tree })
    }

    /// The boxes' indices in the order in which queries name them.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.tree.primitive_indices
    }

    /// Calls `visit` with ranges of [`order`](Self::order).
    pub fn visit_overlapping(&self, query: &Aabb, mut visit: impl FnMut(Range<usize>)) {
        let query = obvhs::aabb::Aabb::new(query.min.into(), query.max.into());
        self.tree.aabb_traverse(query, |tree, node| {
            let node = &tree.nodes[node as usize];
            let first = node.first_index as usize;
            visit(first..first + node.prim_count as usize);
            true
        });
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.tree.nodes.capacity() * 32 + self.tree.primitive_indices.capacity() * 4
    }
}
