//! Eight rays against one triangle after the other.

use caustics_geometry::glam::Vec3;
use caustics_geometry::{Hit, Ray};

use super::block::Block;
use super::leaf_test::{Closest, Sheared, ShearedRay, axes_of, hit_vanishing, load, splat};
use crate::simd::{Lanes, Row, WIDTH, next_lane};

/// Eight rays for Woop's test, whose directions are longest along the same axis: to the bit what
/// [`ShearedRay`] has of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShearedRow {
    pub(crate) axes: [usize; 3],
    origin: [Row; 3],
    shear: [Row; 3],
    t_min: Row,
}

/// The closest hits so far of eight rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosestRow {
    /// As [`Closest`] has it.
    pub(crate) limit: Row,
    u: Row,
    v: Row,
    /// Bits of the primitives' numbers, which only ever move; all of them where nothing is hit.
    primitive: Row,
}

const NO_PRIMITIVE: f32 = f32::from_bits(u32::MAX);

impl ShearedRow {
    /// Without rays yet, for such as go along the same axis as this direction.
    pub(crate) fn along(direction: Vec3) -> Self {
        Self {
            axes: axes_of(direction),
            origin: [[0.0; WIDTH]; 3],
            shear: [[0.0; WIDTH]; 3],
            t_min: [0.0; WIDTH],
        }
    }

    /// Sets the rays: which of them go along the axis.
    #[inline(always)]
    pub(crate) fn set<L: Lanes>(
        &mut self,
        lanes: L,
        origin: &[Row; 3],
        direction: &[Row; 3],
        t_min: Row,
    ) -> L::Mask {
        let [x, y, z] = self.axes;
        let [along_x, along_y, along_z] =
            load(lanes, [&direction[x], &direction[y], &direction[z]]);
        self.origin = [origin[x], origin[y], origin[z]];
        self.shear = [
            lanes.store(lanes.div(along_x, along_z)),
            lanes.store(lanes.div(along_y, along_z)),
            lanes.store(lanes.div(lanes.splat(1.0), along_z)),
        ];
        self.t_min = t_min;
        let zero = lanes.splat(0.0);
        let [size_x, size_y, size_z] = [
            lanes.max(along_x, lanes.sub(zero, along_x)),
            lanes.max(along_y, lanes.sub(zero, along_y)),
            lanes.max(along_z, lanes.sub(zero, along_z)),
        ];
        // Of components of the same size the first one counts, as for `ShearedRay`.
        let beyond_x = if x < z {
            lanes.less(size_x, size_z)
        } else {
            lanes.at_most(size_x, size_z)
        };
        let beyond_y = if y < z {
            lanes.less(size_y, size_z)
        } else {
            lanes.at_most(size_y, size_z)
        };
        lanes.and(beyond_x, beyond_y)
    }

    /// One of the rays.
    #[inline(always)]
    pub(crate) fn ray(&self, lane: usize) -> ShearedRay {
        let of = |[x, y, z]: &[Row; 3]| [x[lane], y[lane], z[lane]];
        ShearedRay {
            axes: self.axes,
            origin: of(&self.origin),
            shear: of(&self.shear),
            t_min: self.t_min[lane],
        }
    }
}

impl ClosestRow {
    /// Before anything is hit.
    pub(crate) const NONE: Self = Self {
        limit: [0.0; WIDTH],
        u: [0.0; WIDTH],
        v: [0.0; WIDTH],
        primitive: [NO_PRIMITIVE; WIDTH],
    };

    /// For other rays.
    #[inline(always)]
    pub(crate) fn forget(&mut self) {
        self.primitive = [NO_PRIMITIVE; WIDTH];
    }

    #[inline(always)]
    pub(crate) fn hit(&self, lane: usize) -> Option<Hit> {
        let primitive = self.primitive[lane].to_bits();
        (primitive != u32::MAX).then_some(Hit {
            t: self.limit[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive,
        })
    }

    #[inline(always)]
    pub(crate) fn get(&self, lane: usize, first: u32) -> Closest {
        Closest {
            limit: self.limit[lane],
            hit: self.hit(lane),
            first,
        }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, closest: &Closest) {
        if let Some(hit) = closest.hit {
            self.limit[lane] = hit.t;
            self.u[lane] = hit.u;
            self.v[lane] = hit.v;
            self.primitive[lane] = f32::from_bits(hit.primitive);
        }
    }

    /// Tests all triangles of a block for the rays of `active`, a bit for each. Numbers of primitives
    /// count from `first`.
    #[inline(always)]
    pub(crate) fn find_closest<L: Lanes>(
        &mut self,
        lanes: L,
        block: &Block,
        first: u32,
        sheared: &ShearedRow,
        rays: &[Ray],
        active: u32,
    ) {
        let ray = Sheared {
            origin: load(lanes, sheared.origin.each_ref()),
            shear: load(lanes, sheared.shear.each_ref()),
            t_min: lanes.load(&sheared.t_min),
        };
        let [x, y, z] = sheared.axes;
        for lane in 0..WIDTH {
            if block.primitives[lane] == u32::MAX {
                break;
            }
            let [a, b, c] = &block.vertices;
            let vertices = [
                splat(lanes, [a[x][lane], a[y][lane], a[z][lane]]),
                splat(lanes, [b[x][lane], b[y][lane], b[z][lane]]),
                splat(lanes, [c[x][lane], c[y][lane], c[z][lane]]),
            ];
            let limit = lanes.load(&self.limit);
            let found = ray.hit(lanes, &vertices, limit);
            let (hit, vanishing) = (found.lanes & active, found.vanishing & active);
            if hit | vanishing == 0 {
                continue;
            }
            let primitive = block.primitives[lane] + first;
            let u = lanes.div(found.b, found.sum);
            let v = lanes.div(found.c, found.sum);
            let nearer = lanes.and(found.met, lanes.less(found.t, limit));
            if vanishing == 0 && lanes.bits(nearer) == hit {
                let number = lanes.splat(f32::from_bits(primitive));
                let old = lanes.load(&self.u);
                self.u = lanes.store(lanes.select(nearer, u, old));
                let old = lanes.load(&self.v);
                self.v = lanes.store(lanes.select(nearer, v, old));
                let old = lanes.load(&self.primitive);
                self.primitive = lanes.store(lanes.select(nearer, number, old));
                self.limit = lanes.store(lanes.select(nearer, found.t, limit));
            } else {
                let candidates = Candidates {
                    hit,
                    vanishing,
                    t: lanes.store(found.t),
                    u: lanes.store(u),
                    v: lanes.store(v),
                };
                self.offer_each(&candidates, block, lane, first, rays);
            }
        }
    }

    /// One ray after the other, where some hits are as far as others or edge functions vanish.
    #[cold]
    #[inline(never)]
    fn offer_each(
        &mut self,
        candidates: &Candidates,
        block: &Block,
        triangle: usize,
        first: u32,
        rays: &[Ray],
    ) {
        let Candidates { t, u, v, .. } = candidates;
        let (mut hit, mut vanishing) = (candidates.hit, candidates.vanishing);
        while hit != 0 {
            let lane = next_lane(&mut hit);
            let mut closest = self.get(lane, first);
            closest.offer(Hit {
                t: t[lane],
                u: u[lane],
                v: v[lane],
                primitive: block.primitives[triangle],
            });
            self.set(lane, &closest);
        }
        while vanishing != 0 {
            let lane = next_lane(&mut vanishing);
            let mut closest = self.get(lane, first);
            if let Some(hit) = hit_vanishing(block, triangle, &rays[lane], closest.limit) {
                closest.offer(hit);
                self.set(lane, &closest);
            }
        }
    }
}

/// What a triangle's test found for eight rays.
struct Candidates {
    /// Rays that hit it.
    hit: u32,
    /// Rays for which edge functions are too small to tell.
    vanishing: u32,
    t: Row,
    u: Row,
    v: Row,
}
