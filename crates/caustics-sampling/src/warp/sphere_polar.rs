use glam::{Vec2, Vec3};

use super::{Cone, WarpSample};

/// Maps the unit square to the unit sphere: `z = 1 - 2u`, azimuth `2 pi v`; density `1/(4 pi)`.
///
/// Poles at `u = 0` and `u = 1`, about which a lattice is stretched without limit;
/// [`square_to_sphere_octahedral`](super::square_to_sphere_octahedral) has none.
#[must_use]
pub fn square_to_sphere_polar(uv: Vec2) -> WarpSample<Vec3> {
    Cone::SPHERE.sample_polar(uv)
}

/// The point of the square that [`square_to_sphere_polar`] maps to a unit direction.
#[must_use]
pub fn sphere_polar_to_square(direction: Vec3) -> Vec2 {
    Cone::SPHERE.invert_polar(direction)
}
