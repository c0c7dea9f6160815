//! What the tracer says about a photon's neighbours behind a mesh with interpolated normals,
//! against f64 over the same triangles and against neighbours that are traced themselves.
//!
//! The rays are those of `traced_spheres`. Photons are told apart by what their paths met, which a
//! ray tracer put in for the crate's own writes down.

use crate::common;

use std::sync::Mutex;

use caustics_accel::Intersect;
use caustics_geometry::shapes::icosphere;
use caustics_geometry::{Hit, Ray};
use caustics_scene::{Light, Material, Scene, SceneIntersector, World};
use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{Photon, RayDifferential};
use common::chain::{Chain, Change, Jitter, Shape, changed, is_regular};
use common::scenes::{
    SPACING, add_floor, add_mesh, add_sphere, flattened, initial_turns, single_ray, trace_one,
};
use common::{direction, relative_error};

const TAU: f64 = std::f64::consts::TAU;

const FLOOR: f32 = -2.0;

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
