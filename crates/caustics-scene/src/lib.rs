//! Materials, lights, cameras and scenes for caustic rendering, and their loading from glTF.
//!
//! A [`Scene`] is what a host or a file describes: meshes, materials, instances that combine them,
//! lights and cameras, all checked on the way in. A [`World`] is the same, flattened for tracing: it
//! numbers primitives, finds hits, and says what a ray finds there.
//!
//! ```
//! use caustics_scene::{BvhOptions, Instance, Intersect, Light, Material, Scene, Shape, World};
//! use caustics_geometry::{Ray, shapes};
//! use glam::{Affine3A, Vec3};
//!
//! let mut scene = Scene::new();
//! let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
//! let cube = scene.add_mesh(shapes::cuboid([1.0, 1.0, 1.0])?);
//! let place = Affine3A::from_translation(Vec3::new(0.0, 2.0, 0.0));
//! scene.add_instance(Instance::new("cube", Shape::Mesh(cube), glass).with_transform(place))?;
//! scene.add_light(Light::point([0.0, 5.0, 0.0], [10.0; 3])?)?;
//!
//! let world = World::new(&scene)?;
//! let rays = world.intersector(&BvhOptions::default())?;
//! let down = Ray::new([0.1, 5.0, 0.2], [0.0, -1.0, 0.0]);
//! let hit = rays.closest_hit(&down).expect("the cube is below the light");
//! let point = world.surface(&down, &hit).expect("the hit is the world's");
//! assert!(point.from_outside);
//! assert!(point.spawn.position.abs_diff_eq(Vec3::new(0.1, 2.5, 0.2), 1e-6));
//! assert_eq!(world.objects()[point.object as usize].name, "cube");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Start with [`builtin::cognac_glass`] for a scene without a file, and with `gltf::load_path` for
//! one with.
//!
//! # Modules
//! | module | what |
//! | --- | --- |
//! | [`builtin`] | scenes made by code |
//! | `gltf` (feature `gltf`) | loading `.glb` and `.gltf`, what becomes of materials, and what is reported as not modelled |
//!
//! | type | what |
//! | --- | --- |
//! | [`Material`], [`Surface`] | how surfaces scatter, absorb and emit light |
//! | [`Brdf`] | how receivers reflect: Lambertian, or glTF's metallic-roughness model |
//! | [`Light`], [`LightPoint`] | point, spot and directional lights; rectangles, triangles, discs and balls that shine |
//! | [`Environment`], [`EnvironmentRow`], [`EnvironmentTexel`] | light from all around, and how it is sampled |
//! | [`Camera`], [`Projection`] | pixels to rays and back |
//! | [`Scene`], [`Instance`], [`Shape`] | what is where |
//! | [`World`], [`Object`] | the scene flattened |
//! | [`SurfacePoint`] | what a ray finds |
//! | [`AreaLight`] | an emissive object of a world |
//! | [`SceneIntersector`] | rays against a world |
//!
//! # Conventions
//! Right-handed, +Y up, metres; cameras look along their -Z axis. Linear RGB. Flux in W, radiant
//! intensity in W/sr, irradiance in W/m^2, radiance in W/(sr m^2). Closed bodies wind
//! counterclockwise seen from outside, and their inside is what the geometric normal points away
//! from; directions and Fresnel terms go by interpolated vertex normals. Where closed dielectrics
//! overlap, the one of the higher priority is there.
//!
//! # Sources
//! Nested bodies by priority: Schmidt and Budge, "Simple nested dielectrics in ray traced images",
//! 2002. Spot falloff: `KHR_lights_punctual`. Absorption: Beer and Lambert's law as in
//! `KHR_materials_volume`. Change of interpolated normals: Igehy, "Tracing ray differentials", 1999.
//! Glossy reflection: glTF 2.0, appendix B; Walter et al., "Microfacet models for refraction through
//! rough surfaces", 2007; Heitz, "Understanding the masking-shadowing function in microfacet-based
//! BRDFs", 2014; Ashikhmin and Shirley, "An anisotropic Phong BRDF model", 2000.
//! Splines of the built-in glass: Farin, "Curves and surfaces for CAGD", chapter 9.
//!
//! # Limits
//! No textures, rough glass, skins or animations; rough metal receives caustics and throws none; `World` copies the triangles of every
//! instance. Spheres are tested one by one, and meant for few.
//!
//! # Features
//! `gltf` (default): the module of that name. `parallel` (default): builds triangle hierarchies on
//! several threads.

mod area_light;
mod brdf;
pub mod builtin;
mod camera;
mod environment;
mod environment_parts;
#[cfg(feature = "gltf")]
pub mod gltf;
mod instanced;
mod intersector;
mod light;
mod light_check;
mod light_point;
mod material;
mod point_on;
mod scene;
mod surface_point;
mod world;

pub use area_light::AreaLight;
pub use brdf::Brdf;
pub use camera::{Camera, CameraError, Projection};
pub use caustics_accel::{AccelError, BvhOptions, Intersect};
pub use environment::{Environment, EnvironmentError, EnvironmentSample};
pub use environment_parts::{EnvironmentRow, EnvironmentTexel};
pub use instanced::InstancedIntersector;
pub use intersector::SceneIntersector;
pub use light::Light;
pub use light_check::LightError;
pub use light_point::LightPoint;
pub use material::{MAX_ATTENUATION, Material, MaterialError, Surface};
pub use scene::{Instance, MaterialId, MeshId, Scene, SceneError, Shape};
pub use surface_point::SurfacePoint;
pub use world::{Object, World};
