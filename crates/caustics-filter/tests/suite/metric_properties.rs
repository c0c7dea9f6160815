//! Error metrics against hand values, limits and brute force.

use approx::assert_relative_eq;
use caustics_filter::{
    Comparison, Image, MetricError, absolute_errors, energy_ratio, percentile, relative_errors,
    relative_mse, rmse, trimmed_mean,
};
use proptest::prelude::*;

fn image(width: u32, height: u32, pixels: &[[f32; 3]]) -> Image {
    Image::from_pixels(width, height, pixels.to_vec()).expect("a valid image")
}

#[test]
fn hand_values() {
    // Mean of the reference 1.5, floor (0.15)^2 = 0.0225.
    let reference = image(2, 1, &[[1.0, 2.0, 0.0], [3.0, 0.0, 3.0]]);
    let test = image(2, 1, &[[1.0, 1.0, 0.0], [3.0, 0.5, 4.0]]);
    let pixel_0 = 1.0 / 4.0225 / 3.0;
    let pixel_1 = (0.25 / 0.0225 + 1.0 / 9.0225) / 3.0;
    let found = Comparison::new(&test, &reference).unwrap();
    assert_relative_eq!(found.energy_ratio, 9.5 / 9.0);
    assert_relative_eq!(found.rmse, (2.25_f64 / 6.0).sqrt());
    assert_relative_eq!(found.rmse_relative, (2.25_f64 / 6.0).sqrt() / 1.5);
    assert_relative_eq!(
        found.relative_mse,
        (pixel_0 + pixel_1) / 2.0,
        max_relative = 1e-12
    );
    // One of two pixels stays, as 1 % of two rounds up to one.
    assert_relative_eq!(found.relative_mse_trimmed, pixel_0, max_relative = 1e-12);
    // Mean absolute differences 1/3 and 1/2; 0.999 of the way from one to the other.
    assert_relative_eq!(found.p999, 1.0 / 3.0 + 0.999 / 6.0, max_relative = 1e-12);
    assert_relative_eq!(found.p999_relative, found.p999 / 1.5);
    assert_eq!(found.non_finite, 0);
}

#[test]
fn non_finite_values_of_the_test_count_as_zero() {
    let reference = image(2, 1, &[[1.0; 3]; 2]);
    let broken = image(
        2,
        1,
        &[
            [f32::NAN, f32::INFINITY, 1.0],
            [1.0, f32::NEG_INFINITY, 1.0],
        ],
    );
    let zeroed = image(2, 1, &[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]);
    let found = Comparison::new(&broken, &reference).unwrap();
    assert_eq!(found.non_finite, 3);
    assert_eq!(
        Comparison {
            non_finite: 0,
            ..found
        },
        Comparison::new(&zeroed, &reference).unwrap()
    );
}

#[test]
fn what_cannot_be_compared_is_an_error() {
    let lit = image(2, 1, &[[1.0; 3]; 2]);
    let tall = image(1, 2, &[[1.0; 3]; 2]);
    let black = image(2, 1, &[[0.0; 3]; 2]);
    let broken = image(2, 1, &[[1.0, f32::NAN, f32::INFINITY], [1.0; 3]]);
    for metric in [energy_ratio, rmse, relative_mse] {
        assert!(matches!(metric(&tall, &lit), Err(MetricError::Size { .. })));
        let error = metric(&lit, &broken).unwrap_err();
        assert_eq!(error, MetricError::NonFiniteReference { count: 2 });
    }
    for metric in [energy_ratio, relative_mse] {
        assert_eq!(metric(&lit, &black), Err(MetricError::BlackReference));
    }
    assert_eq!(
        Comparison::new(&lit, &black),
        Err(MetricError::BlackReference)
    );
    assert_eq!(rmse(&lit, &black), Ok(1.0));
    assert_eq!(absolute_errors(&lit, &black), Ok(vec![1.0; 2]));
}

#[test]
fn percentiles_interpolate() {
    let values = [4.0, 1.0, 2.0, 3.0];
    for (percent, expected) in [
        (0.0, 1.0),
        (50.0, 2.5),
        (100.0, 4.0),
        (90.0, 3.7),
        (-5.0, 1.0),
        (200.0, 4.0),
    ] {
        assert_relative_eq!(percentile(&values, percent), expected, max_relative = 1e-12);
    }
    assert_eq!(percentile(&[7.0], 99.9), 7.0);
    assert!(percentile(&[], 50.0).is_nan());
}

#[test]
fn trimming_drops_the_largest() {
    let values: Vec<f64> = (0..200).map(|i| if i == 77 { 1e9 } else { 1.0 }).collect();
    assert_eq!(trimmed_mean(&values, 0.01), 1.0);
    assert_relative_eq!(trimmed_mean(&values, 0.0), (1e9 + 199.0) / 200.0);
    assert_eq!(trimmed_mean(&[5.0, 3.0], 1.0), 3.0);
    assert!(trimmed_mean(&[], 0.01).is_nan());
}

fn pair() -> impl Strategy<Value = (Image, Image)> {
    (1_u32..12, 1_u32..12).prop_flat_map(|(width, height)| {
        let count = (width * height) as usize;
        let pixels = || prop::collection::vec(prop::array::uniform3(0.0_f32..100.0), count);
        (pixels(), pixels())
            .prop_map(move |(a, b)| (image(width, height, &a), image(width, height, &b)))
    })
}

proptest! {
    #[test]
    fn an_image_equals_itself((image, _) in pair()) {
        prop_assume!(image.mean() > 0.0);
        let found = Comparison::new(&image, &image).unwrap();
        prop_assert_eq!(found.energy_ratio, 1.0);
        prop_assert_eq!((found.rmse, found.relative_mse, found.p999), (0.0, 0.0, 0.0));
    }

    #[test]
    fn relative_measures_do_not_depend_on_the_unit((test, reference) in pair(), power in -20..20) {
        prop_assume!(reference.mean() > 0.0);
        // A power of two scales exactly, unless the result is subnormal.
        let scale = 2.0_f32.powi(power);
        let scaled = |image: &Image| {
            let pixels: Vec<_> = image.pixels().iter().map(|p| p.map(|v| v * scale)).collect();
            self::image(image.width(), image.height(), &pixels)
        };
        let plain = Comparison::new(&test, &reference).unwrap();
        let other = Comparison::new(&scaled(&test), &scaled(&reference)).unwrap();
        assert_relative_eq!(plain.relative_mse, other.relative_mse, max_relative = 1e-9);
        assert_relative_eq!(plain.rmse_relative, other.rmse_relative, max_relative = 1e-9);
        assert_relative_eq!(plain.energy_ratio, other.energy_ratio, max_relative = 1e-9);
        assert_relative_eq!(plain.p999_relative, other.p999_relative, max_relative = 1e-9);
    }

    #[test]
    fn trimming_never_raises_and_errors_average_to_the_mean((test, reference) in pair()) {
        prop_assume!(reference.mean() > 0.0);
        let errors = relative_errors(&test, &reference).unwrap();
        let mean = relative_mse(&test, &reference).unwrap();
        prop_assert!(trimmed_mean(&errors, 0.01) <= mean * (1.0 + 1e-12));
        assert_relative_eq!(
            errors.iter().sum::<f64>() / errors.len() as f64, mean, max_relative = 1e-12
        );
        prop_assert!(percentile(&errors, 100.0) >= mean);
    }
}
