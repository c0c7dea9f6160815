//! Rays, triangles, spheres, meshes and their intersections.

mod aabb;
mod barycentric;
mod hit;
mod mesh;
mod precomputed_triangle;
mod ray;
mod spawn;
mod sphere;
mod triangle;
mod vertex_normals;
mod watertight;

pub use aabb::Aabb;
pub use barycentric::{BarycentricGradient, interpolate};
pub use glam;
pub use hit::Hit;
pub use mesh::{MeshError, TriangleMesh};
pub use precomputed_triangle::PrecomputedTriangle;
pub use ray::Ray;
pub use spawn::SpawnPoint;
pub use sphere::{Sphere, SphereError};
pub use triangle::{Triangle, TriangleHit};
pub use watertight::WatertightRay;
