//! Where sheets of light end: dividing the last photons of a lattice's rows against an independent
//! tracer's pictures.

use caustics::trace::TraceOptions;
use caustics_tests::TestError;
use caustics_tests::scored::ScoredScene;

#[test]
fn divided_photons_have_less_than_half_the_error_where_light_ends_in_the_dark()
-> Result<(), TestError> {
    for name in ["p01_sphere", "p05_brass_ring", "p10_torus_cube"] {
        let scene = ScoredScene::load(name)?;
        let error = |divide_edges: bool| -> Result<(f64, u64), TestError> {
            let options = TraceOptions {
                photons: 1 << 16,
                divide_edges,
                ..TraceOptions::default()
            };
            let map = scene.trace(&options)?;
            let error = scene.score(&scene.picture(&map.photons)?)?.relative_mse;
            Ok((error, map.ledger.rays))
        };
        let ((divided, more_rays), (whole, rays)) = (error(true)?, error(false)?);
        println!("{name}: {divided:.2e} for {whole:.2e}");
        assert!(divided < 0.5 * whole, "{name}: {divided} for {whole}");
        // At less than twice the rays.
        assert!(more_rays < 2 * rays, "{name}: {more_rays} for {rays}");
    }
    Ok(())
}
