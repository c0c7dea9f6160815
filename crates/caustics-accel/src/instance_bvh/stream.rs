//! Neighbouring rays that share their way through the instances and into their meshes.

use caustics_geometry::Ray;
use caustics_geometry::glam::Vec3;

use super::placement::Placement;
use super::traverse::{Among, Inside, place};
use super::{InstanceBvh, Placed};
use crate::simd::{Lanes, WIDTH};
use crate::triangle_bvh::bundle::{Bundle, Sides, size};
use crate::triangle_bvh::gather::{RayRow, Together, load};
use crate::triangle_bvh::layout::{Child, Node};
use crate::triangle_bvh::stage::Stage;
use crate::triangle_bvh::stream::{MeetTogether, fetch, find_closest, search_together};
use crate::triangle_bvh::traverse::{Meet, Tree, search};
use crate::triangles::{ClosestRow, ShearedRow};

impl Stage for InstanceBvh {
    #[inline(always)]
    fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    #[inline(always)]
    fn root(&self) -> Child {
        self.root
    }

    #[inline(always)]
    fn alone<'a, L: Lanes>(&'a self, lanes: L, ray: &'a Ray) -> impl Meet<L> {
        Among::new(lanes, self, ray)
    }

    #[inline(always)]
    fn together<'a, L: Lanes, const ROWS: usize>(
        &'a self,
        rays: Together<'a, ROWS>,
    ) -> impl MeetTogether<L, ROWS> {
        AmongTogether { tree: self, rays }
    }
}

/// A bundle in the world, among the boxes of instances.
struct AmongTogether<'a, const ROWS: usize> {
    tree: &'a InstanceBvh,
    rays: Together<'a, ROWS>,
}

impl<L: Lanes, const ROWS: usize> MeetTogether<L, ROWS> for AmongTogether<'_, ROWS> {
    #[inline(always)]
    fn fetch(&self, _: Child) {}

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, active: u64, closest: &mut [ClosestRow; ROWS]) {
        let Together {
            rays,
            world,
            sheared,
            ..
        } = self.rays;
        for placed in &self.tree.placed[leaf.blocks()] {
            let inside = InsideTogether {
                mesh: self.tree.instances[placed.instance as usize].mesh.tree(),
                placed,
                rays,
                sheared,
            };
            // Turned, the rays may enter boxes by different sides.
            if let Some(bundle) = bundle_inside(lanes, &placed.placement, world) {
                let Tree { nodes, root, .. } = inside.mesh;
                search_together(lanes, nodes, root, &bundle, &inside, closest);
                continue;
            }
            let mut waiting = active;
            while waiting != 0 {
                let ray = waiting.trailing_zeros() as usize % (ROWS * WIDTH);
                waiting &= waiting - 1;
                inside.search_alone(lanes, inside.mesh.root, ray, &mut closest[ray / WIDTH]);
            }
        }
    }

    #[inline(always)]
    fn search_alone(&self, lanes: L, node: Child, ray: usize, closest: &mut ClosestRow) {
        let among = Among::new(lanes, self.tree, &self.rays.rays[ray]);
        let mut alone = closest.get(ray % WIDTH, 0);
        search(lanes, &self.tree.nodes, node, &among, &mut alone);
        closest.set(ray % WIDTH, &alone);
    }
}

/// A bundle inside a placed mesh.
struct InsideTogether<'a, const ROWS: usize> {
    mesh: Tree<'a>,
    placed: &'a Placed,
    rays: &'a [Ray],
    sheared: &'a [ShearedRow; ROWS],
}

impl<L: Lanes, const ROWS: usize> MeetTogether<L, ROWS> for InsideTogether<'_, ROWS> {
    #[inline(always)]
    fn fetch(&self, leaf: Child) {
        fetch(self.mesh.blocks, leaf);
    }

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, active: u64, closest: &mut [ClosestRow; ROWS]) {
        let Placed {
            placement, first, ..
        } = self.placed;
        for block in &self.mesh.blocks[leaf.blocks()] {
            // Once for all rays.
            let block = place(lanes, placement, block);
            find_closest(
                lanes,
                &block,
                *first,
                self.rays,
                self.sheared,
                active,
                closest,
            );
        }
    }

    #[inline(always)]
    fn search_alone(&self, lanes: L, node: Child, ray: usize, closest: &mut ClosestRow) {
        let lane = ray % WIDTH;
        let sheared = self.sheared[ray / WIDTH].ray(lane);
        let inside = Inside::new(
            lanes,
            &self.placed.placement,
            &sheared,
            self.mesh.blocks,
            &self.rays[ray],
        );
        let mut alone = closest.get(lane, self.placed.first);
        search(lanes, self.mesh.nodes, node, &inside, &mut alone);
        closest.set(lane, &alone);
    }
}

/// The rays in an object's frame, each to the bit as [`Inside`] has it; `None` if they enter boxes
/// by different sides there.
#[inline(always)]
fn bundle_inside<L: Lanes, const ROWS: usize>(
    lanes: L,
    placement: &Placement,
    world: &[RayRow; ROWS],
) -> Option<Bundle<ROWS>> {
    let first = world[0].direction.map(|row| row[0]);
    let first = placement.direction_to_object(Vec3::from_array(first));
    let mut bundle = Bundle::new(Sides::new(first.to_array()));
    for (i, row) in world.iter().enumerate() {
        let direction = turned(lanes, placement, &load(lanes, &row.direction));
        let from = load(lanes, &row.origin);
        let mut origin = turned(lanes, placement, &from);
        for (origin, row) in origin.iter_mut().zip(&placement.inverse) {
            *origin = lanes.add(*origin, lanes.splat(row[3]));
        }
        let farthest = lanes.max(
            lanes.max(size(lanes, from[0]), size(lanes, from[1])),
            size(lanes, from[2]),
        );
        let pad = lanes.mul(lanes.splat(placement.pad_by_origin), farthest);
        let pad = lanes.add(lanes.splat(placement.pad), pad);
        let fit = bundle.set(lanes, i, &origin, &direction, pad);
        if lanes.bits(fit) != (1 << WIDTH) - 1 {
            return None;
        }
        bundle.rows[i].t_min = row.t_min;
    }
    Some(bundle)
}

/// Directions in the object's frame, rounded as [`Placement::direction_to_object`] rounds them.
#[inline(always)]
fn turned<L: Lanes>(lanes: L, placement: &Placement, d: &[L::Floats; 3]) -> [L::Floats; 3] {
    let mut turned = *d;
    for (turned, row) in turned.iter_mut().zip(&placement.inverse) {
        let x = lanes.mul(lanes.splat(row[0]), d[0]);
        let xy = lanes.add(x, lanes.mul(lanes.splat(row[1]), d[1]));
        *turned = lanes.add(xy, lanes.mul(lanes.splat(row[2]), d[2]));
    }
    turned
}
