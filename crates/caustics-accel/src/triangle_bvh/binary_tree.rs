//! The binary tree over the triangles' boxes, from which the wide one is made.

use caustics_geometry::glam::Vec3A;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::BvhPreset;

/// A binary tree whose leaves hold one triangle each.
///
/// The root comes first, then its left subtree, then its right one, and so on down: every subtree is
/// a slice of nodes, and parents come before their children.
pub(super) struct BinaryTree {
    pub(super) nodes: Vec<BinaryNode>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    /// How far the right child is behind its parent, which the left child follows; 0 for a leaf.
    pub(super) right: u32,
    /// A leaf's triangle.
    pub(super) triangle: u32,
}

impl BinaryNode {
    pub(super) fn is_leaf(&self) -> bool {
        self.right == 0
    }

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
        Self::in_order(tree.nodes.len(), |node| {
            let node = &tree.nodes[node as usize];
            if node.is_leaf() {
                // A leaf of one triangle is numbered by its box.
                Linked::Leaf(boxes[node.first_index as usize])
            } else {
                Linked::Children(node.first_index)
            }
        })
    }

    /// Lays out a tree whose root has number 0 if there are any nodes. The boxes of inner nodes are
    /// left to be computed.
    fn in_order(count: usize, linked: impl Fn(u32) -> Linked) -> Self {
        let mut nodes: Vec<BinaryNode> = Vec::with_capacity(count);
        // Nodes, and of right children their parents' places.
        let mut waiting = Vec::new();
        waiting.extend((count > 0).then_some((0, None)));
        while let Some((number, parent)) = waiting.pop() {
            let place = nodes.len();
            if let Some(parent) = parent {
                let parent: usize = parent;
                nodes[parent].right = (place - parent) as u32;
            }
            let mut node = BinaryNode {
                low: Vec3A::INFINITY,
                high: Vec3A::NEG_INFINITY,
                right: 0,
                triangle: u32::MAX,
            };
            match linked(number) {
                Linked::Leaf(bounds) => {
                    (node.low, node.high) = (bounds.low, bounds.high);
                    node.triangle = bounds.triangle;
                }
                Linked::Children(left) => {
                    waiting.push((left + 1, Some(place)));
                    waiting.push((left, None));
                }
            }
            nodes.push(node);
        }
        Self { nodes }
    }

    /// Halves the triangles at the median of their centres: no deeper than their number's
    /// logarithm, however they lie.
    pub(super) fn halved(boxes: &[TriangleBounds]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut linked = Vec::with_capacity(2 * boxes.len());
        let mut waiting = Vec::new();
        if let Some(&first) = boxes.first() {
            linked.push(Linked::Leaf(first));
            waiting.push((0, 0, boxes.len()));
        }
        while let Some((node, start, end)) = waiting.pop() {
            let slice = &mut order[start..end];
            if let &mut [index] = slice {
                linked[node] = Linked::Leaf(boxes[index as usize]);
                continue;
            }
            let (mut low_center, mut high_center) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
            for &index in &*slice {
                let bounds = &boxes[index as usize];
                low_center = low_center.min(bounds.low + bounds.high);
                high_center = high_center.max(bounds.low + bounds.high);
            }
            let axis = (high_center - low_center).max_position();
            let center = |index: u32| {
                let bounds = &boxes[index as usize];
                bounds.low[axis] + bounds.high[axis]
            };
            let middle = slice.len() / 2;
            slice.select_nth_unstable_by(middle, |&a, &b| {
                center(a).total_cmp(&center(b)).then(a.cmp(&b))
            });
            let left = linked.len();
            linked[node] = Linked::Children(left as u32);
            waiting.push((left, start, start + middle));
            waiting.push((left + 1, start + middle, end));
            // Until it is their turn.
            linked.extend([Linked::Children(0); 2]);
        }
        Self::in_order(linked.len(), |node| linked[node as usize])
    }
}

/// A node of a tree laid out otherwise: a leaf, or the left child's number, which the right one's
/// follows.
#[derive(Clone, Copy)]
enum Linked {
    Leaf(TriangleBounds),
    Children(u32),
}
