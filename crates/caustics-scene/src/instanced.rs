//! Rays against a scene whose objects move.

use crate::intersector::{closest_among, closest_among_all};
use crate::scene::{Instance, MeshId, Scene, SceneError, Shape};
use crate::world::World;
use caustics_accel::{AccelError, BvhInstance, BvhOptions, InstanceBvh, Intersect, TriangleBvh};
use caustics_geometry::{Hit, Ray, Sphere};
use glam::Affine3A;
use std::sync::Arc;

/// Finds what rays hit in a scene whose objects move: a hierarchy for each mesh, and one over the
/// objects, which alone is built anew when they do.
///
/// Hits are those of [`SceneIntersector`](crate::SceneIntersector) over the same [`World`], to the
/// bit, numbers included, so that [`World::surface`] understands them. Rays take a tenth to a fifth
/// longer.
///
/// ```
/// use caustics_scene::{
///     BvhOptions, Instance, InstancedIntersector, Intersect, Material, Scene, Shape, World,
/// };
/// use caustics_geometry::{Ray, shapes};
/// use glam::{Affine3A, Vec3};
///
/// let mut scene = Scene::new();
/// let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
/// let cube = scene.add_mesh(shapes::cuboid([1.0, 1.0, 1.0])?);
/// scene.add_instance(Instance::new("cube", Shape::Mesh(cube), glass))?;
/// let world = World::new(&scene)?;
/// let mut rays = InstancedIntersector::new(&scene, &world, &BvhOptions::default())?;
/// let down = Ray::new([0.125, 5.0, 0.25], [0.0, -1.0, 0.0]);
/// assert_eq!(rays.closest_hit(&down).map(|hit| hit.t), Some(4.5));
///
/// scene.set_transform(0, Affine3A::from_translation(Vec3::Y))?;
/// let world = World::new(&scene)?;
/// rays.follow(&scene, &world)?;
/// assert_eq!(rays.closest_hit(&down).map(|hit| hit.t), Some(3.5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct InstancedIntersector {
    /// By [`MeshId`]; none for a mesh that no object has had yet.
    meshes: Vec<Option<Arc<TriangleBvh>>>,
    triangles: InstanceBvh,
    spheres: Vec<Sphere>,
    first_sphere: u32,
    options: BvhOptions,
}

impl InstancedIntersector {
    /// Builds the hierarchies of all meshes that objects have, and the one over the objects.
    ///
    /// # Errors
    /// [`SceneError::AnotherWorld`] where `world` is not `scene` flattened, and
    /// [`SceneError::Acceleration`] where there are too many triangles, or they are too far away.
    pub fn new(scene: &Scene, world: &World, options: &BvhOptions) -> Result<Self, SceneError> {
        let mut intersector = Self {
            meshes: Vec::new(),
            triangles: InstanceBvh::new(Vec::new(), options.instructions)
                .map_err(|source| unsearchable("", source))?,
            spheres: Vec::new(),
            first_sphere: 0,
            options: *options,
        };
        intersector.follow(scene, world)?;
        Ok(intersector)
    }

    /// Follows the scene: objects may have moved, come or gone. Meshes that an object had before are
    /// not built again.
    ///
    /// It must be the scene that this was made for: meshes are known by their [`MeshId`].
    ///
    /// # Errors
    /// Those of [`new`](Self::new); nothing has changed then.
    pub fn follow(&mut self, scene: &Scene, world: &World) -> Result<(), SceneError> {
        let count = scene.instances().len();
        if count != world.objects().len() {
            return Err(SceneError::AnotherWorld { count });
        }
        let mut instances = Vec::with_capacity(count);
        for (index, instance) in scene.instances().iter().enumerate() {
            if let Shape::Mesh(mesh) = instance.shape {
                instances.push(self.placed(scene, world, index, instance, mesh)?);
            }
        }
        let triangles = InstanceBvh::new(instances, self.options.instructions)
            .map_err(|source| unsearchable("", source))?;
        if triangles.len() != world.triangles().len() {
            return Err(SceneError::AnotherWorld { count });
        }
        self.triangles = triangles;
        self.spheres = world.spheres().to_vec();
        self.first_sphere = world.triangles().len() as u32;
        Ok(())
    }

    /// An object's mesh in its place.
    fn placed(
        &mut self,
        scene: &Scene,
        world: &World,
        index: usize,
        instance: &Instance,
        id: MeshId,
    ) -> Result<BvhInstance, SceneError> {
        let unsearchable = |source| unsearchable(&instance.name, source);
        let mesh = &scene.meshes()[id.index()];
        let range = world.objects()[index].triangles.clone();
        if range.len() != mesh.triangles().len() {
            // Its transform has flattened some triangles, which the world has left out.
            let triangles = &world.triangles()[range.start as usize..range.end as usize];
            let own = TriangleBvh::new(world.positions(), triangles, &self.options);
            return Ok(BvhInstance {
                mesh: Arc::new(own.map_err(unsearchable)?),
                transform: Affine3A::IDENTITY,
            });
        }
        if self.meshes.len() <= id.index() {
            self.meshes.resize(id.index() + 1, None);
        }
        let slot = &mut self.meshes[id.index()];
        let tree = match slot {
            Some(tree) if tree.len() == mesh.triangles().len() => Arc::clone(tree),
            _ => {
                let tree = TriangleBvh::new(mesh.positions(), mesh.triangles(), &self.options);
                Arc::clone(slot.insert(Arc::new(tree.map_err(unsearchable)?)))
            }
        };
        Ok(BvhInstance {
            mesh: tree,
            transform: instance.transform,
        })
    }
}

fn unsearchable(name: &str, source: AccelError) -> SceneError {
    SceneError::Acceleration {
        name: name.to_owned(),
        source,
    }
}

impl Intersect for InstancedIntersector {
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
