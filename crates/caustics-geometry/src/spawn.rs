use glam::Vec3;

use crate::{Ray, Sphere, Triangle};

/// Half the distance from 1 to the next f32: the largest relative error of one rounding.
const UNIT_ROUNDOFF: f32 = 0.5 * f32::EPSILON;

/// The bound `n u / (1 - n u)` on the relative error of `n` roundings in a row (Higham 2002,
/// "Accuracy and Stability of Numerical Algorithms", section 3.1).
const fn gamma(roundings: u32) -> f32 {
    let error = roundings as f32 * UNIT_ROUNDOFF;
    error / (1.0 - error)
}

/// A point on a surface that rays start from, with a bound on how far rounding has moved it.
///
/// A ray that leaves a surface must not meet the same surface again at once. A fixed offset is
/// too much for a small object and too little for a far one; this one follows from the numbers
/// that made the point (Pharr, Jakob and Humphreys 2023, "Physically Based Rendering", 4th
/// edition, section 6.8): it moves the origin along the normal just as far as needed to leave
/// the box of possible true positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpawnPoint {
    /// The point, in metres.
    pub position: Vec3,
    /// Bound on the absolute error of each coordinate, in metres; not negative.
    pub error: Vec3,
}

impl SpawnPoint {
    /// A point in free space, such as a light without size: nothing to step off.
    #[must_use]
    pub fn free(position: impl Into<Vec3>) -> Self {
        Self {
            position: position.into(),
            error: Vec3::ZERO,
        }
    }

    /// The point of barycentric weights `1 - u - v`, `u`, `v` on a triangle.
    ///
    /// Made from the vertices and not from the ray, because the error of `origin + t direction`
    /// grows with the length of the ray.
    ///
    /// To the error of the point is added that of the next intersection test, which sees the
    /// plane of the triangle moved by rounding: by about machine epsilon times the longest edge
    /// times the ratio of that edge to the triangle's height. It is below the first for all but
    /// slivers, and never more than a thousandth of the longest edge.
    #[must_use]
    pub fn on_triangle(a: Vec3, b: Vec3, c: Vec3, u: f32, v: f32) -> Self {
        Self::on_plane(&Triangle { a, b, c }, u, v, plane_error(b - a, c - a))
    }

    /// The same, with what rounding does to the plane.
    #[inline]
    pub(crate) fn on_plane(triangle: &Triangle, u: f32, v: f32, plane_error: f32) -> Self {
        let Triangle { a, b, c } = *triangle;
        let (a, b, c) = ((1.0 - u - v) * a, u * b, v * c);
        Self {
            position: a + b + c,
            error: gamma(7) * (a.abs() + b.abs() + c.abs()) + plane_error,
        }
    }

    /// The point of the sphere nearest to `point`; the top of the sphere for its center.
    #[must_use]
    pub fn on_sphere(sphere: &Sphere, point: Vec3) -> Self {
        let center = sphere.center.as_dvec3();
        let outward = (point.as_dvec3() - center)
            .try_normalize()
            .unwrap_or(glam::DVec3::Y);
        // Rounded once, at the end.
        let position = (center + f64::from(sphere.radius) * outward).as_vec3();
        Self {
            position,
            error: gamma(2) * position.abs(),
        }
    }

    /// Where a ray of this direction starts: beyond the error of the point, on the side of the
    /// surface that the direction goes to.
    ///
    /// `geometric_normal` is the unit normal of the surface itself, not an interpolated one, to
    /// either side.
    #[inline]
    #[must_use]
    pub fn origin_towards(&self, geometric_normal: Vec3, direction: Vec3) -> Vec3 {
        let distance = geometric_normal.abs().dot(self.error);
        let side = if direction.dot(geometric_normal) < 0.0 {
            -distance
        } else {
            distance
        };
        let offset = side * geometric_normal;
        let moved = self.position + offset;
        Vec3::new(
            away(moved.x, offset.x),
            away(moved.y, offset.y),
            away(moved.z, offset.z),
        )
    }

    /// The ray that leaves the surface in this direction, without a far limit.
    #[must_use]
    pub fn ray_towards(&self, geometric_normal: Vec3, direction: Vec3) -> Ray {
        Ray::new(self.origin_towards(geometric_normal, direction), direction)
    }

    /// The ray from this point to another, both with the unit normals of their surfaces: it
    /// meets whatever lies between them, but neither surface itself. The far end is at `t = 1`.
    ///
    /// For an end in free space give [`SpawnPoint::free`] and any normal.
    #[must_use]
    pub fn ray_between(&self, normal: Vec3, target: &Self, target_normal: Vec3) -> Ray {
        let towards = target.position - self.position;
        let origin = self.origin_towards(normal, towards);
        let end = target.origin_towards(target_normal, -towards);
        Ray::with_range(origin, end - origin, 0.0, 1.0)
    }
}

/// How far rounding in an intersection test moves the plane of a triangle of these two edges, in
/// metres.
///
/// Edge functions are off by the square of the longest edge, times machine epsilon; divided by
/// the area, and times the depth of the triangle, that is this distance, for any direction of the
/// ray. Half of it is enough for each of the 2 10^7 random triangles and rays of the ignored test
/// `twenty_million_rays_never_meet_the_triangle_that_they_leave`. Without it the plain test finds
/// one triangle in 10^5 again, and one in 300 of those whose longest edge is more than 10 times
/// their height.
#[inline]
pub(crate) fn plane_error(ab: Vec3, ac: Vec3) -> f32 {
    let longest_squared = ab
        .length_squared()
        .max(ac.length_squared())
        .max((ac - ab).length_squared());
    let longest = longest_squared.sqrt();
    let relative = UNIT_ROUNDOFF * longest_squared / ab.cross(ac).length();
    // Without area the ratio is infinite or NaN, which `min` both replaces.
    longest * relative.min(1.0 / 1024.0)
}

/// The next f32 in the direction of the offset, which makes up for the rounding of the sum.
#[inline]
fn away(coordinate: f32, offset: f32) -> f32 {
    if offset > 0.0 {
        coordinate.next_up()
    } else if offset < 0.0 {
        coordinate.next_down()
    } else {
        coordinate
    }
}
