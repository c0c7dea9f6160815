//! What the tracer says about a photon's neighbours behind exact spheres, against f64.
//!
//! A spot light as narrow as one spacing of photons, asked for one photon, sends it along its axis,
//! so that a chosen ray goes through the real tracer, and its neighbours are the same light turned
//! a little. Photons split at every interface, without roulette, so that each branch of a path has
//! its own photon and no flux is rescaled.

use crate::common;

use std::cell::Cell;

use caustics_geometry::Sphere;
use caustics_scene::{Material, Scene};
use caustics_trace::Photon;
use caustics_trace::glam::{DVec3, Vec3};
use common::central::{PointAndDirection, derivative};
use common::scenes::{
    SPACING, add_floor, add_sphere, flattened, initial_turns, single_ray, trace_one,
};
use common::{direction, reflect_exactly, refract_exactly, relative_error};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

const TAU: f64 = std::f64::consts::TAU;

const FLOOR: f32 = -2.0;

/// What a sphere of the scene does.
#[derive(Clone, Copy, Debug)]
enum Body {
    Glass(f32),
    Mirror,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    sphere: Sphere,
    body: Body,
}

/// One way through the spheres in f64: at each interface what `transmits` says, to the floor.
/// `None` where it leaves the scene or meets something else than it did before.
struct ExactPath<'a> {
    balls: &'a [Ball],
    /// For each event: the ball, whether from within, and whether it is refracted.
    events: Vec<(usize, bool, bool)>,
}

fn sphere_roots(sphere: &Sphere, origin: DVec3, onwards: DVec3) -> Option<(f64, f64)> {
    let along = (sphere.center.as_dvec3() - origin).dot(onwards);
    let nearest = origin + along * onwards - sphere.center.as_dvec3();
    let squared = f64::from(sphere.radius).powi(2) - nearest.length_squared();
    (squared > 0.0).then(|| (along - squared.sqrt(), along + squared.sqrt()))
}

impl ExactPath<'_> {
    /// Follows the recorded events from a start.
    fn follow(&self, mut position: DVec3, mut onwards: DVec3) -> Option<PointAndDirection> {
        for &(index, inside, refracts) in &self.events {
            let Ball { sphere, body } = &self.balls[index];
            let (near, far) = sphere_roots(sphere, position, onwards)?;
            position += if inside { far } else { near } * onwards;
            let outward = (position - sphere.center.as_dvec3()).normalize();
            let normal = if inside { -outward } else { outward };
            onwards = match *body {
                Body::Glass(ior) if refracts => {
                    let ior = f64::from(ior);
                    refract_exactly(onwards, normal, if inside { ior } else { ior.recip() })?
                }
                _ => reflect_exactly(onwards, normal),
            };
        }
        (onwards.y < 0.0).then(|| PointAndDirection {
            position: position + (f64::from(FLOOR) - position.y) / onwards.y * onwards,
            direction: onwards,
        })
    }
}

/// All ways from a start to the floor with at least one event, and the margin that each keeps
/// from silhouettes and critical angles, in radians.
fn exact_paths<'a>(balls: &'a [Ball], origin: DVec3, onwards: DVec3) -> Vec<(ExactPath<'a>, f64)> {
    let mut done = Vec::new();
    let mut pending = vec![(Vec::new(), origin, onwards, f64::INFINITY)];
    while let Some((events, position, onwards, margin)) = pending.pop() {
        // Not the sphere that the ray has just left outwards.
        let nearest = (0..balls.len())
            .filter_map(|index| {
                let (near, far) = sphere_roots(&balls[index].sphere, position, onwards)?;
                if near > 1e-6 {
                    Some((near, index, false))
                } else {
                    (far > 1e-6).then_some((far, index, true))
                }
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let floor = (f64::from(FLOOR) - position.y) / onwards.y;
        let Some((t, index, inside)) = nearest.filter(|it| floor < 0.0 || it.0 < floor) else {
            if floor > 0.0 && !events.is_empty() {
                let steepness = (-onwards.y).asin();
                done.push((ExactPath { balls, events }, margin.min(steepness)));
            }
            continue;
        };
        if events.len() == 6 {
            continue;
        }
        let at = position + t * onwards;
        let Ball { sphere, body } = &balls[index];
        let outward = (at - sphere.center.as_dvec3()).normalize();
        let normal = if inside { -outward } else { outward };
        let cosine = -onwards.dot(normal);
        let margin = margin.min(cosine.asin());
        let with = |refracts| {
            let mut events = events.clone();
            events.push((index, inside, refracts));
            events
        };
        pending.push((with(false), at, reflect_exactly(onwards, normal), margin));
        if let Body::Glass(ior) = *body {
            let ior = f64::from(ior);
            let eta = if inside { ior } else { ior.recip() };
            let critical = if eta > 1.0 {
                eta.recip().asin() - cosine.acos()
            } else {
                1.0
            };
            if let Some(refracted) = refract_exactly(onwards, normal, eta) {
                pending.push((with(true), at, refracted, margin.min(critical)));
            }
        }
    }
    done
}

#[derive(Clone, Debug)]
struct Draw {
    balls: Vec<Ball>,
    origin: Vec3,
    aim: DVec3,
}

/// Up to three spheres that do not meet, side by side, a light above, and a ray into the first.
fn draw() -> impl Strategy<Value = Draw> {
    let body = prop_oneof![3 => (1.2f32..2.0).prop_map(Body::Glass), 1 => Just(Body::Mirror)];
    let ball = (prop::array::uniform3(-0.2f32..0.2), 0.2f32..0.7, body);
    (
        prop::collection::vec(ball, 1..4),
        prop::array::uniform3(-0.5f32..0.5),
        (-1.0..1.0, 0.0..TAU, 0.0f64..0.95),
    )
        .prop_map(|(balls, origin, (cosine, azimuth, depth))| {
            let balls: Vec<Ball> = balls
                .into_iter()
                .enumerate()
                .map(|(place, (shift, radius, body))| {
                    // The second stands lower, where the first throws its light.
                    let seat = [
                        Vec3::ZERO,
                        Vec3::new(0.9, -0.8, 0.4),
                        Vec3::new(-1.9, 0.1, 0.0),
                    ];
                    let radius = if place == 1 { 0.5 * radius } else { radius };
                    let sphere = Sphere::new(seat[place] + 0.5 * Vec3::from(shift), radius);
                    Ball {
                        sphere: sphere.expect("a valid sphere"),
                        body,
                    }
                })
                .collect();
            let first = balls[0].sphere;
            let inside = depth * f64::from(first.radius) * direction(cosine, azimuth);
            let aim = first.center.as_dvec3() + inside;
            Draw {
                balls,
                origin: Vec3::new(0.0, 3.0, 0.0) + Vec3::from(origin),
                aim,
            }
        })
}

fn scene_of(balls: &[Ball]) -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, FLOOR, 200.0);
    for Ball { sphere, body } in balls {
        let material = match *body {
            Body::Glass(ior) => Material::dielectric("glass", ior),
            Body::Mirror => Material::metal("mirror", [0.9; 3]),
        };
        add_sphere(&mut scene, sphere.center, sphere.radius, material);
    }
    scene
}

fn apart(balls: &[Ball]) -> bool {
    balls.iter().enumerate().all(|(index, a)| {
        balls[..index].iter().all(|b| {
            a.sphere.center.distance(b.sphere.center) > a.sphere.radius + b.sphere.radius + 0.01
        })
    })
}

/// The derivatives of a landing point in the light's two directions, in f64; `None` where a start
/// that is moved and turned by a few roundings of f32, magnified as the path magnifies it, changes
/// them by more than a tenth of the tolerance.
fn exact_axes(path: &ExactPath<'_>, draw: &Draw, turns: [Vec3; 2]) -> Option<[DVec3; 2]> {
    let onwards = (draw.aim - draw.origin.as_dvec3()).normalize();
    let axis = |turn: Vec3, noise: DVec3| {
        let start = draw.origin.as_dvec3() + noise;
        let center = (onwards + noise).normalize();
        derivative(0.1, |step| {
            path.follow(start, (center + step * turn.as_dvec3()).normalize())
        })
        .map(|it| it.position)
    };
    let mut axes = [DVec3::ZERO; 2];
    for (exact, turn) in axes.iter_mut().zip(turns) {
        *exact = axis(turn, DVec3::ZERO)?;
        for seed in [DVec3::X, DVec3::Y, DVec3::Z] {
            let moved = axis(turn, 4.0 * f64::from(f32::EPSILON) * seed)?;
            if (moved - *exact).length() > 1e-4 * exact.length() {
                return None;
            }
        }
    }
    Some(axes)
}

#[test]
fn axes_of_photons_through_spheres_are_exact_derivatives() {
    const TOLERANCE: f64 = 1e-3;
    let (kept, skipped, by_events) = (Cell::new(0u32), Cell::new(0u32), Cell::new([0u32; 7]));
    let worst = Cell::new(0.0f64);
    let mut runner = TestRunner::new(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(400)
    });
    let outcome = runner.run(&draw(), |draw| {
        prop_assume!(apart(&draw.balls));
        let scene = scene_of(&draw.balls);
        let (_, intersector) = flattened(&scene);
        let onwards = (draw.aim - draw.origin.as_dvec3()).normalize();
        let ray = onwards.as_vec3();
        let map = trace_one(&scene, &intersector, single_ray(draw.origin, ray, SPACING));
        if map.ledger.bounded_differentials > 0 {
            skipped.set(skipped.get() + map.photons.len() as u32);
            return Ok(());
        }
        let turns = initial_turns(&scene, draw.origin, ray);
        for (path, margin) in exact_paths(&draw.balls, draw.origin.as_dvec3(), onwards) {
            let Some(landed) = path.follow(draw.origin.as_dvec3(), onwards) else {
                continue;
            };
            let exact = (margin > common::MARGIN && landed.position.abs().max_element() < 100.0)
                .then(|| exact_axes(&path, &draw, turns))
                .flatten();
            let Some(exact) = exact else {
                skipped.set(skipped.get() + 1);
                continue;
            };
            let events = path.events.len();
            let found = map
                .photons
                .iter()
                .filter(|photon| photon.events as usize == events)
                .min_by(|a, b| {
                    let distance = |it: &Photon| it.position.as_dvec3().distance(landed.position);
                    distance(a).total_cmp(&distance(b))
                });
            prop_assert!(
                found.is_some(),
                "no photon of {events} events at {landed:?}"
            );
            let photon = found.expect("just checked");
            let miss = photon.position.as_dvec3().distance(landed.position);
            prop_assert!(
                miss < 1e-3 * (1.0 + landed.position.length()),
                "{miss} off: {landed:?}"
            );
            kept.set(kept.get() + 1);
            let mut counts = by_events.get();
            counts[events] += 1;
            by_events.set(counts);
            for (axis, exact) in photon.axes.iter().zip(exact) {
                let error = relative_error(*axis, exact);
                worst.set(worst.get().max(error));
                prop_assert!(error < TOLERANCE, "{error:e} after {:?}", path.events);
                // The control: a tenth of a per cent shows.
                prop_assert!(relative_error(1.0021 * *axis, exact) > TOLERANCE);
            }
        }
        Ok(())
    });
    let (kept, skipped) = (kept.get(), skipped.get());
    println!(
        "{kept} kept, {skipped} skipped, by events {:?}, worst error {:e}",
        by_events.get(),
        worst.get()
    );
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    assert!(kept > 2 * skipped, "{kept} kept, {skipped} skipped");
}
