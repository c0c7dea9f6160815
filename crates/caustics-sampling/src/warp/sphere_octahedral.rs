use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3};

use crate::unit_interval::nearest;

use super::WarpSample;
use super::sine_cosine::sine_cosine;

/// Maps the unit square to the unit sphere by way of an octahedron; density `1/(4 pi)`.
///
/// After Clarberg, *Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD* (2008). The centre of
/// the square maps to +Z, its corners to -Z, the diamond between the edges' midpoints to the
/// equator. Derivatives are bounded everywhere; seams on the two axes of the square and on the
/// diamond.
#[must_use]
pub fn square_to_sphere_octahedral(uv: Vec2) -> WarpSample<Vec3> {
    let centred = 2.0 * uv - Vec2::ONE;
    let sign = Vec2::ONE.copysign(centred);
    let folded = centred.abs();
    let above = folded.x + folded.y <= 1.0;
    // Below the equator a triangle is that of the pole, mirrored at its long side.
    let (p, q) = if above {
        folded.into()
    } else {
        (1.0 - folded.y, 1.0 - folded.x)
    };
    let up = if above { 1.0 } else { -1.0 };
    let r = p + q;
    let (p_part, q_part) = if r > 0.0 { (p / r, q / r) } else { (0.5, 0.5) };
    let (sin, cos) = sine_cosine(FRAC_PI_4 * (q_part - p_part + 1.0));
    let stretch = (2.0 - r * r).sqrt();
    let radius = r * stretch;

    let radial = Vec2::new(cos, sin);
    let tangential = Vec2::new(-sin, cos);
    // dr/dfolded is up on both axes; the angle's derivative times the radius stays finite at r = 0.
    let d_radius = up * (2.0 - 2.0 * r * r) / stretch;
    let (turn_u, turn_v) = if above {
        (q_part, p_part)
    } else {
        (p_part, q_part)
    };
    let d_z = -2.0 * r;
    // Times 2 for the centring.
    let derivative = |d_angle: f32, sign_here: f32| {
        let across = sign * (d_radius * radial + stretch * d_angle * tangential);
        2.0 * sign_here * across.extend(d_z)
    };
    WarpSample {
        value: (sign * radius * radial).extend(up * (1.0 - r * r)),
        pdf: 0.25 * FRAC_1_PI,
        d_du: derivative(-FRAC_PI_2 * turn_u, sign.x),
        d_dv: derivative(FRAC_PI_2 * turn_v, sign.y),
    }
}

/// The point of the square that [`square_to_sphere_octahedral`] maps to a unit direction.
#[must_use]
pub fn sphere_octahedral_to_square(direction: Vec3) -> Vec2 {
    let across = direction.truncate().abs();
    // 1 - |z| = r^2, from the sine, which keeps its digits near the poles.
    let r = (across.length_squared() / (1.0 + direction.z.abs())).sqrt();
    let q = r * across.y.atan2(across.x) * (2.0 * FRAC_1_PI);
    let p = r - q;
    let folded = if direction.z >= 0.0 {
        Vec2::new(p, q)
    } else {
        Vec2::new(1.0 - q, 1.0 - p)
    };
    (0.5 * folded.copysign(direction.truncate()) + Vec2::splat(0.5)).map(nearest)
}
