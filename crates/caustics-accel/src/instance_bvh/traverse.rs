//! The way of a ray through the instances and into their meshes.

use caustics_geometry::{Hit, Ray};

use super::placement::Placement;
use super::{InstanceBvh, Placed};
use crate::simd::{Kernel, Lanes, Row};
use crate::triangle_bvh::layout::{Child, Node};
use crate::triangle_bvh::traverse::{Meet, Slabs, search, search_any, splat};
use crate::triangles::{Block, Closest, ShearedRay, WIDEN, is_usable, lower_end};

/// The closest hit of a ray.
pub(super) struct ClosestHit<'a> {
    pub(super) tree: &'a InstanceBvh,
    pub(super) ray: &'a Ray,
}

impl Kernel for ClosestHit<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        closest_hit(lanes, self.tree, self.ray)
    }
}

#[inline(always)]
pub(super) fn closest_hit<L: Lanes>(lanes: L, tree: &InstanceBvh, ray: &Ray) -> Option<Hit> {
    if !is_usable(ray) {
        return None;
    }
    let mut closest = Closest::new(ray);
    let among = Among::new(lanes, tree, ray);
    search(lanes, &tree.nodes, tree.root, &among, &mut closest);
    closest.hit
}

/// Whether a ray hits anything.
pub(super) struct Occlusion<'a> {
    pub(super) tree: &'a InstanceBvh,
    pub(super) ray: &'a Ray,
}

impl Kernel for Occlusion<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> bool {
        let Self { tree, ray } = self;
        if !is_usable(ray) {
            return false;
        }
        let among = Among::new(lanes, tree, ray);
        let limit = ray.t_max.next_down();
        search_any(lanes, &tree.nodes, tree.root, &among, limit)
    }
}

/// A ray in the world, among the boxes of instances.
pub(super) struct Among<'a, F> {
    slabs: Slabs<F>,
    sheared: ShearedRay,
    tree: &'a InstanceBvh,
    ray: &'a Ray,
}

impl<'a, F: Copy> Among<'a, F> {
    #[inline(always)]
    pub(super) fn new<L: Lanes<Floats = F>>(lanes: L, tree: &'a InstanceBvh, ray: &'a Ray) -> Self {
        Self {
            slabs: Slabs::new(lanes, ray),
            sheared: ShearedRay::new(ray),
            tree,
            ray,
        }
    }

    #[inline(always)]
    fn inside<L: Lanes<Floats = F>>(&self, lanes: L, placed: &'a Placed) -> Inside<'_, F> {
        let mesh = self.tree.instances[placed.instance as usize].mesh.tree();
        Inside::new(
            lanes,
            &placed.placement,
            &self.sheared,
            mesh.blocks,
            self.ray,
        )
    }
}

impl<L: Lanes> Meet<L> for Among<'_, L::Floats> {
    #[inline(always)]
    fn boxes(&self, lanes: L, node: &Node, limit: L::Floats) -> (L::Floats, u32) {
        self.slabs.meet(lanes, node, limit)
    }

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, closest: &mut Closest) {
        for placed in &self.tree.placed[leaf.blocks()] {
            let mesh = self.tree.instances[placed.instance as usize].mesh.tree();
            let inside = self.inside(lanes, placed);
            closest.first = placed.first;
            search(lanes, mesh.nodes, mesh.root, &inside, closest);
        }
    }

    #[inline(always)]
    fn hits_any(&self, lanes: L, leaf: Child, limit: f32) -> bool {
        for placed in &self.tree.placed[leaf.blocks()] {
            let mesh = self.tree.instances[placed.instance as usize].mesh.tree();
            let inside = self.inside(lanes, placed);
            if search_any(lanes, mesh.nodes, mesh.root, &inside, limit) {
                return true;
            }
        }
        false
    }
}

/// A ray inside a placed mesh: its boxes are met in the object's frame, by a ray that rounding has
/// moved and boxes grown by more than that; its triangles in the world, where their vertices are
/// to the bit those of the flattened mesh.
pub(super) struct Inside<'a, F> {
    /// By axis: the origin moved back, for the side where boxes are entered ...
    origin_near: [F; 3],
    /// ... and forth, for the side where they are left.
    origin_far: [F; 3],
    inverse_near: [F; 3],
    inverse_far: [F; 3],
    near_side: [usize; 3],
    t_min: F,
    placement: &'a Placement,
    sheared: &'a ShearedRay,
    blocks: &'a [Block],
    ray: &'a Ray,
}

impl<'a, F: Copy> Inside<'a, F> {
    #[inline(always)]
    pub(super) fn new<L: Lanes<Floats = F>>(
        lanes: L,
        placement: &'a Placement,
        sheared: &'a ShearedRay,
        blocks: &'a [Block],
        ray: &'a Ray,
    ) -> Self {
        let origin = placement.point_to_object(ray.origin).to_array();
        let direction = placement.direction_to_object(ray.direction).to_array();
        let pad = placement.pad(ray.origin);
        let inverse = direction.map(|d| 1.0 / d);
        let near_side = direction.map(|d| usize::from(d.is_sign_negative()));
        // Entering by the lower side, the box begins earlier.
        let mut back = origin;
        let mut forth = origin;
        for axis in 0..3 {
            let pad = if near_side[axis] == 0 { pad } else { -pad };
            back[axis] += pad;
            forth[axis] -= pad;
        }
        Self {
            origin_near: splat(lanes, back),
            origin_far: splat(lanes, forth),
            inverse_near: splat(lanes, inverse),
            inverse_far: splat(lanes, inverse.map(|i| i * WIDEN)),
            near_side,
            t_min: lanes.splat(lower_end(ray)),
            placement,
            sheared,
            blocks,
            ray,
        }
    }
}

impl<L: Lanes> Meet<L> for Inside<'_, L::Floats> {
    #[inline(always)]
    fn boxes(&self, lanes: L, node: &Node, limit: L::Floats) -> (L::Floats, u32) {
        // As for a ray in its own frame; see there about NaN.
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
            near = lanes.max(lanes.mul(enter, self.inverse_near[axis]), near);
            far = lanes.min(lanes.mul(leave, self.inverse_far[axis]), far);
        }
        (near, lanes.bits(lanes.at_most(near, far)))
    }

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, closest: &mut Closest) {
        for block in &self.blocks[leaf.blocks()] {
            let placed = [place(lanes, self.placement, block)];
            self.sheared
                .find_closest(lanes, &placed, 0..1, self.ray, closest);
        }
    }

    #[inline(always)]
    fn hits_any(&self, lanes: L, leaf: Child, limit: f32) -> bool {
        for block in &self.blocks[leaf.blocks()] {
            let placed = [place(lanes, self.placement, block)];
            if self.sheared.hits_any(lanes, &placed, 0..1, self.ray, limit) {
                return true;
            }
        }
        false
    }
}

/// Eight triangles in the world, rounded as `Affine3A::transform_point3` rounds them.
#[inline(always)]
pub(super) fn place<L: Lanes>(lanes: L, placement: &Placement, block: &Block) -> Block {
    let [a, b, c] = [0, 1, 2].map(|vertex| block.vertices[vertex]);
    let (b, c) = if placement.mirrors { (c, b) } else { (b, c) };
    Block {
        vertices: [
            place_rows(lanes, placement, &a),
            place_rows(lanes, placement, &b),
            place_rows(lanes, placement, &c),
        ],
        primitives: block.primitives,
    }
}

#[inline(always)]
fn place_rows<L: Lanes>(lanes: L, placement: &Placement, rows: &[Row; 3]) -> [Row; 3] {
    let [x, y, z] = [
        lanes.load(&rows[0]),
        lanes.load(&rows[1]),
        lanes.load(&rows[2]),
    ];
    let mut placed = [[0.0; 8]; 3];
    for (placed, row) in placed.iter_mut().zip(&placement.rows) {
        let mut sum = lanes.mul(lanes.splat(row[0]), x);
        sum = lanes.add(sum, lanes.mul(lanes.splat(row[1]), y));
        sum = lanes.add(sum, lanes.mul(lanes.splat(row[2]), z));
        *placed = lanes.store(lanes.add(sum, lanes.splat(row[3])));
    }
    placed
}
