//! The way of a query through the tree.

use caustics_geometry::glam::Vec3;

use super::{PhotonTree, Subtree};
use crate::neighbour::{distance_squared_of, index_of};
use crate::simd::{Kernel, Lanes, Stack, WIDTH, next_lane};

/// Enough for the far children on one path: 32 levels by heuristic, and below them at most 28 of
/// halves, since there are fewer than 2^32 points and a bucket holds 2^4.
const STACK: usize = 64;

/// A subtree that is yet to be searched.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    subtree: Subtree,
    /// Squared distances from the query point to the subtree's half-spaces, by axis.
    offset: [f32; 3],
    distance_squared: f32,
}

/// What becomes of the points that a search comes across.
pub(super) trait Collector {
    /// What is made of them.
    type Output;

    /// Takes the lanes that are no farther than the bound, at least one; returns the squared
    /// distance that counts from then on, given the one that counted before.
    fn take<L: Lanes>(
        &mut self,
        lanes: L,
        indices: &[u32; WIDTH],
        distances: L::Floats,
        near: u32,
        bound: f32,
    ) -> f32;

    /// There are no more.
    fn finish(self) -> Self::Output;
}

/// How many points wait to be visited: a loop over many is foreseen better than many over few.
const WAITING: usize = 16 * WIDTH;

/// Folds all points into a value.
pub(super) struct Fold<T, F> {
    /// There but while it is being added to.
    value: Option<T>,
    add: F,
    keys: [u64; WAITING],
    waiting: usize,
}

impl<T, F: FnMut(T, u32, f32) -> T> Fold<T, F> {
    #[inline(always)]
    pub(super) fn new(value: T, add: F) -> Self {
        Self {
            value: Some(value),
            add,
            keys: [0; WAITING],
            waiting: 0,
        }
    }
}

impl<T, F: FnMut(T, u32, f32) -> T> Collector for Fold<T, F> {
    type Output = Option<T>;

    #[inline(always)]
    fn take<L: Lanes>(
        &mut self,
        lanes: L,
        indices: &[u32; WIDTH],
        distances: L::Floats,
        near: u32,
        bound: f32,
    ) -> f32 {
        if self.waiting > WAITING - WIDTH {
            self.add_waiting();
        }
        append(
            lanes,
            &mut self.keys,
            &mut self.waiting,
            indices,
            distances,
            near,
        );
        bound
    }

    #[inline(always)]
    fn finish(mut self) -> Option<T> {
        self.add_waiting();
        self.value
    }
}

impl<T, F: FnMut(T, u32, f32) -> T> Fold<T, F> {
    #[inline(always)]
    fn add_waiting(&mut self) {
        if let Some(mut value) = self.value.take() {
            for &key in &self.keys[..self.waiting] {
                value = (self.add)(value, index_of(key), distance_squared_of(key));
            }
            self.value = Some(value);
        }
        self.waiting = 0;
    }
}

/// Appends the keys of some lanes, given room for all eight.
#[inline(always)]
fn append<L: Lanes>(
    lanes: L,
    keys: &mut [u64],
    found: &mut usize,
    indices: &[u32; WIDTH],
    distances: L::Floats,
    near: u32,
) {
    if let Some(out) = keys[*found..].first_chunk_mut() {
        lanes.pack(distances, indices, near, out);
        *found += near.count_ones() as usize;
    }
}

/// Collects twice as many as wanted before it drops the farther half.
pub(super) struct Nearest<'a> {
    keys: &'a mut Vec<u64>,
    found: &'a mut usize,
    count: usize,
    /// How many keys call for thinning out: the first time as many as are wanted, for a bound.
    capacity: usize,
}

impl<'a> Nearest<'a> {
    pub(super) fn new(keys: &'a mut Vec<u64>, found: &'a mut usize, count: usize) -> Self {
        // Thinned out only after a whole row.
        let room = 2 * count + WIDTH;
        if keys.len() < room {
            keys.resize(room, 0);
        }
        Self {
            keys,
            found,
            count,
            capacity: count,
        }
    }

    /// Thins out if there are too many.
    #[inline(always)]
    fn bound(&mut self, bound: f32) -> f32 {
        if *self.found < self.capacity {
            return bound;
        }
        keep_nearest(self.keys, self.found, self.count);
        self.capacity = 2 * self.count;
        distance_squared_of(self.keys[self.count - 1])
    }
}

impl Collector for Nearest<'_> {
    type Output = ();

    #[inline(always)]
    fn take<L: Lanes>(
        &mut self,
        lanes: L,
        indices: &[u32; WIDTH],
        distances: L::Floats,
        near: u32,
        bound: f32,
    ) -> f32 {
        append(lanes, self.keys, self.found, indices, distances, near);
        self.bound(bound)
    }

    #[inline(always)]
    fn finish(self) {
        keep_nearest(self.keys, self.found, self.count);
    }
}

/// The same, of those that are accepted.
pub(super) struct NearestWhere<'a, A> {
    pub(super) nearest: Nearest<'a>,
    pub(super) accept: A,
}

impl<A: FnMut(u32) -> bool> Collector for NearestWhere<'_, A> {
    type Output = ();

    #[inline(always)]
    fn take<L: Lanes>(
        &mut self,
        lanes: L,
        indices: &[u32; WIDTH],
        distances: L::Floats,
        mut near: u32,
        bound: f32,
    ) -> f32 {
        let mut accepted = 0;
        while near != 0 {
            let lane = next_lane(&mut near);
            accepted |= u32::from((self.accept)(indices[lane])) << lane;
        }
        self.nearest
            .take(lanes, indices, distances, accepted, bound)
    }

    #[inline(always)]
    fn finish(self) {
        self.nearest.finish();
    }
}

/// Drops all but the `count` lowest of the first `found` keys, at least one, and puts the highest
/// of them last.
fn keep_nearest(keys: &mut [u64], found: &mut usize, count: usize) {
    let taken = &mut keys[..*found];
    if taken.len() > count {
        taken.select_nth_unstable(count - 1);
        *found = count;
    } else if let Some(farthest) = (0..taken.len()).max_by_key(|&place| taken[place]) {
        let last = taken.len() - 1;
        taken.swap(farthest, last);
    }
}

pub(super) struct Search<'a, C> {
    pub(super) tree: &'a PhotonTree,
    pub(super) point: Vec3,
    pub(super) radius: f32,
    pub(super) collector: C,
}

impl<C: Collector> Kernel for Search<'_, C> {
    type Output = C::Output;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> C::Output {
        let query = self.point.extend(0.0).to_array();
        let rows = [
            lanes.splat(query[0]),
            lanes.splat(query[1]),
            lanes.splat(query[2]),
        ];
        // A negative radius gives a negative bound and so finds nothing.
        let mut bound = self.radius * self.radius.abs();
        let mut stack = Stack::<Waiting, STACK>::new();
        if self.tree.is_empty() {
            return self.collector.finish();
        }
        stack.push(Waiting {
            subtree: self.tree.root(),
            offset: [0.0; 3],
            distance_squared: 0.0,
        });
        while let Some(waiting) = stack.pop() {
            if waiting.distance_squared > bound {
                continue;
            }
            let Waiting {
                mut subtree,
                offset,
                ..
            } = waiting;
            while subtree.buckets > 1 {
                let split = self.tree.splits[subtree.split as usize];
                let axis = split.axis();
                let (left, right) = subtree.children(&split);
                let to_left = query[axis] - split.left;
                let to_right = split.right - query[axis];
                // The nearer side lies within this subtree's half-spaces already.
                let (near, far, to_far) = if to_left < to_right {
                    (left, right, to_right)
                } else {
                    (right, left, to_left)
                };
                // Selected, not stored by index: the sum would wait for the store.
                let squared = to_far * to_far;
                let [x, y, z] = offset;
                let x = if axis == 0 { squared.max(x) } else { x };
                let y = if axis == 1 { squared.max(y) } else { y };
                let z = if axis == 2 { squared.max(z) } else { z };
                let far_distance = x + y + z;
                if far_distance <= bound {
                    stack.push(Waiting {
                        subtree: far,
                        offset: [x, y, z],
                        distance_squared: far_distance,
                    });
                }
                subtree = near;
            }
            let bucket = &self.tree.buckets[subtree.bucket as usize];
            for half in 0..2 {
                let mut distances = [rows[0]; 3];
                for axis in 0..3 {
                    let d = lanes.sub(rows[axis], lanes.load(&bucket.positions[axis][half]));
                    distances[axis] = lanes.mul(d, d);
                }
                let [x, y, z] = distances;
                let distances = lanes.add(lanes.add(x, y), z);
                let near = lanes.bits(lanes.at_most(distances, lanes.splat(bound)));
                if near != 0 {
                    let indices = &bucket.indices[half];
                    bound = self.collector.take(lanes, indices, distances, near, bound);
                }
            }
        }
        self.collector.finish()
    }
}
