//! Neighbouring rays that share their way through the tree.

use caustics_geometry::glam::Vec3;
use caustics_geometry::{Hit, Ray};

use super::layout::{Child, Node};
use super::traverse::{
    InPlace, STACK, Slabs, Tree, child_of, closest_hit, entry, near_of, search, splat,
};
use crate::simd::{Kernel, Lanes, Row, Stack, WIDTH, next_lane};
use crate::triangles::{Closest, ShearedRay, WIDEN, is_usable, lower_end};

/// Rows of rays in a bundle.
const ROWS: usize = 2;
/// Rays in a bundle.
const BUNDLE: usize = ROWS * WIDTH;

/// When no more than this many rays meet a node, each goes on alone: then it is no more work.
const ALONE: u32 = 3;

/// Squared sine of the largest angle between a bundle's rays and its first: about 5 degrees.
const SPREAD_SQUARED: f32 = 0.0075;

/// The closest hit of each ray.
pub(super) struct ClosestHits<'a> {
    pub(super) tree: Tree<'a>,
    pub(super) rays: &'a [Ray],
    pub(super) hits: &'a mut [Option<Hit>],
}

impl Kernel for ClosestHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        for (rays, hits) in self.rays.chunks(BUNDLE).zip(self.hits.chunks_mut(BUNDLE)) {
            if let (Ok(rays), Ok(hits)) = (rays.try_into(), hits.try_into())
                && keeps_together(rays)
            {
                trace(lanes, self.tree, rays, hits);
            } else {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = closest_hit(lanes, self.tree, ray);
                }
            }
        }
    }
}

/// Whether the rays enter boxes by the same sides and go nearly the same way, so that the tree
/// has few nodes that only some of them meet.
///
/// Rays along an axis do not mix with others: where 0 * inf says nothing about the former, the
/// interval of both would wrongly rely on the latter.
fn keeps_together(rays: &[Ray; BUNDLE]) -> bool {
    let first = rays[0].direction;
    let signs = first.is_negative_bitmask();
    let along_axis = |direction: Vec3| direction.recip().abs().cmpeq(Vec3::INFINITY).bitmask();
    let axis = along_axis(first);
    let length_squared = first.length_squared();
    rays.iter().all(|ray| {
        let direction = ray.direction;
        let size = direction.length_squared() * length_squared;
        is_usable(ray)
            && direction.is_negative_bitmask() == signs
            && along_axis(direction) == axis
            && direction.cross(first).length_squared() <= SPREAD_SQUARED * size
            && direction.dot(first) > 0.0
    })
}

/// Sends a bundle through the tree.
#[inline(always)]
fn trace<L: Lanes>(
    lanes: L,
    tree: Tree<'_>,
    rays: &[Ray; BUNDLE],
    hits: &mut [Option<Hit>; BUNDLE],
) {
    let hull = Hull::new(lanes, rays);
    let mut closest = [Closest::new(&rays[0]); BUNDLE];
    let mut sheared = [ShearedRay::new(&rays[0]); BUNDLE];
    for (closest, ray) in closest.iter_mut().zip(rays) {
        *closest = Closest::new(ray);
    }
    // Rays that have come to a leaf and been prepared for it.
    let mut prepared = 0_u64;
    let mut rows: [Rows; ROWS] = [const { Rows::EMPTY }; ROWS];
    for (i, row) in rows.iter_mut().enumerate() {
        row.fill(&rays[i * WIDTH..], &closest[i * WIDTH..]);
    }
    let mut farthest = farthest_limit(&rows);
    let mut stack = Stack::<u64, STACK>::new();
    let mut current = tree.root;
    // Which rays meet the current child, a bit for each.
    let mut active = u64::MAX >> (64 - BUNDLE);
    loop {
        let is_leaf = current.is_leaf();
        if is_leaf || active.count_ones() <= ALONE {
            while active != 0 {
                let lane = active.trailing_zeros() as usize % BUNDLE;
                active &= active - 1;
                if prepared >> lane & 1 == 0 {
                    prepared |= 1 << lane;
                    sheared[lane] = ShearedRay::new(&rays[lane]);
                }
                let before = closest[lane].limit;
                let (ray, closest) = (&rays[lane], &mut closest[lane]);
                if is_leaf {
                    let leaf = current.blocks();
                    sheared[lane].find_closest(lanes, tree.blocks, leaf, ray, closest);
                } else {
                    let in_place = InPlace {
                        slabs: rows[lane / WIDTH].slabs(lanes, hull.near_side, lane % WIDTH),
                        sheared: &sheared[lane],
                        blocks: tree.blocks,
                        ray,
                    };
                    search(lanes, tree.nodes, current, &in_place, closest);
                }
                if closest.limit < before {
                    rows[lane / WIDTH].limit[lane % WIDTH] = closest.limit * WIDEN;
                }
            }
            farthest = farthest_limit(&rows);
        } else {
            let index = current.index();
            let node = &tree.nodes[index];
            let (near, mut met) = hull.meet(lanes, node, lanes.splat(farthest));
            if met != 0 {
                let near = lanes.store(near);
                let mut pushed = 0;
                while met != 0 {
                    let lane = next_lane(&mut met);
                    stack.insert(
                        entry(near[lane], Child((index * WIDTH + lane) as u32)),
                        pushed,
                    );
                    pushed += 1;
                }
            }
        }
        loop {
            let Some(next) = stack.pop() else {
                for (hit, closest) in hits.iter_mut().zip(&closest) {
                    *hit = closest.hit;
                }
                return;
            };
            if near_of(next) > farthest {
                continue;
            }
            // An entry names the node and the lane: the box is needed once more.
            let place = child_of(next).index();
            let node = &tree.nodes[place / WIDTH];
            let lane = place % WIDTH;
            active = 0;
            for (i, row) in rows.iter().enumerate() {
                active |= u64::from(row.meet(lanes, hull.near_side, node, lane)) << (i * WIDTH);
            }
            if active != 0 {
                current = node.children[lane];
                break;
            }
        }
    }
}

fn farthest_limit(rows: &[Rows; ROWS]) -> f32 {
    rows.iter().flat_map(|row| row.limit).fold(0.0, f32::max)
}

/// Rays by component, for tests of one box against a row of them.
struct Rows {
    origin: [Row; 3],
    inverse_near: [Row; 3],
    inverse_far: [Row; 3],
    t_min: Row,
    /// Largest parameter at which each may still hit, widened.
    limit: Row,
}

/// What all rays of a bundle have in common: intervals around their origins and reciprocals.
struct Hull<F> {
    /// By axis, 0 where the rays enter through the lower bound and 1 where through the upper one.
    near_side: [usize; 3],
    /// The origin that makes the way to the entered side shortest, and the one that makes the way
    /// to the other side longest.
    origin_near: [F; 3],
    origin_far: [F; 3],
    /// The reciprocals of least and of greatest magnitude, and the same widened.
    slowest: [F; 3],
    fastest: [F; 3],
    slowest_far: [F; 3],
    fastest_far: [F; 3],
    t_min: F,
}

impl<F: Copy> Hull<F> {
    #[inline(always)]
    fn new<L: Lanes<Floats = F>>(lanes: L, rays: &[Ray; BUNDLE]) -> Self {
        let mut low = rays[0].origin;
        let mut high = low;
        let mut inverse_low = Vec3::INFINITY;
        let mut inverse_high = Vec3::NEG_INFINITY;
        let mut t_min = f32::INFINITY;
        for ray in rays {
            low = low.min(ray.origin);
            high = high.max(ray.origin);
            inverse_low = inverse_low.min(ray.direction.recip());
            inverse_high = inverse_high.max(ray.direction.recip());
            t_min = t_min.min(lower_end(ray));
        }
        let negative = rays[0].direction.is_negative_bitmask();
        let mut hull = Self {
            near_side: [0; 3],
            origin_near: [lanes.splat(0.0); 3],
            origin_far: [lanes.splat(0.0); 3],
            slowest: [lanes.splat(0.0); 3],
            fastest: [lanes.splat(0.0); 3],
            slowest_far: [lanes.splat(0.0); 3],
            fastest_far: [lanes.splat(0.0); 3],
            t_min: lanes.splat(t_min),
        };
        for axis in 0..3 {
            let backwards = negative >> axis & 1 == 1;
            let (near, far) = if backwards {
                (low[axis], high[axis])
            } else {
                (high[axis], low[axis])
            };
            let (slow, fast) = if backwards {
                (inverse_high[axis], inverse_low[axis])
            } else {
                (inverse_low[axis], inverse_high[axis])
            };
            hull.near_side[axis] = usize::from(backwards);
            hull.origin_near[axis] = lanes.splat(near);
            hull.origin_far[axis] = lanes.splat(far);
            hull.slowest[axis] = lanes.splat(slow);
            hull.fastest[axis] = lanes.splat(fast);
            hull.slowest_far[axis] = lanes.splat(slow * WIDEN);
            hull.fastest_far[axis] = lanes.splat(fast * WIDEN);
        }
        hull
    }

    /// Which children's boxes any ray may meet before `limit`, and where the first one may enter.
    ///
    /// Every rounded step is monotonic, so that no ray for which the test of a single one finds a
    /// box is left out.
    #[inline(always)]
    fn meet<L: Lanes<Floats = F>>(&self, lanes: L, node: &Node, limit: F) -> (F, u32) {
        let mut near = self.t_min;
        let mut far = limit;
        for axis in 0..3 {
            let [lower, upper] = &node.bounds[axis];
            let (enter, leave) = if self.near_side[axis] == 0 {
                (lower, upper)
            } else {
                (upper, lower)
            };
            let enter = lanes.sub(lanes.load(enter), self.origin_near[axis]);
            let leave = lanes.sub(lanes.load(leave), self.origin_far[axis]);
            // Behind the rays' origins the slowest comes first. A NaN, from 0 * inf, is passed
            // over as it is for a single ray: in the first argument.
            let slow = lanes.mul(enter, self.slowest[axis]);
            let first = lanes.min(lanes.mul(enter, self.fastest[axis]), slow);
            near = lanes.max(first, near);
            let slow = lanes.mul(leave, self.slowest_far[axis]);
            let last = lanes.max(lanes.mul(leave, self.fastest_far[axis]), slow);
            far = lanes.min(last, far);
        }
        (near, lanes.bits(lanes.at_most(near, far)))
    }
}

impl Rows {
    const EMPTY: Self = Self {
        origin: [[0.0; WIDTH]; 3],
        inverse_near: [[0.0; WIDTH]; 3],
        inverse_far: [[0.0; WIDTH]; 3],
        t_min: [0.0; WIDTH],
        limit: [0.0; WIDTH],
    };

    #[inline(always)]
    fn fill(&mut self, rays: &[Ray], closest: &[Closest]) {
        for (lane, (ray, closest)) in rays.iter().zip(closest).take(WIDTH).enumerate() {
            let inverse = ray.direction.recip();
            for axis in 0..3 {
                self.origin[axis][lane] = ray.origin[axis];
                self.inverse_near[axis][lane] = inverse[axis];
                self.inverse_far[axis][lane] = inverse[axis] * WIDEN;
            }
            self.t_min[lane] = lower_end(ray);
            self.limit[lane] = closest.limit * WIDEN;
        }
    }

    /// One ray for tests of eight boxes.
    #[inline(always)]
    fn slabs<L: Lanes>(&self, lanes: L, near_side: [usize; 3], lane: usize) -> Slabs<L::Floats> {
        let [x, y, z] = &self.origin;
        let origin = splat(lanes, [x[lane], y[lane], z[lane]]);
        let [x, y, z] = &self.inverse_near;
        let inverse_near = splat(lanes, [x[lane], y[lane], z[lane]]);
        let [x, y, z] = &self.inverse_far;
        let inverse_far = splat(lanes, [x[lane], y[lane], z[lane]]);
        let t_min = lanes.splat(self.t_min[lane]);
        Slabs {
            origin,
            inverse_near,
            inverse_far,
            near_side,
            t_min,
        }
    }

    /// Which rays meet one child's box: for each the very test of a single ray.
    #[inline(always)]
    fn meet<L: Lanes>(&self, lanes: L, near_side: [usize; 3], node: &Node, child: usize) -> u32 {
        let mut near = lanes.load(&self.t_min);
        let mut far = lanes.load(&self.limit);
        for (axis, side) in near_side.into_iter().enumerate() {
            let origin = lanes.load(&self.origin[axis]);
            let [lower, upper] = [node.bounds[axis][0][child], node.bounds[axis][1][child]];
            let (enter, leave) = if side == 0 {
                (lower, upper)
            } else {
                (upper, lower)
            };
            let enter = lanes.sub(lanes.splat(enter), origin);
            let leave = lanes.sub(lanes.splat(leave), origin);
            near = lanes.max(lanes.mul(enter, lanes.load(&self.inverse_near[axis])), near);
            far = lanes.min(lanes.mul(leave, lanes.load(&self.inverse_far[axis])), far);
        }
        lanes.bits(lanes.at_most(near, far))
    }
}
