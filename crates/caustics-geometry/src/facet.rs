use glam::Vec3;

use crate::spawn::plane_error;
use crate::{BarycentricGradient, NormalGradient, SpawnPoint, Triangle};

/// What a tracer needs of a triangle at every hit and what is the same wherever the hit lies in it.
///
/// Each takes square roots and divisions that wait for one another: kept with the triangle, 40 bytes,
/// they are not taken again for every ray. What comes of it is the same to the last bit as without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Unit normal of the front.
    pub normal: Vec3,
    /// How the barycentric weights change across the plane.
    pub gradient: BarycentricGradient,
    /// How far rounding in an intersection test moves the plane, in metres.
    plane_error: f32,
}

impl Facet {
    /// Of a triangle; `None` of one without area.
    #[must_use]
    pub fn new(triangle: &Triangle) -> Option<Self> {
        let (normal, _) = triangle.normal_and_area()?;
        let Triangle { a, b, c } = *triangle;
        Some(Self {
            normal,
            gradient: BarycentricGradient::new(triangle)?,
            plane_error: plane_error(b - a, c - a),
        })
    }

    /// The same as [`SpawnPoint::on_triangle`]; `triangle` is the one that this is of.
    #[inline]
    #[must_use]
    pub fn spawn_point(&self, triangle: &Triangle, u: f32, v: f32) -> SpawnPoint {
        SpawnPoint::on_plane(triangle, u, v, self.plane_error)
    }

    /// The same as [`NormalGradient::on_triangle`]; `normals` are those of the vertices.
    #[inline]
    #[must_use]
    pub fn normal_gradient(&self, normals: [Vec3; 3], u: f32, v: f32) -> Option<NormalGradient> {
        NormalGradient::interpolated(&self.gradient, normals, u, v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_what_is_computed_anew() {
        let triangle = Triangle::new([0.3, 0.1, -2.0], [1.7, 0.2, -2.5], [0.9, 3.1, 0.4]);
        let normals = [[0.1, 0.2, 1.0], [0.4, -0.2, 0.9], [-0.3, 0.1, 0.8]]
            .map(|it| Vec3::from(it).normalize());
        let facet = Facet::new(&triangle).unwrap();
        assert_eq!(Some(facet.normal), triangle.unit_normal());
        let Triangle { a, b, c } = triangle;
        for (u, v) in [(0.0, 0.0), (0.2, 0.7), (0.33, 0.21)] {
            assert_eq!(
                facet.spawn_point(&triangle, u, v),
                SpawnPoint::on_triangle(a, b, c, u, v)
            );
            let gradient = facet.normal_gradient(normals, u, v);
            assert!(gradient.is_some());
            assert_eq!(
                gradient,
                NormalGradient::on_triangle(&triangle, normals, u, v)
            );
        }
    }

    #[test]
    fn a_line_has_none() {
        let line = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        assert_eq!(Facet::new(&line), None);
    }
}
