//! Rays that meet boxes together.

use super::layout::Node;
use super::traverse::{Slabs, splat};
use crate::simd::{Lanes, Row, WIDTH};
use crate::triangles::WIDEN;

/// Eight rays, for tests of one box against all of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlabsRow {
    /// As in [`Slabs`], but with an origin for each side of a box.
    pub(crate) origin_near: [Row; 3],
    pub(crate) origin_far: [Row; 3],
    pub(crate) inverse_near: [Row; 3],
    pub(crate) inverse_far: [Row; 3],
    pub(crate) t_min: Row,
}

impl SlabsRow {
    const EMPTY: Self = Self {
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
        for (axis, side) in near_side.into_iter().enumerate() {
            let [lower, upper] = [node.bounds[axis][0][child], node.bounds[axis][1][child]];
            let (enter, leave) = if side == 0 {
                (lower, upper)
            } else {
                (upper, lower)
            };
            let enter = lanes.sub(lanes.splat(enter), lanes.load(&self.origin_near[axis]));
            let leave = lanes.sub(lanes.splat(leave), lanes.load(&self.origin_far[axis]));
            near = lanes.max(lanes.mul(enter, lanes.load(&self.inverse_near[axis])), near);
            far = lanes.min(lanes.mul(leave, lanes.load(&self.inverse_far[axis])), far);
        }
        lanes.bits(lanes.at_most(near, far))
    }

    /// One ray for tests of eight boxes, where both its origins are the same.
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

/// By which sides rays enter boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// By axis, 0 where the rays enter through the lower bound and 1 where through the upper one.
    pub(crate) near: [usize; 3],
    /// Axes along which the rays do not move at all, or so little that 1/d is infinite.
    still: [bool; 3],
}

impl Sides {
    pub(crate) fn new(direction: [f32; 3]) -> Self {
        Self {
            near: direction.map(|d| usize::from(d.is_sign_negative())),
            still: direction.map(|d| d.recip().is_infinite()),
        }
    }
}

/// Rays that enter boxes by the same sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bundle<const ROWS: usize> {
    pub(crate) rows: [SlabsRow; ROWS],
    pub(crate) sides: Sides,
}

impl<const ROWS: usize> Bundle<ROWS> {
    /// Without rays yet.
    pub(crate) fn new(sides: Sides) -> Self {
        Self {
            rows: [SlabsRow::EMPTY; ROWS],
            sides,
        }
    }

    /// Sets the rays of a row, whose origins move back and forth by `pad`: whether they are finite
    /// and enter by the bundle's sides.
    ///
    /// Rays along an axis do not mix with others: where 0 * inf says nothing about the former, the
    /// interval of both would wrongly rely on the latter.
    #[inline(always)]
    pub(crate) fn set<L: Lanes>(
        &mut self,
        lanes: L,
        row: usize,
        origin: &[L::Floats; 3],
        direction: &[L::Floats; 3],
        pad: L::Floats,
    ) -> L::Mask {
        let zero = lanes.splat(0.0);
        let max = lanes.splat(f32::MAX);
        let mut fit = lanes.at_most(zero, zero);
        let row = &mut self.rows[row];
        for axis in 0..3 {
            let (origin, direction) = (origin[axis], direction[axis]);
            let inverse = lanes.div(lanes.splat(1.0), direction);
            let steep = size(lanes, inverse);
            let (back, forth) = (lanes.add(origin, pad), lanes.sub(origin, pad));
            let (is_same_side, near, far) = if self.sides.near[axis] == 0 {
                (lanes.less(zero, inverse), back, forth)
            } else {
                (lanes.less(inverse, zero), forth, back)
            };
            let is_same_way = if self.sides.still[axis] {
                lanes.less(max, steep)
            } else {
                lanes.at_most(steep, max)
            };
            fit = lanes.and(fit, lanes.and(is_same_side, is_same_way));
            fit = lanes.and(fit, lanes.at_most(size(lanes, near), max));
            fit = lanes.and(fit, lanes.at_most(size(lanes, far), max));
            row.origin_near[axis] = lanes.store(near);
            row.origin_far[axis] = lanes.store(far);
            row.inverse_near[axis] = lanes.store(inverse);
            row.inverse_far[axis] = lanes.store(lanes.mul(inverse, lanes.splat(WIDEN)));
        }
        fit
    }
}

/// The magnitudes.
#[inline(always)]
pub(crate) fn size<L: Lanes>(lanes: L, a: L::Floats) -> L::Floats {
    lanes.max(a, lanes.sub(lanes.splat(0.0), a))
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
            near_side: bundle.sides.near,
            origin_near: [zero; 3],
            origin_far: [zero; 3],
            slowest: [zero; 3],
            fastest: [zero; 3],
            slowest_far: [zero; 3],
            fastest_far: [zero; 3],
            t_min: zero,
        };
        let rows = &bundle.rows;
        let mut t_min = lanes.load(&rows[0].t_min);
        for row in rows {
            t_min = lanes.min(lanes.load(&row.t_min), t_min);
        }
        hull.t_min = lanes.splat(least(lanes.store(t_min)));
        for axis in 0..3 {
            let [mut near_low, mut near_high] = [lanes.load(&rows[0].origin_near[axis]); 2];
            let [mut far_low, mut far_high] = [lanes.load(&rows[0].origin_far[axis]); 2];
            let [mut low, mut high] = [lanes.load(&rows[0].inverse_near[axis]); 2];
            for row in rows {
                let near = lanes.load(&row.origin_near[axis]);
                near_low = lanes.min(near, near_low);
                near_high = lanes.max(near, near_high);
                let far = lanes.load(&row.origin_far[axis]);
                far_low = lanes.min(far, far_low);
                far_high = lanes.max(far, far_high);
                let inverse = lanes.load(&row.inverse_near[axis]);
                low = lanes.min(inverse, low);
                high = lanes.max(inverse, high);
            }
            let (low, high) = (least(lanes.store(low)), greatest(lanes.store(high)));
            let (near, far, slow, fast) = if hull.near_side[axis] == 0 {
                let (near, far) = (lanes.store(near_high), lanes.store(far_low));
                (greatest(near), least(far), low, high)
            } else {
                let (near, far) = (lanes.store(near_low), lanes.store(far_high));
                (least(near), greatest(far), high, low)
            };
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
pub(crate) fn least([a, b, c, d, e, f, g, h]: Row) -> f32 {
    let least = |a: f32, b: f32| if a < b { a } else { b };
    least(
        least(least(a, e), least(b, f)),
        least(least(c, g), least(d, h)),
    )
}

/// The greatest of eight numbers, none of which is NaN.
#[inline(always)]
pub(crate) fn greatest([a, b, c, d, e, f, g, h]: Row) -> f32 {
    let greatest = |a: f32, b: f32| if a > b { a } else { b };
    greatest(
        greatest(greatest(a, e), greatest(b, f)),
        greatest(greatest(c, g), greatest(d, h)),
    )
}
