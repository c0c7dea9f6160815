use caustics_geometry::Aabb;
use caustics_geometry::glam::{Vec3, Vec3A};
use obvhs::Boundable;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::simd::{Dispatch, Kernel, Lanes, Row, Stack, WIDTH};
use crate::{AccelError, Instructions};

/// Entries that wait at most; see [`MAX_DEPTH`].
const STACK: usize = 512;

/// Levels of nodes that the stack suffices for: each leaves at most seven children waiting, and
/// the last one puts all eight on the stack for a moment.
const MAX_DEPTH: usize = (STACK - 1) / (WIDTH - 1);

/// A bounding volume hierarchy over boxes, which finds those that hold a point or overlap a box.
///
/// Each node has up to eight children that are tried at once, with AVX2 where the processor has
/// it. 40 to 60 bytes a box. Boxes may be of any sizes: a hash grid that held each in cells of its
/// own size answered 1.3 to 4.9 times more slowly, where the boxes were those of photons' footprints.
#[derive(Clone, Debug)]
pub struct BoxTree {
    /// The root comes first; none if there is no box.
    nodes: Vec<Node>,
    boxes: usize,
    dispatch: Dispatch,
}

/// The boxes of up to eight children, one to a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// For each axis the lower and the upper bounds. An unused lane is NaN, which overlaps
    /// nothing, not even a box without end.
    bounds: [[Row; 2]; 3],
    children: [Child; WIDTH],
}

impl Node {
    const EMPTY: Self = Self {
        bounds: [[[f32::NAN; WIDTH]; 2]; 3],
        children: [Child(0); WIDTH],
    };
}

/// A node, or a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Child(u32);

impl Child {
    const BOX: u32 = 1 << 31;

    fn of_box(index: usize) -> Self {
        Self(Self::BOX | index as u32)
    }

    #[inline(always)]
    fn is_box(self) -> bool {
        self.0 & Self::BOX != 0
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & !Self::BOX) as usize
    }
}

/// What a child of a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Member {
    /// A node, by its place.
    Node(usize),
    /// A box, by its place in the order of the tree.
    Box(usize),
}

impl BoxTree {
    /// The most boxes that a tree takes.
    pub const MAX_BOXES: usize = 1 << 31;

    /// Builds a tree over boxes and returns it with the boxes' indices in the order of the tree.
    ///
    /// A search names a box by its place in that order, so that what belongs to boxes close to
    /// each other is close in memory when it is put into the same order. Deterministic on any
    /// number of threads.
    ///
    /// # Errors
    /// [`AccelError::InvalidBox`] or [`AccelError::TooManyBoxes`].
    pub fn new(boxes: &[Aabb]) -> Result<(Self, Vec<u32>), AccelError> {
        if boxes.len() > Self::MAX_BOXES {
            return Err(AccelError::TooManyBoxes {
                count: boxes.len(),
                limit: Self::MAX_BOXES,
            });
        }
        let is_valid =
            |bounds: &Aabb| bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty();
        if let Some(index) = boxes.iter().position(|bounds| !is_valid(bounds)) {
            return Err(AccelError::InvalidBox { index });
        }
        let binary = cluster(boxes);
        let mut builder = Builder {
            boxes,
            nodes: Vec::new(),
            order: Vec::new(),
        };
        if !binary.nodes.is_empty() && !builder.collapse(&binary) {
            builder.pack(&binary.primitive_indices);
        }
        let Builder { nodes, order, .. } = builder;
        let dispatch = Dispatch::new(Instructions::Detect);
        let tree = Self {
            nodes,
            boxes: boxes.len(),
            dispatch,
        };
        debug_assert!(tree.is_valid(boxes, &order));
        Ok((tree, order))
    }

    /// Calls `visit` with the place, in the order that [`new`](Self::new) returned, of each box
    /// that overlaps `query`; one that touches it does.
    #[inline]
    pub fn for_each_overlapping(&self, query: &Aabb, visit: impl FnMut(usize)) {
        if !self.nodes.is_empty() {
            self.dispatch.run(Overlaps {
                nodes: &self.nodes,
                query,
                visit,
            });
        }
    }

    /// Calls `visit` as [`for_each_overlapping`](Self::for_each_overlapping) does, for each box
    /// that holds `point`.
    #[inline]
    pub fn for_each_around(&self, point: Vec3, visit: impl FnMut(usize)) {
        self.for_each_overlapping(
            &Aabb {
                min: point,
                max: point,
            },
            visit,
        );
    }

    /// The nodes, the root first: by lane what each child holds, and its box.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = [Option<(Member, Aabb)>; WIDTH]> + '_ {
        self.nodes
            .iter()
            .map(|node| std::array::from_fn(|lane| node.get(lane)))
    }

    /// Whether every box occurs once and lies within all the boxes above it.
    fn is_valid(&self, boxes: &[Aabb], order: &[u32]) -> bool {
        let mut seen = vec![false; boxes.len()];
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push((0, None::<Aabb>));
        }
        while let Some((place, above)) = waiting.pop() {
            for lane in 0..WIDTH {
                let Some((member, bounds)) = self.nodes[place].get(lane) else {
                    continue;
                };
                if above.is_some_and(|above| above.union(&bounds) != above) {
                    return false;
                }
                match member {
                    Member::Node(child) => waiting.push((child, Some(bounds))),
                    Member::Box(place) => {
                        let index = order[place] as usize;
                        if bounds != boxes[index] || std::mem::replace(&mut seen[index], true) {
                            return false;
                        }
                    }
                }
            }
        }
        seen.into_iter().all(|seen| seen)
    }

    /// How many boxes the tree holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.boxes
    }

    /// Whether the tree holds no box.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.boxes == 0
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.nodes.capacity() * size_of::<Node>()
    }
}

/// The search for all boxes that overlap one.
struct Overlaps<'a, V> {
    nodes: &'a [Node],
    query: &'a Aabb,
    visit: V,
}

impl<V: FnMut(usize)> Kernel for Overlaps<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let [x0, y0, z0] = self.query.min.to_array();
        let [x1, y1, z1] = self.query.max.to_array();
        let low = [lanes.splat(x0), lanes.splat(y0), lanes.splat(z0)];
        let high = [lanes.splat(x1), lanes.splat(y1), lanes.splat(z1)];
        let mut stack = Stack::<u32, STACK>::new();
        stack.push(0);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            let mut inside = lanes.at_most(lanes.load(&node.bounds[0][0]), high[0]);
            inside = lanes.and(
                inside,
                lanes.at_most(low[0], lanes.load(&node.bounds[0][1])),
            );
            for axis in 1..3 {
                let [lower, upper] = &node.bounds[axis];
                inside = lanes.and(inside, lanes.at_most(lanes.load(lower), high[axis]));
                inside = lanes.and(inside, lanes.at_most(low[axis], lanes.load(upper)));
            }
            let mut bits = lanes.bits(inside);
            while bits != 0 {
                let child = node.children[bits.trailing_zeros() as usize];
                bits &= bits - 1;
                if child.is_box() {
                    (self.visit)(child.index());
                } else {
                    stack.push(child.0);
                }
            }
        }
    }
}

struct Indexed {
    bounds: Aabb,
    index: u32,
}

impl Boundable for Indexed {
    /// The box, grown by up to a 256th, each by an amount of its own.
    ///
    /// The builder merges neighbours whose union is smaller than that with any other. Among equal
    /// boxes none would be, and 10^5 copies of a box would take 10^5 rounds.
    fn aabb(&self) -> obvhs::aabb::Aabb {
        let (low, high) = (Vec3A::from(self.bounds.min), Vec3A::from(self.bounds.max));
        let hash = self.index.wrapping_mul(0x9e37_79b9) >> 8;
        let amount = hash as f32 / (1 << 24) as f32;
        let magnitude = low.abs().max(high.abs());
        let growth =
            amount * ((high - low).max_element() / 256.0 + magnitude * (8.0 * f32::EPSILON));
        obvhs::aabb::Aabb::new(low - growth, high + growth)
    }
}

/// Clusters neighbouring boxes from the bottom up, by PLOC (Meister and Bittner 2018).
fn cluster(boxes: &[Aabb]) -> Bvh2 {
    let indexed: Vec<Indexed> = boxes
        .iter()
        .zip(0..)
        .map(|(&bounds, index)| Indexed { bounds, index })
        .collect();
    let indices = (0..boxes.len() as u32).collect();
    PlocBuilder::new().build(
        PlocSearchDistance::Minimum,
        &indexed,
        indices,
        SortPrecision::U64,
        0,
    )
}

/// Makes the wide tree.
struct Builder<'a> {
    boxes: &'a [Aabb],
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Builder<'_> {
    /// Takes from the binary tree, for each node, the descendants that are left when the largest
    /// is replaced by its children until there are eight. Returns whether the result is flat
    /// enough for a search's stack; if not, it is thrown away.
    fn collapse(&mut self, binary: &Bvh2) -> bool {
        self.nodes.push(Node::EMPTY);
        // A node, the binary one that it stands for, and the level it is on.
        let mut waiting = vec![(0, 0, 1)];
        while let Some((place, root, level)) = waiting.pop() {
            if level > MAX_DEPTH {
                self.nodes.clear();
                self.order.clear();
                return false;
            }
            let mut members = vec![root];
            while members.len() < WIDTH {
                let area = |&at: &usize| {
                    let node = &binary.nodes[at];
                    if node.is_leaf() {
                        -1.0
                    } else {
                        node.aabb().half_area()
                    }
                };
                let Some(largest) = (0..members.len())
                    .max_by(|&a, &b| area(&members[a]).total_cmp(&area(&members[b])))
                    .filter(|&largest| area(&members[largest]) >= 0.0)
                else {
                    break;
                };
                let first = binary.nodes[members[largest]].first_index as usize;
                members[largest] = first;
                members.push(first + 1);
            }
            let mut node = Node::EMPTY;
            for (lane, &member) in members.iter().enumerate() {
                let inner = &binary.nodes[member];
                let (bounds, child) = if inner.is_leaf() {
                    let index = binary.primitive_indices[inner.first_index as usize];
                    (self.boxes[index as usize], self.place(index))
                } else {
                    let child = self.nodes.len();
                    self.nodes.push(Node::EMPTY);
                    waiting.push((child, member, level + 1));
                    let bounds = inner.aabb();
                    (
                        Aabb {
                            min: bounds.min.into(),
                            max: bounds.max.into(),
                        },
                        Child(child as u32),
                    )
                };
                node.set(lane, &bounds, child);
            }
            self.nodes[place] = node;
        }
        true
    }

    fn place(&mut self, index: u32) -> Child {
        self.order.push(index);
        Child::of_box(self.order.len() - 1)
    }

    /// Shares the boxes, as they come, evenly among eight children, and so on: a tree as flat as
    /// can be. Returns its place and its box.
    fn pack(&mut self, order: &[u32]) -> (Aabb, Child) {
        if let &[index] = order {
            return (self.boxes[index as usize], self.place(index));
        }
        let place = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut all = Aabb::EMPTY;
        for (lane, part) in order.chunks(order.len().div_ceil(WIDTH)).enumerate() {
            let (bounds, child) = self.pack(part);
            self.nodes[place].set(lane, &bounds, child);
            all = all.union(&bounds);
        }
        (all, Child(place as u32))
    }
}

impl Node {
    fn get(&self, lane: usize) -> Option<(Member, Aabb)> {
        let side = |side: usize| Vec3::from_array(self.bounds.map(|axis| axis[side][lane]));
        let bounds = Aabb {
            min: side(0),
            max: side(1),
        };
        let child = self.children[lane];
        let member = if child.is_box() {
            Member::Box(child.index())
        } else {
            Member::Node(child.index())
        };
        (!bounds.is_empty()).then_some((member, bounds))
    }

    fn set(&mut self, lane: usize, bounds: &Aabb, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0][lane] = bounds.min[axis];
            self.bounds[axis][1][lane] = bounds.max[axis];
        }
        self.children[lane] = child;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_too_deep_to_search_is_packed_instead() {
        let boxes: Vec<Aabb> = (0..800)
            .map(|index| Aabb::new(Vec3::ZERO, Vec3::splat(1.0 + index as f32)))
            .collect();
        let mut builder = Builder {
            boxes: &boxes,
            nodes: Vec::new(),
            order: Vec::new(),
        };
        let binary = cluster(&boxes);
        // Clustering such boxes from the bottom up makes a chain.
        assert!(!builder.collapse(&binary));
        assert!(builder.nodes.is_empty() && builder.order.is_empty());

        builder.pack(&binary.primitive_indices);
        // 800 in parts of 100, of 13, and of 2 or 1.
        assert!(builder.nodes.len() <= 1 + 8 + 64 + 512);
        let tree = BoxTree {
            nodes: builder.nodes,
            boxes: boxes.len(),
            dispatch: Dispatch::new(Instructions::Detect),
        };
        for (first, bounds) in boxes.iter().enumerate() {
            let mut found = Vec::new();
            tree.for_each_around(bounds.max, |place| found.push(builder.order[place]));
            found.sort_unstable();
            assert!(found.into_iter().eq(first as u32..800));
        }
    }

    #[test]
    fn nodes_fill_whole_cache_lines() {
        assert_eq!(size_of::<Node>(), 256);
    }
}
