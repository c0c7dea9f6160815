use glam::{Vec2, Vec3};

use crate::unit_interval::nearest;

use super::WarpSample;

/// Maps the unit square to barycentric coordinates `(b, c)` with `b, c, 1 - b - c >= 0`; density 2.
///
/// After Heitz, *A Low-Distortion Map Between Triangle and Square* (2019): piecewise linear, so
/// that a lattice stays one. The point is `(1 - b - c) A + b B + c C`. A seam on the diagonal
/// `u = v`; no poles.
#[must_use]
pub fn square_to_barycentric(uv: Vec2) -> WarpSample<Vec2> {
    let (value, d_du, d_dv) = if uv.y > uv.x {
        let half = 0.5 * uv.x;
        (Vec2::new(half, uv.y - half), Vec2::new(0.5, -0.5), Vec2::Y)
    } else {
        let half = 0.5 * uv.y;
        (Vec2::new(uv.x - half, half), Vec2::X, Vec2::new(-0.5, 0.5))
    };
    WarpSample {
        value,
        pdf: 2.0,
        d_du,
        d_dv,
    }
}

/// The point of the square that [`square_to_barycentric`] maps to the coordinates `(b, c)`.
#[must_use]
pub fn barycentric_to_square(point: Vec2) -> Vec2 {
    let square = if point.y > point.x {
        Vec2::new(2.0 * point.x, point.y + point.x)
    } else {
        Vec2::new(point.x + point.y, 2.0 * point.y)
    };
    square.map(nearest)
}

/// Maps the unit square to a triangle in space, density `1 / area` (infinite for area zero).
///
/// By [`square_to_barycentric`].
#[must_use]
pub fn square_to_triangle(uv: Vec2, corners: [Vec3; 3]) -> WarpSample<Vec3> {
    let [a, b, c] = corners;
    let (to_b, to_c) = (b - a, c - a);
    let place = |coordinates: Vec2| coordinates.x * to_b + coordinates.y * to_c;
    let barycentric = square_to_barycentric(uv);
    WarpSample {
        value: a + place(barycentric.value),
        pdf: 2.0 / to_b.cross(to_c).length(),
        d_du: place(barycentric.d_du),
        d_dv: place(barycentric.d_dv),
    }
}
