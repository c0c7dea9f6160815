//! Photons as a caustic leaves them, and queries as a picture asks them.

use glam::Vec3;

use crate::random::Random;

/// Photons on a floor under wavy water, in a cusp on it and on two walls, in the order in which
/// they were emitted: at random.
#[must_use]
pub fn surface_photons(count: usize) -> Vec<Vec3> {
    let mut random = Random::new(3);
    (0..count)
        .map(|_| {
            let (u, v) = (random.uniform(), random.uniform());
            match random.uniform() {
                // Refracted by waves: displaced by the slope of the surface.
                kind if kind < 0.55 => {
                    let slope_x =
                        0.06 * (20.0 * u + 3.0 * v).cos() + 0.03 * (31.0 * v - 9.0 * u).sin();
                    let slope_z = 0.05 * (17.0 * v).sin() + 0.04 * (23.0 * u + 11.0 * v).cos();
                    Vec3::new(
                        (u + slope_x).rem_euclid(1.0),
                        0.0,
                        (v + slope_z).rem_euclid(1.0),
                    )
                }
                // The cusp of a ball lens.
                kind if kind < 0.8 => {
                    let (sin, cos) = (std::f32::consts::TAU * u).sin_cos();
                    let r = 0.15 * v + 0.01;
                    Vec3::new(0.6 + r * cos, 0.0, 0.4 + 0.5 * r * sin + r * r)
                }
                kind if kind < 0.9 => Vec3::new(0.0, 0.7 * u * u, v),
                _ => Vec3::new(u, 0.7 * v, 1.0),
            }
        })
        .collect()
}

/// Half of the queries at photons, half anywhere on the floor, in the order of a Morton curve over
/// the floor, as pixels come.
#[must_use]
pub fn pixel_queries(photons: &[Vec3], count: usize) -> Vec<Vec3> {
    let mut random = Random::new(4);
    let mut queries: Vec<Vec3> = (0..count)
        .map(|i| {
            if i % 2 == 0 {
                photons[(random.bits() % photons.len() as u64) as usize]
            } else {
                Vec3::new(random.uniform(), 0.0, random.uniform())
            }
        })
        .collect();
    let spread = |x: f32| {
        (0..12).fold(0_u32, |code, bit| {
            code | (((x * 4095.0) as u32 >> bit) & 1) << (2 * bit)
        })
    };
    queries.sort_by_key(|p| spread(p.x.max(p.y)) | spread(p.z) << 1);
    queries
}
