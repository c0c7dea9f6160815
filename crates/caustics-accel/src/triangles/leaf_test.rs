//! A ray against the triangles of a leaf.

use std::ops::Range;

use caustics_geometry::glam::Vec3;
use caustics_geometry::{Hit, Ray, WatertightRay};

use super::block::Block;
use super::query::lower_end;
use crate::simd::{Lanes, Row, next_lane};

/// A ray for Woop's test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShearedRay {
    /// The axis along which the direction is longest comes last.
    pub(super) axes: [usize; 3],
    /// In the order of `axes`.
    pub(super) origin: [f32; 3],
    /// The direction's other two components over its longest, and the reciprocal of that.
    pub(super) shear: [f32; 3],
    pub(super) t_min: f32,
}

/// The closest hit so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    /// Hits at exactly this parameter count, so that of two at the same place the one with the
    /// lower index wins, whichever is found first.
    pub(crate) limit: f32,
    pub(crate) hit: Option<Hit>,
    /// Added to the triangles' numbers in the blocks.
    pub(crate) first: u32,
}

impl Closest {
    /// Before anything is hit.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        Self {
            limit: ray.t_max.next_down(),
            hit: None,
            first: 0,
        }
    }

    #[inline(always)]
    pub(super) fn offer(&mut self, hit: Hit) {
        let hit = Hit {
            primitive: hit.primitive + self.first,
            ..hit
        };
        let nearer = self.hit.is_none_or(|than| {
            hit.t < than.t || (hit.t == than.t && hit.primitive < than.primitive)
        });
        if nearer {
            self.limit = hit.t;
            self.hit = Some(hit);
        }
    }
}

/// The three axes, the one along which a direction is longest last.
#[inline(always)]
pub(crate) fn axes_of(direction: Vec3) -> [usize; 3] {
    let longest = direction.abs().max_position();
    [(longest + 1) % 3, (longest + 2) % 3, longest]
}

impl ShearedRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        let origin = ray.origin.to_array();
        let direction = ray.direction.to_array();
        let axes = axes_of(ray.direction);
        let along = direction[axes[2]];
        Self {
            axes,
            origin: axes.map(|axis| origin[axis]),
            shear: [
                direction[axes[0]] / along,
                direction[axes[1]] / along,
                1.0 / along,
            ],
            t_min: lower_end(ray),
        }
    }

    /// Tests all triangles of a leaf.
    #[inline(always)]
    pub(crate) fn find_closest<L: Lanes>(
        &self,
        lanes: L,
        blocks: &[Block],
        leaf: Range<usize>,
        ray: &Ray,
        closest: &mut Closest,
    ) {
        for block in &blocks[leaf] {
            let found = self.hit(lanes, block, closest.limit);
            if found.lanes | found.vanishing == 0 {
                continue;
            }
            let t = lanes.store(found.t);
            let mut bits = found.lanes;
            while bits != 0 {
                let lane = next_lane(&mut bits);
                if t[lane] <= closest.limit {
                    let sum = lanes.store(found.sum)[lane];
                    closest.offer(Hit {
                        t: t[lane],
                        u: lanes.store(found.b)[lane] / sum,
                        v: lanes.store(found.c)[lane] / sum,
                        primitive: block.primitives[lane],
                    });
                }
            }
            let mut bits = found.vanishing;
            while bits != 0 {
                let lane = next_lane(&mut bits);
                if let Some(hit) = hit_vanishing(block, lane, ray, closest.limit) {
                    closest.offer(hit);
                }
            }
        }
    }

    /// Whether any triangle of a leaf is hit at no more than `limit`.
    #[inline(always)]
    pub(crate) fn hits_any<L: Lanes>(
        &self,
        lanes: L,
        blocks: &[Block],
        leaf: Range<usize>,
        ray: &Ray,
        limit: f32,
    ) -> bool {
        for block in &blocks[leaf] {
            let mut found = self.hit(lanes, block, limit);
            if found.lanes != 0 {
                return true;
            }
            while found.vanishing != 0 {
                let lane = next_lane(&mut found.vanishing);
                if hit_vanishing(block, lane, ray, limit).is_some() {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn hit<L: Lanes>(&self, lanes: L, block: &Block, limit: f32) -> Hits<L> {
        let [x, y, z] = self.axes;
        let [a, b, c] = &block.vertices;
        let vertices = [
            load(lanes, [&a[x], &a[y], &a[z]]),
            load(lanes, [&b[x], &b[y], &b[z]]),
            load(lanes, [&c[x], &c[y], &c[z]]),
        ];
        let ray = Sheared {
            origin: splat(lanes, self.origin),
            shear: splat(lanes, self.shear),
            t_min: lanes.splat(self.t_min),
        };
        ray.hit(lanes, &vertices, lanes.splat(limit))
    }
}

#[inline(always)]
pub(super) fn load<L: Lanes>(lanes: L, [x, y, z]: [&Row; 3]) -> [L::Floats; 3] {
    [lanes.load(x), lanes.load(y), lanes.load(z)]
}

#[inline(always)]
pub(super) fn splat<L: Lanes>(lanes: L, [x, y, z]: [f32; 3]) -> [L::Floats; 3] {
    [lanes.splat(x), lanes.splat(y), lanes.splat(z)]
}

/// A ray in each lane, or one in all of them: see [`ShearedRay`].
pub(super) struct Sheared<F> {
    pub(super) origin: [F; 3],
    pub(super) shear: [F; 3],
    pub(super) t_min: F,
}

impl<F: Copy> Sheared<F> {
    /// Moves and shears vertices so that the ray becomes the z axis.
    // Not a closure: those are compiled for the base instructions before they are inlined.
    #[inline(always)]
    fn project<L: Lanes<Floats = F>>(&self, lanes: L, [x, y, z]: &[F; 3]) -> (F, F, F) {
        let to_x = lanes.sub(*x, self.origin[0]);
        let to_y = lanes.sub(*y, self.origin[1]);
        let to_z = lanes.sub(*z, self.origin[2]);
        (
            lanes.sub(to_x, lanes.mul(self.shear[0], to_z)),
            lanes.sub(to_y, lanes.mul(self.shear[1], to_z)),
            to_z,
        )
    }

    /// Tests a triangle in each lane, or one in all of them: edge functions for the weights of the
    /// three vertices and their sum, the ray parameters, and the lanes that are hit between the
    /// ray's `t_min` and `limit`.
    ///
    /// Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, JCGT 2013: the ray becomes the
    /// z axis, and every vertex is projected in the same way whatever triangle it belongs to. The
    /// edge functions of the two triangles at an edge are then exact opposites of each other, as
    /// long as nothing contracts the products and the difference. One that rounds to zero counts
    /// as inside for both, so that an edge or vertex is never missed.
    #[inline(always)]
    pub(super) fn hit<L: Lanes<Floats = F>>(
        &self,
        lanes: L,
        [a, b, c]: &[[F; 3]; 3],
        limit: F,
    ) -> Hits<L> {
        let (a_x, a_y, a_z) = self.project(lanes, a);
        let (b_x, b_y, b_z) = self.project(lanes, b);
        let (c_x, c_y, c_z) = self.project(lanes, c);
        let a = lanes.sub(lanes.mul(c_x, b_y), lanes.mul(c_y, b_x));
        let b = lanes.sub(lanes.mul(a_x, c_y), lanes.mul(a_y, c_x));
        let c = lanes.sub(lanes.mul(b_x, a_y), lanes.mul(b_y, a_x));
        let zero = lanes.splat(0.0);
        let all_positive = lanes.at_most(zero, lanes.min(lanes.min(a, b), c));
        let all_negative = lanes.at_most(lanes.max(lanes.max(a, b), c), zero);
        let inside = lanes.or(all_positive, all_negative);
        if lanes.bits(inside) == 0 {
            return Hits {
                b,
                c,
                sum: a,
                t: a,
                met: inside,
                lanes: 0,
                vanishing: 0,
            };
        }
        let sum = lanes.add(lanes.add(a, b), c);
        let size = lanes.max(sum, lanes.sub(zero, sum));
        let vanishing =
            lanes.bits(lanes.and(inside, lanes.less(size, lanes.splat(f32::MIN_POSITIVE))));
        let depth = lanes.add(
            lanes.add(lanes.mul(a, a_z), lanes.mul(b, b_z)),
            lanes.mul(c, c_z),
        );
        let t = lanes.div(lanes.mul(depth, self.shear[2]), sum);
        let in_range = lanes.and(lanes.less(self.t_min, t), lanes.at_most(t, limit));
        let met = lanes.and(inside, in_range);
        Hits {
            b,
            c,
            sum,
            t,
            met,
            lanes: lanes.bits(met) & !vanishing,
            vanishing,
        }
    }
}

pub(super) struct Hits<L: Lanes> {
    pub(super) b: L::Floats,
    pub(super) c: L::Floats,
    pub(super) sum: L::Floats,
    pub(super) t: L::Floats,
    /// Lanes that are hit, and perhaps some of those that vanish.
    pub(super) met: L::Mask,
    /// Lanes that are hit.
    pub(super) lanes: u32,
    /// Lanes whose edge functions are too small for normal floats and say nothing.
    pub(super) vanishing: u32,
}

/// The test again for one triangle whose edge functions vanish, with products that do not.
#[cold]
#[inline(never)]
pub(super) fn hit_vanishing(block: &Block, lane: usize, ray: &Ray, limit: f32) -> Option<Hit> {
    let [a, b, c] = block
        .vertices
        .map(|rows| Vec3::from_array(rows.map(|row| row[lane])));
    let ray = Ray {
        t_min: lower_end(ray),
        ..*ray
    };
    let hit = WatertightRay::new(&ray).intersect(a, b, c, limit.next_up())?;
    Some(Hit {
        t: hit.t,
        u: hit.u,
        v: hit.v,
        primitive: block.primitives[lane],
    })
}
