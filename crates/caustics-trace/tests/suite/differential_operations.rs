//! Each operation on ray differentials alone, against central differences in f64, at log-uniform
//! scales and at least 0.2 degrees away from critical angles and silhouettes.

use crate::common;

use caustics_geometry::{NormalGradient, Sphere, Triangle};
use caustics_trace::glam::{DVec3, Vec3};
use caustics_trace::{RayDifferential, reflect, refract};
use common::central::{PointAndDirection, derivative};
use common::chain::{Change, ExactHit, changed, is_regular};
use common::{MARGIN, direction, relative_error, tilted};
use proptest::prelude::*;

const TOLERANCE: f64 = 1e-3;
const TAU: f64 = std::f64::consts::TAU;

/// A vector of log-uniform length.
fn vector(log_length: std::ops::Range<f64>) -> impl Strategy<Value = Vec3> {
    (log_length, -1.0..1.0, 0.0..TAU)
        .prop_map(|(log, cosine, azimuth)| (10f64.powf(log) * direction(cosine, azimuth)).as_vec3())
}

/// An event: the light's direction, a normal that it arrives at, and the normal's derivative.
#[derive(Clone, Copy, Debug)]
struct Event {
    direction: Vec3,
    normal: Vec3,
}

fn event() -> impl Strategy<Value = Event> {
    let steepest = std::f64::consts::FRAC_PI_2 - MARGIN;
    (-1.0..1.0, 0.0..TAU, 0.0..steepest, 0.0..TAU).prop_map(|(cosine, azimuth, angle, around)| {
        let onwards = direction(cosine, azimuth);
        let normal = tilted(-onwards, angle, around).as_vec3();
        Event {
            direction: onwards.as_vec3(),
            normal,
        }
    })
}

/// The part of `vector` across the unit vector `axis`: derivatives of unit vectors are such.
fn across(vector: Vec3, axis: Vec3) -> Vec3 {
    let axis = axis.as_dvec3().normalize();
    let vector = vector.as_dvec3();
    (vector - vector.dot(axis) * axis).as_vec3()
}

fn neighbour(value: Vec3, change: Vec3, step: f64) -> DVec3 {
    value.as_dvec3() + step * change.as_dvec3()
}

/// Whether the f64 result is long enough, against what it is the sum of, for f32 to hold it to the
/// tolerance: a hundred roundings of the largest summand stay below it.
fn determined(result: DVec3, summands: &[f64]) -> bool {
    let largest = summands.iter().fold(0.0f64, |a, &b| a.max(b));
    result.length() * TOLERANCE > 100.0 * f64::from(f32::EPSILON) * largest
}

/// A differential with the same derivatives in every parameter.
fn differential(position: Vec3, direction: Vec3) -> RayDifferential<1> {
    RayDifferential {
        position: [position],
        direction: [direction],
    }
}

/// The exact derivative of the direction after an event at a normal with a given derivative.
fn exact_event(
    event: &Event,
    change: Change,
    direction_change: Vec3,
    normal_change: Vec3,
) -> Option<DVec3> {
    let size = direction_change.length().max(normal_change.length());
    derivative(1e-3 / f64::from(size), |step| {
        let direction = neighbour(event.direction, direction_change, step).normalize();
        let normal = neighbour(event.normal, normal_change, step).normalize();
        let direction = changed(change, direction, normal)?;
        Some(PointAndDirection {
            position: DVec3::ZERO,
            direction,
        })
    })
    .map(|exact| exact.direction)
}

/// How fast a direction changes after refraction for a normal or a direction that changes by 1.
fn sensitivity(event: &Event, eta: f64) -> f64 {
    let cosine = -event.direction.as_dvec3().dot(event.normal.as_dvec3());
    let along_refracted = (1.0 - eta * eta * (1.0 - cosine * cosine)).max(0.0).sqrt();
    eta + eta * eta * cosine / along_refracted
}

proptest! {
    #![proptest_config(ProptestConfig {
        // About a quarter of the refractions would be total reflections.
        max_global_rejects: 40_000,
        failure_persistence: None,
        ..ProptestConfig::with_cases(20_000)
    })]

    #[test]
    fn transfer_to_a_plane(
        event in event(),
        log_distance in -3.0..3.0,
        moved in vector(-6.0..0.0),
        turned in vector(-6.0..0.0),
    ) {
        let distance = 10f64.powf(log_distance) as f32;
        let turned = across(turned, event.direction);
        let found = differential(moved, turned)
            .transferred(event.direction, distance, event.normal);
        let size = f64::from(moved.length()) + f64::from(distance * turned.length());
        let normal = event.normal.as_dvec3().normalize();
        let onwards = event.direction.as_dvec3().normalize();
        // The plane lies `distance` ahead of the start, which is the origin.
        let plane = f64::from(distance) * onwards;
        let exact = derivative(1e-3 * f64::from(distance) / size, |step| {
            let origin = step * moved.as_dvec3();
            let direction = neighbour(event.direction, turned, step).normalize();
            let t = (plane - origin).dot(normal) / direction.dot(normal);
            Some(PointAndDirection { position: origin + t * direction, direction })
        });
        prop_assume!(exact.is_some());
        let exact = exact.expect("just checked");
        let slope = -onwards.dot(normal);
        prop_assume!(determined(exact.position, &[size, size * slope.recip()]));
        let error = relative_error(found.position[0], exact.position);
        prop_assert!(error < TOLERANCE, "off by {error:e}");
        prop_assert_eq!(found.direction[0], turned);
    }

    #[test]
    fn reflection_at_a_turning_normal(
        event in event(),
        turned in vector(-6.0..0.0),
        bent in vector(-6.0..3.0),
    ) {
        let (turned, bent) = (across(turned, event.direction), across(bent, event.normal));
        let found = differential(Vec3::X, turned)
            .reflected(event.direction, event.normal, [bent]);
        let exact = exact_event(&event, Change::Reflect, turned, bent);
        prop_assume!(exact.is_some());
        let exact = exact.expect("just checked");
        let summands = [turned, bent].map(|it| 2.0 * f64::from(it.length()));
        prop_assume!(determined(exact, &summands));
        let error = relative_error(found.direction[0], exact);
        prop_assert!(error < TOLERANCE, "off by {error:e}");
        prop_assert_eq!(found.position[0], Vec3::X);
    }

    #[test]
    fn refraction_at_a_turning_normal(
        event in event(),
        eta in 0.3f32..3.0,
        turned in vector(-6.0..0.0),
        bent in vector(-6.0..3.0),
    ) {
        let onwards = event.direction.as_dvec3().normalize();
        let normal = event.normal.as_dvec3().normalize();
        let hit = ExactHit { position: DVec3::ZERO, geometric: normal, shading: normal };
        prop_assume!(is_regular(Change::Refract(eta), onwards, &hit));
        let refracted = refract(event.direction, event.normal, eta);
        prop_assert!(refracted.is_some(), "0.2 degrees below the critical angle");
        let refracted = refracted.expect("just checked");
        let (turned, bent) = (across(turned, event.direction), across(bent, event.normal));
        let found = differential(Vec3::X, turned)
            .refracted(event.direction, refracted, event.normal, eta, [bent]);
        let exact = exact_event(&event, Change::Refract(eta), turned, bent);
        prop_assume!(exact.is_some());
        let exact = exact.expect("just checked");
        let amplification = sensitivity(&event, f64::from(eta));
        let summands = [turned, bent].map(|it| amplification * f64::from(it.length()));
        prop_assume!(determined(exact, &summands));
        let error = relative_error(found.direction[0], exact);
        prop_assert!(error < TOLERANCE, "off by {error:e}");

        // The control: without the derivative of mu the same comparison fails, unless the normal
        // and the angle to it stay as they are.
        let mu = eta * event.direction.dot(event.normal) - refracted.dot(event.normal);
        let wrong = relative_error(eta * turned - mu * bent, exact);
        let along_change = turned.dot(event.normal) + event.direction.dot(bent);
        let slope = 2.0 * f64::from(eta) - amplification;
        let missing = slope.abs() * f64::from(along_change).abs();
        prop_assert!(missing < 3.0 * TOLERANCE * exact.length() || wrong > TOLERANCE);
    }

    /// Spheres and triangles as surfaces: transfer, the normal's gradient, and the event.
    #[test]
    fn events_at_curved_surfaces(
        event in event(),
        eta in prop_oneof![Just(None), (0.3f32..3.0).prop_map(Some)],
        on_sphere in any::<bool>(),
        log_size in -3.0..3.0,
        log_moved in -6.0..-1.0,
        moved in vector(-1.0..0.0),
        bends in prop::array::uniform3((0.0..0.4, 0.0..TAU)),
        weights in (0.1..0.45, 0.1..0.45),
    ) {
        let size = 10f64.powf(log_size);
        let normal = event.normal.as_dvec3().normalize();
        let onwards = event.direction.as_dvec3().normalize();
        // In the surface's plane, a part of its size.
        let moved = (size * 10f64.powf(log_moved)) as f32 * across(moved, event.normal);
        type Surface = Box<dyn Fn(DVec3) -> DVec3>;
        let (gradient, exact_normal): (NormalGradient, Surface) = if on_sphere {
            let sphere = Sphere::new(Vec3::ZERO, size as f32).expect("a valid sphere");
            let point = (size * normal).as_vec3();
            let exact = move |at: DVec3| (point.as_dvec3() + at).normalize();
            (NormalGradient::on_sphere(&sphere, point), Box::new(exact))
        } else {
            let (right, up) = normal.any_orthonormal_pair();
            let (e1, e2) = (size * right, size * (0.3 * right + up));
            let (u, v): (f64, f64) = weights;
            let a = -u * e1 - v * e2;
            let corners = [a, a + e1, a + e2].map(DVec3::as_vec3);
            let triangle = Triangle::new(corners[0], corners[1], corners[2]);
            let normals = bends.map(|(angle, azimuth)| tilted(normal, angle, azimuth).as_vec3());
            let gradient = NormalGradient::on_triangle(&triangle, normals, u as f32, v as f32);
            prop_assert!(gradient.is_some());
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let cross = (b - a).cross(c - a);
            let [na, nb, nc] = normals.map(Vec3::as_dvec3);
            let center = a + f64::from(u as f32) * (b - a) + f64::from(v as f32) * (c - a);
            let exact = move |at: DVec3| {
                let from_a = center + at - a;
                let u = from_a.cross(c - a).dot(cross) / cross.length_squared();
                let v = (b - a).cross(from_a).dot(cross) / cross.length_squared();
                ((1.0 - u - v) * na + u * nb + v * nc).normalize()
            };
            (gradient.expect("just checked"), Box::new(exact))
        };
        let shading = exact_normal(DVec3::ZERO);
        let change = eta.map_or(Change::Reflect, Change::Refract);
        let hit = ExactHit { position: DVec3::ZERO, geometric: normal, shading };
        prop_assume!(shading.dot(onwards) < 0.0 && is_regular(change, onwards, &hit));
        let bent = [gradient.along(moved)];
        let start = differential(moved, Vec3::ZERO);
        let found = match eta {
            None => start.reflected(event.direction, gradient.normal, bent),
            Some(eta) => {
                let refracted = refract(event.direction, gradient.normal, eta);
                prop_assert!(refracted.is_some());
                let refracted = refracted.expect("just checked");
                start.refracted(event.direction, refracted, gradient.normal, eta, bent)
            }
        };
        let exact = derivative(1e-3 * size / f64::from(moved.length()), |step| {
            let normal = exact_normal(step * moved.as_dvec3());
            let direction = changed(change, onwards, normal)?;
            Some(PointAndDirection { position: DVec3::ZERO, direction })
        });
        prop_assume!(exact.is_some());
        let exact = exact.expect("just checked").direction;
        let turning = Event { direction: event.direction, normal: gradient.normal };
        let amplification = eta.map_or(2.0, |eta| sensitivity(&turning, f64::from(eta)));
        // Vertex normals that nearly agree have derivatives that are a small difference.
        let bending = f64::from(moved.length()) / size;
        prop_assume!(determined(exact, &[amplification * bending]));
        let error = relative_error(found.direction[0], exact);
        prop_assert!(error < TOLERANCE, "off by {error:e}");
        // The control: a normal that does not turn.
        let wrong = match eta {
            None => start.reflected(event.direction, gradient.normal, [Vec3::ZERO]),
            Some(_) => start,
        };
        prop_assert!(relative_error(wrong.direction[0], exact) > TOLERANCE);
    }
}

#[test]
fn scaling_scales_all_derivatives() {
    let plain = RayDifferential {
        position: [Vec3::X, Vec3::Y],
        direction: [Vec3::Z, Vec3::NEG_X],
    };
    let wide = plain.scaled(2.5);
    assert_eq!(wide.position, [2.5 * Vec3::X, 2.5 * Vec3::Y]);
    assert_eq!(wide.direction, [2.5 * Vec3::Z, -2.5 * Vec3::X]);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(5_000)
    })]

    /// With two parameters the axes are the displacements; with four their covariance is a part of that
    /// of the steps and a disc.
    #[test]
    fn axes_keep_of_the_steps_what_does_not_overlap(
        angles in (-1.0..1.0, 0.0..TAU),
        moved in prop::array::uniform4(vector(-2.0..2.0)),
    ) {
        let normal = direction(angles.0, angles.1).as_vec3().normalize();
        let moved = moved.map(|it| across(it, normal));
        let two = RayDifferential { position: [moved[0], moved[1]], direction: [Vec3::ZERO; 2] };
        prop_assert_eq!(two.footprint_axes(normal), [moved[0], moved[1]]);
        let four = RayDifferential { position: moved, direction: [Vec3::ZERO; 4] };
        let axes = four.footprint_axes(normal);
        let [steps, blurs] = [[moved[0], moved[1]], [moved[2], moved[3]]].map(|pair| {
            let [one, other] = pair.map(Vec3::as_dvec3);
            let squares = one.length_squared() + other.length_squared();
            one.cross(other).length().max(0.01 * squares)
        });
        let covered = steps + 4.0 * (steps * blurs).sqrt();
        let own = steps / covered;
        for probe in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.6, 0.0, 0.8)] {
            let probe = across(probe, normal).as_dvec3();
            let spread = |vectors: &[Vec3]| -> f64 {
                vectors.iter().map(|it| it.as_dvec3().dot(probe).powi(2)).sum()
            };
            let disc = (covered - own * steps) * probe.length_squared();
            let expected = own * spread(&moved[..2]) + disc;
            let scale = own * moved[..2].iter().map(|it| f64::from(it.length_squared())).sum::<f64>();
            let difference = spread(&axes) - expected;
            prop_assert!(difference.abs() < 1e-5 * (scale + covered), "{difference} of {expected}");
        }
        for axis in axes {
            prop_assert!(axis.dot(normal).abs() < 1e-6 * axis.length() + f32::MIN_POSITIVE);
        }
    }

    #[test]
    fn reflection_of_directions_is_what_is_differentiated(event in event()) {
        let exact = changed(Change::Reflect, event.direction.as_dvec3(), event.normal.as_dvec3());
        let error = relative_error(reflect(event.direction, event.normal), exact.unwrap());
        prop_assert!(error < 1e-6);
    }
}
