use caustics_accel::{AccelError, BvhOptions, Intersect, TriangleBvh};
use caustics_geometry::{Hit, Ray, Sphere};

use crate::World;

/// What rays of a [`World`] are shot at: a tree over its triangles, and its spheres.
///
/// Spheres are tested one by one, after the triangles: they are meant for a handful of exact
/// lenses, not for thousands of balls.
#[derive(Clone, Debug)]
pub struct SceneIntersector {
    triangles: TriangleBvh,
    spheres: Vec<Sphere>,
    first_sphere: u32,
}

impl SceneIntersector {
    /// Builds the tree over a world's triangles.
    ///
    /// # Errors
    /// A vertex too far away for the tree, or more triangles than it takes.
    pub fn new(world: &World, options: &BvhOptions) -> Result<Self, AccelError> {
        Ok(Self {
            triangles: TriangleBvh::new(world.positions(), world.triangles(), options)?,
            spheres: world.spheres().to_vec(),
            first_sphere: world.triangles().len() as u32,
        })
    }

    /// The tree over the triangles.
    #[must_use]
    pub fn triangles(&self) -> &TriangleBvh {
        &self.triangles
    }
}

impl Intersect for SceneIntersector {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = self.triangles.closest_hit(ray);
        let mut rest = *ray;
        for (primitive, sphere) in (self.first_sphere..).zip(&self.spheres) {
            rest.t_max = nearest.map_or(ray.t_max, |hit| hit.t);
            if let Some(t) = sphere.intersect(&rest) {
                nearest = Some(Hit { t, u: 0.0, v: 0.0, primitive });
            }
        }
        nearest
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        self.triangles.is_occluded(ray)
            || self.spheres.iter().any(|sphere| sphere.intersect(ray).is_some())
    }
}
