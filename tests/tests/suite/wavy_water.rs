//! Waves over a receiver: flux in squares against the inverted map, and against its own density
//! where it folds.

use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::WavyWater;
use caustics_trace::TraceOptions;
use glam::DVec2;

/// Half the width of the part of the receiver that is looked at, away from the surface's edges.
const HALF: f64 = 0.75;

/// Squares that it is cut into, each way.
const CELLS: usize = 12;

fn squares() -> impl Iterator<Item = (DVec2, DVec2)> {
    let width = 2.0 * HALF / CELLS as f64;
    (0..CELLS * CELLS).map(move |index| {
        let min = DVec2::new((index % CELLS) as f64, (index / CELLS) as f64) * width - HALF;
        (min, min + width)
    })
}

fn inverted(water: &WavyWater) -> FluxProbes {
    let flux = |(min, max)| (Region::Rectangle { min, max }, water.flux(min, max));
    FluxProbes::new(squares().map(flux))
}

fn binned(water: &WavyWater) -> FluxProbes {
    let bins = water.binned_flux(HALF, CELLS, 2000);
    let regions = squares().map(|(min, max)| Region::Rectangle { min, max });
    FluxProbes::new(regions.zip(bins))
}

#[test]
fn flux_in_squares_converges_without_folds() -> Result<(), TestError> {
    let water = WavyWater::with_strength(1.0);
    let scene = water.scene(512)?;
    let counts = [1 << 12, 1 << 14, 1 << 16, 1 << 18];
    let errors = convergence(
        &scene,
        &without_chance(Sequence::Halton, 2),
        1,
        &inverted(&water),
        &counts,
        0..2,
    )?;
    assert!(errors[3].error < 1e-2, "{errors:?}");
    assert!(errors[3].error < errors[0].error / 8.0, "{errors:?}");
    assert!(
        errors.windows(2).all(|pair| pair[1].error < pair[0].error),
        "{errors:?}"
    );
    Ok(())
}

#[test]
fn flux_in_squares_converges_with_folds() -> Result<(), TestError> {
    let water = WavyWater::with_strength(3.0);
    let scene = water.scene(512)?;
    let counts = [1 << 12, 1 << 15, 1 << 18];
    let errors = convergence(
        &scene,
        &without_chance(Sequence::Halton, 2),
        1,
        &binned(&water),
        &counts,
        0..2,
    )?;
    assert!(errors[2].error < 1.5e-2, "{errors:?}");
    assert!(errors[2].error < errors[0].error / 8.0, "{errors:?}");
    Ok(())
}

#[test]
fn slightly_wrong_water_is_told_apart() -> Result<(), TestError> {
    let water = WavyWater::with_strength(1.0);
    let map = trace(
        &water.scene(512)?,
        &TraceOptions {
            photons: 1 << 18,
            ..without_chance(Sequence::Halton, 2)
        },
    )?;
    let right = inverted(&water).error(&map.photons);
    let higher = inverted(&WavyWater::with_strength(1.1)).error(&map.photons);
    assert!(right < 1e-2 && higher > 2.0 * right, "{right} and {higher}");
    Ok(())
}

/// The caustic is a contrast worth measuring: still water would fail these tests.
#[test]
fn waves_are_not_still_water() {
    let water = WavyWater::with_strength(1.0);
    let flux: Vec<f64> = squares().map(|(min, max)| water.flux(min, max)).collect();
    let brightest = flux.iter().copied().fold(0.0, f64::max);
    let darkest = flux.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(brightest > 1.2 * darkest, "{brightest} and {darkest}");
}
