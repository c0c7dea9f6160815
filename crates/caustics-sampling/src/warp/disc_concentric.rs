use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec2Swizzles};

use crate::unit_interval::nearest;

use super::WarpSample;
use super::sine_cosine::sine_cosine;

/// Maps the unit square to the unit disc, concentric squares to circles; density `1/pi`.
///
/// After Shirley and Chiu, *A Low Distortion Map Between Disk and Square* (1997). Neighbours stay
/// neighbours and cells nearly square, which lattices ask for. Seams on both diagonals of the
/// square; no poles.
#[must_use]
pub fn square_to_disc_concentric(uv: Vec2) -> WarpSample<Vec2> {
    let centred = 2.0 * uv - Vec2::ONE;
    // In the wedges left and right of the centre the radius is x and the angle pi/4 y/x; the
    // wedges above and below are those with x and y exchanged.
    let horizontal = centred.x.abs() > centred.y.abs();
    let (radius, other) = if horizontal {
        centred.into()
    } else {
        (centred.y, centred.x)
    };
    let ratio = if radius == 0.0 { 0.0 } else { other / radius };
    let (sin, cos) = sine_cosine(FRAC_PI_4 * ratio);
    let value = radius * Vec2::new(cos, sin);
    let d_radius = 2.0 * Vec2::new(cos + FRAC_PI_4 * ratio * sin, sin - FRAC_PI_4 * ratio * cos);
    let d_other = FRAC_PI_2 * Vec2::new(-sin, cos);
    let (value, d_du, d_dv) = if horizontal {
        (value, d_radius, d_other)
    } else {
        (value.yx(), d_other.yx(), d_radius.yx())
    };
    WarpSample {
        value,
        pdf: FRAC_1_PI,
        d_du,
        d_dv,
    }
}

/// The point of the square that [`square_to_disc_concentric`] maps to `point`.
#[must_use]
pub fn disc_concentric_to_square(point: Vec2) -> Vec2 {
    let horizontal = point.x.abs() > point.y.abs();
    let (axis, other) = if horizontal {
        point.into()
    } else {
        (point.y, point.x)
    };
    let radius = point.length().copysign(axis);
    let angle = if axis == 0.0 {
        0.0
    } else {
        (other / axis).atan()
    };
    let centred = Vec2::new(radius, radius * angle * (4.0 * FRAC_1_PI));
    let centred = if horizontal { centred } else { centred.yx() };
    (0.5 * centred + Vec2::splat(0.5)).map(nearest)
}
