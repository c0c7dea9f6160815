//! Footprints on receivers that curve, against exact pictures: followed along the light, and as plain
//! planes.

use caustics_tests::TestError;
use caustics_tests::pictures::{ExactPicture, on_plain_plane};

/// The relMSE as the library has it, and of plain planes.
fn errors(picture: &ExactPicture, power: u32) -> Result<[f64; 2], TestError> {
    let estimates = picture.estimated_from(1 << power, 0, [|photon| photon, on_plain_plane])?;
    let errors = estimates.map(|estimate| picture.error(&estimate).relative_mse);
    println!("{} 2^{power}: {errors:?}", picture.name);
    Ok(errors)
}

#[test]
fn ripples_have_a_fifth_of_the_plain_planes_error_and_less() -> Result<(), TestError> {
    let picture = ExactPicture::ripples_in_sun(30.0)?;
    // Footprints that are read at the middles of pixels, and ones that are integrated over them.
    let mut before = f64::INFINITY;
    for power in [12, 14, 16] {
        let [followed, plain] = errors(&picture, power)?;
        assert!(followed < 0.2 * plain, "2^{power}: {followed}, {plain}");
        assert!(followed < before, "2^{power}: {followed}, before {before}");
        before = followed;
    }
    Ok(())
}

#[test]
fn a_receiver_that_hardly_curves_is_as_well_a_plain_plane() -> Result<(), TestError> {
    for curvature in [1.0, -1.0] {
        let picture = ExactPicture::curved_under_lens(curvature)?;
        let [followed, plain] = errors(&picture, 14)?;
        let off = (followed / plain - 1.0).abs();
        assert!(off < 0.1, "{curvature}: {followed}, {plain}");
    }
    Ok(())
}
