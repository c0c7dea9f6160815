//! Where receivers end: light of a lamp with an area, in a box that is open at its front, against an
//! independent tracer's picture.

use caustics::filter::Image;
use caustics::trace::{Coverage, PhotonMap, TraceOptions};
use caustics_tests::TestError;
use caustics_tests::scored::ScoredScene;

const SIZE: u32 = 512;

/// What the camera sees of the walls' ends: a frame so many pixels wide, that far from the picture's.
const FRAME: u32 = 4;
const AWAY: u32 = 14;

/// The light in the frame, over the reference's.
fn frame(picture: &Image, reference: &Image) -> f64 {
    let sum = |image: &Image| -> f64 {
        let is_in = |pixel: u32| {
            let (x, y) = (pixel % SIZE, pixel / SIZE);
            let depth = x.min(y).min(SIZE - 1 - x).min(SIZE - 1 - y);
            (AWAY..AWAY + FRAME).contains(&depth)
        };
        let pixels = (0..).zip(image.pixels()).filter(|(index, _)| is_in(*index));
        pixels
            .map(|(_, pixel)| pixel.iter().map(|&it| f64::from(it)).sum::<f64>())
            .sum()
    };
    sum(picture) / sum(reference)
}

#[test]
fn walls_are_as_bright_at_their_ends_as_they_should_be() -> Result<(), TestError> {
    let scene = ScoredScene::load("p09_cornell")?;
    let trace = |reflect_at_boundaries: bool| -> Result<PhotonMap, TestError> {
        let options = TraceOptions {
            photons: 1 << 16,
            reflect_at_boundaries,
            ..TraceOptions::default()
        };
        scene.trace(&options)
    };
    let (with, without) = (trace(true)?, trace(false)?);

    // Images carry no light, and nothing else has changed.
    assert_eq!(with.ledger, without.ledger);
    let mut own = with.photons.clone();
    own.retain(|photon| photon.coverage != Coverage::Reflected);
    assert!(own == without.photons && own.len() < with.photons.len());

    let (reflected, plain) = (
        scene.picture(&with.photons)?,
        scene.picture(&without.photons)?,
    );
    let at_ends = [&reflected, &plain].map(|it| frame(it, &scene.reference));
    println!("at the ends {at_ends:?} of the light");
    assert!(
        (at_ends[0] - 1.0).abs() < 0.04 && at_ends[1] < 0.8,
        "{at_ends:?}"
    );
    let errors = [
        scene.score(&reflected)?.relative_mse,
        scene.score(&plain)?.relative_mse,
    ];
    println!("relMSE {errors:?}");
    assert!(errors[0] < 0.85 * errors[1], "{errors:?}");
    Ok(())
}
