//! The binary tree over the triangles' boxes, from which the wide one is made.

use caustics_geometry::glam::Vec3A;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::BvhPreset;

/// A binary tree whose leaves hold one triangle each; the root comes first.
pub(super) struct BinaryTree {
    pub(super) nodes: Vec<BinaryNode>,
    /// The nodes' indices, children after their parents, each subtree in one piece.
    pub(super) order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    /// The left child, which the right one follows; or the triangle.
    pub(super) first: u32,
    pub(super) is_leaf: bool,
}

impl BinaryNode {
    /// Half the surface area of the box.
    pub(super) fn half_area(&self) -> f32 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// The box around a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleBounds {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    pub(super) triangle: u32,
}

impl Boundable for TriangleBounds {
    /// The box, grown by up to a 200th, each by an amount of its own.
    ///
    /// The builder merges neighbours whose union is smaller than that with any other. Among equal
    /// boxes none would be, and 10^5 copies of a triangle would take 10^5 rounds.
    fn aabb(&self) -> Aabb {
        let hash = self.triangle.wrapping_mul(0x9e37_79b9) >> 8;
        let amount = hash as f32 / (1 << 24) as f32;
        let size = (self.high - self.low).max_element();
        let magnitude = self.low.abs().max(self.high.abs());
        let growth = amount * (size / 256.0 + magnitude * (8.0 * f32::EPSILON));
        Aabb::new(self.low - growth, self.high + growth)
    }
}

impl BinaryTree {
    /// Clusters neighbouring boxes from the bottom up.
    ///
    /// PLOC (Meister, Bittner 2018) and parallel reinsertion (Meister, Bittner 2018), by obvhs.
    pub(super) fn clustered(boxes: &[TriangleBounds], preset: BvhPreset) -> Self {
        let (search, search_depth, reinsertion) = match preset {
            BvhPreset::FastestBuild => (PlocSearchDistance::Minimum, 0, 0.0),
            BvhPreset::FastBuild => (PlocSearchDistance::Minimum, 0, 0.01),
            BvhPreset::Balanced => (PlocSearchDistance::Low, 2, 0.02),
            BvhPreset::FastTrace => (PlocSearchDistance::High, 2, 0.2),
        };
        let indices = (0..boxes.len() as u32).collect();
        let mut tree: Bvh2 =
            PlocBuilder::new().build(search, boxes, indices, SortPrecision::U64, search_depth);
        if reinsertion > 0.0 {
            ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
        }
        let nodes = tree.nodes.iter().map(|node| {
            // A leaf of one triangle is numbered by its box.
            let is_leaf = node.is_leaf();
            let bounds = boxes[if is_leaf {
                node.first_index as usize
            } else {
                0
            }];
            let first = if is_leaf {
                bounds.triangle
            } else {
                node.first_index
            };
            BinaryNode {
                low: bounds.low,
                high: bounds.high,
                first,
                is_leaf,
            }
        });
        let mut tree = Self::new(nodes.collect());
        tree.refit();
        tree
    }

    fn new(nodes: Vec<BinaryNode>) -> Self {
        let mut order = Vec::with_capacity(nodes.len());
        let mut waiting = Vec::new();
        waiting.extend((!nodes.is_empty()).then_some(0));
        while let Some(index) = waiting.pop() {
            order.push(index);
            let node = &nodes[index as usize];
            if !node.is_leaf {
                waiting.extend([node.first + 1, node.first]);
            }
        }
        Self { nodes, order }
    }

    /// Computes the inner nodes' boxes from those of the leaves.
    fn refit(&mut self) {
        for &index in self.order.iter().rev() {
            let node = self.nodes[index as usize];
            if !node.is_leaf {
                let left = self.nodes[node.first as usize];
                let right = self.nodes[node.first as usize + 1];
                let node = &mut self.nodes[index as usize];
                node.low = left.low.min(right.low);
                node.high = left.high.max(right.high);
            }
        }
    }

    /// Halves the triangles at the median of their centres: no deeper than their number's
    /// logarithm, however they lie.
    pub(super) fn halved(boxes: &[TriangleBounds]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let placeholder = BinaryNode {
            low: Vec3A::ZERO,
            high: Vec3A::ZERO,
            first: 0,
            is_leaf: true,
        };
        let mut nodes = Vec::with_capacity(2 * boxes.len());
        if boxes.is_empty() {
            return Self::new(nodes);
        }
        nodes.push(placeholder);
        let mut waiting = vec![(0, 0, boxes.len())];
        while let Some((node, start, end)) = waiting.pop() {
            let slice = &mut order[start..end];
            let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
            let (mut low_center, mut high_center) = (low, high);
            for &index in &*slice {
                let bounds = &boxes[index as usize];
                low = low.min(bounds.low);
                high = high.max(bounds.high);
                low_center = low_center.min(bounds.low + bounds.high);
                high_center = high_center.max(bounds.low + bounds.high);
            }
            nodes[node] = BinaryNode {
                low,
                high,
                first: slice[0],
                is_leaf: true,
            };
            if slice.len() > 1 {
                let axis = (high_center - low_center).max_position();
                let center = |index: u32| {
                    let bounds = &boxes[index as usize];
                    bounds.low[axis] + bounds.high[axis]
                };
                let middle = slice.len() / 2;
                slice.select_nth_unstable_by(middle, |&a, &b| {
                    center(a).total_cmp(&center(b)).then(a.cmp(&b))
                });
                nodes[node].first = nodes.len() as u32;
                nodes[node].is_leaf = false;
                waiting.push((nodes.len(), start, start + middle));
                waiting.push((nodes.len() + 1, start + middle, end));
                nodes.extend([placeholder; 2]);
            }
        }
        Self::new(nodes)
    }
}
