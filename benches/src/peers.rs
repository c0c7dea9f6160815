//! Other libraries, asked for the parameter of the closest hit.

use std::time::Duration;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use caustics_geometry::{PrecomputedTriangle, Ray, Triangle};
use glam::{Vec3, Vec3A};
use nalgebra::{Point3, Vector3};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::rt_triangle::RtTriangle;
use obvhs::{BvhBuildParams, ray::RayHit};
use parry3d::query::RayCast;
use parry3d::shape::TriMesh;

use crate::meshes::Mesh;

fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    mesh.triangles
        .iter()
        .map(|t| t.map(|vertex| mesh.positions[vertex as usize]))
}

/// obvhs used bare: its binary tree over its own precomputed triangles.
pub struct Obvhs {
    tree: Bvh2,
    triangles: Vec<RtTriangle>,
}

impl Obvhs {
    /// Builds the tree of the preset `fast`.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        Self::with_parameters(mesh, BvhBuildParams::fast_build())
    }

    /// Builds the tree of some preset.
    #[must_use]
    pub fn with_parameters(mesh: &Mesh, parameters: BvhBuildParams) -> Self {
        let triangles: Vec<_> = corners(mesh)
            .map(|[a, b, c]| obvhs::triangle::Triangle {
                v0: a.into(),
                v1: b.into(),
                v2: c.into(),
            })
            .collect();
        let tree = build_bvh2_from_tris(&triangles, parameters, &mut Duration::default());
        let ordered = tree.primitive_indices.iter();
        let triangles = ordered
            .map(|&i| RtTriangle::from(&triangles[i as usize]))
            .collect();
        Self { tree, triangles }
    }

    /// Parameter of the closest hit.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let ray = obvhs::ray::Ray::new(
            Vec3A::from(ray.origin),
            Vec3A::from(ray.direction),
            ray.t_min,
            ray.t_max,
        );
        let mut hit = RayHit::none();
        let found = self
            .tree
            .ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray));
        found.then_some(hit.t)
    }

    /// Whether anything is hit.
    #[must_use]
    pub fn is_occluded(&self, ray: &Ray) -> bool {
        let ray = obvhs::ray::Ray::new(
            Vec3A::from(ray.origin),
            Vec3A::from(ray.direction),
            ray.t_min,
            ray.t_max,
        );
        // It says whether the ray missed.
        !self
            .tree
            .ray_traverse_miss(ray, |ray, id| self.triangles[id].intersect(ray))
    }

    /// Puts the nodes into the order that refitting is fastest in.
    pub fn order_nodes(&mut self) {
        self.tree.reorder_in_stack_traversal_order();
    }

    /// Follows a mesh that deforms, leaves and precomputed triangles included.
    pub fn refit(&mut self, mesh: &Mesh) {
        let corners_of = |i: u32| {
            let [a, b, c] = mesh.triangles[i as usize].map(|v| mesh.positions[v as usize]);
            obvhs::triangle::Triangle {
                v0: a.into(),
                v1: b.into(),
                v2: c.into(),
            }
        };
        for (triangle, &i) in self.triangles.iter_mut().zip(&self.tree.primitive_indices) {
            *triangle = RtTriangle::from(&corners_of(i));
        }
        for node in &mut self.tree.nodes {
            if node.is_leaf() {
                let first = node.first_index as usize;
                let mut bounds = obvhs::aabb::Aabb::empty();
                for &i in &self.tree.primitive_indices[first..first + node.prim_count as usize] {
                    bounds = bounds.union(&obvhs::Boundable::aabb(&corners_of(i)));
                }
                node.set_aabb(bounds);
            }
        }
        self.tree.refit_all();
    }
}

/// parry3d's triangle mesh.
pub struct Parry(TriMesh);

impl Parry {
    /// Builds the mesh.
    ///
    /// # Panics
    /// If the mesh has no triangles.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let vector = |p: &Vec3| parry3d::math::Vector::new(p.x, p.y, p.z);
        let positions = mesh.positions.iter().map(vector).collect();
        Self(TriMesh::new(positions, mesh.triangles.clone()).expect("a mesh with triangles"))
    }

    /// Parameter of the closest hit.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let vector = |p: Vec3| parry3d::math::Vector::new(p.x, p.y, p.z);
        let query = parry3d::query::Ray::new(vector(ray.origin), vector(ray.direction));
        self.0.cast_local_ray(&query, ray.t_max, false)
    }
}

/// The crate `bvh`, its nearest-first iterator stopped as early as it allows.
pub struct BvhCrate {
    tree: Bvh<f32, 3>,
    shapes: Vec<Shape>,
}

struct Shape {
    bounds: caustics_geometry::Aabb,
    triangle: PrecomputedTriangle,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        let point = |p: Vec3| Point3::new(p.x, p.y, p.z);
        Aabb::with_bounds(point(self.bounds.min), point(self.bounds.max))
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl BvhCrate {
    /// Builds the tree.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let mut shapes: Vec<Shape> = corners(mesh)
            .map(|[a, b, c]| {
                let triangle = Triangle::new(a, b, c);
                let bounds = triangle.bounds();
                Shape {
                    bounds,
                    triangle: PrecomputedTriangle::new(&triangle),
                    node: 0,
                }
            })
            .collect();
        let tree = Bvh::build(&mut shapes);
        Self { tree, shapes }
    }

    /// Parameter of the closest hit.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let [x, y, z] = ray.origin.to_array();
        let [dx, dy, dz] = ray.direction.to_array();
        let query = bvh::ray::Ray::new(Point3::new(x, y, z), Vector3::new(dx, dy, dz));
        let mut nearest = Ray { ..*ray };
        for shape in self.tree.nearest_traverse_iterator(&query, &self.shapes) {
            if shape.bounds.intersect(&nearest).is_none() {
                // Boxes come nearest first: what follows lies behind the hit.
                if nearest.t_max < ray.t_max {
                    break;
                }
                continue;
            }
            if let Some(hit) = shape.triangle.intersect(&nearest) {
                nearest.t_max = hit.t;
            }
        }
        (nearest.t_max < ray.t_max).then_some(nearest.t_max)
    }
}
