//! Differentials *on* critical angles and silhouettes, where the true derivative is infinite:
//! everything stays finite, the limit holds and is reported, and energy is kept.

use crate::common;

use caustics_scene::{Light, LightError, Material, Scene};
use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{RayDifferential, TraceOptions, fresnel_dielectric, refract, trace_photons};
use common::scenes::{add_sphere, flattened};
use common::{direction, tilted};
use proptest::prelude::*;

const TAU: f64 = std::f64::consts::TAU;

/// How far from the limit, in radians: on it, or beyond by a few roundings up to 0.2 degrees, on
/// either side.
fn offset() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        (-9.0..-2.5).prop_map(|log: f64| 10f64.powf(log)),
        (-9.0..-2.5).prop_map(|log: f64| -(10f64.powf(log))),
    ]
}

/// A vector of a length from 10⁻¹² to 10¹².
fn vector() -> impl Strategy<Value = Vec3> {
    (-12.0..12.0, -1.0..1.0, 0.0..TAU)
        .prop_map(|(log, cosine, azimuth)| (10f64.powf(log) * direction(cosine, azimuth)).as_vec3())
}

fn differential() -> impl Strategy<Value = RayDifferential<2>> {
    (
        prop::array::uniform2(vector()),
        prop::array::uniform2(vector()),
    )
        .prop_map(|(position, direction)| RayDifferential {
            position,
            direction,
        })
}

fn is_finite<const N: usize>(differential: &RayDifferential<N>) -> bool {
    differential
        .position
        .iter()
        .chain(&differential.direction)
        .all(|it| it.is_finite())
}

/// What [`RayDifferential::bounded`] promises about its result.
fn check_bounds(before: &RayDifferential<2>, limit: f32) -> Result<(), TestCaseError> {
    let (bounded, shortened) = before.bounded(limit);
    prop_assert!(is_finite(&bounded), "{bounded:?}");
    let mut too_long = !is_finite(before);
    for (short, long) in bounded.direction.iter().zip(&before.direction) {
        prop_assert!(short.length() <= limit * (1.0 + 4.0 * f32::EPSILON));
        let exact = long.as_dvec3();
        if long.is_finite() && exact.length() > f64::from(limit) * (1.0 + 1e-6) {
            too_long = true;
            // Only the length changes.
            let along = short.as_dvec3().normalize().dot(exact.normalize());
            prop_assert!(along > 1.0 - 1e-6 && short.length() > limit * (1.0 - 1e-6));
        } else if exact.length() < f64::from(limit) * (1.0 - 1e-6) {
            prop_assert_eq!(short, long);
        }
    }
    // At the limit itself either answer is right.
    let near = before
        .direction
        .iter()
        .any(|it| (it.as_dvec3().length() / f64::from(limit) - 1.0).abs() <= 2e-6);
    prop_assert!(
        shortened == too_long || near,
        "shortened {shortened}, too long {too_long}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(20_000)
    })]

    #[test]
    fn at_the_critical_angle(
        normal in (-1.0..1.0, 0.0..TAU),
        azimuth in 0.0..TAU,
        eta in 1.001f32..3.0,
        offset in offset(),
        before in differential(),
        bent in prop::array::uniform2(vector()),
        limit in 0.01f32..2.0,
    ) {
        let normal = direction(normal.0, normal.1);
        let critical = (1.0 / f64::from(eta)).asin();
        let onwards = -tilted(normal, critical + offset, azimuth);
        let (onwards, normal) = (onwards.as_vec3(), normal.as_vec3());
        let reflectance = fresnel_dielectric(-onwards.dot(normal), eta);
        prop_assert!((0.0..=1.0).contains(&reflectance));
        let Some(refracted) = refract(onwards, normal, eta) else {
            prop_assert_eq!(reflectance, 1.0);
            return Ok(());
        };
        prop_assert!((refracted.length() - 1.0).abs() < 1e-6);
        prop_assert!(refracted.dot(normal) <= 0.0 + f32::EPSILON);
        // Fresnel lets through the less, the nearer the angle: as the transmitted cosine t,
        // 4 a t / (a + t)² of either polarisation, with a = eta c and c / eta. The cosine itself
        // is known to the root of a few roundings.
        let (exact_eta, cosine) = (f64::from(eta), -onwards.as_dvec3().dot(normal.as_dvec3()));
        let transmitted = (1.0 - exact_eta * exact_eta * (1.0 - cosine * cosine) + 1e-5).sqrt();
        prop_assert!(f64::from(1.0 - reflectance) <= 4.0 * transmitted * exact_eta / cosine);
        let after = before.refracted(onwards, refracted, normal, eta, bent);
        check_bounds(&after, limit)?;
        prop_assert_eq!(after.position, before.position);
    }

    #[test]
    fn at_a_silhouette(
        normal in (-1.0..1.0, 0.0..TAU),
        azimuth in 0.0..TAU,
        eta in 0.3f32..3.0,
        offset in offset(),
        log_distance in -6.0..6.0,
        before in differential(),
        bent in prop::array::uniform2(vector()),
        limit in 0.01f32..2.0,
    ) {
        let normal = direction(normal.0, normal.1);
        let onwards = -tilted(normal, std::f64::consts::FRAC_PI_2 - offset.abs(), azimuth);
        let (onwards, normal) = (onwards.as_vec3(), normal.as_vec3());
        let distance = 10f64.powf(log_distance) as f32;
        let landed = before.transferred(onwards, distance, normal);
        prop_assert!(is_finite(&landed), "{landed:?}");
        prop_assert!(landed.footprint_axes(normal).iter().all(|axis| axis.is_finite()));
        check_bounds(&landed, limit)?;
        check_bounds(&landed.reflected(onwards, normal, bent), limit)?;
        let reflectance = fresnel_dielectric(-onwards.dot(normal), eta);
        prop_assert!((0.0..=1.0).contains(&reflectance));
        prop_assert!(eta < 1.0 || reflectance > 0.98 || (eta - 1.0) < 0.01);
        if let Some(refracted) = refract(onwards, normal, eta) {
            check_bounds(&landed.refracted(onwards, refracted, normal, eta, bent), limit)?;
        } else {
            prop_assert_eq!(reflectance, 1.0);
        }
    }

    /// Slopes down to the least f32, whatever a path may have made of its direction.
    #[test]
    fn in_the_plane_itself(
        slope in prop_oneof![
            Just(0.0f32), Just(-0.0), Just(1e-45), Just(-1e-45), Just(f32::MIN_POSITIVE),
            Just(-1e-38), Just(1e-30), Just(-1e-20), Just(1e-10),
        ],
        distance in prop_oneof![Just(0.0f32), Just(1e-30), Just(1.0), Just(1e20)],
        before in differential(),
        bent in prop::array::uniform2(vector()),
        eta in 0.3f32..3.0,
    ) {
        let onwards = Vec3::new(1.0, slope, 0.0);
        let landed = before.transferred(onwards, distance, Vec3::Y);
        prop_assert!(is_finite(&landed), "{landed:?}");
        check_bounds(&landed, 0.5)?;
        check_bounds(&landed.reflected(onwards, Vec3::Y, bent), 0.5)?;
        // Refraction straight into the surface has no finite derivative either.
        for refracted in [onwards, Vec3::X, -Vec3::X] {
            check_bounds(&before.refracted(onwards, refracted, Vec3::Y, eta, bent), 0.5)?;
        }
        // Four parameters, whose axes are made from squares.
        let four = RayDifferential {
            position: [landed.position[0], landed.position[1], Vec3::X, Vec3::ZERO],
            direction: [Vec3::ZERO; 4],
        };
        let axes = four.footprint_axes(Vec3::Y);
        prop_assert!(axes.iter().all(|axis| !axis.is_nan()), "{axes:?}");
    }
}

/// The derivative grows towards the critical angle as the true one does: with the inverse square
/// root of the distance.
#[test]
fn the_derivative_diverges_as_it_should() {
    let eta = 1.5f32;
    let critical = (1.0 / f64::from(eta)).asin();
    let length = |offset: f64| {
        let onwards = -tilted(DVec3::Y, critical - offset, 0.0);
        let onwards = onwards.as_vec3();
        let refracted = refract(onwards, Vec3::Y, eta).expect("below the critical angle");
        let (side, _) = onwards.any_orthonormal_pair();
        let across = onwards.cross(Vec3::Y).normalize();
        let in_plane = (side - side.dot(across) * across).normalize();
        RayDifferential::<1> {
            position: [Vec3::ZERO],
            direction: [in_plane],
        }
        .refracted(onwards, refracted, Vec3::Y, eta, [Vec3::ZERO])
        .direction[0]
            .length()
    };
    for offset in [1e-2, 1e-3, 1e-4] {
        let ratio = length(0.25 * offset) / length(offset);
        assert!((ratio - 2.0).abs() < 0.05, "at {offset}: {ratio}");
    }
}

/// The part of photons aimed at a mirror ball whose differentials were shortened.
fn bounded(light: Result<Light, LightError>) -> f64 {
    let mut scene = Scene::new();
    add_sphere(
        &mut scene,
        Vec3::ZERO,
        0.5,
        Material::metal("metal", [0.9; 3]),
    );
    scene
        .add_light(light.expect("a valid light"))
        .expect("a valid light");
    let (world, intersector) = flattened(&scene);
    let options = TraceOptions {
        photons: 40_000,
        guide_emission: false,
        ..TraceOptions::default()
    };
    let map = trace_photons(&world, &intersector, &options, &|_| {}).expect("valid options");
    map.ledger.bounded_differentials as f64 / f64::from(options.photons)
}

#[test]
fn light_of_a_lamp_that_grazes_a_ball_is_bounded_and_counted() {
    const ABOVE: [f32; 3] = [0.0, 3.0, 0.0];
    let lamp = |radius: f32| bounded(Light::disc(ABOVE, [0.0, -1.0, 0.0], radius, [1.0; 3]));
    // 800 of 40,000 cells lie along the edge of the cone, of each of which the outer 0.3 are too near it.
    let found = lamp(1e-4);
    assert!((0.004..0.008).contains(&found), "{found}");
    // Where an eighth of the blur is wider than a step, that counts.
    let found = lamp(0.3);
    assert!((0.1..0.4).contains(&found), "{found}");
    // Neighbours tell where the light of a point ends.
    let found = bounded(Light::point(ABOVE, [1.0; 3]));
    assert!(found < 1e-3, "{found}");
}
