//! What an environment sends out: total flux, its spread over directions and places, and what it says
//! about a photon's neighbours.

use crate::common;

use std::f64::consts::{PI, TAU};

use caustics_geometry::Sphere;
use caustics_sampling::CounterRng;
use caustics_scene::{Environment, Material, Scene, World};
use caustics_trace::glam::{DVec3, Vec2, Vec3};
use caustics_trace::{
    Aim, BLUR_EDGE, Casters, Emission, EmissionDomain, EmissionSample, Emitter, LightSource,
};
use common::relative_error;
use common::scenes::{add_floor, add_sphere};
use proptest::prelude::*;

const BALL: Sphere = Sphere {
    center: Vec3::new(0.2, 0.0, -0.1),
    radius: 0.5,
};

const WIDTH: u32 = 16;
const HEIGHT: u32 = 8;

/// Dim all around, with a spot that is a thousand times as bright.
fn world() -> World {
    let pixels = (0..WIDTH * HEIGHT).map(|it| [if it == 21 { 1000.0 } else { 1.0 }; 3]);
    let sky = Environment::new(WIDTH, HEIGHT, pixels.collect()).expect("a sky");
    let mut scene = Scene::new();
    add_floor(&mut scene, -1.0, 3.0);
    let glass = Material::dielectric("glass", 1.5);
    add_sphere(&mut scene, BALL.center, BALL.radius, glass);
    scene.set_environment(Some(sky));
    World::new(&scene).expect("a small world")
}

fn emitter(world: &World, aim: Aim) -> Emitter {
    let mut emitters = Emitter::all(world, &Casters::of(world), aim);
    assert_eq!(emitters.len(), 1);
    let emitter = emitters.remove(0);
    assert_eq!(emitter.source(), LightSource::Environment);
    emitter
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

/// On a ball falls the sky's radiance, integrated over all directions, times its cross-section.
#[test]
fn the_sky_sends_a_ball_its_total_times_the_cross_section() {
    const COUNT: u32 = 200_000;
    let world = world();
    let total = f64::from(world.environment().expect("a sky").total().x);
    let exact = PI * f64::from(BALL.radius).powi(2) * total;
    for aim in [Aim::Everywhere, Aim::Casters] {
        let emitter = emitter(&world, aim);
        let photons = random_photons(&world, &emitter, COUNT, 3);
        let (mut flux, mut squares) = (0.0, 0.0);
        for photon in photons
            .iter()
            .filter(|it| BALL.intersect(&it.ray).is_some())
        {
            flux += f64::from(photon.flux.x);
            squares += f64::from(photon.flux.x).powi(2);
        }
        let error = (squares - flux * flux / f64::from(COUNT)).max(0.0).sqrt();
        println!("{flux:.5} +- {error:.1e}, exactly {exact:.5}: {aim:?}");
        // Where photons miss the ball, which one in 60 does by the margin of its outline.
        assert!((flux - exact).abs() < 4.0 * error + 1e-6 * exact, "{aim:?}");
        // Importance: all carry the same flux, bright texel or dim.
        let first = photons[0].flux.x;
        assert!(
            photons
                .iter()
                .all(|it| (it.flux.x / first - 1.0).abs() < 1e-4)
        );
    }
}

/// The flux of each texel's directions is its radiance times its solid angle, even over the texel's
/// own height and turn and over the cross-section of what the light is aimed at.
#[test]
fn flux_is_even_over_directions_and_places() {
    const BINS: [usize; 4] = [2, 2, 3, 4];
    let world = world();
    for aim in [Aim::Everywhere, Aim::Casters] {
        let emitter = emitter(&world, aim);
        let EmissionDomain::Sky { target, .. } = *emitter.domain() else {
            panic!("the emitter of a sky");
        };
        let cross_section = PI * f64::from(target.radius).powi(2);
        let photons = random_photons(&world, &emitter, 400_000, 7);
        let per_texel: usize = BINS.iter().product();
        let mut sums = vec![(0.0f64, 0.0f64); per_texel * (WIDTH * HEIGHT) as usize];
        let mut expected = vec![0.0; sums.len()];
        let edge = |row: u32| (PI * f64::from(row) / f64::from(HEIGHT)).cos();
        for texel in 0..WIDTH * HEIGHT {
            let row = texel / WIDTH;
            let angle = TAU / f64::from(WIDTH) * (edge(row) - edge(row + 1));
            let radiance = if texel == 21 { 1000.0 } else { 1.0 };
            let first = texel as usize * per_texel;
            expected[first..first + per_texel]
                .fill(radiance * angle * cross_section / per_texel as f64);
        }
        for photon in &photons {
            let towards = -photon.ray.direction.as_dvec3();
            let turn = towards.x.atan2(-towards.z) / TAU + 0.5;
            let column = turn.rem_euclid(1.0) * f64::from(WIDTH);
            let row = ((towards.y.acos() / PI * f64::from(HEIGHT)) as u32).min(HEIGHT - 1);
            let down = (edge(row) - towards.y) / (edge(row) - edge(row + 1));
            // Where it crosses the disc, in a basis of its own.
            let from_middle = (photon.ray.origin - target.center).as_dvec3();
            let across =
                (from_middle - from_middle.dot(towards) * towards) / f64::from(target.radius);
            let (tangent, bitangent) = towards.any_orthonormal_pair();
            let around = across.dot(bitangent).atan2(across.dot(tangent)) / TAU;
            let at = [
                down,
                column.fract(),
                across.length_squared(),
                around.rem_euclid(1.0),
            ];
            let texel = row * WIDTH + (column as u32).min(WIDTH - 1);
            let bin = BINS.iter().zip(at).fold(texel as usize, |bin, (&n, x)| {
                bin * n + ((x * n as f64) as usize).min(n - 1)
            });
            let flux = f64::from(photon.flux.x);
            sums[bin].0 += flux;
            sums[bin].1 += flux * flux;
        }
        // All carry the same flux: the variance of a bin's sum is its mean times that, also where
        // few photons fall.
        let each = f64::from(photons[0].flux.x);
        let statistic = |tilt: fn(usize) -> f64| -> f64 {
            let terms = sums.iter().zip(&expected).enumerate();
            terms
                .map(|(bin, (sum, expected))| {
                    (tilt(bin) * sum.0 - expected).powi(2) / (expected * each)
                })
                .sum()
        };
        let freedom = sums.len() as f64;
        let limit = freedom + 5.0 * (2.0 * freedom).sqrt();
        let (even, tilted) = (
            statistic(|_| 1.0),
            // The control: a tenth more light from one half of each texel.
            statistic(|bin| if bin % 48 < 24 { 1.1 } else { 0.9 }),
        );
        println!("{even:.0} and {tilted:.0} of {freedom}: {aim:?}");
        assert!(even < limit, "{even} of {freedom}: {aim:?}");
        assert!(tilted > limit, "{tilted} of {freedom}: {aim:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        max_global_rejects: 100_000,
        ..ProptestConfig::with_cases(2_000)
    })]

    /// In its first two parameters a ray moves as the map of places does, by the lattice's steps. In
    /// its last two it turns about where it crosses the disc, alike in all directions, by a part of
    /// what the directions of its part of the sky spread.
    #[test]
    fn differentials_are_those_of_the_maps(
        aim in prop_oneof![Just(Aim::Everywhere), Just(Aim::Casters)],
        point in (0.03f32..0.97, 0.03f32..0.97),
        place in (0.03f32..0.97, 0.03f32..0.97),
        count in 1000u32..1_000_000,
    ) {
        const STEP: f32 = 4e-3;
        let world = world();
        let emitter = emitter(&world, aim);
        let EmissionDomain::Sky { target, distance } = *emitter.domain() else {
            panic!("the emitter of a sky");
        };
        let (point, place) = (Vec2::new(point.0, point.1), Vec2::new(place.0, place.1));
        let off = point - Vec2::splat(0.5);
        let creases = [off.x, off.y, off.x + off.y, off.x - off.y];
        prop_assume!(creases.iter().all(|it| it.abs() > 4.0 * STEP));
        let sample = EmissionSample { point, spacing: [Vec2::ZERO; 2], place, count, weight: 1.0 };
        let emission = emitter.emit::<4>(&world, &sample).expect("light from everywhere");
        // Central differences, extrapolated.
        let slope = |at: &dyn Fn(Vec2) -> DVec3, axis: Vec2| -> DVec3 {
            let difference = |step: f32| {
                (at(step * axis) - at(-step * axis)) / f64::from(2.0 * step)
            };
            (4.0 * difference(STEP) - difference(2.0 * STEP)) / 3.0
        };
        let moved = |by: Vec2| {
            let sample = EmissionSample { point: point + by, ..sample };
            let emission = emitter.emit::<4>(&world, &sample).expect("light");
            emission.ray.origin.as_dvec3()
        };
        let mut factors = [0.0; 2];
        for (axis, factor) in [Vec2::X, Vec2::Y].into_iter().zip(&mut factors) {
            let exact = slope(&moved, axis);
            let index = usize::from(axis == Vec2::Y);
            let found = emission.differential.position[index].as_dvec3();
            *factor = found.dot(exact) / exact.length_squared();
            // Of coordinates of some metres, of which the step is a part.
            let rounding = 16.0 * f64::from(f32::EPSILON / STEP * distance) / exact.length();
            let error = relative_error(found.as_vec3(), *factor * exact);
            prop_assert!(error < 1e-3 + rounding, "{error:e}");
            prop_assert_eq!(emission.differential.direction[index], Vec3::ZERO);
        }
        for factor in factors {
            let steps = factor * f64::from(count).sqrt();
            prop_assert!((steps - 1.0).abs() < 1e-2, "{steps}");
        }

        // The directions of two samples nearby, where they are of one texel, spread by the
        // reciprocal of the density.
        let sky = world.environment().expect("a sky");
        let here = sky.sample(place);
        let around = [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y].map(|it| 2.0 * STEP * it);
        let texel = |towards: Vec3| {
            let turn = towards.x.atan2(-towards.z) / std::f32::consts::TAU + 0.5;
            let row = towards.y.acos() / std::f32::consts::PI * HEIGHT as f32;
            (row as u32, (turn * WIDTH as f32) as u32)
        };
        let own = texel(here.towards);
        prop_assume!(around.iter().all(|by| texel(sky.sample(place + *by).towards) == own));
        let towards = |by: Vec2| sky.sample(place + by).towards.as_dvec3();
        let spread = slope(&towards, Vec2::X).cross(slope(&towards, Vec2::Y)).length();
        prop_assert!((spread * f64::from(here.pdf) - 1.0).abs() < 1e-2, "{spread}");
        let [first, second] = [2, 3].map(|it| emission.differential.direction[it]);
        let turned = f64::from(first.cross(second).length());
        let part = turned / spread / f64::from(BLUR_EDGE).powi(2);
        prop_assert!((part - 1.0).abs() < 0.02, "{part}");
        prop_assert!((first.length() / second.length() - 1.0).abs() < 1e-3);
        for turned in [first, second] {
            prop_assert!(turned.dot(emission.ray.direction).abs() < 1e-5 * turned.length());
        }
        // At the disc the neighbours in direction are where the photon is.
        let ahead = (target.center - emission.ray.origin).dot(emission.ray.direction);
        for parameter in 2..4 {
            let differential = &emission.differential;
            let there = differential.position[parameter] + ahead * differential.direction[parameter];
            let reach = ahead * differential.direction[parameter].length();
            prop_assert!(there.length() < 1e-4 * reach, "{there}");
        }
    }
}
