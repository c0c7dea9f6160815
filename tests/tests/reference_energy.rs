//! Pictures of the glTF scenes hold as much caustic as an independent tracer's.

use caustics::prelude::*;
use caustics_filter::{Comparison, read_exr};
use caustics_tests::{TestError, gallery};

const SIZE: u32 = 64;

fn picture(name: &str, visibility: Visibility) -> Result<Image, TestError> {
    let scene = gallery::load(name)?;
    let trace = TraceOptions {
        photons: 1 << 19,
        branching: Branching::SplitFirst,
        ..TraceOptions::default()
    };
    let caustics = Caustics::new(
        &scene,
        &CausticsOptions {
            trace,
            ..CausticsOptions::default()
        },
    )?;
    let options = PictureOptions {
        width: SIZE,
        height: SIZE,
        samples: 16,
        visibility,
        ..PictureOptions::default()
    };
    Ok(caustics.render(&scene.cameras()[0], &options)?.caustics)
}

#[test]
fn caustics_have_the_energy_of_the_references() -> Result<(), TestError> {
    for (name, visibility, reference) in [
        ("p03_cognac", Visibility::Direct, "p03_cognac"),
        ("p05_brass_ring", Visibility::Direct, "p05_brass_ring"),
        ("p10_torus_cube", Visibility::Direct, "p10_torus_cube"),
        ("p10_torus_cube", Visibility::Full, "p10_torus_cube_full"),
    ] {
        let reference = read_exr(gallery::path(&format!("reference/{reference}.exr")))?;
        let picture = picture(name, visibility)?;
        let comparison = Comparison::new(&picture, &reference)?;
        // Without the silhouettes, where a pixel is partly of something else.
        let (ratio, error) = (comparison.energy_ratio, comparison.relative_mse_trimmed);
        println!("{name} {visibility:?}: energy {ratio:.4}, relative error {error:.2e}");
        assert!((ratio - 1.0).abs() < 0.02, "{name} {visibility:?}: {ratio}");
        // The light is also in its place: a picture upside down is far off.
        assert!(error < 0.02, "{name} {visibility:?}: {error}");
        let mut flipped = picture.into_pixels();
        flipped.reverse();
        let flipped = Image::from_pixels(SIZE, SIZE, flipped)?;
        assert!(
            Comparison::new(&flipped, &reference)?.relative_mse_trimmed > 0.5,
            "{name}"
        );
    }
    Ok(())
}
