//! Still water and a plate of glass: the irradiance below is the transmittance times what falls on.

use caustics_accel::NearestScratch;
use caustics_render::{NearestEstimate, NearestOptions};
use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::{FlatWater, GlassSlab};
use caustics_trace::{Branching, TraceOptions};
use glam::{DVec2, Vec3};

const ANGLES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];

fn water(degrees: f64) -> FlatWater {
    FlatWater {
        ior: 1.33,
        half_width: 1.0,
        depth: 0.5,
        attenuation: 0.3,
        angle: degrees.to_radians(),
        sun: 2.0,
    }
}

/// The whole lit square, its four quarters and its middle.
fn probes(water: &FlatWater) -> FluxProbes {
    let (min, max) = water.lit_square();
    let (middle, half) = (0.5 * (min + max), 0.5 * (max - min));
    let corners = [
        (-1.0, -1.0, 0.0, 0.0),
        (0.0, -1.0, 1.0, 0.0),
        (-1.0, 0.0, 0.0, 1.0),
    ];
    let more = [
        (0.0, 0.0, 1.0, 1.0),
        (-0.5, -0.5, 0.5, 0.5),
        (-2.0, -2.0, 2.0, 2.0),
    ];
    FluxProbes::new(corners.into_iter().chain(more).map(|(x0, z0, x1, z1)| {
        let (low, high) = (DVec2::new(x0, z0), DVec2::new(x1, z1));
        let lit = (high.min(DVec2::ONE) - low.max(DVec2::NEG_ONE)) * half;
        let region = Region::Rectangle {
            min: middle + low * half,
            max: middle + high * half,
        };
        (region, water.irradiance() * lit.x * lit.y)
    }))
}

#[test]
fn flux_converges_at_every_angle() -> Result<(), TestError> {
    for degrees in ANGLES {
        println!("{degrees} degrees");
        let water = water(degrees);
        let (scene, probes) = (water.scene()?, probes(&water));
        let counts = [1 << 12, 1 << 15, 1 << 18];
        let errors = convergence(
            &scene,
            &without_chance(Sequence::Halton, 3),
            1,
            &probes,
            &counts,
            0..4,
        )?;
        assert!(errors[2].error < 1e-3, "{:?}", errors[2]);
        assert!(errors[2].error < errors[0].error / 8.0, "{errors:?}");
        assert!(errors[1].error < errors[0].error, "{errors:?}");
    }
    Ok(())
}

/// The aimed domain is the sheet and a margin of one part in 5000 on either side, into which no
/// point of a square grid falls before it has thousands of rows: the sheet is so much too bright.
#[test]
fn a_grid_along_the_edges_is_off_by_the_margin_of_aim() -> Result<(), TestError> {
    let water = water(30.0);
    let map = trace(
        &water.scene()?,
        &TraceOptions {
            photons: 1 << 18,
            ..without_chance(Sequence::Grid, 3)
        },
    )?;
    assert!(probes(&water).error(&map.photons) < 1e-3);
    Ok(())
}

#[test]
fn one_part_in_two_hundred_is_told_apart() -> Result<(), TestError> {
    let water = water(60.0);
    let map = trace(
        &water.scene()?,
        &TraceOptions {
            photons: 1 << 18,
            ..without_chance(Sequence::Halton, 3)
        },
    )?;
    assert!(probes(&water).error(&map.photons) < 1e-3);
    assert!(probes(&water).scaled(1.005).error(&map.photons) > 3e-3);
    let without_cosine = water.irradiance() / water.angle.cos();
    let wrong = probes(&water).scaled(without_cosine / water.irradiance());
    assert!(wrong.error(&map.photons) > 0.1);
    Ok(())
}

#[test]
fn nearest_photons_give_the_irradiance() -> Result<(), TestError> {
    for degrees in ANGLES {
        let water = water(degrees);
        let map = trace(
            &water.scene()?,
            &TraceOptions {
                photons: 1 << 18,
                ..without_chance(Sequence::Halton, 3)
            },
        )?;
        let options = NearestOptions {
            count: 400,
            ..NearestOptions::default()
        };
        let estimate = NearestEstimate::new(&map.photons, &options)?;
        let mut scratch = NearestScratch::new();
        let (min, max) = water.lit_square();
        let mut worst = 0.0f64;
        for (u, v) in [(0.5, 0.5), (0.3, 0.7), (0.75, 0.25), (0.4, 0.2)] {
            let at = min + (max - min) * DVec2::new(u, v);
            let position = Vec3::new(at.x as f32, 0.0, at.y as f32);
            let found = estimate.irradiance(position, Vec3::Y, &mut scratch);
            worst = worst.max((f64::from(found.x) / water.irradiance() - 1.0).abs());
        }
        println!("{degrees} degrees: irradiance off by {worst:.2e}");
        assert!(worst < 0.02, "{degrees} degrees: {worst}");
    }
    Ok(())
}

#[test]
fn a_plate_sends_a_geometric_series() -> Result<(), TestError> {
    let slab = GlassSlab {
        ior: 2.4,
        width: 1.0,
        sun: 3.0,
    };
    let scene = slab.scene()?;
    let options = TraceOptions {
        photons: 1 << 16,
        ..without_chance(Sequence::Halton, 32)
    };
    let map = trace(&scene, &options)?;
    for events in [2, 4, 6, 8] {
        let counted = map.photons.iter().filter(|photon| photon.events == events);
        let flux = Region::Everything.flux(counted);
        let ratio = flux / slab.flux_after(events);
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio} after {events} events");
    }
    let total = Region::Everything.flux(&map.photons);
    assert!((total / slab.flux() - 1.0).abs() < 1e-3);
    // An odd number of events cannot come out below, and the first pass is not everything.
    assert!(map.photons.iter().all(|photon| photon.events % 2 == 0));
    assert!((total / slab.flux_after(2) - 1.0).abs() > 0.02);
    Ok(())
}

#[test]
fn roulette_agrees_with_splitting_within_its_noise() -> Result<(), TestError> {
    let slab = GlassSlab {
        ior: 2.4,
        width: 1.0,
        sun: 3.0,
    };
    let scene = slab.scene()?;
    for branching in [Branching::Roulette, Branching::SplitFirst] {
        let photons = 1 << 17;
        let map = trace(
            &scene,
            &TraceOptions {
                photons,
                branching,
                sequence: Sequence::Halton,
                ..TraceOptions::default()
            },
        )?;
        // A binomial of the photons that meet the plate; a fifth of its flux does not come out.
        let met = map.photons.len() as f64 / (slab.flux() / 3.0);
        let deviation = 4.0 * (0.25 / met).sqrt();
        let ratio = Region::Everything.flux(&map.photons) / slab.flux();
        println!(
            "{branching:?}: off by {:.1e} of {deviation:.1e}",
            ratio - 1.0
        );
        assert!(
            (ratio - 1.0).abs() < deviation && deviation < 0.02,
            "{branching:?}: {ratio}"
        );
    }
    Ok(())
}
