//! The scene flattened to world space, ready for tracing.

use crate::area_light::AreaLight;
use crate::camera::Camera;
use crate::environment::Environment;
use crate::light::Light;
use crate::material::Material;
use crate::scene::{Instance, Scene, SceneError, Shape, place_sphere};
use caustics_geometry::{Aabb, Facet, Sphere, Triangle};
use glam::Vec3;
use std::ops::Range;

/// One object of a [`World`].
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name in the scene.
    pub name: String,
    /// Index into [`World::materials`].
    pub material: u32,
    /// Its triangles, as indices into [`World::triangles`]; primitive numbers are the same.
    pub triangles: Range<u32>,
    /// Its spheres, as indices into [`World::spheres`]; their primitive numbers follow those of all
    /// triangles.
    pub spheres: Range<u32>,
    /// The smallest box around it.
    pub bounds: Aabb,
}

/// A scene flattened to world space: every instance has triangles of its own, and primitives are
/// numbered, first all triangles, then all spheres.
///
/// Triangles of closed solids wind counterclockwise seen from outside, whatever mirroring their
/// instances did.
///
/// ```
/// use caustics_scene::{World, builtin};
///
/// let world = World::new(&builtin::cognac_glass())?;
/// let glass = world.objects().iter().position(|object| object.name == "glass");
/// let glass = glass.expect("the built-in scene has a glass");
/// let first = world.objects()[glass].triangles.start;
/// assert_eq!(world.object_of(first), Some(glass as u32));
/// assert!(world.bounds().diagonal().length() > world.specular_bounds().diagonal().length());
/// # Ok::<(), caustics_scene::SceneError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct World {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// For each triangle, what is the same at each of its points; `None` without area.
    facets: Vec<Option<Facet>>,
    spheres: Vec<Sphere>,
    objects: Vec<Object>,
    /// For each primitive, its object.
    owners: Vec<u32>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    cameras: Vec<Camera>,
    environment: Option<Environment>,
    emitters: Vec<AreaLight>,
    bounds: Aabb,
    specular_bounds: Aabb,
}

impl World {
    /// Flattens a scene. A scene without lights, cameras, or objects makes a world without them.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`] for an instance whose transform makes its vertices overflow, and
    /// [`SceneError::TooMany`] where 32-bit indices do not suffice or memory does not.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let mut world = Self {
            materials: scene.materials().to_vec(),
            lights: scene.lights().to_vec(),
            cameras: scene.cameras().to_vec(),
            environment: scene.environment().cloned(),
            ..Self::default()
        };
        world.reserve(scene)?;
        for instance in scene.instances() {
            world.add(scene, instance)?;
        }
        world.number_primitives();
        world.facets = world.faceted()?;
        Ok(world)
    }

    /// Asks for all memory beforehand, so that a scene of too many instances is an error.
    fn reserve(&mut self, scene: &Scene) -> Result<(), SceneError> {
        let (mut vertices, mut triangles, mut spheres) = (0u64, 0u64, 0u64);
        for instance in scene.instances() {
            match instance.shape {
                Shape::Mesh(mesh) => {
                    let mesh = &scene.meshes()[mesh.index()];
                    vertices += mesh.positions().len() as u64;
                    triangles += mesh.triangles().len() as u64;
                }
                Shape::Sphere { .. } => spheres += 1,
            }
        }
        let limited = |what, count: u64| match u32::try_from(count) {
            // The largest number is left free, for those who mark an absent primitive by it.
            Ok(n) if n < u32::MAX => Ok(n as usize),
            _ => Err(SceneError::TooMany { what, count }),
        };
        let too_many = |what, count| move |_| SceneError::TooMany { what, count };
        let vertex_count = limited("vertices", vertices)?;
        let primitives = limited("primitives", triangles + spheres)?;
        limited("objects", scene.instances().len() as u64)?;
        limited("materials", scene.materials().len() as u64)?;
        self.positions
            .try_reserve_exact(vertex_count)
            .and_then(|()| self.normals.try_reserve_exact(vertex_count))
            .map_err(too_many("vertices", vertices))?;
        self.triangles
            .try_reserve_exact(triangles as usize)
            .and_then(|()| self.owners.try_reserve_exact(primitives))
            .map_err(too_many("primitives", triangles + spheres))
    }

    fn add(&mut self, scene: &Scene, instance: &Instance) -> Result<(), SceneError> {
        let out_of_range = |source| SceneError::OutOfRange {
            name: instance.name.clone(),
            source,
        };
        let first_triangle = self.triangles.len() as u32;
        let first_sphere = self.spheres.len() as u32;
        let bounds = match instance.shape {
            Shape::Mesh(mesh) => {
                let mesh = &scene.meshes()[mesh.index()];
                let placed = mesh
                    .transformed(&instance.transform)
                    .map_err(out_of_range)?;
                let base = self.positions.len() as u32;
                self.positions.extend_from_slice(placed.positions());
                self.normals.extend_from_slice(placed.normals());
                let shifted = placed
                    .triangles()
                    .iter()
                    .map(|t| t.map(|vertex| vertex + base));
                self.triangles.extend(shifted);
                placed.bounds()
            }
            Shape::Sphere { center, radius } => {
                let sphere =
                    place_sphere(center, radius, &instance.transform).map_err(|source| {
                        SceneError::Sphere {
                            name: instance.name.clone(),
                            source,
                        }
                    })?;
                self.spheres.push(sphere);
                sphere.bounds()
            }
        };
        let material = instance.material.index() as u32;
        self.bounds = self.bounds.union(&bounds);
        if self.materials[instance.material.index()]
            .surface
            .is_specular()
        {
            self.specular_bounds = self.specular_bounds.union(&bounds);
        }
        self.objects.push(Object {
            name: instance.name.clone(),
            material,
            triangles: first_triangle..self.triangles.len() as u32,
            spheres: first_sphere..self.spheres.len() as u32,
            bounds,
        });
        Ok(())
    }

    /// Notes which object each primitive belongs to, and which objects are lights.
    fn number_primitives(&mut self) {
        let first_sphere = self.triangles.len() as u32;
        self.owners = vec![0; self.triangles.len() + self.spheres.len()];
        for (index, object) in self.objects.iter().enumerate() {
            let spheres = object.spheres.start + first_sphere..object.spheres.end + first_sphere;
            for primitive in object.triangles.clone().chain(spheres) {
                self.owners[primitive as usize] = index as u32;
            }
        }
        self.emitters = (0..self.objects.len())
            .filter_map(|object| self.area_light(object))
            .collect();
    }

    /// What is the same at each point of a triangle, for all of them.
    fn faceted(&self) -> Result<Vec<Option<Facet>>, SceneError> {
        let mut facets = Vec::new();
        let count = self.triangles.len();
        facets
            .try_reserve_exact(count)
            .map_err(|_| SceneError::TooMany {
                what: "triangles",
                count: count as u64,
            })?;
        facets.extend(self.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|vertex| self.positions[vertex as usize]);
            Facet::new(&Triangle { a, b, c })
        }));
        Ok(facets)
    }

    fn area_light(&self, index: usize) -> Option<AreaLight> {
        let object = &self.objects[index];
        let material = &self.materials[object.material as usize];
        if !material.is_emissive() {
            return None;
        }
        let range = object.triangles.start as usize..object.triangles.end as usize;
        let triangles = self.triangles[range].iter().map(|triangle| {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        });
        let range = object.spheres.start as usize..object.spheres.end as usize;
        let spheres = self.spheres[range]
            .iter()
            .map(|sphere| f64::from(sphere.area()));
        let areas: Vec<f64> = triangles.chain(spheres).collect();
        let first = if object.triangles.is_empty() {
            self.triangles.len() as u32 + object.spheres.start
        } else {
            object.triangles.start
        };
        AreaLight::new(
            index as u32,
            first,
            &areas,
            material.emission,
            material.double_sided,
        )
    }

    /// Vertex positions in metres.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Unit vertex normals, one for each position.
    #[must_use]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Triangles, as indices into [`positions`](Self::positions).
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// What is the same at each point of a triangle; `None` where the primitive is no triangle or has
    /// no area.
    #[inline]
    #[must_use]
    pub fn facet(&self, primitive: u32) -> Option<&Facet> {
        self.facets.get(primitive as usize)?.as_ref()
    }

    /// Exact spheres. The first has the primitive number that follows the last triangle's.
    #[must_use]
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    /// The objects, in the scene's order.
    #[must_use]
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// The object that a primitive belongs to; `None` for a number that no primitive has.
    #[must_use]
    pub fn object_of(&self, primitive: u32) -> Option<u32> {
        self.owners.get(primitive as usize).copied()
    }

    /// The materials, in the scene's order.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The lights that are no objects, in the scene's order.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The objects that emit light, in their own order.
    #[must_use]
    pub fn emitters(&self) -> &[AreaLight] {
        &self.emitters
    }

    /// Whether there is any light at all, of any kind.
    #[must_use]
    pub fn is_lit(&self) -> bool {
        !self.lights.is_empty() || !self.emitters.is_empty() || self.environment.is_some()
    }

    /// The light from all around, if there is any.
    #[must_use]
    pub fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// The cameras, in the scene's order.
    #[must_use]
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// The smallest box around all objects; empty where there are none.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The smallest box around all objects that can throw caustics: dielectrics and metals.
    #[must_use]
    pub fn specular_bounds(&self) -> Aabb {
        self.specular_bounds
    }
}
