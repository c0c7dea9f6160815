use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::light::Light;

/// A point of a light with an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// Where it is, in metres.
    pub position: Vec3,
    /// The unit normal on the side that shines.
    pub normal: Vec3,
}

impl Light {
    /// Surface area in square metres; `None` for a light that has none.
    #[must_use]
    pub fn area(&self) -> Option<f32> {
        match *self {
            Self::Rectangle { edges, .. } => Some(edges[0].cross(edges[1]).length()),
            Self::Triangle { corners, .. } => {
                let [a, b, c] = corners;
                Some(0.5 * (b - a).cross(c - a).length())
            }
            Self::Disc { radius, .. } => Some(PI * radius * radius),
            Self::Sphere { radius, .. } => Some(4.0 * PI * radius * radius),
            _ => None,
        }
    }

    /// Radiance from every point and in every direction of the side that shines, RGB, in
    /// W/(sr m^2); zero for a light without area.
    #[must_use]
    pub fn radiance(&self) -> Vec3 {
        match *self {
            Self::Rectangle { radiance, .. }
            | Self::Triangle { radiance, .. }
            | Self::Disc { radiance, .. }
            | Self::Sphere { radiance, .. } => radiance,
            _ => Vec3::ZERO,
        }
    }

    /// The point of a light with an area at a sample of the unit square, mapped so that equal areas
    /// of the one have equal areas of the other; `None` for a light without area.
    ///
    /// A triangle by folding the square's root (Turk, *Graphics Gems*, 1990), a disc by polar
    /// coordinates, a ball by Archimedes' map of the cylinder.
    ///
    /// ```
    /// use caustics_scene::Light;
    /// use glam::{Vec2, Vec3};
    ///
    /// let panel = Light::rectangle([0.0; 3], [[2.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [1.0; 3])?;
    /// let point = panel.point_on(Vec2::new(0.25, 0.5)).expect("a panel has an area");
    /// assert_eq!(point.position, Vec3::new(0.5, 0.0, 0.5));
    /// assert_eq!(point.normal, Vec3::NEG_Y);
    /// # Ok::<(), caustics_scene::LightError>(())
    /// ```
    #[must_use]
    pub fn point_on(&self, sample: Vec2) -> Option<LightPoint> {
        match *self {
            Self::Rectangle { corner, edges, .. } => Some(LightPoint {
                position: corner + sample.x * edges[0] + sample.y * edges[1],
                normal: edges[0].cross(edges[1]).normalize(),
            }),
            Self::Triangle {
                corners: [a, b, c], ..
            } => {
                let root = sample.x.clamp(0.0, 1.0).sqrt();
                let (u, v) = (root * (1.0 - sample.y), root * sample.y);
                Some(LightPoint {
                    position: a + u * (b - a) + v * (c - a),
                    normal: (b - a).cross(c - a).normalize(),
                })
            }
            Self::Disc {
                center,
                normal,
                radius,
                ..
            } => {
                let (tangent, bitangent) = normal.any_orthonormal_pair();
                let (sin, cos) = (TAU * sample.y).sin_cos();
                let reach = radius * sample.x.max(0.0).sqrt();
                Some(LightPoint {
                    position: center + reach * (cos * tangent + sin * bitangent),
                    normal,
                })
            }
            Self::Sphere { center, radius, .. } => {
                let height = 1.0 - 2.0 * sample.x;
                let ring = (1.0 - height * height).max(0.0).sqrt();
                let (sin, cos) = (TAU * sample.y).sin_cos();
                let normal = Vec3::new(ring * cos, height, ring * sin);
                Some(LightPoint {
                    position: center + radius * normal,
                    normal,
                })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use glam::DVec3;

    fn lights() -> [Light; 4] {
        let (a, b) = (Vec3::new(1.0, 0.2, -0.3), Vec3::new(-0.4, 1.5, 0.1));
        let normal = Vec3::new(0.3, -1.0, 0.5);
        [
            Light::rectangle([0.3, 2.0, -1.0], [a, b], [1.0; 3]).unwrap(),
            Light::disc([0.1, 1.0, 0.0], normal, 0.7, [1.0; 3]).unwrap(),
            Light::sphere([-0.2, 0.5, 0.4], 1.3, [1.0; 3]).unwrap(),
            Light::triangle([Vec3::Y, Vec3::Y + a, Vec3::Y + b], [1.0; 3]).unwrap(),
        ]
    }

    /// The parallelogram of central differences has the light's area everywhere.
    #[test]
    fn equal_areas_of_the_square_are_equal_areas_of_the_light() {
        const STEP: f32 = 1e-2;
        for light in lights() {
            for index in 0u8..100 {
                let at = Vec2::new(
                    0.1 + 0.8 * (f32::from(index) * 0.618).fract(),
                    0.1 + 0.8 * f32::from(index) / 100.0,
                );
                let place = |at: Vec2| light.point_on(at).unwrap().position.as_dvec3();
                let slope = |axis: Vec2| -> DVec3 {
                    // Richardson's extrapolation of two central differences.
                    let difference = |step: f32| {
                        (place(at + step * axis) - place(at - step * axis)) / f64::from(2.0 * step)
                    };
                    (4.0 * difference(STEP) - difference(2.0 * STEP)) / 3.0
                };
                let across = slope(Vec2::X).cross(slope(Vec2::Y));
                let area = f64::from(light.area().unwrap());
                assert_relative_eq!(across.length(), area, max_relative = 1e-3);
                let normal = light.point_on(at).unwrap().normal.as_dvec3();
                let turned = across.normalize().dot(normal).abs();
                assert_relative_eq!(turned, 1.0, max_relative = 1e-3);
            }
        }
    }

    #[test]
    fn flux_is_pi_area_radiance() {
        let [panel, disc, ball, triangle] = lights();
        assert_relative_eq!(disc.flux().unwrap().x, PI * PI * 0.49, max_relative = 1e-6);
        assert_relative_eq!(
            ball.flux().unwrap().y,
            PI * 4.0 * PI * 1.69,
            max_relative = 1e-6
        );
        let square = Light::rectangle([0.0; 3], [2.0 * Vec3::X, Vec3::Z], [0.0, 0.0, 3.0]).unwrap();
        assert_relative_eq!(
            triangle.flux().unwrap().x,
            0.5 * panel.flux().unwrap().x,
            max_relative = 1e-6
        );
        assert_eq!(square.flux(), Some(Vec3::new(0.0, 0.0, 6.0 * PI)));
        assert_eq!(panel.intensity_towards(Vec3::Y), Vec3::ZERO);
    }

    #[test]
    fn poles_and_centres_are_finite() {
        for light in lights() {
            for at in [Vec2::ZERO, Vec2::ONE, Vec2::X, Vec2::Y, Vec2::splat(0.5)] {
                let point = light.point_on(at).unwrap();
                assert!(point.position.is_finite() && point.normal.is_normalized());
            }
        }
        let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
        assert_eq!(sun.point_on(Vec2::ZERO), None);
    }
}
