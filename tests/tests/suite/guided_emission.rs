//! What it is worth to send photons where their footprints would be wide: glass balls and a box, against an
//! independent tracer's pictures.

use caustics::filter::Comparison;
use caustics::trace::TraceOptions;
use caustics_tests::TestError;
use caustics_tests::scored::ScoredScene;

#[test]
fn the_same_number_of_photons_errs_less() -> Result<(), TestError> {
    for (name, least) in [
        ("p01_sphere", 0.5),
        ("p02_sphere_box", 0.5),
        ("p04_sphere_in_box", 0.75),
    ] {
        let scene = ScoredScene::load(name)?;
        let draw = |guide_emission: bool| -> Result<Comparison, TestError> {
            let options = TraceOptions {
                photons: 1 << 16,
                guide_emission,
                ..TraceOptions::default()
            };
            let map = scene.trace(&options)?;
            scene.score(&scene.picture(&map.photons)?)
        };
        let (guided, even) = (draw(true)?, draw(false)?);
        let errors = [&guided, &even].map(|it| it.relative_mse);
        println!("{name}: {errors:?}");
        assert!(errors[0] < least * errors[1], "{name}: {errors:?}");
        assert!(
            (guided.energy_ratio - 1.0).abs() < 2e-3,
            "{name}: {}",
            guided.energy_ratio
        );
    }
    Ok(())
}
