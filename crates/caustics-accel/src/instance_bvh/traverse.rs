//! The way of a ray through the instances and into their meshes.

use caustics_geometry::Ray;

use super::placement::Placement;
use super::{InstanceBvh, Placed};
use crate::simd::{Lanes, Row};
use crate::triangle_bvh::layout::{Child, Node};
use crate::triangle_bvh::traverse::{Meet, Slabs, search, search_any, splat};
use crate::triangles::{Block, Closest, ShearedRay, lower_end};

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
    /// With the origin moved back, for the side where boxes are entered ...
    slabs: Slabs<F>,
    /// ... and, by axis, forth, for the side where they are left.
    origin_far: [F; 3],
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
        // Entering by the lower side, the box begins earlier.
        let mut back = origin;
        let mut forth = origin;
        for axis in 0..3 {
            let pad = if direction[axis].is_sign_negative() {
                -pad
            } else {
                pad
            };
            back[axis] += pad;
            forth[axis] -= pad;
        }
        Self {
            slabs: Slabs::along(lanes, back, direction, lower_end(ray)),
            origin_far: splat(lanes, forth),
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
        self.slabs.meet_from(lanes, &self.origin_far, node, limit)
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
