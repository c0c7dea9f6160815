//! Rays against everything in a world.

use crate::world::World;
use caustics_accel::{AccelError, BvhOptions, Intersect, TriangleBvh};
use caustics_geometry::{Hit, Ray, Sphere};

/// Finds what rays hit in a [`World`]: its triangles by a bounding volume hierarchy, its spheres one
/// by one. Hits carry the world's primitive numbers.
///
/// ```
/// use caustics_scene::{BvhOptions, Instance, Intersect, Material, Scene, Shape, World};
/// use caustics_geometry::Ray;
/// use glam::Vec3;
///
/// let mut scene = Scene::new();
/// let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
/// let ball = Shape::Sphere { center: Vec3::ZERO, radius: 1.0 };
/// scene.add_instance(Instance::new("ball", ball, glass))?;
/// let world = World::new(&scene)?;
/// let intersector = world.intersector(&BvhOptions::default())?;
///
/// let ray = Ray::new([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]);
/// let hit = intersector.closest_hit(&ray).expect("the ball is ahead");
/// let point = world.surface(&ray, &hit).expect("the hit is the world's");
/// assert_eq!((hit.t, point.shading_normal), (4.0, Vec3::Z));
/// assert!(point.from_outside);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneIntersector {
    triangles: TriangleBvh,
    spheres: Vec<Sphere>,
    first_sphere: u32,
}

impl World {
    /// Builds what finds the hits of rays. It does not refer to the world afterwards.
    ///
    /// # Errors
    /// Where a triangle hierarchy cannot be built: there are too many triangles, or they are too far
    /// away.
    pub fn intersector(&self, options: &BvhOptions) -> Result<SceneIntersector, AccelError> {
        Ok(SceneIntersector {
            triangles: TriangleBvh::new(self.positions(), self.triangles(), options)?,
            spheres: self.spheres().to_vec(),
            first_sphere: self.triangles().len() as u32,
        })
    }
}

impl Intersect for SceneIntersector {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let closest = self.triangles.closest_hit(ray);
        closest_among(&self.spheres, self.first_sphere, ray, closest)
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.triangles.closest_hits(rays, hits);
        closest_among_all(&self.spheres, self.first_sphere, rays, hits);
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        self.triangles.is_occluded(ray)
            || self
                .spheres
                .iter()
                .any(|sphere| sphere.intersect(ray).is_some())
    }
}

/// The same as [`closest_among`], for many rays.
pub(crate) fn closest_among_all(
    spheres: &[Sphere],
    first: u32,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    if spheres.is_empty() {
        return;
    }
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = closest_among(spheres, first, ray, *hit);
    }
}

/// The closest of a triangle's hit and those of spheres, which are numbered from `first` on.
pub(crate) fn closest_among(
    spheres: &[Sphere],
    first: u32,
    ray: &Ray,
    mut closest: Option<Hit>,
) -> Option<Hit> {
    let mut ray = *ray;
    if let Some(hit) = closest {
        ray.t_max = hit.t;
    }
    for (primitive, sphere) in (first..).zip(spheres) {
        if let Some(t) = sphere.intersect(&ray) {
            ray.t_max = t;
            closest = Some(Hit {
                t,
                u: 0.0,
                v: 0.0,
                primitive,
            });
        }
    }
    closest
}
