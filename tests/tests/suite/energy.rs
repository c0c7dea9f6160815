//! Every watt is booked once, and the caustic is as bright however it is sampled.

use caustics_accel::BvhOptions;
use caustics_sampling::Sequence;
use caustics_scene::World;
use caustics_tests::measure::trace;
use caustics_tests::{TestError, gallery};
use caustics_trace::glam::Vec3;
use caustics_trace::{Aim, Branching, Fate, TraceOptions, trace_photons};

const BRANCHINGS: [Branching; 3] = [
    Branching::Roulette,
    Branching::SplitFirst,
    Branching::SplitAll,
];

const AIMS: [Aim; 2] = [Aim::Everywhere, Aim::Casters];

fn ways() -> impl Iterator<Item = (Branching, Aim)> {
    BRANCHINGS
        .into_iter()
        .flat_map(|branching| AIMS.map(|aim| (branching, aim)))
}

#[test]
fn the_ledger_balances() -> Result<(), TestError> {
    let names = gallery::names()?;
    assert!(names.len() >= 3, "{names:?}");
    for name in names {
        let world = World::new(&gallery::load(&name)?)?;
        let intersector = world.intersector(&BvhOptions::default())?;
        let mut worst = 0.0f64;
        for (branching, aim) in ways() {
            let options = TraceOptions {
                photons: 1 << 13,
                branching,
                aim,
                ..TraceOptions::default()
            };
            let ledger = trace_photons(&world, &intersector, &options, &|_| {})?.ledger;
            worst = worst.max(ledger.imbalance());
            assert!(
                ledger.imbalance() < 1e-9,
                "{name} {branching:?} {aim:?}: {ledger:?}"
            );
            assert!(ledger.entry(Fate::Stored).count > 20, "{name}: {ledger:?}");
            assert_eq!(ledger.entry(Fate::Invalid).count, 0, "{name}: {ledger:?}");
        }
        println!("{name}: imbalance {worst:.1e}");
    }
    Ok(())
}

#[test]
fn a_ledger_that_does_not_balance_is_seen() -> Result<(), TestError> {
    let options = TraceOptions {
        photons: 1 << 10,
        ..TraceOptions::default()
    };
    let mut ledger = trace(&gallery::load("p03_cognac")?, &options)?.ledger;
    assert!(ledger.imbalance() < 1e-9);
    // A thousandth of what was emitted, booked a second time.
    let again = ledger.emitted().flux.as_vec3() * 1e-3;
    ledger.book(Fate::Stored, Vec3::new(0.0, again.y, 0.0));
    assert!(
        (ledger.imbalance() / 1e-3 - 1.0).abs() < 0.01,
        "{}",
        ledger.imbalance()
    );
    Ok(())
}

/// Stored flux in watts, summed over the channels: mean and standard error over seeds.
fn stored(name: &str, options: &TraceOptions, seeds: u32) -> Result<(f64, f64), TestError> {
    let scene = gallery::load(name)?;
    let mut values = Vec::new();
    for seed in 1..=seeds {
        let map = trace(
            &scene,
            &TraceOptions {
                seed: u64::from(seed),
                ..*options
            },
        )?;
        values.push(map.ledger.entry(Fate::Stored).flux.element_sum());
    }
    let count = f64::from(seeds);
    let mean = values.iter().sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / (count - 1.0);
    Ok((mean, (variance / count).sqrt()))
}

#[test]
fn the_caustic_is_as_bright_for_every_aim_and_branching() -> Result<(), TestError> {
    let (all, one) = (Branching::SplitAll, Branching::Roulette);
    let (wide, narrow) = (Aim::Everywhere, Aim::Casters);
    for name in [
        "p03_cognac",
        "p04_sphere_in_box",
        "p05_brass_ring",
        "p06_wave_plane",
        "p09_cornell",
        "p10_torus_cube",
    ] {
        let options = TraceOptions {
            photons: 1 << 16,
            sequence: Sequence::Halton,
            branching: all,
            aim: narrow,
            ..TraceOptions::default()
        };
        let (flux, error) = stored(name, &options, 8)?;
        println!("{name}: {flux:.4} W +- {:.1e}", error / flux);
        for (branching, aim) in [
            (one, narrow),
            (Branching::SplitFirst, narrow),
            (all, wide),
            (one, wide),
        ] {
            let options = TraceOptions {
                branching,
                aim,
                ..options
            };
            let (other, other_error) = stored(name, &options, 8)?;
            let difference = (other - flux) / flux;
            let deviation = error.hypot(other_error) / flux;
            println!("{branching:?} {aim:?}: {difference:+.1e} +- {deviation:.1e}");
            assert!(
                difference.abs() < 5.0 * deviation.max(2e-4),
                "{name} {branching:?} {aim:?}"
            );
            // Most photons that are aimed at nothing miss everything; a part in thirty of the flux
            // would still have been seen, and one in two hundred of aimed photons.
            let limit = if aim == wide { 6e-3 } else { 1e-3 };
            assert!(
                deviation < limit,
                "{name} {branching:?} {aim:?}: {deviation}"
            );
        }
    }
    Ok(())
}
