//! Rays as photons take them: in step from a light, and scattered after a bounce.

use caustics_accel::{Intersect, TriangleBvh};
use caustics_geometry::{Ray, SpawnPoint};
use glam::Vec3;

use crate::meshes::Mesh;
use crate::random::Random;

/// Even bits of a number.
fn compact(mut bits: u32) -> u32 {
    bits &= 0x5555_5555;
    bits = (bits | bits >> 1) & 0x3333_3333;
    bits = (bits | bits >> 2) & 0x0f0f_0f0f;
    bits = (bits | bits >> 4) & 0x00ff_00ff;
    (bits | bits >> 8) & 0x0000_ffff
}

/// Photons from a point light: one from each cell of a `2^log2_side` square grid over the cone
/// around the mesh, in Morton order.
#[must_use]
pub fn coherent(mesh: &Mesh, log2_side: u32) -> Vec<Ray> {
    let (centre, radius) = mesh.bounding_sphere();
    let towards = Vec3::new(-0.4, -1.0, -0.3).normalize();
    let distance = 3.0 * radius;
    let light = centre - towards * distance;
    let cos_cone = (1.0 - (radius / distance).powi(2)).sqrt();
    let (right, up) = towards.any_orthonormal_pair();
    let side = (1_u32 << log2_side) as f32;
    let mut random = Random::new(1);
    (0..1_u32 << (2 * log2_side))
        .map(|cell| {
            let u = (compact(cell) as f32 + random.uniform()) / side;
            let v = (compact(cell >> 1) as f32 + random.uniform()) / side;
            // Concentric map of the square to the disc, so that cells stay near each other.
            let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let (r, phi) = if a.abs() > b.abs() {
                (a, std::f32::consts::FRAC_PI_4 * b / a)
            } else {
                (
                    b,
                    std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * a / b,
                )
            };
            let cos = 1.0 - r * r * (1.0 - cos_cone);
            let sin = r.signum() * (1.0 - cos * cos).max(0.0).sqrt();
            let direction = (right * phi.cos() + up * phi.sin()) * sin + towards * cos;
            Ray::new(light, direction.normalize())
        })
        .collect()
}

/// Rays in random directions from where `primary` rays hit, in random order, as many as those.
#[must_use]
pub fn incoherent(mesh: &Mesh, bvh: &TriangleBvh, primary: &[Ray]) -> Vec<Ray> {
    let mut random = Random::new(2);
    let hits: Vec<_> = primary
        .iter()
        .filter_map(|ray| bvh.closest_hit(ray))
        .collect();
    let mut rays: Vec<Ray> = hits
        .iter()
        .cycle()
        .take(primary.len())
        .map(|hit| {
            let [a, b, c] = mesh.triangles[hit.primitive as usize]
                .map(|vertex| mesh.positions[vertex as usize]);
            let spawn = SpawnPoint::on_triangle(a, b, c, hit.u, hit.v);
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            spawn.ray_towards(normal, random.direction())
        })
        .collect();
    random.shuffle(&mut rays);
    rays
}
