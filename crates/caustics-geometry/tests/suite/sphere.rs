//! Spheres against the f64 solution: from outside and inside, tiny and huge, and from origins so
//! far away that the textbook quadratic fails in f32.

use crate::oracle;

use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{Ray, Sphere, SphereError};
use oracle::{EPSILON, Random, in_cube, log_uniform, sphere_roots, translation, unit_vector};
use proptest::prelude::*;

/// Nearer to tangent than this, f64 itself does not tell a hit from a miss.
const TANGENT: f64 = 1e-7;

/// Whether an answer is the exact one, rounded to f32.
fn agrees(ray: &Ray, sphere: &Sphere, found: Option<f32>) -> bool {
    let (roots, margin) = sphere_roots(ray, sphere);
    if margin < TANGENT {
        return margin > -TANGENT || found.is_none();
    }
    // The rounding of the answer, and what f64 loses over the distance to the center.
    let reach = (ray.origin.as_dvec3() - sphere.center.as_dvec3()).length();
    let lost = 1e-11 * (reach + f64::from(sphere.radius)) / ray.direction.as_dvec3().length();
    let error = |t: f64| EPSILON * t.abs() + lost;
    match found {
        Some(t) => {
            let is = |root: f64| (f64::from(t) - root).abs() <= error(root);
            // The second root counts only where the first may be behind the origin.
            is(roots[0]) || (roots[0] <= error(roots[0]) && is(roots[1]))
        }
        None => roots[1] <= error(roots[1]),
    }
}

/// The textbook solution of the quadratic equation, in f32: the control.
fn textbook(ray: &Ray, sphere: &Sphere) -> Option<f32> {
    let f = ray.origin - sphere.center;
    let a = ray.direction.length_squared();
    let half_b = f.dot(ray.direction);
    let c = f.length_squared() - sphere.radius * sphere.radius;
    let discriminant = half_b * half_b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    [(-half_b - root) / a, (-half_b + root) / a]
        .into_iter()
        .find(|t| ray.contains(*t))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn outside_origins_hit_where_f64_says(
        center in translation(),
        radius in log_uniform(-4.0, 4.0),
        from in unit_vector(),
        distance in log_uniform(-6.0, 4.0),
        aim in in_cube(),
        speed in log_uniform(-3.0, 3.0),
    ) {
        let sphere = Sphere::new(center, radius).unwrap();
        let origin = center + from * radius * (1.0 + distance);
        let target = center + 1.2 * radius * aim;
        let ray = Ray::new(origin, (target - origin) * (speed / radius));
        prop_assume!(ray.direction != Vec3::ZERO);
        prop_assert!(agrees(&ray, &sphere, sphere.intersect(&ray)));
    }

    #[test]
    fn inside_origins_hit_the_far_side(
        center in translation(),
        radius in log_uniform(-4.0, 4.0),
        from in unit_vector(),
        depth in log_uniform(-6.0, 0.0),
        direction in unit_vector(),
    ) {
        let sphere = Sphere::new(center, radius).unwrap();
        let ray = Ray::new(center + from * radius * (1.0 - depth), direction);
        let found = sphere.intersect(&ray);
        prop_assert!(agrees(&ray, &sphere, found));
        let offset = ray.origin.as_dvec3() - center.as_dvec3();
        if offset.length() < f64::from(radius) {
            prop_assert!(found.is_some());
        }
    }

    #[test]
    fn far_origins_hit_small_spheres(
        center in in_cube(),
        radius in log_uniform(-4.0, 1.0),
        from in unit_vector(),
        distance in log_uniform(2.0, 4.0),
        aim in in_cube(),
    ) {
        let sphere = Sphere::new(center, radius).unwrap();
        let origin = center + distance * from;
        let ray = Ray::new(origin, center + radius * aim - origin);
        prop_assert!(agrees(&ray, &sphere, sphere.intersect(&ray)));
    }

    #[test]
    fn limits_of_the_ray_are_exclusive(from in unit_vector(), aim in in_cube()) {
        let sphere = Sphere::new([0.0; 3], 1.0).unwrap();
        let ray = Ray::new(3.0 * from, 0.5 * aim - 3.0 * from);
        let near = sphere.intersect(&ray).unwrap();
        let far = sphere.intersect(&Ray { t_min: near, ..ray }).unwrap();
        prop_assert!(far > near);
        prop_assert_eq!(sphere.intersect(&Ray { t_min: far, ..ray }), None);
        prop_assert_eq!(sphere.intersect(&Ray { t_max: near, ..ray }), None);
        prop_assert_eq!(sphere.intersect(&Ray { t_min: near, t_max: far, ..ray }), None);
    }

    #[test]
    fn any_bits_are_survived(values in prop::array::uniform10(any::<u32>())) {
        let values = values.map(f32::from_bits);
        let point = |k: usize| Vec3::new(values[k], values[k + 1], values[k + 2]);
        let ray = Ray::new(point(0), point(3));
        let sphere = Sphere { center: point(6), radius: values[9] };
        if let Some(t) = sphere.intersect(&ray) {
            prop_assert!(ray.contains(t));
        }
    }
}

/// The textbook quadratic fails the comparison that the sphere passes, so that it can fail.
#[test]
fn textbook_quadratic_is_refused_from_afar() {
    let mut random = Random(7);
    let (mut refused, rays) = (0, 10_000);
    for _ in 0..rays {
        let sphere = Sphere::new([0.0; 3], 1.0).unwrap();
        let origin = (1e4 * random.direction()).as_vec3();
        let ray = Ray::new(origin, (0.9 * random.direction()).as_vec3() - origin);
        assert!(agrees(&ray, &sphere, sphere.intersect(&ray)));
        refused += usize::from(!agrees(&ray, &sphere, textbook(&ray, &sphere)));
    }
    // It gives up every digit of the half chord.
    assert!(refused > rays / 2, "{refused} of {rays}");
}

#[test]
fn hits_from_all_sides_by_hand() {
    let sphere = Sphere::new([1.0, 0.0, 0.0], 2.0).unwrap();
    assert_eq!(
        sphere.intersect(&Ray::new([-4.0, 0.0, 0.0], [1.0, 0.0, 0.0])),
        Some(3.0)
    );
    assert_eq!(
        sphere.intersect(&Ray::new([1.0, 0.0, 0.0], [0.0, 0.5, 0.0])),
        Some(4.0)
    );
    assert_eq!(
        sphere.intersect(&Ray::new([-4.0, 0.0, 0.0], [-1.0, 0.0, 0.0])),
        None
    );
    // Tangent from afar, and from the point of contact itself.
    assert_eq!(
        sphere.intersect(&Ray::new([-4.0, 2.0, 0.0], [1.0, 0.0, 0.0])),
        Some(5.0)
    );
    assert_eq!(
        sphere.intersect(&Ray::new([1.0, 2.0, 0.0], [1.0, 0.0, 0.0])),
        None
    );
    // On the surface: outwards nothing, inwards the far side.
    assert_eq!(
        sphere.intersect(&Ray::new([3.0, 0.0, 0.0], [1.0, 0.0, 0.0])),
        None
    );
    assert_eq!(
        sphere.intersect(&Ray::new([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0])),
        Some(4.0)
    );
    assert_eq!(sphere.intersect(&Ray::new([0.0; 3], [0.0; 3])), None);
}

#[test]
fn bounds_normals_and_errors() {
    let sphere = Sphere::new([1.0, 0.0, 0.0], 2.0).unwrap();
    assert_eq!(sphere.normal_at(Vec3::new(1.0, 5.0, 0.0)), Vec3::Y);
    assert_eq!(sphere.normal_at(sphere.center), Vec3::Y);
    assert!((sphere.area() - 16.0 * std::f32::consts::PI).abs() < 1e-5);
    let mut random = Random(11);
    let far = Sphere::new([1234.5, -6789.0, 0.1], 0.37).unwrap();
    for _ in 0..1000 {
        let point = far.center.as_dvec3() + f64::from(far.radius) * random.direction();
        let bounds = far.bounds();
        let clamped: DVec3 = point.clamp(bounds.min.as_dvec3(), bounds.max.as_dvec3());
        assert_eq!(clamped, point);
    }
    assert_eq!(
        Sphere::new([0.0; 3], 0.0),
        Err(SphereError::InvalidRadius { radius: 0.0 })
    );
    assert!(Sphere::new([0.0; 3], -1.0).is_err());
    assert!(Sphere::new([0.0; 3], f32::NAN).is_err());
    assert!(Sphere::new([0.0; 3], f32::INFINITY).is_err());
    assert!(Sphere::new([f32::NAN, 0.0, 0.0], 1.0).is_err());
}
