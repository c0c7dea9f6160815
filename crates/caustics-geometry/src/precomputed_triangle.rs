use glam::Vec3;

use crate::{Ray, Triangle, TriangleHit};

/// A triangle with its two edges at hand, for the test of Möller and Trumbore (1997, "Fast,
/// Minimum Storage Ray/Triangle Intersection").
///
/// Two-sided, and the cheapest test of one ray against one triangle, but not watertight: each
/// triangle rounds a shared edge in its own way, and about one in ten rays aimed exactly at such
/// an edge slips between both neighbours. Where a leak shows (glass, closed bodies), take
/// [`WatertightRay`](crate::WatertightRay).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrecomputedTriangle {
    a: Vec3,
    ab: Vec3,
    ac: Vec3,
}

impl From<&Triangle> for PrecomputedTriangle {
    fn from(triangle: &Triangle) -> Self {
        Self::new(triangle)
    }
}

impl PrecomputedTriangle {
    /// Stores the first vertex and the two edges that leave it.
    #[must_use]
    pub fn new(triangle: &Triangle) -> Self {
        Self {
            a: triangle.a,
            ab: triangle.b - triangle.a,
            ac: triangle.c - triangle.a,
        }
    }

    /// Where the ray meets the triangle, from either side, within the range of the ray.
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<TriangleHit> {
        let p = ray.direction.cross(self.ac);
        // A parallel ray has the determinant 0, and infinities and NaN in what follows.
        let inverse = 1.0 / self.ab.dot(p);
        let s = ray.origin - self.a;
        let q = s.cross(self.ab);
        let u = s.dot(p) * inverse;
        let v = ray.direction.dot(q) * inverse;
        let t = self.ac.dot(q) * inverse;
        // Without short circuits: one branch that is often foreseen instead of five that are not.
        let inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0);
        (inside & ray.contains(t)).then_some(TriangleHit { t, u, v })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> PrecomputedTriangle {
        PrecomputedTriangle::new(&Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    }

    #[test]
    fn hits_from_both_sides_with_weights() {
        let expected = TriangleHit {
            t: 2.0,
            u: 0.25,
            v: 0.5,
        };
        let front = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
        let back = Ray::new([0.25, 0.5, -2.0], [0.0, 0.0, 1.0]);
        assert_eq!(unit().intersect(&front), Some(expected));
        assert_eq!(unit().intersect(&back), Some(expected));
    }

    #[test]
    fn range_is_exclusive_and_parallel_rays_miss() {
        let limited =
            |t_min, t_max| Ray::with_range([0.25, 0.5, 2.0], [0.0, 0.0, -1.0], t_min, t_max);
        assert_eq!(unit().intersect(&limited(2.0, 9.0)), None);
        assert_eq!(unit().intersect(&limited(0.0, 2.0)), None);
        assert!(unit().intersect(&limited(1.9, 2.1)).is_some());
        assert_eq!(
            unit().intersect(&Ray::new([-1.0, 0.2, 0.0], [1.0, 0.0, 0.0])),
            None
        );
        assert_eq!(
            unit().intersect(&Ray::new([0.2, 0.2, 1.0], [0.0, 0.0, 0.0])),
            None
        );
        assert_eq!(
            unit().intersect(&Ray::new([0.2, 0.2, 1.0], [f32::NAN, 0.0, -1.0])),
            None
        );
    }
}
