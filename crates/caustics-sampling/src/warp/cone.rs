use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::unit_interval::nearest;

use super::{
    POLE_DISTANCE, WarpSample, disc_concentric_to_square, square_to_disc_concentric, turn,
};

/// The derivative near the pole needs the product of this and [`POLE_DISTANCE`] to be a normal
/// number.
const LEAST_HEIGHT: f32 = 1e-30;

/// A quantity that makes no cone.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConeError {
    /// The cosine of the half angle is not in `[-1, 1)`, or not a number.
    #[error("the cosine of a cone's half angle is {cosine}, outside [-1, 1)")]
    Cosine {
        /// The cosine given.
        cosine: f32,
    },
    /// The half angle is not in `(0, pi]`, or not a number.
    #[error("the half angle of a cone is {angle} radians, outside (0, pi]")]
    HalfAngle {
        /// The angle given, in radians.
        angle: f32,
    },
    /// The sine of the half angle is not in `(0, 1]`, or not a number.
    #[error("the sine of a cone's half angle is {sine}, outside (0, 1]")]
    Sine {
        /// The sine given.
        sine: f32,
    },
}

/// All directions within a half angle about +Z, with constant density over the solid angle.
///
/// With `r` uniform, `cos theta = 1 - r (1 - cos theta_max)`: area on the sphere goes with the
/// cosine (Archimedes). The cone keeps `1 - cos theta_max` rather than the cosine, since a narrow
/// cone (the sun's: 1.1e-5) has few digits left in the latter.
///
/// ```
/// use caustics_sampling::{glam::vec2, warp::Cone};
///
/// let spot = Cone::from_half_angle(0.5)?;
/// let sample = spot.sample_polar(vec2(0.3, 0.8));
/// assert!(spot.contains(sample.value));
/// assert!((sample.pdf * spot.solid_angle() - 1.0).abs() < 1e-6);
/// // The differential spans the area that the density says.
/// assert!((sample.d_du.cross(sample.d_dv).length() * sample.pdf - 1.0).abs() < 1e-5);
/// # Ok::<(), caustics_sampling::warp::ConeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// `1 - cos theta_max`, in `(0, 2]`.
    height: f32,
}

impl Cone {
    /// The cone of all directions.
    pub const SPHERE: Self = Self { height: 2.0 };

    /// The cone about +Z whose half angle has this cosine, in `[-1, 1)`.
    ///
    /// # Errors
    ///
    /// A cosine outside that range: one would leave no directions.
    pub fn from_cosine(cosine: f32) -> Result<Self, ConeError> {
        if !(-1.0..1.0).contains(&cosine) {
            return Err(ConeError::Cosine { cosine });
        }
        Ok(Self {
            height: 1.0 - cosine,
        })
    }

    /// The cone about +Z of this half angle, in radians in `(0, pi]`. Exact for narrow cones too.
    ///
    /// # Errors
    ///
    /// An angle outside that range, or so small (below 2e-15) that the numbers underflow.
    pub fn from_half_angle(angle: f32) -> Result<Self, ConeError> {
        let sin_half = (0.5 * angle).sin();
        let height = 2.0 * sin_half * sin_half;
        if !(angle > 0.0 && angle <= PI && height >= LEAST_HEIGHT) {
            return Err(ConeError::HalfAngle { angle });
        }
        Ok(Self { height })
    }

    /// The cone, at most a hemisphere, whose half angle has this sine, in `(0, 1]`: the cone that
    /// just holds a sphere has `radius / distance`. Exact for narrow cones too.
    ///
    /// # Errors
    ///
    /// A sine outside that range, or so small (below 2e-15) that the numbers underflow.
    pub fn from_sine(sine: f32) -> Result<Self, ConeError> {
        // 1 - cos = sin^2 / (1 + cos), without cancellation.
        let height = sine * sine / (1.0 + (1.0 - sine * sine).max(0.0).sqrt());
        if !(sine > 0.0 && sine <= 1.0 && height >= LEAST_HEIGHT) {
            return Err(ConeError::Sine { sine });
        }
        Ok(Self { height })
    }

    /// Cosine of the half angle.
    #[must_use]
    pub fn cosine(self) -> f32 {
        1.0 - self.height
    }

    /// `1 - cosine` of the half angle, in (0, 2], to all its digits where the cosine has none left.
    #[must_use]
    pub fn height(self) -> f32 {
        self.height
    }

    /// Solid angle, in steradians.
    #[must_use]
    pub fn solid_angle(self) -> f32 {
        TAU * self.height
    }

    /// Probability density per solid angle of both samples, in 1/sr.
    #[must_use]
    pub fn pdf(self) -> f32 {
        1.0 / self.solid_angle()
    }

    /// Whether a unit direction lies in the cone, within the rounding of its `z`.
    #[must_use]
    pub fn contains(self, direction: Vec3) -> bool {
        direction.z >= self.cosine() - f32::EPSILON
    }

    /// Maps the unit square to the cone: `r = u`, azimuth `2 pi v`. A pole at `u = 0`, and for the
    /// full sphere at `u = 1`.
    #[must_use]
    pub fn sample_polar(self, uv: Vec2) -> WarpSample<Vec3> {
        let (sin, cos) = (TAU * uv.y).sin_cos();
        let radial = Vec2::new(cos, sin);
        let (cos_theta, sin_theta) = self.polar(uv.x);
        // Away from the poles by at least POLE_DISTANCE at either end.
        let (cos_near, sin_near) = self.polar(uv.x.clamp(POLE_DISTANCE, 1.0 - f32::EPSILON / 2.0));
        let d_sin = self.height * cos_near / sin_near;
        WarpSample {
            value: (sin_theta * radial).extend(cos_theta),
            pdf: self.pdf(),
            d_du: (d_sin * radial).extend(-self.height),
            d_dv: (TAU * sin_theta * Vec2::new(-sin, cos)).extend(0.0),
        }
    }

    /// The point of the square that [`sample_polar`](Self::sample_polar) maps to a unit direction.
    #[must_use]
    pub fn invert_polar(self, direction: Vec3) -> Vec2 {
        Vec2::new(
            nearest(height_of(direction) / self.height),
            turn(direction.truncate()),
        )
    }

    /// Maps the unit square to the cone through the concentric disc: cells of a lattice stay
    /// nearly square. Seams on the square's diagonals; a pole only for the full sphere, on the
    /// whole border of the square, which all maps to -Z.
    #[must_use]
    pub fn sample_concentric(self, uv: Vec2) -> WarpSample<Vec3> {
        let disc = square_to_disc_concentric(uv);
        let (point, height) = (disc.value, self.height);
        // r is the squared radius: sin theta / radius = sqrt(height (2 - r height)).
        let r = point.length_squared();
        let stretch = (height * (2.0 - r * height).max(0.0)).sqrt();
        let near = (height * (2.0 - r * height).max(8.0 * POLE_DISTANCE)).sqrt();
        let derivative = |d_point: Vec2| {
            let d_r = 2.0 * point.dot(d_point);
            let d_stretch = -0.5 * height * height * d_r / near;
            (d_point * stretch + point * d_stretch).extend(-height * d_r)
        };
        WarpSample {
            value: (point * stretch).extend(1.0 - r * height),
            pdf: self.pdf(),
            d_du: derivative(disc.d_du),
            d_dv: derivative(disc.d_dv),
        }
    }

    /// The point of the square that [`sample_concentric`](Self::sample_concentric) maps to a unit
    /// direction.
    #[must_use]
    pub fn invert_concentric(self, direction: Vec3) -> Vec2 {
        let radius = (height_of(direction) / self.height).sqrt();
        let across = direction.truncate();
        disc_concentric_to_square(radius * across.try_normalize().unwrap_or(Vec2::X))
    }

    /// Cosine and sine of the polar angle at `r`.
    fn polar(self, r: f32) -> (f32, f32) {
        let fallen = r * self.height;
        (1.0 - fallen, (fallen * (2.0 - fallen)).max(0.0).sqrt())
    }
}

/// `1 - z` of a unit direction, from the sine where the cosine is near one.
fn height_of(direction: Vec3) -> f32 {
    if direction.z > 0.0 {
        direction.truncate().length_squared() / (1.0 + direction.z)
    } else {
        1.0 - direction.z
    }
}
