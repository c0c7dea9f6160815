//! The way of a query through the tree.

use caustics_geometry::glam::Vec3;

use super::{PhotonTree, Subtree};
use crate::neighbour::{distance_squared_of, key};
use crate::simd::{Kernel, Lanes, Stack, WIDTH};

/// Enough for the far children on one path: the tree is balanced, with fewer than 2^32 buckets.
const STACK: usize = 32;

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
    /// Takes a point no farther than the bound; returns the squared distance that counts from
    /// then on, given the one that counted before.
    fn take(&mut self, index: u32, distance_squared: f32, bound: f32) -> f32;
}

pub(super) struct Within<V> {
    pub(super) visit: V,
}

impl<V: FnMut(u32, f32)> Collector for Within<V> {
    #[inline(always)]
    fn take(&mut self, index: u32, distance_squared: f32, bound: f32) -> f32 {
        (self.visit)(index, distance_squared);
        bound
    }
}

/// Collects twice as many as wanted before it drops the farther half.
pub(super) struct Nearest<'a, A> {
    pub(super) keys: &'a mut Vec<u64>,
    pub(super) count: usize,
    /// How many keys call for thinning out: the first time as many as are wanted, for a bound.
    pub(super) capacity: usize,
    pub(super) accept: A,
}

impl<A: FnMut(u32) -> bool> Collector for Nearest<'_, A> {
    #[inline(always)]
    fn take(&mut self, index: u32, distance_squared: f32, bound: f32) -> f32 {
        if !(self.accept)(index) {
            return bound;
        }
        self.keys.push(key(distance_squared, index));
        if self.keys.len() < self.capacity {
            return bound;
        }
        keep_nearest(self.keys, self.count);
        self.capacity = self.count.saturating_mul(2);
        distance_squared_of(self.keys[self.count - 1])
    }
}

/// Drops all but the `count` lowest keys, at least one, and puts the highest of them last.
pub(super) fn keep_nearest(keys: &mut Vec<u64>, count: usize) {
    if keys.len() > count {
        keys.select_nth_unstable(count - 1);
        keys.truncate(count);
    } else if let Some(farthest) = (0..keys.len()).max_by_key(|&place| keys[place]) {
        let last = keys.len() - 1;
        keys.swap(farthest, last);
    }
}

pub(super) struct Search<'a, C> {
    pub(super) tree: &'a PhotonTree,
    pub(super) point: Vec3,
    pub(super) radius: f32,
    pub(super) collector: C,
}

impl<C: Collector> Kernel for Search<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let query = self.point.extend(0.0).to_array();
        let rows = [
            lanes.splat(query[0]),
            lanes.splat(query[1]),
            lanes.splat(query[2]),
        ];
        // A negative radius gives a negative bound and so finds nothing.
        let mut bound = self.radius * self.radius.abs();
        let mut stack = Stack::<Waiting, STACK>::new();
        let buckets = self.tree.buckets.len() as u32;
        if buckets == 0 {
            return;
        }
        stack.push(Waiting {
            subtree: Subtree {
                split: 0,
                bucket: 0,
                buckets,
            },
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
                let axis = split.axis as usize & 3;
                let (left, right) = subtree.children();
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
                let mut near = lanes.bits(lanes.at_most(distances, lanes.splat(bound)));
                if near == 0 {
                    continue;
                }
                let distances = lanes.store(distances);
                while near != 0 {
                    let lane = near.trailing_zeros() as usize & 7;
                    near &= near - 1;
                    let index = bucket.indices[half * WIDTH + lane];
                    if distances[lane] <= bound {
                        bound = self.collector.take(index, distances[lane], bound);
                    }
                }
            }
        }
    }
}
