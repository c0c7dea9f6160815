//! The nephroid in a cup: flux and irradiance against one integral over the wall.

use caustics_accel::NearestScratch;
use caustics_render::{NearestEstimate, NearestOptions};
use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::MirrorCylinder;
use caustics_trace::{Photon, TraceOptions};
use glam::{DVec2, Vec3};

const RING: MirrorCylinder = MirrorCylinder {
    radius: 1.0,
    height: 0.9,
    f0: 0.8,
    angle: 0.8,
    sun: 3.0,
};

/// The ring is a prism; its sides are 5e-6 m inside the cylinder.
const SEGMENTS: u32 = 1024;

/// Discs around the axis, one over the cusp, and a box beside it.
fn probes(ring: &MirrorCylinder) -> FluxProbes {
    let rectangle = |x0, z0, x1, z1| Region::Rectangle {
        min: DVec2::new(x0, z0),
        max: DVec2::new(x1, z1),
    };
    let disc = |x, radius| Region::Disc {
        center: DVec2::new(x, 0.0),
        radius,
    };
    let regions = [
        disc(0.0, 0.5),
        disc(0.0, 0.95),
        disc(0.5, 0.15),
        rectangle(0.3, 0.0, 0.6, 0.4),
        rectangle(0.55, -0.5, 0.8, 0.1),
    ];
    FluxProbes::new(regions.map(|region| (region, ring.flux(&region))))
}

fn reflected_inside(photons: &[Photon]) -> Vec<Photon> {
    photons
        .iter()
        .filter(|photon| photon.events == 1)
        .copied()
        .collect()
}

#[test]
fn flux_in_regions_converges() -> Result<(), TestError> {
    let scene = RING.scene(SEGMENTS)?;
    let counts = [1 << 12, 1 << 14, 1 << 16, 1 << 18];
    let errors = convergence(
        &scene,
        &without_chance(Sequence::Halton, 2),
        1,
        &probes(&RING),
        &counts,
        0..4,
    )?;
    assert!(errors[3].error < 1.5e-3, "{errors:?}");
    assert!(errors[3].error < errors[0].error / 8.0, "{errors:?}");
    assert!(
        errors.windows(2).all(|pair| pair[1].error < pair[0].error),
        "{errors:?}"
    );
    Ok(())
}

#[test]
fn a_grid_converges_as_well() -> Result<(), TestError> {
    let (scene, options) = (RING.scene(SEGMENTS)?, without_chance(Sequence::Grid, 2));
    let errors = convergence(
        &scene,
        &options,
        1,
        &probes(&RING),
        &[1 << 12, 1 << 18],
        1..5,
    )?;
    assert!(
        errors[1].error < 2e-3 && errors[1].error < errors[0].error / 8.0,
        "{errors:?}"
    );
    Ok(())
}

#[test]
fn a_slightly_wrong_ring_is_told_apart() -> Result<(), TestError> {
    let options = TraceOptions {
        photons: 1 << 18,
        ..without_chance(Sequence::Halton, 2)
    };
    let map = trace(&RING.scene(SEGMENTS)?, &options)?;
    let photons = reflected_inside(&map.photons);
    assert!(probes(&RING).error(&photons) < 2e-3);
    // A metal brighter by 2.5 %, a wall 2 cm higher, half a degree off.
    let brighter = MirrorCylinder { f0: 0.82, ..RING };
    assert!(probes(&brighter).error(&photons) > 1e-2);
    let higher = MirrorCylinder {
        height: 0.92,
        ..RING
    };
    assert!(probes(&higher).error(&photons) > 1e-2);
    let lower_sun = MirrorCylinder {
        angle: 0.81,
        ..RING
    };
    assert!(probes(&lower_sun).error(&photons) > 5e-3);
    Ok(())
}

#[test]
fn nearest_photons_give_the_irradiance() -> Result<(), TestError> {
    let options = TraceOptions {
        photons: 1 << 19,
        ..without_chance(Sequence::Halton, 2)
    };
    let map = trace(&RING.scene(SEGMENTS)?, &options)?;
    let photons = reflected_inside(&map.photons);
    let estimate = NearestEstimate::new(
        &photons,
        &NearestOptions {
            count: 400,
            ..NearestOptions::default()
        },
    )?;
    let mut scratch = NearestScratch::new();
    let mut worst = 0.0f64;
    // On both sides of the nephroid and inside it, away from it and from the ends of the light.
    for (x, z) in [
        (0.2, 0.0),
        (0.35, -0.05),
        (0.4, 0.1),
        (0.7, 0.0),
        (0.8, 0.03),
        (0.75, -0.02),
    ] {
        let exact = RING.irradiance_at(DVec2::new(x, z));
        let position = Vec3::new(x as f32, 0.0, z as f32);
        let found = f64::from(estimate.irradiance(position, Vec3::Y, &mut scratch).x);
        println!(
            "({x}, {z}): {exact:.3} W/m², off by {:+.1e}",
            found / exact - 1.0
        );
        worst = worst.max((found / exact - 1.0).abs());
    }
    assert!(worst < 0.04, "{worst}");
    Ok(())
}
