//! Rays, the shapes that they meet, and how to leave a surface again: the ground on which the
//! tracing of caustics stands.
//!
//! A caustic is light that was bent by glass or thrown by a mirror, so two things matter here
//! more than elsewhere in rendering. Nothing may leak: a photon that slips between two triangles
//! of a closed glass is lost in it. And offsets must be small: the walls of a glass are thin, and
//! a fixed epsilon either jumps through them or meets the same wall twice. [`WatertightRay`] sees
//! to the first, [`SpawnPoint`] to the second.
//!
//! ```
//! use caustics_geometry::glam::Vec3;
//! use caustics_geometry::{NormalGradient, Ray, SpawnPoint, WatertightRay, shapes};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let ball = shapes::icosphere(0.05, 4)?;
//! assert!(ball.is_closed() && ball.signed_volume() > 0.0);
//!
//! // The nearest triangle under a ray, by trying them all.
//! let ray = Ray::new([0.01, 1.0, 0.02], [0.0, -1.0, 0.0]);
//! let prepared = WatertightRay::new(&ray);
//! let mut nearest = None;
//! for index in 0..ball.triangles().len() {
//!     let Some(triangle) = ball.triangle(index) else { continue };
//!     let t_max = nearest.map_or(ray.t_max, |(_, _, t)| t);
//!     if let Some(hit) = prepared.intersect(triangle.a, triangle.b, triangle.c, t_max) {
//!         nearest = Some((index, hit, hit.t));
//!     }
//! }
//! let (index, hit, _) = nearest.ok_or("the ray goes through the ball")?;
//! assert!((hit.t - 0.955).abs() < 0.001);
//!
//! // The normal there, and how it turns: on a sphere of 5 cm, by 1 radian in 5 cm.
//! let triangle = ball.triangle(index).ok_or("a triangle of the ball")?;
//! let normals = ball.triangles()[index].map(|vertex| ball.normals()[vertex as usize]);
//! let gradient = NormalGradient::on_triangle(&triangle, normals, hit.u, hit.v).ok_or("flat")?;
//! let turn = gradient.along(Vec3::new(0.001, 0.0, 0.0));
//! assert!((turn.x - 0.001 / 0.05).abs() < 0.001);
//!
//! // Onwards through the ball: the same triangle is not in the way.
//! let point = SpawnPoint::on_triangle(triangle.a, triangle.b, triangle.c, hit.u, hit.v);
//! let face = triangle.unit_normal().ok_or("a triangle with an area")?;
//! let inside = WatertightRay::new(&point.ray_towards(face, ray.direction));
//! assert_eq!(inside.intersect(triangle.a, triangle.b, triangle.c, f32::INFINITY), None);
//! # Ok(())
//! # }
//! ```
//!
//! # What is where
//!
//! | to | take | from |
//! | --- | --- | --- |
//! | shoot a ray, and say where it hit | [`Ray`], [`Hit`], [`TriangleHit`] | |
//! | test many triangles without leaks | [`WatertightRay`] | Woop, Benthin, Wald 2013 |
//! | test one triangle fast, where leaks do not matter | [`PrecomputedTriangle`] | Möller, Trumbore 1997 |
//! | test a sphere, from outside or inside | [`Sphere`] | Haines, Günther, Akenine-Möller 2019 |
//! | test a plane or a box | [`Plane`], [`Aabb`] | Ize 2013 |
//! | leave a surface, or look from one to another | [`SpawnPoint`] | Pharr, Jakob, Humphreys 2023, 6.8 |
//! | hold triangles with normals, validated | [`TriangleMesh`], [`Triangle`] | Thürmer, Wüthrich 1998 |
//! | make a mesh | [`shapes`] | |
//! | interpolate over a triangle | [`interpolate`], [`BarycentricGradient`] | |
//! | know how the normal turns, for ray differentials | [`NormalGradient`] | Igehy 1999 |
//! | have axes around a normal | [`Frame`] | Duff et al. 2017 |
//!
//! For a tree over many triangles see the crate `caustics-accel`, for materials and lights
//! `caustics-scene`.
//!
//! # Conventions
//!
//! Coordinates are right-handed with +Y up, lengths are metres. Triangles wind counterclockwise
//! as seen from the front, and the front of a solid is its outside. Barycentric weights `u` and
//! `v` belong to the second and the third vertex. All intersections are two-sided and lie
//! strictly between the limits of the ray.
//!
//! # Accuracy
//!
//! Everything is f32 at its surface. Where f32 was measured not to be enough, f64 works inside:
//! in the sphere test (a difference to a far center is rounded by more than a small radius), and
//! in the watertight test for the rare triangle whose edge functions all vanish. Each
//! intersection is tested against an f64 solution, at sizes from 10⁻⁴ to 10⁴ and up to 10⁴ from
//! the origin, within error bounds that follow from the input. No input panics.

mod aabb;
mod barycentric;
mod facet;
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
mod unit_vector;
mod vertex_normals;
mod watertight;

pub use aabb::Aabb;
pub use barycentric::{BarycentricGradient, interpolate};
pub use facet::Facet;
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
