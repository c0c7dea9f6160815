//! Both triangle tests against the solution of the equations in f64, at scales from 10^-4 to 10^4
//! and up to 10^4 away from the origin.

use crate::oracle;

use caustics_geometry::glam::Vec3;
use caustics_geometry::{PrecomputedTriangle, Ray, Triangle, TriangleHit, WatertightRay};
use oracle::{ExactHit, in_cube, log_uniform, translation, unit_vector};
use proptest::prelude::*;

fn watertight(ray: &Ray, triangle: &Triangle) -> Option<TriangleHit> {
    WatertightRay::new(ray).intersect(triangle.a, triangle.b, triangle.c, ray.t_max)
}

fn precomputed(ray: &Ray, triangle: &Triangle) -> Option<TriangleHit> {
    PrecomputedTriangle::new(triangle).intersect(ray)
}

/// A triangle of a random size at a random place, and a ray towards the point of weights `u`, `v`
/// in its plane, from up to 100 sizes away.
fn triangle_and_ray(
    flatness: impl Strategy<Value = f32>,
) -> impl Strategy<Value = (Triangle, Ray)> {
    let place = (
        log_uniform(-4.0, 4.0),
        translation(),
        [in_cube(), in_cube(), in_cube()],
    );
    let aim = (-0.5_f32..1.5, -0.5_f32..1.5, unit_vector());
    let lengths = (log_uniform(-2.0, 2.0), log_uniform(-3.0, 3.0));
    (place, aim, lengths, flatness).prop_map(
        |((scale, shift, [a, b, c]), (u, v, from), (distance, speed), flatness)| {
            // Flatness 1 leaves the third vertex where it is, 0 puts it on the line a b.
            let c = a + (b - a) * 0.4 + (c - a) * flatness;
            let triangle = Triangle::new(scale * a + shift, scale * b + shift, scale * c + shift);
            let origin = triangle.point(u, v) + scale * distance * from;
            let ray = Ray::new(origin, (triangle.point(u, v) - origin) * (speed / scale));
            (triangle, ray)
        },
    )
}

fn check(triangle: &Triangle, ray: &Ray) -> Result<(), TestCaseError> {
    let exact = ExactHit::new(ray, triangle);
    // Seen from so far, or rounded so coarsely, that f32 can tell nothing.
    prop_assume!(exact.is_some_and(|exact| exact.weight_error < 0.2));
    for (name, found) in [
        ("watertight", watertight(ray, triangle)),
        ("precomputed", precomputed(ray, triangle)),
    ] {
        let exact = exact.expect("assumed above");
        prop_assert!(exact.agrees(found), "{name}: {found:?}, not {exact:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 20_000,
        max_global_rejects: 1_000_000,
        ..ProptestConfig::default()
    })]

    #[test]
    fn hits_are_those_of_the_exact_solution((triangle, ray) in triangle_and_ray(Just(1.0))) {
        check(&triangle, &ray)?;
        // From behind, and with the winding reversed.
        let reversed = Triangle::new(triangle.a, triangle.c, triangle.b);
        check(&reversed, &ray)?;
    }

    #[test]
    fn hits_on_slivers_are_those_of_the_exact_solution(
        (triangle, ray) in triangle_and_ray(log_uniform(-5.0, -1.0))
    ) {
        check(&triangle, &ray)?;
    }

    #[test]
    fn limits_of_the_ray_are_exclusive((triangle, ray) in triangle_and_ray(Just(1.0))) {
        for test in [watertight, precomputed] {
            let Some(hit) = test(&ray, &triangle) else { continue };
            let limited = |t_min, t_max| Ray { t_min, t_max, ..ray };
            prop_assert_eq!(test(&limited(hit.t, f32::INFINITY), &triangle), None);
            prop_assert_eq!(test(&limited(0.0, hit.t), &triangle), None);
            let around = limited(hit.t.next_down(), hit.t.next_up());
            prop_assert_eq!(test(&around, &triangle), Some(hit));
        }
    }

    #[test]
    fn any_bits_are_survived(values in prop::array::uniform15(any::<u32>())) {
        let point = |k: usize| {
            Vec3::from([values[k], values[k + 1], values[k + 2]].map(f32::from_bits))
        };
        let triangle = Triangle::new(point(0), point(3), point(6));
        let ray = Ray::new(point(9), point(12));
        for hit in [watertight(&ray, &triangle), precomputed(&ray, &triangle)].into_iter().flatten()
        {
            prop_assert!(ray.contains(hit.t));
        }
    }
}

/// The comparison can fail: answers that are wrong by little are refused.
#[test]
fn wrong_answers_are_refused() {
    let triangle = Triangle::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let ray = Ray::new([0.3, 0.2, 1.0], [0.0, 0.0, -1.0]);
    let exact = ExactHit::new(&ray, &triangle).unwrap();
    let right = watertight(&ray, &triangle).unwrap();
    assert!(exact.agrees(Some(right)));
    assert!(!exact.agrees(None));
    assert!(!exact.agrees(Some(TriangleHit {
        t: right.t + 3e-5,
        ..right
    })));
    assert!(!exact.agrees(Some(TriangleHit {
        u: right.u + 3e-5,
        ..right
    })));
    assert!(!exact.agrees(Some(TriangleHit {
        u: right.v,
        v: right.u,
        ..right
    })));
    let beside = Ray::new([0.6, 0.6, 1.0], [0.0, 0.0, -1.0]);
    assert!(
        !ExactHit::new(&beside, &triangle)
            .unwrap()
            .agrees(Some(right))
    );
}
