//! Rays, triangles, spheres, meshes and their intersections.

mod aabb;
mod barycentric;
mod frame;
mod hit;
mod mesh;
mod normal_derivative;
mod plane;
mod precomputed_triangle;
mod ray;
pub mod shapes;
mod spawn;
mod sphere;
mod triangle;
mod vertex_normals;
mod watertight;

pub use aabb::Aabb;
pub use barycentric::{BarycentricGradient, interpolate};
pub use frame::Frame;
pub use glam;
pub use hit::Hit;
pub use mesh::{MeshError, TriangleMesh};
pub use normal_derivative::NormalGradient;
pub use plane::{Plane, PlaneError};
pub use precomputed_triangle::PrecomputedTriangle;
pub use ray::Ray;
pub use spawn::SpawnPoint;
pub use sphere::{Sphere, SphereError};
pub use triangle::{Triangle, TriangleHit};
pub use watertight::WatertightRay;
