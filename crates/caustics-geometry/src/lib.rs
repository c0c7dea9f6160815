//! Rays, triangles, spheres, meshes and their intersections.

mod hit;
mod ray;

pub use glam;
pub use hit::Hit;
pub use ray::Ray;
