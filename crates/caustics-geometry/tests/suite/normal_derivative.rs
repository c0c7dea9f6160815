//! Derivatives of normals against central differences in f64.
//!
//! The triangles here have angles of a degree and more, and their weighted normals are not near
//! zero: where either fails, the derivative has no bound and f32 no digits.

use crate::oracle;

use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{BarycentricGradient, NormalGradient, Sphere, Triangle};
use oracle::{in_cube, log_uniform, translation, unit_vector};
use proptest::prelude::*;

/// Weights of a point of the triangle's plane, by areas, in f64.
fn weights(triangle: &Triangle, point: DVec3) -> (f64, f64) {
    let (a, b, c) = (
        triangle.a.as_dvec3(),
        triangle.b.as_dvec3(),
        triangle.c.as_dvec3(),
    );
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    (
        (a - c).cross(point - c).dot(normal) / area,
        (b - a).cross(point - a).dot(normal) / area,
    )
}

fn interpolated(triangle: &Triangle, normals: [Vec3; 3], point: DVec3) -> DVec3 {
    let (u, v) = weights(triangle, point);
    let [p, q, r] = normals.map(Vec3::as_dvec3);
    ((1.0 - u - v) * p + u * q + v * r).normalize()
}

fn triangles() -> impl Strategy<Value = Triangle> {
    let corners = [in_cube(), in_cube(), in_cube()];
    (log_uniform(-4.0, 4.0), translation(), corners).prop_filter_map(
        "nearly flat",
        |(scale, shift, [a, b, c])| {
            // Not so far out that its corners are rounded to a different triangle.
            let shift = shift.clamp_length_max(100.0 * scale);
            let triangle = Triangle::new(scale * a + shift, scale * b + shift, scale * c + shift);
            let edges = [
                triangle.b - triangle.a,
                triangle.c - triangle.b,
                triangle.a - triangle.c,
            ];
            let longest = edges
                .iter()
                .fold(0.0_f32, |longest, e| longest.max(e.length()));
            (triangle.area() > 0.02 * longest * longest).then_some(triangle)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn triangle_normals_turn_as_central_differences_say(
        triangle in triangles(),
        axis in unit_vector(),
        spread in log_uniform(-3.0, 0.0),
        tilts in [in_cube(), in_cube(), in_cube()],
        (u, v) in (0.0_f32..0.5, 0.0_f32..0.5),
        (along_b, along_c) in (-1.0_f32..1.0, -1.0_f32..1.0),
    ) {
        let normals = tilts.map(|tilt| (axis + spread * tilt).normalize());
        let mean = (1.0 - u - v) * normals[0] + u * normals[1] + v * normals[2];
        prop_assume!(normals.iter().all(|n| n.is_finite()) && mean.length() > 0.1);
        let gradient = NormalGradient::on_triangle(&triangle, normals, u, v).unwrap();
        let (ab, ac) = (triangle.b - triangle.a, triangle.c - triangle.a);
        let displacement = (along_b * ab + along_c * ac).as_dvec3();

        let (a, b, c) = (triangle.a.as_dvec3(), triangle.b.as_dvec3(), triangle.c.as_dvec3());
        let (u, v) = (f64::from(u), f64::from(v));
        let point = (1.0 - u - v) * a + u * b + v * c;
        let normal = interpolated(&triangle, normals, point);
        prop_assert!((gradient.normal.as_dvec3() - normal).length() < 1e-6);

        const STEP: f64 = 1e-4;
        let ahead = interpolated(&triangle, normals, point + STEP * displacement);
        let behind = interpolated(&triangle, normals, point - STEP * displacement);
        let expected = (ahead - behind) / (2.0 * STEP);
        let found = gradient.along(displacement.as_vec3()).as_dvec3();
        // Where the turns along both edges cancel, relative to a tenth of them.
        let turns = f64::from(
            along_b.abs() * (normals[1] - normals[0]).length()
                + along_c.abs() * (normals[2] - normals[0]).length(),
        );
        let error = (found - expected).length();
        prop_assert!(error <= 1e-3 * expected.length().max(0.1 * turns), "{error} {expected}");
        // The change of a unit vector is across it.
        prop_assert!(found.dot(normal).abs() <= 1e-5 * turns.max(found.length()));
    }

    #[test]
    fn weights_change_as_the_gradient_says(triangle in triangles(), step in in_cube()) {
        let gradient = BarycentricGradient::new(&triangle).unwrap();
        let size = (triangle.b - triangle.a).length();
        let displacement = size * step;
        let (a, d) = (triangle.a.as_dvec3(), displacement.as_dvec3());
        let (u, v) = weights(&triangle, a + d);
        let (du, dv) = gradient.along(displacement);
        let bound = |gradient: Vec3| 1e-4 * f64::from(gradient.length() * displacement.length());
        prop_assert!((f64::from(du) - u).abs() <= bound(gradient.u_gradient));
        prop_assert!((f64::from(dv) - v).abs() <= bound(gradient.v_gradient));
    }

    #[test]
    fn sphere_normals_turn_as_central_differences_say(
        center in translation(),
        radius in log_uniform(-4.0, 4.0),
        towards in unit_vector(),
        displacement in in_cube(),
    ) {
        let center = center.clamp_length_max(100.0 * radius);
        let sphere = Sphere::new(center, radius).unwrap();
        let point = center + radius * towards;
        let gradient = NormalGradient::on_sphere(&sphere, point);
        let displacement = radius * displacement;
        const STEP: f64 = 1e-4;
        let normal = |step: f64| {
            let moved = point.as_dvec3() + step * displacement.as_dvec3();
            (moved - center.as_dvec3()).normalize()
        };
        let expected = (normal(STEP) - normal(-STEP)) / (2.0 * STEP);
        let found = gradient.along(displacement).as_dvec3();
        let size = f64::from(displacement.length() / radius);
        prop_assert!((found - expected).length() <= 1e-3 * expected.length().max(0.1 * size));
    }
}
