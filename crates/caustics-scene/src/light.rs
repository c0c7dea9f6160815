//! Lights that no ray can hit: points, directions and areas.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

use crate::light_check::{LightError, finite, has_area, is_radius, is_unit, positive, unit};

/// A light that no ray can hit.
///
/// The lights with an area shine evenly and in all directions of their side (Lambertian emission).
/// They cast no shadow and are not seen themselves: one that is to be seen is an object with an
/// emissive [`Material`].
///
/// Directions are unit vectors. The constructors check their arguments; a light put together by
/// hand is checked when it enters a scene.
///
/// [`Material`]: crate::Material
///
/// ```
/// use caustics_scene::Light;
/// use glam::Vec3;
///
/// let lamp = Light::spot([0.0, 3.0, 0.0], [0.0, -2.0, 0.0], [10.0; 3], 0.3, 0.5)?;
/// assert_eq!(lamp.intensity_towards(Vec3::NEG_Y), Vec3::splat(10.0));
/// assert_eq!(lamp.intensity_towards(Vec3::X), Vec3::ZERO);
/// # Ok::<(), caustics_scene::LightError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// Shines from a point, alike in all directions.
    Point {
        /// Where it is, in metres.
        position: Vec3,
        /// Radiant intensity, RGB, in W/sr.
        intensity: Vec3,
    },
    /// Shines from a point into a cone with a soft edge.
    Spot {
        /// Where it is, in metres.
        position: Vec3,
        /// The cone's axis, a unit vector that points away from the light.
        direction: Vec3,
        /// Radiant intensity inside the inner cone, RGB, in W/sr.
        intensity: Vec3,
        /// Cosine of the angle between the axis and where the light begins to fall off.
        inner_cos: f32,
        /// Cosine of the angle between the axis and where the light ends; at least 0 and less than
        /// `inner_cos`.
        outer_cos: f32,
    },
    /// Shines from infinitely far away, as the sun nearly does.
    Directional {
        /// The direction in which its light travels, a unit vector.
        direction: Vec3,
        /// Irradiance on a plane that faces the light, RGB, in W/m^2.
        irradiance: Vec3,
    },
    /// A parallelogram that shines to the side of `edges[0] x edges[1]`.
    Rectangle {
        /// One corner, in metres.
        corner: Vec3,
        /// The two edges from there, in metres; not parallel.
        edges: [Vec3; 2],
        /// Radiance, RGB, in W/(sr m^2).
        radiance: Vec3,
    },
    /// A triangle that shines to the side from which its corners go round counter-clockwise.
    Triangle {
        /// Its corners, in metres; not on one line.
        corners: [Vec3; 3],
        /// Radiance, RGB, in W/(sr m^2).
        radiance: Vec3,
    },
    /// A disc that shines to one side.
    Disc {
        /// Where it is, in metres.
        center: Vec3,
        /// The side to which it shines, a unit vector.
        normal: Vec3,
        /// In metres, above 0.
        radius: f32,
        /// Radiance, RGB, in W/(sr m^2).
        radiance: Vec3,
    },
    /// A ball that shines outwards.
    Sphere {
        /// Where it is, in metres.
        center: Vec3,
        /// In metres, above 0.
        radius: f32,
        /// Radiance, RGB, in W/(sr m^2).
        radiance: Vec3,
    },
}

impl Light {
    /// A point light of this intensity in W/sr.
    ///
    /// # Errors
    /// A number is not finite, or an intensity is negative.
    pub fn point(
        position: impl Into<Vec3>,
        intensity: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let light = Self::Point {
            position: position.into(),
            intensity: intensity.into(),
        };
        light.validate().map(|()| light)
    }

    /// A spot light that shines along `direction` (of any length), with this intensity in W/sr out
    /// to the angle `inner` from its axis, falling to 0 at `outer`; both in radians, and
    /// `0 <= inner < outer <= pi/2`.
    ///
    /// # Errors
    /// A number is not finite, an intensity is negative, the direction is zero, or the angles are
    /// out of range.
    pub fn spot(
        position: impl Into<Vec3>,
        direction: impl Into<Vec3>,
        intensity: impl Into<Vec3>,
        inner: f32,
        outer: f32,
    ) -> Result<Self, LightError> {
        if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
            return Err(LightError::ConeAngles { inner, outer });
        }
        let light = Self::Spot {
            position: position.into(),
            direction: unit(direction.into())?,
            intensity: intensity.into(),
            inner_cos: inner.cos(),
            // The cosine of the f32 next to pi/2 is -4e-8.
            outer_cos: outer.cos().max(0.0),
        };
        light.validate().map(|()| light)
    }

    /// A directional light whose light travels along `direction` (of any length), with this
    /// irradiance in W/m^2 on a plane facing it.
    ///
    /// # Errors
    /// A number is not finite, an irradiance is negative, or the direction is zero.
    pub fn directional(
        direction: impl Into<Vec3>,
        irradiance: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let direction = unit(direction.into())?;
        let light = Self::Directional {
            direction,
            irradiance: irradiance.into(),
        };
        light.validate().map(|()| light)
    }

    /// A parallelogram with this corner and edges in metres, which shines with this radiance in
    /// W/(sr m^2) to the side of `edges[0] x edges[1]`.
    ///
    /// # Errors
    /// A number is not finite, a radiance is negative, or the edges span no area.
    pub fn rectangle(
        corner: impl Into<Vec3>,
        edges: [impl Into<Vec3>; 2],
        radiance: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let light = Self::Rectangle {
            corner: corner.into(),
            edges: edges.map(Into::into),
            radiance: radiance.into(),
        };
        light.validate().map(|()| light)
    }

    /// A triangle with these corners in metres, which shines with this radiance in W/(sr m^2) to the
    /// side from which they go round counter-clockwise.
    ///
    /// # Errors
    /// A number is not finite, a radiance is negative, or the corners span no area.
    pub fn triangle(
        corners: [impl Into<Vec3>; 3],
        radiance: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let light = Self::Triangle {
            corners: corners.map(Into::into),
            radiance: radiance.into(),
        };
        light.validate().map(|()| light)
    }

    /// A disc of this radius in metres, which shines with this radiance in W/(sr m^2) to the side of
    /// `normal` (of any length).
    ///
    /// # Errors
    /// A number is not finite, a radiance is negative, the normal is zero, or the radius is not
    /// above zero.
    pub fn disc(
        center: impl Into<Vec3>,
        normal: impl Into<Vec3>,
        radius: f32,
        radiance: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let light = Self::Disc {
            center: center.into(),
            normal: unit(normal.into())?,
            radius,
            radiance: radiance.into(),
        };
        light.validate().map(|()| light)
    }

    /// A ball of this radius in metres, which shines outwards with this radiance in W/(sr m^2).
    ///
    /// # Errors
    /// A number is not finite, a radiance is negative, or the radius is not above zero.
    pub fn sphere(
        center: impl Into<Vec3>,
        radius: f32,
        radiance: impl Into<Vec3>,
    ) -> Result<Self, LightError> {
        let light = Self::Sphere {
            center: center.into(),
            radius,
            radiance: radiance.into(),
        };
        light.validate().map(|()| light)
    }

    /// Radiant intensity in W/sr that the light sends along a unit direction; zero for a
    /// directional light, which has none, and for lights with an area, which
    /// [`point_on`](Self::point_on) describes.
    ///
    /// A spot light falls off as `KHR_lights_punctual` recommends: with `t` running from 0 at the
    /// outer cone to 1 at the inner one in the cosine, its intensity is scaled by `t^2`.
    #[must_use]
    pub fn intensity_towards(&self, direction: Vec3) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } => intensity,
            Self::Spot {
                direction: axis,
                intensity,
                inner_cos,
                outer_cos,
                ..
            } => intensity * spot_falloff(axis.dot(direction), inner_cos, outer_cos),
            Self::Directional { .. }
            | Self::Rectangle { .. }
            | Self::Triangle { .. }
            | Self::Disc { .. }
            | Self::Sphere { .. } => Vec3::ZERO,
        }
    }

    /// All the flux that the light sends out, RGB, in W; `None` for a directional light, whose flux
    /// depends on the area it is let shine on.
    ///
    /// A point light's is `4 pi` times its intensity. A spot light's is the integral of its falloff,
    /// `2 pi (1 - inner_cos) + 2 pi (inner_cos - outer_cos) / 3` times its intensity. That of a light
    /// with an area is `pi` times area and radiance.
    #[must_use]
    pub fn flux(&self) -> Option<Vec3> {
        match *self {
            Self::Point { intensity, .. } => Some(4.0 * PI * intensity),
            Self::Spot {
                intensity,
                inner_cos,
                outer_cos,
                ..
            } => {
                let solid_angle = 2.0 * PI * ((1.0 - inner_cos) + (inner_cos - outer_cos) / 3.0);
                Some(solid_angle * intensity)
            }
            Self::Directional { .. } => None,
            Self::Rectangle { radiance, .. }
            | Self::Triangle { radiance, .. }
            | Self::Disc { radiance, .. }
            | Self::Sphere { radiance, .. } => self.area().map(|area| PI * area * radiance),
        }
    }

    /// Whether every number lies in its range; see the fields.
    ///
    /// # Errors
    /// Names the first quantity that does not.
    pub fn validate(&self) -> Result<(), LightError> {
        match *self {
            Self::Point {
                position,
                intensity,
            } => {
                finite(position)?;
                positive(intensity)
            }
            Self::Spot {
                position,
                direction,
                intensity,
                inner_cos,
                outer_cos,
            } => {
                finite(position)?;
                is_unit(direction)?;
                if !(0.0 <= outer_cos && outer_cos < inner_cos && inner_cos <= 1.0) {
                    return Err(LightError::ConeAngles {
                        inner: inner_cos.acos(),
                        outer: outer_cos.acos(),
                    });
                }
                positive(intensity)
            }
            Self::Directional {
                direction,
                irradiance,
            } => {
                is_unit(direction)?;
                positive(irradiance)
            }
            Self::Rectangle {
                corner,
                edges,
                radiance,
            } => {
                finite(corner)?;
                edges.into_iter().try_for_each(finite)?;
                finite(corner + edges[0] + edges[1])?;
                has_area(self.area())?;
                positive(radiance)
            }
            Self::Triangle { corners, radiance } => {
                corners.into_iter().try_for_each(finite)?;
                has_area(self.area())?;
                positive(radiance)
            }
            Self::Disc {
                center,
                normal,
                radius,
                radiance,
            } => {
                finite(center)?;
                is_unit(normal)?;
                is_radius(radius)?;
                has_area(self.area())?;
                positive(radiance)
            }
            Self::Sphere {
                center,
                radius,
                radiance,
            } => {
                finite(center)?;
                is_radius(radius)?;
                has_area(self.area())?;
                positive(radiance)
            }
        }
    }
}

/// Fraction of a spot light's intensity at an angle of this cosine from its axis.
fn spot_falloff(cos: f32, inner_cos: f32, outer_cos: f32) -> f32 {
    let t = ((cos - outer_cos) / (inner_cos - outer_cos)).clamp(0.0, 1.0);
    t * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn spot_falls_off_with_the_square_of_the_cosine_ramp() {
        let (inner, outer) = (0.2_f32, 0.6_f32);
        let light = Light::spot([0.0; 3], [0.0, 0.0, -3.0], [8.0; 3], inner, outer).unwrap();
        let at = |angle: f32| {
            light
                .intensity_towards(Vec3::new(angle.sin(), 0.0, -angle.cos()))
                .x
        };
        assert_eq!(at(0.0), 8.0);
        assert_eq!(at(0.19), 8.0);
        assert_eq!(at(0.61), 0.0);
        let halfway = f32::midpoint(inner.cos(), outer.cos()).acos();
        assert_relative_eq!(at(halfway), 2.0, max_relative = 1e-4);
    }

    #[test]
    fn spot_flux_is_the_integral_of_its_intensity() {
        let light = Light::spot([0.0; 3], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0], 0.3, 1.1).unwrap();
        let Light::Spot {
            inner_cos,
            outer_cos,
            ..
        } = light
        else {
            unreachable!()
        };
        // Midpoint rule over the cosine, in f64.
        let steps = 100_000;
        let sum: f64 = (0..steps)
            .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
            .map(|cos| f64::from(spot_falloff(cos as f32, inner_cos, outer_cos)))
            .sum();
        let expected = 2.0 * std::f64::consts::PI * sum / f64::from(steps);
        let flux = light.flux().unwrap();
        assert_relative_eq!(f64::from(flux.x), expected, max_relative = 1e-5);
        assert_relative_eq!(f64::from(flux.z), 3.0 * expected, max_relative = 1e-5);
    }

    #[test]
    fn point_flux_and_the_lack_of_one() {
        let lamp = Light::point([0.0; 3], [1.0, 0.0, 2.0]).unwrap();
        assert_eq!(lamp.flux(), Some(Vec3::new(4.0 * PI, 0.0, 8.0 * PI)));
        assert_eq!(
            Light::directional([0.0, -1.0, 0.0], [3.0; 3])
                .unwrap()
                .flux(),
            None
        );
    }

    #[test]
    fn directions_of_any_length_become_unit() {
        for length in [1e-38_f32, 1e-20, 1.0, 1e20, 1e38] {
            let light = Light::directional([length, -length, 0.0], [1.0; 3]).unwrap();
            let Light::Directional { direction, .. } = light else {
                unreachable!()
            };
            assert_relative_eq!(direction.x, 0.5_f32.sqrt(), max_relative = 1e-6);
            assert_relative_eq!(direction.y, -(0.5_f32.sqrt()), max_relative = 1e-6);
        }
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(Light::point([f32::NAN, 0.0, 0.0], [1.0; 3]).is_err());
        assert!(Light::point([0.0; 3], [1.0, -1.0, 1.0]).is_err());
        assert!(Light::point([0.0; 3], [f32::INFINITY; 3]).is_err());
        assert!(Light::directional([0.0; 3], [1.0; 3]).is_err());
        let (x, z, radiance) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]);
        for (edges, is_valid) in [
            ([x, z], true),
            ([x, [2.0, 0.0, 0.0]], false),
            ([x, [f32::NAN, 0.0, 1.0]], false),
            ([[1e30, 0.0, 0.0], [0.0, 0.0, 1e30]], false),
        ] {
            let light = Light::rectangle([0.0; 3], edges, radiance);
            assert_eq!(light.is_ok(), is_valid, "{edges:?}");
        }
        for (corners, is_valid) in [
            ([[0.0; 3], x, z], true),
            ([[0.0; 3], x, [2.0, 0.0, 0.0]], false),
            ([[0.0; 3], x, [0.0, f32::NAN, 0.0]], false),
            ([[0.0; 3], [1e30, 0.0, 0.0], [0.0, 0.0, 1e30]], false),
        ] {
            let light = Light::triangle(corners, radiance);
            assert_eq!(light.is_ok(), is_valid, "{corners:?}");
        }
        assert!(Light::triangle([[0.0; 3], x, z], [-1.0; 3]).is_err());
        for (radius, is_valid) in [(1.0, true), (0.0, false), (-1.0, false), (f32::NAN, false)] {
            let disc = Light::disc([0.0; 3], z, radius, radiance);
            assert_eq!(disc.is_ok(), is_valid, "{radius}");
            let ball = Light::sphere([0.0; 3], radius, radiance);
            assert_eq!(ball.is_ok(), is_valid, "{radius}");
        }
        assert!(Light::disc([0.0; 3], [0.0; 3], 1.0, radiance).is_err());
        assert!(Light::sphere([0.0; 3], 1.0, [-1.0; 3]).is_err());
        for (inner, outer) in [
            (0.5, 0.5),
            (0.6, 0.5),
            (-0.1, 0.5),
            (0.1, 1.6),
            (f32::NAN, 0.5),
        ] {
            let light = Light::spot([0.0; 3], [0.0, -1.0, 0.0], [1.0; 3], inner, outer);
            assert!(
                matches!(light, Err(LightError::ConeAngles { .. })),
                "{inner} {outer}"
            );
        }
        // Too narrow for the two cosines to differ in f32.
        assert!(Light::spot([0.0; 3], [0.0, -1.0, 0.0], [1.0; 3], 0.0, 1e-5).is_err());
        let by_hand = Light::Directional {
            direction: Vec3::splat(2.0),
            irradiance: Vec3::ONE,
        };
        assert!(matches!(
            by_hand.validate(),
            Err(LightError::Direction { .. })
        ));
        assert!(Light::spot([0.0; 3], [0.0, -1.0, 0.0], [1.0; 3], 0.0, FRAC_PI_2).is_ok());
    }
}
