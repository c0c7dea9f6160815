//! The way of a ray through the tree.

use caustics_geometry::Ray;

use super::layout::{Child, Node};
use crate::simd::{Lanes, Row, Stack, next_lane};
use crate::triangles::{Block, Closest, ShearedRay, WIDEN, lower_end};

/// What traversal reads.
#[derive(Clone, Copy)]
pub(crate) struct Tree<'a> {
    pub(crate) nodes: &'a [Node],
    pub(crate) blocks: &'a [Block],
    pub(crate) root: Child,
}

/// Entries that wait at most; see [`MAX_DEPTH`].
pub(crate) const STACK: usize = 512;

/// Levels of nodes that the stack suffices for: each leaves at most seven children waiting, and
/// the last one puts all eight on the stack for a moment.
pub(crate) const MAX_DEPTH: usize = (STACK - 1) / 7;

/// A ray for the test against boxes.
pub(crate) struct Slabs<F> {
    /// By axis.
    pub(crate) origin: [F; 3],
    /// Reciprocal of the direction, by axis, for the side of a box where the ray enters ...
    pub(crate) inverse_near: [F; 3],
    /// ... and for the side where it leaves.
    pub(crate) inverse_far: [F; 3],
    /// By axis, 0 where the ray enters through the lower bound and 1 where through the upper one.
    pub(crate) near_side: [usize; 3],
    pub(crate) t_min: F,
}

#[inline(always)]
pub(crate) fn splat<L: Lanes>(lanes: L, [x, y, z]: [f32; 3]) -> [L::Floats; 3] {
    [lanes.splat(x), lanes.splat(y), lanes.splat(z)]
}

impl<F: Copy> Slabs<F> {
    #[inline(always)]
    pub(crate) fn new<L: Lanes<Floats = F>>(lanes: L, ray: &Ray) -> Self {
        let origin = ray.origin.to_array();
        let direction = ray.direction.to_array();
        Self::along(lanes, origin, direction, lower_end(ray))
    }

    #[inline(always)]
    pub(crate) fn along<L: Lanes<Floats = F>>(
        lanes: L,
        origin: [f32; 3],
        direction: [f32; 3],
        t_min: f32,
    ) -> Self {
        let inverse = direction.map(|d| 1.0 / d);
        Self {
            origin: splat(lanes, origin),
            inverse_near: splat(lanes, inverse),
            inverse_far: splat(lanes, inverse.map(|i| i * WIDEN)),
            near_side: direction.map(|d| usize::from(d.is_sign_negative())),
            t_min: lanes.splat(t_min),
        }
    }

    /// Where the ray enters the children's boxes, and which ones it meets before `limit`.
    #[inline(always)]
    pub(crate) fn meet<L: Lanes<Floats = F>>(&self, lanes: L, node: &Node, limit: F) -> (F, u32) {
        self.meet_from(lanes, &self.origin, node, limit)
    }

    /// The same with an origin of its own for the side where the ray leaves.
    #[inline(always)]
    pub(crate) fn meet_from<L: Lanes<Floats = F>>(
        &self,
        lanes: L,
        origin_far: &[F; 3],
        node: &Node,
        limit: F,
    ) -> (F, u32) {
        // A ray that runs in the plane of a box's side has 0 * inf = NaN there. Such a ray counts
        // as inside that slab: the minimum and maximum pass over a NaN in their first argument.
        let mut near = self.t_min;
        let mut far = limit;
        for (axis, &origin_far) in origin_far.iter().enumerate() {
            let [lower, upper] = &node.bounds[axis];
            let (enter, leave) = if self.near_side[axis] == 0 {
                (lower, upper)
            } else {
                (upper, lower)
            };
            let enter = lanes.sub(lanes.load(enter), self.origin[axis]);
            let leave = lanes.sub(lanes.load(leave), origin_far);
            near = lanes.max(lanes.mul(enter, self.inverse_near[axis]), near);
            far = lanes.min(lanes.mul(leave, self.inverse_far[axis]), far);
        }
        (near, lanes.bits(lanes.at_most(near, far)))
    }
}

/// A waiting child, ordered by where the ray enters its box: never a negative number, so that its
/// bits are ordered as it is.
#[inline(always)]
pub(crate) fn entry(near: f32, child: Child) -> u64 {
    (u64::from(near.to_bits()) << 32) | u64::from(child.0)
}

#[inline(always)]
pub(crate) fn child_of(entry: u64) -> Child {
    Child(entry as u32)
}

#[inline(always)]
pub(crate) fn near_of(entry: u64) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

/// A ray as the boxes and leaves of a tree meet it.
pub(crate) trait Meet<L: Lanes> {
    /// Where the ray enters the children's boxes, and which ones it meets before `limit`.
    fn boxes(&self, lanes: L, node: &Node, limit: L::Floats) -> (L::Floats, u32);

    /// Looks for something closer in a leaf.
    fn find_closest(&self, lanes: L, leaf: Child, closest: &mut Closest);

    /// Whether anything in a leaf is hit at no more than `limit`.
    fn hits_any(&self, lanes: L, leaf: Child, limit: f32) -> bool;
}

/// A ray and the triangles of a tree, both where the caller has them.
pub(crate) struct InPlace<'a, F> {
    pub(crate) slabs: Slabs<F>,
    pub(crate) sheared: ShearedRay,
    pub(crate) blocks: &'a [Block],
    pub(crate) ray: &'a Ray,
}

impl<'a, F: Copy> InPlace<'a, F> {
    #[inline(always)]
    pub(crate) fn new<L: Lanes<Floats = F>>(lanes: L, blocks: &'a [Block], ray: &'a Ray) -> Self {
        Self {
            slabs: Slabs::new(lanes, ray),
            sheared: ShearedRay::new(ray),
            blocks,
            ray,
        }
    }
}

impl<L: Lanes> Meet<L> for InPlace<'_, L::Floats> {
    #[inline(always)]
    fn boxes(&self, lanes: L, node: &Node, limit: L::Floats) -> (L::Floats, u32) {
        self.slabs.meet(lanes, node, limit)
    }

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, closest: &mut Closest) {
        self.sheared
            .find_closest(lanes, self.blocks, leaf.blocks(), self.ray, closest);
    }

    #[inline(always)]
    fn hits_any(&self, lanes: L, leaf: Child, limit: f32) -> bool {
        self.sheared
            .hits_any(lanes, self.blocks, leaf.blocks(), self.ray, limit)
    }
}

/// Chooses the nearest of the children that are met, of which there is at least one; the others
/// go on the stack, the farthest first.
#[inline(always)]
fn descend(stack: &mut Stack<u64, STACK>, node: &Node, mut met: u32, near: &Row) -> Child {
    let first = next_lane(&mut met);
    if met == 0 {
        return node.children[first];
    }
    let first = entry(near[first], node.children[first]);
    let second = next_lane(&mut met);
    let second = entry(near[second], node.children[second]);
    let (mut nearest, farther) = if first < second {
        (first, second)
    } else {
        (second, first)
    };
    stack.push(farther);
    let mut pushed = 1;
    while met != 0 {
        let lane = next_lane(&mut met);
        let next = entry(near[lane], node.children[lane]);
        if next < nearest {
            stack.push(nearest);
            nearest = next;
        } else {
            stack.insert(next, pushed);
        }
        pushed += 1;
    }
    child_of(nearest)
}

/// Looks below one child for something closer.
#[inline(always)]
pub(crate) fn search<L: Lanes>(
    lanes: L,
    nodes: &[Node],
    start: Child,
    ray: &impl Meet<L>,
    closest: &mut Closest,
) {
    let mut widened = closest.limit * WIDEN;
    let mut stack = Stack::<u64, STACK>::new();
    let mut current = start;
    loop {
        while !current.is_leaf() {
            let node = &nodes[current.index()];
            let (near, met) = ray.boxes(lanes, node, lanes.splat(widened));
            if met == 0 {
                break;
            }
            current = descend(&mut stack, node, met, &lanes.store(near));
        }
        if current.is_leaf() {
            ray.find_closest(lanes, current, closest);
            widened = closest.limit * WIDEN;
        }
        loop {
            let Some(next) = stack.pop() else {
                return;
            };
            if near_of(next) <= widened {
                current = child_of(next);
                break;
            }
        }
    }
}

/// Looks below one child for anything at no more than `limit`.
#[inline(always)]
pub(crate) fn search_any<L: Lanes>(
    lanes: L,
    nodes: &[Node],
    start: Child,
    ray: &impl Meet<L>,
    limit: f32,
) -> bool {
    let widened = lanes.splat(limit * WIDEN);
    let mut stack = Stack::<Child, STACK>::new();
    stack.push(start);
    while let Some(current) = stack.pop() {
        if current.is_leaf() {
            if ray.hits_any(lanes, current, limit) {
                return true;
            }
        } else {
            let node = &nodes[current.index()];
            let (_, mut met) = ray.boxes(lanes, node, widened);
            while met != 0 {
                stack.push(node.children[next_lane(&mut met)]);
            }
        }
    }
    false
}
