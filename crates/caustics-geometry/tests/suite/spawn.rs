//! Rays that leave a surface do not meet the same surface again, from sizes of 10^-4 to 10^4 and
//! up to 10^4 away from the origin.

use crate::oracle;

use caustics_geometry::glam::{DVec3, Vec3};
use caustics_geometry::{
    PrecomputedTriangle, Ray, SpawnPoint, Sphere, Triangle, TriangleHit, WatertightRay, shapes,
};
use oracle::{Random, in_cube};
use proptest::prelude::*;

fn watertight(ray: &Ray, triangle: &Triangle) -> Option<TriangleHit> {
    WatertightRay::new(ray).intersect(triangle.a, triangle.b, triangle.c, ray.t_max)
}

/// A triangle of a random size and place, and a hit on it; none if f32 flattens it there.
fn random_hit(random: &mut Random) -> Option<(Triangle, Vec3, TriangleHit)> {
    let scale = random.log_uniform(-4.0, 4.0);
    let shift = match random.index(3) {
        0 => DVec3::ZERO,
        1 => random.in_cube() * random.log_uniform(-4.0, 4.0),
        _ => random.direction() * 1e4,
    };
    let mut corner = || (scale * random.in_cube() + shift).as_vec3();
    let triangle = Triangle::new(corner(), corner(), corner());
    let normal = triangle.unit_normal()?;
    let (mut u, mut v) = (random.uniform(), random.uniform());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    // A hit as a ray finds it, not an ideal one.
    let target = triangle.point(u as f32, v as f32).as_dvec3();
    let origin = (target + scale * random.log_uniform(-2.0, 2.0) * random.direction()).as_vec3();
    let ray = Ray::new(origin, (target - origin.as_dvec3()).as_vec3());
    Some((triangle, normal, watertight(&ray, &triangle)?))
}

fn spawn(triangle: &Triangle, hit: &TriangleHit) -> SpawnPoint {
    SpawnPoint::on_triangle(triangle.a, triangle.b, triangle.c, hit.u, hit.v)
}

/// Spawns rays from random hits, both uniform and as near to grazing as a cosine of 10^-5.
fn check_triangles(seed: u64, count: u32) {
    let mut random = Random(seed);
    let mut tested = 0;
    while tested < count {
        let Some((triangle, normal, hit)) = random_hit(&mut random) else {
            continue;
        };
        tested += 1;
        let point = spawn(&triangle, &hit);
        let uniform = random.direction().as_vec3();
        let cosine = random.log_uniform(-5.0, 0.0) as f32;
        let along = (uniform - uniform.dot(normal) * normal).normalize();
        let grazing = cosine * normal + (1.0 - cosine * cosine).sqrt() * along;
        // Both sides alike: to one it is reflected, to the other transmitted.
        for direction in [uniform, -uniform, grazing, -grazing] {
            let ray = point.ray_towards(normal, direction);
            let plain = PrecomputedTriangle::new(&triangle).intersect(&ray);
            let again = [watertight(&ray, &triangle), plain];
            assert_eq!(again, [None, None], "{triangle:?} {hit:?} {direction}");
        }
    }
}

#[test]
fn rays_never_meet_the_triangle_that_they_leave() {
    check_triangles(21, 200_000);
}

/// The count that the documentation states.
#[test]
#[ignore = "twenty million rays"]
fn twenty_million_rays_never_meet_the_triangle_that_they_leave() {
    check_triangles(25, 5_000_000);
}

/// The control: without the offset, many do.
#[test]
fn without_an_offset_many_rays_meet_their_triangle_again() {
    let mut random = Random(21);
    let (mut again, mut tested) = (0, 0);
    while tested < 10_000 {
        let Some((triangle, _, hit)) = random_hit(&mut random) else {
            continue;
        };
        tested += 1;
        let ray = Ray::new(
            spawn(&triangle, &hit).position,
            random.direction().as_vec3(),
        );
        again += usize::from(watertight(&ray, &triangle).is_some());
    }
    assert!(again > tested / 10, "{again} of {tested}");
}

/// The offset stays within a few units in the last place of the vertices' coordinates, slivers
/// aside.
#[test]
fn offset_is_no_larger_than_rounding() {
    let mut random = Random(22);
    let mut tested = 0;
    while tested < 20_000 {
        let Some((triangle, normal, hit)) = random_hit(&mut random) else {
            continue;
        };
        tested += 1;
        let point = spawn(&triangle, &hit);
        let moved = point.origin_towards(normal, normal) - point.position;
        let bounds = triangle.bounds();
        let largest = bounds.max.abs().max(bounds.min.abs()).max_element();
        let edges = [
            triangle.b - triangle.a,
            triangle.c - triangle.b,
            triangle.a - triangle.c,
        ];
        let longest = edges
            .iter()
            .fold(0.0_f32, |longest, edge| longest.max(edge.length()));
        let thinness = 0.5 * longest * longest / triangle.area();
        // Along a normal across all axes: sqrt 3 times seven halves, the sum, the step away.
        let bound = 9.0 * largest + longest * thinness;
        assert!(
            moved.length() <= f32::EPSILON * bound,
            "{moved} beyond {bound}"
        );
        assert!(moved.dot(normal) >= 0.0);
    }
}

/// Out of a convex solid nothing is hit again, and into it the far side always is.
#[test]
fn rays_neither_hit_nor_leak_through_a_closed_mesh() {
    let mut random = Random(23);
    for (scale, shift) in [
        (1.0, 0.0),
        (1e-4, 0.0),
        (1e4, 0.0),
        (1.0, 10.0),
        (1e-3, 0.1),
        (1e3, 1e4),
    ] {
        let mesh = shapes::icosphere(scale, 2).unwrap();
        let vertices: Vec<Vec3> = mesh.positions().iter().map(|p| *p + shift).collect();
        let triangles: Vec<Triangle> = mesh
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| vertices[i as usize]);
                Triangle { a, b, c }
            })
            .collect();
        for _ in 0..10_000 {
            let triangle = triangles[random.index(triangles.len())];
            let normal = triangle.unit_normal().unwrap();
            let (mut u, mut v) = (random.uniform() as f32, random.uniform() as f32);
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let direction = random.direction().as_vec3();
            let point = SpawnPoint::on_triangle(triangle.a, triangle.b, triangle.c, u, v);
            let ray = point.ray_towards(normal, direction);
            let found = triangles
                .iter()
                .any(|triangle| watertight(&ray, triangle).is_some());
            assert_eq!(
                found,
                direction.dot(normal) < 0.0,
                "scale {scale}, shift {shift}"
            );
        }
    }
}

#[test]
fn rays_never_meet_the_sphere_that_they_leave() {
    let mut random = Random(24);
    let mut tested = 0;
    while tested < 200_000 {
        let radius = random.log_uniform(-4.0, 4.0);
        let shift = match random.index(3) {
            0 => DVec3::ZERO,
            1 => random.in_cube() * random.log_uniform(-4.0, 4.0),
            _ => random.direction() * 1e4,
        };
        // Below this, the positions of f32 are too coarse for the sphere.
        if radius < 1e-4 * shift.length() {
            continue;
        }
        tested += 1;
        let sphere = Sphere::new(shift.as_vec3(), radius as f32).unwrap();
        let outside = (shift + 3.0 * radius * random.direction()).as_vec3();
        let inside = (shift + 0.9 * radius * random.in_cube().normalize()).as_vec3();
        let ray = Ray::new(outside, inside - outside);
        let hit = sphere.intersect(&ray).expect("aimed at a point inside");
        let point = SpawnPoint::on_sphere(&sphere, ray.at(hit));
        let normal = sphere.normal_at(point.position);
        let direction = random.direction().as_vec3();
        let cosine = direction.dot(normal).abs();
        let outward = if direction.dot(normal) > 0.0 {
            direction
        } else {
            -direction
        };
        assert_eq!(sphere.intersect(&point.ray_towards(normal, outward)), None);
        // The chord to the far side; near grazing it is as short as rounding is.
        if cosine > 0.02 {
            let chord = sphere.intersect(&point.ray_towards(normal, -outward));
            // Not the near side again, from which it would be nothing.
            let chord = chord.expect("the far side of the sphere");
            assert!(chord > radius as f32 * cosine, "{chord} at {cosine}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5_000))]

    /// A ray between two surfaces meets what lies between, but neither of the two.
    #[test]
    fn rays_between_surfaces_meet_neither(
        first in [in_cube(), in_cube(), in_cube()],
        second in [in_cube(), in_cube(), in_cube()],
        shift in in_cube(),
        weights in prop::array::uniform4(0.0_f32..0.5),
    ) {
        let first = Triangle::new(first[0], first[1], first[2]);
        let far = 1e3 * shift;
        let second = Triangle::new(second[0] + far, second[1] + far, second[2] + far);
        let (Some(n), Some(m)) = (first.unit_normal(), second.unit_normal()) else {
            return Ok(());
        };
        let [u, v, r, s] = weights;
        let start = SpawnPoint::on_triangle(first.a, first.b, first.c, u, v);
        let end = SpawnPoint::on_triangle(second.a, second.b, second.c, r, s);
        let ray = start.ray_between(n, &end, m);
        prop_assert_eq!(watertight(&ray, &first), None);
        prop_assert_eq!(watertight(&ray, &second), None);
        let middle = ray.at(0.5);
        let across = caustics_geometry::Frame::from_normal(ray.direction.normalize());
        let size = 0.1 * ray.direction.length();
        let blocker = Triangle::new(
            middle + size * across.tangent,
            middle - size * across.tangent + size * across.bitangent,
            middle - size * across.tangent - size * across.bitangent,
        );
        prop_assert!(watertight(&ray, &blocker).is_some());
    }
}

#[test]
fn free_points_stay_where_they_are() {
    let point = SpawnPoint::free([1.0, 2.0, 3.0]);
    assert_eq!(
        point.origin_towards(Vec3::Y, Vec3::X),
        Vec3::new(1.0, 2.0, 3.0)
    );
    let sphere = Sphere::new([0.0, 1.0, 0.0], 2.0).unwrap();
    assert_eq!(
        SpawnPoint::on_sphere(&sphere, sphere.center).position,
        Vec3::new(0.0, 3.0, 0.0)
    );
}
