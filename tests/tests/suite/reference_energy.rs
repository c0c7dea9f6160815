//! Pictures of the glTF scenes hold as much caustic as an independent tracer's.

use caustics::prelude::*;
use caustics_filter::Comparison;
use caustics_tests::{TestError, gallery};

/// Pixels of the references that one of ours covers, each way.
const FACTOR: u32 = 8;

const SIZE: u32 = 512 / FACTOR;

fn picture(name: &str, visibility: Visibility) -> Result<Image, TestError> {
    let scene = gallery::load(name)?;
    let mut options = CausticsOptions::default();
    options.trace.photons = 1 << 18;
    let caustics = Caustics::new(&scene, &options)?;
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
    let mut pairs: Vec<(String, Visibility, String)> = gallery::names()?
        .into_iter()
        .map(|name| (name.clone(), Visibility::Direct, name))
        .collect();
    assert_eq!(pairs.len(), 10);
    pairs.extend(
        ["p01_sphere", "p08_square", "p10_torus_cube"]
            .map(|name| (name.to_owned(), Visibility::Full, format!("{name}.full"))),
    );
    let mut wrong = Vec::new();
    for (name, visibility, reference) in pairs {
        let reference = gallery::reference(&reference, FACTOR)?;
        let picture = picture(&name, visibility)?;
        let comparison = Comparison::new(&picture, &reference)?;
        // Without the silhouettes, where a pixel is partly of something else.
        let (ratio, error) = (comparison.energy_ratio, comparison.relative_mse_trimmed);
        // The light is also in its place: a picture turned over is much farther off.
        let mut turned = picture.into_pixels();
        turned.reverse();
        let turned = Image::from_pixels(SIZE, SIZE, turned)?;
        let turned = Comparison::new(&turned, &reference)?.relative_mse_trimmed;
        println!(
            "{name} {visibility:?}: energy {ratio:.4}, error {error:.1e}, turned {turned:.1e}"
        );
        let (is_as_bright, is_in_place) = ((ratio - 1.0).abs() < 0.02, error < 0.1 * turned);
        if !(is_as_bright && is_in_place) {
            wrong.push(format!(
                "{name} {visibility:?}: {ratio}, {error}, turned over {turned}"
            ));
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
    Ok(())
}
