use glam::Vec3;

use crate::Triangle;

/// The mean of three vertex values, weighted by `1 - u - v`, `u` and `v`.
#[inline]
#[must_use]
pub fn interpolate(values: [Vec3; 3], u: f32, v: f32) -> Vec3 {
    (1.0 - u - v) * values[0] + u * values[1] + v * values[2]
}

/// How fast the barycentric weights of a triangle change across its plane, in 1/m.
///
/// Moving by `dP` in the plane changes `u` by `u_gradient . dP` and `v` by `v_gradient . dP`.
/// Both gradients lie in the plane, so that a part of `dP` off the plane changes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarycentricGradient {
    /// Gradient of the second vertex's weight, in 1/m.
    pub u_gradient: Vec3,
    /// Gradient of the third vertex's weight, in 1/m.
    pub v_gradient: Vec3,
}

impl BarycentricGradient {
    /// The gradients on a triangle, or none on one without area.
    #[must_use]
    pub fn new(triangle: &Triangle) -> Option<Self> {
        let (normal, area) = triangle.normal_and_area()?;
        let per_area = 0.5 / area;
        Some(Self {
            u_gradient: (triangle.c - triangle.a).cross(normal) * per_area,
            v_gradient: normal.cross(triangle.b - triangle.a) * per_area,
        })
    }

    /// The changes of `u` and `v` for a displacement in metres.
    #[must_use]
    pub fn along(&self, displacement: Vec3) -> (f32, f32) {
        (
            self.u_gradient.dot(displacement),
            self.v_gradient.dot(displacement),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_returns_the_vertex_values_at_the_vertices() {
        let values = [Vec3::X, Vec3::Y, Vec3::Z];
        assert_eq!(interpolate(values, 0.0, 0.0), Vec3::X);
        assert_eq!(interpolate(values, 1.0, 0.0), Vec3::Y);
        assert_eq!(interpolate(values, 0.0, 1.0), Vec3::Z);
        assert_eq!(interpolate(values, 0.25, 0.25), Vec3::new(0.5, 0.25, 0.25));
    }

    #[test]
    fn gradients_of_a_right_triangle() {
        let triangle = Triangle::new([0.0; 3], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
        let gradient = BarycentricGradient::new(&triangle).unwrap();
        assert_eq!(gradient.along(Vec3::new(2.0, 0.0, 0.0)), (1.0, 0.0));
        assert_eq!(gradient.along(Vec3::new(0.0, 1.0, 0.0)), (0.0, 0.25));
        assert_eq!(gradient.along(Vec3::new(0.0, 0.0, 7.0)), (0.0, 0.0));
    }

    #[test]
    fn no_gradient_without_area() {
        let line = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        assert_eq!(BarycentricGradient::new(&line), None);
    }
}
