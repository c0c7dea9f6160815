use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::{POLE_DISTANCE, WarpSample, disc_concentric_to_square, square_to_disc_concentric};

/// Maps the unit square to the hemisphere about +Z, density `cos(theta) / pi` per solid angle: as
/// a Lambertian surface emits.
///
/// The concentric disc lifted onto the hemisphere (Malley's method). Seams on the square's
/// diagonals; the square's border maps to the horizon, where the density is zero and the
/// derivative a pole. Flux per sample is radiance times `pi` times area, without a division by the
/// density.
#[must_use]
pub fn square_to_cosine_hemisphere(uv: Vec2) -> WarpSample<Vec3> {
    let disc = square_to_disc_concentric(uv);
    let cos_squared = (1.0 - disc.value.length_squared()).max(0.0);
    let cos = cos_squared.sqrt();
    let cos_near = cos_squared.max(4.0 * POLE_DISTANCE).sqrt();
    let lifted = |d_point: Vec2| d_point.extend(-disc.value.dot(d_point) / cos_near);
    WarpSample {
        value: disc.value.extend(cos),
        pdf: cos * FRAC_1_PI,
        d_du: lifted(disc.d_du),
        d_dv: lifted(disc.d_dv),
    }
}

/// The point of the square that [`square_to_cosine_hemisphere`] maps to a unit direction.
#[must_use]
pub fn cosine_hemisphere_to_square(direction: Vec3) -> Vec2 {
    disc_concentric_to_square(direction.truncate())
}
