//! The way of a ray through the tree.

use caustics_geometry::glam::Vec3;
use caustics_geometry::{Hit, Ray, WatertightRay};

use super::layout::{Block, Child, Node};
use crate::simd::{Kernel, Lanes, Row, Stack};

/// What traversal reads.
#[derive(Clone, Copy)]
pub(super) struct Tree<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) blocks: &'a [Block],
    pub(super) root: Child,
}

/// The closest hit of a ray.
pub(super) struct ClosestHit<'a> {
    pub(super) tree: Tree<'a>,
    pub(super) ray: &'a Ray,
}

impl Kernel for ClosestHit<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        closest_hit(lanes, self.tree, self.ray)
    }
}

/// Whether a ray hits anything.
pub(super) struct Occlusion<'a> {
    pub(super) tree: Tree<'a>,
    pub(super) ray: &'a Ray,
}

impl Kernel for Occlusion<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> bool {
        is_occluded(lanes, self.tree, self.ray)
    }
}

/// Entries that wait at most; see [`MAX_DEPTH`].
const STACK: usize = 512;

/// Levels of nodes that the stack suffices for: each leaves at most seven children waiting, and
/// the last one puts all eight on the stack for a moment.
pub(super) const MAX_DEPTH: usize = (STACK - 1) / 7;

/// Widens the far side of every box, so that no rounding lets a ray slip between two of them.
///
/// With e = 2^-24, a computed slab distance (b - o) * (1/d) is off by a factor of at most
/// (1 + e)^3, the near and the far one together by 6 e. The leaf test sees the ray through
/// vertices whose sheared x and y are off by a factor of at most (1 + e)^5, which shifts where it
/// crosses the two slabs by another 10 e. 20 e covers both and the rounding of this product
/// (after Ize, *Robust BVH Ray Traversal*, JCGT 2013, whose factor covers the slabs alone).
const WIDEN: f32 = 1.0 + 20.0 * (f32::EPSILON / 2.0);

/// What is computed once for a ray.
struct Prepared<F> {
    /// By axis.
    origin: [F; 3],
    /// Reciprocal of the direction, by axis, for the side of a box where the ray enters ...
    inverse_near: [F; 3],
    /// ... and for the side where it leaves.
    inverse_far: [F; 3],
    /// By axis, 0 where the ray enters through the lower bound and 1 where through the upper one.
    near_side: [usize; 3],
    t_min: F,
    /// The axis along which the direction is longest comes last.
    axes: [usize; 3],
    /// Origin in the order of `axes`.
    sheared_origin: [F; 3],
    /// Woop's shear, and the reciprocal of the direction's longest component.
    shear: [F; 3],
}

#[inline(always)]
fn splat<L: Lanes>(lanes: L, [x, y, z]: [f32; 3]) -> [L::Floats; 3] {
    [lanes.splat(x), lanes.splat(y), lanes.splat(z)]
}

impl<F: Copy> Prepared<F> {
    /// `None` for a ray that cannot hit anything: not finite, or an empty range.
    #[inline(always)]
    fn new<L: Lanes<Floats = F>>(lanes: L, ray: &Ray, t_min: f32) -> Option<Self> {
        let finite = ray.origin.is_finite() && ray.direction.is_finite();
        // Also turns away a NaN.
        let in_range = t_min < ray.t_max;
        if !(finite && in_range) {
            return None;
        }
        let origin = ray.origin.to_array();
        let direction = ray.direction.to_array();
        let inverse = direction.map(|d| 1.0 / d);
        let longest = ray.direction.abs().max_position();
        let axes = [(longest + 1) % 3, (longest + 2) % 3, longest];
        let along = inverse[longest];
        Some(Self {
            origin: splat(lanes, origin),
            inverse_near: splat(lanes, inverse),
            inverse_far: splat(lanes, inverse.map(|i| i * WIDEN)),
            near_side: direction.map(|d| usize::from(d.is_sign_negative())),
            t_min: lanes.splat(t_min),
            axes,
            sheared_origin: splat(lanes, axes.map(|axis| origin[axis])),
            shear: splat(
                lanes,
                [
                    direction[axes[0]] / direction[longest],
                    direction[axes[1]] / direction[longest],
                    along,
                ],
            ),
        })
    }

    /// Where the ray enters the children's boxes, and which ones it meets before `limit`.
    #[inline(always)]
    fn meet<L: Lanes<Floats = F>>(&self, lanes: L, node: &Node, limit: F) -> (F, u32) {
        // A ray that runs in the plane of a box's side has 0 * inf = NaN there. Such a ray counts
        // as inside that slab: the minimum and maximum pass over a NaN in their first argument.
        let mut near = self.t_min;
        let mut far = limit;
        for axis in 0..3 {
            let [lower, upper] = &node.bounds[axis];
            let (enter, leave) = if self.near_side[axis] == 0 {
                (lower, upper)
            } else {
                (upper, lower)
            };
            let enter = lanes.sub(lanes.load(enter), self.origin[axis]);
            let leave = lanes.sub(lanes.load(leave), self.origin[axis]);
            near = lanes.max(lanes.mul(enter, self.inverse_near[axis]), near);
            far = lanes.min(lanes.mul(leave, self.inverse_far[axis]), far);
        }
        (near, lanes.bits(lanes.at_most(near, far)))
    }

    /// Moves and shears eight vertices so that the ray becomes the z axis.
    // Not a closure: those are compiled for the base instructions before they are inlined.
    #[inline(always)]
    fn project<L: Lanes<Floats = F>>(&self, lanes: L, rows: &[Row; 3]) -> (F, F, F) {
        let [x, y, z] = self.axes;
        let to_x = lanes.sub(lanes.load(&rows[x]), self.sheared_origin[0]);
        let to_y = lanes.sub(lanes.load(&rows[y]), self.sheared_origin[1]);
        let to_z = lanes.sub(lanes.load(&rows[z]), self.sheared_origin[2]);
        (
            lanes.sub(to_x, lanes.mul(self.shear[0], to_z)),
            lanes.sub(to_y, lanes.mul(self.shear[1], to_z)),
            to_z,
        )
    }

    /// Tests eight triangles: edge functions for the weights of the three vertices and their sum,
    /// the ray parameters, and the lanes that are hit between the ray's `t_min` and `limit`.
    ///
    /// Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, JCGT 2013: the ray becomes the
    /// z axis, and every vertex is projected in the same way whatever triangle it belongs to. The
    /// edge functions of the two triangles at an edge are then exact opposites of each other, as
    /// long as nothing contracts the products and the difference. One that rounds to zero counts
    /// as inside for both, so that an edge or vertex is never missed.
    #[inline(always)]
    fn hit<L: Lanes<Floats = F>>(&self, lanes: L, block: &Block, limit: F) -> BlockHits<F> {
        let (a_x, a_y, a_z) = self.project(lanes, &block.vertices[0]);
        let (b_x, b_y, b_z) = self.project(lanes, &block.vertices[1]);
        let (c_x, c_y, c_z) = self.project(lanes, &block.vertices[2]);
        let a = lanes.sub(lanes.mul(c_x, b_y), lanes.mul(c_y, b_x));
        let b = lanes.sub(lanes.mul(a_x, c_y), lanes.mul(a_y, c_x));
        let c = lanes.sub(lanes.mul(b_x, a_y), lanes.mul(b_y, a_x));
        let zero = lanes.splat(0.0);
        let all_positive = lanes.at_most(zero, lanes.min(lanes.min(a, b), c));
        let all_negative = lanes.at_most(lanes.max(lanes.max(a, b), c), zero);
        let inside = lanes.or(all_positive, all_negative);
        if lanes.bits(inside) == 0 {
            return BlockHits {
                b,
                c,
                sum: a,
                t: a,
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
        let hit = lanes.bits(lanes.and(inside, in_range)) & !vanishing;
        BlockHits {
            b,
            c,
            sum,
            t,
            lanes: hit,
            vanishing,
        }
    }
}

struct BlockHits<F> {
    b: F,
    c: F,
    sum: F,
    t: F,
    /// Lanes that are hit.
    lanes: u32,
    /// Lanes whose edge functions are too small for normal floats and say nothing.
    vanishing: u32,
}

/// The test again for one triangle whose edge functions vanish, with products that do not.
#[cold]
#[inline(never)]
fn hit_vanishing(block: &Block, lane: usize, ray: &Ray, limit: f32) -> Option<Hit> {
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

/// Whether a hit comes before another one.
#[inline(always)]
fn is_nearer(t: f32, primitive: u32, than: Option<Hit>) -> bool {
    than.is_none_or(|than| t < than.t || (t == than.t && primitive < than.primitive))
}

/// A waiting child, ordered by where the ray enters its box: never a negative number, so that its
/// bits are ordered as it is.
#[inline(always)]
fn entry(near: f32, child: Child) -> u64 {
    (u64::from(near.to_bits()) << 32) | u64::from(child.0)
}

#[inline(always)]
fn child_of(entry: u64) -> Child {
    Child(entry as u32)
}

#[inline(always)]
fn near_of(entry: u64) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

/// Removes and returns the lowest set bit's index.
#[inline(always)]
fn next_lane(bits: &mut u32) -> usize {
    // The mask tells the compiler that the lane is in range.
    let lane = bits.trailing_zeros() as usize & 7;
    *bits &= *bits - 1;
    lane
}

/// Lower end of the ray's range: boxes are entered at no negative parameter.
#[inline(always)]
fn lower_end(ray: &Ray) -> f32 {
    // A negative zero would sort above everything.
    ray.t_min.max(0.0) + 0.0
}

#[inline(always)]
fn closest_hit<L: Lanes>(lanes: L, tree: Tree<'_>, ray: &Ray) -> Option<Hit> {
    let prepared = Prepared::new(lanes, ray, lower_end(ray))?;
    // Hits at exactly this parameter count, so that of two at the same place the one with the
    // lower index wins, whichever is found first.
    let mut limit = ray.t_max.next_down();
    let mut limits = lanes.splat(limit);
    let mut widened = limit * WIDEN;
    let mut hit = None::<Hit>;
    let mut stack = Stack::<u64, STACK>::new();
    let mut current = tree.root;
    loop {
        while !current.is_leaf() {
            let node = &tree.nodes[current.index()];
            let (near, mut met) = prepared.meet(lanes, node, lanes.splat(widened));
            if met == 0 {
                break;
            }
            let first = next_lane(&mut met);
            if met == 0 {
                current = node.children[first];
                continue;
            }
            let near = lanes.store(near);
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
            current = child_of(nearest);
        }
        if current.is_leaf() {
            for block in &tree.blocks[current.blocks()] {
                let found = prepared.hit(lanes, block, limits);
                if found.lanes | found.vanishing == 0 {
                    continue;
                }
                let t = lanes.store(found.t);
                let mut bits = found.lanes;
                while bits != 0 {
                    let lane = next_lane(&mut bits);
                    let primitive = block.primitives[lane];
                    if is_nearer(t[lane], primitive, hit) {
                        let sum = lanes.store(found.sum)[lane];
                        limit = t[lane];
                        hit = Some(Hit {
                            t: limit,
                            u: lanes.store(found.b)[lane] / sum,
                            v: lanes.store(found.c)[lane] / sum,
                            primitive,
                        });
                    }
                }
                let mut bits = found.vanishing;
                while bits != 0 {
                    let candidate = hit_vanishing(block, next_lane(&mut bits), ray, limit);
                    if let Some(candidate) = candidate
                        && is_nearer(candidate.t, candidate.primitive, hit)
                    {
                        limit = candidate.t;
                        hit = Some(candidate);
                    }
                }
                limits = lanes.splat(limit);
                widened = limit * WIDEN;
            }
        }
        loop {
            let Some(next) = stack.pop() else {
                return hit;
            };
            if near_of(next) <= widened {
                current = child_of(next);
                break;
            }
        }
    }
}

#[inline(always)]
fn is_occluded<L: Lanes>(lanes: L, tree: Tree<'_>, ray: &Ray) -> bool {
    let Some(prepared) = Prepared::new(lanes, ray, lower_end(ray)) else {
        return false;
    };
    let limit = ray.t_max.next_down();
    let limits = lanes.splat(limit);
    let widened = lanes.splat(limit * WIDEN);
    let mut stack = Stack::<u64, STACK>::new();
    stack.push(u64::from(tree.root.0));
    while let Some(next) = stack.pop() {
        let current = child_of(next);
        if current.is_leaf() {
            for block in &tree.blocks[current.blocks()] {
                let mut found = prepared.hit(lanes, block, limits);
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
        } else {
            let node = &tree.nodes[current.index()];
            let (_, mut met) = prepared.meet(lanes, node, widened);
            while met != 0 {
                stack.push(u64::from(node.children[next_lane(&mut met)].0));
            }
        }
    }
    false
}
