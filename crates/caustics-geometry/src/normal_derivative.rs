use glam::{Mat3, Vec3};

use crate::{BarycentricGradient, Sphere, Triangle, interpolate};

/// A unit normal and how it turns as one moves across the surface.
///
/// For a displacement `dP` in the surface the normal changes by `dN`, linear in `dP`; it is what
/// ray differentials need at a curved surface (Igehy 1999, "Tracing Ray Differentials",
/// section 3.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalGradient {
    /// The unit normal at the point itself.
    pub normal: Vec3,
    /// The matrix that takes `dP` in metres to `dN`, in 1/m.
    pub derivative: Mat3,
}

impl NormalGradient {
    /// A normal that does not turn, as on a plane or a faceted triangle.
    #[must_use]
    pub const fn flat(normal: Vec3) -> Self {
        Self {
            normal,
            derivative: Mat3::ZERO,
        }
    }

    /// The normal interpolated from the unit normals of a triangle's vertices, at weights
    /// `1 - u - v`, `u` and `v`.
    ///
    /// With the weighted sum `n`, of which `n / |n|` is the normal,
    /// `dN = ((n.n) dn - (n.dn) n) / (n.n)^(3/2)`. None on a triangle without area, or where the
    /// weighted normals cancel.
    #[must_use]
    pub fn on_triangle(triangle: &Triangle, normals: [Vec3; 3], u: f32, v: f32) -> Option<Self> {
        Self::interpolated(&BarycentricGradient::new(triangle)?, normals, u, v)
    }

    /// The same, on a triangle whose barycentric weights change so.
    #[inline]
    pub(crate) fn interpolated(
        gradient: &BarycentricGradient,
        normals: [Vec3; 3],
        u: f32,
        v: f32,
    ) -> Option<Self> {
        let sum = interpolate(normals, u, v);
        let length = sum.length();
        let normal = sum.try_normalize()?;
        // ((n.n) dn - (n.dn) n) / (n.n)^(3/2) is the part of dn across n, divided by |n|.
        let across = |dn: Vec3| (dn - normal.dot(dn) * normal) / length;
        let per_u = across(normals[1] - normals[0]);
        let per_v = across(normals[2] - normals[0]);
        let derivative = outer(per_u, gradient.u_gradient) + outer(per_v, gradient.v_gradient);
        Some(Self { normal, derivative })
    }

    /// The outward normal of a sphere at a point of its surface: `dN` is the part of `dP` along
    /// the surface, divided by the radius.
    #[must_use]
    pub fn on_sphere(sphere: &Sphere, point: Vec3) -> Self {
        let normal = sphere.normal_at(point);
        let tangential = Mat3::IDENTITY - outer(normal, normal);
        Self {
            normal,
            derivative: tangential * (1.0 / sphere.radius),
        }
    }

    /// The change of the normal for a displacement in metres.
    #[inline]
    #[must_use]
    pub fn along(&self, displacement: Vec3) -> Vec3 {
        self.derivative * displacement
    }

    /// The same surface seen from its other side: the normal and its change are both reversed.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            normal: -self.normal,
            derivative: -self.derivative,
        }
    }
}

/// The matrix that takes `x` to `(row . x) column`.
fn outer(column: Vec3, row: Vec3) -> Mat3 {
    Mat3::from_cols(row.x * column, row.y * column, row.z * column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_normals_do_not_turn() {
        let triangle = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let gradient = NormalGradient::on_triangle(&triangle, [Vec3::Z; 3], 0.2, 0.3).unwrap();
        assert_eq!(gradient, NormalGradient::flat(Vec3::Z));
    }

    #[test]
    fn normals_that_fan_out_along_x_turn_along_x() {
        // n = (x, 0, 1) across the triangle: at x = 0, dN = (dx, 0, 0).
        let triangle = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let normals = [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::Z];
        let gradient = NormalGradient::on_triangle(&triangle, normals, 0.0, 0.25).unwrap();
        assert_eq!(gradient.normal, Vec3::Z);
        assert_eq!(
            gradient.along(Vec3::new(0.5, 0.25, 0.0)),
            Vec3::new(0.5, 0.0, 0.0)
        );
        assert_eq!(gradient.reversed().along(Vec3::X), Vec3::NEG_X);
    }

    #[test]
    fn sphere_of_radius_two_turns_half_as_fast_as_the_unit_one() {
        let sphere = Sphere::new([1.0, 0.0, 0.0], 2.0).unwrap();
        let gradient = NormalGradient::on_sphere(&sphere, Vec3::new(3.0, 0.0, 0.0));
        assert_eq!(gradient.normal, Vec3::X);
        assert_eq!(
            gradient.along(Vec3::new(9.0, 1.0, -3.0)),
            Vec3::new(0.0, 0.5, -1.5)
        );
    }

    #[test]
    fn degenerate_input_gives_none() {
        let line = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        assert_eq!(
            NormalGradient::on_triangle(&line, [Vec3::Z; 3], 0.2, 0.3),
            None
        );
        let triangle = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let opposite = [Vec3::Z, Vec3::NEG_Z, Vec3::Z];
        assert_eq!(
            NormalGradient::on_triangle(&triangle, opposite, 0.5, 0.25),
            None
        );
    }
}
