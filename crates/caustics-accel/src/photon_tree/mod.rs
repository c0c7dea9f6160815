mod search;

use caustics_geometry::glam::{Vec3, Vec3A};

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
/// by side; inner nodes split the widest axis of their points' bounding box and keep the gap
/// between the two halves. The k nearest are collected unsorted and thinned out by selection, in
/// place of a heap. All buckets but the last are full: 17 bytes a point.
///
/// Finds exactly what [`LeftBalancedTree`](crate::LeftBalancedTree) finds, several times faster.
/// [`nearest_of_each`](Self::nearest_of_each) is faster still for many points in order.
#[derive(Clone, Debug)]
pub struct PhotonTree {
    buckets: Vec<Bucket>,
    /// In preorder: the left child of a node follows it, and a node over n buckets has n - 1
    /// nodes, itself included.
    splits: Vec<Split>,
    points: usize,
    dispatch: Dispatch,
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
}

/// An inner node.
#[derive(Clone, Copy, Debug)]
struct Split {
    axis: u32,
    /// The largest coordinate on the left.
    left: f32,
    /// The smallest coordinate on the right.
    right: f32,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    position: [f32; 3],
    index: u32,
}

/// A subtree: its root's place in `splits`, its first bucket, and how many of those it has.
#[derive(Clone, Copy, Debug)]
struct Subtree {
    split: u32,
    bucket: u32,
    buckets: u32,
}

impl Subtree {
    #[inline(always)]
    fn children(self) -> (Self, Self) {
        let left = left_buckets(self.buckets as usize) as u32;
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

/// How many of at least two buckets go to the left.
#[inline(always)]
fn left_buckets(buckets: usize) -> usize {
    buckets.div_ceil(2)
}

impl PhotonTree {
    /// The most points that a tree takes.
    pub const MAX_POINTS: usize = u32::MAX as usize;

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
        let count = points.len().div_ceil(BUCKET);
        let mut splits = vec![
            Split {
                axis: 0,
                left: 0.0,
                right: 0.0
            };
            count.saturating_sub(1)
        ];
        let mut buckets = vec![Bucket::EMPTY; count];
        partition(&mut points, &mut splits, &mut buckets);
        let dispatch = Dispatch::new(Instructions::Detect);
        let tree = Self {
            buckets,
            splits,
            points: points.len(),
            dispatch,
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

    /// Whether every node's halves keep to their sides and every index occurs once.
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
        let side = |subtree: Subtree, axis: u32| {
            let first = subtree.bucket as usize;
            self.buckets[first..first + subtree.buckets as usize]
                .iter()
                .flat_map(move |bucket| {
                    bucket.positions[axis as usize]
                        .into_iter()
                        .flatten()
                        .zip(bucket.indices.into_iter().flatten())
                        .filter_map(|(x, index)| (index != u32::MAX).then_some(x))
                })
        };
        let mut waiting = vec![Subtree {
            split: 0,
            bucket: 0,
            buckets: self.buckets.len() as u32,
        }];
        while let Some(subtree) = waiting.pop() {
            if subtree.buckets > 1 {
                let split = &self.splits[subtree.split as usize];
                let (left, right) = subtree.children();
                let kept = side(left, split.axis).all(|x| x <= split.left)
                    && side(right, split.axis).all(|x| x >= split.right);
                if !kept {
                    return false;
                }
                waiting.extend([left, right]);
            }
        }
        fresh && seen.into_iter().all(|seen| seen)
    }
}

/// Sorts points into buckets and notes the splits above them.
fn partition(points: &mut [Point], splits: &mut [Split], buckets: &mut [Bucket]) {
    if let [bucket] = buckets {
        for (place, point) in points.iter().enumerate() {
            for axis in 0..3 {
                bucket.positions[axis][place / WIDTH][place % WIDTH] = point.position[axis];
            }
            bucket.indices[place / WIDTH][place % WIDTH] = point.index;
        }
        return;
    }
    let Some((split, splits)) = splits.split_first_mut() else {
        return;
    };
    let axis = widest_axis(points);
    let left_count = left_buckets(buckets.len());
    let compare = |a: &Point, b: &Point| a.position[axis].total_cmp(&b.position[axis]);
    let (left, first_right, _) = points.select_nth_unstable_by(left_count * BUCKET, compare);
    let mut largest = f32::NEG_INFINITY;
    for point in left {
        let x = point.position[axis];
        largest = if x > largest { x } else { largest };
    }
    *split = Split {
        axis: axis as u32,
        left: largest,
        right: first_right.position[axis],
    };
    let (left, right) = points.split_at_mut(left_count * BUCKET);
    let (left_splits, right_splits) = splits.split_at_mut(left_count - 1);
    let (left_buckets, right_buckets) = buckets.split_at_mut(left_count);
    #[cfg(feature = "parallel")]
    if left.len() > PARALLEL_POINTS {
        rayon::join(
            || partition(left, left_splits, left_buckets),
            || partition(right, right_splits, right_buckets),
        );
        return;
    }
    partition(left, left_splits, left_buckets);
    partition(right, right_splits, right_buckets);
}

fn widest_axis(points: &[Point]) -> usize {
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
    let extent = (high[0].max(high[1]) - low[0].min(low[1])).to_array();
    let widest = usize::from(extent[1] > extent[0]);
    if extent[2] > extent[widest] {
        2
    } else {
        widest
    }
}
