mod halves;
mod point;
mod search;
mod voxel_volume;

use caustics_geometry::glam::Vec3;

use self::point::Point;
use self::search::{Fold, Nearest, NearestWhere, Search};
use crate::simd::{Dispatch, Row, WIDTH};
use crate::{AccelError, Instructions, NearestScratch, Neighbour};

/// Points in a bucket.
const BUCKET: usize = 2 * WIDTH;

/// Widens a sum of distances by more than rounding can shorten it.
const WIDEN: f32 = 1.0 + 32.0 * f32::EPSILON;
/// Added where distances are so small, in metres, that their squares lose digits.
const TINY: f32 = 1e-18;

/// Points above this number are partitioned on two threads.
#[cfg(feature = "parallel")]
const PARALLEL_POINTS: usize = 8192;

/// A photon map for fast searches: a kd-tree of buckets of sixteen points.
///
/// Sixteen points lie together as rows of coordinates, so that their distances are computed side
/// by side; inner nodes keep the gap between the points on their two sides. The k nearest are
/// collected unsorted and thinned out by selection, in place of a heap. All buckets but the last
/// are full, 17 bytes a point; with [`PhotonSplits::VoxelVolume`] nearly all.
///
/// Finds exactly what [`LeftBalancedTree`](crate::LeftBalancedTree) finds, several times faster.
/// [`nearest_of_each`](Self::nearest_of_each) is faster still for many points in order.
#[derive(Clone, Debug)]
pub struct PhotonTree {
    buckets: Vec<Bucket>,
    /// In preorder: the left child of a node follows it, and a subtree of n buckets has n - 1
    /// nodes.
    splits: Vec<Split>,
    points: usize,
    dispatch: Dispatch,
}

/// How a [`PhotonTree`] is built.
///
/// ```
/// use caustics_accel::{NearestScratch, PhotonSplits, PhotonTree, PhotonTreeOptions};
///
/// let photons: Vec<[f32; 3]> = (0..5000).map(|i| [(i % 71) as f32, 0.0, i as f32]).collect();
/// let options = PhotonTreeOptions { splits: PhotonSplits::VoxelVolume };
/// let tree = PhotonTree::with_options(&photons, &options)?;
/// let halved = PhotonTree::new(&photons)?;
/// let (mut scratch, mut other) = (NearestScratch::new(), NearestScratch::new());
/// let farthest = tree.nearest([9.0, 1.0, 2.0], 50, 1e3, &mut scratch).last();
/// assert!(farthest.is_some());
/// assert_eq!(farthest, halved.nearest([9.0, 1.0, 2.0], 50, 1e3, &mut other).last());
/// # Ok::<(), caustics_accel::AccelError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PhotonTreeOptions {
    /// Where nodes split their points.
    pub splits: PhotonSplits,
}

/// Where the nodes of a [`PhotonTree`] split their points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PhotonSplits {
    /// Into halves of full buckets, along the widest axis.
    #[default]
    Halves,
    /// Nodes of more than 1024 points by the voxel volume heuristic: where the volumes of both
    /// sides, grown by a search radius, times their points add up to the least (Wald, Günther and
    /// Slusallek, *Balancing Considered Harmful*, 2004). The radius is that of the circle that
    /// would hold 50 of the node's points, in metres as they are. Smaller nodes into halves.
    ///
    /// Keeps floors from walls and crowds from voids, so that searches look at fewer buckets:
    /// twice as fast where they have no radius, somewhat faster where they have one. Built as
    /// fast, in 1 % more memory, since a few buckets are not full.
    VoxelVolume,
}

/// Points, in rows.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Bucket {
    /// By axis, then by half of the bucket. Unused places are NaN, at no distance.
    positions: [[Row; 2]; 3],
    /// By half of the bucket.
    indices: [[u32; WIDTH]; 2],
}

impl Bucket {
    const EMPTY: Self = Self {
        positions: [[[f32::NAN; WIDTH]; 2]; 3],
        indices: [[u32::MAX; WIDTH]; 2],
    };

    /// Puts at most [`BUCKET`] points in.
    fn fill(&mut self, points: &[Point]) {
        for (place, point) in points.iter().enumerate() {
            for axis in 0..3 {
                self.positions[axis][place / WIDTH][place % WIDTH] = point.position[axis];
            }
            self.indices[place / WIDTH][place % WIDTH] = point.index;
        }
    }
}

/// An inner node.
#[derive(Clone, Copy, Debug)]
struct Split {
    /// The axis, in the lowest two bits, and above them how many buckets are on the left.
    axis_and_buckets: u32,
    /// The largest coordinate on the left.
    left: f32,
    /// The smallest coordinate on the right.
    right: f32,
}

impl Split {
    const EMPTY: Self = Self {
        axis_and_buckets: 0,
        left: 0.0,
        right: 0.0,
    };

    fn new(axis: usize, left_buckets: usize, left: f32, right: f32) -> Self {
        Self {
            axis_and_buckets: axis as u32 | (left_buckets as u32) << 2,
            left,
            right,
        }
    }

    #[inline(always)]
    fn axis(&self) -> usize {
        self.axis_and_buckets as usize & 3
    }

    #[inline(always)]
    fn left_buckets(&self) -> u32 {
        self.axis_and_buckets >> 2
    }
}

/// A subtree: its root's place in `splits`, its first bucket, and how many of those it has.
#[derive(Clone, Copy, Debug)]
struct Subtree {
    split: u32,
    bucket: u32,
    buckets: u32,
}

impl Subtree {
    /// What lies on either side of its root.
    #[inline(always)]
    fn children(self, split: &Split) -> (Self, Self) {
        let left = split.left_buckets();
        (
            Self {
                split: self.split + 1,
                bucket: self.bucket,
                buckets: left,
            },
            Self {
                split: self.split + left,
                bucket: self.bucket + left,
                buckets: self.buckets - left,
            },
        )
    }
}

impl PhotonTree {
    /// The most points that a tree takes.
    pub const MAX_POINTS: usize = u32::MAX as usize;

    /// Builds the tree with the default options in O(n log n), in parallel with the feature
    /// `parallel`; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`AccelError::NonFinitePoint`] or [`AccelError::TooManyPoints`].
    pub fn new<P: Copy + Into<Vec3>>(positions: &[P]) -> Result<Self, AccelError> {
        Self::with_options(positions, &PhotonTreeOptions::default())
    }

    /// The same with options. Searches find the same photons with any of them.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_options<P: Copy + Into<Vec3>>(
        positions: &[P],
        options: &PhotonTreeOptions,
    ) -> Result<Self, AccelError> {
        if positions.len() > Self::MAX_POINTS {
            return Err(AccelError::TooManyPoints {
                count: positions.len(),
                limit: Self::MAX_POINTS,
            });
        }
        let mut points = Vec::with_capacity(positions.len());
        for (point, &position) in positions.iter().enumerate() {
            let position: Vec3 = position.into();
            if !position.is_finite() {
                return Err(AccelError::NonFinitePoint { point });
            }
            points.push(Point {
                position: position.to_array(),
                index: point as u32,
            });
        }
        let (splits, buckets) = match options.splits {
            PhotonSplits::Halves => halves::build(&mut points),
            PhotonSplits::VoxelVolume => voxel_volume::build(&mut points),
        };
        let tree = Self {
            buckets,
            splits,
            points: points.len(),
            dispatch: Dispatch::new(Instructions::Detect),
        };
        debug_assert!(tree.is_valid());
        Ok(tree)
    }

    /// How many points the tree holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Whether the tree holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.buckets.capacity() * size_of::<Bucket>()
            + self.splits.capacity() * size_of::<Split>()
    }

    /// The `count` points nearest to `point`, no farther than `max_radius` metres.
    ///
    /// The last neighbour is the farthest; the others come in no particular order. Of points at
    /// the same distance those with the lower index are nearer. A NaN in the query finds nothing.
    /// A maximum radius near the expected one makes the search several times faster.
    pub fn nearest<'scratch>(
        &self,
        point: impl Into<Vec3>,
        count: usize,
        max_radius: f32,
        scratch: &'scratch mut NearestScratch,
    ) -> &'scratch [Neighbour] {
        let mut found = 0;
        if count > 0 {
            let keys = &mut scratch.keys;
            let nearest = Nearest::new(keys, &mut found, count.min(self.points));
            self.dispatch.run(Search {
                tree: self,
                point: point.into(),
                radius: max_radius,
                collector: nearest,
            });
        }
        scratch.finish(found)
    }

    /// The same as [`nearest`](Self::nearest) of one point after the other, faster where points
    /// that follow each other lie close together, as those of pixels do; calls `visit` with each
    /// one's place in `points` and its neighbours.
    ///
    /// No photon among the nearest is farther away than the farthest one of the query before plus
    /// the step between both queries: each search starts with that as its radius.
    pub fn nearest_of_each<P: Copy + Into<Vec3>>(
        &self,
        points: &[P],
        count: usize,
        max_radius: f32,
        scratch: &mut NearestScratch,
        mut visit: impl FnMut(usize, &[Neighbour]),
    ) {
        let mut before: Option<(Vec3, f32)> = None;
        for (place, &point) in points.iter().enumerate() {
            let point: Vec3 = point.into();
            // Infinite without a query before, and NaN after one of NaN: then it does not count.
            let reach = before.map_or(f32::INFINITY, |(point_before, farthest)| {
                (farthest.sqrt() + point_before.distance(point)) * WIDEN + TINY
            });
            let radius = if reach < max_radius {
                reach
            } else {
                max_radius
            };
            let found = self.nearest(point, count, radius, scratch);
            // Fewer than wanted say nothing about what is farther away.
            before = (found.len() == count)
                .then(|| found.last())
                .flatten()
                .map(|farthest| (point, farthest.distance_squared));
            visit(place, found);
        }
    }

    /// Like [`nearest`](Self::nearest), among the points whose index `accept` approves of.
    ///
    /// A rejected point does not count among the `count`.
    pub fn nearest_where<'scratch>(
        &self,
        point: impl Into<Vec3>,
        count: usize,
        max_radius: f32,
        accept: impl FnMut(u32) -> bool,
        scratch: &'scratch mut NearestScratch,
    ) -> &'scratch [Neighbour] {
        let mut found = 0;
        if count > 0 {
            let keys = &mut scratch.keys;
            let nearest = Nearest::new(keys, &mut found, count.min(self.points));
            self.dispatch.run(Search {
                tree: self,
                point: point.into(),
                radius: max_radius,
                collector: NearestWhere { nearest, accept },
            });
        }
        scratch.finish(found)
    }

    /// Calls `visit` with the index and the squared distance of every point no farther than
    /// `radius` metres from `point`.
    pub fn within(&self, point: impl Into<Vec3>, radius: f32, mut visit: impl FnMut(u32, f32)) {
        self.fold_within(point, radius, (), |(), index, distance_squared| {
            visit(index, distance_squared);
        });
    }

    /// Folds the index and the squared distance of every point no farther than `radius` metres from
    /// `point` into a value.
    ///
    /// Summing up what belongs to the points is faster so than by a visit that adds to a variable,
    /// which the compiler has to store after every point.
    ///
    /// ```
    /// # use caustics_accel::PhotonTree;
    /// let tree = PhotonTree::new(&[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [9.0, 0.0, 0.0]])?;
    /// let flux = [1.0, 2.0, 4.0];
    /// let gathered = tree.fold_within([0.0; 3], 1.0, 0.0, |sum, i, _| sum + flux[i as usize]);
    /// assert_eq!(gathered, 3.0);
    /// # Ok::<(), caustics_accel::AccelError>(())
    /// ```
    pub fn fold_within<T: Clone>(
        &self,
        point: impl Into<Vec3>,
        radius: f32,
        initial: T,
        add: impl FnMut(T, u32, f32) -> T,
    ) -> T {
        let folded = self.dispatch.run(Search {
            tree: self,
            point: point.into(),
            radius,
            collector: Fold::new(initial.clone(), add),
        });
        // There always is one.
        folded.unwrap_or(initial)
    }

    /// Renumbers the points in the order in which they lie in the tree and returns the former index
    /// of each.
    ///
    /// Neighbours in space then have neighbouring numbers. Put what belongs to the points, such as
    /// their flux, into the same order, and gathering it is fast: it comes from few cache lines.
    pub fn renumber(&mut self) -> Vec<u32> {
        let mut former = Vec::with_capacity(self.points);
        for index in self
            .buckets
            .iter_mut()
            .flat_map(|bucket| bucket.indices.as_flattened_mut())
        {
            if *index != u32::MAX {
                former.push(std::mem::replace(index, former.len() as u32));
            }
        }
        former
    }

    #[inline(always)]
    fn root(&self) -> Subtree {
        Subtree {
            split: 0,
            bucket: 0,
            buckets: self.buckets.len() as u32,
        }
    }

    /// Whether every node's points keep to their sides and every index occurs once.
    fn is_valid(&self) -> bool {
        let mut seen = vec![false; self.points];
        let fresh = self
            .buckets
            .iter()
            .flat_map(|bucket| bucket.indices.into_iter().flatten())
            .all(|index| {
                index == u32::MAX
                    || seen
                        .get_mut(index as usize)
                        .is_some_and(|seen| !std::mem::replace(seen, true))
            });
        let side = |subtree: Subtree, axis: usize| {
            let first = subtree.bucket as usize;
            self.buckets[first..first + subtree.buckets as usize]
                .iter()
                .flat_map(move |bucket| {
                    bucket.positions[axis]
                        .into_iter()
                        .flatten()
                        .zip(bucket.indices.into_iter().flatten())
                        .filter_map(|(x, index)| (index != u32::MAX).then_some(x))
                })
        };
        let mut waiting = vec![self.root()];
        while let Some(subtree) = waiting.pop() {
            if subtree.buckets > 1 {
                let split = &self.splits[subtree.split as usize];
                let (left, right) = subtree.children(split);
                let kept = side(left, split.axis()).all(|x| x <= split.left)
                    && side(right, split.axis()).all(|x| x >= split.right);
                if !kept {
                    return false;
                }
                waiting.extend([left, right]);
            }
        }
        fresh && seen.into_iter().all(|seen| seen)
    }
}
