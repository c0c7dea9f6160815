//! Which rays of a stream keep together.

use caustics_geometry::Ray;
use caustics_geometry::glam::Vec3;

use super::bundle::{Bundle, Sides, size};
use super::traverse::splat;
use crate::simd::{Lanes, Row, WIDTH};
use crate::triangles::{ClosestRow, ShearedRow, axes_of};

/// Squared sine of the largest angle between a bundle's rays and its first: about 5 degrees.
const SPREAD_SQUARED: f32 = 0.0075;

/// Eight rays by component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayRow {
    pub(crate) origin: [Row; 3],
    pub(crate) direction: [Row; 3],
    /// As [`lower_end`](crate::triangles::lower_end) has it.
    pub(crate) t_min: Row,
    t_max: Row,
}

impl RayRow {
    const EMPTY: Self = Self {
        origin: [[0.0; WIDTH]; 3],
        direction: [[0.0; WIDTH]; 3],
        t_min: [0.0; WIDTH],
        t_max: [0.0; WIDTH],
    };
}

/// Rays of a stream that keep together, as boxes and leaves meet them, and what they have hit.
pub(crate) struct Gathered<const ROWS: usize> {
    pub(crate) world: [RayRow; ROWS],
    pub(crate) bundle: Bundle<ROWS>,
    pub(crate) sheared: [ShearedRow; ROWS],
    pub(crate) closest: [ClosestRow; ROWS],
}

/// The same without what they have hit.
#[derive(Clone, Copy)]
pub(crate) struct Together<'a, const ROWS: usize> {
    pub(crate) rays: &'a [Ray],
    pub(crate) world: &'a [RayRow; ROWS],
    pub(crate) bundle: &'a Bundle<ROWS>,
    pub(crate) sheared: &'a [ShearedRow; ROWS],
}

impl<const ROWS: usize> Gathered<ROWS> {
    /// Room for rays, to be used again and again: clearing it takes longer than a small tree.
    pub(crate) fn new() -> Self {
        let any = Vec3::Z;
        Self {
            world: [RayRow::EMPTY; ROWS],
            bundle: Bundle::new(Sides::new(any.to_array())),
            sheared: [ShearedRow::along(any); ROWS],
            closest: [ClosestRow::NONE; ROWS],
        }
    }

    /// Takes in these rays, in place of any others, if there are eight a row that can hit
    /// something, enter boxes by the same sides and go nearly the same way, so that the tree has
    /// few nodes that only some of them meet; and tells whether that is so.
    #[inline(always)]
    pub(crate) fn take<L: Lanes>(&mut self, lanes: L, rays: &[Ray]) -> bool {
        if rays.len() != ROWS * WIDTH {
            return false;
        }
        let (first, last) = (rays[0].direction, rays[rays.len() - 1].direction);
        // Before any work is done for rays that have nothing to do with each other.
        let limit = SPREAD_SQUARED * first.length_squared() * last.length_squared();
        if !(first.cross(last).length_squared() <= limit && first.dot(last) > 0.0) {
            return false;
        }
        self.bundle.sides = Sides::new(first.to_array());
        for row in 0..ROWS {
            self.sheared[row].axes = axes_of(first);
            if !self.fill(lanes, row, &rays[row * WIDTH..][..WIDTH], first) {
                return false;
            }
        }
        true
    }

    /// Sets a row; whether all of its rays keep to the first one.
    #[inline(always)]
    fn fill<L: Lanes>(&mut self, lanes: L, row: usize, rays: &[Ray], first: Vec3) -> bool {
        let world = &mut self.world[row];
        self.closest[row].forget();
        let limit = &mut self.closest[row].limit;
        for (lane, ray) in rays.iter().enumerate().take(WIDTH) {
            for axis in 0..3 {
                world.origin[axis][lane] = ray.origin[axis];
                world.direction[axis][lane] = ray.direction[axis];
            }
            world.t_min[lane] = ray.t_min;
            world.t_max[lane] = ray.t_max;
            limit[lane] = ray.t_max.next_down();
        }
        let zero = lanes.splat(0.0);
        let t_min = lanes.add(lanes.max(lanes.load(&world.t_min), zero), zero);
        let t_max = lanes.load(&world.t_max);
        let (o, d) = (load(lanes, &world.origin), load(lanes, &world.direction));
        world.t_min = lanes.store(t_min);
        let bundle = &mut self.bundle;
        bundle.rows[row].t_min = world.t_min;
        let mut fit = bundle.set(lanes, row, &o, &d, zero);
        fit = lanes.and(fit, lanes.less(t_min, t_max));
        let is_along = self.sheared[row].set(lanes, &world.origin, &world.direction, world.t_min);
        fit = lanes.and(fit, is_along);
        let one = splat(lanes, first.to_array());
        let across = [
            difference(lanes, d[1], one[2], d[2], one[1]),
            difference(lanes, d[2], one[0], d[0], one[2]),
            difference(lanes, d[0], one[1], d[1], one[0]),
        ];
        let limit = lanes.splat(SPREAD_SQUARED * first.length_squared());
        let limit = lanes.mul(dot(lanes, &d, &d), limit);
        fit = lanes.and(fit, lanes.at_most(dot(lanes, &across, &across), limit));
        fit = lanes.and(fit, lanes.less(zero, dot(lanes, &d, &one)));
        for component in d {
            let is_finite = lanes.at_most(size(lanes, component), lanes.splat(f32::MAX));
            fit = lanes.and(fit, is_finite);
        }
        lanes.bits(fit) == (1 << WIDTH) - 1
    }
}

/// Whether rays follow each other in squares, as in Morton order, and not in a long line. The
/// way from the first to the last is then about twice that of a quarter of them, not four times.
pub(crate) fn are_compact(rays: &[Ray]) -> bool {
    let [Some(first), Some(quarter), Some(last)] =
        [rays.first(), rays[..rays.len() / 4].last(), rays.last()]
    else {
        return false;
    };
    let is_compact = |of: fn(&Ray) -> Vec3| {
        let way = of(last).distance_squared(of(first));
        way <= 10.0 * of(quarter).distance_squared(of(first))
    };
    is_compact(|ray| ray.origin) && is_compact(|ray| ray.direction)
}

#[inline(always)]
pub(crate) fn load<L: Lanes>(lanes: L, [x, y, z]: &[Row; 3]) -> [L::Floats; 3] {
    [lanes.load(x), lanes.load(y), lanes.load(z)]
}

/// `a * b - c * d`.
#[inline(always)]
fn difference<L: Lanes>(
    lanes: L,
    a: L::Floats,
    b: L::Floats,
    c: L::Floats,
    d: L::Floats,
) -> L::Floats {
    lanes.sub(lanes.mul(a, b), lanes.mul(c, d))
}

#[inline(always)]
fn dot<L: Lanes>(lanes: L, a: &[L::Floats; 3], b: &[L::Floats; 3]) -> L::Floats {
    let xy = lanes.add(lanes.mul(a[0], b[0]), lanes.mul(a[1], b[1]));
    lanes.add(xy, lanes.mul(a[2], b[2]))
}
