//! A piece of a parabolic mirror: flux in rectangles of the receiver against its closed form.

use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::ParabolicMirror;
use caustics_trace::TraceOptions;
use glam::DVec2;

const MIRROR: ParabolicMirror = ParabolicMirror {
    focal_length: 1.0,
    near: 0.4,
    width: 1.0,
    screen_height: 1.6,
    f0: 0.8,
    sun: 3.0,
};

/// Squares of 4 mm: facets are at most 2e-6 m off the paraboloid.
const CELLS: u32 = 256;

fn probes(mirror: &ParabolicMirror) -> FluxProbes {
    let rectangles = [
        (-1.0, -0.2, -0.4, 0.2),
        (-0.6, -0.25, -0.35, 0.1),
        (-1.2, -0.1, -0.9, 0.45),
    ];
    FluxProbes::new(rectangles.map(|(x0, z0, x1, z1)| {
        let (min, max) = (DVec2::new(x0, z0), DVec2::new(x1, z1));
        (Region::Rectangle { min, max }, mirror.flux(min, max))
    }))
}

#[test]
fn flux_in_rectangles_converges() -> Result<(), TestError> {
    let scene = MIRROR.scene(CELLS)?;
    let counts = [1 << 12, 1 << 15, 1 << 18];
    let errors = convergence(
        &scene,
        &without_chance(Sequence::Halton, 2),
        1,
        &probes(&MIRROR),
        &counts,
        0..4,
    )?;
    assert!(errors[2].error < 2e-3, "{errors:?}");
    assert!(errors[2].error < errors[0].error / 8.0, "{errors:?}");
    Ok(())
}

#[test]
fn a_grid_converges_as_well() -> Result<(), TestError> {
    let (scene, options) = (MIRROR.scene(CELLS)?, without_chance(Sequence::Grid, 2));
    let errors = convergence(
        &scene,
        &options,
        1,
        &probes(&MIRROR),
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
fn a_slightly_wrong_mirror_is_told_apart() -> Result<(), TestError> {
    let options = TraceOptions {
        photons: 1 << 18,
        ..without_chance(Sequence::Halton, 2)
    };
    let map = trace(&MIRROR.scene(CELLS)?, &options)?;
    assert!(probes(&MIRROR).error(&map.photons) < 2e-3);
    let longer = ParabolicMirror {
        focal_length: 1.005,
        ..MIRROR
    };
    assert!(probes(&longer).error(&map.photons) > 5e-3);
    let duller = ParabolicMirror { f0: 0.79, ..MIRROR };
    assert!(probes(&duller).error(&map.photons) > 5e-3);
    Ok(())
}
