//! A glass ball in a parallel beam: flux and irradiance against the map of one dimension.

use caustics_accel::NearestScratch;
use caustics_render::{NearestEstimate, NearestOptions};
use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::{RadialLens, SphereLens};
use caustics_trace::{Photon, TraceOptions};
use glam::{DVec2, Vec3};
use std::f64::consts::TAU;

/// Nearer than the paraxial focus, at 1.5: three rays land inside a bright edge, one outside.
const FOLDED: SphereLens = SphereLens {
    radius: 1.0,
    ior: 1.5,
    floor_distance: 1.2,
    irradiance: 2.0,
};

/// Behind the focus, where every ray has crossed the axis and none meet again.
const CROSSED: SphereLens = SphereLens {
    floor_distance: 2.2,
    ..FOLDED
};

fn discs(lens: &SphereLens, radii: &[f64]) -> FluxProbes {
    let disc = |&radius| {
        (
            Region::Disc {
                center: DVec2::ZERO,
                radius,
            },
            lens.flux_within(radius),
        )
    };
    FluxProbes::new(radii.iter().map(disc))
}

#[test]
fn flux_in_discs_converges() -> Result<(), TestError> {
    for (lens, radii) in [
        (FOLDED, [0.05, 0.1, 0.3, 1.0]),
        (CROSSED, [0.1, 0.3, 0.6, 1.5]),
    ] {
        println!("{} below the centre", lens.floor_distance);
        let counts = [1 << 12, 1 << 14, 1 << 16, 1 << 18];
        let probes = discs(&lens, &radii);
        let errors = convergence(
            &lens.scene()?,
            &without_chance(Sequence::Halton, 3),
            2,
            &probes,
            &counts,
            0..4,
        )?;
        assert!(errors[3].error < 1e-3, "{errors:?}");
        assert!(errors[3].error < errors[0].error / 8.0, "{errors:?}");
        assert!(
            errors.windows(2).all(|pair| pair[1].error < pair[0].error),
            "{errors:?}"
        );
    }
    Ok(())
}

#[test]
fn a_slightly_wrong_ball_is_told_apart() -> Result<(), TestError> {
    let map = trace(
        &FOLDED.scene()?,
        &TraceOptions {
            photons: 1 << 18,
            ..without_chance(Sequence::Halton, 3)
        },
    )?;
    let refracted: Vec<Photon> = map
        .photons
        .iter()
        .filter(|photon| photon.events == 2)
        .copied()
        .collect();
    let radii = [0.05, 0.1, 0.3, 1.0];
    assert!(discs(&FOLDED, &radii).error(&refracted) < 1e-3);
    let denser = SphereLens {
        ior: 1.505,
        ..FOLDED
    };
    assert!(discs(&denser, &radii).error(&refracted) > 5e-3);
    let lower = SphereLens {
        floor_distance: 1.205,
        ..FOLDED
    };
    assert!(discs(&lower, &radii).error(&refracted) > 5e-3);
    // Light reflected at the ball's outside is no part of it.
    assert!(map.photons.iter().any(|photon| photon.events == 1));
    Ok(())
}

#[test]
fn nearest_photons_give_the_irradiance() -> Result<(), TestError> {
    let radii = [(FOLDED, [0.05, 0.12, 0.3]), (CROSSED, [0.2, 0.4, 0.6])];
    for (lens, radii) in radii {
        let map = trace(
            &lens.scene()?,
            &TraceOptions {
                photons: 1 << 19,
                ..without_chance(Sequence::Halton, 3)
            },
        )?;
        let refracted: Vec<Photon> = map
            .photons
            .iter()
            .filter(|photon| photon.events == 2)
            .copied()
            .collect();
        let options = NearestOptions {
            count: 400,
            ..NearestOptions::default()
        };
        let estimate = NearestEstimate::new(&refracted, &options)?;
        let mut scratch = NearestScratch::new();
        for radius in radii {
            let exact = lens.irradiance_at(radius);
            // Mean over the circle, and the worst place on it.
            let (mut sum, mut worst) = (0.0, 0.0f64);
            for step in 0..16 {
                let at = radius * DVec2::from_angle(0.1 + f64::from(step) * TAU / 16.0);
                let position = Vec3::new(at.x as f32, -lens.floor_distance as f32, at.y as f32);
                let found = estimate.irradiance(position, Vec3::Y, &mut scratch);
                let ratio = f64::from(found.x) / exact;
                sum += ratio;
                worst = worst.max((ratio - 1.0).abs());
            }
            let mean = sum / 16.0 - 1.0;
            println!(
                "{} below, at {radius}: {exact:.3} W/m², mean {mean:+.1e}, worst {worst:.1e}",
                lens.floor_distance
            );
            // The mean is off where the irradiance bends within the estimate's disc.
            assert!(
                mean.abs() < 0.015 && worst < 0.05,
                "at {radius}: {mean}, {worst}"
            );
        }
    }
    Ok(())
}
