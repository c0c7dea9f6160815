//! Rays that keep together, by component.

use caustics_geometry::Ray;

use super::layout::Node;
use super::traverse::{Slabs, splat};
use crate::simd::{Lanes, Row, WIDTH};
use crate::triangles::{ClosestRow, ShearedRow, WIDEN};

/// Squared sine of the largest angle between a bundle's rays and its first: about 5 degrees.
const SPREAD_SQUARED: f32 = 0.0075;

/// Eight rays, for tests of one box against all of them.
#[derive(Clone, Copy)]
pub(crate) struct SlabsRow {
    /// As [`Slabs`] has them, with an origin for each side of a box.
    pub(crate) origin_near: [Row; 3],
    pub(crate) origin_far: [Row; 3],
    pub(crate) inverse_near: [Row; 3],
    pub(crate) inverse_far: [Row; 3],
    pub(crate) t_min: Row,
}

impl SlabsRow {
    pub(crate) const EMPTY: Self = Self {
        origin_near: [[0.0; WIDTH]; 3],
        origin_far: [[0.0; WIDTH]; 3],
        inverse_near: [[0.0; WIDTH]; 3],
        inverse_far: [[0.0; WIDTH]; 3],
        t_min: [0.0; WIDTH],
    };

    /// Which rays meet one child's box: for each the very test of a single ray.
    #[inline(always)]
    pub(crate) fn meet<L: Lanes>(
        &self,
        lanes: L,
        near_side: [usize; 3],
        node: &Node,
        child: usize,
        limit: &Row,
    ) -> u32 {
        let mut near = lanes.load(&self.t_min);
        let mut far = lanes.mul(lanes.load(limit), lanes.splat(WIDEN));
        for axis in 0..3 {
            let side = near_side[axis];
            let enter = lanes.splat(node.bounds[axis][side][child]);
            let leave = lanes.splat(node.bounds[axis][1 - side][child]);
            let enter = lanes.sub(enter, lanes.load(&self.origin_near[axis]));
            let leave = lanes.sub(leave, lanes.load(&self.origin_far[axis]));
            near = lanes.max(lanes.mul(enter, lanes.load(&self.inverse_near[axis])), near);
            far = lanes.min(lanes.mul(leave, lanes.load(&self.inverse_far[axis])), far);
        }
        lanes.bits(lanes.at_most(near, far))
    }

    /// One ray for tests of eight boxes.
    #[inline(always)]
    pub(crate) fn slabs<L: Lanes>(
        &self,
        lanes: L,
        near_side: [usize; 3],
        lane: usize,
    ) -> Slabs<L::Floats> {
        let [x, y, z] = &self.origin_near;
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
}

/// Rays that enter boxes by the same sides.
pub(crate) struct Bundle<const ROWS: usize> {
    pub(crate) slabs: [SlabsRow; ROWS],
    /// By axis, 0 where the rays enter through the lower bound and 1 where through the upper one.
    pub(crate) near_side: [usize; 3],
}

/// Rays that keep together.
pub(crate) struct Gathered<const ROWS: usize> {
    pub(crate) bundle: Bundle<ROWS>,
    pub(crate) sheared: [ShearedRow; ROWS],
    pub(crate) closest: [ClosestRow; ROWS],
}

impl<const ROWS: usize> Gathered<ROWS> {
    /// `None` unless the rays enter boxes by the same sides and go nearly the same way, so that
    /// the tree has few nodes that only some of them meet.
    ///
    /// Rays along an axis do not mix with others: where 0 * inf says nothing about the former, the
    /// interval of both would wrongly rely on the latter.
    #[inline(always)]
    pub(crate) fn new<L: Lanes>(lanes: L, rays: &[Ray]) -> Option<Self> {
        let first = rays[0].direction;
        let longest = first.abs().max_position();
        let axes = [(longest + 1) % 3, (longest + 2) % 3, longest];
        let negative = first.is_negative_bitmask();
        let near_side = [negative & 1, negative >> 1 & 1, negative >> 2 & 1].map(|bit| bit as usize);
        let along = first.recip().abs().cmpeq(caustics_geometry::glam::Vec3::INFINITY);
        let along = [along.test(0), along.test(1), along.test(2)];
        let first_square = lanes.splat(SPREAD_SQUARED * first.length_squared());
        let first = splat(lanes, first.to_array());
        let zero = lanes.splat(0.0);
        let max = lanes.splat(f32::MAX);
        let mut gathered = Self {
            bundle: Bundle {
                slabs: [SlabsRow::EMPTY; ROWS],
                near_side,
            },
            sheared: [ShearedRow::EMPTY; ROWS],
            closest: [ClosestRow::NONE; ROWS],
        };
        for row in 0..ROWS {
            let mut origin = [[0.0; WIDTH]; 3];
            let mut direction = [[0.0; WIDTH]; 3];
            let (mut t_min, mut t_max) = ([0.0; WIDTH], [0.0; WIDTH]);
            let limits = &mut gathered.closest[row].limit;
            for (lane, ray) in rays[row * WIDTH..][..WIDTH].iter().enumerate() {
                for axis in 0..3 {
                    origin[axis][lane] = ray.origin[axis];
                    direction[axis][lane] = ray.direction[axis];
                }
                t_min[lane] = ray.t_min;
                t_max[lane] = ray.t_max;
                limits[lane] = ray.t_max.next_down();
            }
            let t_min = lanes.add(lanes.max(lanes.load(&t_min), zero), zero);
            
            let (o, d) = (load(lanes, &origin), load(lanes, &direction));
            let mut good = lanes.less(t_min, lanes.load(&t_max));
            let slabs = &mut gathered.bundle.slabs[row];
            let sheared = &mut gathered.sheared[row];
            let mut size = [zero; 3];
            let one = lanes.splat(1.0);
            for axis in 0..3 {
                let flat = lanes.max(o[axis], lanes.sub(zero, o[axis]));
                good = lanes.and(good, lanes.at_most(flat, max));
                size[axis] = lanes.max(d[axis], lanes.sub(zero, d[axis]));
                good = lanes.and(good, lanes.at_most(size[axis], max));
                let inverse = lanes.div(one, d[axis]);
                let same_side = if near_side[axis] == 0 {
                    lanes.less(zero, inverse)
                } else {
                    lanes.less(inverse, zero)
                };
                good = lanes.and(good, same_side);
                let steep = lanes.max(inverse, lanes.sub(zero, inverse));
                let same_axis = if along[axis] {
                    lanes.less(max, steep)
                } else {
                    lanes.at_most(steep, max)
                };
                good = lanes.and(good, same_axis);
                slabs.origin_near[axis] = origin[axis];
                slabs.origin_far[axis] = origin[axis];
                slabs.inverse_near[axis] = lanes.store(inverse);
                slabs.inverse_far[axis] = lanes.store(lanes.mul(inverse, lanes.splat(WIDEN)));
            }
            slabs.t_min = lanes.store(t_min);
            // As `max_position` decides between components of the same size.
            let is_longest = match longest {
                0 => lanes.and(lanes.at_most(size[1], size[0]), lanes.at_most(size[2], size[0])),
                1 => lanes.and(lanes.less(size[0], size[1]), lanes.at_most(size[2], size[1])),
                _ => lanes.and(lanes.less(size[0], size[2]), lanes.less(size[1], size[2])),
            };
            good = lanes.and(good, is_longest);
            let [x, y, z] = [
                cross(lanes, d[1], d[2], first[1], first[2]),
                cross(lanes, d[2], d[0], first[2], first[0]),
                cross(lanes, d[0], d[1], first[0], first[1]),
            ];
            let sine = dot(lanes, &[x, y, z], &[x, y, z]);
            let limit = lanes.mul(dot(lanes, &d, &d), first_square);
            good = lanes.and(good, lanes.at_most(sine, limit));
            good = lanes.and(good, lanes.less(zero, dot(lanes, &d, &first)));
            if lanes.bits(good) != (1 << WIDTH) - 1 {
                return None;
            }
            sheared.axes = axes;
            sheared.t_min = slabs.t_min;
            for (i, axis) in axes.into_iter().enumerate() {
                sheared.origin[i] = origin[axis];
                let over = if i == 2 { one } else { d[axis] };
                sheared.shear[i] = lanes.store(lanes.div(over, d[longest]));
            }
        }
        Some(gathered)
    }
}

#[inline(always)]
fn load<L: Lanes>(lanes: L, [x, y, z]: &[Row; 3]) -> [L::Floats; 3] {
    [lanes.load(x), lanes.load(y), lanes.load(z)]
}

#[inline(always)]
fn cross<L: Lanes>(lanes: L, a: L::Floats, b: L::Floats, c: L::Floats, d: L::Floats) -> L::Floats {
    lanes.sub(lanes.mul(a, d), lanes.mul(b, c))
}

#[inline(always)]
fn dot<L: Lanes>(lanes: L, a: &[L::Floats; 3], b: &[L::Floats; 3]) -> L::Floats {
    lanes.add(
        lanes.add(lanes.mul(a[0], b[0]), lanes.mul(a[1], b[1])),
        lanes.mul(a[2], b[2]),
    )
}

/// What all rays of a bundle have in common: intervals around their origins and reciprocals.
pub(crate) struct Hull<F> {
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
    pub(crate) fn new<L: Lanes<Floats = F>, const ROWS: usize>(
        lanes: L,
        bundle: &Bundle<ROWS>,
    ) -> Self {
        let zero = lanes.splat(0.0);
        let mut hull = Self {
            near_side: bundle.near_side,
            origin_near: [zero; 3],
            origin_far: [zero; 3],
            slowest: [zero; 3],
            fastest: [zero; 3],
            slowest_far: [zero; 3],
            fastest_far: [zero; 3],
            t_min: zero,
        };
        let rows = &bundle.slabs;
        let mut t_min = lanes.load(&rows[0].t_min);
        for row in &rows[1..] {
            t_min = lanes.min(lanes.load(&row.t_min), t_min);
        }
        hull.t_min = lanes.splat(lowest(lanes.store(t_min)));
        for axis in 0..3 {
            let mut near = lanes.load(&rows[0].origin_near[axis]);
            let mut far = lanes.load(&rows[0].origin_far[axis]);
            let mut low = lanes.load(&rows[0].inverse_near[axis]);
            let mut high = low;
            let backwards = bundle.near_side[axis] == 1;
            for row in &rows[1..] {
                let origin_near = lanes.load(&row.origin_near[axis]);
                let origin_far = lanes.load(&row.origin_far[axis]);
                let inverse = lanes.load(&row.inverse_near[axis]);
                low = lanes.min(low, inverse);
                high = lanes.max(high, inverse);
                if backwards {
                    near = lanes.min(near, origin_near);
                    far = lanes.max(far, origin_far);
                } else {
                    near = lanes.max(near, origin_near);
                    far = lanes.min(far, origin_far);
                }
            }
            let (near, far) = (lanes.store(near), lanes.store(far));
            let (low, high) = (lowest(lanes.store(low)), highest(lanes.store(high)));
            let (near, far) = if backwards {
                (lowest(near), highest(far))
            } else {
                (highest(near), lowest(far))
            };
            let (slow, fast) = if backwards { (high, low) } else { (low, high) };
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
    pub(crate) fn meet<L: Lanes<Floats = F>>(&self, lanes: L, node: &Node, limit: F) -> (F, u32) {
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

/// The least of eight numbers, none of which is NaN.
#[inline(always)]
pub(crate) fn lowest(row: Row) -> f32 {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let [a, b, c, d, e, f, g, h] = row;
    least(
        least(least(a, e), least(b, f)),
        least(least(c, g), least(d, h)),
    )
}

/// The greatest of eight numbers, none of which is NaN.
#[inline(always)]
pub(crate) fn highest(row: Row) -> f32 {
    let greatest = |a: f32, b: f32| if a > b { a } else { b };
    let [a, b, c, d, e, f, g, h] = row;
    greatest(
        greatest(greatest(a, e), greatest(b, f)),
        greatest(greatest(c, g), greatest(d, h)),
    )
}
