//! One ray against many triangles, by the two tests of `caustics-geometry`.
//!
//! Both tests answer the same questions first. They may differ only where a ray passes within
//! rounding of an edge, which random rays do about once in a million; a hit that both find has the
//! same distance and weights.

use caustics_benches::random::Random;
use caustics_geometry::{PrecomputedTriangle, Ray, Triangle, TriangleHit, WatertightRay};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use std::hint::black_box;

/// Triangles that each ray is tested against: they fit the first-level cache.
const TRIANGLES: usize = 64;

const RAYS: usize = 1024;

/// Triangles of about unit size in a box of three units.
fn triangles(random: &mut Random) -> Vec<Triangle> {
    let mut point =
        |size: f32| size * (Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5);
    (0..TRIANGLES)
        .map(|_| {
            let center = point(3.0);
            Triangle {
                a: center + point(1.5),
                b: center + point(1.5),
                c: center + point(1.5),
            }
        })
        .collect()
}

/// Rays from around the box towards points inside it.
fn rays(random: &mut Random) -> Vec<Ray> {
    (0..RAYS)
        .map(|_| {
            let origin = 4.0 * random.direction();
            let target = 1.5 * random.uniform() * random.direction();
            Ray::new(origin, (target - origin).normalize())
        })
        .collect()
}

fn closest_precomputed(
    triangles: &[PrecomputedTriangle],
    ray: &Ray,
) -> Option<(usize, TriangleHit)> {
    let mut ray = *ray;
    let mut closest = None;
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(hit) = triangle.intersect(&ray) {
            ray.t_max = hit.t;
            closest = Some((index, hit));
        }
    }
    closest
}

fn closest_watertight(triangles: &[Triangle], ray: &Ray) -> Option<(usize, TriangleHit)> {
    let watertight = WatertightRay::new(ray);
    let mut t_max = ray.t_max;
    let mut closest = None;
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(hit) = watertight.intersect(triangle.a, triangle.b, triangle.c, t_max) {
            t_max = hit.t;
            closest = Some((index, hit));
        }
    }
    closest
}

/// Whether two answers are one, up to rounding.
fn agree(left: Option<(usize, TriangleHit)>, right: Option<(usize, TriangleHit)>) -> bool {
    match (left, right) {
        (None, None) => true,
        (Some((first, p)), Some((second, q))) => {
            let weights = (p.u - q.u).abs().max((p.v - q.v).abs());
            first == second && (p.t - q.t).abs() < 1e-3 && weights < 1e-2
        }
        _ => false,
    }
}

fn compare(triangles: &[Triangle], precomputed: &[PrecomputedTriangle], rays: &[Ray]) {
    let mut hits = 0;
    let mut differences = 0;
    for ray in rays {
        let left = closest_precomputed(precomputed, ray);
        let right = closest_watertight(triangles, ray);
        hits += usize::from(left.is_some());
        differences += usize::from(!agree(left, right));
        // An answer that is moved must not pass.
        let moved = right.map(|(index, hit)| (index + 1, hit));
        assert!(moved.is_none() || !agree(left, moved));
    }
    assert!(hits > rays.len() / 4 && hits < rays.len(), "{hits} hits");
    assert_eq!(differences, 0, "of {} rays", rays.len());
}

fn triangle_intersection(criterion: &mut Criterion) {
    let mut random = Random::new(3);
    let triangles = triangles(&mut random);
    let precomputed: Vec<PrecomputedTriangle> =
        triangles.iter().map(PrecomputedTriangle::new).collect();
    let rays = rays(&mut random);
    compare(&triangles, &precomputed, &rays);

    let mut group = criterion.benchmark_group("triangle_intersection");
    group.throughput(Throughput::Elements((RAYS * TRIANGLES) as u64));
    group.bench_function("precomputed", |bencher| {
        bencher.iter(|| {
            let hits = rays
                .iter()
                .filter(|&ray| closest_precomputed(&precomputed, ray).is_some());
            black_box(hits.count())
        });
    });
    group.bench_function("watertight", |bencher| {
        bencher.iter(|| {
            let hits = rays
                .iter()
                .filter(|&ray| closest_watertight(&triangles, ray).is_some());
            black_box(hits.count())
        });
    });
    group.finish();
}

criterion_group!(benches, triangle_intersection);
criterion_main!(benches);
