use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec2;

use crate::unit_interval::nearest;

use super::{POLE_DISTANCE, WarpSample, turn};

/// Maps the unit square to the unit disc by radius `sqrt(u)` and angle `2 pi v`; density `1/pi`.
///
/// Simple, but a lattice comes out stretched: long and thin towards the rim, short and wide
/// towards the centre, which is a pole. [`square_to_disc_concentric`] keeps its shape.
///
/// [`square_to_disc_concentric`]: super::square_to_disc_concentric
#[must_use]
pub fn square_to_disc_polar(uv: Vec2) -> WarpSample<Vec2> {
    let (sin, cos) = (TAU * uv.y).sin_cos();
    let radial = Vec2::new(cos, sin);
    let radius = uv.x.sqrt();
    WarpSample {
        value: radius * radial,
        pdf: FRAC_1_PI,
        d_du: (0.5 / uv.x.max(POLE_DISTANCE).sqrt()) * radial,
        d_dv: TAU * radius * Vec2::new(-sin, cos),
    }
}

/// The point of the square that [`square_to_disc_polar`] maps to `point`.
#[must_use]
pub fn disc_polar_to_square(point: Vec2) -> Vec2 {
    Vec2::new(nearest(point.length_squared()), turn(point))
}
