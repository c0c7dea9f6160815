//! Whole chains of up to six specular events: the differential that the crate carries through them
//! against central differences in f64 of a path that knows no differentials.
//!
//! The tolerance is a relative error of 10⁻³ for every derivative, at least 0.2 degrees away from
//! critical angles and silhouettes. A chain whose *exact* derivative moves by more than a tenth of
//! that when its rays, normals and displacements are moved by two roundings of f32 is skipped:
//! there the answer is not determined by the f32 path, and no arithmetic of the differential could
//! give it. The filter asks only the f64 path, never the crate, and the suite counts what it skips.
//!
//! Of 6,000 chains 4,382 were kept in one run; the worst error was 1.5 10⁻⁴.

use crate::common;

use std::cell::Cell;

use caustics_geometry::{Plane, Sphere, Triangle};
use caustics_trace::RayDifferential;
use caustics_trace::glam::{DVec3, Vec3};
use common::central::PointAndDirection;
use common::chain::{Chain, Change, Jitter, Operations, Shape, changed, is_regular};
use common::{direction, relative_error, tilted};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// How far a derivative may be from the exact one, relative to it.
const TOLERANCE: f64 = 1e-3;

/// Two roundings of f32, relative.
const JITTER: f64 = 2.0 * f32::EPSILON as f64;

const TAU: f64 = std::f64::consts::TAU;

/// One event before its place is known.
#[derive(Clone, Debug)]
struct EventDraw {
    kind: u8,
    refracts: bool,
    eta: f64,
    /// Distance from the event before, and radius or size, both over the chain's scale, log10.
    log_distance: f64,
    log_size: f64,
    angle: f64,
    azimuth: f64,
    weights: (f64, f64),
    /// Angle and azimuth from the geometric normal, for three vertices.
    bends: [(f64, f64); 3],
}

#[derive(Clone, Debug)]
struct ChainDraw {
    log_scale: f64,
    origin: (f64, f64, f64),
    start: (f64, f64),
    /// Logarithms of the magnitudes of the derivatives, and their angles.
    changes: [(f64, f64, f64); 4],
    events: Vec<EventDraw>,
    landing: (f64, f64, f64),
}

fn event() -> impl Strategy<Value = EventDraw> {
    let steepest = std::f64::consts::FRAC_PI_2 - common::MARGIN;
    (
        (0u8..4, any::<bool>(), 0.4..2.5),
        (-1.0..0.5, -0.3..1.5),
        (0.0..steepest, 0.0..TAU),
        (0.1..0.45, 0.1..0.45),
        prop::array::uniform3((0.0..0.4, 0.0..TAU)),
    )
        .prop_map(|(kind, sizes, angles, weights, bends)| EventDraw {
            kind: kind.0,
            refracts: kind.1,
            eta: kind.2,
            log_distance: sizes.0,
            log_size: sizes.1,
            angle: angles.0,
            azimuth: angles.1,
            weights,
            bends,
        })
}

fn chain() -> impl Strategy<Value = ChainDraw> {
    (
        -3.0..3.0,
        (-1.0..1.0, -1.0..1.0, -1.0..1.0),
        (-1.0..1.0, 0.0..TAU),
        prop::array::uniform4((-4.0..0.0, -1.0..1.0, 0.0..TAU)),
        prop::collection::vec(event(), 1..=6),
        (-1.0..0.5, 0.0..1.5, 0.0..TAU),
    )
        .prop_map(
            |(log_scale, origin, start, changes, events, landing)| ChainDraw {
                log_scale,
                origin,
                start,
                changes,
                events,
                landing,
            },
        )
}

/// The shape of a draw, put where the ray from `origin` along `onwards` meets it at `angle`.
fn shape(draw: &EventDraw, scale: f64, origin: DVec3, onwards: DVec3) -> Option<Shape> {
    let distance = scale * 10f64.powf(draw.log_distance);
    let size = scale * 10f64.powf(draw.log_size);
    let place = origin + distance * onwards;
    let normal = tilted(-onwards, draw.angle, draw.azimuth);
    match draw.kind {
        0 => Plane::new(place.as_vec3(), normal.as_vec3())
            .ok()
            .map(Shape::Plane),
        1 | 2 => {
            // From within only where the ray starts within.
            let inside = draw.kind == 2 && distance < 1.9 * size * draw.angle.cos();
            let center = if inside {
                place + size * normal
            } else {
                place - size * normal
            };
            let sphere = Sphere::new(center.as_vec3(), size as f32).ok()?;
            Some(Shape::Sphere { sphere, inside })
        }
        _ => {
            let (right, up) = normal.any_orthonormal_pair();
            let (e1, e2) = (size * right, size * (0.3 * right + up));
            let (u, v) = draw.weights;
            let a = place - u * e1 - v * e2;
            let triangle = Triangle::new(a.as_vec3(), (a + e1).as_vec3(), (a + e2).as_vec3());
            let normals = draw
                .bends
                .map(|(angle, azimuth)| tilted(normal, angle, azimuth).as_vec3());
            Some(Shape::Triangle { triangle, normals })
        }
    }
}

/// The chain of a draw, less the events that are too near to a silhouette or a critical angle;
/// `None` where no event is left.
fn build(draw: &ChainDraw) -> Option<Chain> {
    let scale = 10f64.powf(draw.log_scale);
    let origin = (scale * DVec3::new(draw.origin.0, draw.origin.1, draw.origin.2)).as_vec3();
    let first = direction(draw.start.0, draw.start.1).as_vec3().normalize();
    let change = |(log_length, cosine, azimuth): (f64, f64, f64), unit: f64| -> Vec3 {
        (unit * 10f64.powf(log_length) * direction(cosine, azimuth)).as_vec3()
    };
    // The derivative of a unit vector is across it.
    let turn = |draw| {
        let turned = change(draw, 1.0);
        turned - turned.dot(first) * first
    };
    let [moved_u, moved_v, turned_u, turned_v] = draw.changes;
    let mut chain = Chain {
        origin,
        direction: first,
        differential: RayDifferential {
            position: [change(moved_u, scale), change(moved_v, scale)],
            direction: [turn(turned_u), turn(turned_v)],
        },
        events: Vec::new(),
        scale,
    };
    let (mut position, mut onwards) = (origin.as_dvec3(), first.as_dvec3().normalize());
    for event in &draw.events {
        let shape = shape(event, scale, position, onwards)?;
        let hit = shape.hit(position, onwards)?;
        // Nothing is transmitted beyond the critical angle: such an event reflects.
        let refract = Change::Refract(event.eta as f32);
        let transmits = changed(refract, onwards, hit.shading).is_some();
        let change = if event.refracts && transmits {
            refract
        } else {
            Change::Reflect
        };
        if !is_regular(change, onwards, &hit) {
            continue;
        }
        onwards = changed(change, onwards, hit.shading)?;
        position = hit.position;
        chain.events.push((shape, change));
    }
    if chain.events.is_empty() {
        return None;
    }
    let (log_distance, angle, azimuth) = draw.landing;
    let place = position + scale * 10f64.powf(log_distance) * onwards;
    let normal = tilted(-onwards, angle, azimuth);
    let floor = Plane::new(place.as_vec3(), normal.as_vec3()).ok()?;
    chain.events.push((Shape::Plane(floor), Change::Land));
    Some(chain)
}

/// The exact derivatives, if two roundings move none of them by a tenth of the tolerance.
fn well_conditioned(chain: &Chain) -> Option<[PointAndDirection; 2]> {
    let exact = chain.exact(Jitter::NONE)?;
    // With six of them a chain was once kept that moves by more than the limit; it was off by 1.2e-3.
    let steady = (1..=24u64).all(|seed| {
        chain
            .exact(Jitter {
                seed,
                relative: JITTER,
            })
            .is_some_and(|moved| {
                (0..2).all(|i| moved[i].relative_difference(&exact[i]) < 0.1 * TOLERANCE)
            })
    });
    steady.then_some(exact)
}

/// The largest relative error of a derivative.
fn worst_error(found: &RayDifferential<2>, exact: &[PointAndDirection; 2]) -> f64 {
    (0..2).fold(0.0, |worst: f64, i| {
        let position = relative_error(found.position[i], exact[i].position);
        let direction = relative_error(found.direction[i], exact[i].direction);
        worst.max(position).max(direction)
    })
}

#[test]
fn chains_agree_with_central_differences() {
    let tally: [[Cell<u32>; 2]; 7] = Default::default();
    let worst = Cell::new(0.0f64);
    let mut runner = TestRunner::new(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(6_000)
    });
    let outcome = runner.run(&chain(), |draw| {
        let built = build(&draw);
        prop_assume!(built.is_some());
        let chain = built.expect("just checked");
        // The landing is no event.
        let [kept, skipped] = &tally[chain.events.len() - 1];
        let Some(exact) = well_conditioned(&chain) else {
            skipped.set(skipped.get() + 1);
            return Ok(());
        };
        kept.set(kept.get() + 1);
        let found = chain.differentiated(Operations::Crate);
        prop_assert!(found.is_some(), "the f32 path misses a surface: {chain:?}");
        let error = worst_error(&found.expect("just checked"), &exact);
        worst.set(worst.get().max(error));
        prop_assert!(error < TOLERANCE, "off by {error:e}: {chain:?}");
        Ok(())
    });
    let counts = tally
        .each_ref()
        .map(|[kept, skipped]| (kept.get(), skipped.get()));
    println!(
        "kept and skipped by events: {counts:?}, worst error {:e}",
        worst.get()
    );
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    let (kept, skipped) = counts
        .iter()
        .fold((0, 0), |sum, it| (sum.0 + it.0, sum.1 + it.1));
    assert!(
        kept > 2 * skipped,
        "only {kept} of {} chains are well conditioned",
        kept + skipped
    );
    // Three in four of all chains are kept, and half of those with six events.
    let (kept, skipped) = counts[6];
    assert!(
        2 * kept > skipped,
        "of six events: {kept} kept, {skipped} skipped"
    );
}

/// A comparison that accepts a wrong derivative proves nothing.
#[test]
fn wrong_derivatives_are_rejected() {
    for (operations, matters) in [
        (
            Operations::WithoutMuSlope,
            (|(_, change)| matches!(change, Change::Refract(eta) if (eta - 1.0).abs() > 0.05))
                as fn(&(Shape, Change)) -> bool,
        ),
        (Operations::WithoutNormalChange, |(shape, _)| {
            !matches!(shape, Shape::Plane(_))
        }),
        (Operations::WithoutDistanceChange, |_| true),
    ] {
        let (rejected, accepted) = (Cell::new(0u32), Cell::new(0u32));
        let mut runner = TestRunner::new(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(400)
        });
        let outcome = runner.run(&chain(), |draw| {
            let built = build(&draw).filter(|chain| chain.events.iter().any(matters));
            prop_assume!(built.is_some());
            let chain = built.expect("just checked");
            if let Some(exact) = well_conditioned(&chain) {
                let found = chain.differentiated(operations);
                let right = found.is_some_and(|found| worst_error(&found, &exact) < TOLERANCE);
                let tally = if right { &accepted } else { &rejected };
                tally.set(tally.get() + 1);
            }
            Ok(())
        });
        if let Err(failure) = outcome {
            panic!("{failure}");
        }
        println!(
            "{operations:?}: {} rejected, {} accepted",
            rejected.get(),
            accepted.get()
        );
        assert!(rejected.get() > 100, "{operations:?} was hardly tried");
        // Light that comes straight on, or through almost nothing, hides a missing term.
        assert!(
            rejected.get() >= 20 * accepted.get(),
            "{operations:?}: {} of {} chains accepted",
            accepted.get(),
            rejected.get() + accepted.get()
        );
    }
}
