//! Materials, lights, cameras and scenes.

mod area_light;
pub mod builtin;
mod camera;
#[cfg(feature = "gltf")]
pub mod gltf;
mod intersector;
mod light;
mod material;
mod point_on;
mod scene;
mod surface_point;
mod world;

pub use area_light::AreaLight;
pub use camera::{Camera, CameraError, Projection};
pub use caustics_accel::{AccelError, BvhOptions, Intersect};
pub use intersector::SceneIntersector;
pub use light::{Light, LightError};
pub use material::{MAX_ATTENUATION, Material, MaterialError, Surface};
pub use scene::{Instance, MaterialId, MeshId, Scene, SceneError, Shape};
pub use surface_point::SurfacePoint;
pub use world::{Object, World};
