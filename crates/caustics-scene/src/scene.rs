//! What there is: meshes, materials, objects that combine them, lights and cameras.

use crate::camera::{Camera, CameraError};
use crate::environment::Environment;
use crate::light::Light;
use crate::light_check::LightError;
use crate::material::{Material, MaterialError};
use caustics_geometry::{MeshError, Sphere, SphereError, TriangleMesh};
use glam::{Affine3A, Mat3A, Vec3};
use thiserror::Error;

/// Names a mesh of the scene that handed it out.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub struct MeshId(pub(crate) usize);

impl MeshId {
    /// Position in [`Scene::meshes`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0
    }
}

/// Names a material of the scene that handed it out.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub struct MaterialId(pub(crate) usize);

impl MaterialId {
    /// Position in [`Scene::materials`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0
    }
}

/// The shape of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A mesh of the scene.
    Mesh(MeshId),
    /// An exact sphere, its normals pointing outward.
    Sphere {
        /// Its centre in the object's own frame, in metres.
        center: Vec3,
        /// Its radius in the object's own frame, in metres; above 0.
        radius: f32,
    },
}

/// An object: a shape in its place, with its material.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// A name for messages; need not be unique.
    pub name: String,
    /// What it looks like.
    pub shape: Shape,
    /// World from object. Not singular; for a sphere, no scale that would make an ellipsoid.
    /// A mirroring transform leaves outside what was outside.
    pub transform: Affine3A,
    /// What it is made of.
    pub material: MaterialId,
}

impl Instance {
    /// An object whose own frame is the world's.
    #[must_use]
    pub fn new(name: impl Into<String>, shape: Shape, material: MaterialId) -> Self {
        Self {
            name: name.into(),
            shape,
            transform: Affine3A::IDENTITY,
            material,
        }
    }

    /// The same object elsewhere.
    #[must_use]
    pub fn with_transform(mut self, transform: Affine3A) -> Self {
        self.transform = transform;
        self
    }
}

/// Everything that a picture is made from, as a host or a file describes it. [`World`] is the same,
/// flattened for tracing.
///
/// What enters is checked, so that a scene holds only finite numbers in their ranges, and refers
/// only to what it has.
///
/// [`World`]: crate::World
#[derive(Clone, Debug, Default)]
pub struct Scene {
    meshes: Vec<TriangleMesh>,
    materials: Vec<Material>,
    instances: Vec<Instance>,
    lights: Vec<Light>,
    cameras: Vec<Camera>,
    environment: Option<Environment>,
}

impl Scene {
    /// A scene with nothing in it.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mesh, to be placed by any number of instances.
    pub fn add_mesh(&mut self, mesh: TriangleMesh) -> MeshId {
        self.meshes.push(mesh);
        MeshId(self.meshes.len() - 1)
    }

    /// Adds a material, to be used by any number of instances.
    ///
    /// # Errors
    /// [`SceneError::Material`] where [`Material::validate`] has something to say.
    pub fn add_material(&mut self, material: Material) -> Result<MaterialId, SceneError> {
        if let Err(source) = material.validate() {
            return Err(SceneError::Material {
                name: material.name,
                source,
            });
        }
        self.materials.push(material);
        Ok(MaterialId(self.materials.len() - 1))
    }

    /// Adds an object.
    ///
    /// # Errors
    /// Its mesh or material is not of this scene, its transform is singular or not finite, or it is
    /// a sphere without a radius or with a transform that would make it an ellipsoid.
    pub fn add_instance(&mut self, instance: Instance) -> Result<(), SceneError> {
        self.check(&instance)?;
        self.instances.push(instance);
        Ok(())
    }

    /// Moves an object, given by its position in [`instances`](Self::instances).
    ///
    /// # Errors
    /// There is no such object, or it could not have been added with this transform; it is then
    /// where it was.
    pub fn set_transform(&mut self, index: usize, transform: Affine3A) -> Result<(), SceneError> {
        let Some(instance) = self.instances.get(index) else {
            let count = self.instances.len();
            return Err(SceneError::UnknownInstance { index, count });
        };
        let moved = instance.clone().with_transform(transform);
        self.check(&moved)?;
        self.instances[index] = moved;
        Ok(())
    }

    fn check(&self, instance: &Instance) -> Result<(), SceneError> {
        let name = || instance.name.clone();
        if instance.material.0 >= self.materials.len() {
            return Err(SceneError::UnknownMaterial { name: name() });
        }
        if !is_invertible(&instance.transform) {
            return Err(SceneError::Transform { name: name() });
        }
        match instance.shape {
            Shape::Mesh(mesh) if mesh.0 >= self.meshes.len() => {
                return Err(SceneError::UnknownMesh { name: name() });
            }
            Shape::Mesh(_) => {}
            Shape::Sphere { center, radius } => {
                if let Err(source) = place_sphere(center, radius, &instance.transform) {
                    return Err(SceneError::Sphere {
                        name: name(),
                        source,
                    });
                }
                if !scales_uniformly(&instance.transform) {
                    return Err(SceneError::Ellipsoid { name: name() });
                }
            }
        }
        Ok(())
    }

    /// Adds a light.
    ///
    /// # Errors
    /// [`SceneError::Light`] where [`Light::validate`] has something to say.
    pub fn add_light(&mut self, light: Light) -> Result<(), SceneError> {
        light.validate().map_err(|source| SceneError::Light {
            light: self.lights.len(),
            source,
        })?;
        self.lights.push(light);
        Ok(())
    }

    /// Adds a camera.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where [`Camera::validate`] has something to say.
    pub fn add_camera(&mut self, camera: Camera) -> Result<(), SceneError> {
        if let Err(source) = camera.validate() {
            return Err(SceneError::Camera {
                name: camera.name,
                source,
            });
        }
        self.cameras.push(camera);
        Ok(())
    }

    /// Surrounds the scene with light, or with none.
    pub fn set_environment(&mut self, environment: Option<Environment>) {
        self.environment = environment;
    }

    /// The light from all around, if there is any.
    #[must_use]
    pub fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// The meshes, in the order in which they were added.
    #[must_use]
    pub fn meshes(&self) -> &[TriangleMesh] {
        &self.meshes
    }

    /// The materials, in the order in which they were added.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The objects, in the order in which they were added.
    #[must_use]
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The lights that are no objects, in the order in which they were added.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The cameras, in the order in which they were added.
    #[must_use]
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// Number of triangles of all instances together.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.instances
            .iter()
            .map(|instance| match instance.shape {
                Shape::Mesh(mesh) => self.meshes[mesh.0].triangles().len() as u64,
                Shape::Sphere { .. } => 0,
            })
            .sum()
    }
}

/// Whether a transform is finite and keeps volumes from vanishing.
pub(crate) fn is_invertible(transform: &Affine3A) -> bool {
    let m = transform.matrix3;
    // The determinant of a matrix of tiny numbers underflows: scaled first.
    let largest = m
        .x_axis
        .abs()
        .max(m.y_axis.abs())
        .max(m.z_axis.abs())
        .max_element();
    let scaled = m * largest.recip();
    let determinant = scaled.determinant();
    transform.is_finite() && determinant.is_finite() && determinant != 0.0
}

/// Whether a transform scales all lengths by the same factor.
fn scales_uniformly(transform: &Affine3A) -> bool {
    let unscaled = transform.matrix3 * transform.matrix3.x_axis.length().recip();
    (unscaled.transpose() * unscaled).abs_diff_eq(Mat3A::IDENTITY, 1e-4)
}

/// A sphere in its place, given that its transform scales alike in all directions.
pub(crate) fn place_sphere(
    center: Vec3,
    radius: f32,
    transform: &Affine3A,
) -> Result<Sphere, SphereError> {
    Sphere::new(center, radius)?;
    Sphere::new(
        transform.transform_point3(center),
        radius * transform.matrix3.x_axis.length(),
    )
}

/// A scene that cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// A material with a value out of range.
    #[error("material {name:?}: {source}")]
    Material {
        /// The material's name.
        name: String,
        /// Which value.
        source: MaterialError,
    },
    /// A light with a value out of range.
    #[error("light {light}: {source}")]
    Light {
        /// The number that the light would have had in the scene.
        light: usize,
        /// Which value.
        source: LightError,
    },
    /// A camera with a value out of range.
    #[error("camera {name:?}: {source}")]
    Camera {
        /// The camera's name.
        name: String,
        /// Which value.
        source: CameraError,
    },
    /// An object of a mesh that the scene does not have.
    #[error("object {name:?} is of a mesh that the scene does not have")]
    UnknownMesh {
        /// The object's name.
        name: String,
    },
    /// An object of a material that the scene does not have.
    #[error("object {name:?} is of a material that the scene does not have")]
    UnknownMaterial {
        /// The object's name.
        name: String,
    },
    /// A transform that is not finite, or flattens what it is applied to.
    #[error("object {name:?} has a transform that is singular or not finite")]
    Transform {
        /// The object's name.
        name: String,
    },
    /// A sphere without a positive, finite radius or a finite centre, be it in its own frame or in
    /// the world.
    #[error("object {name:?}: {source}")]
    Sphere {
        /// The object's name.
        name: String,
        /// What is wrong with it.
        source: SphereError,
    },
    /// A sphere with a transform that would make it an ellipsoid.
    #[error("object {name:?} is a sphere, but its transform would make it an ellipsoid")]
    Ellipsoid {
        /// The object's name.
        name: String,
    },
    /// An object that the scene does not have.
    #[error("there is no object {index}, but only {count}")]
    UnknownInstance {
        /// The position given.
        index: usize,
        /// How many objects there are.
        count: usize,
    },
    /// A world that was flattened from another scene, or before this one changed.
    #[error("the world does not have the scene's {count} objects in their places")]
    AnotherWorld {
        /// How many objects the scene has.
        count: usize,
    },
    /// A mesh or an object that cannot be searched by rays.
    #[error("object {name:?}: {source}")]
    Acceleration {
        /// The object's name; empty where all objects together are too many.
        name: String,
        /// Why not.
        source: caustics_accel::AccelError,
    },
    /// An object that is not finite once in its place.
    #[error("object {name:?} is too large or too far away: {source}")]
    OutOfRange {
        /// The object's name.
        name: String,
        /// What the mesh became.
        source: MeshError,
    },
    /// More primitives, vertices, objects, or materials than 32-bit indices can name, or than there
    /// is memory for.
    #[error("{count} {what} are more than can be held")]
    TooMany {
        /// Of what there are too many.
        what: &'static str,
        /// How many there would be.
        count: u64,
    },
}
