//! What lights send out, and where: total flux, its spread over the light's rays, and the flux that
//! reaches what they are aimed at.

use crate::common;

use std::f64::consts::{PI, TAU};

use caustics_accel::Intersect;
use caustics_geometry::shapes::{quad, uv_sphere};
use caustics_geometry::{Frame, Sphere};
use caustics_sampling::{CounterRng, PointSet, Sequence};
use caustics_scene::{Light, Material, Scene, World};
use caustics_trace::glam::{DVec3, Vec2, Vec3};
use caustics_trace::{Aim, BLUR_EDGE, Casters, Emission, EmissionSample, Emitter};
use common::scenes::{add_floor, add_mesh, add_sphere, flattened};
use proptest::prelude::*;

const BALL: Sphere = Sphere {
    center: Vec3::new(0.2, 0.0, -0.1),
    radius: 0.5,
};

fn world(light: Light) -> World {
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 3.0);
    let glass = Material::dielectric("glass", 1.5);
    add_sphere(&mut scene, BALL.center, BALL.radius, glass);
    scene.add_light(light).expect("a valid light");
    World::new(&scene).expect("a small world")
}

fn emitters(world: &World, aim: Aim) -> Vec<Emitter> {
    Emitter::all(world, &Casters::of(world), aim)
}

fn panel() -> Light {
    let edges = [Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.1, -0.3, 0.8)];
    Light::rectangle([-0.3, 2.0, -0.2], edges, [2.0; 3]).expect("a valid light")
}

fn triangle() -> Light {
    let corners = [[-0.6, 2.0, -0.5], [0.9, 2.2, -0.1], [-0.1, 1.7, 0.8]];
    // Wound clockwise as seen from above: it shines downwards.
    Light::triangle(corners, [2.0; 3]).expect("a valid light")
}

fn lights() -> Vec<Light> {
    let lights = [
        Light::point([0.3, 2.0, 0.4], [3.0; 3]),
        Light::spot([0.3, 2.0, 0.4], [0.1, -1.0, 0.2], [3.0; 3], 0.4, 0.9),
        Light::directional([0.2, -1.0, 0.1], [3.0; 3]),
        Ok(panel()),
        Light::disc([0.0, 2.0, 0.3], [0.2, -1.0, 0.0], 0.6, [2.0; 3]),
        Light::sphere([0.4, 2.0, 0.3], 0.7, [2.0; 3]),
        Ok(triangle()),
    ];
    lights.map(|light| light.expect("a valid light")).into()
}

/// `count` photons at independent random points.
fn random_photons(world: &World, emitter: &Emitter, count: u32, seed: u64) -> Vec<Emission<4>> {
    (0..count)
        .filter_map(|index| {
            let mut rng = CounterRng::new(seed, u64::from(index));
            let sample = EmissionSample {
                point: rng.next_vec2(),
                spacing: [Vec2::X, Vec2::Y],
                place: rng.next_vec2(),
                count,
                weight: 1.0,
            };
            emitter.emit::<4>(world, &sample)
        })
        .collect()
}

/// Bins along each of the four coordinates of a ray.
const BINS: [usize; 4] = [4, 4, 3, 4];

/// Where a light's ray stands among all, in coordinates of the unit cube in which its flux should
/// be even, and the flux there relative to the mean.
fn coordinates(light: &Light, world: &World, ray: &Emission<4>) -> ([f64; 4], f64) {
    let turn = |x: f32, y: f32| (f64::from(y).atan2(f64::from(x)) / TAU).rem_euclid(1.0);
    let direction = ray.ray.direction;
    // Of a Lambertian surface: the square of the cosine and the azimuth.
    let lambertian = |normal: Vec3| {
        let local = Frame::from_normal(normal).to_local(direction);
        [f64::from(local.z * local.z), turn(local.x, local.y)]
    };
    match *light {
        Light::Point { .. } => {
            let height = 0.5 + 0.5 * f64::from(direction.z);
            ([height, turn(direction.x, direction.y), 0.0, 0.0], 1.0)
        }
        Light::Spot {
            direction: axis,
            inner_cos,
            outer_cos,
            ..
        } => {
            let local = Frame::from_normal(axis).to_local(direction);
            // The part of the flux inside this cone: the ramp's square, integrated.
            let ramp = f64::from(inner_cos - outer_cos);
            let whole = (1.0 - f64::from(inner_cos)) + ramp / 3.0;
            let t = (f64::from(local.z - outer_cos) / ramp).clamp(0.0, 1.0);
            let inside = (1.0 - f64::from(local.z.max(inner_cos))) + ramp * (1.0 - t.powi(3)) / 3.0;
            let first = if local.z > inner_cos {
                (1.0 - f64::from(local.z)) / whole
            } else {
                inside / whole
            };
            ([first, turn(local.x, local.y), 0.0, 0.0], 1.0)
        }
        Light::Directional { direction, .. } => {
            let (center, radius) = world.bounds().bounding_sphere();
            let (tangent, bitangent) = direction.any_orthonormal_pair();
            let along = |axis: Vec3| {
                let across = (ray.ray.origin - center).dot(axis);
                f64::from(0.5 + 0.5 * across / (1.001 * radius))
            };
            ([along(tangent), along(bitangent), 0.0, 0.0], 1.0)
        }
        Light::Rectangle { corner, edges, .. } => {
            let from_corner = ray.ray.origin - corner;
            let normal = edges[0].cross(edges[1]);
            // Oblique coordinates by the reciprocal basis.
            let first =
                edges[1].cross(normal).dot(from_corner) / edges[1].cross(normal).dot(edges[0]);
            let second =
                edges[0].cross(normal).dot(from_corner) / edges[0].cross(normal).dot(edges[1]);
            let [square, azimuth] = lambertian(normal.normalize());
            ([f64::from(first), f64::from(second), square, azimuth], 1.0)
        }
        Light::Triangle {
            corners: [a, b, c], ..
        } => {
            let normal = (b - a).cross(c - a);
            let inside = ray.ray.origin - a;
            let of_b = inside.cross(c - a).dot(normal) / normal.length_squared();
            let of_c = (b - a).cross(inside).dot(normal) / normal.length_squared();
            // Of the area as much lies this near to the first corner, and on this side of a line
            // through it.
            let near = f64::from(of_b + of_c);
            let aside = f64::from(of_c) / near.max(1e-30);
            let [square, azimuth] = lambertian(normal.normalize());
            ([near * near, aside, square, azimuth], 1.0)
        }
        Light::Disc {
            center,
            normal,
            radius,
            ..
        } => {
            let local = Frame::from_normal(normal).to_local((ray.ray.origin - center) / radius);
            let [square, azimuth] = lambertian(normal);
            let reach = f64::from(local.truncate().length_squared());
            ([reach, turn(local.x, local.y), square, azimuth], 1.0)
        }
        Light::Sphere { center, .. } => {
            let normal = (ray.ray.origin - center).normalize();
            let [square, azimuth] = lambertian(normal);
            let height = 0.5 + 0.5 * f64::from(normal.y);
            ([height, turn(normal.x, normal.z), square, azimuth], 1.0)
        }
        _ => unreachable!("all lights are above"),
    }
}

/// The chi-square statistic of flux in bins of the unit cube, and its degrees of freedom.
fn chi_square(light: &Light, world: &World, photons: &[Emission<4>], power: f64) -> (f64, f64) {
    let dimensions = if light.area().is_some() { 4 } else { 2 };
    let bins = &BINS[..dimensions];
    let count: usize = bins.iter().product();
    let mut sums = vec![(0.0f64, 0.0f64); count];
    for photon in photons {
        let (at, _) = coordinates(light, world, photon);
        let bin = bins.iter().zip(at).fold(0, |bin, (&n, x)| {
            bin * n + ((x * n as f64) as usize).min(n - 1)
        });
        let flux = f64::from(photon.flux.x);
        sums[bin].0 += flux;
        sums[bin].1 += flux * flux;
    }
    let expected = power / count as f64;
    let statistic = sums
        .iter()
        .map(|&(flux, squares)| (flux - expected).powi(2) / squares)
        .sum();
    (statistic, count as f64)
}

/// Five standard deviations of a chi-square distribution above its mean.
fn limit(freedom: f64) -> f64 {
    freedom + 5.0 * (2.0 * freedom).sqrt()
}

#[test]
fn flux_is_even_over_the_rays_of_every_light() {
    for light in lights() {
        let world = world(light);
        let emitter = &emitters(&world, Aim::Everywhere)[0];
        let photons = random_photons(&world, emitter, 200_000, 1);
        let (statistic, freedom) = chi_square(&light, &world, &photons, emitter.power().x);
        println!("{statistic:.1} of {freedom} for {light:?}");
        assert!(
            statistic < limit(freedom),
            "{statistic} of {freedom}: {light:?}"
        );
        // The control: a fifth more light from one half of the directions.
        let tilted: Vec<Emission<4>> = photons
            .iter()
            .map(|photon| {
                let (at, _) = coordinates(&light, &world, photon);
                let more = if at[0] < 0.5 { 1.1 } else { 0.9 };
                Emission {
                    flux: more * photon.flux,
                    ..*photon
                }
            })
            .collect();
        let (statistic, freedom) = chi_square(&light, &world, &tilted, emitter.power().x);
        assert!(
            statistic > limit(freedom),
            "{statistic} of {freedom}: {light:?}"
        );
    }
}

/// An emissive panel of two triangles, and an emissive ball, shine as the lights of their shape do.
#[test]
fn flux_is_even_over_the_rays_of_emissive_objects() {
    let ball = Light::sphere([0.4, 2.0, 0.3], 0.7, [2.0; 3]).expect("a valid light");
    for light in [panel(), ball] {
        let mut scene = Scene::new();
        add_floor(&mut scene, -1.0, 3.0);
        let lamp = Material::diffuse("lamp", [0.0; 3]).with_emission([2.0; 3]);
        match light {
            Light::Rectangle { corner, edges, .. } => {
                let mesh = quad(corner, edges[0], edges[1]).expect("a panel");
                add_mesh(&mut scene, "panel", mesh, lamp);
            }
            Light::Sphere { center, radius, .. } => add_sphere(&mut scene, center, radius, lamp),
            _ => unreachable!("these two"),
        }
        let world = World::new(&scene).expect("a small world");
        let emitters = emitters(&world, Aim::Everywhere);
        let [emitter] = &emitters[..] else {
            panic!("one side of one object shines");
        };
        let flux = light.flux().expect("an area");
        let error = (emitter.power().x / f64::from(flux.x) - 1.0).abs();
        assert!(error < 1e-5, "{error:e}");
        let photons = random_photons(&world, emitter, 200_000, 2);
        let (statistic, freedom) = chi_square(&light, &world, &photons, emitter.power().x);
        println!("{statistic:.1} of {freedom}");
        assert!(statistic < limit(freedom), "{statistic} of {freedom}");
    }
}

#[test]
fn photons_of_a_lattice_carry_the_whole_flux() {
    for light in lights() {
        let world = world(light);
        let emitter = &emitters(&world, Aim::Everywhere)[0];
        let points = PointSet::new(Sequence::Grid, 40_000, 0);
        let flux: DVec3 = (0..points.count())
            .filter_map(|index| emitter.emit::<4>(&world, &EmissionSample::of(&points, index)))
            .map(|photon| photon.flux.as_dvec3())
            .sum();
        let error = (flux.x - emitter.power().x).abs() / emitter.power().x;
        // A spot light's cone is not smooth at its edges; everything else is constant.
        let tolerance = if matches!(light, Light::Spot { .. }) {
            2e-4
        } else {
            2e-6
        };
        assert!(error < tolerance, "{error:e}: {light:?}");
    }
}

/// The part of photons aimed at an inscribed ball that miss it.
fn missed(count: u32, sequence: Sequence) -> f64 {
    let mut scene = Scene::new();
    let mesh = uv_sphere(0.5, 64, 32).expect("a valid ball");
    add_mesh(&mut scene, "ball", mesh, Material::dielectric("glass", 1.5));
    scene.add_light(panel()).expect("a valid light");
    let (world, rays) = flattened(&scene);
    let emitter = &emitters(&world, Aim::Casters)[0];
    let points = PointSet::new(sequence, count, 0);
    let sent = (0..count)
        .filter_map(|it| emitter.emit::<4>(&world, &EmissionSample::of(&points, it)))
        .map(|photon| rays.closest_hit(&photon.ray).is_none());
    let (missed, all) = sent.fold((0, 0), |(missed, all), it| {
        (missed + u32::from(it), all + 1)
    });
    f64::from(missed) / f64::from(all)
}

#[test]
fn a_lattice_misses_as_much_as_there_is_to_miss() {
    // Between the ball and the cone that just holds it is a quarter of a cell at most: points in the middles
    // of their cells would all meet the ball.
    let (found, expected) = (
        missed(160_000, Sequence::Grid),
        missed(1_000_000, Sequence::Halton),
    );
    println!("{found:.3e} for {expected:.3e}");
    assert!(
        (found / expected - 1.0).abs() < 0.2,
        "{found} for {expected}"
    );
}

/// Where a photon's ray meets the ball.
fn meets_ball(photon: &Emission<4>) -> bool {
    BALL.intersect(&photon.ray).is_some()
}

/// The mean over independent photons, and its standard error.
fn flux_to_ball(world: &World, aim: Aim, count: u32) -> (f64, f64) {
    let emitter = &emitters(world, aim)[0];
    let photons = random_photons(world, emitter, count, 3);
    let (mut sum, mut squares) = (0.0, 0.0);
    for photon in photons.iter().filter(|it| meets_ball(it)) {
        let flux = f64::from(photon.flux.x);
        sum += flux;
        squares += flux * flux;
    }
    (
        sum,
        (squares - sum * sum / f64::from(count)).max(0.0).sqrt(),
    )
}

/// The solid angle of a triangle seen from the origin (Van Oosterom and Strackee 1983).
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).abs().atan2(below)
}

/// By reciprocity a flat light that has a ball before it sends it `pi L r² Omega`, with the solid
/// angle of the light as the ball's centre sees it; every photon that is aimed at the ball is.
#[test]
fn flat_lights_send_a_ball_what_the_closed_form_says() {
    let center = BALL.center.as_dvec3();
    let (corner, edges) = match panel() {
        Light::Rectangle { corner, edges, .. } => (corner.as_dvec3() - center, edges),
        _ => unreachable!("a panel is a rectangle"),
    };
    let [a, b] = edges.map(Vec3::as_dvec3);
    let panel_angle = solid_angle(corner, corner + a, corner + b)
        + solid_angle(corner + a + b, corner + a, corner + b);
    let corners = match triangle() {
        Light::Triangle { corners, .. } => corners.map(|it| it.as_dvec3() - center),
        _ => unreachable!("a triangle"),
    };
    let triangle_angle = solid_angle(corners[0], corners[1], corners[2]);
    let over = BALL.center + 1.5 * Vec3::Y;
    let disc = Light::disc(over, [0.0, -1.0, 0.0], 0.8, [2.0; 3]).expect("a valid light");
    let disc_angle = TAU * (1.0 - 1.5 / 1.5f64.hypot(0.8));
    for (light, angle) in [
        (panel(), panel_angle),
        (triangle(), triangle_angle),
        (disc, disc_angle),
    ] {
        let world = world(light);
        let radius = f64::from(BALL.radius);
        let exact = PI * 2.0 * radius * radius * angle;
        for aim in [Aim::Everywhere, Aim::Casters] {
            let (flux, error) = flux_to_ball(&world, aim, 100_000);
            println!("{flux:.5} +- {error:.1e}, exactly {exact:.5}: {aim:?}");
            assert!((flux - exact).abs() < 4.0 * error, "{aim:?} {light:?}");
        }
        let (_, error) = flux_to_ball(&world, Aim::Casters, 100_000);
        assert!(error < 1e-3 * exact, "aimed photons vary by {error}");
    }
}

/// The same of photons that stand on a lattice in direction and on a sequence in place.
#[test]
fn a_lattice_sends_a_ball_what_the_closed_form_says() {
    for (height, reach) in [(1.5f64, 0.8f64), (4.2, 0.1), (4.2, 0.8)] {
        let over = BALL.center + height as f32 * Vec3::Y;
        let disc = Light::disc(over, [0.0, -1.0, 0.0], reach as f32, [2.0; 3]);
        let world = world(disc.expect("a valid light"));
        let emitter = &emitters(&world, Aim::Casters)[0];
        let radius = f64::from(BALL.radius);
        let angle = TAU * (1.0 - height / height.hypot(reach));
        let exact = PI * 2.0 * radius * radius * angle;
        for count in [4096, 40_000, 131_072] {
            let points = PointSet::new(Sequence::Grid, count, 0);
            let flux: f64 = (0..count)
                .filter_map(|index| emitter.emit::<4>(&world, &EmissionSample::of(&points, index)))
                .filter(meets_ball)
                .map(|photon| f64::from(photon.flux.x))
                .sum();
            let error = flux / exact - 1.0;
            println!("{height} {reach} {count}: {error:e}");
            assert!(error.abs() < 2e-3, "{error:e}");
        }
    }
}

#[test]
fn a_shining_ball_sends_as_much_aimed_as_unaimed() {
    for radius in [0.05, 0.7, 1.4] {
        let light = Light::sphere([0.4, 2.0, 0.3], radius, [2.0; 3]).expect("a valid light");
        let world = world(light);
        let (aimed, aimed_error) = flux_to_ball(&world, Aim::Casters, 200_000);
        let (unaimed, error) = flux_to_ball(&world, Aim::Everywhere, 2_000_000);
        println!("{radius}: {aimed} +- {aimed_error:.1e}, {unaimed} +- {error:.1e}");
        assert!((aimed - unaimed).abs() < 4.0 * error.hypot(aimed_error));
        assert!(aimed_error < error);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        max_global_rejects: 100_000,
        ..ProptestConfig::with_cases(2_000)
    })]

    /// In its first two parameters a ray of a light with an area turns as the map of directions
    /// does from the same place, in its last two it moves as the map of places does.
    #[test]
    fn differentials_are_those_of_the_map_in_all_four_parameters(
        kind in 3usize..7,
        aim in prop_oneof![Just(Aim::Everywhere), Just(Aim::Casters)],
        point in (0.03f32..0.97, 0.03f32..0.97),
        place in (0.03f32..0.97, 0.03f32..0.97),
        count in 1000u32..1_000_000,
    ) {
        const STEP: f32 = 4e-3;
        let world = world(lights()[kind]);
        let emitter = &emitters(&world, aim)[0];
        let (point, place) = (Vec2::new(point.0, point.1), Vec2::new(place.0, place.1));
        for at in [point, place] {
            let off = at - Vec2::splat(0.5);
            let creases = [off.x, off.y, off.x + off.y, off.x - off.y];
            prop_assume!(creases.iter().all(|it| it.abs() > 4.0 * STEP));
        }
        let sample = EmissionSample { point, spacing: [Vec2::ZERO; 2], place, count, weight: 1.0 };
        let emission = emitter.emit::<4>(&world, &sample);
        prop_assume!(emission.is_some());
        let emission = emission.expect("just checked");
        let mut factors = [[0.0; 2]; 2];
        for (axis, step) in [STEP * Vec2::X, STEP * Vec2::Y].into_iter().enumerate() {
            let turned = [1.0, -1.0, 2.0, -2.0].map(|times| {
                let point = point + times * step;
                emitter.emit::<4>(&world, &EmissionSample { point, ..sample })
            });
            let moved = [1.0, -1.0, 2.0, -2.0].map(|times| {
                let place = place + times * step;
                emitter.emit::<4>(&world, &EmissionSample { place, ..sample })
            });
            let cases = [
                (turned, axis, emission.differential.direction[axis]),
                (moved, 2 + axis, emission.differential.position[2 + axis]),
            ];
            for (case, (around, parameter, found)) in cases.into_iter().enumerate() {
                let [Some(after), Some(before), Some(farther), Some(rear)] = around else {
                    // Neighbours below the horizon.
                    return Err(TestCaseError::reject("at the horizon"));
                };
                let value = |it: &Emission<4>| {
                    if case == 0 { it.ray.direction } else { it.ray.origin }
                };
                let difference = |a: &Emission<4>, b: &Emission<4>| -> DVec3 {
                    (value(a) - value(b)).as_dvec3() / f64::from(2.0 * STEP)
                };
                let exact = (4.0 * difference(&after, &before)
                    - 0.5 * difference(&farther, &rear)) / 3.0;
                let factor = found.as_dvec3().dot(exact) / exact.length_squared();
                let error = (found.as_dvec3() - factor * exact).length() / found.as_dvec3().length();
                let rounding = 12.0 * f64::from(f32::EPSILON / STEP) / exact.length();
                prop_assert!(error < 2e-3 + rounding, "{parameter}: {error:e}");
                factors[case][axis] = factor;
                // Each parameter moves or turns the ray, not both.
                let other = if case == 0 {
                    emission.differential.position[parameter]
                } else {
                    emission.differential.direction[parameter]
                };
                prop_assert_eq!(other, Vec3::ZERO);
            }
        }
        // Alike in both of a pair: a lattice's step of directions, and a part of the places.
        for [one, other] in factors {
            prop_assert!((one / other - 1.0).abs() < 1e-2, "{one} {other}");
        }
        let share = factors[0][0] * factors[1][0] * f64::from(count).sqrt();
        prop_assert!((share / f64::from(BLUR_EDGE) - 1.0).abs() < 1e-2, "{share}");
    }
}
