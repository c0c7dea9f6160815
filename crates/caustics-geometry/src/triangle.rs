use glam::Vec3;

use crate::unit_vector::direction_and_length;
use crate::{Aabb, Hit};

/// Three points in space, wound counterclockwise as seen from the front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// First vertex, in metres.
    pub a: Vec3,
    /// Second vertex, in metres; its barycentric weight is `u`.
    pub b: Vec3,
    /// Third vertex, in metres; its barycentric weight is `v`.
    pub c: Vec3,
}

/// Where a ray meets a triangle: the point is `(1 - u - v) a + u b + v c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Ray parameter, in units of the ray direction's length.
    pub t: f32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
}

impl TriangleHit {
    /// The same hit, on the primitive of this number.
    #[inline]
    #[must_use]
    pub const fn on(self, primitive: u32) -> Hit {
        Hit {
            t: self.t,
            u: self.u,
            v: self.v,
            primitive,
        }
    }
}

impl Triangle {
    /// The triangle of three vertices.
    #[must_use]
    pub fn new(a: impl Into<Vec3>, b: impl Into<Vec3>, c: impl Into<Vec3>) -> Self {
        Self {
            a: a.into(),
            b: b.into(),
            c: c.into(),
        }
    }

    /// The point of barycentric weights `1 - u - v`, `u` and `v`.
    #[must_use]
    pub fn point(&self, u: f32, v: f32) -> Vec3 {
        crate::interpolate([self.a, self.b, self.c], u, v)
    }

    /// The smallest box around the triangle.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points([self.a, self.b, self.c])
    }

    /// The area, in square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.normal_and_area().map_or(0.0, |(_, area)| area)
    }

    /// The unit normal of the front, or none where the three vertices lie on one line.
    #[must_use]
    pub fn unit_normal(&self) -> Option<Vec3> {
        self.normal_and_area().map(|(normal, _)| normal)
    }

    /// The unit normal of the front and the area, or none where the area is zero.
    ///
    /// Both edges are scaled to unit size first, so that neither the smallest nor the largest
    /// triangles underflow or overflow on the way.
    #[must_use]
    pub fn normal_and_area(&self) -> Option<(Vec3, f32)> {
        let (ab, ac) = (self.b - self.a, self.c - self.a);
        let (ab_size, ac_size) = (ab.abs().max_element(), ac.abs().max_element());
        // NaN for an edge without length, and so without direction.
        let cross = (ab / ab_size).cross(ac / ac_size);
        let (normal, length) = direction_and_length(cross)?;
        Some((normal, 0.5 * length * ab_size * ac_size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_and_area_of_a_right_triangle() {
        let triangle = Triangle::new([1.0, 0.0, 0.0], [1.0, 3.0, 0.0], [1.0, 0.0, 4.0]);
        assert_eq!(triangle.unit_normal(), Some(Vec3::X));
        assert_eq!(triangle.area(), 6.0);
        assert_eq!(triangle.point(0.5, 0.25), Vec3::new(1.0, 1.5, 1.0));
        assert_eq!(
            triangle.bounds(),
            Aabb::new([1.0, 0.0, 0.0], [1.0, 3.0, 4.0])
        );
    }

    #[test]
    fn tiny_and_huge_triangles_have_normals() {
        for size in [1e-30, 1e-10, 1e10, 1e18] {
            let triangle = Triangle::new([0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]);
            assert_eq!(triangle.unit_normal(), Some(Vec3::Z), "size {size}");
        }
        let small = Triangle::new([0.0; 3], [1e-12, 0.0, 0.0], [0.0, 1e-12, 0.0]);
        assert!((small.area() / 0.5e-24 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn points_on_a_line_have_no_normal() {
        let line = Triangle::new([0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]);
        assert_eq!(line.unit_normal(), None);
        assert_eq!(line.area(), 0.0);
        let point = Triangle::new([1.0; 3], [1.0; 3], [1.0; 3]);
        assert_eq!(point.unit_normal(), None);
    }
}
