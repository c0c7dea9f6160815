//! A plano-convex lens of triangles: flux in discs against the map of one dimension.

use caustics_sampling::Sequence;
use caustics_tests::TestError;
use caustics_tests::measure::{FluxProbes, Region, convergence, trace, without_chance};
use caustics_tests::oracles::{PlanoConvexLens, RadialLens};
use caustics_trace::TraceOptions;
use glam::DVec2;

/// Half way to the focus, which is at 2.
const LENS: PlanoConvexLens = PlanoConvexLens {
    curvature_radius: 1.0,
    aperture: 0.5,
    ior: 1.5,
    floor_distance: 0.9,
    irradiance: 2.0,
};

fn probes(lens: &PlanoConvexLens) -> FluxProbes {
    let disc = |radius| {
        (
            Region::Disc {
                center: DVec2::ZERO,
                radius,
            },
            lens.flux_within(radius),
        )
    };
    FluxProbes::new([0.05, 0.1, 0.15, 0.2, 1.0].map(disc))
}

#[test]
fn flux_in_discs_converges() -> Result<(), TestError> {
    let scene = LENS.scene(128, 512)?;
    let counts = [1 << 12, 1 << 15, 1 << 18];
    let errors = convergence(
        &scene,
        &without_chance(Sequence::Halton, 3),
        2,
        &probes(&LENS),
        &counts,
        0..4,
    )?;
    assert!(errors[2].error < 2e-3, "{errors:?}");
    assert!(errors[2].error < errors[0].error / 8.0, "{errors:?}");
    Ok(())
}

#[test]
fn a_grid_converges_as_well() -> Result<(), TestError> {
    let (scene, options) = (LENS.scene(128, 512)?, without_chance(Sequence::Grid, 3));
    let errors = convergence(
        &scene,
        &options,
        2,
        &probes(&LENS),
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
fn a_slightly_wrong_lens_is_told_apart() -> Result<(), TestError> {
    let options = TraceOptions {
        photons: 1 << 18,
        ..without_chance(Sequence::Halton, 3)
    };
    let map = trace(&LENS.scene(128, 512)?, &options)?;
    let refracted = || map.photons.iter().filter(|photon| photon.events == 2);
    assert!(probes(&LENS).error(refracted()) < 2e-3);
    let denser = PlanoConvexLens { ior: 1.505, ..LENS };
    assert!(probes(&denser).error(refracted()) > 5e-3);
    let flatter = PlanoConvexLens {
        curvature_radius: 1.01,
        ..LENS
    };
    assert!(probes(&flatter).error(refracted()) > 5e-3);
    Ok(())
}
