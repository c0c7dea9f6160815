//! What it is worth to send photons where their footprints would be wide: glass balls and a box, against an
//! independent tracer's pictures.

use caustics::accel::BvhOptions;
use caustics::filter::Comparison;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::scene::World;
use caustics::trace::{TraceOptions, trace_photons};
use caustics_tests::{TestError, gallery};

const SIZE: u32 = 512;

#[test]
fn the_same_number_of_photons_errs_less() -> Result<(), TestError> {
    for (name, least) in [
        ("p01_sphere", 0.5),
        ("p02_sphere_box", 0.5),
        ("p04_sphere_in_box", 0.75),
    ] {
        let scene = gallery::load(name)?;
        let reference = gallery::reference(name, 1)?;
        let world = World::new(&scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        let buffer = GBuffer::new(&world, &rays, &scene.cameras()[0], SIZE, SIZE)?;
        let draw = |guide_emission: bool| -> Result<Comparison, TestError> {
            let options = TraceOptions {
                photons: 1 << 16,
                guide_emission,
                ..TraceOptions::default()
            };
            let map = trace_photons(&world, &rays, &options, &|_| {})?;
            let (picture, _) = splat(&buffer, &map.photons, &FootprintOptions::default())?;
            Ok(Comparison::new(&picture, &reference)?)
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
