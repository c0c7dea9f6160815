//! What the tracer says about a photon's neighbours against where neighbours really land.
//!
//! A spot light as narrow as one spacing of photons, asked for one photon, sends it along its axis,
//! so that a chosen ray goes through the real tracer, and its neighbours are the same light turned
//! a little. Photons split at every interface, without roulette, so that each branch of a path has
//! its own photon and no flux is rescaled.

mod common;

use caustics_accel::Intersect;
use caustics_geometry::shapes::icosphere;
use caustics_geometry::{Hit, Ray, Sphere};
use caustics_sampling::{PointSet, Sequence};
use caustics_scene::{Light, Material, Scene, SceneIntersector, World};
use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{Aim, EmissionSample, Emitter, Photon, RayDifferential};
use common::central::{PointAndDirection, derivative};
use common::chain::{Chain, Change, Jitter, Shape, changed, is_regular};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened, single_ray, trace_one};
use common::{direction, reflect_exactly, refract_exactly, relative_error};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use std::sync::Mutex;

const TAU: f64 = std::f64::consts::TAU;

/// The spacing of photons, in radians: about as small as a spot light can be, so that few
/// differentials meet their bound.
const SPACING: f32 = 2e-3;

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

/// The photon that the light's only ray becomes, and the two directions in which its neighbours
/// leave, per spacing.
fn initial_turns(scene: &Scene, origin: Vec3, onwards: Vec3) -> [Vec3; 2] {
    let mut scene = scene.clone();
    scene
        .add_light(single_ray(origin, onwards, SPACING))
        .expect("a valid light");
    let world = World::new(&scene).expect("a small world");
    let emitters = Emitter::all(&world, Aim::Everywhere);
    let sample = EmissionSample::of(&PointSet::new(Sequence::Grid, 1, 0), 0);
    let emission = emitters[0]
        .emit::<2>(&sample)
        .expect("the axis is in the cone");
    assert!((emission.ray.direction - onwards.normalize()).length() < 1e-6);
    emission.differential.direction
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

/// A ray tracer that notes every hit of a single photon's branches: an engine's own would stand in
/// for the crate's in the same way.
struct Recorder<'a> {
    tracer: &'a SceneIntersector,
    hits: Mutex<Vec<(Ray, Hit)>>,
}

impl Intersect for Recorder<'_> {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.tracer.closest_hit(ray)?;
        self.hits.lock().expect("one thread").push((*ray, hit));
        Some(hit)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        self.tracer.is_occluded(ray)
    }
}

/// A photon, and the rays of its path with what they hit, the last one first.
#[derive(Debug)]
struct Landing {
    photon: Photon,
    path: Vec<(Ray, Hit)>,
}

impl Landing {
    /// Whether a neighbour met the same primitives on its way.
    fn is_alongside(&self, other: &Self) -> bool {
        let primitives = |it: &Self| it.path.iter().map(|step| step.1.primitive).collect();
        let (mine, theirs): (Vec<u32>, Vec<u32>) = (primitives(self), primitives(other));
        mine == theirs
    }
}

/// Where the photon goes that a light sends along its axis, in all its branches; and whether
/// anything on the way was bounded or took a geometric normal instead of an interpolated one.
fn landings(scene: &Scene, tracer: &SceneIntersector, light: Light) -> (Vec<Landing>, bool) {
    let recorder = Recorder {
        tracer,
        hits: Mutex::default(),
    };
    let map = trace_one(scene, &recorder, light);
    let hits = recorder.hits.into_inner().expect("one thread");
    // Photons are in the order in which their branches hit the floor, which is the first object.
    let on_floor: Vec<usize> = (0..hits.len())
        .filter(|&it| hits[it].1.primitive < 2)
        .collect();
    assert_eq!(on_floor.len(), map.photons.len());
    let landings = map
        .photons
        .iter()
        .zip(on_floor)
        .map(|(photon, last)| {
            let mut path = Vec::new();
            let mut next = Some(last);
            while let Some(index) = next {
                let (ray, hit) = hits[index];
                path.push((ray, hit));
                // A branch starts where an earlier one ended.
                next = (0..index).rev().find(|&earlier| {
                    let (ray_before, hit_before) = &hits[earlier];
                    ray_before.at(hit_before.t).distance(ray.origin) < 1e-5
                });
            }
            assert_eq!(path.len() as u32, photon.events + 1);
            Landing {
                photon: *photon,
                path,
            }
        })
        .collect();
    let limited = map.ledger.bounded_differentials + map.ledger.normal_fallbacks > 0;
    (landings, limited)
}

const GLASS: f32 = 1.5;

/// A tessellated ball of glass beside an exact mirror, over the floor.
fn ball_and_mirror(subdivisions: u32) -> Scene {
    let mut scene = Scene::new();
    add_floor(&mut scene, FLOOR, 20.0);
    let ball = icosphere(0.6, subdivisions).expect("a valid sphere");
    add_mesh(
        &mut scene,
        "ball",
        ball,
        Material::dielectric("glass", GLASS),
    );
    add_sphere(
        &mut scene,
        Vec3::new(1.2, -0.9, 0.3),
        0.4,
        Material::metal("mirror", [0.9; 3]),
    );
    scene
}

/// Directions from a light above into the ball.
fn rays_into_the_ball(count: u32) -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..count).map(|index| {
        let origin = Vec3::new(0.1, 3.0, -0.2);
        let sample = [0u32, 1].map(|axis| f64::from(caustics_sampling::halton(index, axis)));
        let target = 0.55 * sample[0].sqrt() * direction(0.0, TAU * sample[1]);
        (origin, (target - origin.as_dvec3()).normalize().as_vec3())
    })
}

/// The path of a photon as a chain of shapes; `None` where it comes too near to a silhouette or a
/// critical angle.
fn chain_of(world: &World, landing: &Landing, turns: [Vec3; 2]) -> Option<Chain> {
    let steps: Vec<&(Ray, Hit)> = landing.path.iter().rev().collect();
    let (first, _) = steps[0];
    let mut chain = Chain {
        origin: first.origin,
        direction: first.direction,
        differential: RayDifferential {
            position: [Vec3::ZERO; 2],
            direction: turns,
        },
        events: Vec::new(),
        scale: 1.0,
    };
    let (mut position, mut onwards) = (
        first.origin.as_dvec3(),
        first.direction.as_dvec3().normalize(),
    );
    for (place, (ray, hit)) in steps.iter().enumerate() {
        let surface = world.surface(ray, hit).expect("a hit");
        let inside = !surface.from_outside;
        let shape = match (world.sphere(hit.primitive), world.triangle(hit.primitive)) {
            (Some(sphere), _) => Shape::Sphere {
                sphere: *sphere,
                inside,
            },
            (None, triangle) => Shape::Triangle {
                triangle: triangle.expect("a triangle"),
                normals: world.triangle_normals(hit.primitive).expect("its normals"),
            },
        };
        let change = match steps.get(place + 1) {
            None => Change::Land,
            Some((next, _)) => {
                let goes_in = next.direction.dot(surface.geometric_normal) < 0.0;
                let eta = if inside { GLASS } else { GLASS.recip() };
                if goes_in != inside {
                    Change::Refract(eta)
                } else {
                    Change::Reflect
                }
            }
        };
        let exact = shape.hit(position, onwards)?;
        if !is_regular(change, onwards, &exact) {
            return None;
        }
        (position, onwards) = (exact.position, changed(change, onwards, exact.shading)?);
        chain.events.push((shape, change));
    }
    Some(chain)
}

/// The axes of photons that went through triangles with interpolated normals, up to six events,
/// against central differences in f64 over the same triangles.
#[test]
fn axes_of_photons_through_a_mesh_are_exact_derivatives() {
    const TOLERANCE: f64 = 1e-3;
    // Twice the filter of the bare chains: spawned rays step off the surface.
    const JITTER: f64 = 4.0 * f32::EPSILON as f64;
    let scene = ball_and_mirror(5);
    let (world, tracer) = flattened(&scene);
    let (mut kept, mut skipped, mut worst) = ([0u32; 7], [0u32; 7], 0.0f64);
    for (origin, onwards) in rays_into_the_ball(400) {
        let light = single_ray(origin, onwards, SPACING);
        let (landings, limited) = landings(&scene, &tracer, light);
        let turns = initial_turns(&scene, origin, onwards);
        for landing in landings.iter().filter(|it| it.photon.events <= 6) {
            let events = landing.photon.events as usize;
            let exact = chain_of(&world, landing, turns)
                .filter(|_| !limited)
                .and_then(|chain| {
                    let exact = chain.exact(Jitter::NONE)?;
                    let steady = (1..=6u64).all(|seed| {
                        chain
                            .exact(Jitter {
                                seed,
                                relative: JITTER,
                            })
                            .is_some_and(|moved| {
                                (0..2).all(|i| {
                                    moved[i].relative_difference(&exact[i]) < 0.1 * TOLERANCE
                                })
                            })
                    });
                    steady.then_some(exact)
                });
            let Some(exact) = exact else {
                skipped[events] += 1;
                continue;
            };
            kept[events] += 1;
            for (axis, exact) in landing.photon.axes.iter().zip(exact) {
                let error = relative_error(*axis, exact.position);
                worst = worst.max(error);
                assert!(
                    error < TOLERANCE,
                    "off by {error:e} after {events}: {landing:?}"
                );
                // The control: 0.2 per cent show.
                assert!(relative_error(1.0021 * *axis, exact.position) > TOLERANCE);
            }
        }
    }
    println!("{kept:?} kept, {skipped:?} skipped, worst error {worst:e}");
    assert!(
        kept.iter().sum::<u32>() > skipped.iter().sum::<u32>(),
        "{kept:?} of {skipped:?}"
    );
}

/// Neighbours traced as photons of their own, in f32, where they meet the same triangles: at an
/// edge the derivative of an interpolated normal jumps.
#[test]
fn neighbours_land_where_the_axes_say() {
    // A landing is known to a few 10⁻⁷ of the scene's size, over a distance between neighbours of
    // 10⁻³ of it, times what the path magnifies.
    const TOLERANCE: f64 = 1e-2;
    const NEAR: f32 = 1e-3;
    let scene = ball_and_mirror(3);
    let (_, tracer) = flattened(&scene);
    let (mut kept, mut over_edges, mut rough, mut worst) = (0u32, 0u32, 0u32, 0.0f64);
    for (origin, onwards) in rays_into_the_ball(400) {
        let turns = initial_turns(&scene, origin, onwards);
        let traced = |turn: Vec3| {
            let light = single_ray(origin, (onwards + turn).normalize(), SPACING);
            landings(&scene, &tracer, light).0
        };
        let center = traced(Vec3::ZERO);
        for (parameter, turn) in turns.iter().enumerate() {
            let around =
                [NEAR, -NEAR, 2.0 * NEAR, -2.0 * NEAR].map(|by| traced(by * turn.normalize()));
            // Straight through, or off the outside: magnified too little to lose the digits.
            for landing in center.iter().filter(|it| it.photon.events <= 2) {
                let neighbours: Vec<DVec3> = around
                    .iter()
                    .filter_map(|landings| landings.iter().find(|it| it.is_alongside(landing)))
                    .map(|neighbour| neighbour.photon.position.as_dvec3())
                    .collect();
                let [after, before, farther, rear] = neighbours[..] else {
                    over_edges += 1;
                    continue;
                };
                let spacing = f64::from(turn.length() / NEAR);
                let near = 0.5 * spacing * (after - before);
                let far = 0.25 * spacing * (farther - rear);
                // Bent by the third derivative, or lost in the rounding.
                if (near - far).length() > 0.3 * TOLERANCE * near.length() {
                    rough += 1;
                    continue;
                }
                kept += 1;
                let axis = landing.photon.axes[parameter];
                let error = relative_error(axis, near);
                worst = worst.max(error);
                assert!(error < TOLERANCE, "off by {error:e}: {landing:?}");
                // The control: two and a half per cent show.
                assert!(relative_error(1.025 * axis, near) > TOLERANCE);
            }
        }
    }
    println!("{kept} kept, {over_edges} over edges, {rough} rough, worst error {worst:e}");
    assert!(kept > 200 && kept > 2 * rough, "{kept} kept, {rough} rough");
}
