//! The way of a ray through the cells.

use std::ops::Range;

use caustics_geometry::{Hit, Ray};

use super::clip::Bounds;
use super::layout::Node;
use crate::simd::{Kernel, Lanes};
use crate::triangles::{Block, Closest, ShearedRay, WIDEN, is_usable, lower_end};

/// What traversal reads.
#[derive(Clone, Copy)]
pub(super) struct Tree<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) blocks: &'a [Block],
    pub(super) bounds: &'a Bounds,
}

/// How far a ray's parameter at a plane may be off: factors up and down.
///
/// With e = 2^-24, (s - o) * (1/d) is off by a factor of at most (1 + e)^3, and the leaf test sees
/// the place that is hit at a distance from the origin that is off by (1 + e)^5, beside what the
/// triangles' boxes were widened by when the tree was built.
const LATER: f32 = 1.0 + 10.0 * (f32::EPSILON / 2.0);
const EARLIER: f32 = 1.0 - 10.0 * (f32::EPSILON / 2.0);

/// A cell whose far end comes later than this times the closest hit was the last: those after it
/// begin no more than rounding before that end.
const BEHIND: f32 = 1.0 + 32.0 * (f32::EPSILON / 2.0);

/// The closest hit of a ray, with a stack of `N` entries.
pub(super) struct ClosestHit<'a, const N: usize> {
    pub(super) tree: Tree<'a>,
    pub(super) ray: &'a Ray,
}

impl<const N: usize> Kernel for ClosestHit<'_, N> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        if !is_usable(self.ray) {
            return None;
        }
        let mut search = Nearest {
            closest: Closest::new(self.ray),
            sheared: ShearedRay::new(self.ray),
            blocks: self.tree.blocks,
            ray: self.ray,
        };
        walk::<L, _, N>(lanes, self.tree, self.ray, &mut search);
        search.closest.hit
    }
}

/// Whether a ray hits anything, with a stack of `N` entries.
pub(super) struct Occlusion<'a, const N: usize> {
    pub(super) tree: Tree<'a>,
    pub(super) ray: &'a Ray,
}

impl<const N: usize> Kernel for Occlusion<'_, N> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> bool {
        if !is_usable(self.ray) {
            return false;
        }
        let mut search = Any {
            found: false,
            sheared: ShearedRay::new(self.ray),
            blocks: self.tree.blocks,
            ray: self.ray,
        };
        walk::<L, _, N>(lanes, self.tree, self.ray, &mut search);
        search.found
    }
}

/// What is done with the leaves that a ray comes to.
trait Search {
    /// Tests a leaf's blocks; returns the parameter beyond which nothing counts any more.
    fn test<L: Lanes>(&mut self, lanes: L, leaf: Range<usize>) -> f32;
}

struct Nearest<'a> {
    closest: Closest,
    sheared: ShearedRay,
    blocks: &'a [Block],
    ray: &'a Ray,
}

impl Search for Nearest<'_> {
    #[inline(always)]
    fn test<L: Lanes>(&mut self, lanes: L, leaf: Range<usize>) -> f32 {
        let closest = &mut self.closest;
        self.sheared
            .find_closest(lanes, self.blocks, leaf, self.ray, closest);
        closest.limit
    }
}

struct Any<'a> {
    found: bool,
    sheared: ShearedRay,
    blocks: &'a [Block],
    ray: &'a Ray,
}

impl Search for Any<'_> {
    #[inline(always)]
    fn test<L: Lanes>(&mut self, lanes: L, leaf: Range<usize>) -> f32 {
        let limit = self.ray.t_max.next_down();
        let hit = self
            .sheared
            .hits_any(lanes, self.blocks, leaf, self.ray, limit);
        self.found |= hit;
        if hit { f32::NEG_INFINITY } else { limit }
    }
}

/// A cell that waits, and the part of the ray within it.
#[derive(Clone, Copy)]
struct Entry {
    node: u32,
    near: f32,
    far: f32,
}

/// The last `N` cells that wait; older ones are forgotten.
struct ShortStack<const N: usize> {
    entries: [Entry; N],
    /// Entries put in so far, less those taken out.
    top: usize,
    kept: usize,
}

impl<const N: usize> ShortStack<N> {
    #[inline(always)]
    fn new() -> Self {
        let empty = Entry {
            node: 0,
            near: 0.0,
            far: 0.0,
        };
        Self {
            entries: [empty; N],
            top: 0,
            kept: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        if N > 0 {
            self.entries[self.top % N] = entry;
            self.top += 1;
            self.kept = (self.kept + 1).min(N);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        if N == 0 {
            return None;
        }
        self.kept = self.kept.checked_sub(1)?;
        self.top -= 1;
        Some(self.entries[self.top % N])
    }
}

/// Goes through the cells along a ray, the near ones first.
///
/// The part of the ray that each cell gets reaches over its walls by more than rounding amounts
/// to. Such parts overlap, so that "go on from where the last cell ended", as Foley and Sugerman
/// restart (*KD-Tree Acceleration Structures for a GPU Raytracer*, 2005), might find the same cell
/// again. Instead a bit for each level says whether the nearer child is done with, after Laine,
/// *Restart Trail for Stackless BVH Traversal* (2010): adding one at the level of the last cell
/// carries to the deepest level where a child still waits. A short stack (Horn et al.,
/// *Interactive k-D Tree GPU Raytracing*, 2007) saves most of the restarts.
#[inline(always)]
fn walk<L: Lanes, S: Search, const N: usize>(lanes: L, tree: Tree<'_>, ray: &Ray, search: &mut S) {
    let origin = ray.origin.to_array();
    let inverse = ray.direction.to_array().map(|d| 1.0 / d);
    let negative = ray
        .direction
        .to_array()
        .map(|d| usize::from(d.is_sign_negative()));
    let Some((start, end)) = part_within(tree.bounds, ray, inverse) else {
        return;
    };
    // The bit of level 0 is the highest. Levels below the current one are 0.
    let mut trail = 0_u64;
    let mut stack = ShortStack::<N>::new();
    let mut node = tree.nodes[0];
    let (mut near, mut far) = (start, end);
    let mut level = 0_u32;
    loop {
        while !node.is_leaf() {
            let axis = node.axis();
            let t = (node.split() - origin[axis]) * inverse[axis];
            // Both are NaN for a ray in the plane, which is then in both children.
            let (latest, earliest) = (t * LATER, t * EARLIER);
            let (latest, earliest) = if t < 0.0 { (t, t) } else { (latest, earliest) };
            let first = node.lower() + negative[axis];
            let second = node.lower() + 1 - negative[axis];
            let bit = 1_u64 << (63 - level);
            let misses_first = latest < near;
            let misses_second = earliest > far;
            let second_near = if earliest > near { earliest } else { near };
            if !misses_first & !misses_second & (trail & bit == 0) {
                stack.push(Entry {
                    node: second as u32,
                    near: second_near,
                    far,
                });
                far = if latest < far { latest } else { far };
                node = tree.nodes[first];
            } else {
                trail |= bit;
                if !misses_second {
                    near = second_near;
                    node = tree.nodes[second];
                } else {
                    far = if latest < far { latest } else { far };
                    node = tree.nodes[first];
                }
            }
            level += 1;
        }
        let leaf = node.blocks();
        if !leaf.is_empty() {
            let limit = search.test(lanes, leaf);
            if limit * BEHIND < far {
                return;
            }
        }
        if level == 0 {
            return;
        }
        let (next, none_waits) = trail.overflowing_add(1 << (64 - level));
        if none_waits {
            return;
        }
        trail = next;
        if let Some(entry) = stack.pop() {
            node = tree.nodes[entry.node as usize];
            (near, far) = (entry.near, entry.far);
            level = 64 - trail.trailing_zeros();
        } else {
            node = tree.nodes[0];
            (near, far) = (start, end);
            level = 0;
        }
    }
}

/// The part of a ray's range that lies within a box, widened by more than rounding.
#[inline(always)]
fn part_within(bounds: &Bounds, ray: &Ray, inverse: [f32; 3]) -> Option<(f32, f32)> {
    let origin = ray.origin.to_array();
    let mut near = lower_end(ray);
    let mut far = ray.t_max.next_down() * WIDEN;
    for axis in 0..3 {
        let low = (bounds.low[axis] - origin[axis]) * inverse[axis];
        let high = (bounds.high[axis] - origin[axis]) * inverse[axis];
        let (enter, leave) = if inverse[axis].is_sign_negative() {
            (high, low)
        } else {
            (low, high)
        };
        // A NaN, from 0 * inf, is passed over.
        let (enter, leave) = (enter * EARLIER, leave * WIDEN);
        near = if enter > near { enter } else { near };
        far = if leave < far { leave } else { far };
    }
    (near <= far).then_some((near, far))
}
