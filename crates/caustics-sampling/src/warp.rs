//! Maps from the unit square to the domains that lights emit from, each of constant or stated
//! density, with its inverse and its derivatives; and [`DensityTable`], which maps the square to itself by a
//! density that is measured, and has no inverse here.
//!
//! The square is `[0, 1)` on both axes; points outside it are not checked. The derivatives are the
//! start of a photon's differential, and exact for the map, except where the map is not smooth:
//! on a *seam*, where it has one derivative on either side, one of the two is given; at a *pole*,
//! where a derivative does not exist, the one a distance of [`POLE_DISTANCE`] away is given, so
//! that it is always finite.

mod cone;
mod cosine_hemisphere;
mod density_table;
mod disc_concentric;
mod disc_polar;
mod sine_cosine;
mod sphere_octahedral;
mod sphere_polar;
mod triangle;

pub use cone::{Cone, ConeError};
pub use cosine_hemisphere::{cosine_hemisphere_to_square, square_to_cosine_hemisphere};
pub use density_table::{DensityError, DensityTable};
pub use disc_concentric::{disc_concentric_to_square, square_to_disc_concentric};
pub use disc_polar::{disc_polar_to_square, square_to_disc_polar};
pub use sine_cosine::sine_cosine;
pub use sphere_octahedral::{sphere_octahedral_to_square, square_to_sphere_octahedral};
pub use sphere_polar::{sphere_polar_to_square, square_to_sphere_polar};
pub use triangle::{barycentric_to_square, square_to_barycentric, square_to_triangle};

use crate::unit_interval::nearest;

/// A derivative that would be infinite at a pole is the one at this distance from the pole in the
/// unit square: half the step of a 24-bit random number.
pub const POLE_DISTANCE: f32 = f32::EPSILON / 4.0;

/// The image of a point `(u, v)` of the unit square under a warp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpSample<V> {
    /// The image.
    pub value: V,
    /// Probability density there, for a uniform `(u, v)`: per area or per solid angle (1/sr). The
    /// same as `1 / |d_du x d_dv|`.
    pub pdf: f32,
    /// Derivative of the image with respect to `u`.
    pub d_du: V,
    /// Derivative of the image with respect to `v`.
    pub d_dv: V,
}

/// The angle of a point as a part of a turn, in `[0, 1)`.
fn turn(point: glam::Vec2) -> f32 {
    let turn = point.y.atan2(point.x) * std::f32::consts::FRAC_1_PI * 0.5;
    nearest(if turn < 0.0 { turn + 1.0 } else { turn })
}
