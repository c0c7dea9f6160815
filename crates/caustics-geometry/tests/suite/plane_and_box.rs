//! Planes, boxes and frames against f64.

use crate::oracle;

use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{Aabb, Frame, Plane, Ray};
use oracle::{EPSILON, in_cube, log_uniform, translation, unit_vector};
use proptest::prelude::*;

/// Where the exact line of a ray is within the closed box, clipped to the range of the ray.
fn exact_interval(bounds: &Aabb, ray: &Ray) -> (f64, f64) {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (mut enter, mut leave) = (f64::from(ray.t_min), f64::from(ray.t_max));
    for axis in 0..3 {
        let low = f64::from(bounds.min[axis]) - origin[axis];
        let high = f64::from(bounds.max[axis]) - origin[axis];
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                leave = f64::NEG_INFINITY;
            }
        } else {
            let (p, q) = (low / direction[axis], high / direction[axis]);
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
    }
    (enter, leave)
}

/// A coordinate that lines up with the faces of the boxes made of such coordinates.
fn grid_point() -> impl Strategy<Value = Vec3> {
    let coordinate = prop::sample::select(vec![-1.0_f32, -0.5, -0.0, 0.0, 0.5, 1.0]);
    prop::array::uniform3(coordinate).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn plane_is_hit_where_f64_says(
        scale in log_uniform(-4.0, 4.0),
        shift in translation(),
        point in in_cube(),
        normal in unit_vector(),
        origin in in_cube(),
        direction in unit_vector(),
        speed in log_uniform(-3.0, 3.0),
    ) {
        let plane = Plane::new(scale * point + shift, normal).unwrap();
        let ray = Ray::new(scale * origin + shift, speed * direction);
        let normal = plane.normal.as_dvec3();
        let (gap, direction) =
            (plane.point.as_dvec3() - ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let slope = normal.dot(direction);
        let t = normal.dot(gap) / slope;
        // Each term of a dot product is rounded at most four times, and the quotient once.
        let relative_slope = (normal * direction).abs().element_sum() / slope.abs();
        let terms = (normal * gap).abs().element_sum() / slope.abs();
        let error = 4.0 * EPSILON * (terms + t.abs() * relative_slope) + EPSILON * t.abs();
        prop_assume!(4.0 * EPSILON * relative_slope < 0.1);
        match plane.intersect(&ray) {
            Some(found) => prop_assert!((f64::from(found) - t).abs() <= error),
            None => prop_assert!(t <= error),
        }
    }

    #[test]
    fn box_is_hit_where_f64_says(
        scale in log_uniform(-4.0, 4.0),
        shift in translation(),
        corners in [in_cube(), in_cube()],
        origin in in_cube(),
        target in in_cube(),
        distance in log_uniform(-1.0, 3.0),
    ) {
        let bounds = Aabb::new(scale * corners[0] + shift, scale * corners[1] + shift);
        let origin = distance * scale * origin + shift;
        let ray = Ray::new(origin, scale * 1.5 * target + shift - origin);
        let (enter, leave) = exact_interval(&bounds, &ray);
        // Half of it for each of a difference, a quotient and the far end's sum, and three by
        // which that end is pushed out.
        let error = 4.6 * EPSILON * enter.abs().max(leave.abs());
        match bounds.intersect(&ray) {
            // Never lost, and found only where it touches to rounding.
            None => prop_assert!(enter > leave, "{enter} {leave}"),
            Some(found) => {
                prop_assert!(enter <= leave + error);
                prop_assert!((f64::from(found.0) - enter).abs() <= error);
                if leave.is_finite() {
                    prop_assert!((f64::from(found.1) - leave).abs() <= error);
                }
            }
        }
    }

    /// Origins in faces, directions along them, flat boxes and single points: all sums and
    /// quotients here are exact, and so is the answer.
    #[test]
    fn box_is_closed(corners in [grid_point(), grid_point()], origin in grid_point(),
                     direction in grid_point()) {
        let bounds = Aabb::new(corners[0], corners[1]);
        let ray = Ray::new(origin, direction);
        let (enter, leave) = exact_interval(&bounds, &ray);
        prop_assert_eq!(bounds.intersect(&ray).is_some(), enter <= leave);
    }

    #[test]
    fn bounding_sphere_holds_the_box_and_little_more(
        scale in log_uniform(-4.0, 4.0),
        shift in translation(),
        corners in [in_cube(), in_cube()],
    ) {
        let bounds = Aabb::new(scale * corners[0] + shift, scale * corners[1] + shift);
        let (center, radius) = bounds.bounding_sphere();
        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let corner = DVec3::new(pick(0), pick(1), pick(2));
            prop_assert!((corner - center.as_dvec3()).length() <= f64::from(radius));
        }
        let rounding = EPSILON * center.as_dvec3().length();
        let half = 0.5 * (high - low).length();
        prop_assert!(f64::from(radius) <= half * (1.0 + 8.0 * EPSILON) + 2.0 * rounding);
    }

    #[test]
    fn frame_is_orthonormal_and_right_handed(normal in unit_vector(), local in in_cube()) {
        let frame = Frame::from_normal(normal);
        let (x, y, z) =
            (frame.tangent.as_dvec3(), frame.bitangent.as_dvec3(), frame.normal.as_dvec3());
        for (p, q) in [(x, y), (y, z), (z, x)] {
            prop_assert!(p.dot(q).abs() < 5e-7);
        }
        prop_assert!((x.length() - 1.0).abs() < 5e-7 && (y.length() - 1.0).abs() < 5e-7);
        prop_assert!((x.cross(y) - z).length() < 1e-6);
        prop_assert!((frame.to_local(frame.to_world(local)) - local).length() < 2e-6);
    }

    /// The frame stays orthonormal for normals that almost point down, where the first such
    /// formula, of Frisvad, lost its digits.
    #[test]
    fn frame_holds_near_the_pole(tilt in log_uniform(-12.0, -2.0), angle in 0.0_f32..6.3) {
        let normal = Vec3::new(tilt * angle.cos(), tilt * angle.sin(), -1.0).normalize();
        let frame = Frame::from_normal(normal);
        let (x, y) = (frame.tangent.as_dvec3(), frame.bitangent.as_dvec3());
        prop_assert!(x.dot(y).abs() < 5e-7 && x.dot(normal.as_dvec3()).abs() < 5e-7);
        prop_assert!((x.length() - 1.0).abs() < 5e-7 && (y.length() - 1.0).abs() < 5e-7);
    }
}
