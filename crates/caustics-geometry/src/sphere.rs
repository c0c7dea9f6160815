use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::{Aabb, Ray};

/// A sphere, hit from outside and from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its center, in metres.
    pub center: Vec3,
    /// Its radius, in metres; positive.
    pub radius: f32,
}

/// Why numbers do not make a [`Sphere`].
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SphereError {
    /// A coordinate of the center is NaN or infinite.
    #[error("center {center} of the sphere is not finite")]
    NonFiniteCenter {
        /// The center given.
        center: Vec3,
    },
    /// The radius is NaN, infinite, zero or negative.
    #[error("radius {radius} of the sphere is not positive and finite")]
    InvalidRadius {
        /// The radius given, in metres.
        radius: f32,
    },
}

impl Sphere {
    /// A sphere of a finite center and a positive, finite radius, in metres.
    ///
    /// # Errors
    ///
    /// [`SphereError`] where center or radius are out of range.
    pub fn new(center: impl Into<Vec3>, radius: f32) -> Result<Self, SphereError> {
        let center = center.into();
        if !center.is_finite() {
            return Err(SphereError::NonFiniteCenter { center });
        }
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(SphereError::InvalidRadius { radius });
        }
        Ok(Self { center, radius })
    }

    /// The smallest box around the sphere.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        // Rounded outwards, so that no point of the surface is left out.
        let (min, max) = (self.center - self.radius, self.center + self.radius);
        Aabb {
            min: Vec3::from_array(min.to_array().map(f32::next_down)),
            max: Vec3::from_array(max.to_array().map(f32::next_up)),
        }
    }

    /// The area of the surface, in square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The outward unit normal below or above a point; +Y at the center itself.
    #[must_use]
    pub fn normal_at(&self, point: Vec3) -> Vec3 {
        // In f64, since the difference to a far center loses most of its digits in f32.
        let outward = point.as_dvec3() - self.center.as_dvec3();
        outward.try_normalize().unwrap_or(DVec3::Y).as_vec3()
    }

    /// The nearest parameter at which the ray meets the surface within its range: the near side
    /// from outside, the far side from inside.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<f32> {
        let (near, far) = self.roots(ray)?;
        let (near, far) = (near as f32, far as f32);
        if ray.contains(near) {
            Some(near)
        } else {
            ray.contains(far).then_some(far)
        }
    }

    /// The two parameters at which the unlimited line of the ray meets the surface, the smaller
    /// one first, or none where it passes by.
    ///
    /// After Haines, Günther and Akenine-Möller (2019, "Precision Improvements for Ray/Sphere
    /// Intersection", Ray Tracing Gems chapter 7): the discriminant comes from the distance
    /// between the center and the line, not from a difference of squares, and the smaller root
    /// from the product of both. The arithmetic is f64: 10^4 radii away even this form
    /// is off by up to 0.0034 radii in f32; in f64 only the rounding of the answer is left, which
    /// is 0.0005.
    fn roots(&self, ray: &Ray) -> Option<(f64, f64)> {
        let direction = ray.direction.as_dvec3();
        let radius = f64::from(self.radius);
        let from_center = ray.origin.as_dvec3() - self.center.as_dvec3();
        let a = direction.length_squared();
        let b = -from_center.dot(direction);
        let nearest = from_center + b / a * direction;
        let discriminant = radius * radius - nearest.length_squared();
        if discriminant < 0.0 || discriminant.is_nan() {
            return None;
        }
        let q = b + (a * discriminant).sqrt().copysign(b);
        if q == 0.0 {
            // Tangent, and the origin is the point of contact.
            return Some((0.0, 0.0));
        }
        let product = from_center.length_squared() - radius * radius;
        let (first, second) = (product / q, q / a);
        Some((first.min(second), first.max(second)))
    }
}
