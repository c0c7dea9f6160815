mod build;
mod clip;
mod events;
mod layout;
mod split;
mod traverse;

use caustics_geometry::glam::{Vec3, Vec3A};
use caustics_geometry::{Aabb, Hit, Ray};

use self::build::{Cells, build};
use self::clip::Bounds;
use self::layout::Node;
use self::traverse::{ClosestHit, Occlusion, Tree};
use crate::simd::{Dispatch, Kernel};
use crate::triangles::{self, Block, can_be_hit, corners_of, validate};
use crate::{AccelError, Instructions, Intersect};

/// Where a [`TriangleKdTree`] splits its cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum KdTreeSplit {
    /// Where a ray may expect to pay least, by the surface area heuristic.
    #[default]
    SurfaceArea,
    /// In the middle of the longest side: the classic without thought, for comparison. Large
    /// triangles near small ones make it slow.
    SpatialMedian,
}

/// How a ray goes from cell to cell of a [`TriangleKdTree`]. It finds the same either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum KdTreeTraversal {
    /// By a stack of few entries that forgets the oldest, and from the root where it has.
    #[default]
    ShortStack,
    /// From the root for every cell, without a stack, as on a processor without memory for one.
    Restart,
}

/// Settings of [`TriangleKdTree::new`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KdTreeOptions {
    /// Where cells are split.
    pub split: KdTreeSplit,
    /// How rays go from cell to cell.
    pub traversal: KdTreeTraversal,
    /// Processor instructions to trace with.
    pub instructions: Instructions,
}

/// Entries of the short stack.
const SHORT: usize = 8;

/// A kd-tree over triangles: space cut into cells, which rays visit strictly from near to far.
///
/// The classic rival of the [`TriangleBvh`](crate::TriangleBvh), behind the same trait, so that
/// both can be charted on a scene. It is built in O(n log n) and tests triangles eight at a time
/// as that tree does, but goes past one plane at a time, and a triangle lies in every cell that it
/// touches. It cannot be refitted.
///
/// As watertight: a ray aimed at an edge or a vertex that triangles share hits one of them. The
/// test in the leaves is the same, cells hold all triangles that it can see there, and a ray
/// visits all cells that rounding may have put the hit into.
///
/// ```
/// use caustics_accel::{Intersect, KdTreeOptions, KdTreeTraversal, TriangleKdTree};
/// use caustics_geometry::{Ray, glam::Vec3};
///
/// let corners = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
/// let floor = TriangleKdTree::new(&corners, &[[0, 2, 1], [0, 3, 2]], &KdTreeOptions::default())?;
/// let ray = Ray::new([0.5, 2.0, 0.25], Vec3::NEG_Y);
/// let hit = floor.closest_hit(&ray).expect("the floor is below");
/// assert_eq!((hit.t, hit.primitive), (2.0, 0));
/// // The same tree, traversed without a stack.
/// let stackless = floor.traversed_by(KdTreeTraversal::Restart);
/// assert_eq!(stackless.closest_hit(&ray), Some(hit));
/// # Ok::<(), caustics_accel::AccelError>(())
/// ```
///
/// # Limits
/// Those of [`TriangleBvh`](crate::TriangleBvh) for coordinates, directions and hits behind the
/// origin. A hit whose parameter is uncertain by more than the size of a cell, on a sliver seen
/// along its length, may give way to one behind it within that uncertainty.
#[derive(Clone, Debug)]
pub struct TriangleKdTree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// The root's cell, widened as the triangles in it are.
    cell: Bounds,
    bounds: Aabb,
    triangles: usize,
    traversal: KdTreeTraversal,
    dispatch: Dispatch,
}

/// A [`TriangleKdTree`] with a way of traversal of its own.
#[derive(Clone, Copy, Debug)]
pub struct TraversedKdTree<'a> {
    tree: &'a TriangleKdTree,
    traversal: KdTreeTraversal,
}

impl TriangleKdTree {
    /// The largest magnitude of a vertex coordinate, in metres: products of three of them fit an
    /// f32.
    pub const MAX_COORDINATE: f32 = triangles::MAX_COORDINATE;

    /// The most triangles that a tree takes.
    pub const MAX_TRIANGLES: usize = 1 << 25;

    /// Builds a tree over triangles given as three indices into `positions` each.
    ///
    /// A hit's `primitive` is an index into `triangles`. Builds in O(n log n) by sorting once
    /// (Wald and Havran, *On building fast kd-Trees for Ray Tracing, and on doing that in
    /// O(N log N)*, 2006), in parallel with the feature `parallel`; the result does not depend on
    /// the number of threads. No tree holds more than six copies of the average triangle.
    ///
    /// # Errors
    /// [`AccelError::NonFiniteVertex`], [`AccelError::VertexTooFar`],
    /// [`AccelError::VertexOutOfRange`] or [`AccelError::TooManyTriangles`].
    pub fn new<P: Copy + Into<Vec3> + Sync>(
        positions: &[P],
        triangles: &[[u32; 3]],
        options: &KdTreeOptions,
    ) -> Result<Self, AccelError> {
        validate(positions, triangles, Self::MAX_TRIANGLES)?;
        let corners = |triangle: u32| corners_of(positions, triangles, triangle);
        let mut bounds = Aabb::EMPTY;
        let mut listed = Vec::with_capacity(triangles.len());
        for triangle in 0..triangles.len() as u32 {
            let [a, b, c] = corners(triangle).map(Vec3A::from);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            if can_be_hit(low, high) {
                bounds = bounds.extend(low).extend(high);
                listed.push(triangle);
            }
        }
        let (Cells { nodes, blocks }, cell) = build(&listed, &corners, options.split);
        debug_assert!(nodes.len().max(blocks.len()) <= Node::MAX_PLACES);
        let tree = Self {
            nodes,
            blocks,
            cell,
            bounds,
            triangles: triangles.len(),
            traversal: options.traversal,
            dispatch: Dispatch::new(options.instructions),
        };
        debug_assert!(tree.is_valid(&listed, corners));
        Ok(tree)
    }

    /// The same tree, traversed in a given way.
    #[must_use]
    pub fn traversed_by(&self, traversal: KdTreeTraversal) -> TraversedKdTree<'_> {
        TraversedKdTree {
            tree: self,
            traversal,
        }
    }

    /// How many triangles the tree holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles
    }

    /// Whether the tree holds no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles == 0
    }

    /// The box around all triangles that can be hit: those of no area may lie outside.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.blocks.capacity() * size_of::<Block>()
    }

    fn tree(&self) -> Tree<'_> {
        Tree {
            nodes: &self.nodes,
            blocks: &self.blocks,
            bounds: &self.cell,
        }
    }

    /// The leaf's place that holds a point; that of the lower cell for a point between two.
    fn leaf_at(&self, point: [f32; 3]) -> usize {
        let mut place = 0;
        while let node = self.nodes[place]
            && !node.is_leaf()
        {
            place = node.lower() + usize::from(point[node.axis()] > node.split());
        }
        place
    }

    /// Whether every triangle listed, and no other, is in the leaves that hold its corners, or
    /// beside them if it lies in a plane between two.
    fn is_valid(&self, listed: &[u32], corners: impl Fn(u32) -> [[f32; 3]; 3]) -> bool {
        let mut present = Vec::new();
        let mut waiting = vec![(0, self.cell, 0)];
        while let Some((place, cell, level)) = waiting.pop() {
            let node = self.nodes[place];
            if node.is_leaf() {
                for block in &self.blocks[node.blocks()] {
                    let stored = block.primitives.iter().filter(|&&p| p != u32::MAX);
                    present.extend(stored.map(|&primitive| (primitive, place)));
                }
            } else {
                let (axis, split) = (node.axis(), node.split());
                if level == build::MAX_DEPTH || split < cell.low[axis] || split > cell.high[axis] {
                    return false;
                }
                let (lower, upper) = cell.cut(axis, split);
                waiting.push((node.lower(), lower, level + 1));
                waiting.push((node.lower() + 1, upper, level + 1));
            }
        }
        present.sort_unstable();
        let leaves_of = |triangle: u32| {
            let from = present.partition_point(|&(primitive, _)| primitive < triangle);
            let to = present.partition_point(|&(primitive, _)| primitive <= triangle);
            &present[from..to]
        };
        let mut once = present.clone();
        once.dedup();
        once.len() == present.len()
            && present
                .iter()
                .all(|(primitive, _)| listed.binary_search(primitive).is_ok())
            && listed.iter().all(|&triangle| {
                let leaves = leaves_of(triangle);
                let [a, b, c] = corners(triangle);
                let is_flat = (0..3).any(|k| a[k] == b[k] && b[k] == c[k]);
                !leaves.is_empty()
                    && [a, b, c].into_iter().all(|point| {
                        is_flat
                            || leaves
                                .binary_search(&(triangle, self.leaf_at(point)))
                                .is_ok()
                    })
            })
    }
}

impl Intersect for TriangleKdTree {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.traversed_by(self.traversal).closest_hit(ray)
    }

    #[inline]
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.traversed_by(self.traversal).is_occluded(ray)
    }
}

impl TraversedKdTree<'_> {
    #[inline]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        self.tree.dispatch.run(kernel)
    }
}

impl Intersect for TraversedKdTree<'_> {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let tree = self.tree.tree();
        match self.traversal {
            KdTreeTraversal::ShortStack => self.run(ClosestHit::<SHORT> { tree, ray }),
            KdTreeTraversal::Restart => self.run(ClosestHit::<0> { tree, ray }),
        }
    }

    #[inline]
    fn is_occluded(&self, ray: &Ray) -> bool {
        let tree = self.tree.tree();
        match self.traversal {
            KdTreeTraversal::ShortStack => self.run(Occlusion::<SHORT> { tree, ray }),
            KdTreeTraversal::Restart => self.run(Occlusion::<0> { tree, ray }),
        }
    }
}
