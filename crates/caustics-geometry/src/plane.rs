use glam::Vec3;
use thiserror::Error;

use crate::Ray;
use crate::unit_vector::direction;

/// An unbounded plane, hit from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Any point of the plane, in metres. One near the place of interest keeps rounding small.
    pub point: Vec3,
    /// The unit normal.
    pub normal: Vec3,
}

/// Why numbers do not make a [`Plane`].
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PlaneError {
    /// A coordinate of the point is NaN or infinite.
    #[error("point {point} of the plane is not finite")]
    NonFinitePoint {
        /// The point given.
        point: Vec3,
    },
    /// The normal is not finite, or has no length.
    #[error("normal {normal} of the plane has no direction")]
    InvalidNormal {
        /// The normal given.
        normal: Vec3,
    },
}

impl Plane {
    /// The plane through a point, at right angles to a normal of any length but zero.
    ///
    /// # Errors
    ///
    /// [`PlaneError`] where the point is not finite or the normal has no direction.
    pub fn new(point: impl Into<Vec3>, normal: impl Into<Vec3>) -> Result<Self, PlaneError> {
        let (point, normal) = (point.into(), normal.into());
        if !point.is_finite() {
            return Err(PlaneError::NonFinitePoint { point });
        }
        let normal = direction(normal).ok_or(PlaneError::InvalidNormal { normal })?;
        Ok(Self { point, normal })
    }

    /// The distance of a point from the plane, in metres, positive on the normal's side.
    #[must_use]
    pub fn signed_distance(&self, point: Vec3) -> f32 {
        self.normal.dot(point - self.point)
    }

    /// The parameter at which the ray meets the plane within its range, or none: parallel rays
    /// miss, even those within the plane.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<f32> {
        let slope = self.normal.dot(ray.direction);
        if slope == 0.0 {
            return None;
        }
        let t = self.normal.dot(self.point - ray.origin) / slope;
        ray.contains(t).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_from_both_sides_within_the_range() {
        let floor = Plane::new([5.0, 1.0, 5.0], [0.0, 2.0, 0.0]).unwrap();
        assert_eq!(floor.normal, Vec3::Y);
        assert_eq!(
            floor.intersect(&Ray::new([0.0, 3.0, 0.0], [1.0, -0.5, 0.0])),
            Some(4.0)
        );
        assert_eq!(
            floor.intersect(&Ray::new([0.0, 0.0, 0.0], [0.0, 4.0, 0.0])),
            Some(0.25)
        );
        assert_eq!(
            floor.intersect(&Ray::new([0.0, 3.0, 0.0], [0.0, 1.0, 0.0])),
            None
        );
        assert_eq!(
            floor.intersect(&Ray::new([0.0, 1.0, 0.0], [1.0, 0.0, 0.0])),
            None
        );
        let short = Ray::with_range([0.0, 3.0, 0.0], [0.0, -1.0, 0.0], 0.0, 2.0);
        assert_eq!(floor.intersect(&short), None);
        assert_eq!(floor.signed_distance(Vec3::new(7.0, 0.0, 0.0)), -1.0);
    }

    #[test]
    fn planes_without_direction_are_refused() {
        assert_eq!(
            Plane::new([0.0; 3], [0.0; 3]),
            Err(PlaneError::InvalidNormal { normal: Vec3::ZERO })
        );
        assert!(Plane::new([0.0; 3], [f32::NAN, 0.0, 1.0]).is_err());
        assert!(Plane::new([0.0; 3], [f32::INFINITY, 0.0, 1.0]).is_err());
        assert!(Plane::new([f32::INFINITY, 0.0, 0.0], [0.0, 0.0, 1.0]).is_err());
        assert_eq!(
            Plane::new([0.0; 3], [0.0, 1e-30, 0.0]).unwrap().normal,
            Vec3::Y
        );
    }
}
