use caustics_geometry::glam::Vec3;

use crate::neighbour::{distance_squared_of, key};
use crate::{AccelError, NearestScratch, Neighbour};

/// Points above this number are partitioned on two threads.
#[cfg(feature = "parallel")]
const PARALLEL_POINTS: usize = 8192;

/// Enough for the far children on one path: the index limit keeps the tree below 31 levels.
const STACK: usize = 32;

/// The classic photon map: a left-balanced kd-tree without pointers.
///
/// The points themselves are the nodes, laid out in level order, so that the children of node `i`
/// are the nodes `2 i + 1` and `2 i + 2` and no memory is spent on links: 16 bytes a point. Each
/// node splits the widest axis of its points' bounding box at their left-balanced median.
///
/// Layout after Jensen, *Realistic Image Synthesis Using Photon Mapping* (2001), and Wald, *A
/// Stack-Free Traversal Algorithm for Left-Balanced k-d Trees* (2022).
#[derive(Clone, Debug, Default)]
pub struct LeftBalancedTree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Node {
    position: [f32; 3],
    /// Index of the point times four, plus the split axis.
    tag: u32,
}

impl Node {
    fn axis(&self) -> usize {
        (self.tag & 3) as usize
    }

    fn index(&self) -> u32 {
        self.tag >> 2
    }

    fn distance_squared(&self, point: Vec3) -> f32 {
        point.distance_squared(Vec3::from_array(self.position))
    }
}

impl LeftBalancedTree {
    /// The most points that a tree takes.
    pub const MAX_POINTS: usize = 1 << 30;

    /// Builds the tree in O(n log n), in parallel with the feature `parallel`; the result does not
    /// depend on the number of threads.
    ///
    /// # Errors
    /// [`AccelError::NonFinitePoint`] or [`AccelError::TooManyPoints`].
    pub fn new<P: Copy + Into<Vec3>>(positions: &[P]) -> Result<Self, AccelError> {
        if positions.len() > Self::MAX_POINTS {
            return Err(AccelError::TooManyPoints {
                count: positions.len(),
                limit: Self::MAX_POINTS,
            });
        }
        let mut in_order = Vec::with_capacity(positions.len());
        for (point, &position) in positions.iter().enumerate() {
            let position: Vec3 = position.into();
            if !position.is_finite() {
                return Err(AccelError::NonFinitePoint { point });
            }
            in_order.push(Node {
                position: position.to_array(),
                tag: (point as u32) << 2,
            });
        }
        partition(&mut in_order);
        let mut nodes = vec![Node::default(); in_order.len()];
        place(&in_order, &mut nodes, 0);
        let tree = Self { nodes };
        debug_assert!(tree.is_valid());
        Ok(tree)
    }

    /// How many points the tree holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the tree holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.nodes.capacity() * size_of::<Node>()
    }

    /// The `count` points nearest to `point`, no farther than `max_radius` metres.
    ///
    /// The last neighbour is the farthest; the others come in no particular order. Of points at
    /// the same distance those with the lower index are nearer. A NaN in the query finds nothing.
    pub fn nearest<'scratch>(
        &self,
        point: impl Into<Vec3>,
        count: usize,
        max_radius: f32,
        scratch: &'scratch mut NearestScratch,
    ) -> &'scratch [Neighbour] {
        self.nearest_where(point, count, max_radius, |_| true, scratch)
    }

    /// Like [`nearest`](Self::nearest), among the points whose index `accept` approves of.
    ///
    /// A rejected point does not count among the `count`.
    pub fn nearest_where<'scratch>(
        &self,
        point: impl Into<Vec3>,
        count: usize,
        max_radius: f32,
        mut accept: impl FnMut(u32) -> bool,
        scratch: &'scratch mut NearestScratch,
    ) -> &'scratch [Neighbour] {
        let heap = &mut scratch.keys;
        heap.clear();
        if count > 0 {
            self.visit(point.into(), max_radius, |node, distance_squared, bound| {
                let candidate = key(distance_squared, node.index());
                if heap.len() < count {
                    if accept(node.index()) {
                        heap.push(candidate);
                        sift_up(heap);
                    }
                } else if candidate < heap[0] && accept(node.index()) {
                    heap[0] = candidate;
                    sift_down(heap);
                }
                if heap.len() == count {
                    distance_squared_of(heap[0])
                } else {
                    bound
                }
            });
        }
        if !heap.is_empty() {
            let last = heap.len() - 1;
            heap.swap(0, last);
        }
        let found = heap.len();
        scratch.finish(found)
    }

    /// Calls `visit` with the index and the squared distance of every point no farther than
    /// `radius` metres from `point`.
    pub fn within(&self, point: impl Into<Vec3>, radius: f32, mut visit: impl FnMut(u32, f32)) {
        self.visit(point.into(), radius, |node, distance_squared, bound| {
            visit(node.index(), distance_squared);
            bound
        });
    }

    /// Walks the nodes within `radius`; `process` gets a node, its squared distance and the
    /// squared radius that still counts, and returns the one that counts from then on.
    fn visit(&self, point: Vec3, radius: f32, mut process: impl FnMut(&Node, f32, f32) -> f32) {
        // A negative radius gives a negative bound and so finds nothing.
        let mut bound = radius * radius.abs();
        let query = point.to_array();
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut height = 0;
        let mut slot = 0;
        loop {
            while let Some(node) = self.nodes.get(slot) {
                let distance_squared = node.distance_squared(point);
                if distance_squared <= bound {
                    bound = process(node, distance_squared, bound);
                }
                let to_plane = query[node.axis()] - node.position[node.axis()];
                let left_is_near = to_plane < 0.0;
                let far = 2 * slot + 1 + usize::from(left_is_near);
                slot = 2 * slot + 2 - usize::from(left_is_near);
                let to_plane_squared = to_plane * to_plane;
                if to_plane_squared <= bound && far < self.nodes.len() {
                    stack[height] = (far as u32, to_plane_squared);
                    height += 1;
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (far, to_plane_squared) = stack[height];
                if to_plane_squared <= bound {
                    slot = far as usize;
                    break;
                }
            }
        }
    }

    /// Whether every node separates its children by its plane and every index occurs once.
    fn is_valid(&self) -> bool {
        let mut seen = vec![false; self.nodes.len()];
        self.nodes.iter().enumerate().all(|(slot, node)| {
            let fresh = seen
                .get_mut(node.index() as usize)
                .is_some_and(|seen| !std::mem::replace(seen, true));
            let plane = node.position[node.axis()];
            let side = |child: usize| self.nodes.get(child).map(|c| c.position[node.axis()]);
            fresh
                && side(2 * slot + 1).is_none_or(|left| left <= plane)
                && side(2 * slot + 2).is_none_or(|right| right >= plane)
        })
    }
}

/// Nodes in the left subtree of a left-balanced tree of `count` nodes.
fn left_count(count: usize) -> usize {
    // The levels above the last are full; the last is filled from the left.
    let last_level = 1_usize << count.ilog2();
    let in_last_level = count - (last_level - 1);
    let half = last_level / 2;
    last_level / 2 + in_last_level.min(half) - usize::from(count > 1)
}

/// Sorts the nodes into in-order sequence of the left-balanced tree and notes the split axes.
fn partition(nodes: &mut [Node]) {
    if nodes.len() < 2 {
        return;
    }
    let mut low = nodes[0].position;
    let mut high = low;
    for node in &*nodes {
        for axis in 0..3 {
            low[axis] = low[axis].min(node.position[axis]);
            high[axis] = high[axis].max(node.position[axis]);
        }
    }
    let extent = [high[0] - low[0], high[1] - low[1], high[2] - low[2]];
    let mut axis = usize::from(extent[1] > extent[0]);
    if extent[2] > extent[axis] {
        axis = 2;
    }
    let middle = left_count(nodes.len());
    let (left, node, right) = nodes.select_nth_unstable_by(middle, |a, b| {
        a.position[axis]
            .total_cmp(&b.position[axis])
            .then(a.tag.cmp(&b.tag))
    });
    node.tag |= axis as u32;
    #[cfg(feature = "parallel")]
    if left.len() > PARALLEL_POINTS {
        rayon::join(|| partition(left), || partition(right));
        return;
    }
    partition(left);
    partition(right);
}

/// Copies an in-order sequence to level order below `slot`; as deep as the tree.
fn place(in_order: &[Node], nodes: &mut [Node], slot: usize) {
    if in_order.is_empty() {
        return;
    }
    let middle = left_count(in_order.len());
    nodes[slot] = in_order[middle];
    place(&in_order[..middle], nodes, 2 * slot + 1);
    place(&in_order[middle + 1..], nodes, 2 * slot + 2);
}

/// Restores the max-heap after a push.
fn sift_up(heap: &mut [u64]) {
    let mut child = heap.len() - 1;
    while child > 0 {
        let parent = (child - 1) / 2;
        if heap[parent] >= heap[child] {
            break;
        }
        heap.swap(parent, child);
        child = parent;
    }
}

/// Restores the max-heap after its root was replaced.
fn sift_down(heap: &mut [u64]) {
    let mut parent = 0;
    loop {
        let mut child = 2 * parent + 1;
        if child >= heap.len() {
            break;
        }
        if child + 1 < heap.len() && heap[child + 1] > heap[child] {
            child += 1;
        }
        if heap[parent] >= heap[child] {
            break;
        }
        heap.swap(parent, child);
        parent = child;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_subtree_sizes() {
        let expected = [0, 1, 1, 2, 3, 3, 3, 4, 5, 6, 7, 7];
        for (count, left) in (1..).zip(expected) {
            assert_eq!(left_count(count), left, "of {count}");
        }
    }

    #[test]
    fn empty_tree_finds_nothing() {
        let tree = LeftBalancedTree::new::<Vec3>(&[]).unwrap();
        assert!(tree.is_empty());
        assert!(
            tree.nearest(Vec3::ZERO, 5, 10.0, &mut NearestScratch::new())
                .is_empty()
        );
        tree.within(Vec3::ZERO, 10.0, |_, _| panic!("found a point"));
    }

    #[test]
    fn one_point() {
        let tree = LeftBalancedTree::new(&[[1.0, 2.0, 2.0]]).unwrap();
        let mut scratch = NearestScratch::new();
        let only = [Neighbour {
            index: 0,
            distance_squared: 9.0,
        }];
        assert_eq!(tree.nearest(Vec3::ZERO, 5, 3.0, &mut scratch), only);
        assert_eq!(
            tree.nearest(Vec3::ZERO, 5, f32::INFINITY, &mut scratch),
            only
        );
        assert_eq!(tree.nearest(Vec3::ZERO, 5, 2.999, &mut scratch), []);
        assert_eq!(tree.nearest(Vec3::ZERO, 5, -5.0, &mut scratch), []);
        assert_eq!(tree.nearest(Vec3::ZERO, 0, 3.0, &mut scratch), []);
        assert_eq!(tree.nearest(Vec3::NAN, 5, f32::INFINITY, &mut scratch), []);
    }

    #[test]
    fn rejected_points_do_not_count() {
        let positions: Vec<Vec3> = (0..10).map(|i| Vec3::X * i as f32).collect();
        let tree = LeftBalancedTree::new(&positions).unwrap();
        let mut scratch = NearestScratch::new();
        let found = tree.nearest_where(Vec3::ZERO, 3, 100.0, |i| i % 2 == 1, &mut scratch);
        let mut indices: Vec<u32> = found.iter().map(|n| n.index).collect();
        assert_eq!(
            found[2],
            Neighbour {
                index: 5,
                distance_squared: 25.0
            }
        );
        indices.sort_unstable();
        assert_eq!(indices, [1, 3, 5]);
    }

    #[test]
    fn non_finite_points_are_refused() {
        let positions = [Vec3::ZERO, Vec3::new(0.0, f32::NAN, 0.0)];
        let error = LeftBalancedTree::new(&positions).unwrap_err();
        assert_eq!(error, AccelError::NonFinitePoint { point: 1 });
        assert!(LeftBalancedTree::new(&[Vec3::INFINITY]).is_err());
    }
}
